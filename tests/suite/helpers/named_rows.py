"""The rows of a question by their names, in SI units, and what other solvers say of them."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

import cvxpy as cp
import numpy as np

from hand_models.wrench_spaces import WrenchSpace
from planner.prepare import assemble, posture
from planner.programs import WRENCH_UNIT
from planner.question import Question
from planner.result import LimitName
from tests.suite.helpers import peer

LOAD, SIZE = 100.0, 100.0
"""Units of loads and of rows [N] in the quadratic program."""


class NamedRows(NamedTuple):
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


def named_rows(question: Question, cap: float | None) -> NamedRows:
    """The rows of a question; what joints, caps and present tensions say is in the hands' sets."""
    where = posture(question)
    wrench = question.needed_wrench(None if where is None else where.weights)
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
    return NamedRows(
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


def have_loads(parts: NamedRows, constraints: Collection[LimitName]) -> bool:
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


def most_given(
    parts: NamedRows, direction: np.ndarray, held: dict[str, np.ndarray]
) -> float | None:
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


def distance(parts: NamedRows) -> float:
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


def miss(parts: NamedRows, wrench: np.ndarray) -> float:
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
