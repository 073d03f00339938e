"""Joint angles of a climb chosen together: loads, clearances and ways on holds, computed anew."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from planner import Question, Stance, plan
from planner.climbs import ClimbStep, MoveChecks
from planner.climbs.holds import Stay, holds_of
from planner.climbs.postures import PostureChoice, Postures
from planner.climbs.settings import PostureSettings
from planner.motion import CollisionScene, JointSpace, check_way
from planner.programs import WRENCH_UNIT
from planner.question import Limits
from planner.robots import scene_number
from planner.search import State
from tests.suite.helpers.knob_walls import knob_wall

START, RAISED = (0, 2, 4, 6), (0, 2, 4, 7)


def climb():
    """A move, a shift, and another move."""
    return [
        State(1, START),
        State(1, (0, 2, 4, -1)),
        State(1, RAISED),
        State(4, RAISED),
        State(4, (-1, 2, 4, 7)),
        State(4, (1, 2, 4, 7)),
    ]


@cache
def checks():
    return MoveChecks(knob_wall())


@cache
def chosen():
    return Postures(checks()).choose(ClimbStep.each(climb()))


def joints_of(state, k=0):
    """Joint angles of the reach table by limb, of those on the rock."""
    wall = knob_wall()
    on = [(i, p) for i, p in enumerate(state.members) if p >= 0]
    return {i: wall.reach.branches(p, state.body, i)[k] for i, p in on}


def question(state, **limits):
    """The plan of a state at the table's joint angles, with the limb in the air at rest."""
    wall = knob_wall()
    limbs, joints = wall.robot.limbs, joints_of(state)
    named = {limbs[i]: angles for i, angles in joints.items()}
    hands = tuple(replace(wall.places[state.members[i]], limb=limbs[i]) for i in joints)
    whole = {limb: named.get(limb, wall.robot.chains[limb].rest) for limb in limbs}
    stance = Stance(hands, wall.bodies[state.body], robot=wall.robot, joints=whole)
    return Question(stance, limits=Limits(**limits))


@pytest.mark.parametrize("state", [State(1, START), State(1, (0, 2, 4, -1))])
def test_joint_loads_of_a_plans_wrenches_are_its_joint_torques(state):
    wall, programs = knob_wall(), checks().programs
    found = plan(question(state))
    assert found.status == "optimal"
    by_limb = {hand.limb: hand for hand in found.hands}
    for i, angles in joints_of(state).items():
        limb, place = wall.robot.limbs[i], state.members[i]
        loads = programs.loads(i, place, state.body, angles)
        hand = wall.places[place].pose
        force, moment = np.split(np.array(by_limb[limb].wrench), 2)
        # on the robot, in the axes of W about the hands' point
        push, arm = -hand.rotation @ force, hand.position - wall.screening.hands.about
        turn = -hand.rotation @ moment + np.cross(arm, push)
        share = loads.still + loads.hand @ (np.array([*push, *turn]) / WRENCH_UNIT)
        most = wall.robot.chains[limb].torque_limits
        np.testing.assert_allclose(
            share * most[most > 0], np.array(found.joint_torque[limb])[most > 0], atol=1e-6
        )


@pytest.mark.parametrize("state", [State(1, START), State(1, (0, 2, 4, -1))])
def test_the_share_of_torque_limits_is_the_least_with_which_a_plan_exists(state):
    wall, programs = knob_wall(), checks().programs
    loads = {
        i: programs.loads(i, state.members[i], state.body, angles)
        for i, angles in joints_of(state).items()
    }
    share = programs.share(state, loads)
    assert 0.0 < share < 1.0

    def feasible(part):
        limits = {
            limb: (part * share * chain.torque_limits).tolist()
            for limb, chain in wall.robot.chains.items()
        }
        return plan(question(state, joint_torque=limits)).status == "optimal"

    assert feasible(1.001)
    assert not feasible(0.999)


@pytest.mark.parametrize("state", [State(1, START), State(1, (0, 2, 4, -1))])
def test_joints_bear_as_many_times_the_weight_as_the_plans_load_factor(state):
    wall = knob_wall()
    own = checks().programs
    loads = {
        i: own.loads(i, state.members[i], state.body, angles)
        for i, angles in joints_of(state).items()
    }
    # so little torque that it limits the load factor
    part = 1.2 * own.share(state, loads)
    torque = {
        limb: (part * chain.torque_limits).tolist() for limb, chain in wall.robot.chains.items()
    }
    found = plan(replace(question(state, joint_torque=torque), want=frozenset(["load_factor"])))
    factor = found.load_factor
    assert 1.0 < factor < 1.3
    assert own.share(state, loads, multiple=0.999 * factor) < part
    assert own.share(state, loads, multiple=1.001 * factor) > part


@settings(max_examples=20, deadline=None)
@given(multiple=st.floats(1.0, 3.0), members=st.sampled_from([START, (0, 2, 4, -1), (1, 3, -1, 6)]))
def test_what_bears_a_multiple_of_the_weight_bears_the_weight(multiple, members):
    state = State(1, members)
    more = checks().bearing(multiple)
    if more.borne(state):
        assert checks().borne(state)
    # and nothing is taken over from one to the other
    assert checks().bearing(1.0).passes(state, state) == checks().passes(state, state)
    assert checks().multiple == 1.0


def test_the_weight_of_a_limb_in_the_air_needs_the_moment_of_the_reach_table():
    wall, state = knob_wall(), State(1, START)
    for i, angles in joints_of(state).items():
        np.testing.assert_allclose(
            checks().programs.moment(i, state.body, angles),
            wall.screening.moments[state.body, i, state.members[i]],
            atol=1e-12,
        )


def scene():
    """The robot without rock."""
    return CollisionScene(knob_wall().robot, [])


def test_limbs_are_apart_where_no_capsules_of_theirs_are_nearer_than_the_margin():
    robot, rng = knob_wall().robot, np.random.default_rng(3)
    names = robot.limbs
    chains = [robot.chains[names[i]] for i in (0, 1)]
    first, second = (rng.uniform(-np.pi, np.pi, (6, len(c.lower))) for c in chains)
    for swings, name in ((False, "margin_at_hold"), (True, "margin")):
        found = checks().clearances.apart((0, 1), first, second, swings=swings)
        assert 0 < found.sum() < found.size
        whole = scene()
        inside = [set(whole.own[names[i]].tolist()) for i in (0, 1)]
        for k, one in enumerate(first):
            for m, two in enumerate(second):
                placed = whole.placed({names[0]: one, names[1]: two})
                least = min(
                    segments_apart(placed[i], placed[j]) - whole.radii[i] - whole.radii[j]
                    for i, j in whole.pairs.tolist()
                    if (i in inside[0] and j in inside[1]) or (i in inside[1] and j in inside[0])
                )
                margin = scene_number("motion", name)
                assert abs(least - margin) < 1e-9 or found[k, m] == (least >= margin)


def segments_apart(one, two):
    """Distance of two segments (2, 3): of their ends from the other one, or where they cross."""

    def from_point(p, a, b):
        d = b - a
        t = np.clip((p - a) @ d / max(d @ d, 1e-30), 0.0, 1.0)
        return float(np.linalg.norm(p - a - t * d))

    ends = [from_point(p, *two) for p in one] + [from_point(p, *one) for p in two]
    u, v, w = one[1] - one[0], two[1] - two[0], one[0] - two[0]
    matrix = np.array([[u @ u, -u @ v], [u @ v, -v @ v]])
    if abs(np.linalg.det(matrix)) > 1e-12:
        s, t = np.linalg.solve(matrix, [-(w @ u), -(w @ v)])
        if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0:
            ends.append(float(np.linalg.norm(w + s * u - t * v)))
    return min(ends)


def test_ways_keep_the_hand_on_its_hold_at_every_pose_of_the_body():
    wall, ways = knob_wall(), checks().ways
    stay = Stay(1, 2, (1, 4, 7), lifts=True)
    path, at = ways.path(stay)
    assert [path[k] for k in at] == [wall.bodies[b] for b in stay.bodies]
    step = PostureSettings().step
    assert all(np.linalg.norm(b.position - a.position) <= step for a, b in pairwise(path))
    found = ways.of(stay)
    assert found
    name, hand = wall.robot.limbs[1], wall.places[2].pose
    for way in found:
        assert len(way) == len(path)
        for body, angles in zip(path, way, strict=True):
            there = body @ wall.robot.hand_poses({name: angles})[name]
            np.testing.assert_allclose(there.position, hand.position, atol=1e-6)
            np.testing.assert_allclose(there.rotation, hand.rotation, atol=1e-6)


def test_the_way_back_from_a_hold_is_straight():
    wall, ways = knob_wall(), checks().ways
    stay = Stay(1, 2, (1, 4), lifts=True)
    name, hand, body = wall.robot.limbs[1], wall.places[2].pose, wall.bodies[4]
    for way, off in zip(ways.of(stay), ways.off(stay, -1), strict=True):
        np.testing.assert_array_equal(off[0], way[-1])
        for angles in off:
            there = body @ wall.robot.hand_poses({name: angles})[name]
            along = hand.rotation.T @ (there.position - hand.position)
            np.testing.assert_allclose(along[:2], 0.0, atol=1e-6)
        assert along[2] == pytest.approx(-scene_number("motion", "stand_off"))


def test_states_of_a_move_know_where_the_limb_in_the_air_is():
    holds, held = holds_of(ClimbStep.each(climb()))
    assert [(stay.limb, stay.place) for stay in holds[4:]] == [(3, 7), (0, 1)]
    assert [(each.phase, each.air) for each in held] == [
        ("start", ()),
        ("unload", (3,)),
        ("swing", (3, 4)),
        ("close", (4,)),
        ("load", ()),
        ("shift", ()),
        ("unload", (0,)),
        ("swing", (0, 5)),
        ("close", (5,)),
        ("load", ()),
    ]


def test_chosen_postures_keep_limbs_apart_and_reach_their_holds():
    wall, found = knob_wall(), chosen()
    assert isinstance(found, PostureChoice)
    robot = wall.robot
    for state, k in ((climb()[0], 0), (climb()[2], 1)):
        joints = dict(found.start)
        if k:
            joints[robot.limbs[3]] = found.placed[0]
        body = wall.bodies[state.body]
        for i, place in enumerate(state.members):
            there = (
                body @ robot.hand_poses({robot.limbs[i]: joints[robot.limbs[i]]})[robot.limbs[i]]
            )
            np.testing.assert_allclose(there.position, wall.places[place].pose.position, atol=1e-6)
        space = JointSpace(scene(), [body], joints, robot.limbs, touching=robot.limbs)
        pairs = space.clearances(space.start[None])[0][: len(scene().pairs)]
        assert pairs.min() >= scene_number("motion", "margin_at_hold")


def test_straight_ways_off_holds_are_clear_of_the_other_limbs_by_proof():
    wall, found, robot = knob_wall(), chosen(), knob_wall().robot
    body, limb = wall.bodies[1], robot.limbs[3]
    stay = Stay(3, 6, (1,), lifts=True)
    ways, offs = checks().ways.of(stay), checks().ways.off(stay, -1)
    k = next(k for k, way in enumerate(ways) if np.allclose(way[0], found.start[limb]))
    space = JointSpace(scene(), [body], found.start, (limb,), touching=robot.limbs)
    margin = scene_number("motion", "margin_at_hold")
    assert check_way(space, offs[k], margin).clear


def test_no_postures_are_chosen_within_a_share_of_torques_that_joints_do_not_keep():
    failed = Postures(MoveChecks(knob_wall(), settings=PostureSettings(torque_share=0.05))).choose(
        ClimbStep.each(climb())
    )
    assert [(each.move, each.phase) for each in failed] == [(0, "start")]
    assert "of their limits" in failed[0].reason
