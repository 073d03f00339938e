"""The paper's own wrench space, Eq. 16: tensions alone, each up to f_t(max)."""

import itertools
import math

import numpy as np
import pytest

from hand_models import Cylinder, EmptySetError, Grasp, Surface, tension_limits
from hand_models.fixed_wrist import wrench_space
from hand_models.fixed_wrist.tension_box import parallelepiped
from tests.suite.helpers.hands import HAND, ROCK, pinch, without_hand_load


def test_its_vertices_are_the_sums_of_each_finger_at_its_least_and_its_largest_tension():
    settled = pinch()
    space = parallelepiped(settled)
    largest = [limit.tension for limit in tension_limits(settled)]
    friction = settled.surface.friction
    least = []
    for i in range(4):
        own = (settled.finger_of == i) & settled.touching
        pressed = own & np.array([tile.phalanx != "base" for tile in settled.tiles])
        drags = settled.loads[pressed, 0] + friction * settled.loads[pressed, 1]
        least.append(max(-drag[0] / drag[1] for drag in drags))
    corners = np.array(
        [space.wrench(choice) for choice in itertools.product(*zip(least, largest, strict=True))]
    )
    vertices = space.vertices()
    assert len(vertices) == 16
    gaps = np.abs(corners[:, None, :] - vertices[None, :, :]).max(axis=2)
    assert gaps.min(axis=0).max() < 1e-6
    assert gaps.min(axis=1).max() < 1e-6


def test_its_limits_are_named_after_the_phalanx_that_lets_go_first():
    settled = pinch()
    rows = parallelepiped(settled).rows[:4]
    first = [limit.phalanx for limit in tension_limits(settled)]
    assert [row.phalanx for row in rows] == first
    assert {row.limit for row in rows} == {"f_t_max"}


def test_many_half_planes_without_palm_and_lateral_come_close_to_it_from_inside():
    fine = Surface.from_values({"shear_limit": 63.0, "half_planes": 32})
    grasp = Grasp(outer_rotation=math.pi, palm=False, lateral=False)
    settled = HAND.settle(Cylinder(0.3), fine, grasp)
    outer, inner = parallelepiped(settled), without_hand_load(wrench_space(settled))
    for direction in np.random.default_rng(3).normal(size=(50, 6)):
        most, less = outer.support(direction), inner.support(direction)
        assert less <= most + 1e-6
        assert most - less <= 0.01 * (outer.support(direction) + outer.support(-direction))


def test_a_tendon_that_no_tile_stops_is_stopped_by_its_own_maximum():
    strong = Surface.from_values({"shear_limit": 1e5})
    space = parallelepiped(pinch(surface=strong))
    assert {row.limit for row in space.rows[:4]} == {"tendon_tension"}
    np.testing.assert_array_equal(space.s, HAND.maximum_tension)


def test_a_surface_that_holds_nothing_leaves_nothing():
    weak = Surface.from_values({"shear_limit": 0.01})
    with pytest.raises(EmptySetError):
        parallelepiped(pinch(surface=weak)).vertices()


def test_the_rows_it_keeps_are_the_tensions_hard_rows():
    settled = HAND.settle(Cylinder(0.3), ROCK, Grasp())
    kept = parallelepiped(settled).rows[4:]
    assert {row.limit for row in kept} == {"slack_tendon", "dragged_backwards"}
