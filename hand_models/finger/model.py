"""Model of one finger: its numbers, its contacts with the rock, and the loads of its tendon.

In the finger's frame F (x along the finger, z into the rock; coordinates (x, z) here) phalanx i
points along u = (cos θ, sin θ) with its tile's normal n = (−sin θ, cos θ), and touches the rock at
``p_i + c_i u + h n``: p_i the joint, c_i the contact's distance along the phalanx, h the tile's
height. The tile drags the rock with the shear T along −u and presses it with N along n; the rock
pushes back equally, so that joint i balances when (Eq. 4, written out)

    Σ_{j ≥ i} [T_j (d_ij × u_j) − N_j (d_ij × n_j)] + f M_i r_i − K_i q_i − p_i = 0,

with d_ij from joint i to contact j, a × b = a_x b_z − a_z b_x, the tendon's tension f, the pulley
radius r_i, the joint's angle q_i and its spring K_i with preload p_i. The shear follows the tendon
alone (Eq. 5 with a tile that has caught the rock): ``T_i = M_i (τ_i f_close + g (f − f_close))``.
Solving for N gives both loads as affine functions of the tension f (Eq. 14).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal

import numpy as np

from hand_models.base import Array, InvalidInputError
from hand_models.parameters import ParameterTable

__all__ = ["JOINT_STOPS", "PHALANGES", "Contact", "FingerModel", "SettledFinger", "Stop"]

PHALANGES = ("proximal", "middle", "distal")

Stop = Literal["upper", "lower", "balance"]
"""Reason why a joint without a contact is at rest: its upper (closing) limit, its lower (opening)
limit, or a balance of tendon and spring between the limits."""

JOINT_STOPS: Final[tuple[Stop | None, ...]] = (None, "upper", "lower", "balance")
"""Values of `Contact.stop` by integer code; None if contacts support the joint."""


@dataclass(frozen=True)
class FingerModel:
    """Geometry, springs and friction of a finger; the four fingers are alike. SI units.

    Attributes
    ----------
    joint_spacing : float
        Distance from a joint to the next [m].
    tile_height, tile_centre, tile_length : float
        Height of the tile's face above the joint's axis, distance of the tile's centre from the
        joint along the phalanx, length of the tile [m].
    pulley_radii, joint_stiffness, joint_preload : tuple of float, length 3
        Pulley radius r [m], spring stiffness K [N·m/rad] and spring preload p [N·m] of each joint.
    joint_lower, joint_upper : tuple of float, length 3
        Limits of each joint's angle, relative to the phalanx before it [rad].
    engagement : tuple of float, length 3
        τ, shear of each tile over closing tension at the moment of closing.
    base_engagement : float
        τ of the tile on a rotating base.
    shear_gain : tuple of float, length 3
        g = c_p k_c / (k_c + K_p) of each tile, shear per newton of further tension (c_p strands of
        tendon, contact stiffness k_c, spring K_p); a tile on a rotating base has the proximal g.
    spine_travel : float
        Distance that spines reach out of their tile [m].
    frame_radius : float
        Radius of the bare phalanx about the line of its joints [m].
    bed_stiffness : float
        Stiffness of the bed of springs under a tile, per tile [N/m].
    friction : float
        μ of the tendon between phalanges, in M = diag(1, 1 − μ, (1 − μ)², …) (Eq. 8).
    """

    joint_spacing: float
    tile_height: float
    tile_centre: float
    tile_length: float
    pulley_radii: tuple[float, ...]
    joint_stiffness: tuple[float, ...]
    joint_preload: tuple[float, ...]
    joint_lower: tuple[float, ...]
    joint_upper: tuple[float, ...]
    engagement: tuple[float, ...]
    base_engagement: float
    shear_gain: tuple[float, ...]
    spine_travel: float
    frame_radius: float
    bed_stiffness: float
    friction: float

    @classmethod
    def from_table(cls, table: ParameterTable) -> FingerModel:
        """Build the model from ``hand.toml``.

        Raises
        ------
        InvalidInputError
            If a number is missing or impossible.
        """
        contact = np.array(table.vector("tile", "contact_stiffness"))
        spring = table.scalar("tile", "spring_stiffness")
        pulleys = table.positive("tile", "pulley_ratio")
        model = cls(
            joint_spacing=table.positive("finger", "joint_spacing"),
            tile_height=table.scalar("finger", "tile_height"),
            tile_centre=table.scalar("finger", "tile_centre"),
            tile_length=table.positive("finger", "tile_length"),
            pulley_radii=table.vector("finger", "pulley_radii"),
            joint_stiffness=table.vector("finger", "joint_stiffness"),
            joint_preload=table.vector("finger", "joint_preload"),
            joint_lower=table.vector("finger", "joint_lower"),
            joint_upper=table.vector("finger", "joint_upper"),
            engagement=table.vector("tile", "engagement"),
            base_engagement=table.scalar("tile", "base_engagement"),
            shear_gain=tuple((pulleys * contact / (contact + spring)).tolist()),
            spine_travel=table.scalar("tile", "spine_travel"),
            frame_radius=table.positive("finger", "frame_radius"),
            bed_stiffness=table.positive("tile", "bed_stiffness"),
            friction=table.scalar("tendon", "friction"),
        )
        for section, name in (
            ("finger", "pulley_radii"),
            ("finger", "joint_stiffness"),
            ("finger", "joint_preload"),
            ("finger", "joint_lower"),
            ("finger", "joint_upper"),
            ("tile", "engagement"),
            ("tile", "contact_stiffness"),
        ):
            count, size = len(PHALANGES), len(table.vector(section, name))
            if size != count:
                raise InvalidInputError(
                    f"{count} numbers are needed, got {size}", field=f"{section}.{name}"
                )
        if not 0.0 <= model.friction < 1.0:
            raise InvalidInputError(
                f"must be in [0, 1), got {model.friction:g}", field="tendon.friction"
            )
        if not contact.min() > 0.0:
            raise InvalidInputError(
                f"must be above 0 N/m, got {contact.tolist()}", field="tile.contact_stiffness"
            )
        if not min(model.pulley_radii) > 0.0:
            raise InvalidInputError(
                f"must be above 0 m, got {list(model.pulley_radii)}", field="finger.pulley_radii"
            )
        begin, end = model.tile_range
        if not 0.0 <= begin < end <= model.joint_spacing:
            raise InvalidInputError(
                f"a tile must lie on its phalanx, from 0 to {model.joint_spacing:g} m, "
                f"got {begin:g} to {end:g} m (tile_centre ± tile_length / 2)",
                field="finger.tile_centre",
            )
        for lower, upper in zip(model.joint_lower, model.joint_upper, strict=True):
            if not -math.pi <= lower < upper <= math.pi:
                raise InvalidInputError(
                    "must be above finger.joint_lower, both within half a turn, "
                    f"got {upper:g} over {lower:g} rad",
                    field="finger.joint_upper",
                )
        return model

    @property
    def reach(self) -> float:
        """Largest distance from the proximal joint at which a finger may touch anything [m]."""
        return len(self.pulley_radii) * self.joint_spacing + self.tile_height

    @property
    def tile_range(self) -> tuple[float, float]:
        """Begin and end of a tile's face, as distances along the phalanx from its joint [m]."""
        half = self.tile_length / 2.0
        return self.tile_centre - half, self.tile_centre + half

    def depths(self, base_tile: bool) -> Array:
        """Return how far the tendon presses each tile into its bed of springs.

        The tendon's normal force is taken to act at the tiles' centres.

        Parameters
        ----------
        base_tile : bool
            Whether a base tile comes first on the tendon.

        Returns
        -------
        ndarray, shape (3,)
            Depth of each phalanx's tile per newton of tension, proximal first [m/N].
        """
        pull = self.losses(base_tile) * np.asarray(self.pulley_radii)
        return np.asarray(pull / (self.tile_centre * self.bed_stiffness))

    def losses(self, base_tile: bool) -> Array:
        """Return M, each phalanx's tendon tension over the motor's (diagonal of Eq. 8), shape (3,).

        ``base_tile``: whether a base tile comes first on the tendon (one more factor 1 − μ).
        """
        first = 1 if base_tile else 0
        return np.asarray((1.0 - self.friction) ** np.arange(first, first + 3))


@dataclass(frozen=True)
class Contact:
    """Pose of one phalanx, and its contact with the rock in the coordinates (x, z) of F.

    Attributes
    ----------
    angle : float
        θ, angle of the phalanx from the finger's x toward z [rad].
    joint : tuple of float
        (x, z) of the phalanx's joint [m].
    along : float
        c, distance of the contact from the joint along the phalanx [m].
    kind : {'face', 'edge', 'frame', 'none'}
        Contact state: the tile touches with its face; with an edge (or its spines reach the rock
        there); the bare phalanx presses on the rock; or there is no contact.
    stop : {'upper', 'lower', 'balance'} or None
        Limit at which the joint is, or ``balance`` if tendon and spring alone balance the joint;
        None if contacts support the joint.
    rise : float
        Height of the contact above the tile's face; negative on the bare frame [m].
    tilt : float
        Angle from the phalanx's normal to the direction in which it presses, positive as θ [rad].
    engagement : float
        Spine engagement: share of the tile's spines on the rock, if the tile touches.
    """

    angle: float
    joint: tuple[float, float]
    along: float
    kind: str
    stop: Stop | None = None
    rise: float = 0.0
    tilt: float = 0.0
    engagement: float = 1.0

    def point(self, height: float) -> tuple[float, float]:
        """Return the contact's place (x, z) in F [m]; ``height``: of the tile's face [m]."""
        cosine, sine = math.cos(self.angle), math.sin(self.angle)
        height += self.rise
        return (
            self.joint[0] + self.along * cosine - height * sine,
            self.joint[1] + self.along * sine + height * cosine,
        )

    def end(self, spacing: float) -> tuple[float, float]:
        """Return the place (x, z) of the next joint in F [m]; ``spacing``: of the joints [m]."""
        return (
            self.joint[0] + spacing * math.cos(self.angle),
            self.joint[1] + spacing * math.sin(self.angle),
        )


@dataclass(frozen=True)
class SettledFinger:
    """Posture and contacts of a finger that has closed on the rock.

    Attributes
    ----------
    model : FingerModel
    contacts : tuple of Contact, length 3
        Contact of each phalanx, proximal first.
    """

    model: FingerModel
    contacts: tuple[Contact, ...]

    @cached_property
    def touching(self) -> tuple[bool, ...]:
        """True for each phalanx whose tile is on rock (contact state ``face`` or ``edge``)."""
        return tuple(contact.kind in ("face", "edge") for contact in self.contacts)

    @cached_property
    def engagement(self) -> Array:
        """Spine engagement: share of each tile's spines on the rock, shape (3,)."""
        shares = np.array([contact.engagement for contact in self.contacts])
        return np.where(self.touching, shares, 0.0)

    @cached_property
    def bearing(self) -> tuple[int, ...]:
        """Indices of the phalanges with a contact: pressed on rock, or held to rock by spines."""
        return tuple(i for i, contact in enumerate(self.contacts) if contact.kind != "none")

    @cached_property
    def free(self) -> tuple[int, ...]:
        """Indices of the joints that contacts support; as many as `bearing`, if that is not ()."""
        return tuple(i for i, contact in enumerate(self.contacts) if contact.stop is None)

    @cached_property
    def joint_angles(self) -> Array:
        """q, angle of each joint relative to the phalanx before it, shape (3,) [rad]."""
        return np.diff([0.0, *(contact.angle for contact in self.contacts)])

    @cached_property
    def points(self) -> Array:
        """Places (x, z) of the contacts in the finger frame F, shape (3, 2) [m]."""
        return np.array([contact.point(self.model.tile_height) for contact in self.contacts])

    @cached_property
    def directions(self) -> Array:
        """Unit vectors (x, z) in F opposite to tiles' drag, shape (3, 2): u turned by ``tilt``."""
        angles = [contact.angle + contact.tilt for contact in self.contacts]
        return np.column_stack([np.cos(angles), np.sin(angles)])

    @property
    def pin(self) -> tuple[float, float]:
        """Place (x, z) in F of the fingernail's pin, at the end of the distal phalanx [m]."""
        return self.contacts[-1].end(self.model.joint_spacing)

    @property
    def chain(self) -> Array:
        """Places (x, z) in F of the three joints and of the finger's end, shape (4, 2) [m]."""
        return np.array([*(contact.joint for contact in self.contacts), self.pin])

    def shears(self, closing_tension: float, base_tile: bool = False) -> Array:
        """Return each tile's shear T as an affine function of the tendon's tension.

        Parameters
        ----------
        closing_tension : float
            Tension at which the tiles caught the rock [N].
        base_tile : bool, optional
            Whether a base tile comes first on the tendon.

        Returns
        -------
        ndarray, shape (3, 2)
            Columns: shear at zero tension [N], per newton of tension. Zero for tiles off the rock.
        """
        model = self.model
        local = self.engagement * model.losses(base_tile)
        gain = np.array(model.shear_gain)
        at_zero = (np.asarray(model.engagement) - gain) * closing_tension
        return np.column_stack([local * at_zero, local * gain])

    def normals(self, shears: Array, base_tile: bool = False) -> Array:
        """Return each phalanx's normal load as an affine function of tension (Eqs. 4 and 14).

        A joint at its limit joins the phalanges on both sides to one link: the joint's equation and
        the load of a phalanx without contact drop out, and the rest is square again (Section 5.7).

        Parameters
        ----------
        shears : ndarray, shape (3, 2)
            From `shears`.
        base_tile : bool, optional
            Whether a base tile comes first on the tendon.

        Returns
        -------
        ndarray, shape (3, 2)
            Columns: normal load at zero tension [N], and per newton of tension.

        Raises
        ------
        numpy.linalg.LinAlgError
            If the contacts cannot balance the joints that are not at a limit.
        """
        normals = np.zeros_like(shears)
        if self.bearing:
            arms, rest = self._joint_balance(shears, base_tile)
            free, bearing = list(self.free), list(self.bearing)
            normals[bearing] = np.linalg.solve(arms[np.ix_(free, bearing)], rest[free])
        return normals

    def stop_torques(self, shears: Array, normals: Array, base_tile: bool = False) -> Array:
        """Return the torque that each joint's end stop carries, affine in tension.

        Parameters
        ----------
        shears, normals : ndarray, shape (3, 2)
            From `shears` and `normals`.
        base_tile : bool, optional
            Whether a base tile comes first on the tendon.

        Returns
        -------
        ndarray, shape (3, 2)
            At zero tension [N·m], and per newton [m]. Positive toward closing: not negative at an
            upper stop, not positive at a lower one, zero at a joint that contacts support.
        """
        if len(self.free) == len(self.contacts):
            return np.zeros_like(shears)
        arms, rest = self._joint_balance(shears, base_tile)
        torques = rest - arms @ normals
        torques[list(self.free)] = 0.0
        return np.asarray(torques)

    def _joint_balance(self, shears: Array, base_tile: bool) -> tuple[Array, Array]:
        """Return (A, b) with A N = b for the three joints; b has a column as each of `shears`."""
        model = self.model
        u = self.directions
        joints = np.array([c.joint for c in self.contacts])
        d = self.points[None, :, :] - joints[:, None, :]
        later = np.triu(np.ones((3, 3)))
        shear_arms = later * (d[..., 0] * u[:, 1] - d[..., 1] * u[:, 0])
        normal_arms = later * (d[..., 0] * u[:, 0] + d[..., 1] * u[:, 1])
        rest = shear_arms @ shears
        rest[:, 0] -= np.asarray(model.joint_stiffness) * self.joint_angles
        rest[:, 0] -= np.asarray(model.joint_preload)
        rest[:, 1] += model.losses(base_tile) * np.asarray(model.pulley_radii)
        return normal_arms, rest
