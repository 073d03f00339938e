"""Programs at the speed of their solver: compiled once, refreshed in place for each query.

CVXPY compiles a problem into conic data that are affine in its parameters (`cvxpy_internals`), with
room for smaller ones of its kind (`conic_extent`). A query's values are put into one vector, each
datum is one of them or a sum of some, and a solver that is already set up takes them over. Of the
data only the entries count that are not zero in the query: the blocks of `planner.programs.program`
are mostly zeros, and a solver that does not know costs three times as much. A solver is set up for
a pattern of entries, and serves every query of that pattern: an answer depends on its query alone,
not on those before.

Solvers are kept, some for each problem: each serves one caller at a time, so that threads do not
wait for each other, and one whose last query had the same arrays is only given what is new. Where
CVXPY's internals have changed, everything still works, at the speed of CVXPY's own `solve`.
"""

from __future__ import annotations

import operator
import threading
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, NamedTuple

import clarabel
import cvxpy as cp
import numpy as np

from hand_models.base import Array, BoundedStore
from planner import deadline
from planner.programs.conic_extent import Extent, Layout, PaddedProgram
from planner.programs.cvxpy_internals import STATUS, WRITTEN_FOR, ChangedError, ConeMap, cone_map

__all__ = ["OUT_OF_TIME", "Compiled", "Solution", "Solver"]

KEPT: Final = 32
"""Solvers that wait for queries of one problem."""

LAYOUTS: Final = 128
"""Extents of which the conic program is kept."""

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

    Attributes
    ----------
    parameters : sequence of Parameter
    map : ConeMap or None
        The conic program; None where CVXPY's internals have changed.
    idle : list of Solver
        Those that wait for queries, the last used last; `KEPT` at most.
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
        self.idle: list[Solver] = []
        self._layouts: BoundedStore[Extent, Layout] = BoundedStore(LAYOUTS)
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
        else:
            self._room = PaddedProgram(self.map)

    def solve(self, values: Values, extent: Extent) -> Solution:
        """Solve for some values.

        Parameters
        ----------
        values : sequence
            Of the parameters, in their order; in their first rows and columns, if they are smaller.
        extent : Extent
            How much there is of variables and constraints then. Where `map` is None there must be
            all of the problem.
        """
        solution = FAILED
        for i, chosen in enumerate(self._settings):
            if self.map is None:
                solution = self._slowly(values, chosen)
            elif i == 0:
                solution = self._fast(values, extent, chosen)
            else:
                layout = self._layout(values, extent)
                query = _Query(layout)
                query.take(values)
                solution = Solver(extent, layout, chosen, query).solve()
            ended = solution.status in (cp.OPTIMAL, cp.INFEASIBLE, cp.UNBOUNDED, OUT_OF_TIME)
            if ended or deadline.expired():
                break
        return solution

    def _fast(self, values: Values, extent: Extent, settings: Mapping[str, Any]) -> Solution:
        solver = self.ready(values, extent, settings)
        solution = solver.solve()
        # one that has met what is no number, or was interrupted, may not forget it
        if solution.status != cp.SOLVER_ERROR:
            self.put_back(solver)
        return solution

    def ready(self, values: Values, extent: Extent, settings: Mapping[str, Any]) -> Solver:
        """Return a solver that has taken the values over; it no longer waits for queries.

        Parameters
        ----------
        values : sequence
            As in `solve`.
        extent : Extent
        settings : mapping of str to value
            Of Clarabel.
        """
        idle = self._take_idle(extent, lambda solver: 1 + solver.query.knows(values))
        query = _Query(self._layout(values, extent)) if idle is None else idle.query
        changed = query.take(values)
        if idle is not None:
            if query.pattern == idle.pattern:
                idle.update(changed)
                return idle
            idle.query = _Query(idle.layout)
            self.put_back(idle)
            other = self._take_idle(extent, lambda solver: solver.pattern == query.pattern)
            if other is not None:
                other.turn_to(query)
                return other
        return Solver(extent, query.layout, settings, query)

    def _take_idle(self, extent: Extent, merit: Callable[[Solver], int]) -> Solver | None:
        """Take the solver of that extent with the most merit, the last used of such, if any has."""
        with self._lock:
            found, most = None, 0
            for solver in reversed(self.idle):
                if solver.extent == extent and (its := merit(solver)) > most:
                    found, most = solver, its
            if found is not None:
                self.idle.remove(found)
            return found

    def put_back(self, solver: Solver) -> None:
        """Let a solver wait for queries again."""
        with self._lock:
            self.idle.append(solver)
            del self.idle[:-KEPT]

    def _layout(self, values: Values, extent: Extent) -> Layout:
        """Return the conic program of an extent, found once."""
        (found,) = self._layouts.find([extent])
        if found is None:
            found = self._room.layout(extent, [np.shape(value) for value in values])
            self._layouts.keep([(extent, found)])
        return found

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


class _Query:
    """A query's values as one vector p, and what they were.

    Parameters
    ----------
    layout : Layout
    """

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self.p = np.ones(layout.size)
        self._views = [
            self.p[place].reshape(shape, order="F")
            for place, shape in zip(layout.places, layout.shapes, strict=True)
        ]
        self._given: list[Any] = [None] * len(self._views)
        self.pattern = b""
        """Which of the entries that shape A are not zero."""

    def knows(self, values: Values) -> int:
        """Return how many of the values are the same arrays as last time."""
        return sum(map(operator.is_, self._given, values))

    def take(self, values: Values) -> set[str]:
        """Take values over; return the names of the parts that change with them."""
        given, views, touched = self._given, self._views, self.layout.touched
        changed: set[str] = set()
        for i, value in enumerate(values):
            if given[i] is not value:
                views[i][...] = value
                given[i] = value
                changed.update(touched[i])
        if "A" in changed:
            self.pattern = (self.p.take(self.layout.shaping) != 0.0).tobytes()
        return changed


class Solver:
    """A solver with what it was given last, set up for a pattern of data.

    Parameters
    ----------
    extent : Extent
    layout : Layout
        Of that extent.
    settings : mapping of str to value
        Of Clarabel.
    query : _Query
        For whose pattern it is set up.
    """

    def __init__(
        self, extent: Extent, layout: Layout, settings: Mapping[str, Any], query: _Query
    ) -> None:
        self.extent, self.layout, self.query, self.pattern = extent, layout, query, query.pattern
        chosen = clarabel.DefaultSettings()
        chosen.verbose = False
        for name, value in settings.items():
            setattr(chosen, name, value)
        self._parts = {
            "P": layout.P,
            "q": layout.q,
            "A": layout.A.without_zeros(query.p),
            "b": layout.b,
        }
        self._solver = clarabel.DefaultSolver(*self.data(), layout.cones, chosen)

    def update(self, names: set[str]) -> None:
        """Take over parts of the data that have changed in the query."""
        # it takes lists faster than arrays, and cannot take nothing
        if names:
            parts, p = self._parts, self.query.p
            self._solver.update(**{name: parts[name].entries.at(p).tolist() for name in names})

    def turn_to(self, query: _Query) -> None:
        """Take over another query of the pattern."""
        self.query = query
        self.update({name for names in self.layout.touched for name in names})

    def solve(self) -> Solution:
        """Solve with the values taken last."""
        deadline.begin_overlap()
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
        parts, p = self._parts, self.query.p
        P, A = (parts[name].matrix(p) for name in "PA")
        return P, parts["q"].entries.at(p), A, parts["b"].entries.at(p)

    def _read(self, raw: Any) -> Solution:
        of, word = self.layout, str(raw.status)
        status = OUT_OF_TIME if word == STOPPED else STATUS.get(word, cp.SOLVER_ERROR)
        if status not in PRESENT + PROVEN:
            return Solution(status, raw.iterations, float("nan"))
        multipliers = of.constraints.of(raw.z)
        if status in PROVEN:
            return Solution(status, raw.iterations, float("nan"), (), multipliers)
        offset = float(of.d.entries.at(self.query.p)[0])
        return Solution(
            status=status,
            iterations=raw.iterations,
            value=of.sign * (raw.obj_val + offset),
            variables=of.variables.of(raw.x),
            multipliers=multipliers,
        )
