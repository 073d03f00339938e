"""How far { o + V y : A y ≤ b } reaches, by linear programming."""

from __future__ import annotations

from typing import Final

import numpy as np

from hand_models.base import Array
from hand_models.wrench_spaces.linear_programs import linear_program

__all__ = ["ends_along", "farthest"]

EXACT: Final = 1e-9
"""Tolerance of the linear program of a support function [N]."""


def farthest(slopes: Array, A: Array, b: Array) -> Array | None:
    """Return the y of { y : A y ≤ b } with the largest slopes · y; None if there is none.

    Raises
    ------
    SolverError
        If the program fails.
    """
    return linear_program(-slopes, A, b, "support", tolerance=EXACT)


def ends_along(
    direction: Array, origin: Array, generators: Array, A: Array, b: Array
) -> tuple[float, float] | None:
    """Return the least and the largest t for which t d = o + V y, A y ≤ b has a y; None if none.

    Parameters
    ----------
    direction, origin : ndarray, shape (n,)
        d and o.
    generators : ndarray, shape (n, m)
        V.
    A, b : ndarray, shapes (k, m), (k,)

    Raises
    ------
    SolverError
        If a program fails.
    """
    m = generators.shape[1]
    equations = np.hstack([generators, -direction[:, None]])
    rows = np.hstack([A, np.zeros((len(b), 1))])
    ends = []
    for sign in (1.0, -1.0):
        cost = np.zeros(m + 1)
        cost[-1] = sign
        found = linear_program(cost, rows, b, "capability", A_eq=equations, b_eq=-origin)
        if found is None:
            return None
        ends.append(float(found[-1]))
    return ends[0], ends[1]
