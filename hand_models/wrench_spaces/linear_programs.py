"""Linear programs, solved a second time where the solver's presolve leaves them undecided."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy

from hand_models.base import Array, SolverError, UnsupportedError

__all__ = ["ends_along", "linear_program"]


def linear_program(
    cost: Array, A: Array, b: Array, what: str, *, tolerance: float | None = None, **more: Any
) -> Array | None:
    """Return the x that minimises cost · x subject to A x ≤ b; None if no x is feasible.

    A program that the solver leaves undecided is retried without presolve.

    Parameters
    ----------
    cost : ndarray, shape (n,)
        Coefficients of the objective.
    A, b : ndarray, shapes (k, n), (k,)
        Constraints.
    what : str
        Name of the program, for error messages.
    tolerance : float, optional
        Feasibility tolerance; the solver's default otherwise.
    **more
        Keyword arguments of `scipy.optimize.linprog`; x is free where no bounds are given.

    Returns
    -------
    ndarray, shape (n,), or None

    Raises
    ------
    UnsupportedError
        If the objective is unbounded.
    SolverError
        If the solver does not decide the program.
    """
    options: Any = {}
    if tolerance is not None:
        options = {
            "primal_feasibility_tolerance": tolerance,
            "dual_feasibility_tolerance": tolerance,
        }
    more = {"bounds": [(None, None)] * len(cost), **more}
    for presolve in (True, False):
        found: Any = scipy.optimize.linprog(
            cost, A_ub=A, b_ub=b, method="highs", options=options | {"presolve": presolve}, **more
        )
        # of linprog's statuses 0 is solved, 2 empty, 3 unbounded
        if found.status == 0 and found.x is not None:
            return np.asarray(found.x)
        if found.status == 2:
            return None
    if found.status == 3:
        raise UnsupportedError(
            f"{what} is unbounded: fingers with lateral reactions (grasp.lateral) would bound it"
        )
    raise SolverError(
        f"{what}: no solution of a linear program found (HiGHS said {found.message}); change a "
        "number slightly"
    )


def ends_along(
    direction: Array, origin: Array, generators: Array, A: Array, b: Array
) -> tuple[float, float] | None:
    """Return the least and the largest t for which t d = o + V y has a y with A y ≤ b.

    Parameters
    ----------
    direction, origin : ndarray, shape (n,)
        Direction d and point o.
    generators : ndarray, shape (n, m)
        V, change of the point per unit of each y.
    A, b : ndarray, shapes (k, m), (k,)
        Constraints on y.

    Returns
    -------
    tuple of (float, float), or None
        Least and largest t; None if no t is feasible.

    Raises
    ------
    UnsupportedError
        If t is unbounded.
    SolverError
        If the solver does not decide a program.
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
