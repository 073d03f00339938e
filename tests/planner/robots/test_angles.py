"""Angles that no joints can have are refused, in Python as in a request."""

import json

import msgspec
import numpy as np
import pytest

from hand_models.base import InvalidInputError
from planner.prepare import posture
from planner.robots import RobotFile, robosimian, robot_of
from service.answering.questions import question
from service.commands.stances import read_request
from service.requests import PlanRequest
from service.wire import decode_request
from tests.suite.helpers.robots import joint, limbs_toml, link, urdf

GOOD = [0.3, -0.9, 0.5, 1.2, 0.0, 0.4, 0.0]

WRONG = [
    ({"front_right": [0.0] * 6}, "front_right", "expected 7 numbers, got 6"),
    ({"front_right": [0.0] * 8}, "front_right", "expected 7 numbers, got 8"),
    ({"front_right": []}, "front_right", "7"),
    ({"nobody": [0.0] * 7}, "nobody", "unknown limb; known are front_right"),
    ({"Front_Right": [0.0] * 7}, "Front_Right", "unknown limb"),
    ({"front_right": [9.0] * 7}, "front_right[0]", "limb1_joint1 goes from -3.1415 to 3.1415 rad"),
    ({"front_right": [0.0] * 6 + [-9.0]}, "front_right[6]", "limb1_joint7 goes from"),
    ({"rear_left": [0.0, 3.15] + [0.0] * 5}, "rear_left[1]", "limb3_joint2 goes from"),
    ({"front_right": [float("nan")] * 7}, "front_right", "finite"),
    ({"front_right": [float("inf")] + [0.0] * 6}, "front_right", "finite"),
    ({"front_right": [[0.0] * 7]}, "front_right", "7 numbers"),
    ({"front_right": GOOD, "front_left": [57.3] * 7}, "front_left[0]", "got 57.3"),
]


@pytest.mark.parametrize("name", ["hand_poses", "jacobians", "com_at"])
def test_angles_that_cannot_be_are_refused(name):
    for angles, field, words in WRONG:
        with pytest.raises(InvalidInputError) as caught:
            getattr(robosimian(), name)(angles)
        assert caught.value.field == field
        assert words in caught.value.message


# what is no number, and no list of numbers, is refused when it is decoded
LISTS = [
    (angles, field) for angles, field, words in WRONG if words not in ("finite", "7 numbers", "7")
]


def test_a_request_refuses_the_same():
    request = json.loads(msgspec.json.encode(read_request("wall-300-joints")))
    for angles, field in LISTS:
        request["stance"]["joints"] = dict.fromkeys(robosimian().limbs, GOOD) | angles
        with pytest.raises(InvalidInputError) as caught:
            posture(question(decode_request(json.dumps(request).encode(), PlanRequest)))
        assert caught.value.field == f"stance.joints.{field}"


def test_lists_do_as_arrays_do():
    robot = robosimian()
    for limb, pose in robot.hand_poses({"rear_left": GOOD}).items():
        other = robot.hand_poses({"rear_left": np.array(GOOD)})[limb]
        np.testing.assert_array_equal(pose.position, other.position)
    # seven digits of a limit are the limit
    robot.hand_poses({"rear_left": [3.1415005, *GOOD[1:]]})


def test_a_joint_that_slides_has_a_range_in_metres():
    parts = (
        link("trunk", 5.0),
        joint("lift", "prismatic", "trunk", "mast", "0 0 0.2", "0 0 1", "0.1 0.4"),
        link("mast", 1.0),
    )
    crane = robot_of(RobotFile("crane", limbs_toml("crane", {"arm": "mast"}), urdf(*parts)))
    with pytest.raises(InvalidInputError, match=r"lift goes from 0.1 to 0.4 m, got 0"):
        crane.hand_poses({"arm": [0.0]})
    # left out, it is at the limit that is nearest to zero
    assert crane.hand_poses({})["arm"].position[2] == pytest.approx(0.3)
