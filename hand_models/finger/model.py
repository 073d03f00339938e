"""One finger on a section of rock: how it settles, and what its tendon then loads.

In the finger's frame F (x along the finger, z into the rock; coordinates (x, z) here) phalanx i
points along u = (cos θ, sin θ) with its tile's normal n = (−sin θ, cos θ), and touches the rock at
``p_i + c_i u + h n``. The tile drags the rock with the shear T along −u and presses it with N along
n; the rock pushes back equally, so that joint i balances when (Eq. 4, written out)

    Σ_{j ≥ i} [T_j (d_ij × u_j) − N_j (d_ij × n_j)] + f M_i r_i − K_i q_i − p_i = 0,

with d_ij from joint i to contact j and a × b = a_x b_z − a_z b_x. The shear follows the tendon
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
"""What holds a joint that no contact holds: its limit of closing or of opening, or nothing."""

JOINT_STOPS: Final[tuple[Stop | None, ...]] = (None, "upper", "lower", "balance")
"""These by code; None where contacts hold it."""


@dataclass(frozen=True)
class FingerModel:
    """A finger's numbers, alike for the four of them. SI units.

    Attributes
    ----------
    joint_spacing : float
        From a joint to the next [m].
    tile_height, tile_centre, tile_length : float
        The tile's face above the joint's axis, its centre from the joint, its length [m].
    pulley_radii, joint_stiffness, joint_preload : tuple of float
        r [m], K_r [N·m/rad], p_r [N·m] of each joint.
    joint_lower, joint_upper : tuple of float
        Limits of each joint, relative to the phalanx before it [rad].
    engagement : tuple of float
        τ, shear over closing tension at the moment of closing.
    base_engagement : float
        The same for the tile on a rotating base.
    shear_gain : tuple of float
        g = c_p k_c / (k_c + K_p) of each phalanx, shear per newton of further tension; a tile on a
        rotating base has the proximal one's.
    spine_travel : float
        How far spines reach [m].
    frame_radius : float
        Of the bare phalanx about the line of its joints [m].
    bed_stiffness : float
        Of the bed of springs that a tile rests on, per tile [N/m].
    friction : float
        μ of M = diag(1, 1 − μ, (1 − μ)², …) (Eq. 8).
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
        pulleys = table.scalar("tile", "pulley_ratio")
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
        for name in (
            "pulley_radii",
            "joint_stiffness",
            "joint_preload",
            "joint_lower",
            "joint_upper",
            "engagement",
            "shear_gain",
        ):
            if len(getattr(model, name)) != len(PHALANGES):
                raise InvalidInputError(f"one number for each of {PHALANGES}", field=name)
        if not 0.0 <= model.friction < 1.0:
            raise InvalidInputError(
                f"must be in [0, 1), got {model.friction:g}", field="tendon.friction"
            )
        if not min(model.shear_gain) > 0.0:
            raise InvalidInputError("stiffnesses must be above 0", field="tile.contact_stiffness")
        if not min(model.pulley_radii) > 0.0:
            raise InvalidInputError(
                f"must be above 0 m, got {list(model.pulley_radii)}", field="finger.pulley_radii"
            )
        begin, end = model.tile_range
        if not 0.0 <= begin < end <= model.joint_spacing:
            raise InvalidInputError(
                f"a tile must lie on its phalanx, from 0 to {model.joint_spacing:g} m, "
                f"got {begin:g} to {end:g}",
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
        """Largest distance from its first joint at which a finger may touch anything [m]."""
        return len(self.pulley_radii) * self.joint_spacing + self.tile_height

    @property
    def tile_range(self) -> tuple[float, float]:
        """Begin and end of a tile's face along its phalanx [m]."""
        half = self.tile_length / 2.0
        return self.tile_centre - half, self.tile_centre + half

    def depths(self, base_tile: bool) -> Array:
        """Return how far tiles are pressed into their beds per newton of tension, (3,) [m/N].

        By what the tendon presses with at the tiles' centres.
        """
        pull = self.losses(base_tile) * np.asarray(self.pulley_radii)
        return np.asarray(pull / (self.tile_centre * self.bed_stiffness))

    def losses(self, base_tile: bool) -> Array:
        """Return the diagonal of M (Eq. 8) for the three phalanges, shape (3,).

        A tile on the base comes first on the tendon, so it shifts the others by one.
        """
        first = 1 if base_tile else 0
        return np.asarray((1.0 - self.friction) ** np.arange(first, first + 3))


@dataclass(frozen=True)
class Contact:
    """One phalanx on the rock.

    Attributes
    ----------
    angle : float
        θ, of the phalanx from the finger's x toward z [rad].
    joint : tuple of float
        (x, z) of its joint [m].
    along : float
        c, of the contact from the joint along the phalanx [m].
    kind : {'face', 'edge', 'frame', 'none'}
        Whether the tile touches with its face or with one of its edges (or its spines hold it to
        the rock there), or the bare phalanx only presses, or nothing does.
    stop : {'upper', 'lower', 'balance'} or None
        The limit at which the joint stands, or ``balance`` where tendon and springs hold it without
        any contact; None where the contacts hold it.
    rise : float
        Of the contact above the tile's face; negative on the bare frame [m].
    tilt : float
        From the phalanx's normal to the direction in which it presses, as θ grows [rad].
    engagement : float
        Share of the tile's spines that are on the rock, if it touches.
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
        """Return the contact's place (x, z); ``height``: of the face above the joint's axis [m]."""
        cosine, sine = math.cos(self.angle), math.sin(self.angle)
        height += self.rise
        return (
            self.joint[0] + self.along * cosine - height * sine,
            self.joint[1] + self.along * sine + height * cosine,
        )

    def end(self, spacing: float) -> tuple[float, float]:
        """Return the place (x, z) of the next joint, ``spacing`` from this one [m]."""
        return (
            self.joint[0] + spacing * math.cos(self.angle),
            self.joint[1] + spacing * math.sin(self.angle),
        )


@dataclass(frozen=True)
class SettledFinger:
    """A finger that has closed on the rock.

    Attributes
    ----------
    model : FingerModel
    contacts : tuple of Contact
        Proximal first.
    """

    model: FingerModel
    contacts: tuple[Contact, ...]

    @cached_property
    def touching(self) -> tuple[bool, ...]:
        """True for each phalanx that has rock under its tile."""
        return tuple(contact.kind in ("face", "edge") for contact in self.contacts)

    @cached_property
    def engagement(self) -> Array:
        """Share of each tile's spines that are on the rock, shape (3,)."""
        shares = np.array([contact.engagement for contact in self.contacts])
        return np.where(self.touching, shares, 0.0)

    @cached_property
    def bearing(self) -> tuple[int, ...]:
        """Phalanges that bear: that press on rock with their tiles or frames, or are held to it."""
        return tuple(i for i, contact in enumerate(self.contacts) if contact.kind != "none")

    @cached_property
    def free(self) -> tuple[int, ...]:
        """Joints that contacts hold; as many as phalanges that bear, if any do."""
        return tuple(i for i, contact in enumerate(self.contacts) if contact.stop is None)

    @cached_property
    def joint_angles(self) -> Array:
        """q, each joint relative to the phalanx before it, shape (3,) [rad]."""
        return np.diff([0.0, *(contact.angle for contact in self.contacts)])

    @cached_property
    def points(self) -> Array:
        """Contacts in (x, z) of F, shape (3, 2) [m]."""
        return np.array([contact.point(self.model.tile_height) for contact in self.contacts])

    @cached_property
    def directions(self) -> Array:
        """Unit vectors along which tiles drag away from the base, in (x, z) of F, shape (3, 2).

        Along the phalanges, u, but for contacts that press aside of their normals.
        """
        angles = [contact.angle + contact.tilt for contact in self.contacts]
        return np.column_stack([np.cos(angles), np.sin(angles)])

    @property
    def pin(self) -> tuple[float, float]:
        """(x, z) of the fingernail's pin in F, at the end of the last phalanx [m]."""
        return self.contacts[-1].end(self.model.joint_spacing)

    @property
    def chain(self) -> Array:
        """The finger's joints and its end in (x, z) of F, shape (4, 2) [m]."""
        return np.array([*(contact.joint for contact in self.contacts), self.pin])

    def shears(self, closing_tension: float, base_tile: bool = False) -> Array:
        """Return each tile's shear as an affine function of tension.

        Returns
        -------
        ndarray, shape (3, 2)
            Columns: at zero tension [N], per newton of tension. Zero where nothing is touched.
        """
        model = self.model
        local = self.engagement * model.losses(base_tile)
        gain = np.array(model.shear_gain)
        at_zero = (np.asarray(model.engagement) - gain) * closing_tension
        return np.column_stack([local * at_zero, local * gain])

    def normals(self, shears: Array, base_tile: bool = False) -> Array:
        """Return each phalanx's normal load as an affine function of tension (Eqs. 4 and 14).

        A joint at its limit makes one link of the phalanges on both sides: its equation drops out,
        as the load of a phalanx without contact does, and the rest is square again (Section 5.7).

        Parameters
        ----------
        shears : ndarray, shape (3, 2)
            From `shears`.
        base_tile : bool, optional
            Whether a base tile comes first on the tendon.

        Returns
        -------
        ndarray, shape (3, 2)
            Columns as in `shears`.

        Raises
        ------
        numpy.linalg.LinAlgError
            If the contacts cannot hold the joints that are free.
        """
        normals = np.zeros_like(shears)
        if self.bearing:
            arms, rest = self._joint_balance(shears, base_tile)
            free, bearing = list(self.free), list(self.bearing)
            normals[bearing] = np.linalg.solve(arms[np.ix_(free, bearing)], rest[free])
        return normals

    def stop_torques(self, shears: Array, normals: Array, base_tile: bool = False) -> Array:
        """Return what turns each joint against its limit, affine in tension, shape (3, 2) [N·m].

        Toward closing, so that an upper stop holds a torque that is not negative and a lower one a
        torque that is not positive; zero at a joint that contacts hold.
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
