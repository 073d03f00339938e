"""Support function of a hand's wrench space, by a linear program kept for many directions."""

from __future__ import annotations

import math
from typing import Any

import highspy
import numpy as np

from hand_models.base import Array
from hand_models.wrench_spaces import WrenchSpace
from planner.programs.scaled_rows import ScaledRows

__all__ = ["SilentHighs", "Support"]


class SilentHighs(highspy.Highs):
    """Linear-programming solver HiGHS without any printed output.

    Parameters
    ----------
    options : dict of str to any
        Options of HiGHS by name.
    """

    def __init__(self, options: dict[str, Any]) -> None:
        highspy.Highs.__init__(self)
        self.callbacks = []  # none is called, and they would hold it in a circle
        for name, value in options.items():
            self.setOptionValue(name, value)

    def optimal(self) -> bool:
        """Solve the linear program; return True if HiGHS reports an optimum."""
        self.run()
        return bool(self.getModelStatus() == highspy.HighsModelStatus.kOptimal)

    def infeasible(self) -> bool:
        """Return True if HiGHS reported after the last `optimal` that no solution is feasible."""
        return bool(self.getModelStatus() == highspy.HighsModelStatus.kInfeasible)

    def enableCallbacks(self) -> None:
        """Switch the output of HiGHS off. HiGHS calls this method before it prints its banner."""
        self.silent()

    def load(self, A: Array, columns: tuple[Array, Array], rows: tuple[Array, Array]) -> None:
        """Load the feasibility problem of bounds on x and on A x, with zero costs.

        Parameters
        ----------
        A : ndarray, shape (rows, columns)
            Matrix A of the rows.
        columns : tuple of ndarray, shape (columns,)
            Lower and upper bounds of x.
        rows : tuple of ndarray, shape (rows,)
            Lower and upper bounds of A x.
        """
        (count, size), entries = A.shape, A.T != 0.0
        starts = np.append(0, entries.sum(axis=1).cumsum())
        self.passModel(
            size,
            count,
            int(starts[-1]),
            int(highspy.MatrixFormat.kColwise),
            int(highspy.ObjSense.kMinimize),
            0.0,  # the costs begin at this
            np.zeros(size),
            *columns,
            *rows,
            starts.astype(np.int32),
            entries.nonzero()[1].astype(np.int32),
            A.T[entries],
            np.zeros(size, dtype=np.int32),  # no column is an integer
        )


class Support:
    """Support function of all wrenches that a hand can exert at a utilisation. Not thread-safe.

    Each call solves a linear program by the simplex method, warm-started from the direction before.

    Parameters
    ----------
    space : WrenchSpace
        Set of the hand's wrenches.
    cap : float
        Largest utilisation of the limits.
    """

    def __init__(self, space: WrenchSpace, cap: float) -> None:
        rows = ScaledRows.of(space)
        self._generators, self._origin = rows.generators, rows.origin
        A, most = np.vstack([rows.L, rows.H]), np.concatenate([cap - rows.l0, rows.h])
        free = np.full(A.shape[1], np.inf)
        # presolving would lose the basis of the program before
        self._solver = SilentHighs({"presolve": "off", "parallel": "off", "solver": "simplex"})
        self._solver.load(A, (-free, free), (np.full(len(A), -np.inf), most))
        self._columns = np.arange(A.shape[1], dtype=np.int32)

    def __call__(self, direction: Array) -> float:
        """Return the largest product of a direction with a wrench of the hand.

        Parameters
        ----------
        direction : ndarray, shape (6,)
            Direction in the hand frame H [1/N, 1/(N·m)].

        Returns
        -------
        float
            max direction · w over the wrenches w on the rock, in H. ∞ if there is no maximum; −∞ if
            the set is empty, or the solver reports neither an optimum nor an unbounded program.
        """
        solver = self._solver
        solver.changeColsCost(len(self._columns), self._columns, -(direction @ self._generators))
        if solver.optimal():
            return float(direction @ self._origin) - solver.getObjectiveValue()
        unbounded = solver.getModelStatus() == highspy.HighsModelStatus.kUnbounded
        return math.inf if unbounded else -math.inf
