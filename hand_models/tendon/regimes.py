"""Stick and slip of a finger's tendon for many changes of load at once.

`FingerTendon` solves one change of load as a complementarity problem. From one state of rest, every
choice of which boundaries stick and which way the others slip (a *regime*) makes the tensions an
affine function of the change:

    t = a + B_x (k δx) + B_q (r δq),

and exactly one regime is consistent for each change of load, all of them on their seams. There are
3ⁿ regimes of n boundaries, few enough to try them all.

Everything here also takes complex numbers, so that derivatives are found by complex steps; they are
those of the regime.
"""

from __future__ import annotations

import itertools
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import BASE_TOLERANCES, Array, Indices
from hand_models.tendon.finger_tendon import LEAST_FRICTION, FingerTendon, TendonState

__all__ = ["MotorScheme", "TendonRegimes", "TendonResponse"]

MotorScheme = Literal["held", "tension"]
"""Motor while the load changes: it stands still (held), or keeps its tension."""


class TendonResponse(NamedTuple):
    """Tensions and shears of a finger's tendon, shapes (m, n); ``regime`` has shape (m,).

    Attributes
    ----------
    tensions : ndarray
        t_i [N].
    shears : ndarray
        T_i on the rock [N].
    regime : ndarray of int
    """

    tensions: NDArray[Any]
    shears: NDArray[Any]
    regime: Indices


class TendonRegimes:
    """A finger's tendon and tiles about a state of rest.

    Parameters
    ----------
    tendon : FingerTendon
    state : TendonState
        At rest, without slack.
    scheme : {'held', 'tension'}
        What the motor does.
    """

    def __init__(self, tendon: FingerTendon, state: TendonState, scheme: MotorScheme) -> None:
        self.tendon = tendon
        self.state = state
        self.scheme = scheme
        n = len(tendon.pulley_radii)
        mu = np.full(n, tendon.friction)
        mu[0] = tendon.entry_friction
        self._mu = np.where(mu > LEAST_FRICTION, mu, 0.0)
        stiffness = np.array(tendon.contact_stiffness)
        self._stiffness = stiffness
        self._radii = np.array(tendon.pulley_radii)
        self._give = 1.0 / (stiffness + tendon.spring_stiffness)
        self._unit = tendon.pulley_ratio**2 * float(self._give.mean())
        # v = travel @ t + constant + by_push @ pushed + by_turn @ wound, in newtons (over `unit`)
        later = np.triu(np.ones((n, n))) / self._unit
        c = tendon.pulley_ratio
        self._travel = later * (c**2 * self._give)
        self._by_push = -later * (c * self._give)
        self._by_turn = later
        self._constant = -self._travel @ state.tensions
        self._regimes = [r for r in map(self._regime, self._choices(n)) if r is not None]

    def _choices(self, n: int) -> list[tuple[int, ...]]:
        """Return regimes: 0 sticks, 1 slips toward the motor, −1 away; all 2 if slack."""
        options: list[tuple[int, ...]] = []
        for i, mu in enumerate(self._mu):
            if i == 0 and self.scheme == "held":
                options.append((0,))
            else:
                options.append((0, 1, -1) if mu > 0.0 else (1,))
        choices = sorted(itertools.product(*options), key=lambda c: sum(map(abs, c)))
        if self.scheme == "held":
            choices.append((2,) * n)
        return choices

    def _regime(self, choice: tuple[int, ...]) -> _Regime | None:
        """Return the affine map of a regime."""
        n = len(choice)
        rows, constant = np.zeros((n, n)), np.zeros(n)
        by_push, by_turn = np.zeros((n, n)), np.zeros((n, n))
        for i, sign in enumerate(choice):
            if sign == 0:
                rows[i] = self._travel[i]
                constant[i] = -self._constant[i]
                by_push[i], by_turn[i] = -self._by_push[i], -self._by_turn[i]
                continue
            rows[i, i] = 1.0
            factor = 0.0 if sign == 2 else 1.0 - sign * self._mu[i]
            if i:
                rows[i, i - 1] = -factor
            else:
                constant[i] = factor * self.state.motor_tension
        if abs(np.linalg.det(rows)) < np.finfo(float).tiny:
            return None
        inverse = np.asarray(np.linalg.inv(rows), dtype=float)
        return _Regime(choice, inverse @ constant, inverse @ by_push, inverse @ by_turn)

    def respond(self, slips: NDArray[Any], turns: NDArray[Any]) -> TendonResponse:
        """Return tensions and shears after changes of load, each from the state of rest.

        Parameters
        ----------
        slips : ndarray, shape (m, n)
            δx_i of each phalanx along the rock, toward the finger's base [m].
        turns : ndarray, shape (m, n)
            δq_i of each joint, closing [rad].
        """
        pushed, wound = slips * self._stiffness, turns * self._radii
        first = self._regimes[0]
        tensions = first.tensions(pushed, wound)
        regime = np.zeros(len(slips), dtype=np.intp)
        wrong: Indices = np.flatnonzero(
            ~(self._contradiction(first, tensions, pushed, wound) <= BASE_TOLERANCES.force)
        )
        least = np.full(len(wrong), np.inf)
        left = np.arange(len(wrong))
        for k, candidate in enumerate(self._regimes):
            those = wrong[left]
            tried = candidate.tensions(pushed[those], wound[those])
            off = self._contradiction(candidate, tried, pushed[those], wound[those])
            better = off < least[left]
            least[left[better]] = off[better]
            tensions[those[better]] = tried[better]
            regime[those[better]] = k
            left = left[~(off <= BASE_TOLERANCES.force)]
            if not len(left):
                break
        rise = self.tendon.pulley_ratio * (tensions - self.state.tensions)
        travel = self._give * (rise - pushed)
        shears = self.state.shears + pushed + self._stiffness * travel
        return TendonResponse(tensions, shears, regime)

    def _contradiction(
        self, regime: _Regime, tensions: NDArray[Any], pushed: NDArray[Any], wound: NDArray[Any]
    ) -> Array:
        """Return by how many newtons each change of load contradicts a regime, shape (m,)."""
        t = tensions.real
        v = t @ self._travel.T + self._constant
        v = v + pushed.real @ self._by_push.T + wound.real @ self._by_turn.T
        worst = np.zeros(len(t))
        for i, sign in enumerate(regime.choice):
            if sign == 2:
                if i == 0:
                    worst = np.maximum(worst, -v[:, 0])
            elif sign == 0:
                if i == 0 and self.scheme == "held":
                    worst = np.maximum(worst, -t[:, 0])
                    continue
                before = t[:, i - 1] if i else np.full(len(t), self.state.motor_tension)
                mu = self._mu[i]
                worst = np.maximum(worst, (1.0 - mu) * before - t[:, i])
                worst = np.maximum(worst, t[:, i] - (1.0 + mu) * before)
            elif self._mu[i] > 0.0:
                worst = np.maximum(worst, -sign * v[:, i])
        return worst


class _Regime(NamedTuple):
    """Boundaries that slip, and the tensions then: a + B_x pushed + B_q wound."""

    choice: tuple[int, ...]
    constant: Array
    by_push: Array
    by_turn: Array

    def tensions(self, pushed: NDArray[Any], wound: NDArray[Any]) -> NDArray[Any]:
        return np.asarray(self.constant + pushed @ self.by_push.T + wound @ self.by_turn.T)
