"""Least effort with floating hands, and their joints, caps and given wrenches."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from msgspec import structs
from scipy.optimize import minimize

from hand_models.base import wrench_transport
from planner.floating import SETTINGS
from planner.prepare import posture
from planner.programs import CAP_SLACK, TWIST_UNIT, WRENCH_UNIT
from planner.question import ForceCap, Limits, Load, Question
from planner.result import Plan
from planner.solving import plan
from tests.suite.helpers.efforts import promised, told_effort
from tests.suite.helpers.floating_hands import NEAR, PAIR, REAR, body_wrench, floating, wrist_of
from tests.suite.helpers.stances import on_wall

chance = np.random.default_rng(3)
TWISTS = [2.0 * NEAR * part for part in chance.uniform(0.2, 1.0, (4, 6))[2:]] * np.array(
    [[1.0] * 6, [1.0, -1.0] * 3]
)
"""Of the wrists of `PAIR`: poses that they bear, and that others reach with less effort."""


def least(question: Question) -> Plan:
    return plan(replace(question, objective="min_effort"))


@cache
def with_joints() -> Question:
    """Four hands on a wall, the rear ones floating, with the joints that inverse kinematics gives.

    Its joints' limits are halved, so that they count.
    """
    stance = replace(floating(on_wall(), *REAR, preload=np.full(4, 50.0)), joints="solve")
    found = posture(Question(stance))
    return Question(
        replace(stance, joints=found.angles),
        load=Load(mass=95.0),
        limits=Limits(joint_torque=60.0),
    )


@cache
def pair() -> Question:
    """Two floating hands, with a wrench that they can bear."""
    return Question(PAIR, body_wrench=body_wrench(PAIR, TWISTS))


@cache
def both(name: str) -> tuple[Question, Plan, Plan]:
    """A question, its plan of least utilisation and that of least effort."""
    question = {"pair": pair, "with joints": with_joints}[name]()
    return question, plan(question), least(question)


@pytest.mark.parametrize("name", ["pair", "with joints"])
def test_least_effort_is_no_more_and_its_sets_promise_no_less(name):
    question, margin, effort = both(name)
    assert effort.status == "optimal"
    assert effort.verified
    assert effort.utilisation <= 1.0 + CAP_SLACK
    assert effort.effort < margin.effort
    for answer in (margin, effort):
        assert answer.effort == pytest.approx(told_effort(question, answer), rel=1e-6)
    assert promised(question, margin, 1.0) > 1e-4
    assert promised(question, effort, 1.0 + CAP_SLACK) <= 1e-5


class Model:
    """Effort, missing wrench and room of two floating hands by the model alone, and slopes.

    Unknowns are the steps of both wrists from a plan's poses, in `TWIST_UNIT`.
    """

    STEP = 1e-7

    def __init__(self, question: Question, answer: Plan) -> None:
        body = question.stance.body.inverse()
        self.wrists = [wrist_of(hand, question.stance) for hand in question.stance.hands]
        self.carried = [-wrench_transport(body @ hand.pose) for hand in question.stance.hands]
        self.best = [hand.wrist.twist for hand in answer.hands]
        self.wanted = question.body_wrench
        self.most = self.wrists[0].hand.settled.hand.maximum_tension
        self._at, self._found = None, None

    def values(self, x: np.ndarray) -> np.ndarray:
        """At x and one step aside along each axis, shape (13, 1 + 6 + 4)."""
        if self._at is None or (self._at != x).any():
            total, effort, room = -self.wanted, 0.0, []
            for i, wrist in enumerate(self.wrists):
                steps = np.vstack([np.zeros(12), self.STEP * np.eye(12)])[:, 6 * i : 6 * i + 6]
                twists = self.best[i] + (x[6 * i : 6 * i + 6] + steps) * TWIST_UNIT
                loads, judged = wrist.hand.loads(twists), wrist.evaluate(twists)
                effort = effort + np.sum((loads.tensions / self.most) ** 2, axis=1)
                total = total + loads.wrenches @ self.carried[i].T
                room += [1.0 - judged.utilisation, -judged.violation / 100.0]
            self._at = x.copy()
            self._found = np.column_stack([effort, total / WRENCH_UNIT, *room])
        return self._found

    def slopes(self, x: np.ndarray, part: slice) -> np.ndarray:
        found = self.values(x)[:, part]
        return (found[1:] - found[0]).T / self.STEP


@pytest.mark.slow
def test_another_solver_finds_nothing_less_on_the_model_itself():
    """Poses of the wrists are the unknowns of a nonlinear program for scipy's SLSQP."""
    question, margin, answer = both("pair")
    assert answer.effort < margin.effort * (1.0 - 1e-3)
    model, parts = Model(question, answer), (slice(1, 7), slice(7, 11))
    assert model.values(np.zeros(12))[0, 0] == pytest.approx(answer.effort, rel=1e-9)
    constraints = [
        {
            "type": kind,
            "fun": lambda x, part=part: model.values(x)[0, part],
            "jac": lambda x, part=part: model.slopes(x, part),
        }
        for kind, part in zip(("eq", "ineq"), parts, strict=True)
    ]
    passed = [np.zeros(12)]
    minimize(
        lambda x: model.values(x)[0, 0],
        np.zeros(12),
        jac=lambda x: model.slopes(x, slice(0, 1))[0],
        method="SLSQP",
        constraints=constraints,
        bounds=[(-0.5, 0.5)] * 12,
        options={"maxiter": 60, "ftol": 1e-12},
        callback=lambda x: passed.append(x.copy()),
    )
    values = [model.values(x)[0] for x in passed]
    # SLSQP keeps limits to about 1e-5 only
    held = [
        v[0] for v in values if np.abs(v[parts[0]]).max() <= 1e-6 and v[parts[1]].min() >= -5e-5
    ]
    assert len(held) >= 3
    assert min(held) >= answer.effort - 1e-5


# Caps on the utilisation ------------------------------------------------------------------------


def test_a_tighter_cap_costs_effort_and_is_kept():
    question, margin, effort = both("with joints")
    cap = 0.5 * (1.0 + margin.utilisation)
    answer = least(replace(question, limits=structs.replace(question.limits, utilisation=cap)))
    assert answer.status == "optimal"
    assert answer.utilisation <= cap + CAP_SLACK
    assert margin.effort > answer.effort > effort.effort


def test_the_least_utilisation_itself_may_be_the_cap():
    question, margin, _ = both("with joints")
    limits = structs.replace(question.limits, utilisation=margin.utilisation)
    answer = least(replace(question, limits=limits))
    assert answer.status == "optimal"
    assert answer.verified
    assert answer.effort <= margin.effort


def test_beyond_the_cap_the_least_utilisation_is_told():
    question, margin, _ = both("with joints")
    limits = structs.replace(question.limits, utilisation=margin.utilisation - 0.01)
    answer = least(replace(question, limits=limits))
    assert answer.status == "overloaded"
    assert answer.utilisation == pytest.approx(margin.utilisation, abs=1e-6)
    assert answer.effort_prices is None


def test_an_ended_budget_leaves_a_plan_and_says_so(monkeypatch):
    question, margin, _ = both("with joints")
    monkeypatch.setattr("planner.floating.effort.SETTINGS", replace(SETTINGS, effort_programs=0))
    answer = least(question)
    assert answer.status == "optimal"
    assert answer.verified
    assert answer.effort <= margin.effort * (1.0 + 1e-9)
    assert any("not proven" in text for text in answer.warnings)


# Joints, caps and given wrenches of floating hands ------------------------------------------------


def test_joints_of_floating_hands_bear_gravity_and_the_hand_where_it_rests():
    question, margin, effort = both("with joints")
    where = posture(question)
    for answer in (margin, effort):
        for hand in answer.hands:
            joints = where.joints[hand.limb]
            torque = joints.gravity + joints.jacobian.T @ hand.wrench
            np.testing.assert_allclose(answer.joint_torque[hand.limb], torque, atol=1e-9)
            assert np.abs(torque).max() <= answer.utilisation * 60.0 * (1.0 + 1e-6)


def of_joint(question: Question, torque: float) -> Question:
    """The question with a limit on one joint of a floating hand's limb [N·m]."""
    own = (60.0, torque, *[60.0] * 5)
    return replace(question, limits=Limits(joint_torque={"rear_left": own}))


def of_force(question: Question, force: float) -> Question:
    """The question with a cap on a floating hand's force [N]."""
    return replace(question, limits=Limits(per_hand={"rear_left": ForceCap(force)}))


@pytest.mark.parametrize(
    ("limited", "at", "step", "limit"),
    [(of_joint, 8.0, 0.1, "joint_torque"), (of_force, 100.0, 1.0, "force_cap")],
)
def test_prices_at_floating_hands_are_slopes(limited, at, step, limit):
    """One-sided differences on the limit itself, each from a search of its own."""
    question = replace(with_joints(), want=frozenset(["prices"]))
    low, here, high = (plan(limited(question, at + d)) for d in (-step, 0.0, step))
    told = [p.price for p in here.prices if p.name.limit == limit]
    assert len(told) == 1
    less = (low.utilisation - here.utilisation) / step
    more = (here.utilisation - high.utilisation) / step
    assert 0.99 * more - 1e-6 <= told[0] <= 1.01 * less + 1e-6


@pytest.mark.slow
def test_effort_prices_at_floating_hands_are_slopes():
    question, step = with_joints(), 1.0
    low, here, high = (least(of_force(question, 80.0 + d)) for d in (-step, 0.0, step))
    told = [p.price for p in here.effort_prices if p.name.limit == "force_cap"]
    assert len(told) == 1
    less, more = (low.effort - here.effort) / step, (here.effort - high.effort) / step
    assert 0.98 * more - 1e-6 <= told[0] <= 1.02 * less + 1e-6


GIVEN = {
    "one force": (None, None, -10.0, None, None, None),
    "three forces": (-100.0, 5.0, 20.0, None, None, None),
    "a moment": (None, None, None, None, None, 1.5),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("limb", "name"),
    [
        pytest.param("rear_right", "one force", marks=pytest.mark.slow),
        pytest.param("rear_right", "three forces", marks=pytest.mark.slow),
        pytest.param("rear_right", "a moment", marks=pytest.mark.slow),
        ("front_right", "one force"),
    ],
)
def test_given_components_of_a_wrench_are_met(limb, name):
    question = with_joints()
    hands = tuple(
        replace(hand, wrench=GIVEN[name]) if hand.limb == limb else hand
        for hand in question.stance.hands
    )
    given = replace(question, stance=replace(question.stance, hands=hands))
    _, free, _ = both("with joints")
    margin, effort = plan(given), least(given)
    assert margin.utilisation >= free.utilisation * (1.0 - 1e-5)
    assert effort.effort <= margin.effort
    for answer in (margin, effort):
        assert answer.status == "optimal"
        assert answer.verified
        hand = next(hand for hand in answer.hands if hand.limb == limb)
        for got, asked in zip(hand.wrench, GIVEN[name], strict=True):
            assert asked is None or got == pytest.approx(asked, abs=1e-5)


def test_load_factor_leaves_given_components_as_they_are():
    question = with_joints()
    hands = tuple(
        replace(hand, wrench=GIVEN["three forces"]) if hand.limb == "rear_right" else hand
        for hand in question.stance.hands
    )
    given = replace(question, stance=replace(question.stance, hands=hands))
    whole = plan(replace(given, want=frozenset(["load_factor"])))
    assert whole.load_factor > 1.0
    more = plan(replace(given, body_wrench=whole.load_factor * whole.body_wrench))
    assert more.utilisation == pytest.approx(1.0, abs=2e-5)
    np.testing.assert_allclose(more.hands[1].wrench[:3], GIVEN["three forces"][:3], atol=1e-5)


def test_fixed_hands_beside_floating_ones_keep_near_their_present_tensions():
    question, margin, free = both("with joints")
    now = {
        hand.limb: np.array([finger.tendon_tension for finger in hand.fingers])
        for hand in margin.hands
        if hand.wrist is None
    }
    limits = structs.replace(question.limits, tension_change=3.0)
    answer = least(replace(question, present=now, limits=limits))
    assert answer.status == "optimal"
    assert free.effort < answer.effort <= margin.effort
    for hand in answer.hands:
        if hand.wrist is None:
            tensions = np.array([finger.tendon_tension for finger in hand.fingers])
            assert np.abs(tensions - now[hand.limb]).max() <= 3.0 + 1e-5
