"""Capsules of limbs, and their distances from each other and from rock."""

from dataclasses import replace

import coal
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hand_models.base import Pose, turns_about
from hand_models.rock import Cylinder, Profile
from planner.motion import CollisionScene, JointSpace, Rock, rocks_of
from planner.motion.compiled_capsules import capsule_distances
from planner.motion.limb_capsules import LimbCapsules
from planner.prepare.settled_stance import settle_stance
from planner.scene import clearance, scene_of
from planner.scene.solids import capsule_solids, distance_between
from tests.planner.robots.test_coupled_joints import random_angles, random_arms
from tests.suite.helpers.rocks import cylinder_mesh
from tests.suite.helpers.stances_with_joints import at_joints
from tests.suite.helpers.swings import BODY, ROBOT, ball, posture, rock, rough

seeds = st.integers(0, 2**32 - 1)


def moved_by(rng) -> Pose:
    return Pose(rng.normal(size=3), turns_about(rng.normal(size=3)))


def some_space(scene, joints, limbs, bodies=(BODY,), touching=()):
    return JointSpace(scene, bodies, joints, limbs, touching=touching)


@pytest.mark.parametrize("seed", range(4))
def test_capsules_are_where_pinocchio_puts_them(seed):
    """Joints that turn, slide, and follow others."""
    robot, rng = (ROBOT if seed == 0 else random_arms(seed)[0]), np.random.default_rng(seed)
    postures = [random_angles(robot, rng) for _ in range(5)]
    for limb in robot.limbs:
        limbs = LimbCapsules(robot, limb)
        found = limbs.segments(np.array([angles[limb] for angles in postures]))
        own = [i for i, each in enumerate(robot.capsules.limbs) if each == limb]
        for segments, angles in zip(found, postures, strict=True):
            assert segments[:-1] == pytest.approx(robot.placed_capsules(angles)[own], abs=1e-12)
            # the palm's capsule touches the palm's face, z = 0 of H, with its whole length
            in_hand = robot.hand_poses(angles)[limb].inverse().apply(segments[-1])
            radius = CollisionScene(robot, []).radii[-1]
            assert in_hand[:, 1:] == pytest.approx(np.array([[0.0, -radius]] * 2), abs=1e-12)
            assert in_hand[:, 0] == pytest.approx(-in_hand[::-1, 0], abs=1e-12)


def test_capsules_are_as_far_from_each_other_as_coal_says():
    rng = np.random.default_rng(1)
    ends = rng.uniform(-0.3, 0.3, (60, 2, 3))
    ends[:10, 1] = ends[:10, 0]  # balls
    ends[10:20, 1] = ends[10:20, 0] + (ends[20:30, 1] - ends[20:30, 0]) * rng.uniform(
        -1, 2, (10, 1)
    )
    radii = rng.uniform(0.01, 0.05, 60)
    pairs = np.ascontiguousarray(np.argwhere(np.tri(60, k=-1)))
    found = capsule_distances(ends[None], radii, pairs, np.inf)[0]
    solids = capsule_solids(["" for _ in radii], ends, radii)
    want = np.array([distance_between(solids[i], solids[j])[0] for i, j in pairs.tolist()])
    apart = want > 1e-6
    assert apart.sum() > 500
    assert found[apart] == pytest.approx(want[apart], abs=1e-6)
    assert (found[want < -1e-6] < 0.0).all()
    # beyond a distance, lower bounds
    rough_ones = capsule_distances(ends[None], radii, pairs, 0.1)[0]
    assert (rough_ones <= found + 1e-12).all()
    assert rough_ones[found <= 0.1] == pytest.approx(found[found <= 0.1])
    assert (rough_ones[found > 0.1] > 0.1 - 1e-12).all()


@pytest.mark.parametrize(
    "hold",
    [
        Cylinder(0.3),
        Profile([[-0.5, 0.1], [-0.1, 0.0], [0.1, 0.02], [0.5, 0.3]]),
        rough(),
    ],
    ids=lambda hold: hold.shape,
)
def test_links_are_as_far_from_rock_as_coal_says(hold):
    """Distances are lower bounds, by what the spacing of points leaves out."""
    rng, seen = np.random.default_rng(2), 0
    angles = np.array([rng.uniform(-1.0, 1.0, 7) for _ in range(30)])
    body = Pose(np.array([-0.7, -0.2, -0.1]), turns_about([0.1, 0.2, 0.3]))
    scene = CollisionScene(ROBOT, [Rock("rock", hold, Pose.identity(), frozenset())])
    space = some_space(scene, {"front_left": angles[0]}, ("front_left",), [body])
    found = space.clearances(angles)[:, -len(scene.own["front_left"]) :]
    segments = body.apply(scene.limbs["front_left"].segments(angles).reshape(-1, 3))
    radii = scene.radii[scene.own["front_left"]]
    shape, place = hold_shape(hold)
    for away, ends in zip(found, segments.reshape(30, -1, 2, 3), strict=True):
        for near, solid in zip(away, capsule_solids([""] * len(radii), ends, radii), strict=True):
            want, _ = distance_between(solid, solid._replace(shape=shape, place=place))
            # behind triangles coal counts as outside again
            if near > 1e-6 and want < 0.15:
                seen += 1
                assert want - 2.5e-3 <= near <= want + 1e-5
    assert seen > 10


def hold_shape(hold):
    """The hold's surface for coal, in fine triangles where it is round."""
    if isinstance(hold, Cylinder):
        vertices, faces = cylinder_mesh(hold.diameter, 2048, 8.0)
    else:
        vertices, faces = hold.surface(np.full(3, -2.0), np.full(3, 2.0))
    shape = coal.BVHModelOBBRSS()
    shape.beginModel(len(faces), len(vertices))
    shape.addVertices(np.ascontiguousarray(vertices))
    shape.addTriangles(np.ascontiguousarray(faces, dtype=np.int64))
    shape.endModel()
    return shape, coal.Transform3s.Identity()


def test_the_nearest_two_are_those_of_a_plans_clearance():
    """What `"want": ["clearance"]` measures by coal."""
    stance = at_joints(ROBOT, posture(), tuple(posture()), body=BODY, hold=Cylinder(0.3))
    settled = settle_stance(stance)
    scene = CollisionScene(ROBOT, rocks_of(zip(stance.hands, settled, strict=True)))
    want = clearance(scene_of(stance, settled), posture())
    least = min((want.link_link, want.hand_hand, want.hand_body), key=lambda each: each.distance)
    scene.rocks = ()
    found = scene.nearest(BODY, posture())
    assert {found.first, found.second} == set(least.between)
    assert found.distance == pytest.approx(least.distance, abs=1e-6)


def test_rock_of_several_hands_at_one_place_is_one():
    stance = at_joints(ROBOT, posture(), tuple(posture()), body=BODY)
    settled = settle_stance(stance)
    one = rough()
    hands = [replace(hand, hold=one) for hand in stance.hands]
    there = [each.seating.pose.inverse() for each in settled]
    same = [replace(hand, pose=BODY @ pose) for hand, pose in zip(hands, there, strict=True)]
    (found,) = rocks_of(zip(same, settled, strict=True))
    assert found.limbs == frozenset(stance.robot.limbs)
    assert found.pose.position == pytest.approx(BODY.position)
    assert len(rocks_of(zip(hands, settled, strict=True))) == 4


@given(seeds)
@settings(max_examples=20, deadline=None)
def test_distances_change_no_faster_than_their_bounds(seed):
    """By any step of joints that turn, slide or follow, and of the body."""
    rng = np.random.default_rng(seed)
    robot = ROBOT if seed % 2 else random_arms(seed % 8)[0]
    scene = CollisionScene(robot, [rock(), ball([0.2, 0.1, 0.1])])
    joints = random_angles(robot, rng)
    bodies = [Pose(BODY.position + rng.normal(0.0, 0.1, 3), turns_about(rng.normal(0.0, 0.3, 3)))]
    bodies += [Pose(bodies[0].position + rng.normal(0.0, 0.1, 3), BODY.rotation)]
    space = some_space(scene, joints, robot.limbs, bodies)
    ends = rng.uniform(
        np.maximum(space.lower, -1.0), np.minimum(space.upper, 1.0), (2, len(space.start))
    )
    ends[1] = ends[0] + rng.uniform(0.0, 1.0) * (ends[1] - ends[0])
    before, after = space.clearances(ends, np.inf)
    motion = space.motions(ends[1:] - ends[:1])[0]
    assert before.shape == motion.shape
    # points along a capsule leave out as much as their spacing says
    assert (np.abs(after - before) <= motion + 2e-3).all()


@given(seeds)
@settings(max_examples=10, deadline=None)
def test_clearances_are_the_same_wherever_the_world_begins(seed):
    rng = np.random.default_rng(seed)
    by, angles = moved_by(rng), posture()["front_left"] + rng.uniform(-0.5, 0.5, (3, 7))
    rocks = [rock(), ball([0.2, 0.1, 0.1]), rock(rough())]
    moved = [each._replace(pose=by @ each.pose) for each in rocks]
    found = [
        some_space(CollisionScene(ROBOT, each), posture(), ("front_left",), [body]).clearances(
            angles
        )
        for each, body in ((rocks, BODY), (moved, by @ BODY))
    ]
    assert found[1] == pytest.approx(found[0], abs=1e-9)


def test_limbs_that_are_each_other_half_turned_are_as_clear():
    """Limbs are alike after half a turn about z of B, but for the camera in front."""
    turn = Pose(np.zeros(3), np.diag([-1.0, -1.0, 1.0]))
    other = dict(
        zip(ROBOT.limbs, ("rear_left", "front_left", "front_right", "rear_right"), strict=True)
    )
    rng = np.random.default_rng(4)
    joints = {limb: angles + rng.uniform(-0.4, 0.4, 7) for limb, angles in posture().items()}
    turned = {other[limb]: angles for limb, angles in joints.items()}
    scene = CollisionScene(ROBOT, [rock(), ball([0.3, 0.2, 0.1])])
    camera = int(np.flatnonzero(scene.body[:, 0, 0] > 0.4)[0])
    found = []
    for limb, angles, body in (
        ("front_left", joints, BODY),
        (other["front_left"], turned, BODY @ turn),
    ):
        space = some_space(scene, angles, (limb,), [body])
        away = space.clearances(space.start[None])[0]
        pairs = scene.pairs[np.isin(scene.pairs, scene.own[limb]).any(axis=1)]
        with_camera = np.flatnonzero((pairs == camera).any(axis=1))
        found.append(np.sort(np.delete(away, with_camera)))
    assert found[1] == pytest.approx(found[0], abs=1e-6)


def test_a_closed_hand_is_not_measured_from_its_own_rock():
    scene = CollisionScene(ROBOT, [rock(), ball([0.9, 0.9, 0.0])])
    held = scene.nearest(BODY, posture())
    assert held.distance > 0.02
    free = some_space(scene, posture(), ("front_left",))
    assert free.nearest(free.start) == ("hand of front_left", "wall", pytest.approx(0.0, abs=1e-3))
    closed = some_space(scene, posture(), ("front_left",), touching=("front_left",))
    assert closed.nearest(closed.start).distance > 0.02
    # a deep one is named as such
    down = Pose(BODY.position - 0.4 * BODY.rotation[:, 2], BODY.rotation)
    deep = scene.nearest(down, posture())
    assert deep.distance < 0.0
    assert "mm deep in wall" in str(deep)
