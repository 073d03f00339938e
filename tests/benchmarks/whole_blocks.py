"""Raw Clarabel on what CVXPY itself would give it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import clarabel
import scipy.sparse as sp

from planner.programs import StanceData, program

__all__ = ["WholeBlocks"]


class WholeBlocks:
    """Raw Clarabel on the data as CVXPY writes them: whole blocks, with their zeros."""

    def __init__(self, stances: Sequence[StanceData]) -> None:
        built = program.Unique(stances[0].shape)
        of = built.compiled.map
        assert of is not None
        self._places, self._new = of.variables, []
        for each in stances:
            values = built.values(each, *(hand.tie for hand in each.hands))
            for parameter, value in zip(built.compiled.parameters, values, strict=True):
                parameter.value = value
            p = of.vector()
            new = {"P": of.P.values @ p, "A": of.A.values @ p, "b": of.b.values @ p}
            self._new.append({name: part.tolist() for name, part in new.items()})
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        for name, value in program.Unique.settings[0].items():
            setattr(settings, name, value)
        P, A = (
            sp.csc_matrix((part.values @ p, part.indices, part.indptr), part.shape)
            for part in (of.P, of.A)
        )
        self._solver = clarabel.DefaultSolver(
            P, of.q.values @ p, A, of.b.values @ p, of.cones, settings
        )

    def used(self, number: int) -> float:
        """Return the utilisation that it comes to."""
        return float(self._places.of(self.updated(number).x)[-1])

    def turned(self, number: int) -> Any:
        """Solve with the right-hand side of that stance new."""
        self._solver.update(b=self._new[number % len(self._new)]["b"])
        return self._solver.solve()

    def updated(self, number: int) -> Any:
        """Solve with all data of that stance new."""
        self._solver.update(**self._new[number % len(self._new)])
        return self._solver.solve()
