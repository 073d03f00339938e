"""What all programs of a stance share: variables, data, rows, and how they are run.

Data enter as whole-block parameters (disciplined parametrised programming), so a program depends on
the shape of a stance only, is compiled once and solved with new data after
(`planner.programs.compiled`).
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Final

import cvxpy as cp

from hand_models.base import Array
from planner.programs.compiled import Compiled
from planner.programs.conic_extent import Extent
from planner.programs.outcome import Outcome
from planner.programs.stance_data import Shape, StanceData

__all__ = ["CAREFUL", "REFINED", "SETTINGS", "SHARP", "SOLVER", "StanceProgram"]

SOLVER: Final = "CLARABEL"

SETTINGS: Final[dict[str, Any]] = {
    "equilibrate_enable": False,
    "iterative_refinement_enable": False,
    "presolve_enable": False,
    "chordal_decomposition_enable": False,
    "max_threads": 1,
    "tol_gap_abs": 1e-9,
    "tol_gap_rel": 1e-9,
    "tol_feas": 1e-9,
}
"""One physical scaling instead of equilibration, and no refinement of solutions that are good."""

SHARP: Final[dict[str, Any]] = {**SETTINGS, "tol_gap_abs": 1e-11, "tol_gap_rel": 1e-11}
"""Where a small term of the objective decides."""

REFINED: Final[dict[str, Any]] = {**SETTINGS, "iterative_refinement_enable": True}
"""For a second try."""

CAREFUL: Final[dict[str, Any]] = {"max_threads": 1}
"""The solver's own defaults, for a third."""

SOLVED: Final = (cp.OPTIMAL, cp.OPTIMAL_INACCURATE)


class StanceProgram(ABC):
    """A program for one shape of stance, compiled. Safe to call from several threads."""

    settings: ClassVar[Sequence[Mapping[str, Any]]] = (SETTINGS, REFINED, CAREFUL)

    def __init__(self, shape: Shape) -> None:
        self.shape = shape
        self.z = [cp.Variable(m) for m, _, _, _ in shape.hands]
        self.G = [cp.Parameter((shape.balance, m)) for m, _, _, _ in shape.hands]
        self.L: list[cp.Parameter] = []
        self.l0: list[cp.Parameter] = []
        self.H = [cp.Parameter((nh, m)) for m, _, nh, _ in shape.hands]
        self.h = [cp.Parameter(nh) for _, _, nh, _ in shape.hands]
        self.offset = cp.Parameter(shape.balance)
        """W − Σ g, or −Σ g where W is scaled apart."""
        self.reaction = sum(G @ z for G, z in zip(self.G, self.z, strict=True))
        self.hard = [H @ z <= h for H, z, h in zip(self.H, self.z, self.h, strict=True)]
        self.limits: list[cp.Constraint] = []
        self.own: list[cp.Parameter] = []
        """Parameters beside the stance's."""
        self.further: list[cp.Variable] = []
        """Variables beside the loads whose values are wanted."""
        self.balance: cp.Constraint
        self.problem = self.define()
        self.compiled = Compiled(
            self.problem,
            [*self.G, *self.L, *self.l0, *self.H, *self.h, self.offset, *self.own],
            [*self.z, *self.further],
            [self.balance, *self.limits, *self.hard],
            self.settings,
        )

    @abstractmethod
    def define(self) -> cp.Problem:
        """Return the problem, with `limits`, `balance`, `own` and `further` set."""

    def utilisations(self) -> list[cp.Expression]:
        """Return each hand's limit rows as load over capacity."""
        self.L = [cp.Parameter((nl, m)) for m, nl, _, _ in self.shape.hands]
        self.l0 = [cp.Parameter(nl) for _, nl, _, _ in self.shape.hands]
        return [L @ z + l0 for L, z, l0 in zip(self.L, self.z, self.l0, strict=True)]

    def values(self, data: StanceData, *own: Any) -> list[Any]:
        """Return what the parameters are given."""
        hands = data.hands
        limits = [*(hand.L for hand in hands), *(hand.l0 for hand in hands)] if self.L else []
        return [
            *(hand.G for hand in hands),
            *limits,
            *(hand.H for hand in hands),
            *(hand.h for hand in hands),
            data.offset,
            *own,
        ]

    def run(self, data: StanceData, *own: Any) -> tuple[Outcome, list[Array]]:
        """Solve with the stance's data and the values of `own`.

        Returns
        -------
        outcome : Outcome
        further : list of ndarray
            Values of the variables `further`; empty where there is no solution.
        """
        hands = data.hands
        found = self.compiled.solve(self.values(data, *own), self.extent(data.shape))
        solved = found.status in SOLVED and math.isfinite(found.value)
        duals, first = found.multipliers, 1 + len(self.limits)
        outcome = Outcome(
            solved=solved,
            status=found.status,
            iterations=found.iterations,
            value=found.value if solved else math.nan,
            loads=tuple(z * hand.unit for z, hand in zip(found.variables, hands, strict=False))
            if solved
            else (),
            limit_duals=duals[1:first],
            hard_duals=duals[first:],
            balance_dual=duals[0] if duals else None,
        )
        return outcome, list(found.variables[len(hands) :]) if solved else []

    def extent(self, shape: Shape) -> Extent:
        """Return how much there is of variables and constraints for a shape.

        Parameters
        ----------
        shape : Shape
            For which the program has room.
        """
        loads, limits, hard = [], [], []
        for m, nl, nh, _ in shape.hands:
            loads.append(m)
            limits.append(nl)
            hard.append(nh)
        if not self.limits:
            limits = []
        further = [variable.size for variable in self.further]
        return Extent((*loads, *further), (shape.balance, *limits, *hard), shape)
