"""One branch of inverse kinematics kept along a path, held against Pinocchio's kinematics."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hand_models.base import Pose, turns_about
from planner import deadline
from planner.deadline import DeadlineError
from planner.motion import (
    MOTION_SETTINGS,
    BranchEndError,
    branches,
    follow_poses,
    pose_between,
    shift_postures,
)
from planner.robots import RobotFile, robot_of
from tests.planner.robots.test_coupled_joints import random_angles, random_arms
from tests.suite.helpers.crawlers import crawler_in
from tests.suite.helpers.robots import TWO_LINK, limbs_toml
from tests.suite.helpers.stances_with_joints import two_link_robot
from tests.suite.helpers.swings import BODY, ROBOT, palm, posture

LIMB = "front_left"
seeds = st.integers(0, 2**32 - 1)


def hand_at(angles, limb=LIMB, robot=ROBOT):
    return robot.hand_poses({limb: angles})[limb]


def off(first: Pose, second: Pose) -> float:
    return max(
        np.abs(first.position - second.position).max(),
        np.abs(first.rotation - second.rotation).max(),
    )


def straight(start: Pose, end: Pose, count: int):
    return [pose_between(start, end, part) for part in np.linspace(0.0, 1.0, count + 1)[1:]]


def small_way(rng, angles, far=0.1):
    here = hand_at(angles)
    there = Pose(
        here.position + rng.uniform(-far, far, 3),
        here.rotation @ turns_about(rng.normal(0, 0.1, 3)),
    )
    return here, there


@given(seeds)
@settings(max_examples=30, deadline=None)
def test_every_pose_is_reached_within_limits_without_leaps(seed):
    rng = np.random.default_rng(seed)
    start = posture()[LIMB] + rng.uniform(-0.3, 0.3, 7)
    path = straight(*small_way(rng, start), 12)
    found = follow_poses(ROBOT, LIMB, start, path)
    assert max(off(hand_at(angles), pose) for angles, pose in zip(found, path, strict=True)) < 1e-9
    chain = ROBOT.chains[LIMB]
    assert ((found >= chain.lower) & (found <= chain.upper)).all()
    assert np.abs(np.diff(np.vstack([start, found]), axis=0)).max() <= MOTION_SETTINGS.largest_step
    # a path that is looked at less often ends on the same branch, about where it did
    few = follow_poses(ROBOT, LIMB, start, path[2::3])
    assert few[-1] == pytest.approx(found[-1], abs=0.05)


@given(seeds)
@settings(max_examples=10, deadline=None)
def test_the_limb_on_the_other_side_follows_the_turned_path_alike(seed):
    """Front left and rear right are alike after half a turn about z of B."""
    rng, turn = np.random.default_rng(seed), np.diag([-1.0, -1.0, 1.0])
    start = posture()[LIMB] + rng.uniform(-0.2, 0.2, 7)
    path = straight(*small_way(rng, start), 6)
    turned = [Pose(turn @ pose.position, turn @ pose.rotation) for pose in path]
    ours = follow_poses(ROBOT, LIMB, start, path)
    theirs = follow_poses(ROBOT, "rear_right", start, turned)
    assert theirs == pytest.approx(ours, abs=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_joints_that_slide_or_follow_keep_the_hand_on_its_path(seed):
    robot, rng = random_arms(seed)[0], np.random.default_rng(seed)
    limb, angles = robot.limbs[0], random_angles(robot, rng)
    before, path = angles[limb], []
    for _ in range(8):
        chain = robot.chains[limb]
        before = np.clip(before + rng.normal(0.0, 0.02, len(before)), chain.lower, chain.upper)
        path.append(hand_at(before, limb, robot))
    # five joints reach few poses, but these
    found = follow_poses(robot, limb, angles[limb], path)
    for each, pose in zip(found, path, strict=True):
        assert off(hand_at(each, limb, robot), pose) < 1e-9


def test_a_redundant_limb_keeps_off_its_limits():
    """Back and forth a limb that starts near a limit gets away from it, its hand as asked."""
    chain, start = ROBOT.chains[LIMB], posture()[LIMB]
    near = next(
        angles
        for angles in branches(ROBOT, LIMB, hand_at(start), count=40)
        if 0.05 < np.minimum(chain.upper - angles, angles - chain.lower).min() < 0.5
    )
    here = hand_at(near)
    there = Pose(here.position - 0.05 * here.rotation[:, 2], here.rotation)
    path = (straight(here, there, 4) + straight(there, here, 4)) * 5
    found = follow_poses(ROBOT, LIMB, near, path)
    room = np.minimum(chain.upper - found, found - chain.lower).min(axis=1)
    assert room[-1] > np.minimum(chain.upper - near, near - chain.lower).min() + 0.1
    assert off(hand_at(found[-1]), here) < 1e-9


def test_the_end_of_a_branch_is_where_the_limb_is_stretched():
    """A limb that can stretch 0.844 m cannot be followed farther."""
    start, chain = posture()[LIMB], ROBOT.chains[LIMB]
    here = hand_at(start)
    out = here.position - chain.shoulder
    there = Pose(here.position + out / np.linalg.norm(out), here.rotation)
    with pytest.raises(BranchEndError, match=r"front_left .* stretched or folded") as caught:
        follow_poses(ROBOT, LIMB, start, straight(here, there, 20))
    reached = here.position + caught.value.share * (there.position - here.position)
    # the hand is 0.13 m from the link that carries it
    assert 0.6 < np.linalg.norm(reached - chain.shoulder) < chain.reach + 0.14
    # as far as that it can be followed
    before = pose_between(here, there, 0.98 * caught.value.share)
    assert len(follow_poses(ROBOT, LIMB, start, straight(here, before, 20))) == 20


def test_the_end_of_a_branch_names_the_joint_at_its_limit():
    """A hip that turns by ±2.5 rad, and a path that only a hip of 9 rad can follow."""
    robot = two_link_robot()
    text = TWO_LINK.replace('lower="-2.5"', 'lower="-9"').replace('upper="2.5"', 'upper="9"')
    beyond = robot_of(RobotFile("arm", limbs_toml("arm", {"leg": "foot"}), text))
    turned = [np.array([angle, 0.4]) for angle in np.linspace(2.3, 2.7, 9)]
    path = [hand_at(angles, "leg", beyond) for angles in turned]
    with pytest.raises(BranchEndError, match=r"^leg .* hip is at its limit of 2.5 rad") as caught:
        follow_poses(robot, "leg", turned[0], path)
    assert caught.value.share == pytest.approx(5.0 / 9.0)  # 2.3 to 2.5 rad
    assert follow_poses(beyond, "leg", turned[0], path) == pytest.approx(np.array(turned))


def test_a_limb_of_three_joints_says_how_few_they_are(tmp_path):
    """Its hand moves in a plane that yaws; along the first joint's axis alone it cannot go."""
    robot, limb = crawler_in(tmp_path), "limb03"
    angles = np.array([0.1, 0.6, -0.6])
    here = hand_at(angles, limb, robot)
    up = Pose(here.position + np.array([0.0, 0.0, 0.05]), here.rotation)
    few = r"a limb of 3 joints moves its hand in 3 of 6 ways only, 50 mm .*; choose another path$"
    with pytest.raises(BranchEndError, match=few) as caught:
        follow_poses(robot, limb, angles, [up])
    assert caught.value.few_joints
    with pytest.raises(BranchEndError, match=r"3 of 6 .*; shift the body less or elsewhere$"):
        shift_postures(robot, {limb: here}, [up], {limb: angles})
    # turned about the first joint's axis beyond its limit: what stops it is the limit
    chain = robot.chains[limb]
    last = np.array([chain.upper[0] - 0.05, 0.6, -0.6])
    there = hand_at(last, limb, robot)
    turns = [turns_about([0.0, 0.0, 0.01 * k]) for k in range(1, 11)]
    beyond = [
        Pose(chain.shoulder + turn @ (there.position - chain.shoulder), turn @ there.rotation)
        for turn in turns
    ]
    with pytest.raises(BranchEndError, match=rf"{limb}_yaw is at its limit") as caught:
        follow_poses(robot, limb, last, beyond)
    assert caught.value.share == pytest.approx(0.5)
    assert not caught.value.few_joints


def test_hands_stay_while_the_body_shifts():
    hands = {limb: BODY @ hand_at(angles, limb) for limb, angles in posture().items()}
    there = Pose(
        BODY.position + np.array([0.02, 0.05, 0.08]), BODY.rotation @ turns_about([0.05, 0.0, 0.1])
    )
    bodies = straight(BODY, there, 8)
    found = shift_postures(ROBOT, hands, bodies, posture())
    for i, body in enumerate(bodies):
        poses = ROBOT.hand_poses({limb: angles[i] for limb, angles in found.items()})
        for limb, hand in hands.items():
            assert off(body @ poses[limb], hand) < 1e-9


def test_a_shift_that_is_too_far_says_how_far_the_limb_goes():
    hands = {LIMB: BODY @ hand_at(posture()[LIMB])}
    far = Pose(BODY.position - np.array([0.0, 0.0, 1.0]), BODY.rotation)
    with pytest.raises(
        BranchEndError, match=r"keep its hold beyond .* of the body's shift"
    ) as caught:
        shift_postures(ROBOT, hands, [far], posture())
    assert caught.value.shifts
    # the hand does not turn, so no angle is told
    assert "e-" not in str(caught.value)
    assert " rad from" not in str(caught.value)


def test_branches_are_solutions_of_different_kinds_the_nearest_first():
    pose = BODY.inverse() @ palm(0.6, 0.4)
    near = posture()[LIMB] + 0.1
    found = branches(ROBOT, LIMB, pose, near, count=12)
    assert len(found) > 4
    assert all(off(hand_at(angles), pose) < 1e-9 for angles in found)
    away = [np.abs(angles - near).max() for angles in found]
    assert away == sorted(away)
    for i, one in enumerate(found):
        for other in found[:i]:
            assert np.abs(one - other).max() > MOTION_SETTINGS.alike
    again = branches(ROBOT, LIMB, pose, near, count=12)
    assert np.array_equal(again, found)


def test_no_solution_is_none():
    far = Pose(np.array([3.0, 0.0, 0.0]), np.eye(3))
    assert branches(ROBOT, LIMB, far) == ()


def test_a_deadline_ends_the_way():
    start = posture()[LIMB]
    with deadline.within(0.0), pytest.raises(DeadlineError):
        follow_poses(ROBOT, LIMB, start, [hand_at(start)])
