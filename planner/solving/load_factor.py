"""The load factor: how many times the body wrench could be held at utilisation 1."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Final

import numpy as np

from hand_models.fixed_wrist import DRAWS, TENTH, scattered_hands, wrench_spaces
from hand_models.hand import SettledHand
from planner import deadline, programs
from planner.deadline import DeadlineError
from planner.floating import NO_WRENCH, most_load
from planner.prepare import HandSets
from planner.programs import SLACK, StanceData
from planner.result import RobustLoadFactor
from planner.solving.answer import Answer

__all__ = ["find_load_factor", "find_robust_load_factor"]

SEED: Final = 0
"""Of the places of hands that are drawn."""


def find_load_factor(answer: Answer) -> None:
    """Find how many times the body wrench could be held, if it can be known."""
    if _overloaded_by_itself(answer):
        return
    if not _needs_hands(answer):
        # any multiple of it can be held, or none
        answer.unbounded = answer.outcome.solved and answer.outcome.value <= 1.0 + SLACK
        return
    if deadline.expired():
        answer.mind_time("load_factor")
        return
    if answer.least_used is not None:
        most = most_load(answer.parts, answer.least_used, answer.known_factor, answer.budget)
        if most is not None:
            answer.load_factor, answer.least_factor = most.factor, not most.sure
        else:
            answer.mind_time("load_factor")
        return
    answer.load_factor = _most(answer.parts, answer.data)
    if answer.load_factor is None:
        answer.mind_time("load_factor")


def find_robust_load_factor(answer: Answer) -> None:
    """Find it where the hands are not quite where they were put, if that is asked for."""
    if "robust" not in answer.question.want or not _needs_hands(answer):
        return
    hand = answer.question.stance.robot.hand
    # drawn in the order of their names, whatever the order of the question
    order = np.argsort(answer.limbs)
    settled = [answer.batch.hands[i] for i in order.tolist()]
    places = scattered_hands(hand, settled, DRAWS, SEED, hand.seat_scatter)
    factors: list[float] = []
    refused: Counter[str] = Counter()
    try:
        for drawn in places:
            deadline.check("all draws were planned")
            draw = [drawn[i] for i in np.argsort(order).tolist()]
            there = [each for each in draw if isinstance(each, SettledHand)]
            pairs = zip(answer.limbs, draw, strict=True)
            refused.update(limb for limb, each in pairs if not isinstance(each, SettledHand))
            factor = _most_elsewhere(answer, there) if len(there) == len(draw) else None
            factors += [] if factor is None else [factor]
        deadline.check("all draws were planned")
    except DeadlineError:
        answer.mind_time("robust")
        return
    without = DRAWS - len(factors)
    worst, tenth = np.percentile(factors, [0.0, TENTH]).tolist() if factors else (None, None)
    answer.robust = RobustLoadFactor(
        DRAWS, without, dict(refused), *hand.seat_scatter, SEED, worst, tenth
    )


def _most_elsewhere(answer: Answer, settled: Sequence[SettledHand]) -> float | None:
    """Return the load factor of the same hands closed elsewhere; None if there is none."""
    if _overloaded_by_itself(answer):
        return None
    spaces = wrench_spaces(settled, answer.question.limits.tendon_tension)
    pairs = zip(answer.parts.added, spaces, strict=True)
    moved = answer.parts.with_sets([rows.on(space) for rows, space in pairs])
    return _most(moved, moved.sets(moved.at_rest(moved.idle)).data)


def _overloaded_by_itself(answer: Answer) -> bool:
    """Whether a limb without a hand cannot bear itself, whatever the body needs."""
    return any(used.utilisation > 1.0 + SLACK for used in answer.idle)


def _needs_hands(answer: Answer) -> bool:
    """Whether anything is asked of the hands."""
    return bool(np.abs(answer.data.wrench[:6]).max() > NO_WRENCH)


def _most(hands: HandSets, data: StanceData) -> float | None:
    """Return the load factor of hands with fixed wrists; None if none passes its checks."""
    result = programs.load_factor(data)
    if not result.solved:
        return None
    scaled = data.turned(hands.goal(result.value))
    error = programs.body_wrench(scaled, result.loads) - scaled.wrench
    used = max(
        float(np.max(hand.L @ (y / hand.unit) + hand.l0, initial=0.0))
        for hand, y in zip(data.hands, result.loads, strict=True)
    )
    return max(result.value, 0.0) if np.abs(error).max() <= SLACK and used <= 1.0 + SLACK else None
