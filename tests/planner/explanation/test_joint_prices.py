"""Prices of joints and of caps on forces: one-sided finite differences on the limit, by HiGHS."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from hand_models.base import Pose
from planner.prepare import assemble, posture
from planner.question import ForceCap, Limits, Question
from planner.result import Price
from planner.robots import robosimian
from planner.solving import plan
from tests.suite.helpers import peer
from tests.suite.helpers.stances import ask, on_wall
from tests.suite.helpers.stances_with_joints import at_joints

ROBOT = robosimian()
ANGLES = {
    limb: np.array([0.2, -0.4, 0.3, 0.5, -0.2, 0.4, 0.1]) * sign
    for limb, sign in zip(ROBOT.limbs, (1.0, -1.0, 1.0, -1.0), strict=True)
}
WRENCH = np.array([150.0, 40.0, 60.0, 5.0, -8.0, 3.0])


def with_joints(limbs: tuple[str, ...], torque: dict) -> Question:
    stance = at_joints(ROBOT, ANGLES, limbs, body=Pose.identity())
    return ask(stance, "prices", body_wrench=WRENCH, limits=Limits(joint_torque=torque))


def least(question: Question) -> float:
    """The least utilisation, with limbs that hold nothing."""
    where = posture(question)
    _, hands = assemble(question, where, question.needed_wrench())
    result = peer.least_utilisation(question, list(hands.spaces))
    assert result.status == 0, result.message
    limbs = [hand.limb for hand in question.stance.hands]
    joints = {} if where is None else where.joints
    idle = [
        float(np.abs(bears.gravity / bears.limits).max())
        for limb, bears in joints.items()
        if limb not in limbs
    ]
    return max([result.fun, *idle])


def slopes(changed, limit: float) -> tuple[float, float]:
    """What a unit more and a unit less of a limit take off and add, from steps of 1e-5 of it."""
    step = 1e-5 * limit
    here = least(changed(limit))
    return (here - least(changed(limit + step))) / step, (
        least(changed(limit - step)) - here
    ) / step


def with_torque(question: Question, price: Price):
    """The question with another limit of the joint that a price is of."""
    limits, limb = question.limits, price.name.limb
    index = ROBOT.chains[limb].joints.index(price.name.joint)

    def changed(limit: float) -> Question:
        torque = list(limits.joint_torque[limb])
        torque[index] = limit
        by_limb = {**limits.joint_torque, limb: tuple(torque)}
        return replace(question, limits=structs.replace(limits, joint_torque=by_limb))

    return changed, limits.joint_torque[limb][index]


def test_price_of_a_joint_lies_between_the_one_sided_differences():
    for limbs in [ROBOT.limbs, ROBOT.limbs[:3], ROBOT.limbs[:2]]:
        torque = {limb: tuple(np.linspace(60.0, 20.0, 7)) for limb in ROBOT.limbs}
        question = with_joints(limbs, torque)
        answer = plan(question)
        prices = [price for price in answer.prices if price.name.limit == "joint_torque"]
        assert prices
        for price in prices:
            assert price.unit == "N·m"
            more, less = slopes(*with_torque(question, price))
            slack = 2e-3 * max(more, less) + 1e-7
            assert more - slack <= price.price <= less + slack
            assert price.price > 0.0


def test_price_of_a_limb_that_holds_nothing_is_its_joints_alone():
    torque = {ROBOT.limbs[3]: (0.5,) * 7}
    question = with_joints(ROBOT.limbs[:3], torque)
    (price,) = plan(question).prices
    assert price.name.limb == ROBOT.limbs[3]
    more, less = slopes(*with_torque(question, price))
    assert price.price == pytest.approx(more, rel=1e-4)
    assert price.price == pytest.approx(less, rel=1e-4)


@pytest.mark.parametrize("frame", ["hand", "body", "world"])
@pytest.mark.parametrize("ranged", [False, True], ids=["size", "range"])
def test_price_of_a_cap_on_a_force_lies_between_the_one_sided_differences(frame, ranged):
    stance = on_wall()
    limb = stance.hands[2].limb
    along = {"hand": 0, "body": 0, "world": 2}[frame]

    def changed(most: float) -> Question:
        axes = [(-np.inf, np.inf)] * 3
        axes[along] = (-most, most)
        cap = ForceCap(tuple(axes) if ranged else most, frame)
        return ask(stance, "prices", limits=Limits(per_hand={limb: cap}))

    price = next(p for p in plan(changed(150.0)).prices if p.name.limit == "force_cap")
    assert (price.name.limb, price.unit) == (limb, "N")
    more, less = slopes(changed, 150.0)
    slack = 2e-3 * max(more, less) + 1e-7
    assert price.price > 0.0
    assert more - slack <= price.price <= less + slack
