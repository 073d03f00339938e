"""The load factor: how many times the body wrench could be held at utilisation 1."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from hand_models.fixed_wrist import DRAWS, TENTH, scattered_hands, wrench_spaces
from hand_models.hand import SettledHand
from planner import deadline, programs
from planner.deadline import Budget, DeadlineError, Unfinished, late
from planner.explanation import LimitUse
from planner.floating import NO_WRENCH, most_load
from planner.prepare import HandSets, PreparedStance
from planner.programs import SLACK, StanceData
from planner.result import RobustLoadFactor
from planner.solving.solution import Solution

__all__ = ["FoundFactor", "find_load_factor", "find_robust_load_factor", "needs_hands"]

SEED: Final = 0
"""Of the places of hands that are drawn."""


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


def find_load_factor(
    prepared: PreparedStance, found: Solution, idle: Sequence[LimitUse], budget: Budget
) -> FoundFactor:
    """Return how many times the body wrench could be held, if it can be known."""
    if _overloaded_by_itself(idle):
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
        factor = _most(prepared.hands, found.sets.data)
        if factor is not None:
            return FoundFactor(factor)
    return FoundFactor(unfinished=late("load_factor"))


def find_robust_load_factor(
    prepared: PreparedStance, idle: Sequence[LimitUse]
) -> RobustLoadFactor | None:
    """Return it where the hands are not quite where they were put; None if time does not allow."""
    hand, limbs = prepared.question.stance.robot.hand, prepared.limbs
    # drawn in the order of their names, whatever the order of the question
    order = np.argsort(limbs)
    settled = [prepared.batch.hands[i] for i in order.tolist()]
    places = scattered_hands(hand, settled, DRAWS, SEED, hand.seat_scatter)
    factors: list[float] = []
    refused: Counter[str] = Counter()
    try:
        for drawn in places:
            deadline.check("all draws were planned")
            draw = [drawn[i] for i in np.argsort(order).tolist()]
            there = [each for each in draw if isinstance(each, SettledHand)]
            pairs = zip(limbs, draw, strict=True)
            refused.update(limb for limb, each in pairs if not isinstance(each, SettledHand))
            if len(there) == len(draw) and not _overloaded_by_itself(idle):
                factor = _most_elsewhere(prepared, there)
                factors += [] if factor is None else [factor]
        deadline.check("all draws were planned")
    except DeadlineError:
        return None
    without = DRAWS - len(factors)
    worst, tenth = np.percentile(factors, [0.0, TENTH]).tolist() if factors else (None, None)
    return RobustLoadFactor(DRAWS, without, dict(refused), *hand.seat_scatter, SEED, worst, tenth)


def _most_elsewhere(prepared: PreparedStance, settled: Sequence[SettledHand]) -> float | None:
    """Return the load factor of the same hands closed elsewhere; None if there is none."""
    spaces = wrench_spaces(settled, prepared.question.limits.tendon_tension)
    pairs = zip(prepared.hands.added, spaces, strict=True)
    moved = prepared.hands.with_sets([rows.on(space) for rows, space in pairs])
    return _most(moved, moved.sets(moved.at_rest(moved.idle)).data)


def _overloaded_by_itself(idle: Sequence[LimitUse]) -> bool:
    """Whether a limb without a hand cannot bear itself, whatever the body needs."""
    return any(used.utilisation > 1.0 + SLACK for used in idle)


def needs_hands(prepared: PreparedStance) -> bool:
    """Whether anything is asked of the hands."""
    return bool(np.abs(prepared.hands.wrench[:6]).max() > NO_WRENCH)


def _most(hands: HandSets, data: StanceData) -> float | None:
    """Return the load factor of hands with fixed wrists; None if none passes its checks."""
    result = programs.load_factor(data)
    if not result.solved:
        return None
    held = programs.holds(data.turned(hands.goal(result.value)), result.loads, 1.0)
    return max(result.value, 0.0) if held else None
