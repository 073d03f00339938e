"""Where triangles end, and how near that is to fingers in whose planes they do."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import strategies as st

from hand_models import Cylinder, Grasp, Plane, Pose
from hand_models.rock import Mesh
from hand_models.rock.triangles import bridge, cut
from planner.explanation import warnings
from planner.explanation.stance_warnings import _apart
from planner.prepare import HandBatch
from planner.prepare.settled_stance import settle_stance
from tests.suite.helpers.hands import HAND, ROCK
from tests.suite.helpers.rocks import height_map, random_axes, random_mesh
from tests.suite.helpers.shares import given_some
from tests.suite.helpers.stances import on_wall

seeds = st.integers(0, 2**32 - 1)
OFF = Pose(np.array([0.0, 0.0, 0.004]), np.eye(3))


def wall(count: int, without: tuple[float, float, float] | None = None) -> Mesh:
    """A flat wall of cells of 4 mm, ``without`` a square about (x, y) of half a side."""
    vertices, faces = height_map(np.zeros((count, count)), 4e-3)
    if without is not None:
        middle, half = np.array(without[:2]), without[2]
        away = np.abs(vertices[faces].mean(axis=1)[:, :2] - middle).max(axis=1)
        faces = faces[away > half]
    return Mesh(vertices, faces)


@given_some(12, 100, seeds)
def test_a_closed_mesh_has_no_border(seed):
    assert random_mesh(np.random.default_rng(seed)).border.shape == (0, 2, 3)


def test_the_border_of_a_wall_is_its_outline_and_that_of_wide_holes():
    assert len(wall(20).border) == 4 * 19
    assert len(wall(20, (0.0, 0.0, 0.0019)).border) == 4 * 19
    assert len(wall(20, (0.0, 0.0, 0.0061)).border) == 4 * 19 + 4 * 3


def test_the_outline_is_the_border_without_holes():
    whole, holed = wall(20), wall(20, (0.0, 0.0, 0.0061))
    np.testing.assert_array_equal(whole.outline, whole.border)
    assert len(holed.outline) == 4 * 19
    assert np.abs(holed.outline).max(axis=2).min() == pytest.approx(np.abs(whole.border).max())
    # each part of the surface has an outline
    two = [wall(20), wall(12, (0.0, 0.0, 0.0061))]
    vertices = np.concatenate([two[0].triangles.vertices, two[1].triangles.vertices + 1.0])
    faces = [two[0].triangles.faces, two[1].triangles.faces + len(two[0].triangles.vertices)]
    both = Mesh(vertices, np.concatenate(faces))
    assert len(both.border) == 4 * 19 + 4 * 11 + 4 * 3
    assert len(both.outline) == 4 * 19 + 4 * 11


@given_some(5, 60, seeds)
def test_rock_ends_where_a_fingers_cut_does(seed):
    rng = np.random.default_rng(seed)
    hold = wall(60, (*rng.uniform(-0.1, 0.1, 2), rng.uniform(0.006, 0.02)))
    place = Pose(np.array([*rng.uniform(-0.05, 0.05, 2), 0.004]), random_axes(rng, 0.0))
    grasp = Grasp(rng.uniform(0.0, math.pi))
    hand = replace(HAND.settle(Plane(), ROCK, grasp, place), hold=hold)
    there = hand.seating.pose.inverse()
    for frame, found in zip(HAND.frames(hand.grasp.outer_rotation), hand.rock_ends, strict=True):
        plane = there.apply(frame.joint), there.rotation @ frame.along, there.rotation[:, 2]
        pieces = bridge(cut(hold.triangles, *plane, 1.0), 1e-9)
        ends = [end for each in pieces for end in each[[0, -1]]]
        assert found == pytest.approx(np.linalg.norm(ends, axis=1).min(), rel=1e-9)


def test_rock_without_a_border_does_not_end():
    assert HAND.settle(Cylinder(0.3), ROCK).rock_ends == (math.inf,) * 4
    beside = wall(121)
    assert min(HAND.settle(beside, ROCK, Grasp(), OFF).rock_ends) > 0.15


@pytest.mark.parametrize(
    ("hold", "ends"),
    [
        (wall(121), False),
        (wall(121, (0.1, 0.0, 0.003)), False),
        (wall(121, (0.1, 0.0, 0.03)), True),
        (wall(121, (-0.2, 0.0, 0.03)), False),
        (wall(51), True),
    ],
)
def test_a_plan_warns_of_rock_that_ends_within_a_fingers_reach(hold, ends):
    stance = on_wall(hold, outer_rotation=0.0)
    told = [w for w in warnings(stance, HandBatch.of(settle_stance(stance))) if "rock ends" in w]
    assert len(told) == ends * len(stance.hands)
    for words, place in zip(told, stance.hands, strict=False):
        assert words.startswith(f"{place.limb}: its rock ends 0.")
        end, reach = map(float, re.findall(r"([0-9.]+) m", words)[:2])
        assert end < reach


def test_a_warning_of_rock_that_ends_has_digits_that_tell_it_from_the_reach():
    assert _apart(0.131, 0.134) == ("0.131", "0.134")
    assert _apart(0.11, 0.134) == ("0.11", "0.13")
    assert _apart(0.1339999, 0.134) == ("0.1339999", "0.134")
