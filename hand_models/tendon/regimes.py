"""Stick and slip of many fingers' tendons for many changes of load at once.

`FingerTendon` solves one change of load as a complementarity problem. From one state of rest, every
choice of which boundaries stick and which way the others slip (a *regime*) makes the tensions an
affine function of the change,

    t = a f + B_x (k δx) + B_q (r δq),

also linear in the motor's tension f at rest (k the contact stiffnesses, δx the phalanges'
displacements along the rock, r the pulley radii, δq the joints' turns). Exactly one regime is
consistent for each change of load, or several with equal tensions where two regimes meet. There are
3ⁿ regimes of n boundaries, few enough to try them all.

Tendons over fewer tiles than others are padded at their ends with tiles of zero stiffness. All
arrays may be complex, for derivatives by complex steps; these are derivatives within the regime.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import BASE_TOLERANCES, Array, Indices
from hand_models.tendon.finger_tendon import LEAST_FRICTION, FingerTendon, pad_tiles

__all__ = ["MotorScheme", "TendonRegimes", "TendonResponse"]

MotorScheme = Literal["held", "tension"]
"""Motor while the load changes: it stands still (``held``), or keeps its tension (``tension``)."""


class TendonResponse(NamedTuple):
    """Tensions and shears of F fingers' tendons after m changes of load.

    Attributes
    ----------
    tensions : ndarray, shape (F, n, m)
        t_i, tension at each tile [N].
    shears : ndarray, shape (F, n, m)
        T_i, shear of each tile on the rock [N].
    regime : ndarray of int, shape (F, m)
        Index of the regime (which boundaries stick, and which way the others slip), among all 3ⁿ.
    """

    tensions: NDArray[Any]
    shears: NDArray[Any]
    regime: Indices


class TendonRegimes:
    """Tendons and tiles of F fingers at rest, as functions from changes of load to tensions.

    Parameters
    ----------
    tendons : sequence of FingerTendon, length F
    losses : ndarray, shape (F, n)
        Tension at each tile at rest, as a share of the motor's tension.
    scheme : {'held', 'tension'}
        Whether motors stand still or keep their tension.
    """

    def __init__(self, tendons: Sequence[FingerTendon], losses: Array, scheme: MotorScheme) -> None:
        self.scheme = scheme
        stiffness = pad_tiles([tendon.contact_stiffness for tendon in tendons])
        radii = pad_tiles([tendon.pulley_radii for tendon in tendons])
        ratio = np.array([tendon.pulley_ratio for tendon in tendons])[:, None]
        count, n = losses.shape
        own = pad_tiles([np.ones(len(tendon.pulley_radii)) for tendon in tendons])
        springs = np.array([tendon.spring_stiffness for tendon in tendons])[:, None]
        give = own / (stiffness + np.where(own > 0.0, springs, 1.0))
        by_tile = losses, stiffness, radii, give, ratio
        self._losses, self._stiffness, self._radii, self._give, self._ratio = (
            part[..., None] for part in by_tile
        )
        mu = np.array([tendon.friction for tendon in tendons])[:, None] * own
        mu[:, 0] = [tendon.entry_friction for tendon in tendons]
        mu = np.where(mu > LEAST_FRICTION, mu, 0.0)
        # v = travel @ t + given @ (pushed, wound, f), in newtons (over `unit`)
        unit = ratio**2 * (give.sum(axis=1) / own.sum(axis=1))[:, None]
        later = np.triu(np.ones((n, n))) / unit[..., None]
        travel = later * (ratio**2 * give)[:, None, :]
        by_push = -later * (ratio * give)[:, None, :]
        constant = -np.einsum("fij,fj->fi", travel, losses)
        given = np.concatenate([by_push, later, constant[..., None]], axis=-1)[:, None]
        signs, slipping = self._choices(mu)
        # where next to nothing slips is looked for first
        ends = np.searchsorted(slipping, [1, 2, 2 * n + 1])
        self._groups = [slice(start, end) for start, end in itertools.pairwise([0, *ends])]
        slack, mu = signs == 2, mu[:, None]
        sticks, factor = (signs == 0)[..., None], np.where(slack, 0.0, 1.0 - signs * mu)
        rows = np.where(sticks, travel[:, None], np.eye(n) - factor[..., None] * np.eye(n, k=-1))
        aims = np.where(sticks, -given, 0.0)
        aims[..., 0, -1] = np.where(sticks[..., 0, 0], aims[..., 0, -1], factor[..., 0])
        self._tensions = t = np.linalg.solve(rows, aims)
        # what contradicts a regime where it is positive, by (pushed, wound, f)
        v = travel[:, None] @ t + given
        motor = np.broadcast_to(np.eye(2 * n + 1)[-1], t[..., :1, :].shape)
        before, mu = np.concatenate([motor, t[..., :-1, :]], axis=-2), mu[..., None]
        against = np.where(mu > 0.0, -signs[..., None] * v, 0.0)
        sides = [(1.0 - mu) * before - t, t - (1.0 + mu) * before]
        off = np.stack([np.where(sticks, side, against) for side in sides], axis=2)
        if scheme == "held":
            off = np.where(slack[:, :, None, :, None], 0.0, off)
            first = np.where(slack[..., :1], -v[..., 0, :], -t[..., 0, :])
            off[..., 0, :] = first[:, :, None]
        self._contradictions = off.reshape(count, len(slipping), 2 * n, 2 * n + 1)

    def _choices(self, mu: Array) -> tuple[Indices, Indices]:
        """Return the signs of every finger's boundaries in every regime, shape (F, R, n).

        0 sticks, 1 slips toward the motor, −1 away; all are 2 where the tendon is slack.
        And how many boundaries slip in each, in rising order, shape (R,).
        """
        n, held = mu.shape[1], self.scheme == "held"
        options = [(0,) if held and i == 0 else (0, 1, -1) for i in range(n)]
        choices = sorted(itertools.product(*options), key=lambda signs: sum(map(abs, signs)))
        if held:
            choices.append((2,) * n)
        signs = np.tile(np.array(choices), (len(mu), 1, 1))
        slides = mu == 0.0
        slides[:, 0] &= not held
        signs = np.where(slides[:, None] & (signs != 2), 1, signs)
        return signs, np.abs(choices).sum(axis=1)

    def respond(
        self,
        slips: NDArray[Any],
        turns: NDArray[Any],
        tension: NDArray[Any],
        at_rest: NDArray[Any],
    ) -> TendonResponse:
        """Return tensions and shears after m changes of load, each change begun at rest.

        Parameters
        ----------
        slips : ndarray, shape (F, n, m)
            δx_i, displacement of each phalanx along the rock, toward the finger's base [m].
        turns : ndarray, shape (F, n, m)
            δq_i, turn of each joint, closing [rad].
        tension : ndarray, shape (F, m)
            Tension of each motor at rest [N].
        at_rest : ndarray, shape (F, n, m)
            Shear of each tile at rest [N].
        """
        pushed = slips * self._stiffness
        given = [pushed, turns * self._radii, tension[:, None]]
        changes = np.concatenate(given, axis=1)
        # complex steps from one change of load share its regime
        starts = np.ones(changes.shape[-1], dtype=bool)
        starts[1:] = (changes[..., 1:].real != changes[..., :-1].real).any(axis=(0, 1))
        regime = self._consistent(changes.real[..., starts])[:, np.cumsum(starts) - 1]
        of_each = self._tensions[np.arange(len(regime))[:, None], regime]
        tensions = np.einsum("fmij,fjm->fim", of_each, changes)
        rise = self._ratio * (tensions - tension[:, None] * self._losses)
        shears = at_rest + pushed + self._stiffness * self._give * (rise - pushed)
        return TendonResponse(tensions, shears, regime)

    def _consistent(self, changes: Array) -> Indices:
        """Return the regime of each change of load (F, 2 n + 1, m), shape (F, m).

        The first that does not contradict itself; by rounding, that which does least.
        """
        first, *later = self._groups
        least = self._off(first, changes, slice(None))[:, 0]
        found = np.zeros(least.shape, dtype=np.intp)
        for group in later:
            left = least > 0.0
            fingers, rows = (np.flatnonzero(left.any(axis=axis)) for axis in (1, 0))
            # so many at once, which bounds the memory
            for those in np.array_split(rows, -(-left.size // 4096)) if len(rows) else ():
                own = np.ix_(fingers, those)
                off = self._off(group, changes[fingers][..., those], fingers)
                best, worst = off.argmin(axis=1), off.min(axis=1)
                better = worst < least[own]
                found[own] = np.where(better, group.start + best, found[own])
                least[own] = np.where(better, worst, least[own])
        return found

    def _off(self, group: slice, changes: Array, fingers: slice | Indices) -> Array:
        """Return by how many newtons changes (k, 2 n + 1, m) contradict regimes, (k, R, m)."""
        rows = self._contradictions[fingers][:, group]
        flat = rows.reshape(len(rows), -1, rows.shape[-1]) @ changes
        worst = flat.reshape(*rows.shape[:3], changes.shape[-1]).max(axis=2)
        return np.where(
            worst <= BASE_TOLERANCES.force, 0.0, np.where(np.isnan(worst), np.inf, worst)
        )
