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
from hand_models.tendon.finger_tendon import LEAST_FRICTION, FingerTendon

__all__ = ["MotorScheme", "TendonRegimes", "TendonResponse", "pad_tiles"]

MotorScheme = Literal["held", "tension"]
"""Motor while the load changes: it stands still (``held``), or keeps its tension (``tension``)."""


class TendonResponse(NamedTuple):
    """Tensions and shears of F fingers' tendons after m changes of load.

    Attributes
    ----------
    tensions : ndarray, shape (F, m, n)
        t_i, tension at each tile [N].
    shears : ndarray, shape (F, m, n)
        T_i, shear of each tile on the rock [N].
    regime : ndarray of int, shape (F, m)
        Index of the regime of stick and slip.
    """

    tensions: NDArray[Any]
    shears: NDArray[Any]
    regime: Indices


def pad_tiles(rows: Sequence[Sequence[float] | Array], fill: float) -> Array:
    """Return numbers of tiles as one array (F, n), from rows of different lengths.

    Parameters
    ----------
    rows : sequence of sequence of float, length F
        One number for each tile of each finger.
    fill : float
        Number put at the end of rows with fewer than n tiles.
    """
    count = max(map(len, rows))
    return np.array([[*row, *[fill] * (count - len(row))] for row in rows], dtype=float)


class TendonRegimes:
    """Tendons and tiles of F fingers at rest, as functions from changes of load to tensions.

    Parameters
    ----------
    tendons : sequence of FingerTendon, length F
    losses : ndarray, shape (F, n)
        Tension at each tile at rest, over the motor's tension.
    scheme : {'held', 'tension'}
        Whether motors stand still or keep their tension.
    """

    def __init__(self, tendons: Sequence[FingerTendon], losses: Array, scheme: MotorScheme) -> None:
        self.scheme = scheme
        self._losses = losses
        self._stiffness = pad_tiles([tendon.contact_stiffness for tendon in tendons], 0.0)
        self._radii = pad_tiles([tendon.pulley_radii for tendon in tendons], 0.0)
        self._ratio = np.array([tendon.pulley_ratio for tendon in tendons])[:, None]
        count, n = losses.shape
        own = pad_tiles([np.ones(len(tendon.pulley_radii)) for tendon in tendons], 0.0)
        springs = np.array([tendon.spring_stiffness for tendon in tendons])[:, None]
        self._give = own / (self._stiffness + np.where(own > 0.0, springs, 1.0))
        mu = np.array([tendon.friction for tendon in tendons])[:, None] * own
        mu[:, 0] = [tendon.entry_friction for tendon in tendons]
        self._mu = np.where(mu > LEAST_FRICTION, mu, 0.0)
        # v = travel @ t + by_push @ pushed + by_turn @ wound + constant f, in newtons (over `unit`)
        unit = self._ratio**2 * (self._give.sum(axis=1) / own.sum(axis=1))[:, None]
        later = np.triu(np.ones((n, n))) / unit[..., None]
        travel = later * (self._ratio**2 * self._give)[:, None, :]
        by_push = -later * (self._ratio * self._give)[:, None, :]
        constant = -np.einsum("fij,fj->fi", travel, losses)
        given = np.concatenate([by_push, later, constant[..., None]], axis=-1)
        self._signs, slipping = self._choices(count, n)
        # where next to nothing slips is looked for first
        ends = np.searchsorted(slipping, [1, 2, 2 * n + 1])
        self._groups = [np.arange(start, end) for start, end in itertools.pairwise([0, *ends])]
        self._tensions = np.stack(
            [self._regime(signs, travel, given) for signs in np.moveaxis(self._signs, 1, 0)], axis=1
        )
        self._travels = travel[:, None] @ self._tensions + given[:, None]

    def _choices(self, count: int, n: int) -> tuple[Indices, Indices]:
        """Return the signs of every finger's boundaries in every regime, shape (F, R, n).

        0 sticks, 1 slips toward the motor, −1 away; all are 2 where the tendon is slack.
        And how many boundaries slip in each, in rising order, shape (R,).
        """
        held = self.scheme == "held"
        options = [(0,) if held and i == 0 else (0, 1, -1) for i in range(n)]
        choices = sorted(itertools.product(*options), key=lambda signs: sum(map(abs, signs)))
        if held:
            choices.append((2,) * n)
        signs = np.tile(np.array(choices), (count, 1, 1))
        slides = self._mu == 0.0
        slides[:, 0] &= not held
        signs = np.where(slides[:, None] & (signs != 2), 1, signs)
        return signs, np.abs(choices).sum(axis=1)

    def _regime(self, signs: Indices, travel: Array, given: Array) -> Array:
        """Return tensions by (pushed, wound, f) in a regime of each finger, (F, n, 2 n + 1)."""
        n = signs.shape[1]
        sticks = (signs == 0)[..., None]
        factor = np.where(signs == 2, 0.0, 1.0 - signs * self._mu)
        slides = np.eye(n) - factor[..., None] * np.eye(n, k=-1)
        rows = np.where(sticks, travel, slides)
        aims = np.where(sticks, -given, 0.0)
        aims[:, 0, -1] = np.where(sticks[:, 0, 0], aims[:, 0, -1], factor[:, 0])
        return np.asarray(np.linalg.solve(rows, aims))

    def respond(
        self,
        slips: NDArray[Any],
        turns: NDArray[Any],
        tension: NDArray[Any],
        at_rest: NDArray[Any],
    ) -> TendonResponse:
        """Return tensions and shears after changes of load, each from the state of rest.

        Parameters
        ----------
        slips : ndarray, shape (F, m, n)
            δx_i, displacement of each phalanx along the rock, toward the finger's base [m].
        turns : ndarray, shape (F, m, n)
            δq_i, turn of each joint, closing [rad].
        tension : ndarray, shape (F, m)
            Tension of each motor at rest [N].
        at_rest : ndarray, shape (F, m, n)
            Shear of each tile at rest [N].
        """
        pushed = slips * self._stiffness[:, None]
        given = [pushed, turns * self._radii[:, None], tension[..., None]]
        changes = np.concatenate(given, axis=-1)
        regime = self._consistent(changes.real)
        tensions = np.empty(pushed.shape, dtype=changes.dtype)
        for i, found in enumerate(regime):
            for k in np.unique(found):
                those = found == k
                tensions[i, those] = changes[i, those] @ self._tensions[i, k].T
        rise = self._ratio[:, None] * (tensions - tension[..., None] * self._losses[:, None])
        travel = self._give[:, None] * (rise - pushed)
        shears = at_rest + pushed + self._stiffness[:, None] * travel
        return TendonResponse(tensions, shears, regime)

    def _consistent(self, changes: Array) -> Indices:
        """Return the regime of each change of load (F, m, 2 n + 1), shape (F, m).

        The first that does not contradict itself; by rounding, that which does least.
        """
        first, *later = self._groups
        least = self._contradictions(np.arange(len(changes)), first, changes)[..., 0]
        found = np.zeros(least.shape, dtype=np.intp)
        for i in np.flatnonzero((least > 0.0).any(axis=1)):
            for group in later:
                left = np.flatnonzero(least[i] > 0.0)
                # so many at once, which bounds the memory
                for those in np.array_split(left, -(-len(left) // 4096)) if len(left) else ():
                    off = self._contradictions(np.array([i]), group, changes[i : i + 1, those])[0]
                    best = off.argmin(axis=1)
                    worst = off[np.arange(len(those)), best]
                    better = worst < least[i, those]
                    found[i, those[better]] = group[best[better]]
                    least[i, those[better]] = worst[better]
        return found

    def _contradictions(self, fingers: Indices, group: Indices, changes: Array) -> Array:
        """Return by how many newtons changes (k, m, 2 n + 1) contradict regimes, (k, m, R)."""
        own = fingers[:, None], group
        signs, mu = self._signs[own][:, :, None], self._mu[fingers][:, None, None]
        with np.errstate(invalid="ignore"):
            t = changes[:, None] @ np.swapaxes(self._tensions[own], -1, -2)
            v = changes[:, None] @ np.swapaxes(self._travels[own], -1, -2)
            motor = np.broadcast_to(changes[:, None, :, -1:], t[..., :1].shape)
            before = np.concatenate([motor, t[..., :-1]], axis=-1)
            stuck = np.maximum((1.0 - mu) * before - t, t - (1.0 + mu) * before)
            off = np.where(signs == 0, stuck, np.where(mu > 0.0, -signs * v, 0.0))
            if self.scheme == "held":
                slack = (signs == 2).all(axis=-1)[..., 0]
                off[slack] = 0.0
                off[..., 0] = np.where(slack[..., None], -v[..., 0], -t[..., 0])
            worst = np.swapaxes(off.max(axis=-1), 1, 2)
        return np.where(
            worst <= BASE_TOLERANCES.force, 0.0, np.where(np.isnan(worst), np.inf, worst)
        )
