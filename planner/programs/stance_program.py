"""Base class of the conic programs of a stance: the constraints, and how the solver is called.

`StanceProgram.define` writes the program in CVXPY, as readable mathematics. `StanceProgram.conic`
writes the same program in the solver's form, which takes a fraction of the time. `run` solves the
second; if the solver returns neither a solution nor a certificate, a retry uses iterative
refinement, and at last CVXPY solves the first.
"""

from __future__ import annotations

import math
import threading
import warnings
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from hand_models.base import Array
from planner import deadline
from planner.programs.conic import (
    INFEASIBLE_STATUSES,
    OUT_OF_TIME,
    SOLVED_STATUSES,
    SOLVER_ERROR,
    WAITING_SOLVERS,
    Columns,
    ConicProgram,
    ConicSolver,
    Outcome,
)
from planner.programs.stance_data import StanceData, parted

if TYPE_CHECKING:
    import cvxpy as cp

__all__ = ["CLARABEL_SETTINGS", "REFINED_SETTINGS", "SHARP_SETTINGS", "Definition", "StanceProgram"]

CLARABEL_SETTINGS: Final[dict[str, Any]] = {
    "equilibrate_enable": False,
    "iterative_refinement_enable": False,
    "presolve_enable": False,
    "chordal_decomposition_enable": False,
    "max_threads": 1,
    "tol_gap_abs": 1e-9,
    "tol_gap_rel": 1e-9,
    "tol_feas": 1e-9,
}
"""Default options of Clarabel: no equilibration, as all data are scaled, and no refinement."""

SHARP_SETTINGS: Final[dict[str, Any]] = {
    **CLARABEL_SETTINGS,
    "tol_gap_abs": 1e-11,
    "tol_gap_rel": 1e-11,
}
"""Options of Clarabel for programs where a small term of the objective decides."""

REFINED_SETTINGS: Final[dict[str, Any]] = {**CLARABEL_SETTINGS, "iterative_refinement_enable": True}
"""Options of Clarabel for a retry, with iterative refinement."""

_cvxpy = threading.Lock()
"""CVXPY counts its variables for all threads, and loses count where two define at a time."""


class Definition(NamedTuple):
    """A conic program written in CVXPY.

    Attributes
    ----------
    problem : Problem
        CVXPY problem: objective and constraints.
    variables : tuple of Variable
        Variables that the caller reads, in order; the hands' loads z come last.
    rows : tuple of Constraint
        The balance of wrenches, the limits, and the hard rows.
    """

    problem: cp.Problem
    variables: tuple[cp.Variable, ...]
    rows: tuple[cp.Constraint, cp.Constraint, cp.Constraint]


class StanceProgram(ABC):
    """A conic program whose constraints are the balance, limits and hard rows of a stance.

    The scaled loads z, shape (M,), are those of all hands one below the other. So the balance
    Σ_h G_h z_h is G z, and L and H are block-diagonal.

    Parameters
    ----------
    data : StanceData
        Scaled rows of all hands, and the wrench that they must balance.

    Attributes
    ----------
    data : StanceData
        Scaled rows of all hands, and the wrench that they must balance.
    G : ndarray, shape (nb, M)
        Balance: body wrench per load.
    L, l0 : ndarray, shapes (Σ nl, M), (Σ nl,)
        Limits of all hands: utilisations L z + l0.
    H, h : ndarray, shapes (Σ nh, M), (Σ nh,)
        Hard rows of all hands: H z ≤ h.
    size : int
        Number of loads M.
    """

    settings: Sequence[Mapping[str, Any]] = (CLARABEL_SETTINGS, REFINED_SETTINGS)
    wanted: int = 0
    """Number of leading variables, before the loads, that `run` returns."""

    def __init__(self, data: StanceData) -> None:
        self.data = data
        rows, balance = data.rows, len(data.wrench)
        self.G = rows.whole[:balance]
        hard = balance + rows.limits
        self.L, self.H = rows.whole[balance:hard], rows.whole[hard:]
        self.size = len(rows.unit)
        self.l0, self.h = -rows.rest[: rows.limits], rows.rest[rows.limits :]

    @abstractmethod
    def define(self) -> Definition:
        """Return the program written in CVXPY."""

    @abstractmethod
    def conic(self) -> ConicProgram:
        """Return the program in the solver's form.

        Columns: the `wanted` variables, auxiliary variables, then the loads z. Rows: further
        equations, the balance, further equations, limits, hard rows, further inequalities or cones.
        """

    def loads(self) -> cp.Variable:
        """Return a CVXPY variable for the scaled loads z of all hands, shape (M,)."""
        import cvxpy as cp

        return cp.Variable(self.size)

    def rows(
        self, z: cp.Variable, cap: cp.Expression | float
    ) -> tuple[cp.Constraint, cp.Constraint, cp.Constraint]:
        """Return the CVXPY constraints of the loads z: balance, limits at a utilisation, hard rows.

        Parameters
        ----------
        z : Variable, shape (M,)
            Scaled loads of all hands.
        cap : Expression or float
            Largest utilisation: a number, a scalar, or one value for each limit row.
        """
        return (
            self.G @ z == self.data.offset,
            self.L @ z + self.l0 <= cap,
            self.H @ z <= self.h,
        )

    def blocks(
        self, front: int, above: Array | None = None, below: int = 0
    ) -> tuple[Array, Columns, Array]:
        """Return the parts of the solver's matrix and right-hand side that all programs share.

        Parameters
        ----------
        front : int
            Number of columns before those of the loads.
        above : ndarray, shape (rows, M), optional
            Rows above the balance, in the columns of the loads.
        below : int, optional
            Number of rows below the hard rows; zero in the columns of the loads.

        Returns
        -------
        columns : ndarray, shape (all rows, front)
            Zeros, to be filled in by the caller.
        loads : Columns
            Columns of the loads: the rows above, balance, limits and hard rows.
        b : ndarray, shape (all rows,)
            Right-hand side of the balance, of the limits at utilisation 0 and of the hard rows;
            zero in the other rows.
        """
        rows = self.data.rows
        loads, first = rows.columns, 0
        if above is not None:
            loads, first = Columns.of(np.vstack([above, rows.whole])), len(above)
        b = np.zeros(first + len(rows.whole) + below)
        own = b[first:]
        own[: len(self.G)] = self.data.offset
        own[len(self.G) : len(rows.whole)] = rows.rest
        return np.zeros((len(b), front)), loads, b

    @property
    def of_limits(self) -> slice:
        """Indices of the limit rows in the solver's form, if the balance comes first."""
        return slice(len(self.G), len(self.G) + len(self.L))

    def solve(self) -> Outcome:
        """Solve the program, and return its loads or its infeasibility certificate."""
        return self.run()[0]

    def run(self) -> tuple[Outcome, Array | None]:
        """Solve the program in the solver's form; if that fails, retry refined, then with CVXPY.

        Returns
        -------
        outcome : Outcome
            Loads and dual values, or an infeasibility certificate.
        further : ndarray, shape (wanted,), or None
            The `wanted` variables before the loads; None without a solution.
        """
        program = self.conic()
        found = WAITING_SOLVERS.solve(program, self.settings[0])
        # after which nothing else is tried
        ends = ("optimal", "infeasible", "unbounded", OUT_OF_TIME)
        for settings in self.settings[1:]:
            if found.status in ends or deadline.expired():
                break
            found = ConicSolver(program, settings).solve()
        ended = found.status in ends or deadline.expired()
        if not ended and all(
            np.isfinite(part).all()
            for part in (program.P, program.q, program.b, self.data.rows.whole)
        ):
            return self.by_definition()
        duals = found.multipliers
        if duals is not None:
            balance = duals[program.above : program.above + len(self.G)]
            duals = np.concatenate([balance, duals[program.zero :]])
        return self._read(found.status, found.iterations, found.value, found.x, duals)

    def by_definition(self, own: Mapping[str, Any] | None = None) -> tuple[Outcome, Array | None]:
        """Solve the CVXPY definition of the program.

        Parameters
        ----------
        own : mapping of str to any, optional
            Arguments of ``cvxpy.Problem.solve``; by default Clarabel with CVXPY's options for it.

        Returns
        -------
        outcome : Outcome
            Loads and dual values, or an infeasibility certificate.
        further : ndarray, shape (wanted,), or None
            The `wanted` variables before the loads; None without a solution.
        """
        import cvxpy as cp

        left = deadline.left()
        options = dict(own or {"solver": "CLARABEL", "max_threads": 1})
        if left is not None and own is None:
            options["time_limit"] = left
        with _cvxpy, warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            # of what has no end, a value is none
            warnings.simplefilter("ignore", RuntimeWarning)
            problem, variables, rows = self.define()
            try:
                problem.solve(**options)
            except cp.SolverError:
                return self._read(SOLVER_ERROR, 0, math.nan, None, None)
        status, stats = problem.status, problem.solver_stats
        x = duals = None
        if status in SOLVED_STATUSES:
            x = np.concatenate([np.atleast_1d(variable.value) for variable in variables])
        values = [row.dual_value for row in rows if row.size]
        ended = status in (*SOLVED_STATUSES, *INFEASIBLE_STATUSES)
        if ended and all(each is not None for each in values):
            duals = np.concatenate(values)
        if status == cp.USER_LIMIT and left is not None:
            status = OUT_OF_TIME
        value = math.nan if x is None else problem.value
        return self._read(status, int(stats.num_iters or 0), value, x, duals)

    def _read(
        self,
        status: str,
        iterations: int,
        value: float,
        x: Array | None,
        duals: Array | None,
    ) -> tuple[Outcome, Array | None]:
        """Return how it ended.

        What is wanted comes first in x, and the loads last; of the multipliers, those of the
        balance, limits and hard rows.
        """
        hands, unit = self.data.hands, self.data.rows.unit
        loads: tuple[Array, ...] = ()
        if x is not None and math.isfinite(value):
            loads = parted(x[-len(unit) :] * unit, [len(hand.unit) for hand in hands])
        balance, limits, hard = (
            (None, (), ()) if duals is None else self.data.by_rows(duals, limits=len(self.L) > 0)
        )
        outcome = Outcome(
            solved=bool(loads),
            status=status,
            iterations=iterations,
            value=value if loads else math.nan,
            loads=loads,
            limit_duals=limits,
            hard_duals=hard,
            balance_dual=balance,
        )
        return outcome, x[: self.wanted] if loads and x is not None else None
