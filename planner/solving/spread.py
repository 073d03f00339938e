"""Spread: plan a stance anew for Monte Carlo samples of the hand's and the rock's parameters.

A sample changes the hands and the strength of their tiles. Body, poses of the hands, joints and
body wrench stay the same. A hand with a seat is closed at the seat of the sample's hand: H stays
where it is, and the rock is elsewhere. A hand whose best seat was searched for keeps that seat. The
search for floating wrists starts from the solution for the question's hands. A sample's plan has no
certificate, no prices and no explanation. Beside it stands what the question's own plan does in the
sample, its tensions kept or balanced by feedback (`planner.execution`).

The contact stiffness on rock is uncertain, too, but counts only where wrists move: samples have it
if a wrist that is compliant or floating is on another surface than that of the calibration.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import Final

from hand_models.base import InvalidInputError
from hand_models.hand import Placement, PlacementKey, SettledHand, settle_hands
from hand_models.parameters import FITTED_SURFACE
from hand_models.tile import Surface
from planner import deadline
from planner.advice import Attempt
from planner.deadline import DeadlineError
from planner.execution import Passes, execute_closed, sent_plans, without_margins
from planner.explanation import LimitUse
from planner.prepare import PreparedStance
from planner.programs import CAP_SLACK
from planner.question import DrawnHand, drawn_hands, drawn_quantities
from planner.result import DrawnPlan, HandPlan, SentPlan, Spread
from planner.solving.solution import Solution

__all__ = ["find_spread"]

LATE: Final = "all samples were planned"
"""What a deadline may leave unfinished."""


def find_spread(
    prepared: PreparedStance,
    idle: Sequence[LimitUse],
    usual: Solution,
    attempt: Attempt,
    hands: Sequence[HandPlan] = (),
    passes: Passes = lambda *_: True,
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
    hands : sequence of HandPlan, optional
        Verified plan for the question's hands, whose set-points are judged in all samples.
    passes : callable, optional
        Check of each equilibrium of hands whose wrists move, as of `find_open_loop`.

    Returns
    -------
    Spread or None
        None if the deadline passed before all samples were planned.
    """
    question, stance = prepared.question, prepared.question.stance
    surfaces = frozenset(hand.surface.name for hand in stance.hands)
    moving = any(
        hand.wrist != "fixed" and hand.surface.name != FITTED_SURFACE for hand in stance.hands
    )
    drawn = drawn_hands(stance.robot.hand, question.draws, wrists_move=moving)
    fixed = len(hands) > 0 and not prepared.floating
    limbs_hold = len(prepared.floating) == len(hands) > 0 and stance.limb_stiffness is not None
    bare, tensions = without_margins(prepared), [hand.tensions for hand in hands]
    used = max([each.utilisation for each in idle], default=0.0)
    plans, refused = [DrawnPlan()] * len(drawn), Counter[str]()
    kept, feedback = [SentPlan()] * len(drawn), [SentPlan()] * len(drawn)
    closed: dict[int, list[SettledHand]] = {}
    try:
        for k, each in enumerate(drawn):
            deadline.check(LATE)
            outcomes = _settled(prepared, each)
            own = [hand for hand in outcomes if isinstance(hand, SettledHand)]
            pairs = zip(prepared.limbs, outcomes, strict=True)
            refused.update(limb for limb, hand in pairs if not isinstance(hand, SettledHand))
            there = _with_hands(prepared, own) if len(own) == len(outcomes) else None
            if there is None:
                continue
            closed[k], plans[k] = own, _planned(prepared, there, idle, usual, attempt)
            if fixed:
                sent = there if bare is prepared else bare.with_hands(own)
                kept[k], feedback[k] = sent_plans(sent, tensions, used)
        if limbs_hold:
            found = execute_closed(prepared, hands, list(closed.values()), used, passes)
            for k, sample in zip(closed, found, strict=True):
                kept[k] = SentPlan(sample.utilisation, sample.holds)
        deadline.check(LATE)
    except DeadlineError:
        return None
    return Spread.of(
        plans,
        question.limits.utilisation,
        refused,
        drawn_quantities(drawn, surfaces),
        kept if fixed or limbs_hold else None,
        feedback if fixed else None,
    )


def _settled(prepared: PreparedStance, drawn: DrawnHand) -> list[SettledHand | InvalidInputError]:
    """Return the hands closed as those of a draw; errors in place of those that cannot be."""
    placements, surfaces, keys = {}, dict[Surface, Surface](), list[PlacementKey]()
    for hand, usual in zip(prepared.question.stance.hands, prepared.batch.hands, strict=True):
        seat, at = hand.placed_hold(), hand.at
        if hand.seat == "best":
            seat, at = usual.seating.pose, None
        if hand.surface not in surfaces:
            surfaces[hand.surface] = drawn.surface(hand.surface)
        placement = Placement(hand.hold, surfaces[hand.surface], hand.grasp, seat, at)
        keys.append(PlacementKey(placement))
        placements[keys[-1]] = placement
    # hands that close alike close once
    outcomes = settle_hands(drawn.model, list(placements.values()))
    found = dict(zip(placements, outcomes, strict=True))
    return [found[key] for key in keys]


def _with_hands(prepared: PreparedStance, settled: Sequence[SettledHand]) -> PreparedStance | None:
    """Return the stance with a draw's hands; None if one does not hold the preload that it has."""
    try:
        return prepared.with_hands(settled)
    except InvalidInputError:
        return None


def _planned(
    prepared: PreparedStance,
    there: PreparedStance,
    idle: Sequence[LimitUse],
    usual: Solution,
    attempt: Attempt,
) -> DrawnPlan:
    """Return what the verified plan says of the same stance with a draw's hands."""
    pairs = zip(there.batch.hands, prepared.batch.hands, strict=True)
    # with its palms, a hand has other ways to carry
    alike = all(drawn.palm.engaged == own.palm.engaged for drawn, own in pairs)
    trial = attempt(there, idle, usual if prepared.hands.floating and alike else None)
    used, factor = trial.utilisation, trial.load_factor().factor
    if math.isinf(used):
        return DrawnPlan(load_factor=factor)
    return DrawnPlan(used, factor, used <= there.question.limits.utilisation + CAP_SLACK)
