"""A hand whose wrist gives way: what it is at rest, and how stiff."""

import math
from dataclasses import replace

import numpy as np
import pytest

from hand_models import InvalidInputError
from hand_models.base import UnsupportedError
from hand_models.compliance import COMPLEX_STEP, CompliantHand, FloatingWrist
from hand_models.compliance.compliant_finger import CompliantFingers
from hand_models.fixed_wrist import wrench_space
from hand_models.hand import FINGERS, Grasp
from hand_models.rock import Cylinder, Edge, Ellipsoid, Mesh, Plane, Sphere
from hand_models.tile import Surface
from tests.suite.helpers.hands import HAND, changed_hand, partly
from tests.suite.helpers.rocks import fractal_wall

ROCK = Surface.named("rock")

HOLDS = {
    "pinch": (Cylinder(0.3), Grasp(outer_rotation=math.pi)),
    "no lateral": (Cylinder(0.3), Grasp(outer_rotation=math.pi, lateral=False, palm=False)),
    "oblique": (Cylinder(0.3), Grasp(outer_rotation=1.0)),
    "plane": (Plane(), Grasp()),
    "sphere": (Sphere(0.4), Grasp(outer_rotation=2.0)),
    "ellipsoid": (Ellipsoid((0.2, 0.3, 0.1)), Grasp(outer_rotation=math.pi)),
    "edge": (Edge(fillet_radius=0.02, angle=1.6), Grasp()),
}


def compliant(name, preload=None, hand=HAND):
    hold, grasp = HOLDS[name]
    return CompliantHand(hand.settle(hold, ROCK, grasp), preload)


def slopes(function, at, small=1e-7):
    """Central differences of a function of a twist, a column for each component."""
    ends = [function(at + side * small * np.eye(6)) for side in (1.0, -1.0)]
    return (ends[0] - ends[1]).T / (2.0 * small)


@pytest.mark.parametrize("name", HOLDS)
@pytest.mark.parametrize("tension", [37.0, 55.0])
def test_at_rest_it_carries_what_the_fixed_wrist_carries(name, tension):
    hand = compliant(name, [tension] * 4)
    loads = hand.loads(np.zeros((1, 6)))
    np.testing.assert_allclose(
        loads.tile_loads[0], hand.settled.tile_loads(np.full(4, tension)), atol=1e-9
    )
    space = wrench_space(hand.settled)
    y = np.zeros(len(space.columns))
    y[: len(FINGERS)] = tension
    np.testing.assert_allclose(loads.wrenches[0], space.wrench(y), atol=1e-9)


@pytest.mark.parametrize("seed", [1, 2])
def test_tiles_that_bear_on_one_side_exert_their_moments_where_the_wrist_gives_way(seed):
    vertices, faces = fractal_wall(seed, size=0.45, count=91)
    settled = HAND.settle(Mesh(vertices, faces), ROCK, Grasp(outer_rotation=math.pi))
    assert np.abs(settled.postures.across).max() > 2e-3
    loads = CompliantHand(settled).loads(np.zeros((1, 6)))
    np.testing.assert_allclose(loads.positions[0], settled.positions, atol=1e-12)
    space = wrench_space(settled)
    y = np.zeros(len(space.columns))
    y[: len(FINGERS)] = settled.closing_tension
    np.testing.assert_allclose(loads.wrenches[0], space.wrench(y), atol=1e-8)
    # rolling contacts keep their distance from the finger's plane
    moved = CompliantHand(settled).loads(np.array([[1e-4, -2e-4, -1e-4, 1e-3, 5e-4, -1e-3]]))
    for frame, own, beside in zip(
        settled.hand.frames(math.pi),
        [np.flatnonzero(settled.finger_of == i)[-3:] for i in range(4)],
        settled.postures.across,
        strict=True,
    ):
        aside = (moved.positions[0, own] - frame.joint) @ frame.across
        np.testing.assert_allclose(aside, beside, atol=1e-12)


@pytest.mark.parametrize("name", [name for name in HOLDS if name != "edge"])
def test_the_stiffness_is_what_finite_differences_give(name):
    hand = compliant(name)
    at = np.array([2e-5, -1e-5, -3e-5, 1e-4, -2e-4, 1e-4])
    expected = slopes(lambda twists: hand.loads(twists).wrenches, at)
    found = hand.stiffness(at)
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("name", ["pinch", "oblique", "sphere"])
@pytest.mark.parametrize("finger", [1, 2])
def test_a_finger_stiffens_the_grasp_through_its_twist(name, finger):
    """K_g = Σ J_fᵀ K_f J_f (Eqs. 11 and 12), with the lateral springs out of the plane."""
    hand = compliant(name)
    frame, own = hand.frames[finger], hand.tiles_of(finger)
    up = np.array([0.0, 0.0, 1.0])
    # the twist of the base in the finger's plane: x, z and the turn from x toward z
    J = np.array(
        [
            [*frame.along, *np.cross(frame.joint, frame.along)],
            [*up, *np.cross(frame.joint, up)],
            [0.0, 0.0, 0.0, *-frame.across],
        ]
    )
    # tiles that bear on one side act beside the plane
    beside = (hand.settled.positions[own] - frame.joint) @ frame.across
    across = np.array(
        [[*frame.across, *np.cross(p, frame.across)] for p in hand.settled.positions[own]]
    )
    lateral = slopes(lambda twists: hand.lateral_loads(finger, twists), np.zeros(6))
    alone = CompliantFingers([hand.fingers[finger]], "held")
    steps = (1j * COMPLEX_STEP * np.eye(3))[:, None]
    in_plane = alone.loads(*steps, np.full((1, 3), 37.0)).planar_wrench[0].imag.T / COMPLEX_STEP
    expected = J.T @ in_plane @ J + across.T @ lateral

    def wrenches(twists):
        loads = hand.loads(twists)
        planar, aside = (
            np.einsum("mtk,mtkx->mtx", loads.tile_loads[..., of], loads.axes[:, :, of])[:, own]
            for of in (slice(2), slice(2, 3))
        )
        places = loads.positions[:, own]
        forces = planar + aside
        moments = np.cross(places - beside[:, None] * frame.across, planar)
        moments += np.cross(places, aside)
        return np.concatenate([forces.sum(axis=1), moments.sum(axis=1)], axis=1)

    found = slopes(wrenches, np.zeros(6))
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())


def test_pulling_off_drags_the_tiles_and_takes_their_pressing():
    hand = compliant("no lateral")
    rest, pulled = (hand.loads(np.array([[0.0, 0.0, z, 0.0, 0.0, 0.0]])) for z in (0.0, -3e-4))
    proximal = [hand.tiles_of(i)[-3] for i in range(4)]
    assert (pulled.shears[0] - rest.shears[0])[hand.settled.touching].min() > -1e-9
    assert (pulled.normals[0, proximal] < rest.normals[0, proximal] - 1.0).all()
    assert pulled.wrenches[0, 2] < rest.wrenches[0, 2] - 5.0


def test_a_held_motor_is_stiffer_than_one_that_keeps_its_tension():
    # without friction in the tendon, only the motor keeps it from running
    free = compliant("pinch", hand=changed_hand("tendon", "holding_friction", 0.0)).fingers[1]
    steps = (1j * COMPLEX_STEP * np.eye(3))[:, None]
    pulled = np.array([0.0, -3e-4, 0.0])[:, None, None]
    slopes_of, tensions = {}, {}
    for scheme in ("held", "tension"):
        finger = CompliantFingers([free], scheme)
        slopes_of[scheme] = finger.loads(*steps, np.full((1, 3), 37.0)).planar_wrench[0].imag
        tensions[scheme] = finger.loads(*pulled, np.full((1, 1), 37.0)).tensions
    assert slopes_of["held"][0, 0] > 1.05 * slopes_of["tension"][0, 0]
    assert np.abs(tensions["tension"] - 37.0).max() < 1e-9
    assert np.abs(tensions["held"] - 37.0).max() > 0.1


def test_symmetric_hands_answer_mirrored_twists_with_mirrored_wrenches():
    hand = compliant("pinch")
    mirror = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    twists = np.random.default_rng(1).normal(size=(20, 6)) * [*[2e-4] * 3, *[4e-3] * 3]
    straight = hand.loads(twists).wrenches
    mirrored = hand.loads(twists * mirror).wrenches
    np.testing.assert_allclose(mirrored, straight * mirror, atol=1e-9)


def test_lateral_springs_are_the_beam_in_series_with_the_tiles():
    soft = compliant("pinch", hand=changed_hand("beam", "bending_stiffness", 1.0))
    stiff = compliant("pinch", hand=changed_hand("beam", "bending_stiffness", 1e9))
    sideways = np.array([[0.0, 1e-4, 0.0, 0.0, 0.0, 0.0]])
    own = stiff.tiles_of(1)
    loads = stiff.lateral_loads(1, sideways)[0]
    # a rigid beam: each tile's own stiffness, less what the twist of the finger takes
    assert (loads[stiff.settled.touching[own]] <= 1e-4 * HAND.lateral_stiffness + 1e-12).all()
    assert loads.sum() > 0.5 * len(own) * 1e-4 * HAND.lateral_stiffness
    assert soft.lateral_loads(1, sideways)[0].sum() < loads.sum()


def test_half_of_the_spines_are_half_as_stiff_sideways():
    settled = replace(
        HAND.settle(Cylinder(0.3), ROCK, Grasp(outer_rotation=0.0)),
        hand=changed_hand("beam", "bending_stiffness", 1e12),
    )
    settled = replace(settled, positions=settled.positions * [1.0, 1.0, 0.0])
    sideways = np.array([[0.0, 1e-4, 0.0, 0.0, 0.0, 0.0]])
    for share in (1.0, 0.5, 1e-9):
        found = CompliantHand(partly(settled, share)).lateral_loads(0, sideways)[0]
        # 10 N/mm of each tile's spines
        expected = share * settled.engagement[settled.finger_of == 0] * 1e4 * 1e-4
        np.testing.assert_allclose(found, expected, rtol=1e-5)


@pytest.mark.parametrize("diameter", [0.2, 0.3, 0.7])
def test_on_round_rock_a_pinch_is_stiff_in_every_direction_and_conservative(diameter):
    """Springs and rolling without slip have an energy: K_g is symmetric, and positive."""
    settled = HAND.settle(Cylinder(diameter), ROCK, HOLDS["pinch"][1])
    stiffness = CompliantHand(settled).stiffness()
    # what is left is of the preload's forces turning with the rock: not of springs
    np.testing.assert_allclose(stiffness, stiffness.T, atol=5e-3 * np.abs(stiffness).max())
    assert np.linalg.eigvalsh(stiffness + stiffness.T).min() > 0.0


@pytest.mark.parametrize("name", ["pinch", "oblique", "plane"])
def test_at_rest_the_palm_does_not_stiffen_the_hand(name):
    """It begins to carry there, which a complex step must not take for carrying."""
    hold, grasp = HOLDS[name]
    bare = Grasp(outer_rotation=grasp.outer_rotation, palm=False)
    without = CompliantHand(HAND.settle(hold, ROCK, bare))
    np.testing.assert_allclose(compliant(name).stiffness(), without.stiffness(), atol=1e-6)


def test_the_palm_neither_pushes_nor_pulls():
    hand = compliant("pinch")
    assert hand.settled.palm.engaged
    into = 1e-4 + max(hand.settled.palm.gaps[i] for i in hand.settled.palm.engaged)
    away, against = (
        hand.loads(np.array([[side * 1e-4, 0.0, -side * into, 0.0, 0.0, 0.0]])).palm[0]
        for side in (1.0, -1.0)
    )
    np.testing.assert_array_equal(away, 0.0)
    assert (against > 0.0).all()


@pytest.mark.parametrize("preload", [[1.0] * 3, [-1.0] * 4, [701.0] * 4, [math.nan] * 4])
def test_an_impossible_preload_is_refused(preload):
    with pytest.raises(InvalidInputError, match="tendon_preload"):
        compliant("pinch", preload)


def test_an_impossible_preload_is_told_as_a_plain_list():
    with pytest.raises(InvalidInputError) as caught:
        compliant("pinch", np.full(4, 900.0))
    assert str(caught.value) == (
        "tendon_preload: four tensions from 0 to tendon.maximum_tension, 700 N, are needed, got "
        "[900.0, 900.0, 900.0, 900.0]"
    )


def test_a_hand_on_its_nails_cannot_float():
    hold = Edge(fillet_radius=0.002, angle=1.5707963)
    settled = HAND.settle(hold, ROCK, Grasp(fingernail=True))
    with pytest.raises(UnsupportedError, match="fingernail"):
        CompliantHand(settled)


# Linearised sets --------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["pinch", "oblique", "sphere", "plane"])
def test_the_linearised_set_touches_the_exact_one_where_it_is_linearised(name):
    hand = compliant(name)
    wrist = FloatingWrist(hand)
    at = np.array([5e-5, 2e-5, -8e-5, 1e-3, -1e-3, 5e-4])
    space = wrist.linearised(at)
    loads = hand.loads(at[None])
    np.testing.assert_allclose(space.wrench(at), loads.wrenches[0], atol=1e-8)
    verdict = wrist.evaluate(at[None])
    assert space.utilisations(at).max() == pytest.approx(verdict.utilisation[0], abs=1e-9)
    assert space.rows[int(space.utilisations(at).argmax())] == wrist.limits[verdict.limiting[0]]
    # away from there the loads are off to second order only
    way = np.random.default_rng(2).normal(size=6) * [*[1e-4] * 3, *[1e-3] * 3]
    poses = [at + t * way for t in (0.02, 0.01)]
    exact = wrist.evaluate(np.array(poses)).utilisation
    off = [abs(space.utilisations(pose).max() - u) for pose, u in zip(poses, exact, strict=True)]
    assert off[1] <= 0.35 * off[0] + 1e-9


def test_rows_have_the_fixed_wrists_names():
    hand = compliant("pinch")
    fixed = wrench_space(hand.settled)
    floating = FloatingWrist(hand).linearised()
    count = len(floating.s)
    assert floating.rows[:count] == fixed.rows[: len(fixed.s)]
    np.testing.assert_allclose(floating.s, fixed.s)


def test_a_range_keeps_the_wrist_near():
    wrist = FloatingWrist(compliant("no lateral"))
    within = np.array([1e-4, 2e-4, 1e-4, 1e-3, 1e-3, 1e-3])
    at = np.array([1e-5, 0.0, -2e-5, 0.0, 1e-4, 0.0])
    space = wrist.linearised(at, within=within)
    new = [row.label for row in space.rows if row.limit == "wrist_range"]
    assert len(new) == 12
    inside = at + 0.99 * within * [1, -1, 1, -1, 1, -1]
    outside = at + 2.1e-4 * np.eye(6)[1]
    rows = slice(len(space.h) - 12, None)
    assert (space.H[rows] @ inside <= space.h[rows]).all()
    assert not (space.H[rows] @ outside <= space.h[rows]).all()


def test_the_sieve_lets_pass_all_that_holds():
    wrist = FloatingWrist(compliant("no lateral"))
    twists = np.random.default_rng(4).normal(size=(4000, 6)) * [*[2e-4] * 3, *[3e-3] * 3]
    holds = np.flatnonzero(wrist.evaluate(twists).holds)
    passed = wrist.sieve(twists)
    assert 0 < len(holds) <= len(passed) < len(twists)
    assert set(holds) <= set(passed)


def test_sets_at_many_poses_are_those_at_each():
    wrist = FloatingWrist(compliant("oblique"))
    poses = np.array([5e-5, 2e-5, -8e-5, 1e-3, -1e-3, 5e-4]) * np.arange(4)[:, None]
    within = np.full(6, 1e-3)
    # one of them known already, with another range
    wrist.linearised(poses[2])
    many = wrist.linearised_each(poses, within)
    for at, found in zip(poses, many, strict=True):
        alone = FloatingWrist(wrist.hand).linearised(at, within=within)
        for name in ("origin", "generators", "L", "l0", "s", "H", "h"):
            np.testing.assert_allclose(getattr(found, name), getattr(alone, name), rtol=1e-12)
