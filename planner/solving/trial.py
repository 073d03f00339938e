"""A stance that is only tried: its verified plan without proof, prices or words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

from planner.deadline import Budget, Overlap
from planner.explanation import LimitUse
from planner.floating import PROGRAMS, WristSolution
from planner.prepare import PreparedStance
from planner.result import LoadRecovery
from planner.solving.load_factor import FoundFactor, find_load_factor
from planner.solving.prepared_checks import PreparedChecks, idle_joints
from planner.solving.solution import Solution, not_least, solve_question
from planner.solving.why_not import look_again
from planner.verification import Check

__all__ = ["Trial", "try_stance"]


class Trial(NamedTuple):
    """What came of a stance that was tried.

    Attributes
    ----------
    prepared : PreparedStance
    found : Solution
    idle : tuple of LimitUse
        How much of their joints' torque limbs without a hand use.
    budget : Budget
        What is left of its programs.
    """

    prepared: PreparedStance
    found: Solution
    idle: tuple[LimitUse, ...]
    budget: Budget

    @property
    def utilisation(self) -> float:
        """The largest of the verified plan; infinite without one."""
        reading = self.found.reading
        if not self.found.passes or reading is None or not_least(self.found):
            return math.inf
        return reading.whole

    def load_factor(self) -> FoundFactor:
        """Find how many times the body wrench could be held."""
        return find_load_factor(self.prepared, self.found, self.idle, self.budget)


def try_stance(
    prepared: PreparedStance,
    idle: Sequence[LimitUse] | None = None,
    near: WristSolution | None = None,
) -> Trial:
    """Return the verified plan of a stance, of which no store keeps anything.

    Parameters
    ----------
    prepared : PreparedStance
    idle : sequence of LimitUse, optional
        How much of their joints' torque limbs without a hand use, where that is known.
    near : WristSolution, optional
        Where floating wrists are in a plan of much the same stance.
    """
    bare = idle_joints(prepared) if idle is None else tuple(idle)
    checks, budget = Overlap(partial(_checks, prepared, bare)), Budget(PROGRAMS)
    found = solve_question(prepared, checks, budget, near)
    if not found.passes:
        found, _ = look_again(prepared, checks, found, budget, prove=False)
    return Trial(prepared, found, bare, budget)


def _checks(prepared: PreparedStance, idle: tuple[LimitUse, ...]) -> PreparedChecks:
    """Return what reads and checks its plans, of which nothing is kept."""
    batch, hands, recovery = prepared.batch, prepared.hands, None
    if not hands.floating:
        recovery = LoadRecovery(batch, hands.spaces, hands.scaled)
    check = Check(prepared.question, batch, prepared.where)
    return PreparedChecks(recovery, check, tuple(idle), (), ())
