"""The reach table: its entries, against Pinocchio and the planner's own inverse kinematics."""

from functools import cache

import numpy as np
import pytest

from hand_models.base import Pose, turns_about
from planner.limbs import LimbChain
from planner.motion import CollisionScene
from planner.programs import WRENCH_UNIT
from planner.reach import (
    REACH_SETTINGS,
    Starts,
    body_wrenches,
    limb_moments,
    reach_poses,
    reach_table,
)
from planner.robots import UnreachableError, robosimian, solve_limbs

INTO = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])  # x up, z into the rock


def placed(rng, count):
    """Placements on a wall at x = 0, turned at random."""
    turns = turns_about(rng.uniform(-0.4, 0.4, (count, 3)))
    places = np.column_stack([np.zeros(count), rng.uniform(-1.0, 1.0, (count, 2))])
    return [Pose(place, INTO @ turn) for place, turn in zip(places, turns, strict=True)]


def bodies_before(rng, count):
    spots = rng.uniform([-0.6, -0.3, -0.3], [-0.35, 0.3, 0.3], (count, 3))
    return [
        Pose(spot, turns_about(turn))
        for spot, turn in zip(spots, rng.uniform(-0.2, 0.2, (count, 3)), strict=True)
    ]


@cache
def some_table(clear):
    rng = np.random.default_rng(1)
    placements, bodies = placed(rng, 12), bodies_before(rng, 5)
    return placements, bodies, reach_table(robosimian(), placements, bodies, clear=clear)


def test_tables_of_some_bodies_and_of_the_others_are_the_table_of_all():
    placements, bodies, table = some_table(True)
    first, rest = (reach_table(robosimian(), placements, of) for of in (bodies[:2], bodies[2:]))
    for name, value in vars(first.beside(rest)).items():
        np.testing.assert_array_equal(getattr(table, name), value)


def test_every_solution_reaches_its_placement_within_limits():
    robot, (placements, bodies, table) = robosimian(), some_table(True)
    scene = CollisionScene(robot, ())
    assert 20 < table.reached.sum() < 200
    for p, b, i in np.argwhere(table.reached).tolist():
        limb, target = robot.limbs[i], bodies[b].inverse() @ placements[p]
        found = table.branches(p, b, i)
        assert 1 <= len(found) <= REACH_SETTINGS.branches
        for angles in found:
            pose = robot.hand_poses({limb: angles})[limb]  # refuses angles beyond their limits
            np.testing.assert_allclose(pose.position, target.position, atol=1e-6)
            np.testing.assert_allclose(pose.rotation, target.rotation, atol=1e-6)
            segments = scene.placed({limb: angles})
            mine = [*range(len(scene.body)), *scene.own[limb].tolist()]
            for k, m in scene.pairs.tolist():
                if k in mine and m in mine and m >= len(scene.body):
                    apart = least_distance(*segments[[k, m]]) - scene.radii[[k, m]].sum()
                    assert apart > -1e-3  # what the points of a segment leave out
        for first in range(len(found)):
            for second in range(first):
                assert np.abs(found[first] - found[second]).max() > REACH_SETTINGS.alike


def least_distance(first, second):
    """The distance of two segments, from points along them."""
    parts = np.linspace(0.0, 1.0, 60)[:, None]
    a, b = (end[0] + parts * (end[1] - end[0]) for end in (first, second))
    return np.linalg.norm(a[:, None] - b[None], axis=2).min()


@pytest.mark.parametrize(
    ("tried", "beyond"), [(12, 2), pytest.param(200, 20, marks=pytest.mark.slow)]
)
def test_misses_nothing_that_the_planner_reaches(tried, beyond):
    robot, (placements, bodies, table) = robosimian(), some_table(False)
    missed, reached = 0, 0
    near = np.argwhere(table.spanned)
    for p, b, i in near[np.random.default_rng(2).permutation(len(near))[:tried]].tolist():
        pose = bodies[b].inverse() @ placements[p]
        try:
            solve_limbs(robot, {robot.limbs[i]: pose}, {}, np.zeros(3))
        except UnreachableError:
            continue
        reached += 1
        missed += not table.reached[p, b, i]
    assert reached > 0.2 * min(tried, len(near))
    assert missed <= 0.01 * reached
    # and beyond the span the planner reaches nothing either
    for p, b, i in np.argwhere(~table.spanned)[:: 1 + (~table.spanned).sum() // beyond].tolist():
        pose = bodies[b].inverse() @ placements[p]
        with pytest.raises(UnreachableError):
            solve_limbs(robot, {robot.limbs[i]: pose}, {}, np.zeros(3))


def test_reaches_the_poses_of_random_postures():
    robot = robosimian()
    limb = robot.limbs[1]
    chain = LimbChain.of(robot, limb)
    low, high = np.maximum(chain.lower, -np.pi), np.minimum(chain.upper, np.pi)
    postures = np.random.default_rng(5).uniform(low, high, (1000, len(low)))
    targets = chain.frames(postures)
    angles, count = reach_poses(chain, Starts(chain), targets)
    assert (count > 0).mean() > 0.99
    again = np.repeat(targets, count, axis=0)
    np.testing.assert_allclose(chain.frames(angles), again, atol=1e-7)
    # only those that fit are returned, and further ones are searched where none does
    some, fewer = reach_poses(chain, Starts(chain), targets[:200], 3, lambda q, _: q[:, 0] > 0.0)
    assert (some[:, 0] > 0.0).all()
    assert (fewer <= 3).all()
    first = np.cumsum(count[:200]) - count[:200]
    had = np.add.reduceat(angles[: count[:200].sum(), 0] > 0.0, first[count[:200] > 0]) > 0
    assert (fewer[count[:200] > 0] > 0)[had].all()


def test_moves_with_the_world():
    """Placements and bodies moved together have the same entries."""
    robot, (placements, bodies, table) = robosimian(), some_table(True)
    moved = Pose(np.array([1.0, -2.0, 3.0]), turns_about(np.array([0.3, -0.5, 0.7])))
    again = reach_table(robot, [moved @ p for p in placements], [moved @ b for b in bodies])
    assert (again.reached != table.reached).mean() < 0.01


def test_weights_are_those_of_the_posture():
    """Body wrench and moments of limbs are those of the robot at the angles of all of them."""
    robot, (_placements, bodies, table) = robosimian(), some_table(True)
    about, gravity = np.array([0.1, -0.2, 0.3]), np.array([0.5, -1.0, -9.0])
    wrenches = body_wrenches(robot, bodies, about, gravity)
    moments = limb_moments(robot, table, bodies, gravity)
    assert np.abs(moments).max() > 0.1
    for b, body in enumerate(bodies):
        first = {i: np.flatnonzero(table.reached[:, b, i]) for i in range(len(robot.limbs))}
        chosen = {i: int(some[0]) for i, some in first.items() if len(some)}
        posture = {robot.limbs[i]: table.branches(p, b, i)[0] for i, p in chosen.items()}
        turned = np.linalg.inv(body.rotation) @ gravity
        statics = robot.statics(posture, turned).body_wrench
        force, moment = body.rotation @ statics[:3], body.rotation @ statics[3:]
        moment = moment + np.cross(body.position - about, force)
        total = wrenches[b].copy()
        total[3:] += sum(moments[b, i, p] for i, p in chosen.items())
        np.testing.assert_allclose(total * WRENCH_UNIT, [*force, *moment], atol=1e-8)
