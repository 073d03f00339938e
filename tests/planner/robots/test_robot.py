"""What the planner knows of RoboSimian, against its published model robosimian_caesar_new."""

import numpy as np
import pytest

from hand_models.base import Pose
from planner.robots import robosimian

SHOULDERS = {
    "front_right": (0.29326, -0.2094, -0.20853),
    "rear_right": (-0.29326, -0.2094, -0.20853),
    "rear_left": (-0.29326, 0.2094, -0.20853),
    "front_left": (0.29326, 0.2094, -0.20853),
}
"""Origins of the limbs' link 2 in the torso frame, limbs 1 to 4 [m]."""

LINK = np.array([0.2865, -0.117, 0.0])
LAST_LINK = np.array([0.1925, -0.117, 0.0])
"""Joints 3 and 5, and 7, in their parents [m]."""


def test_mass_is_that_of_torso_limbs_and_hands():
    torso, limb, hand = 40.0, 3 * (0.429 + 3.975) + 1.76, 2.6
    assert robosimian().mass == pytest.approx(torso + 4 * limb + 4 * hand, abs=1e-9)
    assert robosimian().mass == pytest.approx(110.288, abs=1e-9)


def test_limbs_come_in_the_order_of_the_model_with_its_shoulders():
    robot = robosimian()
    assert robot.limbs == tuple(SHOULDERS)
    for limb, shoulder in SHOULDERS.items():
        np.testing.assert_allclose(robot.chains[limb].shoulder, shoulder, atol=1e-5)


def test_centre_of_mass_is_that_of_the_zero_pose():
    np.testing.assert_allclose(robosimian().com, [0.00033, -0.00082, -0.13289], atol=1e-9)


def test_reach_is_that_of_a_stretched_limb():
    """Two segments along a line to link 6, and the last one on."""
    stretched = 2 * np.linalg.norm(LINK) + np.linalg.norm(LAST_LINK)
    assert robosimian().reach == pytest.approx(stretched, abs=1e-3)


def test_hand_is_mounted_where_the_meshes_say():
    # hand frame 87.2 mm along link 7, less 19.85 mm from it to H; palm 112.5 mm above the axis
    for mount in robosimian().description.mounts.values():
        np.testing.assert_allclose(mount.pose.position, [0.0872 - 0.01985, 0.0, 0.1125])
        np.testing.assert_array_equal(mount.pose.rotation, np.eye(3))


@pytest.mark.parametrize("limb", SHOULDERS)
@pytest.mark.parametrize("part", [0.0, 0.5, 1.0, 1.2])
def test_stretch_is_the_distance_of_the_last_link_over_the_reach(limb, part):
    robot = robosimian()
    rng = np.random.default_rng(3)
    way = rng.normal(size=3)
    link = robot.chains[limb].shoulder + part * robot.reach * way / np.linalg.norm(way)
    turn = Pose.from_quaternion([0.0, 0.0, 0.0], [0.5, -0.5, 0.5, 0.5]).rotation
    hand = Pose(link, turn) @ robot.description.mounts[limb].pose
    (stretch,) = robot.stretches(Pose.identity(), [limb], [hand])
    assert stretch == pytest.approx(part, abs=1e-9)


def test_the_hand_on_every_limb_is_the_spinyhand():
    hand = robosimian().hand
    assert hand.mass == 2.6
    assert hand.maximum_tension == 700.0
