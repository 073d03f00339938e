"""A wall that is finer about a state keeps all that it had, and has more where the state is."""

import numpy as np
import pytest

from hand_models.base import Pose, turns_about
from planner.search import State
from planner.walls import finer_about, wall_of
from planner.walls.bodies import clear_of
from tests.suite.helpers.climbing_walls import tiny_source, tiny_wall


@pytest.fixture(scope="module")
def finer():
    """Source and wall of some state, the state, and the source that is finer about it."""
    source, wall = tiny_source(), tiny_wall().wall
    body = int(np.bincount(wall.shifts.ravel()).argmax())
    state = State(body, (0, len(wall.places) - 1, -1, 3))
    return source, wall, state, finer_about(source, wall, state)


def holds(source, wall, state):
    into = source.rock_pose.inverse()
    return np.array([(into @ wall.places[p].pose).position[:2] for p in state.members if p >= 0])


def test_points_are_half_a_spacing_from_the_hands_of_the_state_and_apart(finer):
    source, wall, state, more = finer
    points, step = np.array(more.more_points), 0.5 * source.places.spacing
    away = np.abs(points[:, None] - holds(source, wall, state)).max(axis=2)
    assert np.isclose(away, step, atol=1e-12).any(axis=1).all()
    # eight about each of three hands, but for those that would be nearly the same
    assert 16 <= len(points) <= 24
    between = np.linalg.norm(points[:, None] - points, axis=2)
    assert between[~np.eye(len(points), dtype=bool)].min() >= 0.5 * step


def test_a_second_time_the_spacing_is_a_quarter_and_no_point_comes_twice(finer):
    source, wall, state, more = finer
    twice = finer_about(more, wall, state, 2)
    new = np.array(twice.more_points[len(more.more_points) :])
    assert twice.more_points[: len(more.more_points)] == more.more_points
    away = np.abs(new[:, None] - holds(source, wall, state)).max(axis=2).min(axis=1)
    np.testing.assert_allclose(away, 0.25 * source.places.spacing, atol=1e-12)
    assert not finer_about(twice, wall, state, 2).more_points[len(twice.more_points) :]


def test_bodies_are_halfway_to_where_the_body_may_be_shifted_and_clear_of_rock(finer):
    source, wall, state, more = finer
    own, added = wall.bodies[state.body], more.more_bodies
    there = {int(i) for pair in wall.shifts for i in pair if state.body in pair} - {state.body}
    ends = [wall.bodies[i].position for i in there]
    assert 0 < len(added) <= len(there)
    for pose in added:
        np.testing.assert_array_equal(pose.rotation, own.rotation)
        assert min(np.abs(2.0 * pose.position - own.position - end).max() for end in ends) < 1e-12
    into = source.rock_pose.inverse()
    at = [into @ pose for pose in added]
    assert clear_of(source.rock, source.robot, at, source.bodies.clear).all()


@pytest.mark.slow
def test_points_and_bodies_move_with_the_wall(finer):
    source, _, state, more = finer
    moved = Pose(np.array([1.0, -2.0, 0.5]), turns_about([0.3, -0.7, 0.4]))
    there_source = tiny_source(
        rock_pose=moved @ source.rock_pose, gravity=moved.rotation @ source.gravity
    )
    there_wall = wall_of(there_source, there_source.poses()).wall
    there = finer_about(there_source, there_wall, state)
    np.testing.assert_allclose(there.more_points, more.more_points, atol=1e-12)
    for pose, other in zip(more.more_bodies, there.more_bodies, strict=True):
        np.testing.assert_allclose((moved @ pose).position, other.position, atol=1e-12)


@pytest.mark.slow
def test_the_finer_wall_has_what_the_wall_had_with_its_reach(finer):
    source, wall, _, more = finer
    asked = []
    fine = wall_of(more, more.poses(), recorded(asked, more)).wall
    P, B = len(wall.places), len(wall.bodies)
    assert len(fine.places) > P
    assert len(fine.bodies) == B + len(more.more_bodies)
    for old, new in zip([*wall.places], fine.places[:P], strict=True):
        np.testing.assert_array_equal(old.pose.position, new.pose.position)
    np.testing.assert_array_equal(fine.reach.counts[:P, :B], wall.reach.counts)
    for p, b, limb in np.argwhere(wall.reach.reached)[::40].tolist():
        np.testing.assert_array_equal(
            fine.reach.branches(p, b, limb), wall.reach.branches(p, b, limb)
        )
    # all but what is at the ends of the first placements is asked in the same words as before
    before = []
    wall_of(source, source.poses(), recorded(before, source))
    assert len([each for each in before if each in asked]) >= len(before) - 2 > 3


def recorded(questions, source):
    bodies = source.poses()

    def ask(every):
        for question in every:
            questions.append(question)
            yield source.answer(question, bodies)

    return ask
