"""What CVXPY knows of a compiled problem, read off its own objects; nothing else touches these.

CVXPY compiles a parametrised problem into a conic program

    min ½ xᵀP x + qᵀx + d   with   A x + s = b,  s ∈ K,

whose data are affine in the parameters: each is one sparse matrix times p, all parameters' values
one after the other (column by column) and a 1. That matrix is not public. It was read here from
CVXPY `WRITTEN_FOR`; `cone_map` compares with the public `Problem.get_problem_data` and raises
`ChangedError` where the two disagree, or an attribute is not there any more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from types import SimpleNamespace
from typing import Any, Final, NamedTuple

import cvxpy as cp
import numpy as np
import scipy.sparse as sp
from cvxpy.reductions.solvers.conic_solvers.clarabel_conif import CLARABEL, dims_to_solver_cones

from hand_models.base import Array, Indices

__all__ = ["STATUS", "WRITTEN_FOR", "Affine", "ChangedError", "ConeMap", "Positions", "cone_map"]

WRITTEN_FOR: Final = "1.9"
"""CVXPY's version, as far as its internals are known."""

STATUS: Final[dict[str, str]] = dict(CLARABEL.STATUS_MAP)
"""CVXPY's word for each of Clarabel's."""


class ChangedError(Exception):
    """CVXPY's internals are not what they were."""


class Affine(NamedTuple):
    """A sparse matrix, or a vector, whose entries are affine in the parameters.

    Attributes
    ----------
    indices, indptr : ndarray of int
        Of the matrix, in compressed columns; of a vector of all its entries.
    shape : tuple of int
    values : csr_array, shape (entries, p)
        What is multiplied with the parameters to give the entries.
    """

    indices: Indices
    indptr: Indices
    shape: tuple[int, int]
    values: Any


@dataclass(frozen=True, eq=False)
class Positions:
    """Where variables, or the multipliers of constraints, are in x or z.

    Attributes
    ----------
    entries, factors : ndarray
        Of all of them, one after the other.
    parts : tuple of (slice, tuple of int)
        Of each, and its shape.
    """

    entries: Indices
    factors: Array
    parts: tuple[tuple[slice, tuple[int, ...]], ...]

    @cached_property
    def straight(self) -> bool:
        """Whether they are the first of x or z as they stand there."""
        first = np.arange(len(self.entries))
        return bool((self.entries == first).all() and (self.factors == 1.0).all())

    def of(self, solution: Sequence[float]) -> tuple[Array, ...]:
        """Return their values."""
        found = np.asarray(solution)
        if not self.straight:
            found = found[self.entries] * self.factors
        return tuple(
            found[part] if len(shape) == 1 else found[part].reshape(shape, order="F")
            for part, shape in self.parts
        )


NOWHERE: Final = Positions(np.zeros(0, dtype=int), np.zeros(0), ())


class ConeMap(NamedTuple):
    """A problem as a conic program that is affine in its parameters.

    Attributes
    ----------
    P, q, A, b, d : Affine
        P has its upper triangle only; A as in A x + s = b.
    cones : list
        Of Clarabel.
    parameters : tuple of (Parameter, slice)
        Where each parameter's values are in p, column by column; the last of p is 1.
    size : int
        Of p.
    sign : float
        −1 where the problem maximises.
    variables, constraints : Positions
        Of those that were asked for.
    """

    P: Affine
    q: Affine
    A: Affine
    b: Affine
    d: Affine
    cones: list[Any]
    parameters: tuple[tuple[cp.Parameter, slice], ...]
    size: int
    sign: float
    variables: Positions
    constraints: Positions

    def vector(self) -> Array:
        """Return p for the parameters' present values."""
        p = np.ones(self.size)
        for parameter, place in self.parameters:
            p[place] = np.ravel(parameter.value, order="F")
        return p


def cone_map(
    problem: cp.Problem,
    parameters: Sequence[cp.Parameter],
    variables: Sequence[cp.Variable],
    constraints: Sequence[cp.Constraint],
) -> ConeMap:
    """Compile a problem.

    Parameters
    ----------
    problem : Problem
        With disciplined parameters; their values are replaced.
    parameters : sequence of Parameter
        All of the problem's, in the order wanted.
    variables, constraints : sequence
        Of the problem, whose values and multipliers will be read.

    Raises
    ------
    ChangedError
        If CVXPY's internals are not those of `WRITTEN_FOR`.
    """
    rng = np.random.default_rng(0)
    for parameter in parameters:
        # positive and nonzero, so that every entry shows
        parameter.value = rng.uniform(0.5, 1.5, parameter.shape)
    data, chain, inverse = problem.get_problem_data(cp.CLARABEL, enforce_dpp=True, solver_opts={})
    try:
        compiled = data[cp.settings.PARAM_PROB]
        found = _read(problem, parameters, compiled, data)
        n, rows = found.A.shape[1], found.A.shape[0]
        read = _Reader(problem, chain, inverse, data, n, rows)
        found = found._replace(
            variables=read.places(variables), constraints=read.places(constraints)
        )
    except (AttributeError, KeyError, TypeError, ValueError, IndexError) as error:
        raise ChangedError(f"{type(error).__name__}: {error}") from error
    _compare(found, data)
    return found


def _read(
    problem: cp.Problem, parameters: Sequence[cp.Parameter], compiled: Any, data: dict[str, Any]
) -> ConeMap:
    n = compiled.x.size
    compiled.reduced_A.cache()
    indices, indptr, shape = compiled.reduced_A.problem_data_index
    by_param = sp.csr_array(compiled.reduced_A.reduced_mat)
    split = int(indptr[n])
    A = Affine(indices[:split], indptr[: n + 1], (shape[0], n), -by_param[:split])
    b = _dense(indices[split:], by_param[split:], shape[0])
    by_param = sp.csr_array(compiled.q)
    q = _dense(np.arange(n), by_param[:n], n)
    d = _dense(np.arange(1), by_param[n:], 1)
    size = by_param.shape[1]
    P = Affine(np.zeros(0, dtype=int), np.zeros(n + 1, dtype=int), (n, n), sp.csr_array((0, size)))
    if compiled.P is not None:
        compiled.reduced_P.cache()
        indices, indptr, _ = compiled.reduced_P.problem_data_index
        columns = np.repeat(np.arange(n), np.diff(indptr[: n + 1]))
        upper = indices <= columns
        P = Affine(
            indices[upper],
            np.concatenate([[0], np.cumsum(np.bincount(columns[upper], minlength=n))]),
            (n, n),
            sp.csr_array(compiled.reduced_P.reduced_mat)[upper],
        )
    places = compiled.param_id_to_col
    return ConeMap(
        P=P,
        q=q,
        A=A,
        b=b,
        d=d,
        cones=dims_to_solver_cones(data["dims"]),
        parameters=tuple(
            (parameter, slice(places[parameter.id], places[parameter.id] + parameter.size))
            for parameter in parameters
        ),
        size=size,
        sign=-1.0 if isinstance(problem.objective, cp.Maximize) else 1.0,
        variables=NOWHERE,
        constraints=NOWHERE,
    )


def _dense(indices: Indices, by_param: Any, length: int) -> Affine:
    """Return a vector of which only the entries at the indices are not always zero."""
    place = sp.csr_array(
        (np.ones(len(indices)), (indices, np.arange(len(indices)))), shape=(length, len(indices))
    )
    return Affine(np.arange(length), np.array([0, length]), (length, 1), place @ by_param)


class _Reader:
    """Finds variables and multipliers by unpacking solutions whose numbers are their places."""

    def __init__(
        self, problem: cp.Problem, chain: Any, inverse: Any, data: dict[str, Any], n: int, rows: int
    ) -> None:
        self._found: list[dict[int, Array]] = []
        for offset in (1.0, 2.0):
            solution = SimpleNamespace(
                status=CLARABEL.SOLVED,
                x=np.arange(n) + offset,
                z=np.arange(rows) + offset,
                obj_val=0.0,
                iterations=0,
                solve_time=0.0,
            )
            problem.unpack_results(solution, chain, inverse)
            values = {variable.id: variable.value for variable in problem.variables()}
            values |= {row.id: row.dual_value for row in problem.constraints}
            self._found.append({key: np.array(value, dtype=float) for key, value in values.items()})

    def places(self, wanted: Sequence[cp.Variable | cp.Constraint]) -> Positions:
        entries, factors, parts, start = [NOWHERE.entries], [NOWHERE.factors], [], 0
        for part in wanted:
            first, second = (found[part.id] for found in self._found)
            # factor · (place + 1) and factor · (place + 2)
            factor = np.ravel(second - first, order="F")
            entries.append(np.rint(np.ravel(first, order="F") / factor - 1.0).astype(int))
            factors.append(factor)
            parts.append((slice(start, start + first.size), first.shape))
            start += first.size
        return Positions(np.concatenate(entries), np.concatenate(factors), tuple(parts))


def _compare(found: ConeMap, data: dict[str, Any]) -> None:
    """Raise `ChangedError` unless the map gives the data that CVXPY itself gives."""
    p = found.vector()
    pairs = [(found.q.values @ p, data["c"]), (found.b.values @ p, data["b"])]
    for part, name in ((found.A, "A"), (found.P, "P")):
        ours = sp.csc_array((part.values @ p, part.indices, part.indptr), shape=part.shape)
        theirs = data.get(name, sp.csc_array(part.shape))
        if name == "P":
            theirs = sp.triu(theirs)
        pairs.append((ours.toarray(), theirs.toarray()))
    if not all(np.array_equal(ours, theirs) for ours, theirs in pairs):
        raise ChangedError("the map from parameters to data gives other data than CVXPY")
