"""Find how much stronger rock, or how much lighter a body, makes a stance feasible."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from planner.advice.changes import SETTINGS, Change, hand_path
from planner.advice.trials import Trials
from planner.question import HandOnHold

__all__ = ["lighter", "stronger"]


def stronger(trials: Trials, order: Sequence[int], most: int) -> None:
    """Find the factors on the rock's strength, under all hands or one, for a feasible stance.

    Results are kept in ``trials``.

    Parameters
    ----------
    trials : Trials
        Budget of plans.
    order : sequence of int
        Indices of single hands, in this order.
    most : int
        Largest number of plans.
    """
    hands, last = trials.question.stance.hands, trials.left - most
    single = [(i,) for i in order] if len(hands) > 1 else []
    for which in [tuple(range(len(hands))), *single]:
        if trials.left - last < SETTINGS.strength_plans:
            return
        enough = _enough(trials, which)
        if not enough and len(which) == len(hands):
            # what all holds together do not do, none does
            return


def _enough(trials: Trials, which: Sequence[int]) -> bool:
    """Find how much stronger some holds have to be, if that is enough, to 0.01 if it can be."""
    most = trials.of([_strengthened(trials, which, SETTINGS.strongest)])
    if not most or not trials.holds(most[0].utilisation):
        return False
    cap = trials.question.limits.utilisation
    # pairs of 1 / k and utilisation, over which that is nearly straight
    low, high = (1.0, trials.base.utilisation), (1.0 / SETTINGS.strongest, most[0].utilisation)
    for _ in range(SETTINGS.strength_plans - 1):
        share = 0.5 if math.isinf(low[1]) else (cap - high[1]) / (low[1] - high[1])
        inverse = high[0] + min(max(share, 0.02), 0.98) * (low[0] - high[0])
        factor = math.ceil((1.0 / inverse) / SETTINGS.share_step) * SETTINGS.share_step
        if not 1.0 / low[0] < factor < 1.0 / high[0]:
            break
        found = trials.of([_strengthened(trials, which, factor)])
        used = found[0].utilisation if found else math.inf
        if trials.holds(used):
            high = 1.0 / factor, used
        else:
            low = 1.0 / factor, used
    return True


def _strengthened(trials: Trials, which: Sequence[int], factor: float) -> Change:
    """Return some hands' holds so many times as strong."""
    hands = [trials.question.stance.hands[i] for i in which]
    changes = {
        hand_path(i, "surface"): _surface(hand, factor)
        for i, hand in zip(which, hands, strict=True)
    }
    limbs = tuple(hand.limb for hand in hands)
    whose = "all hands" if len(which) == len(trials.question.stance.hands) else limbs[0]
    more = 100.0 * (factor - 1.0)
    words = f"if the rock under {whose} were {more:.{0 if more >= 1.0 else 1}f} % stronger"
    return Change(
        "strength", limbs, words, changes, len(which) * math.log(factor) / SETTINGS.strength_unit
    )


def _surface(hand: HandOnHold, factor: float) -> dict[str, Any]:
    """Return the numbers of a hand's surface, as strong."""
    numbers = {name: value for name, value in asdict(hand.surface).items() if name != "name"}
    if numbers["pull_off_exponent"] == 1.0:
        # Eq. 21's, which every surface has unless it says so
        del numbers["pull_off_exponent"]
    for name in ("shear_limit", "pull_off_limit", "lateral_limit"):
        numbers[name] = float(numbers[name] * factor)
    return numbers


def lighter(trials: Trials, factor: float | None, most: int) -> None:
    """Find the largest mass of the body for which the stance is feasible.

    Results are kept in ``trials``: none where a body wrench or an angular acceleration is given.

    Parameters
    ----------
    trials : Trials
        Budget of plans.
    factor : float or None
        Load factor of the unchanged stance, where the search starts; None if there is none.
    most : int
        Largest number of plans.
    """
    question = trials.question
    load = question.load
    if question.body_wrench is not None or factor is None or any(load.angular_acceleration):
        return
    mass = question.stance.robot.mass if load.mass is None else load.mass
    low, high = 0.0, min(factor, 1.0)
    share = high * (1.0 - 1e-4)  # a little less than the largest mass
    for _ in range(most):
        if share < 1e-2:  # less of the mass is not reported
            break
        changes: dict[str, Any] = {"load.mass": share * mass}
        words = f"if the body weighed {share * mass:.1f} kg instead of {mass:.1f} kg"
        size = -math.log(share) / SETTINGS.strength_unit
        tried = trials.of([Change("mass", (), words, changes, size)])
        if tried and trials.holds(tried[0].utilisation):
            low = share
        else:
            high = share
        if low >= (1.0 - SETTINGS.share_step) * high:
            break
        share = 0.5 * (low + high)
