"""Walls that are made: the tables are those of their placements and bodies, and move with them."""

import re
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hand_models.base import (
    InvalidInputError,
    Pose,
    UnsupportedError,
    turns_about,
    wrench_transport,
)
from hand_models.fixed_wrist import wrench_spaces
from hand_models.hand import Grasp
from hand_models.rock import Cylinder, Mesh
from hand_models.scans import generate_wall
from hand_models.tile import Surface
from planner import deadline
from planner.motion import Rock
from planner.prepare import settle_each
from planner.programs import WRENCH_UNIT
from planner.reach import reach_table
from planner.walls import BodyGrid, PlaceGrid, read_wall, wall_digest, wall_of, write_wall
from tests.suite.helpers.climbing_walls import (
    FLAT,
    TINY,
    arrays_of,
    asked_once,
    rock_of,
    tiny_source,
    tiny_wall,
    wall_besides,
)

DIRECTIONS = np.random.default_rng(0).normal(size=(10, 6))


def test_every_trial_is_counted():
    made = tiny_wall()
    assert made.tried == len(made.wall.places) + sum(made.refused.values()) == 40
    assert (made.lost_trials, made.lost_places, made.in_rock) == (0, 0, 0)
    assert list(made.refused.values()) == sorted(made.refused.values(), reverse=True)
    assert len(made.wall.places) > 6


def test_reach_in_chunks_is_reach_at_once():
    wall, source = tiny_wall().wall, tiny_source()
    rock = Rock("rock", source.rock, source.rock_pose, frozenset(wall.robot.limbs))
    whole = reach_table(wall.robot, [place.pose for place in wall.places], wall.bodies, rock=rock)
    assert 0 < whole.reached.sum() < whole.reached.size
    for name, value in vars(whole).items():
        np.testing.assert_array_equal(getattr(wall.reach, name), value)
    for p, b, limb in np.argwhere(whole.reached)[::50].tolist():
        np.testing.assert_array_equal(wall.reach.branches(p, b, limb), whole.branches(p, b, limb))


def test_supports_are_those_of_the_planner():
    wall = tiny_wall().wall
    closed = settle_each(wall.robot.hand, wall.places)
    found = wall.screening.hands.supports(DIRECTIONS)
    about = wall.screening.hands.about
    for place, space, supports in zip(wall.places, wrench_spaces(closed), found, strict=True):
        moved = Pose(place.pose.position - about, place.pose.rotation)
        carried = -wrench_transport(moved) / WRENCH_UNIT[:, None]
        expected = [space.support(way) for way in DIRECTIONS @ carried]
        np.testing.assert_allclose(supports, expected, rtol=1e-7, atol=1e-7)


def test_what_stands_and_falls_with_the_wall_moves_with_it():
    source, here = tiny_source(), tiny_wall().wall
    # gravity turns, too
    moved = Pose(np.array([1.0, -2.0, 0.5]), turns_about([0.3, -0.7, 0.4]))
    there_source = replace(
        source, rock_pose=moved @ source.rock_pose, gravity=moved.rotation @ source.gravity
    )
    there = wall_of(there_source, there_source.poses()).wall
    assert len(there.places) == len(here.places)
    for first, second in zip(
        [place.pose for place in here.places] + list(here.bodies),
        [place.pose for place in there.places] + list(there.bodies),
        strict=True,
    ):
        np.testing.assert_allclose((moved @ first).position, second.position, atol=1e-12)
        np.testing.assert_allclose((moved @ first).rotation, second.rotation, atol=1e-12)
    np.testing.assert_array_equal(here.apart, there.apart)
    # a search may end in another branch here and there, where starts are as near
    assert (here.reach.reached != there.reach.reached).mean() < 0.01
    turn = np.kron(np.eye(2), moved.rotation)
    np.testing.assert_allclose(
        there.screening.hands.supports(DIRECTIONS @ turn.T),
        here.screening.hands.supports(DIRECTIONS),
        atol=1e-9,
    )
    np.testing.assert_allclose(
        there.screening.wrenches, here.screening.wrenches @ turn.T, atol=1e-9
    )


def test_given_placements_and_bodies_come_last():
    source, made = tiny_source(), tiny_wall().wall
    place = made.places[3]
    # a micrometre beside its place on the rock
    aside = np.array([0.0, 1e-6, 0.0])
    pose = Pose(place.pose.position + aside, place.pose.rotation)
    given = replace(
        place, limb="rear_left", pose=pose, hold_pose=source.rock_pose, hold_in_hand=None
    )
    body = Pose(made.bodies[0].position + np.array([0.0, 0.02, 0.0]), made.bodies[0].rotation)
    more = replace(source, more_places=[given], more_bodies=[body])
    poses = more.poses()
    whole = wall_besides(more, poses)
    wall = whole.wall
    assert (whole.given, poses.given) == ((len(made.places),), (len(made.bodies),))
    assert wall.places[-1].limb == "rear_left"
    np.testing.assert_array_equal(wall.bodies[-1].position, body.position)
    # about the same hand as before, from the same bodies
    np.testing.assert_array_equal(wall.reach.reached[-1, :-1], made.reach.reached[3])
    supports = wall.screening.hands.supports(DIRECTIONS)
    np.testing.assert_allclose(supports[-1], supports[3], rtol=1e-3)
    assert not wall.apart[-1, 3]
    assert any(pair.tolist() == [0, len(made.bodies)] for pair in wall.shifts)
    loose = replace(source, more_places=[replace(given, wrist="compliant")])
    with pytest.raises(UnsupportedError, match=r"more_places\[0\]\.wrist: must have a fixed"):
        wall_besides(loose, loose.poses())
    far = Pose(given.pose.position + np.array([0.0, 0.0, 9.0]), given.pose.rotation)
    off_rock = replace(given, pose=far, hold_in_hand=None, hold_pose=source.rock_pose)
    off = replace(source, more_places=[given, off_rock])
    with pytest.raises(InvalidInputError, match=r"more_places\[1\]\.pose: no tile is on the rock"):
        wall_besides(off, off.poses())


def test_what_the_grids_have_counts_once():
    """As numbers of twelve digits give it, such as those of a file."""
    source, made = tiny_source(), tiny_wall().wall
    place, body = made.places[3], made.bodies[1]
    turn = Rotation.from_matrix(place.pose.rotation).as_quat().round(12)
    pose = Pose.from_quaternion(place.pose.position.round(12), turn)
    about = replace(place, pose=pose, hold_pose=source.rock_pose, hold_in_hand=None)
    grasp = Grasp(round(place.grasp.outer_rotation, 12))
    other = Grasp(grasp.outer_rotation, closing_tension=30.0)
    hands = [replace(about, grasp=each) for each in (grasp, other, grasp, other)]
    more = replace(source, more_places=hands, more_bodies=[body, body])
    poses = more.poses()
    whole = wall_besides(more, poses)
    count = len(made.places)
    assert (whole.given, len(whole.wall.places)) == ((3, count, 3, count), count + 1)
    assert (poses.given, len(poses.poses)) == ((1, 1), len(made.bodies))
    np.testing.assert_array_equal(poses.shifts, source.poses().shifts)


def test_a_wall_is_read_as_it_was_written(tmp_path):
    source, made = tiny_source(), tiny_wall().wall
    path = tmp_path / "wall.npz"
    digest = write_wall(made, path, "a tiny wall")
    again = read_wall(path, source.robot, source.rock, source.surface)
    assert wall_digest(again) == wall_digest(made) == digest
    for name, value in arrays_of(made).items():
        np.testing.assert_array_equal(arrays_of(again)[name], value)
    hands = again.screening.hands, made.screening.hands
    supports = [each.supports(DIRECTIONS) for each in hands]
    np.testing.assert_allclose(*supports, rtol=1e-9)
    with np.load(path, allow_pickle=False) as file:
        assert str(file["format"]) == "crux wall 1"
        assert str(file["about"]) == "a tiny wall"


def test_a_wall_of_something_else_is_not_read(tmp_path):
    source, path = tiny_source(), tmp_path / "wall.npz"
    write_wall(tiny_wall().wall, path)
    robot, rock, surface = source.robot, source.rock, source.surface
    vertices = rock.triangles.vertices.copy()
    vertices[0, 2] += 1e-9
    other = Mesh(vertices, rock.triangles.faces, anywhere=True)
    with pytest.raises(InvalidInputError, match="file: was made with another rock: make the wall"):
        read_wall(path, robot, other, surface)
    with pytest.raises(InvalidInputError, match="was made with another surface"):
        read_wall(path, robot, rock, Surface.named("sandpaper-36"))
    with np.load(path) as file:
        arrays = dict(file)
    arrays["screening_supports"][0, 0] += 1e-6
    np.savez(path, **arrays)
    with pytest.raises(InvalidInputError, match="is damaged"):
        read_wall(path, robot, rock, surface)
    np.savez(path, a=1)
    with pytest.raises(InvalidInputError, match="is not a file of a wall"):
        read_wall(path, robot, rock, surface)


def test_walls_that_no_file_can_have(tmp_path):
    made = tiny_wall().wall
    for change in ({"hold": Cylinder(0.3)}, {"hold_in_hand": None}):
        odd = replace(made, places=(*made.places[1:], replace(made.places[0], **change)))
        with pytest.raises(UnsupportedError, match="only walls with all placements on one mesh"):
            write_wall(odd, tmp_path / "wall.npz")
    assert not list(tmp_path.iterdir())


def test_lost_chunks_are_counted_and_the_rest_is_made():
    source, whole = tiny_source(), tiny_wall().wall
    bodies = source.poses()
    answers, calls = asked_once(source, bodies), []

    def ask(questions):
        calls.append(questions)
        for i, question in enumerate(questions):
            yield None if i == 1 else next(answers([question]))

    made = wall_of(source, bodies, ask)
    # 6 points of a chunk, two hands at each
    assert made.lost_trials == 12
    assert made.tried == 28
    assert made.lost_places == min(6, len(made.wall.places) - 6)
    lost = slice(6, 6 + made.lost_places)
    assert not made.wall.reach.reached[lost].any()
    assert made.wall.reach.spanned[lost].all()
    kept = {tuple(place.pose.position) for place in made.wall.places}
    assert kept < {tuple(place.pose.position) for place in whole.places}
    assert len(calls) == 2


def test_a_deadline_ends_it():
    source = tiny_source()
    bodies = source.poses()
    asked = []

    def ask(questions):
        for question in questions:
            asked.append(question)
            yield source.answer(question, bodies)

    with pytest.raises(deadline.DeadlineError), deadline.within(1e-9):
        wall_of(source, bodies, ask)
    assert len(asked) <= 1


def test_hands_that_hold_nothing_are_counted_in_words():
    rock, pose = rock_of(lean=0.0, **TINY, **FLAT)
    source = tiny_source(rock=rock, rock_pose=pose)
    with pytest.raises(InvalidInputError) as caught:
        wall_of(source, source.poses())
    found = re.findall(r"(\d+) of (\d+) hands: ", str(caught.value))
    (total,) = {int(each) for _, each in found}
    assert sum(int(count) for count, _ in found) == total
    assert "hands: a hand can be there, but holds nothing in any direction" in str(caught.value)


def test_questions_are_plain_bytes():
    source = tiny_source()
    questions = []

    def ask(every):
        questions.extend(every)
        return [None] * len(every)

    with pytest.raises(InvalidInputError) as caught:
        wall_of(source, source.poses(), ask)
    points = [point for each in questions for point in msgspec.msgpack.decode(each)["points"]]
    assert len(points) == 20
    assert str(caught.value) == (
        "places.spacing: no hand holds anything on this rock (40 of 40 hands: not tried, as "
        "processes died of them); try a smaller spacing"
    )
    assert all(len(trial) == 4 for point in points for trial in point)


@pytest.mark.slow
def test_no_limb_reaches_over_the_gap_of_the_blocked_wall():
    # at one body, a limb goes from hold to hold on the same side only: nobody gets across
    found = generate_wall("blocked-wall", 1)
    rock = Mesh(found.vertices, found.faces, anywhere=True)
    source = tiny_source(
        rock=rock,
        rock_pose=found.pose,
        places=PlaceGrid(spacing=0.2, rotations=(0.0,)),
        bodies=BodyGrid(spacing=0.25, stand_offs=(0.4, 0.6), tilts=(-0.3, 0.3)),
    )
    wall = wall_of(source, source.poses()).wall
    above = np.array([(found.pose.inverse() @ place.pose).position[0] for place in wall.places]) > 0
    reached = wall.reach.reached
    low, high = (reached[each].any(axis=0) for each in (~above, above))
    assert low.any(axis=0).all()
    assert high.any(axis=0).all()
    assert not (low & high).any()
    # there are bodies over the gap, which reach one side or the other
    over = np.abs([(found.pose.inverse() @ body).position[0] for body in wall.bodies]) < 0.5
    assert (low | high)[over].any()
