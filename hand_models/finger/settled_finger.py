"""Contacts of one closed finger with the rock, and the loads of its tendon.

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
from typing import Final, Literal

import numpy as np

from hand_models.base import Array
from hand_models.finger.model import FingerModel

__all__ = ["JOINT_STOPS", "Contact", "SettledFinger", "Stop"]

Stop = Literal["upper", "lower", "balance"]
"""Reason why a joint without a contact is at rest: its upper (closing) limit, its lower (opening)
limit, or a balance of tendon and spring between the limits."""

JOINT_STOPS: Final[tuple[Stop | None, ...]] = (None, "upper", "lower", "balance")
"""Values of `Contact.stop` by integer code; None if contacts support the joint."""


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
    across : float
        Distance of the contact from the finger's plane, along y of F [m].
    bearing_share : float
        w, share of what balances its joint that the contact bears: 1, but φ/φ₀ for spines across a
        gap that are less than the share φ₀. The joint, taken as locked, carries the rest, as it
        does all of it without a contact.
    """

    angle: float
    joint: tuple[float, float]
    along: float
    kind: str
    stop: Stop | None = None
    rise: float = 0.0
    tilt: float = 0.0
    engagement: float = 1.0
    across: float = 0.0
    bearing_share: float = 1.0

    def point(self, height: float) -> tuple[float, float]:
        """Return the contact's place (x, z) in F [m]; ``height``: as `FingerModel.tile_height`."""
        cosine, sine = math.cos(self.angle), math.sin(self.angle)
        height += self.rise
        return (
            self.joint[0] + self.along * cosine - height * sine,
            self.joint[1] + self.along * sine + height * cosine,
        )

    def end(self, spacing: float) -> tuple[float, float]:
        """Return the place (x, z) of the next joint in F, ``spacing`` from this joint [m]."""
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

    @property
    def touching(self) -> tuple[bool, ...]:
        """True for each phalanx whose tile is on rock (contact state ``face`` or ``edge``)."""
        return tuple(contact.kind in ("face", "edge") for contact in self.contacts)

    @property
    def engagement(self) -> Array:
        """Spine engagement: share of each tile's spines on the rock, shape (3,)."""
        shares = np.array([contact.engagement for contact in self.contacts])
        return np.where(self.touching, shares, 0.0)

    @property
    def bearing(self) -> tuple[int, ...]:
        """Indices of the phalanges with a contact: pressed on rock, or held to rock by spines."""
        return tuple(i for i, contact in enumerate(self.contacts) if contact.kind != "none")

    @property
    def free(self) -> tuple[int, ...]:
        """Indices of the joints that contacts support; with a contact, as many as in `bearing`."""
        return tuple(i for i, contact in enumerate(self.contacts) if contact.stop is None)

    @property
    def joint_angles(self) -> Array:
        """q, angle of each joint relative to the phalanx before it, shape (3,) [rad]."""
        return np.diff([0.0, *(contact.angle for contact in self.contacts)])

    @property
    def points(self) -> Array:
        """Places (x, z) of the contacts in the finger frame F, shape (3, 2) [m]."""
        return np.array([contact.point(self.model.tile_height) for contact in self.contacts])

    @property
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
        A contact that bears the share w has w A_ij N_j + (1 − w) A_ii N_i = w b_i in place of its
        joint's equation A_ij N_j = b_i, so that its load begins at zero where its spines do.

        Parameters
        ----------
        shears : ndarray, shape (3, 2)
            Result of the method `shears`.
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
        free, bearing = list(self.free), list(self.bearing)
        if bearing:
            arms, rest = self._joint_balance(shears, base_tile)
            share = np.array([self.contacts[j].bearing_share for j in bearing])[:, None]
            A = arms[np.ix_(free, bearing)]
            A = share * A + np.diag((1.0 - share[:, 0]) * np.diag(A))
            normals[bearing] = np.linalg.solve(A, share * rest[free])
        return normals

    def stop_torques(self, shears: Array, normals: Array, base_tile: bool = False) -> Array:
        """Return the torque on each joint's end stop as an affine function of the tension.

        Parameters
        ----------
        shears, normals : ndarray, shape (3, 2)
            Results of the methods `shears` and `normals`.
        base_tile : bool, optional
            Whether a base tile comes first on the tendon.

        Returns
        -------
        ndarray, shape (3, 2)
            Columns: torque at zero tension [N·m], and per newton [m]. Positive toward closing: not
            negative at an upper stop, not positive at a lower one, zero at a joint that contacts
            support.
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
