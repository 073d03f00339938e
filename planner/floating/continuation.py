"""Least utilisation and load factor of floating hands, by continuation along the body wrench.

The utilisation of floating hands is not convex in the body wrench: a search from rest may end at a
poor plan, or at none. Then smaller multiples of the body wrench are planned first, and each plan is
the start of the next search, up to the largest multiple that can be held, and on to the whole
(Allgower and Georg, Introduction to Numerical Continuation Methods, ch. 2).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planner import deadline
from planner.deadline import Budget
from planner.floating.elastic_search import (
    find_wrists,
    first_plan,
    most_programs,
    other_starts,
    pressing,
)
from planner.floating.goals import SETTINGS
from planner.floating.wrist_iteration import WristSolution
from planner.prepare import TOLERANCES, HandSets
from planner.programs import CAP_SLACK

__all__ = ["LargestFactor", "least_use", "most_load"]


class LargestFactor(NamedTuple):
    """Largest multiple of the body wrench for which a plan was found.

    Attributes
    ----------
    factor : float
        The multiple.
    sure : bool
        True if utilisation 1 is reached there. False if a search beyond it found no plan: then the
        multiple is a lower bound.
    """

    factor: float
    sure: bool


class _Way(NamedTuple):
    """A search along the factor: its largest, the plan there, and one for the whole wrench."""

    most: LargestFactor
    at: WristSolution
    whole: WristSolution | None


def least_use(
    hands: HandSets, budget: Budget, near: WristSolution | None = None
) -> tuple[WristSolution, LargestFactor | None]:
    """Search for the plan of least utilisation, over wrist poses.

    If the utilisation exceeds 1, or no plan is found, the search continues from smaller multiples
    of the body wrench up to the largest that can be held, and on to the whole.

    Parameters
    ----------
    hands : HandSets
        Hands of the stance, with their sets at any pose of their wrists.
    budget : Budget
        Largest number of conic programs.
    near : WristSolution, optional
        Plan of similar hands, from which the search starts. If that leads to a plan beyond
        utilisation 1, the search continues from that plan to the largest multiple that can be held;
        where it finds none, it starts anew, as without a plan.

    Returns
    -------
    WristSolution
        The best plan found; if there is none, the search that ended with the least missing wrench.
    LargestFactor or None
        Largest multiple of the body wrench found on the way; None if none was sought, as for a plan
        within its limits.
    """
    first = most_programs(hands)
    plan = None if near is None else find_wrists(hands, near.point, budget.part(first))
    if plan is None or not plan.exact:
        near, plan = None, first_plan(hands, 1.0, budget.part(first))
    if not _held(plan) and hands.springy and hands.together is None and near is None:
        # palms carry nothing at rest: a search from there may not find what they can do, and
        # driven hands with their bounded travel hardly reach it
        there = find_wrists(hands, pressing(hands, 1.0), budget.part(first), SETTINGS.rounds_nearby)
        plan = _better(plan, there)
    for start in other_starts(hands) if near is None else ():
        if _held(plan) or deadline.expired():
            break
        there = find_wrists(hands, start, budget.part(first))
        if not (plan.exact and _as_good(plan, there)):  # of two as good, the first may be proven
            plan = _better(plan, there)
    if deadline.expired():
        return plan, None
    most: LargestFactor | None = None
    if not _held(plan) and np.abs(hands.wrench[:6]).max() > TOLERANCES.body_wrench:
        along = budget.part(SETTINGS.along_programs)
        for way in _ways(hands, plan, along, up=near is None and hands.together is None):
            if most is None or way.most.factor > most.factor:
                most = way.most
            onward = way.whole or _carried_on(hands, way.at, along)
            same = onward is not None and way.most.sure and _as_good(onward, plan)
            plan = _better(plan, onward)
            if same or _held(plan):
                break
        if most is None and not deadline.expired():
            # the way down from a plan may end at its first step
            if near is not None:
                anew, most = least_use(hands, budget)
                plan = _better(plan, anew)
            elif plan.exact and hands.together is not None:
                up = next(_ways(hands, plan, budget.part(SETTINGS.along_programs)), None)
                most = None if up is None else up.most
    if _held(plan) and most is not None and most.factor < 1.0:
        most = None
    return plan, most


def most_load(
    hands: HandSets, plan: WristSolution, known: LargestFactor | None, budget: Budget
) -> tuple[LargestFactor | None, WristSolution]:
    """Return the largest multiple of the body wrench that has a plan of utilisation 1.

    On its way the search may come to wrist poses that carry more. Then another search for the whole
    body wrench begins there.

    Parameters
    ----------
    hands : HandSets
        Hands of the stance, with their sets at any pose of their wrists.
    plan : WristSolution
        Result of `least_use` for the whole body wrench.
    known : LargestFactor or None
        Multiple that `least_use` found.
    budget : Budget
        Largest number of conic programs.

    Returns
    -------
    most : LargestFactor or None
        None if no multiple was found.
    plan : WristSolution
        The given plan, or a better one for the whole body wrench.
    """
    if (known is not None and known.sure) or not _held(plan):
        return known, plan
    way = _way(hands, plan, budget)
    if way is None:
        return known, plan
    plan = _carried_back(hands, plan, way.at, budget)
    return (known if known is not None and known.factor > way.most.factor else way.most), plan


def _carried_back(
    hands: HandSets, plan: WristSolution, at: WristSolution, budget: Budget
) -> WristSolution:
    """Return a plan of the whole body wrench that uses less, if that for a multiple promises one.

    It does where it uses less than the plan's own slope allows: the least utilisation of wrists
    near the plan rises at least by that slope.
    """
    least = plan.measure.utilisation + _slope(hands, plan) * (at.point.factor - 1.0)
    if at.measure.utilisation > least - SETTINGS.better_branch:
        return plan
    start = replace(at.point, factor=1.0)
    return _better(plan, find_wrists(hands, start, budget, SETTINGS.rounds_nearby))


def _slope(hands: HandSets, plan: WristSolution) -> float:
    """Return the change of a plan's utilisation with the factor of the body wrench."""
    assert plan.outcome.balance_dual is not None
    return -float(plan.outcome.balance_dual[:6] @ hands.wrench[:6])


def _held(found: WristSolution) -> bool:
    """Return whether a solution is a plan within its limits."""
    return found.exact and found.measure.utilisation <= 1.0 + CAP_SLACK


def _better(plan: WristSolution, other: WristSolution | None) -> WristSolution:
    """Return the one that uses less; a plan rather than none."""
    if other is None or not other.exact:
        return plan
    if not plan.exact or other.measure.utilisation < plan.measure.utilisation:
        return other
    return plan


def _as_good(found: WristSolution, plan: WristSolution) -> bool:
    """Return whether a plan uses no more than another, to the accuracy of such searches."""
    return not plan.exact or found.measure.utilisation <= plan.measure.utilisation * (1.0 + 1e-3)


def _ways(
    hands: HandSets, plan: WristSolution, budget: Budget, *, up: bool = True
) -> Iterator[_Way]:
    """Yield searches along the factor: up from a small one, if so, and down from a plan."""
    for fraction in SETTINGS.small_factors if up else ():
        if deadline.expired():
            return
        part = budget.part(most_programs(hands))
        start = first_plan(hands, fraction, part)
        if start.exact:
            way = _way(hands, start, budget)
            if way is not None:
                yield way
            break
    if plan.exact:
        way = _way(hands, plan, budget)
        if way is not None:
            yield way


def _way(hands: HandSets, start: WristSolution, budget: Budget) -> _Way | None:
    """Search for the largest factor from a plan for some factor; None if none is held.

    By Newton's method on the least utilisation as a function of the factor, whose slope the
    multipliers of the balance give. Where hard rows end it first, or at kinks, it is bracketed
    and the lower end returned. On its way up it passes the whole body wrench.
    """
    now, best, whole = start, None, None
    high, sure, overloaded, anew = math.inf, False, False, False
    least = 0.02  # of the factors that are tried
    for _ in range(10):  # factors of the body wrench
        used, factor = now.measure.utilisation, now.point.factor
        if factor == 1.0 and (whole is None or used < whole.measure.utilisation):
            whole = now
        low = 0.0 if best is None else best.point.factor
        if used <= 1.0 + CAP_SLACK:
            if factor >= low:
                best, low = now, factor
        elif factor < high:
            high, overloaded = factor, True
        if budget.ended:
            break
        # a search for compliant wrists ends within some thousandths of the least
        near = CAP_SLACK if hands.together is None else 5e-4
        if 1.0 - near <= used <= 1.0 + CAP_SLACK:
            sure = True
            break
        # bracketed to 0.2 %, where Newton's method does not end
        if high < math.inf and high - low <= 2e-3 * high:
            jumps = best is not None and best.measure.utilisation < 0.98  # over 0.2 % of the load
            sure = overloaded and not jumps
            if best is None or not jumps or anew:
                break
            # the search ended at a poor plan at the upper end: from the lower end it may not
            anew, upper = True, replace(best.point, factor=high)
            now = find_wrists(hands, upper, budget, SETTINGS.rounds_nearby)
            if not now.exact or now.measure.utilisation > 1.0 + CAP_SLACK:
                break
            high, overloaded = math.inf, False
            continue
        slope = _slope(hands, now)
        aim = math.inf if used < 1.0 else 0.0
        if slope > 1e-3:  # it gets harder with the load
            # from beyond 1 a search may end a little beyond it again
            wanted = 1.0 if used < 1.0 else 1.0 - 0.5 * near
            aim = factor + (wanted - used) / slope
        if aim < least and factor <= SETTINGS.small_factors[0]:
            # what overloads the hands is not the body wrench
            break
        aim = min(max(aim, 0.3 * factor), 2.0 * factor)
        if not low < aim < high:
            aim = 0.5 * (low + high) if high < math.inf else 2.0 * low
        if low < 1.0 < min(aim, high):
            aim = 1.0
        if aim < least:
            break
        there = find_wrists(hands, replace(now.point, factor=aim), budget, SETTINGS.rounds_nearby)
        if there.exact:
            now = there
        elif aim > factor or best is not None:
            high, overloaded, now = aim, False, best or now
        else:
            break
    if best is None:
        return None
    return _Way(LargestFactor(best.point.factor, sure), best, whole)


def _carried_on(hands: HandSets, at: WristSolution, budget: Budget) -> WristSolution | None:
    """Return a plan for the whole body wrench that follows from one for a part of it."""
    now, aim = at, 1.0
    for _ in range(8):  # halvings of what is left
        if budget.ended:
            break
        there = find_wrists(hands, replace(now.point, factor=aim), budget, SETTINGS.rounds_nearby)
        if there.exact and aim == 1.0:
            return there
        now, aim = (there, 1.0) if there.exact else (now, 0.5 * (now.point.factor + aim))
    return None
