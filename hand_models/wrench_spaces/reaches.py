"""How far { o + V y : A y ≤ b } reaches, by linear programming."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.optimize import linprog

from hand_models.base import Array, SolverError

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
    result = linprog(
        -slopes,
        A_ub=A,
        b_ub=b,
        bounds=[(None, None)] * len(slopes),
        method="highs",
        options={"primal_feasibility_tolerance": EXACT, "dual_feasibility_tolerance": EXACT},
    )
    if result.status == 2:
        return None
    if result.status != 0 or result.x is None:
        raise SolverError(f"support: {result.message}")
    return np.asarray(result.x)


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
        # the presolve of an older HiGHS leaves some of these undecided
        for presolve in (True, False):
            result = linprog(
                cost,
                A_ub=rows,
                b_ub=b,
                A_eq=equations,
                b_eq=-origin,
                bounds=[(None, None)] * (m + 1),
                method="highs",
                options={"presolve": presolve},
            )
            if result.status in (0, 2):
                break
        if result.status == 2:
            return None
        if result.status != 0 or result.x is None:
            raise SolverError(f"capability: {result.message}")
        ends.append(float(result.x[-1]))
    return ends[0], ends[1]
