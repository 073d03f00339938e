"""Supports of hands in world axes: against those of the sets, and against another solver."""

import numpy as np
import pytest
import scipy

from hand_models.base import Pose, wrench_transport
from planner.prepare import prepare_stance
from planner.programs import WRENCH_UNIT
from planner.screening import HandParts, WorldHands
from service.answering import questions
from service.commands import stances
from tests.suite.helpers.walls import bundled_spaces, random_wall


def in_hand(direction, pose, about):
    moved = Pose(pose.position - about, pose.rotation)
    return -direction / WRENCH_UNIT @ wrench_transport(moved)


def test_are_those_of_the_sets():
    wall = random_wall(1, 12)
    directions = np.random.default_rng(2).normal(size=(10, 6))
    found = wall.hands.supports(directions)
    assert wall.hands.rows.shape[1] > 0  # some sets are clipped
    for row, space, pose in zip(found, wall.spaces, wall.poses, strict=True):
        expected = [space.support(in_hand(d, pose, np.zeros(3))) for d in directions]
        np.testing.assert_allclose(row, expected, rtol=1e-9, atol=1e-9)


def test_with_joint_torques_are_those_of_another_solver():
    prepared = prepare_stance(questions.question(stances.read_request("wall-300-joints")))
    poses, about = [hand.pose for hand in prepared.question.stance.hands], np.array([0.1, 0.2, 0.3])
    spaces = prepared.hands.spaces
    hands = WorldHands.of([HandParts.of(space) for space in spaces], poses, about)
    directions = np.random.default_rng(3).normal(size=(6, 6))
    found = hands.supports(directions)
    for row, space, pose in zip(found, spaces, poses, strict=True):
        for value, direction in zip(row, directions, strict=True):
            d = in_hand(direction, pose, about)
            most = scipy.optimize.linprog(
                -(d @ space.generators), A_ub=space.A, b_ub=space.b, bounds=(None, None)
            )
            assert value == pytest.approx(d @ space.origin - most.fun, rel=1e-7, abs=1e-7)


def test_hold_what_any_loads_give():
    """No wrench of a hand exceeds its support: at random loads, scaled into the set."""
    rng, wall = np.random.default_rng(4), random_wall(5, 4)
    directions = rng.normal(size=(20, 6))
    found = wall.hands.supports(directions)
    for row, space, pose in zip(found, wall.spaces, wall.poses, strict=True):
        ends = np.array([space.extreme(d) for d in rng.normal(size=(20, 6))])
        inside = rng.dirichlet(np.ones(20), size=30) @ ends
        wrenches = -inside @ wrench_transport(pose).T / WRENCH_UNIT
        assert (wrenches @ directions.T <= row + 1e-9).all()


def test_of_a_set_that_two_hands_share_differ_by_their_poses_alone():
    (space, *_), pose = bundled_spaces(), Pose.identity()
    moved = Pose(np.array([0.0, 0.3, 0.0]), np.eye(3))
    hands = WorldHands.of([HandParts.of(space)] * 2, [pose, moved], np.zeros(3))
    force, moment = np.eye(6)[0], np.eye(6)[5]
    first, second = hands.supports(np.vstack([force, moment]))
    assert first[0] == pytest.approx(second[0])
    # M_z of the moved hand is that of the other less 0.3 m F_x
    turned = moment - np.append(0.3 * WRENCH_UNIT[0] / WRENCH_UNIT[5], np.zeros(5))
    assert second[1] == pytest.approx(hands.supports(turned[None])[0, 0])
