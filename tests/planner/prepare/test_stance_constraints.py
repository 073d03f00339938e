"""Rows of joints, force caps and tension changes in a hand's set, against the formulas."""

import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from hand_models.hand import FINGERS
from hand_models.wrench_spaces import WrenchSpace
from planner.prepare import FORCE_CAP, FORCE_DIRECTIONS, TENSION_CHANGE, hand_space
from planner.prepare.stance_constraints import JointLoads, StanceConstraints
from planner.programs import JOINT_TORQUE
from tests.suite.helpers.stances import on_wall

SEEDS = st.integers(0, 2**32 - 1)


@cache
def space() -> WrenchSpace:
    return hand_space(on_wall(), "front_right")[1]


def random_joints(rng: np.random.Generator, count: int = 7) -> JointLoads:
    names = tuple(f"joint{i}" for i in range(count))
    gravity, jacobian = rng.normal(size=count) * 30.0, rng.normal(size=(6, count))
    sliding = np.zeros(count, dtype=bool)
    return JointLoads(names, sliding, gravity, jacobian, rng.uniform(10.0, 200.0, count))


def random_loads(rng: np.random.Generator) -> np.ndarray:
    return rng.uniform(-200.0, 200.0, len(space().columns))


def used(made: WrenchSpace, y: np.ndarray) -> dict[str, float]:
    """Utilisation of every limit row by its label."""
    rows = made.rows[: len(made.s)]
    assert len({row.label for row in made.rows}) == len(made.rows)
    return {row.label: u for row, u in zip(rows, made.utilisations(y), strict=True)}


def broken(made: WrenchSpace, y: np.ndarray) -> dict[str, float]:
    """By how much each hard row is broken, by its label."""
    return {
        row.label: float(a @ y - b)
        for row, a, b in zip(made.rows[len(made.s) :], made.H, made.h, strict=True)
    }


@given(SEEDS)
def test_joint_rows_are_the_joints_torques_with_both_signs(seed):
    rng = np.random.default_rng(seed)
    joints, y = random_joints(rng), random_loads(rng)
    made = StanceConstraints(joints=joints).on(space())
    wrench = space().origin + space().generators @ y
    found = used(made, y)
    for i, name in enumerate(joints.names):
        torque = joints.gravity[i] + sum(joints.jacobian[k, i] * wrench[k] for k in range(6))
        for sign, factor in (("+", 1.0), ("-", -1.0)):
            share = found[f"{JOINT_TORQUE}/{name}{sign}"]
            assert share == pytest.approx(factor * torque / joints.limits[i], abs=1e-9)
    named = [row.joint for row in made.rows if row.limit == JOINT_TORQUE]
    assert sorted(named) == sorted(2 * joints.names)


@given(SEEDS)
def test_rows_that_are_added_leave_the_others_as_they_are(seed):
    rng = np.random.default_rng(seed)
    y = random_loads(rng)
    added = StanceConstraints(random_joints(rng), 100.0, np.eye(3), rng.uniform(0.0, 90.0, 4), 5.0)
    made, before = added.on(space()), space()
    plain, all_of_them = used(before, y), used(made, y)
    assert {label: all_of_them[label] for label in plain} == plain
    hard, all_hard = broken(before, y), broken(made, y)
    assert {label: all_hard[label] for label in hard} == hard
    np.testing.assert_array_equal(made.D, before.D)
    np.testing.assert_array_equal(made.wrench(y), before.wrench(y))
    # wrench rows are the last of the limit rows
    tail = made.utilisations(y)[len(made.s) - len(made.D) :]
    np.testing.assert_allclose(
        tail, made.D @ made.wrench(y) / made.s[len(made.s) - len(made.D) :], atol=1e-12
    )


def test_nothing_asked_adds_nothing():
    assert StanceConstraints().on(space()) is space()
    assert StanceConstraints(present=np.zeros(4)).on(space()) is space()
    assert StanceConstraints(change=5.0).on(space()) is space()


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: math.hypot(*v) > 1e-3))
def test_26_directions_tell_the_size_of_a_force_from_above(force):
    size = math.hypot(*force)
    told = float((FORCE_DIRECTIONS @ force).max())
    assert FORCE_DIRECTIONS.shape == (26, 3)
    assert size * (1.0 - 1e-12) <= told <= 1.12 * size


def test_26_directions_enclose_the_ball_and_no_more():
    """The farthest force whose largest product is 1, along many directions, is within the ball."""
    rng = np.random.default_rng(1)
    farthest = 0.0
    for way in rng.normal(size=(60, 3)):
        found = linprog(
            -way, A_ub=FORCE_DIRECTIONS, b_ub=np.ones(len(FORCE_DIRECTIONS)), bounds=(None, None)
        )
        farthest = max(farthest, float(np.linalg.norm(found.x)))
    assert 0.99 <= farthest <= 1.0 + 1e-9


@given(SEEDS, st.one_of(st.floats(1.0, 1e3), st.integers(1, 1000)))
def test_a_cap_whatever_the_direction(seed, most):
    y = random_loads(np.random.default_rng(seed))
    found = used(StanceConstraints(cap=most).on(space()), y)
    told = max(share for label, share in found.items() if label.startswith(FORCE_CAP))
    size = float(np.linalg.norm(space().wrench(y)[:3]))
    assert size * (1.0 - 1e-9) <= told * most <= 1.12 * size + 1e-9


@given(SEEDS)
def test_a_cap_along_axes_of_a_frame(seed):
    rng = np.random.default_rng(seed)
    frame = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
    y = random_loads(rng)
    cap = ((-30.0, 50.0), (-math.inf, 20.0), (0.0, math.inf))
    made = StanceConstraints(cap=cap, frame=frame).on(space())
    found, hard = used(made, y), broken(made, y)
    along = [float(frame[:, i] @ space().wrench(y)[:3]) for i in range(3)]
    assert {label for label in found if label.startswith(FORCE_CAP)} == {
        f"{FORCE_CAP}/{end}" for end in ("fx+", "fx-", "fy+")
    }
    assert {label for label in hard if label.startswith(FORCE_CAP)} == {f"{FORCE_CAP}/fz-"}
    assert found[f"{FORCE_CAP}/fx+"] == pytest.approx(along[0] / 50.0, abs=1e-9)
    assert found[f"{FORCE_CAP}/fx-"] == pytest.approx(-along[0] / 30.0, abs=1e-9)
    assert found[f"{FORCE_CAP}/fy+"] == pytest.approx(along[1] / 20.0, abs=1e-9)
    assert hard[f"{FORCE_CAP}/fz-"] == pytest.approx(-along[2], abs=1e-8)


@given(SEEDS, st.floats(0.1, 100.0))
def test_changes_of_tension_are_hard(seed, most):
    rng = np.random.default_rng(seed)
    y, present = random_loads(rng), rng.uniform(0.0, 100.0, 4)
    hard = broken(StanceConstraints(present=present, change=most).on(space()), y)
    for i, finger in enumerate(FINGERS):
        tension = y[space().columns.index(f"{finger}/tension")]
        up, down = (hard[f"{finger}/{TENSION_CHANGE}/{way}"] for way in ("up", "down"))
        assert up == pytest.approx(tension - present[i] - most, abs=1e-9)
        assert down == pytest.approx(present[i] - tension - most, abs=1e-9)
