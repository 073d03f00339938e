"""The floating wrist's set: by search, by successive linear programs, by a list of linear sets."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq, minimize

from hand_models import InvalidInputError
from hand_models.base import EmptySetError
from hand_models.compliance import (
    PLANAR_COMPONENTS,
    CompliantHand,
    FloatingWrist,
    Gripper,
    boundary,
    farthest,
    gripper_table,
    linear_extreme,
    pieces,
    pose_units,
    search_box,
    search_grid,
    wrist_pose,
)
from hand_models.finger import FingerModel, settle_finger
from hand_models.hand import Grasp
from hand_models.parameters import ParameterTable, Quantity, experiment_table, hand_table
from hand_models.rock import Cylinder, Plane, Sphere
from hand_models.tendon import FingerTendon
from hand_models.tile import Surface
from hand_models.wrench_spaces import WRENCH_SCALE
from tests.hand_models.tendon.test_finger_tendon import by_enumeration
from tests.suite.helpers.hands import HAND

PINCH = Grasp(outer_rotation=math.pi)
GRIPPER = Gripper(0.3, 37.0)
CAPPED = Gripper(0.3, 37.0, most_pressing=0.9)
"""Of the paper's surface: Coulomb friction alone holds what presses, in corners too thin for rays
from the middle."""

TWISTS = np.random.default_rng(7).normal(size=(200, 3)) * [3e-4, 3e-4, 4e-3]
MIRROR = np.array([-1.0, 1.0, -1.0])


def floating(hold=None, grasp=PINCH, surface="rock", palm=False):
    grasp = Grasp(outer_rotation=grasp.outer_rotation, palm=palm)
    settled = HAND.settle(hold or Cylinder(0.3), Surface.named(surface), grasp)
    return FloatingWrist(CompliantHand(settled))


def planar(way):
    direction = np.zeros(6)
    direction[list(PLANAR_COMPONENTS)] = way
    return direction


# The gripper ------------------------------------------------------------------------------------


def test_a_grippers_finger_is_the_scalar_model_step_by_step():
    """Settle the moved finger, ask the tendon, balance the joints: all without the fast path."""
    gripper = GRIPPER
    x, z, turn = 2e-4, -4e-4, 0.006
    loads, _ = gripper.finger_loads(np.array([[x, z, turn]]))
    deep, spread = gripper.origin_height, gripper.half_spacing
    base = (
        x + spread * (math.cos(turn) - 1.0) - deep * math.sin(turn),
        z - spread * math.sin(turn) - deep * (math.cos(turn) - 1.0),
    )
    rest = gripper.finger
    model: FingerModel = rest.model
    moved = settle_finger(model, gripper.section, base)
    centre, radius = gripper.section.centre, gripper.section.radius
    cx, cz = centre.real, centre.imag

    def arc(point):
        return radius * math.atan2(point[0] - cx, cz - point[1])

    slips = [
        (now.along - then.along) - (arc(p) - arc(p0))
        for now, then, p, p0 in zip(
            moved.contacts, rest.contacts, moved.points, rest.points, strict=True
        )
    ]
    turned = np.diff([-turn, *(c.angle for c in moved.contacts)])
    turns = turned - rest.joint_angles
    table = gripper.table
    tendon = FingerTendon(
        2.0,
        table.vector("gripper", "contact_stiffness"),
        table.scalar("tile", "spring_stiffness"),
        model.pulley_radii,
        table.scalar("tendon", "holding_friction"),
        table.scalar("gripper", "entry_friction"),
    )
    start = FingerTendon(2.0, (1.0,) * 3, 1.0, model.pulley_radii, 0.0).closed(
        37.0, rest.shears(37.0) @ [1.0, 37.0]
    )
    travel, tensions = by_enumeration(tendon, start, np.array(slips), turns, 37.0)[0]
    shears = start.shears + np.array(tendon.contact_stiffness) * (slips + travel)
    np.testing.assert_allclose(loads.shears[0], shears, atol=1e-8)
    np.testing.assert_allclose(loads.tensions[0], tensions, atol=1e-8)
    # joint torques of the loads found, joint by joint
    for i, contact in enumerate(moved.contacts):
        torque = tensions[i] * model.pulley_radii[i]
        torque -= model.joint_stiffness[i] * turned[i] + model.joint_preload[i]
        for j in range(i, 3):
            force = loads.forces[0, j]
            arm = moved.points[j] - np.array(contact.joint)
            torque -= arm[0] * force[1] - arm[1] * force[0]
        assert torque == pytest.approx(0.0, abs=1e-9)


def test_mirrored_poses_have_mirrored_wrenches():
    straight = GRIPPER.evaluate(TWISTS)
    mirrored = GRIPPER.evaluate(TWISTS * MIRROR)
    np.testing.assert_allclose(
        mirrored.wrenches[:, PLANAR_COMPONENTS],
        straight.wrenches[:, PLANAR_COMPONENTS] * MIRROR,
        atol=1e-9,
    )
    np.testing.assert_allclose(mirrored.utilisation, straight.utilisation, atol=1e-9)


def test_the_moment_is_that_of_the_forces_about_the_origin():
    loads = GRIPPER.finger_loads(TWISTS)
    spread, deep = GRIPPER.half_spacing, GRIPPER.origin_height
    total = np.zeros(len(TWISTS))
    for side, sign in zip(loads, (1.0, -1.0), strict=True):
        x = sign * (spread + side.points[..., 0])
        z = side.points[..., 1] - deep
        total += (z * sign * side.forces[..., 0] - x * side.forces[..., 1]).sum(axis=1)
    np.testing.assert_allclose(GRIPPER.evaluate(TWISTS).wrenches[:, 4], total, atol=1e-9)


def test_the_grippers_linear_set_has_its_slopes():
    space, small = GRIPPER.linearised(TWISTS[0]), 1e-8
    ends = [GRIPPER.evaluate(TWISTS[0] + side * small * np.eye(3)) for side in (1.0, -1.0)]
    slope = (ends[0].wrenches - ends[1].wrenches).T / (2.0 * small)
    np.testing.assert_allclose(space.generators, slope, rtol=1e-5, atol=1e-2)
    np.testing.assert_allclose(
        space.wrench(TWISTS[0]), GRIPPER.evaluate(TWISTS[:1]).wrenches[0], atol=1e-9
    )


def test_a_callers_entries_go_before_the_experiments():
    own = Quantity([0.0055, 0.003, 0.002], "m", "assumed", "a test")
    hand = hand_table().replaced(ParameterTable({"finger": {"pulley_radii": own}}))
    assert gripper_table(hand).quantity("finger", "pulley_radii") == own
    calibrated = experiment_table().quantity("gripper", "pulley_radii")
    assert gripper_table(hand_table()).quantity("finger", "pulley_radii") == calibrated


@pytest.mark.parametrize(
    ("diameter", "tension", "field"),
    [
        *((value, 37.0, "diameter") for value in (0.0, -0.3, math.nan, math.inf)),
        *((0.3, value, "tension") for value in (0.0, -37.0, math.nan, math.inf)),
    ],
)
def test_an_impossible_gripper_is_refused(diameter, tension, field):
    with pytest.raises(InvalidInputError, match=field):
        Gripper(diameter, tension)


# Search -----------------------------------------------------------------------------------------


def test_the_search_finds_what_a_plain_grid_finds_and_more():
    found = search_grid(GRIPPER, 25)
    assert found.tried == 25**3
    assert 0 < found.held < found.tried
    # poses on the boundary: nothing lets go, and a hair further something does
    verdict = GRIPPER.evaluate(found.poses)
    assert verdict.utilisation.max() <= 1.0
    beyond = found.box.centre + (found.poses - found.box.centre) * (1.0 + 1e-6)
    assert not GRIPPER.evaluate(beyond).holds.any()
    plain = np.stack(np.meshgrid(*[np.linspace(-1.0, 1.0, 25)] * 3, indexing="ij"), axis=-1)
    plain = plain.reshape(-1, 3) * [1.6e-3, 1.2e-3, 0.03]
    held = GRIPPER.evaluate(plain)
    wrenches = held.wrenches[held.holds]
    for way in np.vstack([np.eye(3), -np.eye(3)]):
        assert found.support(planar(way)) >= 0.97 * float((wrenches @ planar(way)).max())


def test_a_finer_search_and_rays_agree():
    coarse, rays = search_grid(CAPPED, 40), boundary(CAPPED, search_box(CAPPED), 3000)
    for way in np.random.default_rng(0).normal(size=(50, 3)):
        direction = planar(way / np.linalg.norm(way) * WRENCH_SCALE[list(PLANAR_COMPONENTS)])
        # in shares of the set's size: both miss the very corners
        size = 0.5 * (rays.support(direction) + rays.support(-direction))
        assert coarse.support(direction) == pytest.approx(rays.support(direction), abs=0.05 * size)


@pytest.mark.slow
def test_the_set_is_skew_symmetric():
    found = boundary(CAPPED, search_box(CAPPED), 16000)
    for way in np.random.default_rng(1).normal(size=(50, 3)):
        direction = planar(way * WRENCH_SCALE[list(PLANAR_COMPONENTS)])
        mirrored = planar(way * MIRROR * WRENCH_SCALE[list(PLANAR_COMPONENTS)])
        size = 0.5 * (found.support(direction) + found.support(-direction))
        assert found.support(direction) == pytest.approx(found.support(mirrored), abs=0.05 * size)


def test_a_closing_that_is_too_tight_leaves_nothing():
    with pytest.raises(EmptySetError):
        search_grid(Gripper(0.3, 300.0), 15)


@pytest.mark.slow
def test_the_search_of_a_whole_hand_reaches_as_far_as_the_linear_programs_nearly():
    wrist = floating(surface="sandpaper-36")
    found = search_grid(wrist, 4)
    assert found.tried == 4**6
    assert (wrist.evaluate(found.poses).utilisation <= 1.0).all()
    for i in range(6):
        for sign in (1.0, -1.0):
            direction = sign * np.eye(6)[i]
            best = found.wrenches[int((found.wrenches @ direction).argmax())] @ direction
            pose = found.poses[int((found.wrenches @ direction).argmax())]
            assert farthest(wrist, direction, pose).reach >= best - 1e-6


# Limits along directions ------------------------------------------------------------------------


def test_the_farthest_wrench_is_a_local_maximum():
    for way in ([1.0, 0.0, 0.0], [0.3, -1.0, 10.0]):
        direction = planar(way)
        found = farthest(GRIPPER, direction)
        assert found.limiting is not None
        assert GRIPPER.evaluate(found.twist[None]).utilisation[0] <= 1.0 + 1e-5

        def short(pose, direction=direction):
            there = GRIPPER.evaluate((pose * [1e-3, 1e-3, 1e-2])[None])
            excess = max(there.utilisation[0] - 1.0, there.violation[0], 0.0)
            return float(-direction @ there.wrenches[0] + 1e3 * excess)

        start = found.twist / [1e-3, 1e-3, 1e-2]
        other = minimize(short, start, method="Nelder-Mead", options={"xatol": 1e-9})
        assert -other.fun <= found.reach + 1e-3 * abs(found.reach)


def test_a_pull_lets_go_where_bisection_says():
    """A symmetric pull along −z: one unknown, so a root of the utilisation tells the pose."""

    def used(z):
        return float(GRIPPER.evaluate(np.array([[0.0, z, 0.0]])).utilisation[0]) - 1.0

    z = brentq(used, -3e-3, 0.0)
    straight = GRIPPER.evaluate(np.array([[0.0, z, 0.0]])).wrenches[0]
    found = farthest(GRIPPER, planar([0.0, -1.0, 0.0]))
    assert found.reach >= -straight[2] - 1e-3


# A list of linear sets --------------------------------------------------------------------------


def pulls(n, seed):
    """Directions of the wrench that do not press."""
    ways = np.random.default_rng(seed).normal(size=(n, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    ways *= np.where(ways[:, 1:2] > 0.0, -1.0, 1.0)
    return np.array([planar(way * WRENCH_SCALE[list(PLANAR_COMPONENTS)]) for way in ways])


@pytest.mark.slow
def test_a_few_linear_sets_stand_for_the_whole_within_five_percent():
    found = pieces(GRIPPER, pulls(60, 0))
    assert found.error <= 0.05
    assert 2 <= len(found.pieces) <= 12
    # also in directions that were not looked at, against the search
    elsewhere = pulls(20, 1)
    rays = boundary(GRIPPER, search_box(GRIPPER), 4000, toward=elsewhere)
    rest = GRIPPER.evaluate(np.zeros((1, 3))).wrenches[0]
    for direction in elsewhere:
        union = max(linear_extreme(piece.space, direction)[1] for piece in found.pieces)
        exact = max(rays.support(direction), farthest(GRIPPER, direction).reach)
        offset = float(direction @ rest)
        assert union - offset == pytest.approx(exact - offset, rel=0.06)


@pytest.mark.parametrize("others", [8, pytest.param(20, marks=pytest.mark.slow)])
def test_one_linear_set_at_rest_does_not(others):
    space = GRIPPER.linearised()
    rest = GRIPPER.evaluate(np.zeros((1, 3))).wrenches[0]
    off = []
    for direction in pulls(others, 2):
        offset = float(direction @ rest)
        exact = farthest(GRIPPER, direction).reach - offset
        off.append(abs((linear_extreme(space, direction)[1] - offset) / exact - 1.0))
    assert max(off) > 0.1


# Wrench to pose ---------------------------------------------------------------------------------


GRASPS = {
    "pinch": (Cylinder(0.3), math.pi, True),
    "oblique": (Cylinder(0.7), 1.2, True),
    "plane": (Plane(), 0.0, True),
    "sphere": (Sphere(0.4), 2.0, False),
}


def wrenches_inside(wrist, count):
    """Wrenches at random poses near rest at which nothing lets go."""
    box, rng = search_box(wrist), np.random.default_rng(3)
    found = np.zeros((0, 6))
    for _ in range(100):
        poses = box.poses(rng.uniform(-1.0, 1.0, (20000, 6)) * box.range)
        near = (np.abs(poses) <= 10.0 * pose_units(wrist.columns)).all(axis=1)
        poses = poses[near]  # 10 mm and 0.1 rad: farther no twist is small
        there = wrist.evaluate(poses[wrist.sieve(poses)])
        found = np.vstack([found, there.wrenches[there.holds]])
        if len(found) >= count:
            return found[:count]
    raise AssertionError("too few poses hold")


@pytest.mark.slow
@pytest.mark.parametrize("name", GRASPS)
def test_newton_finds_the_pose_of_a_thousand_wrenches(name):
    hold, rotation, palm = GRASPS[name]
    wrist = floating(hold, Grasp(outer_rotation=rotation), palm=palm)
    wrenches = wrenches_inside(wrist, 250)
    found = [wrist_pose(wrist.hand, wrench) for wrench in wrenches]
    assert all(pose.converged for pose in found)
    back = wrist.evaluate(np.array([pose.twist for pose in found])).wrenches
    np.testing.assert_allclose(back * WRENCH_SCALE, wrenches * WRENCH_SCALE, atol=1e-6)


def test_the_rest_wrench_needs_no_step():
    wrist = floating()
    pose = wrist_pose(wrist.hand, wrist.evaluate(np.zeros((1, 6))).wrenches[0])
    assert pose.converged
    np.testing.assert_array_equal(pose.twist, 0.0)


@pytest.mark.slow
def test_a_wrench_beyond_reach_is_said_to_be_so():
    pose = wrist_pose(floating().hand, [0.0, 0.0, -1e5, 0.0, 0.0, 0.0])
    assert not pose.converged
    assert np.abs(pose.residual).max() > 1.0


def test_a_wrench_that_is_none_is_refused():
    with pytest.raises(InvalidInputError, match="wrench"):
        wrist_pose(floating().hand, [math.nan] * 6)
