"""Find the wrist poses of floating hands: sequential convex programming with a trust region.

A floating hand's wrench is nonlinear in its wrist's twist ξ, so a plan on one linearised set is off
by some per cent. Here the hands' sets are linearised at a point (ξ of every floating hand, the
loads of the others), the conic program is solved on them within a range around the point, and the
outcome is the next point:

    ξ_k → sets at ξ_k → loads → ξ_{k+1} → … until the sets at ξ_k have nothing better than ξ_k.

A set is exact where it is linearised, so balance, limits and hard rows *at the point* are those of
the model itself, and so is the plan. A `Goal` says what is minimised: the utilisation u, or the
effort under a cap on u. A step must lower the merit function

    value + ρ (‖missing body wrench‖₁ + largest violation of a hard row + excess over the cap),

if need be after a second-order correction; else it is tried again in a smaller trust region
(exact penalty function; Fletcher, Practical Methods of Optimization, ch. 14).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Literal

import numpy as np
import scipy

from hand_models.base import Array
from hand_models.wrench_spaces import WRENCH_SCALE, WrenchSpace
from planner import deadline, programs
from planner.deadline import Budget
from planner.floating.goals import LEAST_USE, SETTINGS, Goal
from planner.prepare import ExactMeasure, HandSets, LinearisationPoint, Sets
from planner.programs import Outcome

__all__ = [
    "WristSolution",
    "disagreements",
    "gap",
    "made_exact",
    "repaired",
    "searching",
    "solve_wrists",
]

NOT_SOLVED: Final = Outcome(False, "none", 0, math.nan)
"""Outcome before any program is solved."""


@dataclass(frozen=True, eq=False)
class WristSolution:
    """Result of a search for the wrist poses of floating and compliant hands.

    Attributes
    ----------
    found : {'least', 'unproven', 'nothing'}
        ``least``: the point is a plan (balanced, within hard rows), and the sets linearised there
        contain nothing better. ``unproven``: the point is a plan, but not proven to be the best: it
        lies at a kink (a tendon begins to slip, a contact reaches its tile's edge), or the search
        ran out of rounds. ``nothing``: the point is no plan.
    point : LinearisationPoint
        Wrist poses and loads found.
    sets : Sets
        Sets linearised at the point.
    outcome : Outcome
        Result of the goal's program on these sets; not solved if ``nothing`` was found.
    rounds : int
        Number of linearisations.
    error : float
        Largest difference of a hand's wrench at the point from the sets of the last step: forces,
        and moments over 0.1 m [N].
    measure : ExactMeasure
        Exact utilisation, violations and effort at the point.
    """

    found: Literal["least", "unproven", "nothing"]
    point: LinearisationPoint
    sets: Sets
    outcome: Outcome
    rounds: int
    error: float
    measure: ExactMeasure = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "measure", self.sets.measure(self.point.loads))

    @property
    def exact(self) -> bool:
        """True if the point is a plan."""
        return self.found != "nothing"


def searching(
    hands: HandSets,
    goal: Goal,
    point: LinearisationPoint,
    within: float,
    before: Sets | None = None,
    error: float = 0.0,
) -> WristSolution:
    """Return the state of a search at a point: the sets linearised there, and nothing solved yet.

    Parameters
    ----------
    hands : HandSets
        Hands of the stance, with their sets at any pose of their wrists.
    goal : Goal
        Objective of the search.
    point : LinearisationPoint
        Wrist poses and loads at which the sets are linearised.
    within : float
        Half width of the trust region, in `TWIST_UNIT`.
    before : Sets, optional
        Sets of the previous point, with which the wrenches at the new point are compared.
    error : float, optional
        Linearisation error to report if ``before`` is not given [N].
    """
    sets = hands.sets(point, within, goal.farthest)
    if before is not None:
        error = max(disagreements(hands, before.spaces, sets.spaces, point.loads))
    return WristSolution("nothing", point, sets, NOT_SOLVED, 0, error)


def solve_wrists(
    hands: HandSets,
    start: LinearisationPoint,
    budget: Budget,
    most: int = SETTINGS.rounds,
    goal: Goal = LEAST_USE,
) -> WristSolution:
    """Search for the loads and wrist poses that are best for a goal, within a trust region.

    If the search ends without proof, or its budget is spent, violations at the last point are
    corrected (`made_exact`). At a deadline the latest plan found on the way is returned.

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
        The best plan found, or the point at which the search failed.
    """
    now = searching(hands, goal, start, SETTINGS.first_range)
    passed: WristSolution | None = None
    within, penalty, stalled = SETTINGS.first_range, goal.least_penalty, 0
    weights, root, rounds = NOT_SOLVED, None, 0
    for rounds in range(1, most + 1):
        if budget.ended:
            break
        outcome = goal.solve(now.sets.data)
        budget.spend(2)
        if outcome.solved:
            if goal.exact(now.measure, hands):
                here = replace(now, found="least", outcome=outcome, rounds=rounds)
                if gap(goal, now, outcome) <= SETTINGS.closeness:  # nothing in the sets is better
                    return here
                passed = replace(here, found="unproven")
            penalty = max(penalty, 2.0 * goal.dearest(outcome))
            step, stalled = outcome, 0
            if rounds <= 5:  # later ones stay near the point and mind their curvature
                chosen = goal.first_step(now.sets.data, outcome, now.point.loads)
            else:
                if root is None:
                    duals = weights if weights.solved else outcome
                    root = goal.root(hands, now.point, now.sets, within, duals)
                chosen = weights = goal.later_step(now.sets.data, root, now.point.loads)
            if chosen.solved:
                step = chosen
        else:
            # no balance in this range: come as near as it lets
            step = goal.restore(now.sets.data)
            # rounds that hardly lower what is missing: none of the sets has a balance
            if not step.solved or stalled > 4:
                break
        size = hands.step(now.point, step.loads)
        there = searching(hands, goal, replace(now.point, loads=step.loads), within, now.sets)
        before, after = (goal.merit(state.measure, penalty) for state in (now, there))
        if not outcome.solved:
            stalled += not after < before - 0.02 * abs(before)
        direct = after < before
        if outcome.solved and there.sets.finite and not direct:
            there = repaired(hands, goal, there, within)
            after = goal.merit(there.measure, penalty)
        if hands.near_rest(there.point) and there.sets.finite and after < before:
            if not direct and outcome.solved and goal.promised is not None:
                direct = before - after >= goal.promised * (before - outcome.value)
            if direct and size > 0.8 * within:
                within = min(2.5 * within, 30.0)  # in `TWIST_UNIT`, where a step reaches its end
                there = searching(hands, goal, there.point, within, error=there.error)
            now, root = there, None
        else:
            within = 0.3 * min(within, size)  # where steps do not lower the merit
            if within < 1e-3:  # in `TWIST_UNIT`: only a kink spoils such steps
                break
            now = searching(hands, goal, now.point, within, error=now.error)
    if passed is not None and deadline.expired():
        return replace(passed, rounds=rounds)
    return made_exact(hands, goal, now, rounds, budget)


def repaired(hands: HandSets, goal: Goal, state: WristSolution, within: float) -> WristSolution:
    """Return a point with smaller violations, by the smallest step: a second-order correction.

    The step is the least-squares solution that balances the body and puts violated hard rows on
    their limits; active hard rows stay active. If rows nearly contradict each other, the step would
    be kilometres long, where the model is not valid: then the point is returned unchanged.

    Parameters
    ----------
    hands : HandSets
        Hands of the stance, with their sets at any pose of their wrists.
    goal : Goal
        Objective of the search.
    state : WristSolution
        Point to be corrected.
    within : float
        Half width of the trust region of the returned sets, in `TWIST_UNIT`.
    """
    data, loads = goal.constraints(state.sets.data), state.point.loads
    if not state.sets.finite:
        return state
    z = [y / hand.unit for hand, y in zip(data.hands, loads, strict=True)]
    room = np.concatenate([hand.h - hand.H @ x for hand, x in zip(data.hands, z, strict=True)])
    those = room < 1e-5  # in `LOAD_UNIT`: they just hold
    rows = np.vstack(
        [
            np.hstack([hand.G for hand in data.hands]),
            scipy.linalg.block_diag(*(hand.H for hand in data.hands))[those],
        ]
    )
    missing = data.wrench - programs.body_wrench(data, loads)
    aims = np.concatenate([missing, np.minimum(room[those], 0.0)])
    step = np.linalg.lstsq(rows, aims, rcond=SETTINGS.dependent_rows)[0]
    parts = np.split(step, np.cumsum([len(x) for x in z])[:-1])
    moved = tuple(
        y + hand.unit * part for hand, y, part in zip(data.hands, loads, parts, strict=True)
    )
    point = replace(state.point, loads=moved)
    if not hands.near_rest(point):
        return state
    return searching(hands, goal, point, within, state.sets)


def made_exact(
    hands: HandSets,
    goal: Goal,
    start: WristSolution,
    rounds: int,
    budget: Budget,
    growth: float = SETTINGS.repair_growth,
) -> WristSolution:
    """Remove the violations at a point where a search ended without proof, by repeated corrections.

    Parameters
    ----------
    hands : HandSets
        Hands of the stance, with their sets at any pose of their wrists.
    goal : Goal
        Objective of the search.
    start : WristSolution
        Point at which the search ended.
    rounds : int
        Number of linearisations until then.
    budget : Budget
        Largest number of conic programs.
    growth : float, optional
        How much corrections may add to the value, relative: a thousandth by default.

    Returns
    -------
    WristSolution
        ``unproven`` with the corrected point if it is a plan whose value has not grown by more;
        else ``nothing``, with the point that the search ended at.
    """
    now = start = searching(hands, goal, start.point, SETTINGS.first_range, error=start.error)
    for _ in range(12):
        if deadline.expired():
            break
        if goal.exact(now.measure, hands):
            outcome, value = goal.solve(now.sets.data), goal.value(start.measure)
            budget.spend()
            if outcome.solved and goal.value(now.measure) - value <= growth * max(1.0, value):
                return replace(now, found="unproven", outcome=outcome, rounds=rounds)
            break
        before, now, rounds = now, repaired(hands, goal, now, SETTINGS.first_range), rounds + 1
        lost, left = (goal.wrong(state.measure) for state in (before, now))
        if not now.sets.finite or not left < 0.5 * lost:
            break
    return replace(start, rounds=rounds)


def gap(goal: Goal, state: WristSolution, outcome: Outcome) -> float:
    """Return the relative difference between a point's value and the optimum on its sets.

    Parameters
    ----------
    goal : Goal
        Objective of the search.
    state : WristSolution
        The point, with its exact measure.
    outcome : Outcome
        Solution of the goal's program on the sets linearised at the point.

    Returns
    -------
    float
        (value of the point − optimum) / max(1, value of the point).
    """
    value = goal.value(state.measure)
    return (value - outcome.value) / max(1.0, value)


def disagreements(
    hands: HandSets,
    spaces: Sequence[WrenchSpace],
    there: Sequence[WrenchSpace],
    loads: Sequence[Array],
) -> list[float]:
    """Return the linearisation error of each compliant or floating hand's set at given loads.

    Parameters
    ----------
    hands : HandSets
        Hands of the stance, with their sets at any pose of their wrists.
    spaces : sequence of WrenchSpace
        Sets whose error is wanted.
    there : sequence of WrenchSpace
        Sets linearised at the loads, which are exact there.
    loads : sequence of ndarray, shape (m,)
        Loads y of each hand.

    Returns
    -------
    list of float
        Largest difference of the wrench of each compliant or floating hand: forces, and moments
        over 0.1 m [N].
    """
    return [
        float(np.abs((a.wrench(y) - b.wrench(y)) * WRENCH_SCALE).max())
        for wrist, a, b, y in zip(hands.wrists, spaces, there, loads, strict=True)
        if wrist is not None
    ]
