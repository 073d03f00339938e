"""The loads of one finger whose base moves a little while its tiles stay in the rock (Section 5.3).

    base (x, z, ψ) → contacts and joints (`resettling`) → tendon and shears (`tendon_regimes`)
      → normals from the balance of the joints (Eqs. 4–7) → the force and moment on the rock.

Shears follow the contact stiffness of each tile and the tendon's friction (Appendix 9.3); each
joint's pulley has the tension t_i of its own phalanx, so that joint i balances when

    Σ_{j ≥ i} [T_j (d_ij × u_j) − N_j (d_ij × n_j)] + t_i r_i − K_i q_i − p_i = 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.compliance.rolling import Numbers, RollingContact
from hand_models.finger import PHALANGES, FingerModel, SettledFinger
from hand_models.sections import Section
from hand_models.tendon import FingerTendon, MotorScheme, TendonRegimes, TendonState

__all__ = ["CompliantFinger", "FingerLoads"]

COMPLEX_STEP = 1e-30
"""Size of complex steps, whose error is its square."""


class FingerLoads(NamedTuple):
    """A finger's loads, shapes (m, …); n is 3, or 4 where a base tile comes first on the tendon.

    Attributes
    ----------
    shears : ndarray, shape (m, n)
        T of each tile [N].
    normals : ndarray, shape (m, 3)
        N of each phalanx [N].
    tensions : ndarray, shape (m, n)
        t of each phalanx [N].
    stop_torques : ndarray, shape (m, 3)
        What turns each joint that no contact holds, closing [N·m].
    points : ndarray, shape (m, 3, 2)
        Contacts (x, z) in F, which stays where the base was at rest [m].
    directions : ndarray, shape (m, 3, 2)
        Unit vectors in F along which tiles drag away from the base: along the phalanges, but for
        contacts that press aside.
    reached : ndarray of bool, shape (m,)
        Whether every phalanx still finds its rock.
    """

    shears: Numbers
    normals: Numbers
    tensions: Numbers
    stop_torques: Numbers
    points: Numbers
    directions: Numbers
    reached: NDArray[np.bool_]

    @property
    def forces(self) -> Numbers:
        """F of each phalanx on the rock, (x, z) in F, shape (m, 3, 2) [N]; no base tile's."""
        u = self.directions
        across = np.stack([-u[..., 1], u[..., 0]], axis=-1)
        shears = self.shears[:, -3:]
        return np.asarray(self.normals[..., None] * across - shears[..., None] * u)

    @property
    def planar_wrench(self) -> Numbers:
        """F_x, F_z and M, from x toward z about the origin of F, shape (m, 3) [N, N·m]."""
        forces, points = self.forces, self.points
        moments = points[..., 0] * forces[..., 1] - points[..., 1] * forces[..., 0]
        return np.asarray(
            np.concatenate([forces.sum(axis=1), moments.sum(axis=1)[:, None]], axis=1)
        )


class CompliantFinger:
    """A finger at rest on rock, about which its base may move.

    Parameters
    ----------
    finger : SettledFinger
        Its proximal joint at the origin of F.
    section : Section or None
        The rock in its plane.
    tendon : FingerTendon
        With the friction that holds the tendon; phalanges without rock under their tiles are taken
        out here. One more entry than phalanges if a base tile comes first.
    state : TendonState
        At rest: tensions and shears, the base tile's first.
    scheme : {'held', 'tension'}
        What the motor does.
    depths : sequence of float, optional
        How far the tiles of the three phalanges are pressed in; not at all by default [m].
    """

    def __init__(
        self,
        finger: SettledFinger,
        section: Section | None,
        tendon: FingerTendon,
        state: TendonState,
        scheme: MotorScheme,
        depths: Sequence[float] = (0.0,) * len(PHALANGES),
    ) -> None:
        self.finger = finger
        self.base_tile = len(tendon.pulley_radii) > len(PHALANGES)
        stiffness = np.array(tendon.contact_stiffness)
        stiffness[-3:] = np.where(finger.touching, stiffness[-3:], 0.0)
        tendon = replace(tendon, contact_stiffness=tuple(stiffness.tolist()))
        self.regimes = TendonRegimes(tendon, state, scheme)
        self._resettling = RollingContact(finger, section, depths)

    @property
    def model(self) -> FingerModel:
        """The finger's numbers."""
        return self.finger.model

    def loads(
        self, x: Numbers, z: Numbers, turn: Numbers, base_slip: Numbers | None = None
    ) -> FingerLoads:
        """Return the loads after displacements of the base.

        Parameters
        ----------
        x, z, turn : ndarray, shape (m,)
            As of `RollingContact.move` [m, rad].
        base_slip : ndarray, shape (m,), optional
            Of the base tile along the rock, toward the base [m]; zero by default.
        """
        posture = self._resettling.move(x, z, turn)
        slips, turns = posture.slips, posture.turns
        if self.base_tile:
            first = 0.0 * slips[:, :1] if base_slip is None else base_slip[:, None]
            slips = np.concatenate([first, slips], axis=1)
            turns = np.concatenate([0.0 * turns[:, :1], turns], axis=1)
        with np.errstate(invalid="ignore"):
            response = self.regimes.respond(slips, turns)
        angles = posture.angles + np.array([contact.tilt for contact in self.finger.contacts])
        u = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        normals, torques = self._balance(
            response.shears[:, -3:],
            response.tensions[:, -3:],
            self.finger.joint_angles + posture.turns,
            u,
            posture.joints,
            posture.points,
        )
        return FingerLoads(
            shears=response.shears,
            normals=normals,
            tensions=response.tensions,
            stop_torques=torques,
            points=posture.points,
            directions=u,
            reached=posture.reached,
        )

    def _balance(
        self,
        shears: Numbers,
        tensions: Numbers,
        joint_angles: Numbers,
        u: Numbers,
        joints: Numbers,
        points: Numbers,
    ) -> tuple[Numbers, Numbers]:
        """Return the normals that balance the free joints, and what is left at the others."""
        model = self.model
        rest = tensions * np.array(model.pulley_radii)
        rest = rest - np.array(model.joint_stiffness) * joint_angles - np.array(model.joint_preload)
        count = len(PHALANGES)
        arms = {}
        for i in range(count):
            for j in range(i, count):
                dx = points[:, j, 0] - joints[:, i, 0]
                dz = points[:, j, 1] - joints[:, i, 1]
                rest[:, i] += shears[:, j] * (dx * u[:, j, 1] - dz * u[:, j, 0])
                arms[i, j] = dx * u[:, j, 0] + dz * u[:, j, 1]
        normals = np.zeros_like(rest)
        # each free joint begins a link with one phalanx that bears: from the tip, one unknown each
        pairs = list(zip(self.finger.free, self.finger.bearing, strict=True))
        for joint, phalanx in reversed(pairs):
            later = (normals[:, j] * arms[joint, j] for _, j in pairs if j > phalanx)
            normals[:, phalanx] = (rest[:, joint] - sum(later)) / arms[joint, phalanx]
        for i in range(count):
            for j in range(i, count):
                rest[:, i] -= normals[:, j] * arms[i, j]
        rest[:, list(self.finger.free)] = 0.0
        return normals, rest
