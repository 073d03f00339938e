"""Load factors of a stance whose palms carry no shear, or do not press."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from msgspec import structs

from hand_models.fixed_wrist import PALM_PRESSING, PALM_SHEAR
from hand_models.wrench_spaces import WrenchSpace
from planner import deadline
from planner.prepare import PreparedStance, prepare_stance
from planner.programs import CAP_SLACK
from planner.question import Question, Want
from planner.result import Plan
from planner.solving.fixed_wrists import most_of_fixed
from planner.solving.solve import plan
from planner.solving.verified import idle_joints

__all__ = ["PalmLoadFactors", "load_factors_without_palm_loads", "plan_without_palms"]


class PalmLoadFactors(NamedTuple):
    """Load factors of a stance that lacks one of its palms' two loads; None if there is no plan.

    Attributes
    ----------
    without_shear : float or None
        Load factor if palms press, and carry no shear.
    without_pressing : float or None
        Load factor if palms carry shear, and do not press.
    """

    without_shear: float | None
    without_pressing: float | None


def plan_without_palms(question: Question) -> Plan:
    """Return the plan, with its load factor, of a stance whose palms carry nothing.

    Parameters
    ----------
    question : Question
        Question whose stance is planned without palms; of its extras only the load factor is.

    Raises
    ------
    DeadlineError
        If the deadline passes before a plan passes the checks or is proven infeasible.
    """
    stance = question.stance
    hands = [replace(hand, grasp=structs.replace(hand.grasp, palm=False)) for hand in stance.hands]
    bare = replace(stance, hands=tuple(hands))
    want: frozenset[Want] = frozenset({"load_factor"})
    plain = replace(question, want=want, draws=None, open_loop=None, explain=False)
    return plan(replace(plain, stance=bare))


def load_factors_without_palm_loads(question: Question) -> PalmLoadFactors | None:
    """Return the load factors without the palms' shear, and without their pressing.

    The palm of a wrist that moves carries what its travel gives, so these are for stances with
    fixed wrists alone.

    Parameters
    ----------
    question : Question
        Question whose stance is planned with each of the two loads left out.

    Returns
    -------
    PalmLoadFactors or None
        None if a wrist is compliant or floating, no palm is on rock, or the body wrench is zero.

    Raises
    ------
    InvalidInputError
        If the question is not valid; the error's field is relative to the question.
    DeadlineError
        If the deadline passes before both are found.
    """
    prepared = prepare_stance(question)
    palms = any(hand.palm.engaged for hand in prepared.batch.hands)
    if prepared.hands.floating or not palms or not prepared.needs_hands:
        return None
    if any(each.utilisation > 1.0 + CAP_SLACK for each in idle_joints(prepared)):
        return PalmLoadFactors(None, None)
    found = PalmLoadFactors(*(_without(prepared, load) for load in (PALM_SHEAR, PALM_PRESSING)))
    deadline.check("load factors without one of the palms' loads were found")
    return found


def _without(prepared: PreparedStance, load: str) -> float | None:
    """Return the load factor of hands whose sets lack a load of the palm."""
    hands = prepared.hands.with_sets([_less(space, load) for space in prepared.hands.spaces])
    return most_of_fixed(hands, hands.data)


def _less(space: WrenchSpace, load: str) -> WrenchSpace:
    """Return a set without one of its loads, which is then zero."""
    kept = np.array([column != load for column in space.columns])
    return replace(
        space,
        generators=space.generators[:, kept],
        columns=tuple(column for column in space.columns if column != load),
        L=space.L[:, kept],
        H=space.H[:, kept],
    )
