"""A plan's programs as plain matrices, and solvers that are given these and nothing else.

The least utilisation made unique, min u + Σ (w y)²; the least utilisation alone, min u; and the
tie-break that may follow it, min Σ (v y)² under a cap on u; over all hands' loads y with

    B y + b = W,   L y + l0 ≤ u s,   H y ≤ h.

Written down from the hands' sets without the planner's own programs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import clarabel
import numpy as np
import scipy.sparse as sp

from planner.prepare import Sets
from planner.programs import (
    CAP_SLACK,
    HandData,
    StanceData,
    program,
    tie_weight,
    unique as unique_program,
)
from planner.programs.conic import Columns, ConicProgram
from planner.question import Question
from tests.suite.helpers import peer
from tests.suite.helpers.named_programs import program_of

__all__ = [
    "Clarabel",
    "Conic",
    "Data",
    "Qoco",
    "highs",
    "least",
    "scaled",
    "si",
    "tie",
    "unique",
    "whole_blocks",
]


class Data(NamedTuple):
    """All hands' rows, the wrench W that is needed, and the weights w and v of the loads."""

    rows: peer.Rows
    wrench: np.ndarray
    w: np.ndarray
    v: np.ndarray


class Conic(NamedTuple):
    """Min ½ Σ p x² + q · x with A x + s = b, s zero in the first ``equations`` rows, else ≥ 0."""

    p: np.ndarray
    q: np.ndarray
    A: np.ndarray
    b: np.ndarray
    equations: int


def scaled(sets: Sets) -> Data:
    """Rows in the planner's physical units: what its own solver is given."""
    hands = sets.data.hands

    def spread(name: str) -> np.ndarray:
        return sp.block_diag([getattr(hand, name) for hand in hands]).toarray()

    def joined(name: str) -> np.ndarray:
        return np.concatenate([getattr(hand, name) for hand in hands])

    l0, v = joined("l0"), np.sqrt(joined("tie"))
    return Data(
        peer.Rows(
            L=spread("L"),
            l0=l0,
            s=np.ones(len(l0)),
            H=spread("H"),
            h=joined("h"),
            B=np.hstack([hand.G for hand in hands]),
            b=np.sum([hand.g for hand in hands], axis=0),
        ),
        sets.data.wrench,
        math.sqrt(tie_weight(len(sets.data.hands))) * v,
        v / v.max(),
    )


def si(question: Question, sets: Sets) -> Data:
    """Rows in N and N·m, each against its own capacity."""
    unit = np.concatenate([hand.unit for hand in sets.data.hands])
    v = np.sqrt(np.concatenate([hand.tie for hand in sets.data.hands])) / unit
    w = math.sqrt(tie_weight(len(sets.data.hands))) * v
    return Data(peer.rows(question, list(sets.spaces)), question.needed_wrench(), w, v)


def least(data: Data) -> Conic:
    """Return the program of least utilisation; the unknowns are all loads, then u."""
    r, n = data.rows, data.rows.B.shape[1]
    return Conic(
        p=np.zeros(n + 1),
        q=np.append(np.zeros(n), 1.0),
        A=np.vstack(
            [
                np.column_stack([r.B, np.zeros(len(r.b))]),
                np.column_stack([r.L, -r.s]),
                np.column_stack([r.H, np.zeros(len(r.h))]),
            ]
        ),
        b=np.concatenate([data.wrench - r.b, -r.l0, r.h]),
        equations=len(r.b),
    )


def unique(data: Data) -> Conic:
    """Return the program of least utilisation with squares that make the plan unique."""
    return least(data)._replace(p=np.append(2.0 * data.w**2, 0.0))


def tie(data: Data, utilisation: float) -> Conic:
    """Return the tie-break among plans of a least utilisation."""
    r = data.rows
    cap = utilisation + CAP_SLACK * max(1.0, abs(utilisation))
    return Conic(
        p=2.0 * data.v**2,
        q=np.zeros(r.B.shape[1]),
        A=np.vstack([r.B, r.L, r.H]),
        b=np.concatenate([data.wrench - r.b, cap * r.s - r.l0, r.h]),
        equations=len(r.b),
    )


def _pattern(programs: Sequence[Conic]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Columns' starts, rows and columns of the entries of A that are not zero in all programs."""
    used = np.any([program.A != 0.0 for program in programs], axis=0)
    columns, rows = np.nonzero(used.T)
    return np.searchsorted(columns, np.arange(used.shape[1] + 1)), rows, columns


def _diagonal(p: np.ndarray) -> sp.csc_matrix:
    """A diagonal matrix with no entries that are zero."""
    places = np.flatnonzero(p)
    return sp.csc_matrix((p[places], (places, places)), shape=(len(p), len(p)))


class Clarabel:
    """Clarabel, set up once for the pattern of some programs and updated with each of them.

    Parameters
    ----------
    programs : sequence of Conic
    settings : mapping of str to object
        Of the solver.
    full : Conic, optional
        A program whose entries are the pattern; by default those that the programs have.
    """

    def __init__(
        self, programs: Sequence[Conic], settings: Mapping[str, Any], full: Conic | None = None
    ) -> None:
        self._settings = clarabel.DefaultSettings()
        self._settings.verbose = False
        for name, value in settings.items():
            setattr(self._settings, name, value)
        starts, rows, columns = _pattern(programs if full is None else [full])
        first = programs[0]
        self._cones = [
            clarabel.ZeroConeT(first.equations),
            clarabel.NonnegativeConeT(len(first.b) - first.equations),
        ]
        self.matrices = [
            sp.csc_matrix((each.A[rows, columns], rows, starts), each.A.shape) for each in programs
        ]
        self.costs = [_diagonal(each.p) for each in programs]
        self.programs = programs
        self._new = [
            {
                "A": matrix.data.tolist(),
                "b": each.b.tolist(),
                **({"P": cost.data.tolist()} if cost.nnz else {}),
            }
            for matrix, cost, each in zip(self.matrices, self.costs, programs, strict=True)
        ]
        self._sides = [each.b.tolist() for each in programs]
        self._solver = self._set_up(0)

    def _set_up(self, number: int) -> Any:
        each = self.programs[number]
        matrix, cost = self.matrices[number], self.costs[number]
        return clarabel.DefaultSolver(cost, each.q, matrix, each.b, self._cones, self._settings)

    def updated(self, number: int) -> Any:
        """Solve with all data of that program new."""
        self._solver.update(**self._new[number % len(self._new)])
        return self._solver.solve()

    def turned(self, number: int) -> Any:
        """Solve with the right-hand side of that program new."""
        self._solver.update(b=self._sides[number % len(self._sides)])
        return self._solver.solve()

    def fresh(self, number: int) -> Any:
        """Set a solver up for that program, and solve."""
        return self._set_up(number % len(self.programs)).solve()


def whole_blocks(stances: Sequence[StanceData]) -> Clarabel:
    """Return Clarabel for the planner's own programs, with the zeros in their blocks, as CVXPY's.

    The utilisation is the first of their unknowns.
    """
    hands = tuple(HandData(*map(np.ones_like, hand)) for hand in stances[0].hands)
    full, *programs = (
        _dense(program_of(unique_program, each).conic())
        for each in (StanceData.of(hands, stances[0].wrench), *stances)
    )
    return Clarabel(programs, program.SHARP_SETTINGS, full)


def _dense(asked: ConicProgram) -> Conic:
    A = sp.csc_matrix(Columns.beside(asked.A), (len(asked.b), len(asked.q))).toarray()
    return Conic(np.array(asked.P), np.array(asked.q), A, np.array(asked.b), asked.zero)


class Qoco:
    """QOCO with its default tolerances, as `Clarabel`; its equations are apart."""

    def __init__(self, programs: Sequence[Conic]) -> None:
        import qoco

        first, k = programs[0], programs[0].equations
        _, rows, columns = _pattern(programs)
        top = rows < k
        self._new = []
        for each in programs:
            values = each.A[rows, columns]
            self._new.append((each, values[top], values[~top]))
        A, G = (
            sp.csc_matrix((values, (rows[part] - shift, columns[part])), (count, len(first.q)))
            for values, part, shift, count in (
                (self._new[0][1], top, 0, k),
                (self._new[0][2], ~top, k, len(first.b) - k),
            )
        )
        self._quadratic = bool(first.p.any())
        cost = _diagonal(first.p) if self._quadratic else None
        sizes = len(first.q), len(first.b) - k, k
        cones = len(first.b) - k, 0, None
        sides = first.b[:k], first.b[k:]
        self._solver = qoco.QOCO()
        self._solver.setup(*sizes, cost, first.q, A, sides[0], G, sides[1], *cones)

    def updated(self, number: int) -> Any:
        """Solve with all data of that program new."""
        each, A, G = self._new[number % len(self._new)]
        k = each.equations
        self._solver.update_vector_data(b=each.b[:k], h=each.b[k:])
        if self._quadratic:
            self._solver.update_matrix_data(P=each.p[each.p > 0.0], A=A, G=G)
        else:
            self._solver.update_matrix_data(A=A, G=G)
        return self._solver.solve()


def highs(program: Conic) -> Any:
    """Solve a program without squares by HiGHS."""
    k = program.equations
    return peer.solve(program.q, program.A[k:], program.b[k:], program.A[:k], program.b[:k])
