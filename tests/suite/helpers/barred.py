"""Stances whose loads do not balance, put to another solver: SI data for HiGHS, by names."""

from __future__ import annotations

from collections.abc import Collection
from functools import cache
from typing import NamedTuple

import cvxpy as cp
import numpy as np
import pytest
from msgspec import convert

from hand_models.wrench_spaces import WrenchSpace
from planner.prepare import assemble, posture
from planner.programs import WRENCH_UNIT
from planner.question import Question
from planner.result import LimitName, Plan
from planner.solving import plan
from service.answering.questions import question as planner_question
from service.requests import PlanRequest
from tests.suite.helpers import peer
from tests.suite.helpers.jointed import random_jointed_question
from tests.suite.helpers.random_requests import random_request
from tests.suite.helpers.stances import random_question

LOAD, SIZE = 100.0, 100.0
"""Units of loads and of rows [N] in the quadratic program."""


class Barred(NamedTuple):
    """``A y ≤ b`` with a name for each row, ``E y = e``: given components, ``B y + o``: the body's.

    Limit rows are there at a cap on the utilisation, if there is one.
    """

    A: np.ndarray
    b: np.ndarray
    names: list[LimitName]
    E: np.ndarray
    e: np.ndarray
    owners: list[LimitName]
    B: np.ndarray
    o: np.ndarray
    wrench: np.ndarray
    spaces: dict[str, WrenchSpace]

    @property
    def constraints(self) -> set[LimitName]:
        return {*self.names, *self.owners}


def barred(question: Question, cap: float | None) -> Barred:
    """The rows of a question; what joints, caps and present tensions say is in the hands' sets."""
    where = posture(question)
    wrench = question.needed_wrench(None if where is None else where.body_wrench)
    _, hands = assemble(question, where, wrench)
    spaces = list(hands.spaces)
    rows = peer.rows(question, spaces)
    limbs = [hand.limb for hand in question.stance.hands]

    def named(space, limb, kind):
        return [
            LimitName(limb, row.finger, row.phalanx, row.limit, row.joint)
            for row in space.rows
            if row.kind == kind
        ]

    pairs = list(zip(spaces, limbs, strict=True))
    names = [name for pair in pairs for name in named(*pair, "hard")]
    A, b = rows.H, rows.h
    if cap is not None:
        names = [name for pair in pairs for name in named(*pair, "limit")] + names
        A, b = np.vstack([rows.L, A]), np.concatenate([cap * rows.s - rows.l0, b])
    columns = np.cumsum([0, *(len(space.columns) for space in spaces)])
    E, e, owners = [], [], []
    for i, (hand, space) in enumerate(zip(question.stance.hands, spaces, strict=True)):
        for j, value in enumerate(hand.wrench or ()):
            if value is not None:
                row = np.zeros(columns[-1])
                row[columns[i] : columns[i + 1]] = space.generators[j]
                E.append(row)
                e.append(value - space.origin[j])
                owners.append(LimitName(hand.limb, None, None, "held_wrench"))
    return Barred(
        A,
        b,
        names,
        np.array(E).reshape(-1, columns[-1]),
        np.array(e),
        owners,
        rows.B,
        rows.b,
        wrench,
        dict(zip(limbs, spaces, strict=True)),
    )


def have_loads(parts: Barred, constraints: Collection[LimitName]) -> bool:
    """Whether HiGHS finds loads up to `peer.HUGE` that balance and keep to these constraints."""
    rows = [name in constraints for name in parts.names]
    tied = [name in constraints for name in parts.owners]
    result = peer.solve(
        np.zeros(parts.A.shape[1]),
        parts.A[rows],
        parts.b[rows],
        np.vstack([parts.B, parts.E[tied]]),
        np.concatenate([parts.wrench - parts.o, parts.e[tied]]),
        bounds=(-peer.HUGE, peer.HUGE),
    )
    assert result.status in (0, peer.INFEASIBLE), result.message
    return result.status == 0


def most_given(parts: Barred, direction: np.ndarray, held: dict[str, np.ndarray]) -> float | None:
    """Max of direction · w + Σ held · v within the constraints: w the body's, v hands' wrenches.

    None where the constraints contradict each other.
    """
    row, rest = direction @ parts.B, float(direction @ parts.o)
    start = 0
    for limb, space in parts.spaces.items():
        count = len(space.columns)
        if limb in held:
            row[start : start + count] += held[limb] @ space.generators
            rest += float(held[limb] @ space.origin)
        start += count
    result = peer.solve(-row, parts.A, parts.b, bounds=(-peer.HUGE, peer.HUGE))
    assert result.status in (0, peer.INFEASIBLE), result.message
    return rest - float(result.fun) if result.status == 0 else None


def distance(parts: Barred) -> float:
    """How far the body wrenches that the constraints and given components allow are, by SCS.

    In `WRENCH_UNIT`, as a quadratic program without a box on the loads.
    """
    loads = cp.Variable(parts.A.shape[1])
    reached = parts.B * LOAD @ loads + parts.o
    rows = [parts.A * LOAD / SIZE @ loads <= parts.b / SIZE]
    if len(parts.E):
        rows.append(parts.E * LOAD / SIZE @ loads == parts.e / SIZE)
    missing = cp.multiply(1.0 / WRENCH_UNIT, reached - parts.wrench)
    problem = cp.Problem(cp.Minimize(cp.sum_squares(missing)), rows)
    problem.solve(solver=cp.SCS, eps=1e-8, max_iters=50_000)
    assert problem.status in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE)
    return float(np.sqrt(problem.value))


def miss(parts: Barred, wrench: np.ndarray) -> float:
    """How far the body wrenches that the constraints allow stay from one: the largest component."""
    unit = np.ones((6, 1))
    none = np.zeros((len(parts.A), 1))
    target = wrench - parts.o
    result = peer.solve(
        np.append(np.zeros(parts.A.shape[1]), 1.0),
        np.vstack(
            [
                np.hstack([parts.B, -unit]),
                np.hstack([-parts.B, -unit]),
                np.hstack([parts.A, none]),
            ]
        ),
        np.concatenate([target, -target, parts.b]),
        *((np.column_stack([parts.E, 0.0 * parts.e]), parts.e) if len(parts.E) else ()),
    )
    assert result.status == 0, result.message
    return float(result.fun)


def requested(seed: int) -> Question:
    """A random request as a question."""
    return planner_question(convert(random_request(seed), PlanRequest))


KINDS = {"plain": random_question, "jointed": random_jointed_question, "request": requested}

SEEDS = {
    "infeasible": {
        "plain": (3, 5, 12, 64, 77),
        "jointed": (15, 24),
        "request": (4, 10, 24, 54, 82, 90, 93),
    },
    "overloaded": {
        "plain": (14, 16, 46),
        "jointed": (0, 3, 7, 37),
        "request": (6, 9, 28, 55, 75, 97),
    },
}
"""Random questions that were answered so: with joints, caps, given wrenches, single hands."""

FEW = {
    "infeasible": {"plain": (5, 64), "jointed": (15, 24), "request": (4, 82, 90, 93)},
    "overloaded": {"plain": (14, 46), "jointed": (0, 7, 37), "request": (6, 55)},
}
"""Of them some that stand for all, where all would take long."""

few_and_all = pytest.mark.parametrize(
    "seeds", [FEW, pytest.param(SEEDS, marks=pytest.mark.slow)], ids=["few", "all"]
)


@cache
def _answered(kind: str, seed: int) -> tuple[str, Question, Plan]:
    question = KINDS[kind](seed)
    return f"{kind} {seed}", question, plan(question)


def explained(
    status: str, seeds: dict[str, dict[str, tuple[int, ...]]]
) -> list[tuple[str, Question, Plan]]:
    """Random questions that are answered with a status, and their answers."""
    answers = [_answered(kind, seed) for kind, some in seeds[status].items() for seed in some]
    found = [each for each in answers if each[2].status == status]
    assert len(found) >= 0.8 * len(answers)
    return found
