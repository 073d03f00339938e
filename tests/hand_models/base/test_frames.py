"""Poses compose as rigid motions, and wrenches are carried so that power stays the same."""

import copy
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.spatial.transform import Rotation

from hand_models import InvalidInputError, Pose
from hand_models.base import skew, wrench_transport

seeds = st.integers(0, 2**32 - 1)


def random_pose(rng):
    quaternion = rng.normal(size=4)
    return Pose.from_quaternion(rng.normal(size=3), quaternion / np.linalg.norm(quaternion))


def rigid(pose):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = pose.rotation, pose.position
    return matrix


@pytest.mark.parametrize(
    ("quaternion", "carried"),
    [
        ([0, 0, 0, 1], [1, 2, 3]),
        ([1, 0, 0, 0], [1, -2, -3]),
        ([0, 0, math.sqrt(0.5), math.sqrt(0.5)], [-2, 1, 3]),  # 90° about z
        ([0, math.sqrt(0.5), 0, math.sqrt(0.5)], [3, 2, -1]),  # 90° about y
    ],
)
def test_quaternions_are_x_y_z_w(quaternion, carried):
    pose = Pose.from_quaternion([10, 20, 30], quaternion)
    np.testing.assert_allclose(pose.apply([1, 2, 3]), np.add(carried, [10, 20, 30]), atol=1e-12)


@pytest.mark.parametrize("norm", [1.0 - 9e-4, 1.0 + 9e-4])
def test_a_quaternion_a_little_off_its_norm_is_normalised(norm):
    direction = np.array([0.1, -0.2, 0.3, 0.9])
    direction /= np.linalg.norm(direction)
    off = Pose.from_quaternion([0, 0, 0], norm * direction)
    np.testing.assert_allclose(off.rotation @ off.rotation.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(off.quaternion(), direction, atol=1e-12)


@pytest.mark.parametrize("norm", [0.0, 1.0 - 2e-3, 1.0 + 2e-3, 1e3])
def test_a_quaternion_off_its_norm_is_refused(norm):
    with pytest.raises(
        InvalidInputError, match="the norm is .*: divide" if norm else "not turned"
    ) as caught:
        Pose.from_quaternion([0, 0, 0], norm * np.array([0.5, 0.5, 0.5, 0.5]))
    assert caught.value.field == "orientation"


@pytest.mark.parametrize(
    ("position", "orientation", "field"),
    [
        ([0, 0, math.nan], [0, 0, 0, 1], "position"),
        ([0, 0, math.inf], [0, 0, 0, 1], "position"),
        ([0, 0], [0, 0, 0, 1], "position"),
        (["a", 0, 0], [0, 0, 0, 1], "position"),
        ([0, 0, 0], [math.nan, 0, 0, 1], "orientation"),
        ([0, 0, 0], [0, 0, 1], "orientation"),
    ],
)
def test_what_is_no_pose_is_refused_by_field(position, orientation, field):
    with pytest.raises(InvalidInputError) as caught:
        Pose.from_quaternion(position, orientation)
    assert caught.value.field == field


@given(seeds)
def test_a_quaternion_and_its_negative_are_one_orientation_given_back_with_w_positive(seed):
    q = np.random.default_rng(seed).normal(size=4)
    q /= np.linalg.norm(q)
    one, other = Pose.from_quaternion(np.zeros(3), q), Pose.from_quaternion(np.zeros(3), -q)
    np.testing.assert_allclose(one.rotation, other.rotation, atol=1e-12)
    assert one.quaternion()[3] >= 0.0
    np.testing.assert_allclose(one.quaternion(), np.copysign(1.0, q[3]) * q, atol=1e-9)


@given(seeds)
def test_poses_compose_and_invert_as_homogeneous_matrices(seed):
    rng = np.random.default_rng(seed)
    a, b = random_pose(rng), random_pose(rng)
    np.testing.assert_allclose(rigid(a @ b), rigid(a) @ rigid(b), atol=1e-12)
    np.testing.assert_allclose(rigid(a.inverse()), np.linalg.inv(rigid(a)), atol=1e-12)
    points = rng.normal(size=(5, 3))
    np.testing.assert_allclose((a @ b).apply(points), a.apply(b.apply(points)), atol=1e-12)
    np.testing.assert_allclose(Pose.identity().apply(points), points)


@given(seeds)
def test_a_wrench_does_the_same_work_in_every_frame(seed):
    """The parent's origin, moved with the body, has velocity R v − ω × p, with ω turned by R."""
    rng = np.random.default_rng(seed)
    pose, wrench, velocity, spin = random_pose(rng), *np.split(rng.normal(size=12), [6, 9])
    turned = pose.rotation @ spin
    at_parent = pose.rotation @ velocity - np.cross(turned, pose.position)
    carried = wrench_transport(pose) @ wrench
    power = wrench @ np.concatenate([velocity, spin])
    assert carried @ np.concatenate([at_parent, turned]) == pytest.approx(power, abs=1e-12)


@given(seeds)
def test_transport_follows_composition(seed):
    rng = np.random.default_rng(seed)
    a, b = random_pose(rng), random_pose(rng)
    np.testing.assert_allclose(
        wrench_transport(a @ b), wrench_transport(a) @ wrench_transport(b), atol=1e-12
    )
    np.testing.assert_allclose(
        wrench_transport(a.inverse()), np.linalg.inv(wrench_transport(a)), atol=1e-12
    )


def test_a_force_off_the_origin_has_its_lever_as_moment():
    """10 N along z at 2 m along x turns about −y with 20 N·m."""
    pose = Pose(np.array([2.0, 0.0, 0.0]), np.eye(3))
    np.testing.assert_allclose(
        wrench_transport(pose) @ [0, 0, 10, 0, 0, 1], [0, 0, 10, 0, -20, 1], atol=1e-12
    )


def test_skew_is_the_cross_product():
    v, w = np.array([1.0, -2.0, 0.5]), np.array([0.3, 4.0, -1.0])
    np.testing.assert_allclose(skew(v) @ w, np.cross(v, w), atol=1e-15)


def test_orientation_agrees_with_scipys_euler_angles():
    rotation = Rotation.from_euler("xyz", [0.2, -0.4, 0.9])
    pose = Pose.from_quaternion(np.zeros(3), rotation.as_quat())
    np.testing.assert_allclose(pose.rotation, rotation.as_matrix(), atol=1e-12)


def test_quaternions_are_those_of_scipy():
    """Of small and large turns about any axis, half turns among them."""
    rng = np.random.default_rng(7)
    axes = np.vstack([np.eye(3), -np.eye(3), rng.normal(size=(200, 3))])
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    for axis in axes:
        for angle in (0.0, 1e-9, 0.3, 2.0, math.pi - 1e-6, math.pi, 4.0):
            turn = Rotation.from_rotvec(angle * axis)
            got = Pose(np.zeros(3), turn.as_matrix()).quaternion()
            assert got[3] >= 0.0
            same = Rotation.from_quat(got).inv() * turn
            assert same.magnitude() == pytest.approx(0.0, abs=1e-14)
            if abs(angle - math.pi) > 1e-9:
                np.testing.assert_allclose(got, turn.as_quat(canonical=True), atol=1e-14)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda pose: pickle.loads(pickle.dumps(pose))])
def test_nothing_is_known_of_a_pose_whose_arrays_can_be_written(copied):
    pose = Pose.from_quaternion([1.0, 2.0, 3.0], [0.0, 0.0, 0.6, 0.8])
    assert pose.proper
    with pytest.raises(ValueError, match="read-only"):
        pose.rotation[0, 0] = 5.0
    other = copied(pose)
    assert not other.proper
    np.testing.assert_array_equal(other.rotation, pose.rotation)
    assert not replace(pose, position=np.zeros(3)).proper
