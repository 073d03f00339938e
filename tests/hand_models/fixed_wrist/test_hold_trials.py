"""Holds that are proposed on a rock are those of hands that are placed there one by one."""

import math
import pickle

import numpy as np
import pytest
import trimesh

from hand_models import Cylinder, Grasp, InvalidInputError, Pose, place
from hand_models.base import RefusedPlaceError, turns_about
from hand_models.fixed_wrist import (
    AT_BORDER,
    AT_HOLE,
    TRIAL_WAYS,
    FoundHold,
    HoldTrial,
    Robustness,
    approach_frame,
    grid_of_trials,
    ranked_holds,
    scattered_places,
    trials_at,
    try_holds,
    wrench_space,
)
from hand_models.hand import Placement
from hand_models.rock import Mesh
from tests.suite.helpers.hands import HAND, ROCK
from tests.suite.helpers.rocks import cylinder_mesh, fractal_wall, height_map

RADIUS = 0.055
PLACED = 4
"""Hands that are placed one by one."""

DIRECTIONS = {
    "-fz": (2, -1.0),
    "-fx": (0, -1.0),
    "+fx": (0, 1.0),
    "-fy": (1, -1.0),
    "+fy": (1, 1.0),
}


@pytest.fixture(scope="module")
def wall():
    return Mesh(*fractal_wall(3), anywhere=True)


def test_hands_at_points_are_those_of_a_grid_that_has_the_points(wall):
    grid = grid_of_trials(wall, 0.2, 3, (0.0, 1.0), radius=RADIUS)
    points = np.array([trial.point[:2] for trial in grid[::6]])[[4, 1]]
    above = float(wall.triangles.vertices[:, 2].min()) - 0.2
    there = trials_at(wall, points, 3, (0.0, 1.0), None, above, RADIUS)
    assert there == [*grid[24:30], *grid[6:12]]


def test_a_grid_covers_the_rock_and_hands_come_against_its_normal(wall):
    trials = grid_of_trials(wall, 0.2, 3, (0.0, 1.0), radius=RADIUS)
    points = np.array([trial.point for trial in trials[::6]])
    assert len(trials) == 6 * len(points) == 6 * 16
    sides = np.unique(points[:, 0])
    np.testing.assert_allclose(sides, [-0.3, -0.1, 0.1, 0.3], atol=1e-12)
    angles = {(trial.wrist_angle, trial.outer_rotation) for trial in trials}
    assert angles == {(k * math.tau / 3, r) for k in range(3) for r in (0.0, 1.0)}
    for trial in trials[::6]:
        toward = np.array(trial.approach)
        assert np.linalg.norm(toward) == pytest.approx(1.0)
        assert wall.entry(np.array(trial.point) - 0.05 * toward, toward) == pytest.approx(
            0.05, abs=0.02
        )
        near = np.linalg.norm(wall.triangles.vertices - trial.point, axis=1) < RADIUS
        # across the mean plane of what is under the palm
        spread = np.linalg.svd(
            wall.triangles.vertices[near] - wall.triangles.vertices[near].mean(axis=0)
        )[2]
        assert abs(spread[2] @ toward) > 0.97


def test_what_is_found_is_what_a_hand_placed_there_can_carry(wall):
    trials = grid_of_trials(wall, 0.2, 1, radius=RADIUS)[::2]
    found = try_holds(HAND, wall, ROCK, trials)
    held = 0
    for trial, each in zip(trials, found, strict=True):
        if isinstance(each, InvalidInputError) or np.isnan(each.support).any():
            continue
        held += 1
        if held > PLACED:
            continue
        hand = place(wall, trial.point, trial.approach, trial.wrist_angle, Grasp(), ROCK)
        np.testing.assert_allclose(hand.seating.pose.inverse().position, each.pose.position)
        space = wrench_space(hand)
        for way, reach in zip(TRIAL_WAYS, each.support, strict=True):
            axis, sign = DIRECTIONS[way]
            assert space.support(sign * np.eye(6)[axis]) == pytest.approx(reach, rel=1e-9)
        for (axis, sign), pure in zip(DIRECTIONS.values(), each.pure, strict=True):
            ends = space.capability(sign * np.eye(6)[axis])
            assert np.isnan(pure) if ends is None else pure == pytest.approx(ends[1], abs=1e-6)
    # where fingers point outward at the border they are too near it
    assert 2 <= held < len(trials)


def test_the_border_of_a_scan_is_no_edge_to_hold(wall):
    (found,) = try_holds(HAND, wall, ROCK, [HoldTrial((0.2, 0.0, 0.0), (0.0, 0.0, 1.0), 0.0, 0.0)])
    assert isinstance(found, InvalidInputError)
    assert "the scan ends" in str(found)


def test_a_finger_beyond_the_scan_holds_nothing_of_it(wall):
    trials = [HoldTrial((0.0, y, 0.0), (0.0, 0.0, 1.0), 0.0, 0.0) for y in (0.33, 0.35, 0.4)]
    for found in try_holds(HAND, wall, ROCK, trials):
        assert isinstance(found, InvalidInputError)


def test_the_grid_does_not_depend_on_how_finely_triangles_tell_the_rock():
    corners = np.array([[-0.5, -0.5, 0.1], [0.5, -0.5, 0.1], [0.5, 0.5, -0.1], [-0.5, 0.5, -0.1]])
    rock = corners, np.array([[0, 2, 1], [0, 3, 2]])
    coarse = grid_of_trials(Mesh(*rock, anywhere=True), 0.3, 1, radius=RADIUS)
    for _ in range(3):
        rock = trimesh.remesh.subdivide(*rock)
    fine = grid_of_trials(Mesh(*rock, anywhere=True), 0.3, 1, radius=RADIUS)
    assert len(coarse) == 16
    for one, other in zip(coarse, fine, strict=True):
        np.testing.assert_allclose(np.hstack(one), np.hstack(other), atol=1e-12)


def test_robust_is_that_of_the_hand_seated_anew_near_its_place():
    """At each sample the seat is found again; only contact's own scatter moves it from there."""
    log, grasp = Mesh(*cylinder_mesh(0.3, length=0.5), anywhere=True), Grasp(math.pi)
    trial = HoldTrial((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.0, math.pi)
    (found,) = try_holds(HAND, log, ROCK, [trial], samples=4, force=40.0)
    assert isinstance(found, FoundHold)
    at = approach_frame(trial.point, trial.approach, trial.wrist_angle)
    ways = np.array([sign * np.eye(6)[axis] for axis, sign in DIRECTIONS.values()])
    supports, pure = [], []
    for x, y, z, roll, pitch, yaw in scattered_places("", 4, 0):
        moved = at @ Pose(0.002 * np.array([x, y, 0.0]), turns_about([0.0, 0.0, 0.02 * yaw]))
        supports.append(np.zeros(5))
        pure.append(np.zeros(5))
        try:
            seat = HAND.settle(log, ROCK, grasp, at=moved).seating.pose
            left = Pose(
                np.array([0.0, 0.0, 0.25e-3 * z]), turns_about([3e-3 * roll, 3e-3 * pitch, 0.0])
            )
            space = wrench_space(HAND.settle(log, ROCK, grasp, left.inverse() @ seat))
        except InvalidInputError:
            continue
        supports[-1] = np.array([space.support(way) for way in ways])
        ends = [space.capability(way) for way in ways]
        pure[-1] = np.array([0.0 if each is None else max(each[1], 0.0) for each in ends])
    assert np.any(np.array(pure) > 40.0)
    tenth = np.percentile(supports, 10.0, axis=0)
    np.testing.assert_allclose(found.robust.tenth, tenth, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(found.robust.pure_tenth, np.min(pure, axis=0), rtol=1e-5, atol=1e-6)
    np.testing.assert_array_equal(found.robust.share, (np.array(pure) >= 40.0).mean(axis=0))
    assert found.robust.contact == (0.25e-3, 3e-3)


def test_each_refused_place_has_its_kind():
    corners = np.array([[-0.3, -0.3, 0.0], [0.3, -0.3, 0.0], [0.3, 0.3, 0.0], [-0.3, 0.3, 0.0]])
    flat = Mesh(corners, np.array([[0, 2, 1], [0, 3, 2]]), anywhere=True)
    trial = HoldTrial((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.0, 0.0)
    (resting,) = try_holds(HAND, flat, ROCK, [trial], placing="contact")
    assert resting.reason == "no_rest"
    (outside,) = try_holds(HAND, flat, ROCK, [trial._replace(point=(0.25, 0.0, 0.0))])
    assert (outside.reason, outside.message) == ("scan_border", AT_BORDER)
    deep = Placement(flat, ROCK, Grasp(), Pose(np.array([0.0, 0.0, -0.02]), np.eye(3)))
    tilted = Pose(np.array([0.0, 0.0, 0.03]), turns_about([0.0, 0.4, 0.0]))
    slack = Placement(Cylinder(0.3), ROCK, Grasp(math.pi, closing_tension=1.0), None)
    found = HAND.settle_each([deep, deep._replace(hold_in_hand=tilted), slack])
    assert [each.reason for each in found] == ["palm_in_rock", "finger_in_rock", "tendon_slack"]


def test_a_place_near_a_hole_of_a_scan_is_not_called_one_at_its_end():
    vertices, faces = height_map(np.zeros((121, 121)), 4e-3)
    middles = vertices[faces].mean(axis=1)
    hole = np.abs(middles[:, :2] - [0.1, 0.0]).max(axis=1) < 0.03
    whole = Mesh(vertices, faces, anywhere=True)
    holed = Mesh(vertices, faces[~hole], anywhere=True)

    def messages(rock: Mesh, x: float) -> set[str]:
        trials = [
            HoldTrial((x, 0.0, 0.0), (0.0, 0.0, 1.0), 0.5 * math.pi * turn, 0.0)
            for turn in range(4)
        ]
        found = try_holds(HAND, rock, ROCK, trials)
        return {each.message for each in found if isinstance(each, RefusedPlaceError)}

    assert messages(whole, 0.0) == set()
    assert messages(holed, 0.0) == {AT_HOLE}
    # at the outline it is the outline, hole or not
    assert messages(whole, -0.2) == messages(holed, -0.2) == {AT_BORDER}


def test_a_refused_place_keeps_its_kind_on_the_way_from_a_worker():
    error = RefusedPlaceError("is in the way", reason="palm_in_rock", field="hold")
    there = pickle.loads(pickle.dumps(error))
    assert (there.reason, there.kind, str(there)) == (error.reason, "invalid", str(error))


def test_holds_are_ranked_by_each_measure():
    """Three holds, each first by another measure; one without samples; one that cannot be."""

    def hold(pure: float, support: float, tenth: float | None, share: float = 0.0) -> FoundHold:
        robust = None
        if tenth is not None:
            numbers = (np.full(5, value) for value in (0.0, 0.0, 0.0, tenth, share))
            worst, quantile, hundredth, pure_tenth, shares = numbers
            robust = Robustness(
                4, 0, 0.002, 0.02, 0, worst, quantile, hundredth, None, pure_tenth, shares
            )
        return FoundHold(
            Pose.identity(), "palm", 0.0, np.full(5, support), np.full(5, pure), robust
        )

    nan = math.nan
    found = [
        hold(nan, 90.0, None),
        hold(5.0, 7.0, 0.0, 0.25),
        InvalidInputError("in rock"),
        hold(9.0, 9.0, 0.0, 0.5),
        hold(3.0, 4.0, 2.0, 1.0),
        hold(-1.0, 0.05, 0.0),
        hold(nan, nan, 0.0),
        hold(nan, 8.0, 0.0, 0.5),
        # a pure force below zero is no better than none
        hold(-1.0, 5.0, None),
    ]
    assert ranked_holds(found) == [4, 3, 7, 1, 0, 8]
    assert ranked_holds(found, "share") == [4, 3, 7, 1, 0, 8]
    assert ranked_holds(found, "pure") == [3, 1, 4, 7, 0, 8]
    assert ranked_holds(found, "support", "+fy") == [0, 3, 7, 1, 8, 4]
    for given in ({"by": "luck"}, {"way": "+fz"}):
        with pytest.raises(InvalidInputError, match="must be one of") as caught:
            ranked_holds(found, **given)
        assert caught.value.field == next(iter(given))


@pytest.mark.parametrize(("spacing", "angles", "field"), [(0.0, 1, "spacing"), (0.1, 0, "angles")])
def test_grids_that_cannot_be_are_refused(wall, spacing, angles, field):
    with pytest.raises(InvalidInputError) as caught:
        grid_of_trials(wall, spacing, angles, radius=RADIUS)
    assert caught.value.field == field


def test_a_hand_placed_by_contact_is_tried_where_it_rests():
    """On a log it is deeper than its seat, and holds less pull-off."""
    log = Mesh(*cylinder_mesh(0.3, length=0.5), anywhere=True)
    trial = HoldTrial((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.0, math.pi)
    (seated,) = try_holds(HAND, log, ROCK, [trial])
    (resting,) = try_holds(HAND, log, ROCK, [trial], placing="contact")
    assert resting.rule == "contact"
    moved = (seated.pose.inverse() @ resting.pose).position
    # as on a log that is given by its diameter, but for its facets
    assert moved == pytest.approx([0.0, 0.0, 0.72e-3], abs=1e-4)
    assert 0.0 < resting.support[0] < seated.support[0]
