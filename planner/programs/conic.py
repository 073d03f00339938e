"""Conic programs as their solver takes them, at the speed of the solver.

    min ½ xᵀ diag(P) x + qᵀ x   with   A x + s = b,  s ∈ K,

K being zeros, then nonnegative numbers, then one second-order cone. Of A only the entries count
that are not zero: the rows of a stance are mostly zeros, and a solver that does not know costs
three times as much. A solver is set up for a pattern of entries, is kept, and takes over the
numbers of later programs of that pattern: an answer depends on its program alone, not on those
before.
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
"""Status of a solver that the deadline has ended."""

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
"""CVXPY's word for each of Clarabel's; for all others it is `SOLVER_ERROR`."""

SOLVER_ERROR: Final = "solver_error"

SOLVED_STATUSES: Final = ("optimal", "optimal_inaccurate")
"""Statuses with a solution."""

INFEASIBLE_STATUSES: Final = ("infeasible", "infeasible_inaccurate")
"""Statuses with multipliers that prove that there is no solution."""


class Columns(NamedTuple):
    """A matrix without its zeros, in compressed columns.

    Attributes
    ----------
    values : ndarray, shape (n,)
    rows : ndarray of int, shape (n,)
        Of the values, column by column.
    starts : ndarray of int, shape (columns + 1,)
        Where each column begins in them, and where the last one ends.
    """

    values: Array
    rows: Indices
    starts: Indices

    @classmethod
    def of(cls, matrix: Array) -> Columns:
        """Leave the zeros of a matrix out."""
        height, width = matrix.shape
        flat = matrix.T.ravel()
        # of truth values they are found six times as fast as of numbers
        (places,) = (flat != 0.0).nonzero()
        starts = places.searchsorted(height * np.arange(width + 1))
        return cls(flat.take(places), places % max(height, 1), starts)

    @classmethod
    def beside(cls, parts: Sequence[Columns]) -> Columns:
        """Put some with the same rows beside each other."""
        ends = np.cumsum([0, *(part.starts[-1] for part in parts)])
        starts = [part.starts[:-1] + end for part, end in zip(parts, ends, strict=False)]
        return cls(
            np.concatenate([part.values for part in parts]),
            np.concatenate([part.rows for part in parts]),
            np.concatenate([*starts, ends[-1:]]),
        )


class ConicProgram(NamedTuple):
    """A program's data; m rows, n columns.

    Attributes
    ----------
    P, q : ndarray, shape (n,)
    A : tuple of Columns
        Beside each other, all with m rows.
    b : ndarray, shape (m,)
    zero : int
        Rows of equations, the first ones.
    above : int
        Of these, those above the balance.
    second_order : int
        Rows of the second-order cone, the last ones; all between are nonnegative.
    """

    P: Array
    q: Array
    A: tuple[Columns, ...]
    b: Array
    zero: int
    above: int = 0
    second_order: int = 0


class ConicSolution(NamedTuple):
    """Solution of a conic program, or the proof that there is none.

    Attributes
    ----------
    status : str
        CVXPY's word, or `OUT_OF_TIME`.
    iterations : int
    value : float
        The objective; NaN without one.
    x : ndarray or None
        None where there is no solution.
    multipliers : ndarray or None
        Multipliers of the rows; where the program is infeasible, the proof of it. None without any.
    """

    status: str
    iterations: int = 0
    value: float = float("nan")
    x: Array | None = None
    multipliers: Array | None = None


class ConicSolver:
    """A solver set up for a pattern of data, with the numbers it was given last.

    Parameters
    ----------
    program : ConicProgram
    settings : mapping of str to value
        Of Clarabel. To be updated it may neither presolve nor decompose.
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
        """Take over a program of the pattern."""
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
        """Solve the program taken last."""
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
    """Solvers that wait for programs. Safe to use from several threads.

    Each serves one caller at a time, so that threads do not wait for each other.

    Parameters
    ----------
    most : int
        That are kept; those go first that were used longest ago.
    """

    name = "solvers"

    def __init__(self, most: int) -> None:
        self._most = most
        self._lock = threading.Lock()
        self._idle: list[ConicSolver] = []
        self._hits = self._misses = 0
        enlist(self)

    def info(self) -> StoreInfo:
        """Return how they have served."""
        with self._lock:
            return StoreInfo(self._hits, self._misses, len(self._idle), self._most)

    def clear(self) -> None:
        """Let all go that wait."""
        with self._lock:
            self._idle.clear()
            self._hits = self._misses = 0

    def solve(self, program: ConicProgram, settings: Mapping[str, Any]) -> ConicSolution:
        """Solve a program; parameters as for `ConicSolver`."""
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
"""Those of this process."""


class Pattern(NamedTuple):
    """Pattern of the programs that a solver is set up for.

    Attributes
    ----------
    rows, columns, zero, second_order : int
    quadratic : bool
        Whether P is not zero.
    places : tuple of bytes
        Places where A is not zero.
    """

    rows: int
    columns: int
    zero: int
    second_order: int
    quadratic: bool
    places: tuple[bytes, ...]

    @classmethod
    def of(cls, program: ConicProgram) -> Pattern:
        """Return that of a program."""
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
    """Outcome of a program of a stance: its loads, or the proof that there are none.

    Attributes
    ----------
    solved : bool
        Whether the solver says so; the plan is checked apart from it.
    status : str
        CVXPY's word, or `OUT_OF_TIME`.
    iterations : int
    value : float
        Objective, NaN if not solved.
    loads : tuple of ndarray
        y of each hand [N], of a floating one [m, rad]; empty if not solved.
    limit_duals, hard_duals : tuple of ndarray
        Multipliers of each hand's rows; where there is no solution, the proof of that. Empty if
        the solver has neither.
    balance_dual : ndarray or None
        Multipliers of the balance, shape (nb,).
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
    """Outcome of `Reach`, and the t that it reached, shape (k,), NaN if it was not solved."""

    outcome: Outcome
    t: Array
