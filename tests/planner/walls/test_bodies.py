"""Bodies before a rock: where they are, and that they are clear of it."""

import numpy as np
import pytest

from hand_models.base import InvalidInputError, Pose, turns_about
from planner.robots import robosimian
from planner.walls import BodyGrid, body_poses
from tests.suite.helpers.climbing_walls import FLAT, rock_of

ROBOT = robosimian()


def distance_from_vertices(rock, pose, body):
    """Distance of the body's surface from the nearest vertex of a mesh in W [m]."""
    segments, radii = ROBOT.body_capsules
    there = body.inverse().apply(pose.apply(rock.triangles.vertices))
    found = []
    for (first, second), radius in zip(segments, radii, strict=True):
        along = second - first
        size = along @ along
        part = np.clip((there - first) @ along / size if size else 0.0 * there[:, 0], 0.0, 1.0)
        found.append(np.linalg.norm(there - first - part[:, None] * along, axis=1).min() - radius)
    return min(found)


def test_a_body_before_a_flat_wall_stands_off_as_far_as_it_says():
    rock, pose = rock_of(lean=0.6, **FLAT)
    grid = BodyGrid(spacing=0.2, margin=0.4, stand_offs=(0.35, 0.5), tilts=(-0.1, 0.2))
    found = body_poses(grid, rock, pose, ROBOT)
    # 0.7 m up and 0.5 m across in steps of 0.2 m, in the middle
    assert found.cells.max(axis=0).tolist() == [3, 2, 1, 1]
    assert len(found.poses) == 4 * 3 * 2 * 2
    assert found.in_rock == 0
    for body, (i, j, k, m) in zip(found.poses, found.cells, strict=True):
        in_rock = pose.inverse() @ body
        at = [-0.3 + 0.2 * i, 0.2 - 0.2 * j, -grid.stand_offs[k]]
        np.testing.assert_allclose(in_rock.position, at, atol=1e-9)
        # x of B up the wall, z away from it, then its front toward the rock
        tilted = np.diag([1.0, -1.0, -1.0]) @ turns_about([0.0, grid.tilts[m], 0.0])
        np.testing.assert_allclose(in_rock.rotation, tilted, atol=1e-9)
        front = in_rock.apply([1.0, 0.0, 0.0])[2] - in_rock.position[2]
        assert np.sign(front) == np.sign(grid.tilts[m])


def test_neighbours_are_one_step_apart():
    rock, pose = rock_of()
    grid = BodyGrid(spacing=0.2, margin=0.4, stand_offs=(0.4, 0.5), tilts=(0.0, 0.1))
    found = body_poses(grid, rock, pose, ROBOT)
    steps = np.abs(found.cells[found.shifts[:, 0]] - found.cells[found.shifts[:, 1]])
    assert (steps.sum(axis=1) == 1).all()
    # of a full grid of 4 × 3 × 2 × 2
    assert len(found.poses) == 48
    assert len(found.shifts) == 3 * 12 + 4 * 8 + 24 + 24
    for first, second in found.shifts:
        alike = np.allclose(found.poses[first].rotation, found.poses[second].rotation, atol=1e-12)
        same = np.allclose(found.poses[first].position, found.poses[second].position, atol=1e-12)
        assert alike != same


def test_bodies_that_touch_the_rock_are_left_out_and_no_others():
    rock, pose = rock_of(2, knob_height=[0.1, 0.15], knobs=6)
    grid = BodyGrid(spacing=0.1, margin=0.45, stand_offs=(0.22, 0.27, 0.33), clear=0.03)
    near = body_poses(grid, rock, pose, ROBOT)
    assert 0 < near.in_rock < 0.9 * (len(near.poses) + near.in_rock)
    free = [distance_from_vertices(rock, pose, body) for body in near.poses]
    assert min(free) >= 0.03
    # the others, from a grid without rock in the way
    every = body_poses(BodyGrid(**options(grid) | {"clear": 0.0}), rock, pose, ROBOT)
    others = set(map(tuple, every.cells.tolist())) - set(map(tuple, near.cells.tolist()))
    at = {tuple(cell): body for cell, body in zip(every.cells.tolist(), every.poses, strict=True)}
    assert others
    for cell in others:
        # vertices are 0.02 m apart, and so is what is nearest to a capsule; 4 mm for its samples
        assert distance_from_vertices(rock, pose, at[cell]) < 0.03 + 0.008


def options(grid):
    return {name: getattr(grid, name) for name in grid.__struct_fields__}


def test_bodies_move_with_the_rock():
    rock, pose = rock_of()
    grid = BodyGrid(margin=0.55)
    moved = Pose(np.array([3.0, -2.0, 1.0]), turns_about([0.4, -0.9, 1.3]))
    here, there = (body_poses(grid, rock, at, ROBOT) for at in (pose, moved @ pose))
    np.testing.assert_array_equal(here.shifts, there.shifts)
    for first, second in zip(here.poses, there.poses, strict=True):
        np.testing.assert_allclose((moved @ first).position, second.position, atol=1e-12)
        np.testing.assert_allclose((moved @ first).rotation, second.rotation, atol=1e-12)


def test_given_bodies_may_be_shifted_to_those_near_them():
    rock, pose = rock_of(**FLAT)
    found = body_poses(BodyGrid(spacing=0.2, margin=0.4, stand_offs=(0.4,)), rock, pose, ROBOT)
    first = found.poses[0]
    beside = Pose(first.position + np.array([0.0, 0.05, 0.0]), first.rotation)
    turned = Pose(first.position, first.rotation @ turns_about([0.0, 0.0, 0.5]))
    more = found.with_more([beside, turned], 0.24, 0.3)
    count = len(found.poses)
    assert more.poses[count:] == (beside, turned)
    new = [pair.tolist() for pair in more.shifts if pair.max() >= count]
    # 0.05 m from one of the grid and 0.2 m or 0.21 m from two; the other is turned too far
    assert sorted(new) == [[0, count], [1, count], [3, count]]
    np.testing.assert_array_equal(more.shifts[: len(found.shifts)], found.shifts)


def test_without_a_body_that_is_clear():
    rock, pose = rock_of()
    with pytest.raises(InvalidInputError, match="stand_offs: no pose of the body is clear"):
        body_poses(BodyGrid(stand_offs=(0.1,), margin=0.6), rock, pose, ROBOT)


@pytest.mark.parametrize(
    ("numbers", "said"),
    [
        ({"spacing": 0.0}, r"spacing: must be 0\.005 to 10 m, got 0"),
        ({"stand_offs": (0.3, 20.0)}, "stand_offs: must be 0 to 10 m, got 20"),
        ({"stand_offs": (0.3, 0.3)}, "stand_offs: must be at least one number, and no number twi"),
        ({"tilts": ()}, "tilts: must be at least one number"),
        ({"turn": float("nan")}, "turn: must be 0 to"),
    ],
)
def test_impossible_grids(numbers, said):
    with pytest.raises(InvalidInputError, match=said):
        BodyGrid(**numbers)
