"""Choose the palm modes of floating hands: whether a palm drags along the rock and presses on it.

A palm drags the rock if it moves toward −x, and presses if it moves into the rock. Each of a hand's
palm modes has a set of its own; the sets meet where the palm just does not move. A good combination
of modes is sought at rest, hand by hand. If in the plan only its mode holds a palm back, the plan
is searched for again with that palm's mode switched.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache, partial

import numpy as np

from hand_models.compliance import PALM_MODES, PalmMode
from hand_models.fixed_wrist import PALM_PRESSING, PALM_SHEAR
from planner import deadline, programs
from planner.deadline import Budget
from planner.floating.elastic_search import find_wrists
from planner.floating.goals import LEAST_USE, SETTINGS, Goal
from planner.floating.wrist_iteration import WristSolution
from planner.prepare import HandSets, LinearisationPoint
from planner.programs import CAP_SLACK

__all__ = ["exchanged", "first_plan", "starts"]

Palms = tuple[PalmMode | None, ...]


def first_plan(
    hands: HandSets, factor: float, choices: Iterator[Palms], budget: Budget
) -> WristSolution:
    """Return the first plan found over combinations of palm modes, or the nearest failure.

    Parameters
    ----------
    hands : HandSets
    factor : float
        Multiple of the body wrench to be balanced.
    choices : iterator of tuple of PalmMode or None
        Palm modes of all hands to try, in order.
    budget : Budget
        Largest number of conic programs.

    Returns
    -------
    WristSolution
        A plan; if there is none, the failed search with the smallest missing wrench.
    """
    failed: list[WristSolution] = []
    for palms in choices:
        most = SETTINGS.rounds_nearby if failed else SETTINGS.rounds
        start = replace(hands.at_rest(palms), factor=factor)
        for begin in _beginnings(hands, start, budget):
            found = find_wrists(hands, begin, budget, most)
            if found.exact:
                return found
            failed.append(found)
            if budget.ended:
                break
        if budget.ended:
            break
    if not failed:
        return find_wrists(hands, replace(hands.at_rest(hands.idle), factor=factor), budget)
    return min(failed, key=lambda found: found.measure.missing)


def _beginnings(
    hands: HandSets, start: LinearisationPoint, budget: Budget
) -> Iterator[LinearisationPoint]:
    """Yield points at which a search may begin, the most promising first."""
    if hands.springy:
        # palms on their springs draw the search to where fingers hold little
        yield find_wrists(hands.without_palms(), start, budget, SETTINGS.rounds_nearby).point
    yield start
    if hands.together is not None:
        # closed harder, tiles are farther from being dragged backwards
        loads = [
            y if wrist is None or not wrist.driven else np.where(np.arange(len(y)) < 4, 80.0, y)
            for wrist, y in zip(hands.wrists, start.loads, strict=True)
        ]
        yield replace(start, loads=tuple(loads))


def starts(hands: HandSets, factor: float, budget: Budget) -> Iterator[Palms]:
    """Yield up to five combinations of palm modes, ranked by least utilisation at rest.

    Parameters
    ----------
    hands : HandSets
    factor : float
        Multiple of the body wrench to be balanced.
    budget : Budget
        Largest number of conic programs.
    """
    choices = [None if wrist is None else wrist.palm_modes() for wrist in hands.wrists]
    engaged = [i for i, modes in enumerate(choices) if modes is not None and len(modes) > 1]
    common: list[Palms] = [
        tuple(None if modes is None else (mode if mode in modes else "off") for modes in choices)
        for mode in PALM_MODES.values()
    ]
    common = list(dict.fromkeys(common))
    rank = cache(partial(_rank, hands, factor, budget))
    best = min(common, key=rank)
    for i in engaged:
        best = min([best, *(_with(best, i, mode) for mode in PALM_MODES.values())], key=rank)
    # more choices than these are not tried
    yield from sorted(dict.fromkeys([best, *common]), key=rank)[:5]


def _rank(hands: HandSets, factor: float, budget: Budget, palms: Palms) -> float:
    """Return the least utilisation with the sets at rest; more where they have no balance."""
    if deadline.expired():
        return float("inf")
    data = hands.sets(replace(hands.at_rest(palms), factor=factor)).data
    outcome = programs.margin(data)
    budget.spend()
    if outcome.solved:
        return outcome.value
    budget.spend()
    nearest = programs.nearest(data)
    return 1e6 * (1.0 + nearest.value) if nearest.solved else float("inf")  # beside what is missing


def _with(palms: Palms, i: int, mode: PalmMode) -> Palms:
    return (*palms[:i], mode, *palms[i + 1 :])


def exchanged(
    hands: HandSets, found: WristSolution, budget: Budget, goal: Goal = LEAST_USE
) -> WristSolution:
    """Improve a plan by switching palm modes that hold a palm back (positive dual value).

    Parameters
    ----------
    hands : HandSets
    found : WristSolution
        Plan to be improved.
    budget : Budget
        Largest number of conic programs.
    goal : Goal, optional
        Objective; the least utilisation by default.

    Returns
    -------
    WristSolution
        A plan with a smaller value of the goal, or ``found``.
    """
    tried: set[Palms] = {found.point.palms}
    for _ in range(6):
        new = next((p for p in _turned(found) if p not in tried), None)
        if new is None or budget.ended:
            break
        tried.add(new)
        turned = replace(found.point, palms=new)
        there = find_wrists(hands, turned, budget, SETTINGS.rounds_nearby, goal)
        value = goal.value(found.measure)
        lower = value - CAP_SLACK * max(1.0, value)
        if there.exact and goal.value(there.measure) < lower:
            found = there
    return found


def _turned(found: WristSolution) -> Iterator[Palms]:
    """Yield choices in which one palm that its mode holds back goes the other way."""
    palms = found.point.palms
    holding = 1e-6  # multiplier of the goal, per `LOAD_UNIT`
    for i, (space, mode) in enumerate(zip(found.sets.spaces, palms, strict=True)):
        if mode is None:
            continue
        drags, presses = next(key for key, value in PALM_MODES.items() if value == mode)
        rows = space.rows[len(space.s) :]
        for row, multiplier in zip(rows, found.outcome.hard_duals[i], strict=True):
            if multiplier > holding and row.limit == f"{PALM_SHEAR}_reversed":
                yield _with(palms, i, PALM_MODES[not drags, presses])
            elif multiplier > holding and row.limit == f"{PALM_PRESSING}_reversed":
                yield _with(palms, i, PALM_MODES[drags, not presses])
