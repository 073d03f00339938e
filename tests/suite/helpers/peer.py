"""The planner's questions put to another solver: linear programs in SI units for scipy's HiGHS.

Only each hand's set (o, V, L, l0, s, H, h) comes from the code; the programs are assembled here,
with y of every hand and, as the last unknown, the utilisation u or the load factor.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import OptimizeResult, linprog

from hand_models.wrench_spaces import WrenchSpace
from planner.prepare import hand_space
from planner.question import Question

INFEASIBLE = 2
"""HiGHS's status in scipy."""

HUGE = 1e6
"""Far beyond any load that a tile, a tendon or a palm could carry [N]."""

TOLERANCES = {"primal_feasibility_tolerance": 1e-9, "dual_feasibility_tolerance": 1e-9}

DECIDED = 0, 2
"""Statuses: an optimum, or none as nothing is feasible."""


class Rows(NamedTuple):
    """``L y + l0 ≤ u s``, ``H y ≤ h`` and ``B y + b`` the body wrench, for all hands together."""

    L: np.ndarray
    l0: np.ndarray
    s: np.ndarray
    H: np.ndarray
    h: np.ndarray
    B: np.ndarray
    b: np.ndarray


def spaces(question: Question) -> list[WrenchSpace]:
    """Each hand's set, with the question's cap on the tendons."""
    cap = question.limits.tendon_tension or np.inf
    found = []
    for hand in question.stance.hands:
        _, space = hand_space(question.stance, hand.limb)
        tendon = np.array([row.limit == "tendon_tension" for row in space.rows[: len(space.s)]])
        found.append(replace(space, s=np.where(tendon, np.minimum(space.s, cap), space.s)))
    return found


def reaction(question: Question, index: int, wrench: np.ndarray) -> np.ndarray:
    """What a hand's wrenches on the rock (6, ...) give the body: minus each, carried to B."""
    body = question.stance.body
    pose = question.stance.hands[index].pose
    force = -body.rotation.T @ pose.rotation @ wrench[:3]
    moment = -body.rotation.T @ pose.rotation @ wrench[3:]
    lever = body.rotation.T @ (pose.position - body.position)
    return np.concatenate([force, moment + np.cross(lever, force, axisb=0, axisc=0)])


def rows(question: Question, sets: list[WrenchSpace] | None = None) -> Rows:
    sets = spaces(question) if sets is None else sets
    columns = np.cumsum([0, *(len(each.columns) for each in sets)])

    def spread(blocks: list[np.ndarray]) -> np.ndarray:
        whole = np.zeros((sum(len(block) for block in blocks), columns[-1]))
        start = 0
        for i, block in enumerate(blocks):
            whole[start : start + len(block), columns[i] : columns[i + 1]] = block
            start += len(block)
        return whole

    return Rows(
        L=spread([each.L for each in sets]),
        l0=np.concatenate([each.l0 for each in sets]),
        s=np.concatenate([each.s for each in sets]),
        H=spread([each.H for each in sets]),
        h=np.concatenate([each.h for each in sets]),
        B=np.hstack([reaction(question, i, each.generators) for i, each in enumerate(sets)]),
        b=sum(reaction(question, i, each.origin) for i, each in enumerate(sets)),
    )


def solve(cost, A, b, E=None, e=None, bounds=(None, None)) -> OptimizeResult:
    """min cost · x with A x ≤ b and E x = e."""
    # the presolve of an older HiGHS leaves some of these undecided, its simplex method others
    for method, presolve in (("highs", True), ("highs", False), ("highs-ipm", True)):
        found = linprog(
            cost,
            A_ub=A,
            b_ub=b,
            A_eq=E,
            b_eq=e,
            bounds=bounds,
            method=method,
            options={**TOLERANCES, "presolve": presolve},
        )
        if found.status in DECIDED:
            break
    return found


def margin_program(question: Question, sets: list[WrenchSpace] | None = None) -> tuple:
    """Return cost, A, b, E, e of the least utilisation; the unknowns are all y, then u."""
    r = rows(question, sets)
    n = r.L.shape[1]
    return (
        np.append(np.zeros(n), 1.0),
        np.vstack([np.column_stack([r.L, -r.s]), np.column_stack([r.H, np.zeros(len(r.h))])]),
        np.concatenate([-r.l0, r.h]),
        np.column_stack([r.B, np.zeros(6)]),
        question.needed_wrench() - r.b,
    )


def largest_load(question: Question) -> float:
    """Return the largest load that counts [N]: 10⁶ N, or a hundred times the body's force."""
    return max(1e6, 1e2 * float(np.linalg.norm(question.needed_wrench()[:3])))


def least_utilisation(
    question: Question, sets: list[WrenchSpace] | None = None, largest: float = np.inf
) -> OptimizeResult:
    """min u, loads up to a largest; ``fun`` is u, ``x`` the loads y of all hands, then u."""
    program = margin_program(question, sets)
    bounds = [(-largest, largest)] * (len(program[0]) - 1) + [(None, None)]
    return solve(*program, bounds=bounds)


def largest_load_factor(question: Question) -> float | None:
    """Max s at utilisation 1, or None."""
    r = rows(question)
    n = r.L.shape[1]
    A = np.column_stack([np.vstack([r.L, r.H]), np.zeros(len(r.s) + len(r.h))])
    A = np.vstack([A, np.append(np.zeros(n), -1.0)])
    E = np.column_stack([r.B, -question.needed_wrench()])
    b = np.concatenate([r.s - r.l0, r.h, [0.0]])
    result = solve(np.append(np.zeros(n), -1.0), A, b, E, -r.b)
    return float(result.x[-1]) if result.status == 0 else None


def farthest(
    question: Question, direction: np.ndarray, sets: list[WrenchSpace] | None = None
) -> float:
    """Max of direction · body wrench over all loads up to `HUGE` that the hard rows allow."""
    r = rows(question, sets)
    result = solve(-(direction @ r.B), r.H, r.h, bounds=(-HUGE, HUGE))
    assert result.status == 0, result.message
    return float(-result.fun + direction @ r.b)
