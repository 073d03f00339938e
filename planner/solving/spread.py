"""Spread: plan a stance anew for Monte Carlo samples of the hand's and the rock's parameters.

A sample changes the hands and the strength of their tiles. Body, poses of the hands, joints and
body wrench stay the same. A hand with a seat is closed at the seat of the sample's hand: H stays
where it is, and the rock is elsewhere. A hand whose best seat was searched for keeps that seat. The
search for floating wrists starts from the solution for the question's hands. A sample's plan has no
certificate, no prices and no explanation.

The contact stiffness on rock is uncertain, too, but counts only where wrists move: samples have it
if a wrist that is compliant or floating is on another surface than that of the calibration.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

from hand_models.base import InvalidInputError
from hand_models.hand import Placement, PlacementKey, SettledHand, settle_hands
from hand_models.parameters import FITTED_SURFACE
from planner import deadline
from planner.advice import Attempt
from planner.deadline import DeadlineError
from planner.explanation import LimitUse
from planner.prepare import PreparedStance
from planner.programs import CAP_SLACK
from planner.question import DrawnHand, drawn_hands, drawn_quantities
from planner.result import DrawnPlan, Spread
from planner.solving.solution import Solution

__all__ = ["find_spread"]


def find_spread(
    prepared: PreparedStance, idle: Sequence[LimitUse], usual: Solution, attempt: Attempt
) -> Spread | None:
    """Return the plans of a stance over all samples of uncertain parameters (Monte Carlo).

    Parameters
    ----------
    prepared : PreparedStance
    idle : sequence of LimitUse
        Utilisation of the joints of limbs without a hand, the same in every sample.
    usual : Solution
        Solution for the question's hands, from which searches for floating wrists start.
    attempt : callable
        Plans the stance of a sample (`try_stance`).

    Returns
    -------
    Spread or None
        None if the deadline passed before all samples were planned.
    """
    question, plans = prepared.question, []
    surfaces = frozenset(hand.surface.name for hand in question.stance.hands)
    moving = any(
        hand.wrist != "fixed" and hand.surface.name != FITTED_SURFACE
        for hand in question.stance.hands
    )
    limbs = tuple(sorted(hand.limb for hand in question.stance.hands))
    drawn = drawn_hands(question.stance.robot.hand, question.draws, wrists_move=moving, limbs=limbs)
    refused: Counter[str] = Counter()
    try:
        for each in drawn:
            deadline.check("all samples were planned")
            outcomes = _settled(prepared, each)
            there = [hand for hand in outcomes if isinstance(hand, SettledHand)]
            pairs = zip(prepared.limbs, outcomes, strict=True)
            refused.update(limb for limb, hand in pairs if not isinstance(hand, SettledHand))
            whole = len(there) == len(outcomes)
            plans.append(_planned(prepared, there, idle, usual, attempt) if whole else DrawnPlan())
        deadline.check("all samples were planned")
    except DeadlineError:
        return None
    cap = question.limits.utilisation
    return Spread.of(plans, cap, refused, drawn_quantities(drawn, surfaces))


def _settled(prepared: PreparedStance, drawn: DrawnHand) -> list[SettledHand | InvalidInputError]:
    """Return the hands closed as those of a draw; errors in place of those that cannot be."""
    placements = {}
    keys = []
    for hand, usual in zip(prepared.question.stance.hands, prepared.batch.hands, strict=True):
        seat, at = hand.placed_hold(), hand.at
        if hand.seat == "best":
            seat, at = usual.seating.pose, None
        placement = Placement(hand.hold, drawn.surface(hand.surface), hand.grasp, seat, at)
        keys.append(PlacementKey(placement))
        placements[keys[-1]] = placement
    # hands that close alike close once
    outcomes = settle_hands(drawn.model, list(placements.values()))
    found = dict(zip(placements, outcomes, strict=True))
    pairs = [(limb, found[key]) for limb, key in zip(prepared.limbs, keys, strict=True)]
    return [
        drawn.closed(each, limb) if isinstance(each, SettledHand) else each for limb, each in pairs
    ]


def _planned(
    prepared: PreparedStance,
    settled: Sequence[SettledHand],
    idle: Sequence[LimitUse],
    usual: Solution,
    attempt: Attempt,
) -> DrawnPlan:
    """Return what the verified plan says of the same stance with a draw's hands."""
    try:
        there = prepared.with_hands(settled)
    except InvalidInputError:
        # a preload that a floating hand does not hold
        return DrawnPlan()
    pairs = zip(settled, prepared.batch.hands, strict=True)
    # with its palms, a hand has other ways to carry
    alike = all(drawn.palm.engaged == own.palm.engaged for drawn, own in pairs)
    trial = attempt(there, idle, usual if prepared.hands.floating and alike else None)
    used, factor = trial.utilisation, trial.load_factor().factor
    if math.isinf(used):
        return DrawnPlan(load_factor=factor)
    return DrawnPlan(used, factor, used <= there.question.limits.utilisation + CAP_SLACK)
