"""Raw Clarabel on whole blocks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import clarabel
import numpy as np
import scipy.sparse as sp

from planner.programs import HandData, StanceData, program, unique
from planner.programs.conic import Columns, ConicProgram
from tests.suite.helpers.named_programs import program_of

__all__ = ["WholeBlocks"]


class WholeBlocks:
    """Raw Clarabel on the blocks of a program as they are, with their zeros; as CVXPY has them."""

    def __init__(self, stances: Sequence[StanceData]) -> None:
        full = tuple(HandData(*map(np.ones_like, hand)) for hand in stances[0].hands)
        there = _dense(program_of(unique, StanceData.of(full, stances[0].wrench)).conic()) != 0.0
        columns, rows = np.nonzero(there.T)
        starts = np.searchsorted(columns, np.arange(there.shape[1] + 1))
        programs = [program_of(unique, each).conic() for each in stances]
        self._new = [
            {"P": each.P.tolist(), "A": _dense(each)[rows, columns].tolist(), "b": each.b.tolist()}
            for each in programs
        ]
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        for name, value in program.SHARP.items():
            setattr(settings, name, value)
        last = programs[-1]
        A = sp.csc_matrix((_dense(last)[rows, columns], rows, starts), there.shape)
        cones = [
            clarabel.ZeroConeT(last.zero),
            clarabel.NonnegativeConeT(len(last.b) - last.zero),
        ]
        P = sp.csc_matrix(
            (last.P, np.arange(len(last.P)), np.arange(len(last.P) + 1)), 2 * last.P.shape
        )
        self._solver = clarabel.DefaultSolver(P, last.q, A, last.b, cones, settings)

    def used(self, number: int) -> float:
        """Return the utilisation that it comes to."""
        return float(self.updated(number).x[0])

    def turned(self, number: int) -> Any:
        """Solve with the right-hand side of that stance new."""
        self._solver.update(b=self._new[number % len(self._new)]["b"])
        return self._solver.solve()

    def updated(self, number: int) -> Any:
        """Solve with all data of that stance new."""
        self._solver.update(**self._new[number % len(self._new)])
        return self._solver.solve()


def _dense(asked: ConicProgram) -> np.ndarray:
    shape = len(asked.b), len(asked.q)
    return sp.csc_matrix(Columns.beside(asked.A), shape).toarray()
