"""Conic programs in the solver's form (Clarabel), with solvers that are set up once and reused.

    min ½ xᵀ diag(P) x + qᵀ x   with   A x + s = b,  s ∈ K.

The cone K is a product of zeros, then nonnegative numbers, then one second-order cone. A is passed
sparse, because most entries of a stance's rows are zero: a dense A costs three times as much. A
solver is set up for one sparsity pattern, kept in the cache `Solvers`, and given the numbers of
later programs of that pattern. No solution depends on the programs that were solved before it.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import clarabel
import numpy as np

from hand_models.base import Array, Indices, StoreInfo, enlist
from planner import deadline

__all__ = [
    "INFEASIBLE_STATUSES",
    "OUT_OF_TIME",
    "SOLVED_STATUSES",
    "SOLVER_ERROR",
    "WAITING_SOLVERS",
    "Columns",
    "ConicProgram",
    "ConicSolution",
    "ConicSolver",
    "Outcome",
    "Reached",
    "Solvers",
]

OUT_OF_TIME: Final = "out of time"
"""Status of a solver that was stopped by the deadline."""

CLARABEL_STATUSES: Final = {
    "Solved": "optimal",
    "AlmostSolved": "optimal_inaccurate",
    "PrimalInfeasible": "infeasible",
    "AlmostPrimalInfeasible": "infeasible_inaccurate",
    "DualInfeasible": "unbounded",
    "AlmostDualInfeasible": "unbounded_inaccurate",
    "MaxIterations": "user_limit",
    "MaxTime": "user_limit",
    "CallbackTerminated": OUT_OF_TIME,
}
"""CVXPY's name of each of Clarabel's statuses; any other status becomes `SOLVER_ERROR`."""

SOLVER_ERROR: Final = "solver_error"

SOLVED_STATUSES: Final = ("optimal", "optimal_inaccurate")
"""Statuses of a program that has a solution."""

INFEASIBLE_STATUSES: Final = ("infeasible", "infeasible_inaccurate")
"""Statuses whose multipliers are an infeasibility (Farkas) certificate."""


class Columns(NamedTuple):
    """Sparse matrix in compressed sparse column format (CSC).

    Attributes
    ----------
    values : ndarray, shape (n,)
        Entries that are not zero, column by column.
    rows : ndarray of int, shape (n,)
        Row index of each entry.
    starts : ndarray of int, shape (columns + 1,)
        Index of each column's first entry in ``values``; last, the number of entries.
    """

    values: Array
    rows: Indices
    starts: Indices

    @classmethod
    def of(cls, matrix: Array) -> Columns:
        """Convert a dense matrix, shape (rows, columns), to compressed sparse columns."""
        height, width = matrix.shape
        flat = matrix.T.ravel()
        # of truth values they are found six times as fast as of numbers
        (places,) = (flat != 0.0).nonzero()
        starts = places.searchsorted(height * np.arange(width + 1))
        return cls(flat.take(places), places % max(height, 1), starts)

    @classmethod
    def beside(cls, parts: Sequence[Columns]) -> Columns:
        """Concatenate sparse matrices with equal numbers of rows from left to right."""
        ends = np.cumsum([0, *(part.starts[-1] for part in parts)])
        starts = [part.starts[:-1] + end for part, end in zip(parts, ends, strict=False)]
        return cls(
            np.concatenate([part.values for part in parts]),
            np.concatenate([part.rows for part in parts]),
            np.concatenate([*starts, ends[-1:]]),
        )


class ConicProgram(NamedTuple):
    """Data of one conic program with m rows and n columns: P, q, A, b and the sizes of the cones.

    Attributes
    ----------
    P, q : ndarray, shape (n,)
        Diagonal of the quadratic cost, and linear cost.
    A : tuple of Columns
        Blocks of the constraint matrix from left to right, each with m rows.
    b : ndarray, shape (m,)
        Right-hand side.
    zero : int
        Number of equations, which are the first rows.
    above : int
        Number of those equations that come before the balance of wrenches.
    second_order : int
        Number of rows of the second-order cone, which are the last rows. All rows between the
        equations and the second-order cone are inequalities.
    """

    P: Array
    q: Array
    A: tuple[Columns, ...]
    b: Array
    zero: int
    above: int = 0
    second_order: int = 0


class ConicSolution(NamedTuple):
    """Solution of a conic program, or its infeasibility (Farkas) certificate.

    Attributes
    ----------
    status : str
        CVXPY's name of the solver's status, or `OUT_OF_TIME`.
    iterations : int
        Iterations of the interior-point method.
    value : float
        Objective at the solution; NaN without a solution.
    x : ndarray, shape (n,), or None
        Variables; None without a solution.
    multipliers : ndarray, shape (m,), or None
        Dual values (Lagrange multipliers) of the rows. Of an infeasible program, its infeasibility
        certificate. None for every other status without a solution.
    """

    status: str
    iterations: int = 0
    value: float = float("nan")
    x: Array | None = None
    multipliers: Array | None = None


class ConicSolver:
    """A Clarabel solver set up for one sparsity pattern, with the numbers of its latest program.

    Parameters
    ----------
    program : ConicProgram
        Program whose sparsity pattern the solver is set up for.
    settings : mapping of str to value
        Options of Clarabel. Presolve and chordal decomposition must be off for `update`.
    """

    def __init__(self, program: ConicProgram, settings: Mapping[str, Any]) -> None:
        self.settings = settings
        self.pattern = Pattern.of(program)
        self._numbers = _numbers(program)
        rows, columns = len(program.b), len(program.q)
        A = _Matrix.of(Columns.beside(program.A), rows)
        # a program without a quadratic term begins elsewhere
        diagonal = np.arange(columns + 1)
        P = Columns(program.P, diagonal[:-1], diagonal)
        if not self.pattern.quadratic:
            P = Columns(P.values[:0], P.rows[:0], np.zeros_like(P.starts))
        between = rows - program.zero - program.second_order
        cones = [clarabel.ZeroConeT(program.zero), clarabel.NonnegativeConeT(between)]
        if program.second_order:
            cones.append(clarabel.SecondOrderConeT(program.second_order))
        chosen = clarabel.DefaultSettings()
        chosen.verbose = False
        for name, value in settings.items():
            setattr(chosen, name, value)
        self._solver = clarabel.DefaultSolver(
            _Matrix.of(P, columns), program.q, A, program.b, cones, chosen
        )

    def update(self, program: ConicProgram) -> None:
        """Replace the solver's numbers by those of a program with the same sparsity pattern."""
        numbers = _numbers(program)
        changed = {
            name: value
            for name, value in numbers.items()
            if not np.array_equal(value, self._numbers[name])
        }
        # it takes lists faster than arrays, and cannot take nothing
        if changed:
            self._solver.update(**{name: value.tolist() for name, value in changed.items()})
            self._numbers = numbers

    def solve(self) -> ConicSolution:
        """Solve the program passed last; stop at the deadline of `planner.deadline`, if one is set.

        If the deadline expires, the solution's status is `OUT_OF_TIME`.
        """
        if deadline.left() is None:
            return _read(self._solver.solve())
        caught: list[BaseException] = []

        def over(_: object) -> bool:
            # the solver would print what is raised here, and go on
            try:
                return deadline.expired()
            except BaseException as error:
                caught.append(error)
                return True

        self._solver.set_termination_callback(over)
        try:
            raw = self._solver.solve()
        finally:
            self._solver.unset_termination_callback()
        if caught:
            raise caught[0]
        return _read(raw)


class _Matrix(NamedTuple):
    """A matrix in compressed columns, by the names of SciPy's, which the solver reads.

    It is passed as lists, which are read faster than arrays; of SciPy a plan needs nothing else.
    """

    data: list[float]
    indices: list[int]
    indptr: list[int]
    shape: tuple[int, int]
    has_canonical_format: bool = True

    @classmethod
    def of(cls, columns: Columns, height: int) -> _Matrix:
        """Return columns of so many rows."""
        values, rows, starts = (part.tolist() for part in columns)
        return cls(values, rows, starts, (height, len(starts) - 1))


class Solvers:
    """Bounded cache (LRU) of idle solvers, reused for programs of the same pattern. Thread-safe.

    A solver serves one caller at a time, so that threads do not wait for each other.

    Parameters
    ----------
    most : int
        Largest number of idle solvers; beyond it the least recently used solver is dropped.
    """

    name = "solvers"

    def __init__(self, most: int) -> None:
        self._most = most
        self._lock = threading.Lock()
        self._idle: list[ConicSolver] = []
        self._hits = self._misses = 0
        enlist(self)

    def info(self) -> StoreInfo:
        """Return the cache's hits and misses, its number of idle solvers, and its bound."""
        with self._lock:
            return StoreInfo(self._hits, self._misses, len(self._idle), self._most)

    def clear(self) -> None:
        """Drop all idle solvers, and set hits and misses to zero."""
        with self._lock:
            self._idle.clear()
            self._hits = self._misses = 0

    def solve(self, program: ConicProgram, settings: Mapping[str, Any]) -> ConicSolution:
        """Solve a program with an idle solver of its pattern and settings, or with a new one."""
        solver = self._take(Pattern.of(program), settings)
        if solver is None:
            solver = ConicSolver(program, settings)
        else:
            solver.update(program)
        solution = solver.solve()
        # one that has met what is no number, or was interrupted, may not forget it
        if solution.status != SOLVER_ERROR:
            with self._lock:
                self._idle.append(solver)
                del self._idle[: -self._most]
        return solution

    def _take(self, pattern: Pattern, settings: Mapping[str, Any]) -> ConicSolver | None:
        """Take the solver of a pattern that was used last, if one waits."""
        with self._lock:
            for i in reversed(range(len(self._idle))):
                if self._idle[i].pattern == pattern and self._idle[i].settings == settings:
                    self._hits += 1
                    return self._idle.pop(i)
            self._misses += 1
        return None


WAITING_SOLVERS: Final = Solvers(64)
"""Solver cache of this process."""


class Pattern(NamedTuple):
    """Sparsity pattern and cone sizes of a program: the key by which a solver is reused.

    Attributes
    ----------
    rows, columns, zero, second_order : int
        Shape of A, and numbers of equations and of rows of the second-order cone.
    quadratic : bool
        True if P has an entry that is not zero.
    places : tuple of bytes
        Row indices and column starts of each block of A, as bytes.
    """

    rows: int
    columns: int
    zero: int
    second_order: int
    quadratic: bool
    places: tuple[bytes, ...]

    @classmethod
    def of(cls, program: ConicProgram) -> Pattern:
        """Return the sparsity pattern of a program."""
        return cls(
            len(program.b),
            len(program.q),
            program.zero,
            program.second_order,
            bool(program.P.any()),
            tuple(part.tobytes() for each in program.A for part in (each.rows, each.starts)),
        )


def _numbers(program: ConicProgram) -> dict[str, Array]:
    A = np.concatenate([part.values for part in program.A])
    return {"P": program.P, "q": program.q, "A": A, "b": program.b}


def _read(raw: Any) -> ConicSolution:
    status = CLARABEL_STATUSES.get(str(raw.status), SOLVER_ERROR)
    if status in SOLVED_STATUSES:
        return ConicSolution(status, raw.iterations, raw.obj_val, np.array(raw.x), np.array(raw.z))
    proof = np.array(raw.z) if status in INFEASIBLE_STATUSES else None
    return ConicSolution(status, raw.iterations, multipliers=proof)


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of a stance's conic program: loads of all hands, or an infeasibility certificate.

    Attributes
    ----------
    solved : bool
        True if the solver returned loads. The planner checks the loads separately.
    status : str
        CVXPY's name of the solver's status, or `OUT_OF_TIME`.
    iterations : int
        Iterations of the solver.
    value : float
        Objective; NaN if not solved.
    loads : tuple of ndarray, shape (m,)
        Loads y of each hand [N]; of a floating wrist its twist [m, rad], of a compliant one
        tensions [N] and twist. Empty if not solved.
    limit_duals, hard_duals : tuple of ndarray, shapes (nl,), (nh,)
        Dual values of each hand's limit rows and hard rows. Of an infeasible program, its Farkas
        certificate. Empty if the solver returned no dual values.
    balance_dual : ndarray, shape (nb,), or None
        Dual values of the balance of wrenches.
    """

    solved: bool
    status: str
    iterations: int
    value: float
    loads: tuple[Array, ...] = ()
    limit_duals: tuple[Array, ...] = ()
    hard_duals: tuple[Array, ...] = ()
    balance_dual: Array | None = None


class Reached(NamedTuple):
    """Result of `Reach`: solver's outcome, and the variables t, shape (k,), NaN if not solved."""

    outcome: Outcome
    t: Array
