"""The effort of plans from their numbers alone, and how much less HiGHS finds near them."""

from __future__ import annotations

import numpy as np

from planner.prepare import assemble, posture
from planner.question import Question
from planner.result import HandPlan, Plan
from tests.suite.helpers import peer


def told_effort(question: Question, answer: Plan) -> float:
    """The sum of squared relative tensions and torques, from the plan's numbers alone."""
    total = 0.0
    for hand in answer.hands:
        most = next(
            s for row, s in zip(hand.space.rows, hand.space.s, strict=False) if is_tension(row)
        )
        total += sum((finger.tendon_tension / most) ** 2 for finger in hand.fingers)
        if answer.joint_torque is not None:
            most = (
                question.limits.joint_torque
                or question.stance.robot.chains[hand.limb].torque_limits
            )
            total += float(np.sum((answer.joint_torque[hand.limb] / most) ** 2))
    return total


def is_tension(row) -> bool:
    return row.limit == "tendon_tension"


def loads_of(hand: HandPlan) -> np.ndarray:
    """The loads y of a hand's set that its plan tells."""
    if hand.wrist is not None:
        return hand.wrist.twist
    told = {"palm_shear": -hand.palm.force[0], "palm_pressing": hand.palm.force[2]}
    for finger in hand.fingers:
        told[f"{finger.name}/tension"] = finger.tendon_tension
        told[f"{finger.name}/lateral"] = sum(tile.lateral for tile in finger.tiles)
    y = np.array([told[column] for column in hand.space.columns])
    np.testing.assert_allclose(hand.space.wrench(y), hand.wrench, atol=1e-6)
    return y


def promised(question: Question, answer: Plan, cap: float) -> float:
    """How much less effort the sets about a plan promise, at most: to first order, by HiGHS.

    Effort is convex on them, so that it lies above its tangent at the plan.
    """
    _, hands = assemble(question, posture(question), answer.body_wrench)
    data = hands.sets(hands.at_rest()).data.hands
    spaces = [hand.space for hand in answer.hands]
    loads = [loads_of(hand) for hand in answer.hands]
    slopes = []
    for space, y, scaled in zip(spaces, loads, data, strict=True):
        those = [
            i
            for i, row in enumerate(space.rows[: len(space.s)])
            if is_tension(row) or (row.limit == "joint_torque" and row.label.endswith("+"))
        ]
        E, e0 = space.L[those] / space.s[those, None], space.l0[those] / space.s[those]
        slopes.append(2.0 * (E.T @ (E @ y + e0) + scaled.rest / scaled.unit**2 * y))
    cost = np.concatenate(slopes)
    r = peer.rows(question, spaces)
    result = peer.solve(
        cost,
        np.vstack([r.L, r.H]),
        np.concatenate([cap * r.s - r.l0, r.h]),
        r.B,
        answer.body_wrench - r.b,
    )
    assert result.status == 0, result.message
    return float(cost @ np.concatenate(loads) - result.fun)
