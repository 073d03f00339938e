"""Safety of the straight path from the present tendon tensions to the planned ones.

Along the path, each tendon with a present tension changes linearly from that to the planned
tension. Palms, lateral reactions and tendons without a present tension take any loads that balance
the body. A point of the path is safe if some such loads keep all hard rows, and the limits at the
utilisation cap. Safe points are convex: if the plan is safe they are an interval that ends at the
plan, and its length is one linear program,

    max s   with tensions  planned + s (present − planned)   in the balance    (`program.Reach`),

whose multipliers show which limits end the interval.

Hands with floating wrists keep their planned loads, as their sets are linearised there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import accumulate

import numpy as np

from hand_models.base import Array
from hand_models.hand import FINGERS
from hand_models.wrench_spaces import WrenchSpace
from planner import programs
from planner.explanation.active_limits import TOLERANCES, LimitUse, close_to, limit_name
from planner.explanation.infeasibility import ranked, summed
from planner.explanation.sentences import blocking_sentence
from planner.prepare import PreparedStance, Sets
from planner.programs import CAP_SLACK, LOAD_UNIT, Outcome, StanceData
from planner.result import LimitName, TensionPath

__all__ = ["tension_path", "unsafe_sentence"]


def tension_path(
    prepared: PreparedStance,
    sets: Sets,
    loads: Sequence[Array],
    idle: Sequence[LimitUse] = (),
) -> TensionPath | None:
    """Return how much of the path from the present tensions to a plan is safe.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.
    sets : Sets
        Wrench spaces of the hands, and their scaled rows; linearised about the plan.
    loads : sequence of ndarray
        Planned loads y of each hand [N]; of a floating hand the wrist's twist [m, rad].
    idle : sequence of LimitUse, optional
        Use of joint torque by limbs without a hand.

    Returns
    -------
    TensionPath or None
        None if the solver's answer fails the check.
    """
    (spaces, data), limbs, question = sets, prepared.limbs, prepared.question
    cap, present = question.limits.utilisation, question.present
    z = [y / hand.unit for hand, y in zip(data.hands, loads, strict=True)]
    rows = [hand.L @ part + hand.l0 for hand, part in zip(data.hands, z, strict=True)]
    used = [float(row.max(initial=0.0)) for row in rows]
    fixed = [i for i, space in enumerate(spaces) if f"{FINGERS[0]}/tension" in space.columns]
    changes = {
        i: present[limbs[i]] / LOAD_UNIT - z[i][_columns(spaces[i])]
        for i in fixed
        if limbs[i] in present
    }
    start, way = _pinned(data, spaces, z, fixed, changes)
    still = max(
        [
            0.0,
            *(each.utilisation for each in idle),
            *(used[i] for i in range(len(z)) if i not in fixed),
        ]
    )
    size = float(np.abs(way).max(initial=0.0))
    change = LOAD_UNIT * size
    here = max(still, *used)
    at_present = (
        here
        if change <= TOLERANCES.tension_change
        else _least(start.turned(start.wrench + way), still)
    )
    if here > cap + CAP_SLACK:
        close = close_to(here)
        names = [
            limit_name(limb, space.rows[i])
            for limb, space, mine in zip(limbs, spaces, rows, strict=True)
            for i in np.flatnonzero(mine >= close).tolist()
        ]
        names += [each.name for each in idle if each.utilisation >= close]
        return TensionPath(False, 0.0, at_present, change, list(dict.fromkeys(names)))
    if change <= TOLERANCES.tension_change:
        return TensionPath(True, 1.0, at_present, change)
    # rounding must not leave the plan itself outside
    most = max(cap, *used)
    reached = programs.reach(start, np.ones(1), (way / size)[:, None], cap=most + 0.5 * CAP_SLACK)
    if not reached.outcome.solved:
        return None
    part = float(reached.t[0]) / size
    if not programs.loads_are_feasible(
        start.turned(start.wrench + part * way), reached.outcome.loads, most + CAP_SLACK
    ):
        return None
    part = min(max(part, 0.0), 1.0)
    if part >= 1.0 - CAP_SLACK:
        return TensionPath(True, part, at_present, change)
    ends = _ends([limbs[i] for i in fixed], [spaces[i] for i in fixed], reached.outcome)
    return TensionPath(False, part, at_present, change, ends)


def unsafe_sentence(path: TensionPath) -> str:
    """Return a sentence: the safe share of an unsafe path, in full per cent, and what limits it."""
    part = math.floor(100.0 * path.safe_part)
    much = f"only the last {part} %" if part > 0 else "no part"
    sentence = f"{much} of the straight way from the present tensions is safe"
    return f"{sentence}: {blocking_sentence(path.limiting)}" if path.limiting else sentence


def _ends(limbs: Sequence[str], spaces: Sequence[WrenchSpace], outcome: Outcome) -> list[LimitName]:
    """Return the limits and hard rows that end the safe part, those that weigh most first."""
    names = [
        limit_name(limb, row)
        for limb, space in zip(limbs, spaces, strict=True)
        for row in space.rows
    ]
    duals = zip(outcome.limit_duals, outcome.hard_duals, strict=True)
    weights = summed(names, np.concatenate([part for pair in duals for part in pair]).tolist())
    # multipliers below a thousandth of the largest end nothing
    least = 1e-3 * max(weights.values(), default=0.0)
    return [name for name in ranked(weights) if weights[name] > least]


def _columns(space: WrenchSpace) -> list[int]:
    return [space.columns.index(f"{finger}/tension") for finger in FINGERS]


def _pinned(
    data: StanceData,
    spaces: Sequence[WrenchSpace],
    z: Sequence[Array],
    fixed: Sequence[int],
    changes: Mapping[int, Array],
) -> tuple[StanceData, Array]:
    """Return the fixed hands, tensions further rows of their balance, at the plan; and the way.

    Parameters
    ----------
    data, spaces
        Of all hands.
    z : sequence of ndarray
        The plan's loads, scaled.
    fixed : sequence of int
        Hands whose wrists are.
    changes : mapping of int to ndarray, shape (4,)
        From planned tensions to present ones, scaled, by hand.
    """
    goal = np.array(sum(data.hands[i].G @ z[i] + data.hands[i].g for i in fixed))
    sizes = [len(z[i]) for i in fixed]
    first = dict(zip(fixed, accumulate(sizes, initial=0), strict=False))
    places = [first[i] + column for i in changes for column in _columns(spaces[i])]
    picked = np.split(np.eye(sum(sizes))[places], np.cumsum(sizes[:-1]), axis=1)
    hands = [
        data.hands[i]._replace(
            G=np.vstack([data.hands[i].G, mine]),
            g=np.concatenate([data.hands[i].g, np.zeros(len(places))]),
            h=data.hands[i].h + TOLERANCES.tension_change / LOAD_UNIT,
        )
        for i, mine in zip(fixed, picked, strict=True)
    ]
    planned = np.concatenate([z[i] for i in fixed])[places]
    way = np.concatenate([np.zeros(len(goal)), *changes.values()])
    return StanceData.of(tuple(hands), np.concatenate([goal, planned])), way


def _least(data: StanceData, still: float) -> float | None:
    """Return the least utilisation; ``still`` is what hands use that are left out."""
    outcome = programs.margin(data)
    if not (
        outcome.solved
        and programs.loads_are_feasible(data, outcome.loads, outcome.value + CAP_SLACK)
    ):
        return None
    return max(outcome.value, still)
