"""Loads of fingers whose bases move a little while their tiles stay in the rock (Section 5.3).

    base (x, z, ψ) → contacts and joints (`rolling`) → tendon and shears (`TendonRegimes`)
      → normals from the balance of the joints (Eqs. 4–7) → the force and moment on the rock.

Shears follow the contact stiffness of each tile and the tendon's friction (Appendix 9.3). Joint i
with its pulley radius r_i, spring K_i, preload p_i and the tension t_i of its own phalanx balances
when

    Σ_{j ≥ i} [T_j (d_ij × u_j) − N_j (d_ij × n_j)] + t_i r_i − K_i q_i − p_i = 0,

with the shear T_j along −u_j and the normal load N_j along n_j at the place d_ij from joint i.
All fingers of a hand, or of many hands, are computed in one call; one finger is a batch of one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array
from hand_models.compliance.link import Numbers, across, dot
from hand_models.compliance.rolling import MovedPosture, RollingContact
from hand_models.finger import PHALANGES, SettledFinger
from hand_models.sections import Section
from hand_models.tendon import FingerTendon, MotorScheme, TendonRegimes, pad_tiles

__all__ = ["CompliantFingers", "FingerAtRest", "FingerLoads"]

COMPLEX_STEP = 1e-30
"""Size of the complex steps for derivatives; their error is its square."""


class FingerAtRest(NamedTuple):
    """A closed finger before its base moves: contacts, rock, tendon and shears.

    Attributes
    ----------
    finger : SettledFinger
        Posture and contacts, the proximal joint at the origin of the finger frame F.
    section : Section or None
        Rock in the finger's plane; None if there is none.
    tendon : FingerTendon
        Tendon with the friction of holding, over n tiles: the three phalanges' and, if there is a
        base tile, that tile first.
    closing_friction : float
        μ of the tendon on closing.
    shears : ndarray, shape (n, 2)
        Shear of each tile at zero tension [N], and per newton of tension; the base tile's first.
    depths : sequence of float, length 3
        Depth to which each phalanx's tile is pressed into its bed of springs [m].
    """

    finger: SettledFinger
    section: Section | None
    tendon: FingerTendon
    closing_friction: float
    shears: Array
    depths: Sequence[float] = (0.0,) * len(PHALANGES)

    @property
    def base_tile(self) -> bool:
        """True if a tile on the finger's base comes first on the tendon."""
        return len(self.shears) > len(PHALANGES)

    @property
    def losses(self) -> Array:
        """Ratio of the tendon's tension at each tile to the motor's at rest (Eq. 8), shape (n,)."""
        return np.asarray((1.0 - self.closing_friction) ** np.arange(len(self.shears), dtype=float))

    @property
    def anchored(self) -> FingerTendon:
        """The tendon, with zero contact stiffness for the tiles that are off the rock."""
        stiffness = np.array(self.tendon.contact_stiffness)
        stiffness[-len(PHALANGES) :] *= self.finger.touching
        return replace(self.tendon, contact_stiffness=tuple(stiffness.tolist()))


class FingerLoads(NamedTuple):
    """Loads of F fingers at m displacements of their bases, shapes (F, m, …).

    Attributes
    ----------
    shears : ndarray, shape (F, m, 3)
        T, shear of each phalanx's tile [N].
    tile_shears : ndarray, shape (F, m, n)
        Shear of each tile, base tiles first; zero at the end for fingers of fewer than n [N].
    normals : ndarray, shape (F, m, 3)
        N, normal load of each phalanx [N].
    tensions : ndarray, shape (F, m, 3)
        t, tendon tension in each phalanx [N].
    motor_tensions : ndarray, shape (F, m)
        Tendon tension at the first tile from the motor [N].
    stop_torques : ndarray, shape (F, m, 3)
        Torque on the stop of each joint that no contact supports, positive toward closing [N·m].
    points : ndarray, shape (F, m, 3, 2)
        Contacts (x, z) in the finger's frame at rest [m].
    directions : ndarray, shape (F, m, 3, 2)
        Unit vectors (x, z) in that frame, opposite to each tile's drag: along the phalanx, turned
        by the contact's ``tilt``.
    reached : ndarray of bool, shape (F, m)
        Whether every phalanx with a contact still meets rock.
    """

    shears: Numbers
    tile_shears: Numbers
    normals: Numbers
    tensions: Numbers
    motor_tensions: Numbers
    stop_torques: Numbers
    points: Numbers
    directions: Numbers
    reached: NDArray[np.bool_]

    def of(self, finger: int) -> FingerLoads:
        """Return the loads of one finger, shapes (m, …)."""
        return FingerLoads(*(part[finger] for part in self))

    @property
    def forces(self) -> Numbers:
        """Force of each phalanx on the rock without the base tile's, shape (..., 3, 2) [N].

        (x, z) in the finger frame F.
        """
        u = self.directions
        across = np.stack([-u[..., 1], u[..., 0]], axis=-1)
        return np.asarray(self.normals[..., None] * across - self.shears[..., None] * u)

    @property
    def planar_wrench(self) -> Numbers:
        """Wrench of each finger in its plane on the rock, shape (..., 3) [N, N·m].

        F_x, F_z and the moment M from x toward z about the origin of the finger frame F.
        """
        forces, points = self.forces, self.points
        moments = points[..., 0] * forces[..., 1] - points[..., 1] * forces[..., 0]
        sums = [forces.sum(axis=-2), moments.sum(axis=-1)[..., None]]
        return np.asarray(np.concatenate(sums, axis=-1))


class CompliantFingers:
    """F fingers at rest on rock, as functions from displacements of their bases to loads.

    Parameters
    ----------
    fingers : sequence of FingerAtRest, length F
    scheme : {'held', 'tension'}
        Whether the motors stand still, or keep their tension, while the bases move.
    """

    def __init__(self, fingers: Sequence[FingerAtRest], scheme: MotorScheme) -> None:
        models = [each.finger.model for each in fingers]
        self._rolling = RollingContact(
            [each.finger for each in fingers],
            [each.section for each in fingers],
            [list(each.depths) for each in fingers],
        )
        losses = pad_tiles([each.losses for each in fingers])
        self._regimes = TendonRegimes([each.anchored for each in fingers], losses, scheme)
        self._zero, self._per_newton = (
            pad_tiles([each.shears[:, k] for each in fingers])[..., None] for k in (0, 1)
        )
        # where each phalanx is among its finger's tiles
        own, tiles = np.arange(len(fingers))[:, None], np.arange(len(PHALANGES))
        self._phalanges = own, np.array([each.base_tile for each in fingers])[:, None] + tiles
        self._stiffness = np.array([model.joint_stiffness for model in models])[..., None]
        preload = np.array([model.joint_preload for model in models])[..., None]
        angles = np.array([each.finger.joint_angles for each in fingers])[..., None]
        self._springs = preload + self._stiffness * angles
        self._radii = np.array([model.pulley_radii for model in models])[..., None]
        # the phalanx that bears for each free joint, which begins a link; −1 where none does
        self._bearing = np.full((len(fingers), len(PHALANGES)), -1)
        for bearing, each in zip(self._bearing, fingers, strict=True):
            bearing[list(each.finger.free)] = each.finger.bearing
        self._shares = np.array(
            [[contact.bearing_share for contact in each.finger.contacts] for each in fingers]
        )

    def loads(
        self,
        x: Numbers,
        z: Numbers,
        turn: Numbers,
        tension: Numbers,
        base_slip: Numbers | float = 0.0,
    ) -> FingerLoads:
        """Return the loads of the fingers after displacements of their bases.

        Parameters
        ----------
        x, z : ndarray, shape (F, m)
            Displacement of each proximal joint in the finger frame F [m].
        turn : ndarray, shape (F, m)
            ψ, rotation of each base from x toward z [rad].
        tension : ndarray, shape (F, m)
            Tension at which the fingers have closed [N].
        base_slip : ndarray, shape (F, m), optional
            Displacement of base tiles along the rock, toward the base [m]; zero by default.
        """
        posture = self._rolling.move(x, z, turn)
        shape, kind = (*self._zero.shape[:2], x.shape[1]), np.result_type(posture.slips, base_slip)
        slips, turns = np.zeros(shape, dtype=kind), np.zeros(shape, dtype=kind)
        slips[:, 0] = base_slip
        slips[self._phalanges], turns[self._phalanges] = posture.slips, posture.turns
        at_rest = self._zero + tension[:, None] * self._per_newton
        with np.errstate(invalid="ignore", divide="ignore"):
            response = self._regimes.respond(slips, turns, tension, at_rest)
            tensions, shears = (part[self._phalanges] for part in response[:2])
            normals, torques = self._balance(posture, shears, tensions)
        return FingerLoads(
            shears=shears.swapaxes(1, 2),
            tile_shears=response.shears.swapaxes(1, 2),
            normals=normals.swapaxes(1, 2),
            tensions=tensions.swapaxes(1, 2),
            motor_tensions=response.tensions[:, 0],
            stop_torques=torques.swapaxes(1, 2),
            points=posture.points.transpose(0, 3, 1, 2),
            directions=posture.directions.transpose(0, 3, 1, 2),
            reached=posture.reached,
        )

    def _balance(
        self, posture: MovedPosture, shears: Numbers, tensions: Numbers
    ) -> tuple[Numbers, Numbers]:
        """Return the normals that balance the free joints, and what is left at the others.

        Each of shape (F, 3, m). Joint after joint from the last: what is beyond it is known but for
        the normal load of one phalanx.
        """
        u, points = posture.directions, posture.points
        # of shears and, per newton, of normals: force on the finger, moment from x toward z
        drags, drag_moments = shears[:, :, None] * u, shears * dot(across(points), u)
        presses, press_moments = across(u), dot(points, u)
        left = tensions * self._radii - self._springs - self._stiffness * posture.turns
        normals, force, moment = (np.zeros_like(part) for part in (left, u[:, 0], left[:, 0]))
        for i in reversed(range(len(PHALANGES))):
            joint, force = posture.joints[:, i], force + drags[:, i]
            moment = moment + drag_moments[:, i]
            left[:, i] += moment - dot(across(joint), force)
            free = (self._bearing[:, i] >= 0).nonzero()[0]
            if len(free):
                bears = free, self._bearing[free, i]
                arm = press_moments[bears] - dot(joint[free], u[bears])
                normals[bears] = load = self._shares[bears][:, None] * left[free, i] / arm
                force[free] -= load[:, None] * presses[bears]
                moment[free] -= load * press_moments[bears]
                left[free, i] = 0.0
        return normals, left
