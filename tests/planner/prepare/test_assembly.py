"""What the programs are given of a question's hands, against its formulas hand by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hand_models.base import Pose, wrench_transport, wrench_transports
from hand_models.hand import FINGERS
from hand_models.rock import Cylinder
from planner.prepare import HandSets, assemble, posture
from planner.programs import HandData, ScaledRows, StanceData
from planner.question import ForceCap, Limits, Question
from tests.suite.helpers.shares import given_some
from tests.suite.helpers.stances import ask, moved, on_wall, random_stance

WRENCH = np.array([300.0, 300.0, 300.0, 30.0, 30.0, 30.0])
"""What body wrenches are over [N, N·m]."""

LOAD = 100.0
"""What loads are over [N]."""

SEEDS = st.integers(0, 40)


def gathered(question: Question) -> tuple[HandSets, StanceData]:
    where = posture(question)
    wrench = question.needed_wrench(None if where is None else where.weights)
    _, hands = assemble(question, where, wrench)
    return hands, hands.sets(hands.at_rest()).data


def on_body(stance, i: int, wrench: np.ndarray) -> np.ndarray:
    """What the rock exerts on the body where hand i exerts a wrench on the rock, in B."""
    turn = stance.body.rotation.T
    place = turn @ (stance.hands[i].pose.position - stance.body.position)
    force, moment = (-turn @ stance.hands[i].pose.rotation @ part for part in np.split(wrench, 2))
    return np.concatenate([force, moment + np.cross(place, force)])


def check_hand(
    question: Question, hands: HandSets, data: StanceData, i: int, y: np.ndarray
) -> None:
    """A hand's data at loads y [N], against its set's own numbers."""
    space, hand, z = hands.spaces[i], data.hands[i], y / LOAD
    np.testing.assert_array_equal(hand.unit, LOAD)
    balance = on_body(question.stance, i, space.origin + space.generators @ y) / WRENCH
    np.testing.assert_allclose(
        hand.G[:6] @ z + hand.g[:6], balance, rtol=0.0, atol=1e-12 * max(1.0, np.abs(balance).max())
    )
    used = space.utilisations(y)
    np.testing.assert_allclose(hand.L @ z + hand.l0, used, rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(
        hand.H @ z - hand.h, (space.H @ y - space.h) / LOAD, rtol=0.0, atol=1e-11
    )
    rows = space.rows[: len(space.s)]
    efforts = [
        share
        for row, share in zip(rows, used, strict=True)
        if row.limit == "tendon_tension"
        or (row.limit == "joint_torque" and row.label.endswith("+"))
    ]
    np.testing.assert_allclose(hand.E @ z + hand.e0, efforts, rtol=0.0, atol=1e-11)
    # in the tie-break loads count by their own capacity, other loads than tensions for 1 % of it
    most = {row.label: capacity for row, capacity in zip(rows, space.s, strict=True)}
    for column, tie, rest in zip(space.columns, hand.tie, hand.rest, strict=True):
        finger, _, name = column.rpartition("/")
        if name == "tension":
            assert tie == pytest.approx((LOAD / most[f"{finger}/tendon_tension"]) ** 2, rel=1e-12)
            assert rest == 0.0
        else:
            assert tie == pytest.approx((0.01 * LOAD / most.get(column, LOAD)) ** 2, rel=1e-12)
            assert rest == pytest.approx(0.1 * tie, rel=1e-12)
    sizes = len(hand.unit), len(hand.l0), len(hand.h), len(hand.e0)
    assert sizes == (len(y), len(used), len(space.h), len(efforts))


def check(question: Question, seed: int = 0) -> StanceData:
    hands, data = gathered(question)
    rng = np.random.default_rng(seed)
    for i, space in enumerate(hands.spaces):
        check_hand(question, hands, data, i, rng.uniform(-200.0, 200.0, len(space.columns)))
    offset = data.wrench - np.sum([hand.g for hand in data.hands], axis=0)
    np.testing.assert_allclose(data.offset, offset, rtol=0.0, atol=1e-12)
    return data


@given_some(5, 25, SEEDS, st.one_of(st.none(), st.floats(20.0, 900.0)))
def test_hands_of_random_stances(seed, cap):
    stance = random_stance(np.random.default_rng(seed))
    data = check(ask(stance, limits=Limits(tendon_tension=cap)), seed)
    assert len(data.wrench) == 6


def test_hands_with_joints_caps_and_present_tensions():
    stance = replace(on_wall(off=0.2, palm=True), joints="solve")
    limits = Limits(
        per_hand={
            "front_left": ForceCap(150.0),
            "rear_left": ForceCap(((-math.inf, 90.0),) * 2 + ((0.0, 100.0),), "world"),
        },
        tension_change=20.0,
    )
    present = {"front_right": np.full(len(FINGERS), 50.0)}
    check(ask(stance, limits=limits, present=present))


def test_given_components_of_a_hands_wrench_are_rows_of_the_balance():
    stance = on_wall()
    first = replace(stance.hands[0], wrench=(None, 12.0, None, None, None, 0.6))
    question = ask(replace(stance, hands=(first, *stance.hands[1:])))
    data = check(question)
    hands, _ = gathered(question)
    np.testing.assert_allclose(data.wrench[6:], [12.0 / 300.0, 0.6 / 30.0])
    y = np.linspace(-50.0, 80.0, len(hands.spaces[0].columns))
    wrench = hands.spaces[0].wrench(y)
    held = data.hands[0].G[6:] @ (y / LOAD) + data.hands[0].g[6:]
    np.testing.assert_allclose(held, [wrench[1] / 300.0, wrench[5] / 30.0], atol=1e-13)
    for hand in data.hands[1:]:
        assert not hand.G[6:].any()
        assert not hand.g[6:].any()


@given(st.integers(0, 2**32 - 1))
def test_wrenches_of_all_hands_are_carried_as_those_of_each(seed):
    rng = np.random.default_rng(seed)
    quaternions = rng.normal(size=(4, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    body, *poses = (Pose.from_quaternion(rng.normal(size=3) * 3.0, q) for q in quaternions)
    found = wrench_transports(body, poses)
    for pose, transport in zip(poses, found, strict=True):
        alone = wrench_transport(body.inverse() @ pose)
        np.testing.assert_allclose(transport, alone, rtol=0.0, atol=1e-13)


def test_a_hand_elsewhere_gives_the_very_same_rows():
    """Only its part of the balance is new, where the body is turned and hands stay on holds."""
    question = ask(on_wall(Cylinder(0.4)))
    hands, data = gathered(question)
    turned = replace(question.stance, body=question.stance.body @ Pose(np.full(3, 0.1), np.eye(3)))
    there, other = gathered(replace(question, stance=turned))
    assert all(a is b for a, b in zip(hands.spaces, there.spaces, strict=True))
    for a, b in zip(data.hands, other.hands, strict=True):
        assert not np.allclose(a.G, b.G)
        assert all(np.array_equal(*pair) for pair in zip(a[2:], b[2:], strict=True))
    check(replace(question, stance=turned))


def test_scaled_rows_cannot_be_written_to():
    hands, _ = gathered(ask(on_wall(Cylinder(0.41), limbs=("front_left",))))
    rows = ScaledRows.of(hands.spaces[0])
    for name in ("generators", "origin", "L", "l0", "H", "h", "E", "e0", "tie", "rest", "unit"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(rows, name)[...] = 1.0


def test_where_the_stance_is_in_the_world_changes_no_number():
    question = ask(on_wall())
    by = Pose.from_quaternion([3.0, -2.0, 1.0], [0.1, 0.7, -0.1, math.sqrt(1.0 - 0.51)])
    _, here = gathered(question)
    _, there = gathered(replace(question, stance=moved(question.stance, by)))
    for a, b in zip(here.hands, there.hands, strict=True):
        for name, one, other in zip(HandData._fields, a, b, strict=True):
            np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-11, err_msg=name)
