"""Spread: plan a stance anew for Monte Carlo samples of the hand's and the rock's parameters.

A sample changes the hands and the strength of their tiles. Body, poses of the hands, joints and
body wrench stay the same. The search for floating wrists starts from the solution for the
question's hands. A sample's plan has no certificate, no prices and no explanation. Beside it stands
what the question's own plan does in the sample, its tensions kept or balanced by feedback
(`planner.execution`).

The contact stiffness on rock is uncertain, too, but counts only where wrists move: samples have it
if a wrist that is compliant or floating is on another surface than that of the calibration.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from hand_models.base import root_between
from hand_models.hand import SettledHand
from hand_models.parameters import FITTED_SURFACE, ParameterTable, draw_table, surface_table
from planner import deadline
from planner.advice import Attempt, StanceTrial
from planner.deadline import DeadlineError
from planner.execution import Passes, execute_closed, sent_plans, without_margins
from planner.explanation import LimitUse
from planner.prepare import PreparedStance, settled_as_drawn, with_drawn_hands
from planner.programs import CAP_SLACK
from planner.question import DrawnHand, drawn_hands, drawn_quantities
from planner.result import DrawnPlan, HandPlan, SentPlan, Spread, StrengthThreshold
from planner.solving.objective import MAX_MARGIN, Objective
from planner.solving.objectives import MAX_ROBUST, objective_of
from planner.solving.solution import Solution

__all__ = ["find_spread"]

ALL_PLANNED: Final = "all samples were planned"
"""What a deadline may leave unfinished."""


@dataclass(frozen=True, slots=True)
class ThresholdSettings:
    """Settings of the search for the least strength of rock."""

    surface: str = "rock"
    """Preset surface whose strength has an assumed range."""
    accuracy: float = 0.01  # of the strength, far below what is known of any rock
    none: float = 10.0
    """Utilisation beyond the cap that stands for no plan: finite, so that it can be bracketed."""


THRESHOLD_SETTINGS: Final = ThresholdSettings()


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
    if objective_of(prepared.question) is MAX_ROBUST:
        # planned anew with the sample known, tensions need not serve other samples
        known: Objective = MAX_MARGIN
        prepared = replace(prepared, question=replace(prepared.question, objective=known))
    question, stance = prepared.question, prepared.question.stance
    surfaces = frozenset(hand.surface.name for hand in stance.hands)
    moving = any(
        hand.wrist != "fixed" and hand.surface.name != FITTED_SURFACE for hand in stance.hands
    )
    limbs = tuple(sorted(hand.limb for hand in stance.hands))
    drawn = drawn_hands(stance.robot.hand, question.draws, wrists_move=moving, limbs=limbs)
    fixed = len(hands) > 0 and not prepared.floating
    limbs_hold = len(prepared.floating) == len(hands) > 0 and stance.limb_stiffness is not None
    bare, tensions = without_margins(prepared), [hand.tensions for hand in hands]
    used = max([each.utilisation for each in idle], default=0.0)
    plans, refused = [DrawnPlan()] * len(drawn), Counter[str]()
    kept, feedback = [SentPlan()] * len(drawn), [SentPlan()] * len(drawn)
    closed: dict[int, Sequence[SettledHand]] = {}
    try:
        for k, each in enumerate(drawn):
            deadline.check(ALL_PLANNED)
            outcomes = settled_as_drawn(prepared, each)
            pairs = zip(prepared.limbs, outcomes, strict=True)
            refused.update(limb for limb, hand in pairs if not isinstance(hand, SettledHand))
            there = with_drawn_hands(prepared, outcomes)
            if there is None:
                continue
            closed[k] = own = there.batch.hands
            plans[k] = _planned(_tried(prepared, there, idle, usual, attempt))
            if fixed:
                sent = there if bare is prepared else bare.with_hands(own)
                kept[k], feedback[k] = sent_plans(sent, tensions, used)
        if limbs_hold:
            found = execute_closed(prepared, hands, list(closed.values()), used, passes)
            for k, sample in zip(closed, found, strict=True):
                kept[k] = SentPlan(sample.utilisation, sample.holds)
        own_samples = question.draws is not None
        threshold = None if own_samples else _threshold(prepared, idle, usual, attempt)
        deadline.check(ALL_PLANNED)
    except DeadlineError:
        return None
    quantities = drawn_quantities(drawn, surfaces)
    return Spread.of(
        plans,
        question.limits.utilisation,
        refused,
        quantities,
        kept if fixed or limbs_hold else None,
        feedback if fixed else None,
        threshold,
        {name: _source(drawn[0], name) for name in quantities},
    )


def _source(drawn: DrawnHand, name: str) -> str:
    """Return the source of an uncertain parameter, by its name in `drawn_quantities`."""
    section, _, entry = name.partition(".")
    for drawn_range in ("discrepancy", "half_planes"):
        if drawn_range in (section, entry):
            return draw_table().quantity("ranges", drawn_range).source
    entry, table = entry.split("[")[0], drawn.model.table
    if section not in table.sections:
        table = drawn.surfaces
        section = section if entry in table.sections.get(section, {}) else "defaults"
    return table.quantity(section, entry).source


def _threshold(
    prepared: PreparedStance, idle: Sequence[LimitUse], usual: Solution, attempt: Attempt
) -> StrengthThreshold | None:
    """Return the least strength of rock in its assumed range with which the stance is feasible."""
    stance, table = prepared.question.stance, surface_table()
    preset, sandpaper = THRESHOLD_SETTINGS.surface, table.scalar(FITTED_SURFACE, "shear_limit")
    least, most = draw_table().vector("ranges", "rock_ratio")
    cap = prepared.question.limits.utilisation + CAP_SLACK

    def on_rock(ratio: float) -> DrawnHand:
        strength = table.quantity(preset, "shear_limit").changed(ratio * sandpaper)
        own = ParameterTable({preset: {"shear_limit": strength}})
        return DrawnHand(stance.robot.hand, table.replaced(own), None, {})

    def beyond(weakness: float) -> float:
        """Return by how much the utilisation exceeds the cap on rock of 1 / weakness."""
        deadline.check(ALL_PLANNED)
        there = with_drawn_hands(prepared, settled_as_drawn(prepared, on_rock(1.0 / weakness)))
        if there is None:
            return THRESHOLD_SETTINGS.none
        used = _tried(prepared, there, idle, usual, attempt).utilisation
        return min(used - cap, THRESHOLD_SETTINGS.none)

    weakest = on_rock(least)
    if all(weakest.surface(hand.surface) == hand.surface for hand in stance.hands):
        return None
    ratio: float | None = least
    ends = 1.0 / most, 1.0 / least
    if (on_strongest := beyond(ends[0])) > 0.0:
        ratio = None
    elif (on_weakest := beyond(ends[1])) > 0.0:
        # the utilisation is nearly linear in the weakness
        accuracy = THRESHOLD_SETTINGS.accuracy / most
        ratio = 1.0 / root_between(beyond, ends, (on_strongest, on_weakest), accuracy)
    share = 0.0 if ratio is None else (most - ratio) / (most - least)
    strength = None if ratio is None else ratio * sandpaper
    return StrengthThreshold(preset, strength, ratio, [least, most], share)


def _tried(
    prepared: PreparedStance,
    there: PreparedStance,
    idle: Sequence[LimitUse],
    usual: Solution,
    attempt: Attempt,
) -> StanceTrial:
    """Return the plan of the same stance with other hands."""
    pairs = zip(there.batch.hands, prepared.batch.hands, strict=True)
    # with its palms, a hand has other ways to carry
    alike = all(drawn.palm.engaged == own.palm.engaged for drawn, own in pairs)
    return attempt(there, idle, usual if prepared.hands.floating and alike else None)


def _planned(trial: StanceTrial) -> DrawnPlan:
    """Return what the verified plan says of the same stance with a draw's hands."""
    used, factor = trial.utilisation, trial.load_factor().factor
    if math.isinf(used):
        return DrawnPlan(load_factor=factor)
    cap = trial.prepared.question.limits.utilisation
    return DrawnPlan(used, factor, used <= cap + CAP_SLACK)
