"""Find tensions and wrist poses of compliant hands by sequential ℓ₁ linear programming.

From rest, the sets linearised at a point usually contain no plan: a wrist moves by millimetres, and
a linearised set is good for one. So the balance and the hard rows are relaxed at a price ρ, and
each round solves `programs.elastic` on the sets of its point, within a trust region. A step must
lower the merit

    u + ρ (‖missing body wrench‖₁ + violations of all hard rows)

of the model itself, u the utilisation (Fletcher, Practical Methods of Optimization, ch. 12 and 14).
If a step lowers it by less than predicted, the sets where it ends give further steps. At the end
the violations at the point are removed; the sets linearised there prove that its utilisation is the
least, or the result is marked unproven.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner import programs
from planner.deadline import Budget
from planner.floating.goals import LEAST_USE, SETTINGS, Goal
from planner.floating.wrist_iteration import (
    WristSolution,
    gap,
    made_exact,
    searching,
    solve_wrists,
)
from planner.prepare import HandSets, LinearisationPoint, Sets
from planner.programs import WRIST_RANGE, Outcome

__all__ = [
    "find_wrists",
    "firm_rows",
    "first_plan",
    "most_programs",
    "other_starts",
    "pressing",
    "without_hindrance",
]


def first_plan(hands: HandSets, factor: float, budget: Budget) -> WristSolution:
    """Search for a plan of least utilisation from one starting point after another.

    The first plan found is returned, unless palms of compliant hands carry load in it: then the
    best of all, because the search is local, and a palm's springs carry nothing before a gap.

    Parameters
    ----------
    hands : HandSets
        Hands of the stance, with their sets at any pose of their wrists.
    factor : float
        Multiple of the body wrench to be balanced.
    budget : Budget
        Largest number of conic programs.

    Returns
    -------
    WristSolution
        A plan; if there is none, the failed search with the smallest missing wrench.
    """
    searches: list[WristSolution] = []
    for start in _starts(hands, factor, budget):
        most = SETTINGS.rounds_nearby if searches else SETTINGS.rounds
        searches.append(find_wrists(hands, start, budget, most))
        plans = [found for found in searches if found.exact]
        if budget.ended or (plans and not _palms_carry(hands, plans[0].point)):
            break
    if plans:
        best = min(plans, key=lambda found: found.measure.utilisation)
        return without_hindrance(hands, best, budget)
    return min(searches, key=lambda found: found.measure.missing)


def most_programs(hands: HandSets) -> int:
    """Return the largest number of programs for a first plan; steps of relaxed programs are many.

    Parameters
    ----------
    hands : HandSets
        Hands of the stance, with their sets at any pose of their wrists.
    """
    return SETTINGS.first_programs if hands.together is None else SETTINGS.first_relaxed


def _palms_carry(hands: HandSets, point: LinearisationPoint) -> bool:
    """Return whether the palm of a compliant hand carries load at a point."""
    return any(
        wrist is not None and wrist.driven and wrist.palm_mode(y) != "off"
        for wrist, y in zip(hands.wrists, point.loads, strict=True)
    )


def pressing(hands: HandSets, factor: float) -> LinearisationPoint:
    """Return the point at which all compliant and floating wrists have brought palms to rock.

    ``factor`` is the multiple of the body wrench that is to be balanced from there on.
    """
    point = hands.at_rest()
    loads = [
        y if wrist is None else wrist.pressing
        for wrist, y in zip(hands.wrists, point.loads, strict=True)
    ]
    return replace(point, loads=tuple(loads), factor=factor)


def _starts(hands: HandSets, factor: float, budget: Budget) -> Iterator[LinearisationPoint]:
    """Yield points at which a search may begin, the most promising first."""
    rest = replace(hands.at_rest(), factor=factor)
    if hands.springy:
        # palms on their springs draw the search to where fingers hold little; half of the programs
        # are for the hands as they are
        part = budget.part(most_programs(hands) // 2)
        yield find_wrists(hands.without_palms(), rest, part, SETTINGS.rounds_nearby).point
    yield rest
    if hands.springy and hands.together is None:
        yield pressing(hands, factor)
    if hands.together is not None:
        yield _closed_harder(hands, rest)


def other_starts(hands: HandSets) -> tuple[LinearisationPoint, ...]:
    """Return starts for compliant hands of which the first plan is beyond limits, or none.

    The search is local, and on rough rock it may end where fingers that are about to be dragged
    backwards keep their wrists back: from the hands at rest, and from hands that are closed harder,
    it ends elsewhere. Empty if no hand is compliant.

    Parameters
    ----------
    hands : HandSets
        Hands of the stance, with their sets at any pose of their wrists.
    """
    if hands.together is None:
        return ()
    rest = hands.at_rest()
    return _closed_harder(hands, rest), rest


def _closed_harder(hands: HandSets, rest: LinearisationPoint) -> LinearisationPoint:
    """Return a point at which tiles of driven hands are farther from being dragged backwards."""
    loads = [
        y if wrist is None or not wrist.driven else np.where(np.arange(len(y)) < 4, 80.0, y)
        for wrist, y in zip(hands.wrists, rest.loads, strict=True)
    ]
    return replace(rest, loads=tuple(loads))


def find_wrists(
    hands: HandSets,
    start: LinearisationPoint,
    budget: Budget,
    most: int = SETTINGS.rounds,
    goal: Goal = LEAST_USE,
) -> WristSolution:
    """Search for the loads and wrist poses that are best for a goal.

    Where a hand is compliant and the goal is the least utilisation, the search is that of this
    module, with relaxed programs; otherwise it is `solve_wrists`.

    Parameters
    ----------
    hands : HandSets
        Hands of the stance, with their sets at any pose of their wrists.
    start : LinearisationPoint
        Point at which the search begins.
    budget : Budget
        Largest number of conic programs.
    most : int, optional
        Largest number of rounds (linearisations).
    goal : Goal, optional
        Objective; the least utilisation by default.

    Returns
    -------
    WristSolution
        The best plan found, or the failed search.
    """
    if hands.together is None or goal is not LEAST_USE:
        return solve_wrists(hands, start, budget, most, goal)
    return _relaxed(hands, start, budget, most)


def without_hindrance(hands: HandSets, found: WristSolution, budget: Budget) -> WristSolution:
    """Look for a better plan than one in which palms of compliant hands keep their wrists back.

    A search without palms begins at the plan found. If it ends at a lower utilisation, a search
    with palms begins there. Returns the given plan if neither helps.

    Parameters
    ----------
    hands : HandSets
        Hands of the stance, with their sets at any pose of their wrists.
    found : WristSolution
        Result of a search, with or without a plan.
    budget : Budget
        Largest number of conic programs.
    """
    if not (found.exact and _palms_carry(hands, found.point)) or budget.ended:
        return found
    used, most = found.measure.utilisation, SETTINGS.rounds
    bare = _relaxed(hands.without_palms(), found.point, budget, most)
    if not bare.exact or bare.measure.utilisation >= used:
        return found
    again = _relaxed(hands, bare.point, budget, most)
    return again if again.exact and again.measure.utilisation < used else found


def _relaxed(
    hands: HandSets, start: LinearisationPoint, budget: Budget, most: int
) -> WristSolution:
    """Search for the least utilisation by relaxed programs, at rising prices."""
    point, goal, prices = start, LEAST_USE, _prices(hands)
    for price in prices:
        now, rounds = _descended(hands, goal, point, price, budget, most)
        # after the last, a plan that uses more is better than none
        growth = math.inf if price is prices[-1] else SETTINGS.repair_growth
        found, point = made_exact(hands, goal, now, rounds, budget, growth), now.point
        if found.exact or budget.ended or not now.sets.finite:
            break
        if _violation(now) > SETTINGS.far_off:
            if not _too_cheap(hands, now, budget):
                break  # no equilibrium near
            point = start  # not from where too low a price has led
    proven = found.exact and gap(goal, found, found.outcome) <= SETTINGS.closeness
    return replace(found, found="least") if proven else found


def _descended(
    hands: HandSets,
    goal: Goal,
    start: LinearisationPoint,
    price: _Price,
    budget: Budget,
    most: int,
) -> tuple[WristSolution, int]:
    """Lower the merit at a price from a start.

    Returns where that ends, and the rounds it took.
    """
    within = SETTINGS.relaxed_range
    now = searching(hands, goal, start, within)
    merit, rounds, past = _merit(now, price), 0, [math.inf] * 6
    for _ in range(most):
        # six steps for a thousandth: it creeps along a kink
        if budget.ended or past[-6] - merit < 1e-3 * merit:
            break
        past.append(merit)
        outcome = _relaxed_step(now, price, budget)
        if not outcome.solved:
            break
        promised = merit - outcome.value
        if promised < 1e-4 * price.scale:  # nothing better about the point
            return now, rounds + 1
        there, after, steps = _followed(hands, goal, now, outcome, price, within, budget)
        gained, resized, rounds = (merit - after) / promised, within, rounds + steps
        if after < merit - 1e-9:
            now, merit = there, after
            resized = min(2.0 * within, 4.0) if gained > 0.7 else within
            resized = 0.5 * within if gained < 0.25 else resized
        else:
            resized = 0.4 * within
        if resized < 1e-3:  # only a kink spoils steps of a micrometre and 0.1 N
            break
        if resized != within:
            within = resized
            now = searching(hands, goal, now.point, within, error=now.error)
    return now, rounds


def _followed(
    hands: HandSets,
    goal: Goal,
    start: WristSolution,
    outcome: Outcome,
    price: _Price,
    within: float,
    budget: Budget,
) -> tuple[WristSolution, float, int]:
    """Follow a step, and if it does not keep half of its promise, those of the sets where it ends.

    A step along curved limits raises the merit, however good its direction; the program about its
    end corrects that, with the limits that bind there (watchdog: Chamberlain, Powell, Lemarechal
    and Pedersen, Mathematical Programming Study 16, 1982).

    Returns the best point met, its merit, and the number of steps.
    """
    merit, now, best, least, steps = _merit(start, price), start, start, math.inf, 0
    promised = merit - outcome.value
    for steps in range(1, SETTINGS.followed + 1):
        point = replace(now.point, loads=outcome.loads)
        now = searching(hands, goal, point, within, now.sets)
        if not now.sets.finite:
            break
        after = _merit(now, price)
        if after < least:
            best, least = now, after
        if merit - least >= 0.5 * promised or steps == SETTINGS.followed:
            break
        outcome = _relaxed_step(now, price, budget)
        if not outcome.solved or outcome.value > min(merit, least) - 0.1 * promised:
            break
    return best, least, steps


def _relaxed_step(state: WristSolution, price: _Price, budget: Budget) -> Outcome:
    """Solve the relaxed program about a point of the search."""
    sets, loads = state.sets, state.point.loads
    budget.spend()
    near = SETTINGS.nearness * price.scale
    return programs.elastic(sets.data, price.violation, loads, firm_rows(sets), near)


def _merit(state: WristSolution, price: _Price) -> float:
    """Return the utilisation, and what is wrong at its price; infinite where rock is lost."""
    if not state.sets.finite:
        return math.inf
    return state.measure.utilisation + price.violation * _violation(state)


def _violation(state: WristSolution) -> float:
    """Return the missing body wrench plus the violations of all hard rows, in their units."""
    return state.measure.missing + state.measure.excess


class _Price(NamedTuple):
    """Price of violations, and the utilisation that a search counts as one unit.

    Where limits are weak, any load uses more of them: with both in proportion to what hands use at
    rest, the search takes the same steps.
    """

    violation: float
    scale: float


def _prices(hands: HandSets) -> list[_Price]:
    """Return the rising prices of violations, all well above what hands use at rest."""
    at_rest = float(programs.used(hands.data, hands.at_rest().loads).max())
    scale = max(1.0, SETTINGS.beyond_rest * at_rest / SETTINGS.price)
    return [_Price(scale * SETTINGS.price * rise, scale) for rise in SETTINGS.rises]


def _too_cheap(hands: HandSets, state: WristSolution, budget: Budget) -> bool:
    """Return whether sets about the end of a search promise less violation at a higher price.

    Then the price was too low; otherwise the search ended for want of a balance.
    """
    near = searching(hands, LEAST_USE, state.point, SETTINGS.relaxed_range)
    outcome = _relaxed_step(near, _prices(hands)[-1], budget)
    if not outcome.solved:
        return False
    there = near.sets.measure(outcome.loads)
    return there.missing + there.excess < (1.0 - SETTINGS.promise) * _violation(state)


def firm_rows(sets: Sets) -> NDArray[np.bool_]:
    """Return a mask of the hard rows that bound the trust region, shape (Σ nh,), bool.

    `programs.elastic` must keep these rows; it may exceed the hands' nh other hard rows.

    Parameters
    ----------
    sets : Sets
        Sets linearised within a trust region.
    """
    return np.array(
        [row.limit == WRIST_RANGE for space in sets.spaces for row in space.rows[len(space.s) :]]
    )
