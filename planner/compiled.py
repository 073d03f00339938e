"""Programs at the speed of their solver: compiled once, refreshed in place for each query.

CVXPY compiles a problem into conic data that are affine in its parameters (`cvxpy_internals`). A
query's values are put into one vector, one sparse product gives the data, and a solver that is
already set up takes them over. Of the data only the entries count that are not zero in the query:
the blocks of `planner.program` are mostly zeros, and a solver that does not know costs three times
as much. A solver is set up for a pattern of entries, and serves every query of that pattern: an
answer depends on its query alone, not on those before.

Solvers are kept, a few for each problem: each serves one caller at a time, so that threads do not
wait for each other, and one whose last query had the same arrays is only given what is new. Where
CVXPY's internals have changed, everything still works, at the speed of CVXPY's own `solve`.
"""

from __future__ import annotations

import operator
import threading
import warnings
from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

import clarabel
import cvxpy as cp
import numpy as np
import scipy.sparse as sp

from hand_models.frames import Array, Indices
from planner import deadline
from planner.cvxpy_internals import STATUS, WRITTEN_FOR, Affine, ChangedError, ConeMap, cone_map

__all__ = ["OUT_OF_TIME", "Compiled", "Solution"]

KEPT: Final = 8
"""Solvers that wait for queries of one problem."""

OUT_OF_TIME: Final = "out of time"
"""Status of a solver that the deadline has ended."""

STOPPED: Final = "CallbackTerminated"
"""Clarabel's word for that."""

Values = Sequence[Any]
"""What a query gives the parameters: arrays, which are not changed afterwards, or numbers."""


class Solution(NamedTuple):
    """How a problem ended.

    Attributes
    ----------
    status : str
        CVXPY's word, or `OUT_OF_TIME`.
    iterations : int
    value : float
        The objective; NaN without one.
    variables : tuple of ndarray
        Those that `Compiled` was asked for; empty where there is no solution.
    multipliers : tuple of ndarray
        Of the constraints; where the problem is infeasible, the proof of it. Empty without any.
    """

    status: str
    iterations: int
    value: float
    variables: tuple[Array, ...] = ()
    multipliers: tuple[Array, ...] = ()


FAILED: Final = Solution(cp.SOLVER_ERROR, 0, float("nan"))
LATE: Final = Solution(OUT_OF_TIME, 0, float("nan"))

PRESENT: Final = (cp.OPTIMAL, cp.OPTIMAL_INACCURATE)
"""With a solution."""

PROVEN: Final = (cp.INFEASIBLE, cp.INFEASIBLE_INACCURATE)
"""With multipliers that say why there is none."""


class Compiled:
    """A parametrised problem, compiled. Safe to call from several threads.

    Parameters
    ----------
    problem : Problem
    parameters : sequence of Parameter
        All of the problem's, in the order in which queries will give their values.
    variables, constraints : sequence
        Whose values and multipliers are wanted.
    settings : sequence of mapping of str to value
        Of Clarabel. Later ones are tried, on a new solver, where those before come to no end; the
        first must let a solver be updated (no presolve, no chordal decomposition).
    """

    def __init__(
        self,
        problem: cp.Problem,
        parameters: Sequence[cp.Parameter],
        variables: Sequence[cp.Variable],
        constraints: Sequence[cp.Constraint],
        settings: Sequence[Mapping[str, Any]],
    ) -> None:
        self._problem, self.parameters = problem, parameters
        self._settings = settings
        self._variables, self._constraints = variables, constraints
        self._lock = threading.Lock()
        self._idle: list[_Solver] = []
        self.map: ConeMap | None = None
        try:
            self.map = cone_map(problem, parameters, variables, constraints)
        except ChangedError as error:
            warnings.warn(
                f"CVXPY {cp.__version__} is not understood ({error}; written for {WRITTEN_FOR}): "
                "plans take longer, and are the same",
                RuntimeWarning,
                stacklevel=2,
            )

    def solve(self, values: Values) -> Solution:
        """Solve for some values of the parameters, in their order."""
        solution = FAILED
        for i, chosen in enumerate(self._settings):
            if self.map is None:
                solution = self._slowly(values, chosen)
            else:
                solution = self._fast(self.map, values, chosen, keep=i == 0)
            ended = solution.status in (cp.OPTIMAL, cp.INFEASIBLE, cp.UNBOUNDED, OUT_OF_TIME)
            if ended or deadline.expired():
                break
        return solution

    def _fast(
        self, of: ConeMap, values: Values, settings: Mapping[str, Any], *, keep: bool
    ) -> Solution:
        if not keep:
            solver = _Solver(of, settings)
            solver.take(values)
            return solver.solve()
        solver = self._ready(of, values, settings)
        try:
            return solver.solve()
        finally:
            with self._lock:
                self._idle.append(solver)
                del self._idle[:-KEPT]

    def _ready(self, of: ConeMap, values: Values, settings: Mapping[str, Any]) -> _Solver:
        """Return a solver that has taken the values over: first asked is who knows most of them."""
        others: list[_Solver] = []
        try:
            while True:
                with self._lock:
                    if not self._idle:
                        break
                    solver = max(reversed(self._idle), key=lambda one: one.knows(values))
                    self._idle.remove(solver)
                if solver.take(values):
                    return solver
                others.append(solver)
        finally:
            with self._lock:
                self._idle[:0] = others
        solver = _Solver(of, settings)
        solver.take(values)
        return solver

    def _slowly(self, values: Values, settings: Mapping[str, Any]) -> Solution:
        """Solve by CVXPY itself."""
        with self._lock, warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            for parameter, value in zip(self.parameters, values, strict=True):
                parameter.value = value
            left = deadline.left()
            if left == 0.0:
                return LATE
            # a solver that CVXPY has kept would keep its settings
            options = {**settings, "warm_start": False}
            if left is not None:
                options["time_limit"] = left
            try:
                self._problem.solve(solver=cp.CLARABEL, enforce_dpp=True, **options)
            except cp.SolverError:
                return FAILED
            status, stats = self._problem.status, self._problem.solver_stats
            if status == cp.USER_LIMIT and left is not None:
                return LATE
            there = status in PRESENT
            proven = there or status in PROVEN
            return Solution(
                status=status,
                iterations=int(stats.num_iters or 0) if stats else 0,
                value=float(self._problem.value) if there else float("nan"),
                variables=tuple(np.array(v.value) for v in self._variables) if there else (),
                multipliers=tuple(np.array(row.dual_value) for row in self._constraints)
                if proven
                else (),
            )


class _Block:
    """One part of the data, a matrix or a vector, with the entries that a solver is set up for.

    Parameters
    ----------
    of : Affine
    p : ndarray
        Parameters' values.
    whole : bool
        Take all entries, or those alone that are not zero for p.
    """

    def __init__(self, of: Affine, p: Array, *, whole: bool) -> None:
        count, last = of.values.shape[0], of.values.shape[1] - 1
        # an entry with a constant part may be zero by chance alone
        always = of.values[:, [last]].toarray().ravel() != 0.0
        chosen = np.ones(count, dtype=bool) if whole else always | (of.values @ p != 0.0)
        kept = np.flatnonzero(chosen)
        self.values = of.values[kept]
        self.indices = of.indices[kept]
        self.indptr = np.searchsorted(kept, of.indptr)
        self.shape = of.shape
        self.own = _parameters(self.values)

    def at(self, p: Array) -> Array:
        """Return the entries' values."""
        return np.asarray(self.values @ p)

    def matrix(self, p: Array) -> Any:
        """Return the block as a sparse matrix."""
        return sp.csc_matrix((self.at(p), self.indices, self.indptr), shape=self.shape)


def _parameters(values: Any) -> Indices:
    """Return which entries of p, but for the constant, the rows of a map depend on."""
    found = np.unique(values.indices)
    return np.asarray(found[found < values.shape[1] - 1])


class _Solver:
    """A solver with what it was given last, set up for a pattern of data."""

    def __init__(self, of: ConeMap, settings: Mapping[str, Any]) -> None:
        self._map = of
        self._settings = clarabel.DefaultSettings()
        self._settings.verbose = False
        for name, value in settings.items():
            setattr(self._settings, name, value)
        self._p = np.ones(of.size)
        self._views = [
            self._p[place].reshape(parameter.shape, order="F") for parameter, place in of.parameters
        ]
        self._given: list[Any] = [None] * len(self._views)
        self._shaping = _parameters(of.A.values)
        """Entries of p that A depends on."""
        self._pattern = b""
        """Which of these are not zero."""
        self._solver: Any = None
        self._blocks: dict[str, _Block] = {}
        self._touched: list[tuple[str, ...]] = []

    def knows(self, values: Values) -> int:
        """Return how many of the values are the same arrays as last time."""
        return sum(map(operator.is_, self._given, values))

    def take(self, values: Values) -> bool:
        """Take values over; return whether they have the pattern that the solver is set up for."""
        given, new = self._given, []
        for i, value in enumerate(values):
            if given[i] is not value:
                self._views[i][...] = value
                given[i] = value
                new.append(i)
        pattern = (self._p[self._shaping] != 0.0).tobytes()
        if self._solver is None:
            self._pattern = pattern
            self._set_up()
        elif pattern != self._pattern:
            # the solver itself has not got these: nothing is known
            self._given = [None] * len(given)
            return False
        else:
            names = {name for i in new for name in self._touched[i]}
            # it takes lists faster than arrays, and cannot take nothing
            if names:
                self._solver.update(
                    **{name: self._blocks[name].at(self._p).tolist() for name in names}
                )
        return True

    def solve(self) -> Solution:
        """Solve with the values taken last."""
        if deadline.left() is None:
            return self._read(self._solver.solve())
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
        return self._read(raw)

    def data(self) -> tuple[Any, Array, Any, Array]:
        """Return P, q, A and b as the solver has them."""
        blocks, p = self._blocks, self._p
        return blocks["P"].matrix(p), blocks["q"].at(p), blocks["A"].matrix(p), blocks["b"].at(p)

    def _set_up(self) -> None:
        """Set the solver up for the pattern of the present values."""
        of, p = self._map, self._p
        self._blocks = {
            name: _Block(part, p, whole=name != "A")
            for name, part in (("P", of.P), ("q", of.q), ("A", of.A), ("b", of.b))
        }
        self._touched = [
            tuple(
                name
                for name, block in self._blocks.items()
                if ((block.own >= place.start) & (block.own < place.stop)).any()
            )
            for _, place in of.parameters
        ]
        P, q, A, b = self.data()
        self._solver = clarabel.DefaultSolver(P, q, A, b, of.cones, self._settings)

    def _read(self, raw: Any) -> Solution:
        of, word = self._map, str(raw.status)
        status = OUT_OF_TIME if word == STOPPED else STATUS.get(word, cp.SOLVER_ERROR)
        if status not in PRESENT + PROVEN:
            return Solution(status, raw.iterations, float("nan"))
        multipliers = of.constraints.of(raw.z)
        if status in PROVEN:
            return Solution(status, raw.iterations, float("nan"), (), multipliers)
        offset = float((of.d.values @ self._p)[0])
        return Solution(
            status=status,
            iterations=raw.iterations,
            value=of.sign * (raw.obj_val + offset),
            variables=of.variables.of(raw.x),
            multipliers=multipliers,
        )
