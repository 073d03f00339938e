"""The load factor: how many times the body wrench could be held at utilisation 1."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planner import deadline, programs
from planner.deadline import Budget, Unfinished, late
from planner.explanation import LimitUse
from planner.floating import NO_WRENCH, most_load
from planner.prepare import HandSets, PreparedStance
from planner.programs import SLACK, StanceData
from planner.result import LoadFactorStatus
from planner.solving.solution import Solution

__all__ = [
    "FoundFactor",
    "find_load_factor",
    "most_of_fixed",
    "needs_hands",
    "overloaded_by_itself",
]


class FoundFactor(NamedTuple):
    """What was found of a load factor.

    Attributes
    ----------
    factor : float or None
    least : bool
        Whether it is only known to be no less.
    unbounded : bool
        Whether any multiple of the body wrench can be held.
    unfinished : tuple of str
        What the deadline came before.
    """

    factor: float | None = None
    least: bool = False
    unbounded: bool = False
    unfinished: tuple[Unfinished, ...] = ()

    @property
    def status(self) -> LoadFactorStatus:
        """What is known of it, where it was asked for."""
        if self.unbounded:
            return "unbounded"
        if self.factor is not None:
            return "at_least" if self.least else "found"
        return "not_finished" if self.unfinished else "none"


def find_load_factor(
    prepared: PreparedStance, found: Solution, idle: Sequence[LimitUse], budget: Budget
) -> FoundFactor:
    """Return how many times the body wrench could be held, if it can be known."""
    if overloaded_by_itself(idle):
        return FoundFactor()
    if not needs_hands(prepared):
        # any multiple of it can be held, or none
        held = found.outcome.solved and found.outcome.value <= 1.0 + SLACK
        return FoundFactor(unbounded=held)
    if deadline.expired():
        return FoundFactor(unfinished=("load_factor",))
    if found.least_use is not None:
        most = most_load(prepared.hands, found.least_use, found.factor, budget)
        if most is not None:
            return FoundFactor(most.factor, least=not most.sure)
    else:
        factor = most_of_fixed(prepared.hands, found.sets.data)
        if factor is not None:
            return FoundFactor(factor)
    return FoundFactor(unfinished=late("load_factor"))


def overloaded_by_itself(idle: Sequence[LimitUse]) -> bool:
    """Whether a limb without a hand cannot bear itself, whatever the body needs."""
    return any(used.utilisation > 1.0 + SLACK for used in idle)


def needs_hands(prepared: PreparedStance) -> bool:
    """Whether anything is asked of the hands."""
    return bool(np.abs(prepared.hands.wrench[:6]).max() > NO_WRENCH)


def most_of_fixed(hands: HandSets, data: StanceData) -> float | None:
    """Return the load factor of hands with fixed wrists; None if none passes its checks."""
    result = programs.load_factor(data)
    if not result.solved:
        return None
    held = programs.holds(data.turned(hands.goal(result.value)), result.loads, 1.0)
    return max(result.value, 0.0) if held else None
