"""What a stance can hold: against another solver, and against plans."""

import json
import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from msgspec import structs
from scipy.spatial import ConvexHull

from hand_models.base import InvalidInputError
from hand_models.tile import Surface
from planner.capability import WRENCH_COMPONENTS, BodySpace
from planner.prepare import hand_space, posture
from planner.programs import CAP_SLACK
from planner.question import ForceCap, Limits, Load, Question
from planner.solving import plan
from service.answering import questions
from service.requests import PlanRequest
from service.wire import decode_request
from tests.suite.helpers import peer
from tests.suite.helpers.floating_hands import NEAR, PAIR, body_wrench
from tests.suite.helpers.polygons import hull_of
from tests.suite.helpers.requests import (
    request_with_joints,
)
from tests.suite.helpers.stances import ask, attainable_wrench, on_wall, random_stance

AXES = np.vstack([np.eye(3), -np.eye(3)])


@cache
def wall_space() -> BodySpace:
    """Four pinches on a wall, under a load that they hold."""
    return BodySpace(ask(on_wall(), load=Load(80.0, (0.0, 0.0, 0.05))))


@cache
def with_joints() -> Question:
    """The wall with joints that are known, under the robot's own weight on a small planet."""
    request = request_with_joints()
    for extra in ("objective", "limits", "present", "want", "load"):
        del request[extra]
    del request["stance"]["hands"][1]["wrench"]
    return questions.question(decode_request(json.dumps(request).encode(), PlanRequest))


@cache
def space_with_joints() -> BodySpace:
    return BodySpace(with_joints())


def random_space(seed: int) -> BodySpace:
    rng = np.random.default_rng(seed)
    where = random_stance(rng)
    cap = float(rng.choice([1.0, 0.7]))
    wrench = attainable_wrench(where, rng)
    return BodySpace(Question(where, body_wrench=wrench, limits=Limits(utilisation=cap)))


def farthest(question, goal, columns, start):
    """Max of goal · t with the body wrench start + columns t, by HiGHS; None if there is none."""
    rows = peer.rows(question)
    n, k = rows.L.shape[1], columns.shape[1]
    A = np.vstack([rows.L, rows.H])
    b = np.concatenate([question.limits.utilisation * rows.s - rows.l0, rows.h])
    found = peer.solve(
        np.concatenate([np.zeros(n), -np.asarray(goal, dtype=float)]),
        np.hstack([A, np.zeros((len(b), k))]),
        b,
        np.hstack([rows.B, -columns]),
        start - rows.b,
    )
    if found.status == peer.INFEASIBLE:
        return None
    assert found.status == 0, found.message
    return -found.fun


# Against another solver ---------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_support_and_capability_are_those_of_highs(seed):
    space, rng = random_space(seed), np.random.default_rng(seed + 100)
    ways = [*np.eye(6)[rng.permutation(6)[:2]], rng.normal(size=6) / [1, 1, 1, 0.1, 0.1, 0.1]]
    held = space.plan.status == "optimal"
    cap = space.question.limits.utilisation
    for way in ways:
        end = space.support(way)
        wanted = farthest(space.question, way, np.eye(6), np.zeros(6))
        assert (end is None) == (wanted is None)
        if end is not None:
            assert end.reach == pytest.approx(wanted, rel=1e-6, abs=1e-3)
            assert way @ end.wrench == pytest.approx(end.reach, rel=1e-9)
            # what ends the way may be that a load turns round, which no limit's room changes
            room = structs.replace(space.question.limits, utilisation=0.99 * cap)
            less = farthest(replace(space.question, limits=room), way, np.eye(6), np.zeros(6))
            assert (end.limiting is None) == (less == pytest.approx(wanted, rel=1e-6, abs=1e-4))
        for start, end in ((np.zeros(6), space.pure(way)), (space.needed, space.more(way))):
            wanted = farthest(space.question, [1.0], way[:, None], start)
            if start is not space.needed or held:
                assert (end is None) == (wanted is None)
            else:
                assert end is None
            if end is not None:
                assert end.reach == pytest.approx(wanted, rel=1e-5, abs=1e-3)
                np.testing.assert_allclose(end.wrench, start + end.reach * way, atol=1e-3)


@pytest.mark.parametrize("others", ["needed", "zero", "free"])
@pytest.mark.parametrize("seed", [8, 15])
def test_the_set_is_between_its_polygons(seed, others):
    space, rng = random_space(seed), np.random.default_rng(seed)
    axes = [WRENCH_COMPONENTS[i] for i in sorted(rng.permutation(6)[:2])]
    plane = [WRENCH_COMPONENTS.index(axis) for axis in axes]
    columns = np.eye(6) if others == "free" else np.eye(6)[:, plane]
    at = space.needed * (others == "needed")
    at[plane] = 0.0
    scale = np.where(np.array(plane) < 3, 1.0, 10.0)
    polygon = space.section(axes, others).polygon
    for angle in rng.uniform(0.0, math.tau, 6):
        normal = scale * [math.cos(angle), math.sin(angle)]
        wanted = farthest(space.question, columns[plane].T @ normal, columns, at)
        assert (polygon is None) == (wanted is None)
        if polygon is not None:
            inner, outer = (hull_of(p)(normal).reach for p in (polygon.inner, polygon.outer))
            slack = 1e-6 * (1.0 + abs(wanted)) + 1e-3
            assert inner <= wanted + slack
            assert outer >= wanted - slack
            assert outer - inner <= polygon.gap + slack
    if polygon is not None:
        assert len(polygon.limiting) == len(polygon.inner)


def test_a_projection_is_the_sum_of_the_hands_own_vertices():
    limbs = ("front_left", "rear_right")
    question = ask(on_wall(limbs=limbs, lateral=False))
    polygon = BodySpace(question).section(("fx", "my"), "free").polygon
    scale = np.array([1.0, 10.0])
    total = np.zeros((1, 2))
    for i, limb in enumerate(limbs):
        vertices = hand_space(question.stance, limb)[1].vertices()
        flat = peer.reaction(question, i, vertices.T)[[0, 4]].T * scale
        flat = flat[ConvexHull(flat).vertices]
        total = (total[:, None] + flat).reshape(-1, 2)
    wanted = total[ConvexHull(total).vertices]
    inner = polygon.inner * scale
    # every corner of the one is near the other
    for corner in wanted:
        normals = [corner - wanted.mean(axis=0)]
        for normal in normals / np.linalg.norm(normals, axis=1)[:, None]:
            assert hull_of(inner)(normal).reach >= normal @ corner - polygon.gap - 1e-3
    for corner in inner:
        assert np.max(ConvexHull(total).equations @ [*corner, 1.0]) <= 1e-3
    assert ConvexHull(inner).volume == pytest.approx(ConvexHull(total).volume, rel=2e-3)


# Flat and empty sets ------------------------------------------------------------------------------


def held_wrench(given) -> Question:
    """One hand, some components of whose wrench are given."""
    question = ask(on_wall(limbs=("front_left",)), load=Load(20.0, (0.0, 0.0, 0.0)))
    hand = replace(question.stance.hands[0], wrench=given)
    return replace(question, stance=replace(question.stance, hands=(hand,)))


def test_a_hand_whose_wrench_is_given_leaves_a_point():
    given = (-20.0, 4.0, 20.0, 0.0, 0.0, 0.0)
    question = held_wrench(given)
    wanted = peer.reaction(question, 0, np.array(given))
    space = BodySpace(question)
    assert space.plan.status == "infeasible"
    for way in np.vstack([np.eye(6), -np.eye(6)]):
        np.testing.assert_allclose(space.support(way).wrench, wanted, atol=1e-3)
        assert space.more(way) is None
    polygon = space.section(("fx", "mz"), "free").polygon
    np.testing.assert_allclose(polygon.inner, [wanted[[0, 5]]], atol=1e-3)
    assert polygon.gap < 1e-3
    assert space.section(("fx", "fz"), "zero").polygon is None


def test_a_hand_with_one_free_component_leaves_a_segment():
    question = held_wrench((-20.0, 4.0, None, 0.0, 0.0, 0.0))
    polygon = BodySpace(question).section(("fz", "mx"), "free").polygon
    assert len(polygon.inner) == 2
    # the hand pushes along z of H, which is −z of B, 0.4 m to the left
    forces = polygon.inner[:, 0]
    assert np.ptp(forces) > 60.0
    slope = np.diff(polygon.inner[:, 1]) / np.diff(forces)
    assert slope == pytest.approx(0.4, abs=1e-4)


def test_where_nothing_is_held_there_is_nothing():
    weak = Surface.from_values({"shear_limit": 0.01})
    question = ask(on_wall(surface=weak, limbs=("front_left",)))
    space = BodySpace(question)
    assert space.plan.status == "overloaded"
    assert space.support(np.eye(6)[0]) is None
    assert space.section(("fx", "fz"), "free").polygon is None
    assert space.acceleration([1.0, 0.0, 0.0]) is None
    assert space.acceleration_section([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]) is None


# Accelerations ------------------------------------------------------------------------------------


def planned(question: Question, acceleration: np.ndarray) -> str:
    load = structs.replace(
        question.load,
        acceleration=tuple(float(a) for a in acceleration[:3]),
        angular_acceleration=tuple(float(a) for a in acceleration[3:]) or (0.0, 0.0, 0.0),
    )
    return plan(replace(question, load=load)).status


@pytest.mark.parametrize("way", AXES)
def test_a_plan_holds_up_to_the_largest_acceleration(way):
    space = wall_space()
    most = space.acceleration(way)
    assert most.reach > 0.5
    assert planned(space.question, 0.999 * most.reach * way) == "optimal"
    assert planned(space.question, 1.001 * most.reach * way) == "overloaded"


@pytest.mark.parametrize("index", [0, 4, 5])
def test_so_it_does_with_joints_and_turning(index):
    space = space_with_joints()
    for sign in (1.0, -1.0):
        way = sign * np.eye(6)[index]
        most = space.acceleration(way)
        assert planned(space.question, 0.999 * most.reach * way) == "optimal"
        assert planned(space.question, 1.001 * most.reach * way) == "overloaded"


def test_torques_change_with_the_acceleration():
    # weak knees: the joints end the way, and would not if only gravity loaded them
    question = replace(with_joints(), limits=Limits(joint_torque=45.0))
    space = BodySpace(question)
    ends = {}
    for way in AXES:
        ends[tuple(way)] = most = space.acceleration(way)
        assert planned(question, 0.999 * most.reach * way) == "optimal"
        assert planned(question, 1.001 * most.reach * way) == "overloaded"
    by_joints = [end for end in ends.values() if end.limiting.limit == "joint_torque"]
    assert by_joints
    assert all(end.limiting.joint for end in by_joints)


def test_a_limb_in_the_air_ends_it_too():
    whole = with_joints()
    hands = tuple(h for h in whole.stance.hands if h.limb != "front_left")
    question = replace(whole, stance=replace(whole.stance, hands=hands))
    gravity = np.abs(posture(question).joints["front_left"].gravity)
    limits = Limits(joint_torque={"front_left": tuple(float(g) for g in gravity + 1.0)})
    question = replace(question, limits=limits)
    space = BodySpace(question)
    most = space.acceleration([0.0, 0.0, 1.0])
    assert most.limiting.limb == "front_left"
    assert most.limiting.limit == "joint_torque"
    assert planned(question, np.array([0.0, 0.0, 0.999 * most.reach])) == "optimal"
    assert planned(question, np.array([0.0, 0.0, 1.001 * most.reach])) == "overloaded"
    # and below what its own weight takes, nothing is held at all
    limits = Limits(joint_torque={"front_left": tuple(float(g) for g in 0.5 * gravity + 1e-3)})
    space = BodySpace(replace(question, limits=limits))
    assert space.plan.status == "overloaded"
    assert space.support(np.eye(6)[0]) is None


def test_accelerations_are_from_rest_whatever_is_asked_for():
    rest = space_with_joints()
    load = Load(acceleration=(0.3, -0.2, 0.4), angular_acceleration=(0.1, 0.0, -0.2))
    moving = BodySpace(replace(with_joints(), load=load))
    np.testing.assert_allclose(moving.weight, rest.needed, atol=1e-6)
    assert np.abs(moving.needed - rest.needed).max() > 10.0
    for way in np.eye(6)[[0, 2, 4]]:
        assert moving.acceleration(way).reach == pytest.approx(rest.acceleration(way).reach, 1e-5)


def test_a_plane_of_accelerations_has_the_largest_ones_on_its_rim():
    space = wall_space()
    one, two = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    polygon = space.acceleration_section(one, two)
    for angle in np.linspace(0.0, math.tau, 8):
        c, s = math.cos(angle), math.sin(angle)
        reach = space.acceleration(c * one + s * two).reach
        inside, beyond = (
            ConvexHull(corners).equations @ [reach * c, reach * s, 1.0]
            for corners in (polygon.outer, polygon.inner)
        )
        assert inside.max() <= 1e-4
        assert -1e-4 <= beyond.max() <= polygon.gap + 1e-4


def test_the_wrench_at_the_end_is_mass_times_acceleration():
    space = wall_space()
    end = space.acceleration([0.0, 0.0, 1.0])
    where = space.question.stance
    force = 80.0 * where.body.rotation.T @ (np.array([0.0, 0.0, end.reach + 9.81]))
    np.testing.assert_allclose(end.wrench[:3], force, atol=1e-3)
    np.testing.assert_allclose(end.wrench[3:], np.cross([0.0, 0.0, 0.05], force), atol=1e-3)


def test_a_given_body_wrench_has_no_mass():
    space = BodySpace(ask(on_wall(), body_wrench=wall_space().needed))
    assert not space.accelerates
    assert not space.turns
    assert space.weight is None
    with pytest.raises(InvalidInputError, match="give load"):
        space.acceleration([1.0, 0.0, 0.0])
    way = np.eye(6)[0]
    assert space.more(way).reach == pytest.approx(wall_space().more(way).reach, rel=1e-6)


def test_turning_needs_joints_and_the_robots_own_load():
    assert not wall_space().turns
    with pytest.raises(InvalidInputError, match=r"3 components .* got 6; angular .* load.com$"):
        wall_space().acceleration(np.eye(6)[4])
    with pytest.raises(InvalidInputError, match=r"3 or 6 components are needed, got 2$"):
        space_with_joints().acceleration([1.0, 0.0])
    with pytest.raises(InvalidInputError, match="not zero"):
        space_with_joints().acceleration(np.zeros(3))


# Monotone -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "limits",
    [
        Limits(utilisation=0.8),
        Limits(tendon_tension=60.0),
        Limits(per_hand={"front_left": ForceCap(250.0)}),
    ],
)
def test_stricter_limits_leave_less(limits):
    space = wall_space()
    strict = BodySpace(replace(space.question, limits=limits))
    lost = []
    for way in np.vstack([np.eye(6), -np.eye(6)]):
        for kind in ("support", "pure", "more"):
            wide, narrow = getattr(space, kind)(way), getattr(strict, kind)(way)
            if narrow is not None:
                assert narrow.reach <= wide.reach * (1.0 + 1e-6) + 1e-3
                lost.append(wide.reach - narrow.reach)
    assert max(lost) > 1.0


def test_less_gravity_leaves_the_wrenches_and_more_acceleration_against_it():
    moon = replace(wall_space().question.stance, gravity=np.array([0.0, 0.0, -1.62]))
    space = BodySpace(replace(wall_space().question, stance=moon))
    way = np.eye(6)[1]
    assert space.support(way).reach == pytest.approx(wall_space().support(way).reach, rel=1e-6)
    up = [s.acceleration([0.0, 0.0, 1.0]).reach for s in (space, wall_space())]
    # without joints the way up is the same wrench
    assert up[0] - up[1] == pytest.approx(9.81 - 1.62, rel=1e-5)


def test_where_it_all_just_holds():
    # at a cap that is the least utilisation itself, rounding does not empty the set
    question = wall_space().question
    least = wall_space().plan.utilisation
    space = BodySpace(replace(question, limits=Limits(utilisation=least)))
    assert space.plan.status == "optimal"
    assert all(space.more(way).reach >= -CAP_SLACK for way in np.vstack([np.eye(6), -np.eye(6)]))
    # more weight is more load on all of them
    assert space.more(np.eye(6)[0]).reach == pytest.approx(0.0, abs=0.1)
    assert space.acceleration([0.0, 0.0, 1.0]).reach == pytest.approx(0.0, abs=1e-2)


# Floating hands -----------------------------------------------------------------------------------


def test_floating_hands_are_linearised_where_the_plan_puts_them():
    question = Question(PAIR, body_wrench=body_wrench(PAIR, [NEAR, NEAR]))
    space = BodySpace(question)
    assert space.plan.status == "optimal"
    assert not space.exact
    ends = [space.more(way) for way in np.eye(6)]
    assert all(end.reach >= 0.0 for end in ends)
    # a little further, a plan with the exact model agrees with the linearised set
    least = min(range(6), key=lambda i: ends[i].reach)
    part = 0.2 * ends[least].reach * np.eye(6)[least]
    assert plan(replace(question, body_wrench=question.body_wrench + part)).status == "optimal"
    # what the sets are off grows with the square of the way
    rest = [hand.wrist.twist for hand in space.plan.hands]
    end = ends[least]
    near = [y + 0.1 * (far - y) for y, far in zip(rest, end.loads, strict=True)]
    assert (
        0.0
        < space.linearisation_error([end._replace(loads=tuple(near))])
        < 0.05 * space.linearisation_error([end])
    )
    assert wall_space().linearisation_error([wall_space().support(np.eye(6)[0])]) == 0.0


# What is refused ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("axes", "others", "field", "text"),
    [
        (("fx", "fq"), "needed", "axes[1]", "known are fx, fy"),
        (("fx", "fx"), "needed", "axes", "given twice"),
        (("fx",), "needed", "axes", "two axes are needed, got 1"),
        (("fx", "fz"), "some", "others", "known are needed, zero, free"),
    ],
)
def test_impossible_planes(axes, others, field, text):
    with pytest.raises(InvalidInputError, match=text) as caught:
        wall_space().section(axes, others)
    assert caught.value.field == field
