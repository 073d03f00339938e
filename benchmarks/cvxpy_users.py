"""A plan's program as users of CVXPY write it: in SI units, with default options.

Once with the numbers as constants, so that the problem is built for each query, and once with
parameters (DPP), so that it is compiled once.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cvxpy as cp
import numpy as np

from hand_models.wrench_spaces import WrenchSpace

__all__ = ["Parametrised", "Query", "rebuilt"]


class Query:
    """What a plan is asked of: each hand's set, and how its wrench counts for the body.

    Parameters
    ----------
    spaces : sequence of WrenchSpace
    transports : sequence of ndarray, shape (6, 6)
        Ad(B←H) of each hand.
    wrench : ndarray, shape (6,)
        The body wrench that is needed.
    weights : sequence of ndarray, shape (m,)
        Of each hand's loads, whose squares make the plan unique [1/N].
    """

    def __init__(
        self,
        spaces: Sequence[WrenchSpace],
        transports: Sequence[np.ndarray],
        wrench: np.ndarray,
        weights: Sequence[np.ndarray],
    ) -> None:
        self.hands = [
            {
                "V": transport @ space.generators,
                "o": transport @ space.origin,
                "L": space.L,
                "l0": space.l0,
                "s": space.s,
                "H": space.H,
                "h": space.h,
                "w": w,
            }
            for space, transport, w in zip(spaces, transports, weights, strict=True)
        ]
        self.wrench = wrench


def _problem(hands: Sequence[dict[str, Any]], wrench: Any) -> tuple[cp.Problem, cp.Variable]:
    """Return the problem, for numbers or parameters, and its utilisation."""
    u = cp.Variable()
    loads = [cp.Variable(hand["V"].shape[1]) for hand in hands]
    given, squares, rows = 0, 0, []
    for hand, y in zip(hands, loads, strict=True):
        given = given - (hand["V"] @ y + hand["o"])
        squares = squares + cp.sum_squares(cp.multiply(hand["w"], y))
        rows += [hand["L"] @ y + hand["l0"] <= u * hand["s"], hand["H"] @ y <= hand["h"]]
    return cp.Problem(cp.Minimize(u + squares), [given == wrench, *rows]), u


def _solved(problem: cp.Problem, u: cp.Variable) -> float:
    problem.solve(solver=cp.CLARABEL)
    if problem.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
        raise AssertionError(f"CVXPY: {problem.status}")
    return float(u.value)


def rebuilt(query: Query) -> float:
    """Build and solve for one query; return the utilisation."""
    return _solved(*_problem(query.hands, query.wrench))


class Parametrised:
    """The problem with a parameter for each block of numbers, for queries like the first."""

    def __init__(self, like: Query) -> None:
        self._hands = [
            {name: cp.Parameter(value.shape) for name, value in hand.items()} for hand in like.hands
        ]
        self._wrench = cp.Parameter(6)
        self._problem, self._u = _problem(self._hands, self._wrench)

    def solve(self, query: Query) -> float:
        """Solve with the numbers of a query; return the utilisation."""
        self._wrench.value = query.wrench
        for hand, values in zip(self._hands, query.hands, strict=True):
            for name, value in values.items():
                hand[name].value = value
        return _solved(self._problem, self._u)
