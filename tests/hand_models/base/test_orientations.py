"""Quaternion, roll-pitch-yaw and axes give the same rotation; other combinations are refused."""

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.spatial.transform import Rotation

from hand_models import InvalidInputError
from hand_models.base import oriented_pose

angles = st.floats(-math.pi, math.pi)


@given(angles, angles, angles)
def test_rpy_turns_about_fixed_axes_one_after_the_other(roll, pitch, yaw):
    pose = oriented_pose([1.0, 2.0, 3.0], rpy=[roll, pitch, yaw])
    independent = Rotation.from_euler("xyz", [roll, pitch, yaw]).as_matrix()  # lower case: fixed
    np.testing.assert_allclose(pose.rotation, independent, atol=1e-12)
    assert pose.position.tolist() == [1.0, 2.0, 3.0]


def test_rpy_by_hand():
    # yaw by 90° after pitch by 90°: x goes down, and stays there; y goes to -x; z goes to y
    turned = oriented_pose([0, 0, 0], rpy=[0.0, math.pi / 2, math.pi / 2]).rotation
    np.testing.assert_allclose(turned, [[0, -1, 0], [0, 0, 1], [-1, 0, 0]], atol=1e-15)


@given(st.integers(0, 2**32 - 1))
def test_all_forms_agree(seed):
    rotation = Rotation.random(random_state=seed)
    matrix = rotation.as_matrix()
    rng = np.random.default_rng(seed)
    by_axes = oriented_pose(
        [0, 0, 0],
        x_axis=rng.uniform(0.1, 9.0) * matrix[:, 0],
        z_axis=rng.uniform(0.1, 9.0) * matrix[:, 2],
    )
    by_quaternion = oriented_pose([0, 0, 0], orientation=rotation.as_quat())
    np.testing.assert_allclose(by_axes.rotation, matrix, atol=1e-12)
    np.testing.assert_allclose(by_quaternion.rotation, matrix, atol=1e-12)


def test_axes_that_are_rounded_are_made_perpendicular_and_z_stays():
    pose = oriented_pose([0, 0, 0], x_axis=[0.707, 0.0, -0.708], z_axis=[0.708, 0.0, 0.707])
    np.testing.assert_allclose(pose.rotation.T @ pose.rotation, np.eye(3), atol=1e-14)
    z = np.array([0.708, 0.0, 0.707])
    np.testing.assert_allclose(pose.rotation[:, 2], z / np.linalg.norm(z), atol=1e-14)


@pytest.mark.parametrize(
    ("form", "field"),
    [
        ({}, "orientation"),
        ({"rpy": [0, 0, 0], "orientation": [0, 0, 0, 1]}, "rpy"),
        ({"rpy": [0, 0, 0], "x_axis": [1, 0, 0], "z_axis": [0, 0, 1]}, "x_axis"),
        ({"orientation": [0, 0, 0, 1], "z_axis": [0, 0, 1]}, "z_axis"),
        ({"x_axis": [1, 0, 0]}, "z_axis"),
        ({"z_axis": [0, 0, 1]}, "x_axis"),
        ({"x_axis": [1, 0, 0], "z_axis": [1, 0, 0]}, "z_axis"),
        ({"x_axis": [1, 0, 0], "z_axis": [1.1e-3, 0, 1]}, "z_axis"),
        ({"x_axis": [0, 0, 0], "z_axis": [0, 0, 1]}, "x_axis"),
        ({"x_axis": [math.nan, 0, 0], "z_axis": [0, 0, 1]}, "x_axis"),
        ({"rpy": [0, 0]}, "rpy"),
        ({"rpy": [0, 0, math.inf]}, "rpy"),
        ({"rpy": [180.0, 0, 0]}, "rpy"),
    ],
)
def test_what_is_refused(form, field):
    with pytest.raises(InvalidInputError) as caught:
        oriented_pose([0, 0, 0], **form)
    assert caught.value.field == field
