"""Twist of fingers whose tiles bear on one side: by hand, and from forces and places in space."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import strategies as st

from hand_models import Cylinder, Grasp, Plane, Pose
from hand_models.compliance import CompliantHand, FloatingWrist
from hand_models.fixed_wrist import FINGER_TWIST, wrench_space
from hand_models.hand import FINGERS
from hand_models.rock import Mesh, Profile
from planner.prepare import settle_hand
from planner.solving import plan
from service.answering import question
from service.commands.stances import read_request
from tests.suite.helpers.checks import problems
from tests.suite.helpers.hands import HAND, ROCK, changed_hand
from tests.suite.helpers.robots import with_hand
from tests.suite.helpers.rocks import fractal_wall, height_map, random_profile
from tests.suite.helpers.shares import given_some

seeds = st.integers(0, 2**32 - 1)

LIMIT = 3.6
"""What a joint carries about its phalanx [N·m]."""

PHALANGES = ("proximal", "middle", "distal")


def rough(seed, turned=math.pi):
    """A hand on a rough wall, its outer fingers turned."""
    return HAND.settle(
        Mesh(*fractal_wall(seed, size=0.45, count=91, height=0.003)), ROCK, Grasp(turned)
    )


def twists(space, loads):
    """Load of each row of a twist [N·m], by its label."""
    found = space.L @ loads + space.l0
    named = zip(space.rows, found.tolist(), strict=False)
    return {row.label: load for row, load in named if row.limit == FINGER_TWIST}


def twists_of(settled, tile_loads, places, axes):
    """The same from forces and places in H, and each joint's line along its phalanx.

    What tiles from the joint on exert about that line, with their forces in the finger's plane.
    """
    found, spacing = {}, settled.hand.finger.joint_spacing
    frames = settled.hand.frames(settled.grasp.outer_rotation)
    for i, (frame, finger) in enumerate(zip(frames, settled.fingers, strict=True)):
        own = np.flatnonzero(settled.finger_of == i)[-3:]
        for j, contact in enumerate(finger.contacts):
            begin, end = (
                frame.joint + x * frame.along + z * np.array([0.0, 0.0, 1.0])
                for x, z in (contact.joint, contact.end(spacing))
            )
            along = (end - begin) / np.linalg.norm(end - begin)
            about = 0.0
            for tile in own[j:]:
                shear, normal = tile_loads[tile, :2]
                force = shear * axes[tile, 0] + normal * axes[tile, 1]
                about += np.cross(places[tile] - begin, force) @ along
            for sign, side in (("+", 1.0), ("-", -1.0)):
                found[f"{FINGERS[i]}/{PHALANGES[j]}/{FINGER_TWIST}{sign}"] = side * about
    return found


def test_of_a_tile_on_a_shelf_it_is_what_is_worked_by_hand():
    """A straight finger whose proximal tile alone bears, with its left half, on level rock.

    The tendon's moment about the proximal joint is balanced by the tile's normal load N alone, at
    the contact's c from the joint, and by its shear T at the tile's height h:
    N c = f r − K q − h T. It acts a quarter of the tile's width beside the plane.
    """
    inner = FINGERS.index("inner_left")
    middle = HAND.frames(0.0)[inner].joint[1]
    y = 1e-3 * np.arange(-100, 101)
    heights = np.tile(np.where(y > middle, 0.0, 0.03), (201, 1))
    pose = Pose(np.array([0.0, 0.0, 0.0041]), np.eye(3))
    hand = HAND.settle(Mesh(*height_map(heights, 1e-3)), ROCK, Grasp(0.0), pose)
    contact, f = hand.fingers[inner].contacts[0], 120.0
    (tile,) = [i for i in np.flatnonzero(hand.finger_of == inner) if hand.engagement[i] > 0.0]
    assert [c.kind for c in hand.fingers[inner].contacts] == ["face", "none", "none"]
    space = wrench_space(hand)
    loads = np.zeros(len(space.columns))
    loads[inner] = f
    shear = hand.tile_loads(loads[:4])[tile, 0]
    model = hand.hand.finger
    torque = f * model.pulley_radii[0] - model.joint_stiffness[0] * contact.angle
    height = model.tile_height + contact.rise
    normal = (torque - height * shear) / contact.along
    # the shelf's edge is a millimetre wide, a strip nearly two
    assert contact.across == pytest.approx(0.0215 / 4.0, abs=1.2e-3)
    found, about = twists(space, loads), contact.across * normal
    # the face is a few milliradians off the rock
    assert found["inner_left/proximal/finger_twist+"] == pytest.approx(about, rel=1e-3)
    assert found["inner_left/proximal/finger_twist-"] == pytest.approx(-about, rel=1e-3)
    assert {label for label in found if label.startswith("inner_left")} == {
        f"inner_left/proximal/finger_twist{sign}" for sign in "+-"
    }
    # as a share of what the joint carries
    used = dict(zip([row.label for row in space.rows], space.utilisations(loads), strict=False))
    assert used["inner_left/proximal/finger_twist+"] == pytest.approx(about / LIMIT, rel=1e-3)


@given_some(6, 40, seeds)
def test_rows_are_moments_about_the_lines_of_phalanges(seed):
    hand = rough(seed % 50, 1.0 + seed % 3)
    space = wrench_space(hand)
    loads = np.random.default_rng(seed).uniform(0.0, 300.0, len(space.columns))
    tile_loads = hand.tile_loads(loads[:4])
    want = twists_of(hand, tile_loads, hand.positions, hand.axes)
    found = twists(space, loads)
    assert len(found) >= 6
    for label, moment in want.items():
        assert found.get(label, 0.0) == pytest.approx(moment, rel=1e-7, abs=1e-7)
    # lateral reactions and the palm twist no joint: spines limit these
    others = loads.copy()
    others[4:] += 100.0
    assert twists(space, others) == found


@pytest.mark.parametrize("seed", [3, 8])
def test_where_the_wrist_gives_way_rows_are_the_same_moments(seed):
    hand = rough(seed)
    compliant = CompliantHand(hand)
    space = FloatingWrist(compliant).linearised()
    loads = np.zeros(len(wrench_space(hand).columns))
    loads[:4] = hand.closing_tension
    at_rest, fixed = twists(space, np.zeros(6)), twists(wrench_space(hand), loads)
    assert at_rest.keys() == fixed.keys()
    np.testing.assert_allclose(list(at_rest.values()), list(fixed.values()), atol=1e-7)
    # and where it has moved, about the phalanges as they were
    twist = np.array([1e-4, -1e-4, -2e-4, 5e-4, -5e-4, 1e-3])
    moved = compliant.loads(twist[None])
    want = twists_of(hand, moved.tile_loads[0], moved.positions[0], moved.axes[0])
    there = twists(FloatingWrist(compliant).linearised(twist), twist)
    assert there.keys() == fixed.keys()
    for label, moment in there.items():
        assert moment == pytest.approx(want[label], abs=1e-7)
    assert max(abs(there[label] - at_rest[label]) for label in there) > 1e-4


def test_rock_that_is_alike_across_fingers_twists_none():
    x = np.linspace(-0.14, 0.14, 281)
    heights = np.tile((0.15 - np.sqrt(0.15**2 - x**2))[:, None], (1, 281))
    log = Mesh(*height_map(heights, 1e-3))
    drawn = Profile(random_profile(np.random.default_rng(5)).outlines[0])
    for hold in (Plane(), Cylinder(0.3), log, drawn):
        space = wrench_space(HAND.settle(hold, ROCK, Grasp(math.pi)))
        assert not twists(space, np.zeros(len(space.columns)))


@pytest.mark.parametrize("wrist", ["fixed", pytest.param("compliant", marks=pytest.mark.slow)])
def test_a_plan_that_it_overloads_names_the_joint(wrist):
    asked = question(read_request("boulders"))
    weak = with_hand(asked.stance.robot, changed_hand("structure", FINGER_TWIST, 0.004))
    hands = tuple(replace(hand, wrist=wrist) for hand in asked.stance.hands)
    answer = plan(replace(asked, stance=replace(asked.stance, robot=weak, hands=hands)))
    assert answer.status == "overloaded"
    assert answer.verified
    name = answer.limiting
    assert name.limit == FINGER_TWIST
    start = f"{name.limb}: {name.phalanx} joint of {name.finger} would carry "
    assert answer.reason.startswith(start), answer.reason
    assert " N·m of 0.004 N·m about its phalanx" in answer.reason


@pytest.mark.slow
def test_however_weak_a_joint_compliant_hands_find_their_balance_with_much_the_same_twist():
    """A balance knows no limit, and where twist is all that counts, the least is much the same."""
    asked = question(read_request("boulders"))
    hands = tuple(replace(hand, wrist="compliant") for hand in asked.stance.hands)
    found = []
    for limit in (2e-3, 5e-4, 1e-4):
        weak = with_hand(asked.stance.robot, changed_hand("structure", FINGER_TWIST, limit))
        answer = plan(replace(asked, stance=replace(asked.stance, robot=weak, hands=hands)))
        assert answer.status == "overloaded"
        assert answer.limiting.limit == FINGER_TWIST
        found.append(answer.utilisation * limit)
    assert max(found) <= 1.03 * min(found)


def test_the_check_of_plans_knows_it():
    """The plan of hands that bear it, checked for hands that bear less."""
    asked = question(read_request("boulders"))
    answer = plan(asked)
    weak = changed_hand("structure", FINGER_TWIST, 0.004)
    settled = [replace(settle_hand(hand, asked.stance), hand=weak) for hand in asked.stance.hands]
    found = problems(asked, answer, settled=settled)
    assert any("plan: utilisation is" in each for each in found)
