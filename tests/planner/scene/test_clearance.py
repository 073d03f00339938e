"""The least distances about a stance, held against points all along the capsules."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hand_models.base import Pose
from hand_models.rock import Cylinder, Edge, Ellipsoid, Mesh, Plane, Profile, Sphere, Triangles
from hand_models.rock.surface import grid
from planner.prepare import posture
from planner.prepare.settled_stance import settle_stance
from planner.question import Question, Stance
from planner.robots import Robot, robosimian
from planner.scene import clearance, link_findings, scene_of, solids
from planner.scene.scene import SCENE_SETTINGS
from planner.solving import plan
from service.answering.questions import question
from service.commands.stances import read_request
from tests.suite.helpers.rocks import cylinder_mesh, distance
from tests.suite.helpers.scenes import beside
from tests.suite.helpers.stances import moved, on_wall
from tests.suite.helpers.stances_with_joints import at_joints, two_link_robot

STEPS = 41
"""Points along a capsule."""

ANGLES = {
    "front_right": np.array([0.2, -0.9, 0.3, 1.2, -0.4, 0.6, 0.1]),
    "rear_left": np.array([-0.3, 0.8, 0.1, -1.1, 0.5, -0.7, 0.4]),
}


def scene(stance: Stance):
    return scene_of(stance, settle_stance(stance))


def spread(ends: np.ndarray) -> np.ndarray:
    """Points along segments (n, 2, 3), shape (n, STEPS, 3)."""
    part = np.linspace(0.0, 1.0, STEPS)[:, None]
    return ends[:, None, 0] * (1.0 - part) + ends[:, None, 1] * part


def from_rock(stance: Stance, points: np.ndarray) -> np.ndarray:
    """Of points in B from all rock, shape (rocks, ...) [m]."""
    there = []
    for hand, settled in zip(stance.hands, settle_stance(stance), strict=True):
        in_hold = (hand.pose @ settled.seating.pose).inverse() @ stance.body
        flat = in_hold.apply(points.reshape(-1, 3))
        there.append(distance(hand.hold, flat).reshape(points.shape[:-1]))
    return np.array(there)


@pytest.mark.parametrize(
    "hold",
    [Plane(), Cylinder(0.3), Sphere(0.25), Ellipsoid((0.14, 0.2, 0.12)), Edge(0.08, 1.7)],
    ids=lambda hold: hold.shape,
)
def test_links_and_body_are_as_far_from_rock_as_their_points(hold):
    robot = robosimian()
    stance = at_joints(robot, ANGLES, tuple(ANGLES), hold=hold)
    found = clearance(scene(stance), ANGLES)
    radii, still = robot.capsules.radii, robot.capsules.steps == 0
    away = from_rock(stance, spread(robot.placed_capsules(ANGLES))) - radii[:, None]
    for near, of in ((found.link_rock, ~still), (found.body_rock, still)):
        expected = away[:, of].min()
        # deep inside, points tell the way along their own normals only
        assert near.distance == pytest.approx(expected, abs=2e-3 if expected > 0.0 else 0.05)
        assert np.sign(near.distance) == np.sign(expected)
    first, second = np.array(found.body_rock.points)
    if found.body_rock.distance > 0.0:
        assert np.linalg.norm(first - second) == pytest.approx(found.body_rock.distance, abs=1e-6)
        on_rock = from_rock(stance, stance.body.inverse().apply(second[None]))
        assert np.abs(on_rock).min() < 1e-5


def test_links_are_as_far_from_each_other_as_their_points():
    robot = robosimian()
    stance = at_joints(robot, ANGLES, tuple(ANGLES))
    found = clearance(scene(stance), ANGLES).link_link
    ends, radii = robot.placed_capsules(ANGLES), robot.capsules.radii
    points = spread(ends)
    names = np.array(
        ["body" if limb is None else name for name, limb in zip(*robot.capsules[:2], strict=True)]
    )
    both = [np.flatnonzero(names == name) for name in found.between if name in names]
    if len(both) == 2:
        apart = [
            np.linalg.norm(points[i][:, None] - points[j][None], axis=2).min() - radii[i] - radii[j]
            for i in both[0]
            for j in both[1]
        ]
        assert found.distance == pytest.approx(min(apart), abs=1e-3)
    # limbs of two corners that have nothing to do with each other are no nearer than that
    one, other = (
        np.flatnonzero([limb == each for limb in robot.capsules.limbs]) for each in ANGLES
    )
    for i in one:
        for j in other:
            apart = np.linalg.norm(points[i][:, None] - points[j][None], axis=2).min()
            assert apart - radii[i] - radii[j] >= found.distance - 1e-6


def test_rock_of_triangles_and_outlines_is_as_near_as_the_log_that_they_show():
    turn = np.linspace(-1.5, 1.5, 401)
    outline = np.column_stack([0.15 * np.sin(turn), 0.15 - 0.15 * np.cos(turn)])
    holds = [Cylinder(0.3), Mesh(*cylinder_mesh(0.3, length=4.0)), Profile(outline)]
    found = []
    for hold in holds:
        stance = on_wall(hold)
        given = Pose(np.array([0.02, 0.0, 0.003]), np.eye(3))
        hands = tuple(replace(hand, hold_in_hand=given) for hand in stance.hands)
        found.append(clearance(scene(replace(stance, hands=hands)), None).body_rock.distance)
    assert found[1:] == pytest.approx([found[0]] * 2, abs=1e-4)


def test_rock_of_many_triangles_is_as_near_but_for_a_cube(monkeypatch):
    """Vertices merged in cubes of 8 mm move by less than the diagonal."""
    many = replace(SCENE_SETTINGS, rock_triangles=0)
    monkeypatch.setattr(solids, "SCENE_SETTINGS", many)
    x, y = np.meshgrid(np.arange(-1.0, 1.0, 0.01), np.arange(-1.0, 1.0, 0.003), indexing="ij")
    fine = grid(np.stack([x, y, 0.02 * np.sin(30.0 * x) * np.cos(20.0 * y)], axis=-1))
    fine = Triangles(fine.vertices, fine.faces[:, ::-1])
    stance = on_wall(Mesh(*fine))
    found = clearance(scene(stance), None).body_rock
    monkeypatch.undo()
    solids.ROCK_SHAPES.clear()
    want = clearance(scene(stance), None).body_rock
    assert 0.0 < abs(found.distance - want.distance) < math.sqrt(3.0) * many.rock_cube


def test_what_was_not_measured_is_said():
    found = clearance(scene(on_wall()), None)
    assert found.link_rock is None
    assert found.link_link is None
    assert [words.split(":")[0] for words in found.unchecked] == ["links"]
    robot = two_link_robot()
    angles = {"leg": np.array([0.4, 0.3])}
    found = clearance(scene(at_joints(robot, angles, ("leg",), hold=Sphere(0.2))), angles)
    assert (found.hand_hand, found.hand_body, found.body_rock) == (None, None, None)
    assert [words.split(":")[0] for words in found.unchecked] == ["body"]
    assert found.link_rock is not None


def test_distances_are_the_same_wherever_the_world_begins():
    stance = at_joints(robosimian(), ANGLES, tuple(ANGLES))
    by = Pose(np.array([2.0, -1.0, 5.0]), Rotation.from_rotvec([0.4, 2.0, -1.0]).as_matrix())
    here, there = (clearance(scene(each), ANGLES) for each in (stance, moved(stance, by)))
    for name in ("link_rock", "link_link", "hand_hand", "hand_body", "body_rock"):
        ours, theirs = getattr(here, name), getattr(there, name)
        assert theirs.between == ours.between
        assert theirs.distance == pytest.approx(ours.distance, abs=1e-9)
        assert np.array(theirs.points) == pytest.approx(by.apply(np.array(ours.points)), abs=1e-6)


def test_hands_that_overlap_are_below_zero():
    stance = on_wall(limbs=("front_left", "front_right"))
    apart = clearance(scene(stance), None).hand_hand
    assert apart.between == ["hand of front_right", "hand of front_left"]
    # 0.8 m less the width of a palm with its outer fingers' bases
    hand = stance.robot.hand
    assert apart.distance == pytest.approx(0.8 - 2.0 * hand.outer_axis[1])
    assert clearance(scene(beside(stance, 0.03)), None).hand_hand.distance < 0.0


def test_a_plan_tells_clearance_where_it_is_wanted():
    asked = Question(on_wall(), want=frozenset({"clearance"}))
    found = plan(asked).clearance
    assert found == clearance(scene(asked.stance), None)
    assert plan(Question(on_wall())).clearance is None


# Links in the way ---------------------------------------------------------------------------------


def test_the_bundled_stance_with_joints_is_clear_of_all():
    asked = question(read_request("wall-300-joints"))
    where = posture(asked)
    there = scene(asked.stance)
    assert link_findings(there, where.angles) == ()
    found = clearance(there, where.angles)
    assert found.unchecked == []
    near = [found.link_rock, found.link_link, found.hand_hand, found.hand_body, found.body_rock]
    assert min(each.distance for each in near) > 0.0


def test_links_are_in_each_other_where_points_of_them_are():
    robot, rng = robosimian(), np.random.default_rng(3)
    capsules = robot.capsules
    whose = np.array([robot.limbs.index(limb) if limb else -1 for limb in capsules.limbs])
    i, j = np.triu_indices(len(whose), 1)
    # links three joints apart are joined in no sense
    alike = (whose[i] == whose[j]) | (whose[i] < 0) | (whose[j] < 0)
    apart = ~alike | (np.abs(capsules.steps[i] - capsules.steps[j]) >= 3)
    i, j = i[apart], j[apart]
    seen = set()
    for _ in range(12):
        angles = {limb: rng.uniform(-1.3, 1.3, 7) for limb in robot.limbs}
        stance = at_joints(robot, angles, ("front_left",), hold=Sphere(0.1))
        points = spread(robot.placed_capsules(angles))[:, ::4]
        gaps = np.array(
            [
                np.linalg.norm(points[a][:, None] - points[b], axis=2).min()
                for a, b in zip(i, j, strict=True)
            ]
        )
        deep = (capsules.radii[i] + capsules.radii[j] - gaps).max()
        found = [f for f in link_findings(scene(stance), angles) if f.kind == "links_collide"]
        seen.add(bool(found))
        if deep > 0.021:
            assert max(each.value for each in found) >= deep - 1e-9
        assert all(each.value > 0.02 for each in found)
    assert seen == {True, False}


def test_links_in_rock_are_told_by_limb_for_given_joints_and_once_for_solved_ones():
    robot = robosimian()
    angles = {limb: np.zeros(7) for limb in robot.limbs}
    stance = at_joints(robot, angles, ("front_right",), hold=Plane())
    # the limbs are level, so that a wall below the body that is raised has all of them in it
    level = Pose(np.array([0.0, 0.0, -0.2]), np.diag([1.0, -1.0, -1.0]))
    raised = replace(scene(stance), rocks=(level,))
    given = [each for each in link_findings(raised, angles) if each.kind == "link_in_rock"]
    assert {each.field for each in given} == {f"stance.joints.{limb}" for limb in robot.limbs}
    solved = replace(raised, stance=replace(stance, joints="solve"))
    (told,) = [each for each in link_findings(solved, angles) if each.kind == "link_in_rock"]
    assert told.field == "stance.joints"
    assert told.value == max(each.value for each in given)


def thin(radius=None):
    """RoboSimian without capsules of its own: links of a radius, by default the assumed one."""
    own = robosimian()
    mounts = {limb: replace(mount, radius=radius) for limb, mount in own.description.mounts.items()}
    return Robot(replace(own.description, mounts=mounts, capsules={}), own.urdf, own.hand)


def beside_a_wall(robot, below):
    """The findings of links that are level, so far above the middle of their joints' lines."""
    angles = {limb: np.zeros(7) for limb in robot.limbs}
    stance = at_joints(robot, angles, ("front_right",), hold=Plane())
    lowest = min(robot.link_chain(angles, limb)[:-1, 2].min() for limb in robot.limbs)
    wall = Pose(np.array([0.0, 0.0, lowest - below]), np.diag([1.0, -1.0, -1.0]))
    there = replace(scene(stance), rocks=(wall.inverse(),))
    return [each for each in link_findings(there, angles) if each.kind == "link_in_rock"]


@pytest.mark.parametrize("below", [0.001, 0.005, 0.01, 0.015, 0.02, 0.025])
def test_a_radius_that_is_assumed_is_named_where_it_is_the_cause(below):
    found = beside_a_wall(thin(), below)
    assert found
    for each in found:
        assert "links are taken to have a radius of 50 mm" in each.message
        assert "capsules there, or the limb's radius" in each.message
        assert "in rad" not in each.message


@pytest.mark.parametrize(
    ("radius", "below"), [(None, -0.03), (None, -0.1), (0.05, 0.01), (0.05, -0.03), (0.08, 0.02)]
)
def test_it_is_not_where_it_is_known_or_where_angles_are_wrong_without_it(radius, below):
    found = beside_a_wall(thin(radius), below)
    assert found
    # thicker links may have others near the same wall
    worst = [each for each in found if each.value > max(each.value for each in found) - 1e-9]
    for each in worst:
        holds = each.field == "stance.joints.front_right"
        asked = "others may keep the links clear" if holds else "are its angles in rad, from the"
        assert asked in each.message


def test_links_that_are_as_thin_as_they_are_known_to_be_are_clear():
    assert beside_a_wall(thin(0.01), 0.02) == []
