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
from hand_models.compliance.rolling import Numbers, RollingContact
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
        """Tendon tension at each tile over the motor's tension at rest (Eq. 8), shape (n,)."""
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
    base_shears : ndarray, shape (F, m)
        Shear of each base tile; zero for fingers without one [N].
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
    base_shears: Numbers
    normals: Numbers
    tensions: Numbers
    motor_tensions: Numbers
    stop_torques: Numbers
    points: Numbers
    directions: Numbers
    reached: NDArray[np.bool_]

    def of(self, finger: int | slice) -> FingerLoads:
        """Return the loads of one finger, shapes (m, …), or of a slice of them, (F, m, …)."""
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
        losses = pad_tiles([each.losses for each in fingers], 0.0)
        self._regimes = TendonRegimes([each.anchored for each in fingers], losses, scheme)
        self._at_rest = [pad_tiles([each.shears[:, k] for each in fingers], 0.0) for k in (0, 1)]
        self._base = np.array([each.base_tile for each in fingers])
        self._stiffness = np.array([model.joint_stiffness for model in models])[:, None]
        self._preload = np.array([model.joint_preload for model in models])[:, None]
        self._radii = np.array([model.pulley_radii for model in models])[:, None]
        self._angles = np.array([each.finger.joint_angles for each in fingers])[:, None]
        count = len(PHALANGES)
        # each free joint begins a link with one phalanx that bears
        self._held_by = np.zeros((len(fingers), count, count))
        for pairs, each in zip(self._held_by, fingers, strict=True):
            pairs[list(each.finger.bearing), list(each.finger.free)] = 1.0

    def loads(
        self,
        x: Numbers,
        z: Numbers,
        turn: Numbers,
        tension: Numbers,
        base_slip: Numbers | None = None,
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
        first = 0.0 * posture.slips[..., 0] if base_slip is None else base_slip
        slips = self._of_tiles(posture.slips, first)
        turns = self._of_tiles(posture.turns, 0.0 * first)
        zero, per_newton = self._at_rest
        at_rest = zero[:, None] + tension[..., None] * per_newton[:, None]
        with np.errstate(invalid="ignore"):
            response = self._regimes.respond(slips, turns, tension, at_rest)
        shears, tensions = (
            self._of_phalanges(part) for part in (response.shears, response.tensions)
        )
        angles = posture.angles + self._rolling.tilts
        u = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        normals, torques = self._balance(
            shears, tensions, posture.turns, u, posture.joints, posture.points
        )
        return FingerLoads(
            shears=shears,
            base_shears=np.where(self._base[:, None], response.shears[..., 0], 0.0),
            normals=normals,
            tensions=tensions,
            motor_tensions=response.tensions[..., 0],
            stop_torques=torques,
            points=posture.points,
            directions=u,
            reached=posture.reached,
        )

    def _of_tiles(self, of_phalanges: Numbers, first: Numbers) -> Numbers:
        """Return numbers of phalanges as those of tiles, base tiles' first, padded at the end."""
        if not self._base.any():
            return of_phalanges
        after = np.concatenate([first[..., None], of_phalanges], axis=-1)
        padded = np.concatenate([of_phalanges, 0.0 * first[..., None]], axis=-1)
        return np.where(self._base[:, None, None], after, padded)

    def _of_phalanges(self, of_tiles: Numbers) -> Numbers:
        """Return numbers of tiles without base tiles, shape (F, m, 3)."""
        if not self._base.any():
            return of_tiles
        return np.where(self._base[:, None, None], of_tiles[..., 1:], of_tiles[..., :-1])

    def _balance(
        self,
        shears: Numbers,
        tensions: Numbers,
        turns: Numbers,
        u: Numbers,
        joints: Numbers,
        points: Numbers,
    ) -> tuple[Numbers, Numbers]:
        """Return the normals that balance the free joints, and what is left at the others."""
        d = points[..., None, :, :] - joints[..., :, None, :]
        later = np.triu(np.ones((len(PHALANGES),) * 2))
        u = u[..., None, :, :]
        across = (d[..., 0] * u[..., 1] - d[..., 1] * u[..., 0]) * later
        arms = (d[..., 0] * u[..., 0] + d[..., 1] * u[..., 1]) * later
        springs = self._stiffness * (self._angles + turns) + self._preload
        rest = tensions * self._radii - springs + (across * shears[..., None, :]).sum(axis=-1)
        held_by = self._held_by[:, None]
        free, bears = held_by.sum(axis=-2) > 0.0, held_by.sum(axis=-1) > 0.0
        # one equation for each phalanx: of its joint, or that it presses nothing
        rows = np.where(
            bears[..., None], held_by @ (arms * bears[..., None, :]), np.eye(len(later))
        )
        own = np.diagonal(rows, axis1=-2, axis2=-1)
        lost = ~(np.isfinite(rows.real).all(axis=(-1, -2)) & (own != 0.0).all(axis=-1))
        rows[lost] = np.eye(len(later))
        aims = held_by @ rest[..., None]
        normals = np.linalg.solve(rows, aims)[..., 0]
        normals[lost] = np.nan
        left = rest - (arms * normals[..., None, :]).sum(axis=-1)
        return normals, np.where(free, 0.0, left)
