"""Limits of a gripper's hull, and what closing alone does to it."""

import itertools

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.spatial import ConvexHull

from hand_models import InvalidInputError
from hand_models.base import EmptySetError
from hand_models.compliance import Gripper, gripper_table
from hand_models.experiments import (
    Axis,
    Conditions,
    HullPoints,
    clipped_vertices,
    limit,
    rest_state,
    section,
    sharpened,
    sweep_cell,
    volume,
)
from hand_models.experiments.force_limits import unloaded_pose
from hand_models.parameters import experiment_table
from hand_models.tile import Surface

RATIO = 50.0
BOX = np.array(list(itertools.product((-10.0, 10.0), (-5.0, 8.0), (-0.1, 0.1))))
"""|F_x| ≤ 10 N, −5 N ≤ F_z ≤ 8 N, |M_y| ≤ 0.1 N·m."""


@pytest.fixture(scope="module")
def grasp():
    return Conditions(0.3, 46.0, "concrete-fine").gripper(gripper_table())


@pytest.fixture(scope="module")
def points(grasp):
    return HullPoints.explored(grasp, 150)


def radius(i, value):
    """The gripper's table with another radius of a pulley."""
    return Axis("finger", "pulley_radii", i, (), "m").set(gripper_table(), value)


def test_limits_of_a_box():
    """F_x = 50 M_y ≤ 5 N; the box goes to −5 N and 0.1 N·m."""
    assert experiment_table().scalar("parameter_studies", "force_to_moment") == RATIO
    for measure, expected in (("shear", 5.0), ("normal", 5.0), ("moment", 0.1)):
        assert limit(BOX, measure).value == pytest.approx(expected)


@given(st.integers(0, 10**6))
def test_a_limit_is_a_combination_of_its_corners_and_its_direction_bounds_it(seed):
    points = np.random.default_rng(seed).normal(size=(30, 3)) * (20.0, 10.0, 0.5)
    for measure in ("shear", "normal", "moment"):
        found = limit(points, measure)
        assert found.weights.sum() == pytest.approx(1.0)
        wrench = found.weights @ points[found.corners]
        assert wrench[1] <= 1e-9
        # no point is farther in the direction than the corners: so the limit is the largest
        reached = points @ found.direction
        assert reached[found.corners] == pytest.approx(reached.max())
    sheared = limit(points, "shear")
    wrench = sheared.weights @ points[sheared.corners]
    assert sheared.value == pytest.approx(wrench[0]) == pytest.approx(RATIO * wrench[2])
    polygon = section(clipped_vertices(points), (1.0, 0.0, -RATIO))
    assert sheared.value == pytest.approx(polygon[:, 0].max())


def test_a_hull_that_only_presses_has_no_limits():
    pressing = BOX + np.array([0.0, 20.0, 0.0])
    for measure in ("shear", "normal", "moment"):
        with pytest.raises(EmptySetError):
            limit(pressing, measure)


def test_mirrored_poses_have_the_mirrored_wrenches(grasp, points):
    found = grasp.evaluate(points.poses)
    assert found.holds.mean() > 0.99
    ours = found.wrenches[:, [0, 2, 4]] * (1.0, 1.0, -1.0)
    assert ours == pytest.approx(points.wrenches, abs=1e-9)
    assert len(points.phalanges) == len(points.poses)


@pytest.mark.parametrize("measure", ["shear", "moment"])
def test_sharper_hulls_go_farther_and_their_poses_hold(grasp, points, measure):
    before = limit(points.wrenches, measure).value
    sharper, found = sharpened(grasp, points, measure, 12, 1)
    assert found.value >= before
    added = sharper.poses[len(points.poses) :]
    if len(added):
        evaluated = grasp.evaluate(added)
        assert (evaluated.utilisation <= 1.0 + 1e-4).all()
        ours = evaluated.wrenches[:, [0, 2, 4]] * (1.0, 1.0, -1.0)
        assert ours == pytest.approx(sharper.wrenches[len(points.poses) :], abs=1e-9)
    # local search from few rays goes about as far as many rays do
    fine = limit(HullPoints.explored(grasp, 2000).wrenches, measure).value
    assert found.value >= 0.9 * fine


def test_the_volume_is_that_of_the_part_that_pulls(grasp):
    wrenches = HullPoints.explored(grasp, 150).wrenches
    found = volume(clipped_vertices(wrenches))
    scaled = wrenches * (1.0, 1.0, 10.0)
    whole = ConvexHull(scaled).volume / 10.0
    hull = ConvexHull(scaled)
    rng = np.random.default_rng(0)
    low, high = scaled.min(axis=0), scaled.max(axis=0)
    tried = rng.uniform(low, high, size=(40_000, 3))
    inside = (tried @ hull.equations[:, :3].T + hull.equations[:, 3] <= 0.0).all(axis=1)
    share = (tried[inside, 1] <= 0.0).mean()
    assert found == pytest.approx(share * whole, rel=0.08)


def test_what_holds_more_has_larger_limits():
    found = [
        sweep_cell(gripper_table(), Conditions(0.3, 46.0, name), ["shear", "normal"])["limits"]
        for name in ("concrete-fine", "concrete-coarse")
    ]
    for measure, weaker in found[0].items():
        assert found[1][measure] > weaker


def test_at_its_unloaded_pose_a_gripper_exerts_nothing(grasp):
    pose = unloaded_pose(grasp)
    assert grasp.evaluate(pose[None]).wrenches[0] == pytest.approx(np.zeros(6), abs=1e-6)
    pushed = grasp.evaluate(np.zeros((1, 3))).wrenches[0, 2]
    # a push off the rock, F_z > 0 on it, ends where the wrist has backed away
    assert pose[1] * pushed < 0.0


def test_closing_alone_holds_until_a_tile_is_overloaded(grasp):
    """Utilisations go as one over the strength: the largest one tells which surface is too weak."""
    assert rest_state(grasp) == "holds"
    poses = np.stack([np.zeros(3), unloaded_pose(grasp)])
    used = grasp.evaluate(poses).utilisation
    table, surface = gripper_table(), grasp.surface

    def on(share):
        values = {
            "shear_limit": share * surface.shear_limit,
            "pull_off_limit": share * surface.pull_off_limit,
        }
        return rest_state(Gripper(0.3, 46.0, Surface.from_values(values), table))

    assert on(1.01 * used.max()) == "holds"
    assert on(0.99 * used.max()) in ("contact fails", "ejects")
    assert on(0.5 * used.min()) in ("contact fails", "ejects")


@pytest.mark.parametrize("diameter", [0.3, 0.7])
def test_a_far_too_large_distal_pulley_ejects_the_gripper(diameter):
    grasp = Conditions(diameter, 46.0, "concrete-fine").gripper(radius(2, 0.0055))
    assert rest_state(grasp) == "ejects"
    assert grasp.evaluate(np.zeros((1, 3))).wrenches[0, 2] > 0.0
    back = np.linspace(0.0, -0.005, 201)
    found = grasp.evaluate(np.column_stack([0.0 * back, back, 0.0 * back]))
    unloaded = np.abs(found.wrenches[:, 2]) < 0.5
    assert not (found.holds & unloaded).any()


def test_surfaces_are_named():
    table = gripper_table()
    paper, fine = (
        Conditions(0.3, 46.0, name).gripper(table).surface
        for name in ("sandpaper-36", "concrete-fine")
    )
    assert paper.shear_limit == table.scalar("gripper", "shear_limit")
    assert fine.shear_limit == Surface.named("concrete-fine").shear_limit
    with pytest.raises(InvalidInputError, match="concrete-fine"):
        Conditions(0.3, 46.0, "moon").gripper(table)
