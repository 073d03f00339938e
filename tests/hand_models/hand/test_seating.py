"""Where hands go on rock that is known by its outline or its triangles only."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh
from hypothesis import strategies as st

from hand_models import Cylinder, Grasp, InvalidInputError, Pose, Sphere
from hand_models.rock import Mesh, Profile
from hand_models.sections import Face
from tests.suite.helpers.hands import HAND, ROCK, seating_on
from tests.suite.helpers.rocks import cylinder_mesh, distance, random_mesh, random_profile
from tests.suite.helpers.shares import given_some

seeds = st.integers(0, 2**32 - 1)

HEIGHT = 1e-6
"""How far off a palm may be seated [m]."""


def test_a_meshed_cylinder_seats_as_the_cylinder():
    for rotation in [0.0, math.pi]:
        for diameter in [0.15, 0.2, 0.3, 0.7, 1.5]:
            want = seating_on(Cylinder(diameter), Grasp(rotation))
            got = seating_on(Mesh(*cylinder_mesh(diameter, 512)), Grasp(rotation))
            assert got.rule == want.rule
            np.testing.assert_allclose(got.pose.position, want.pose.position, atol=1e-4)


def test_a_meshed_ball_seats_as_the_ball():
    ball = trimesh.creation.icosphere(subdivisions=6, radius=0.2)
    want = seating_on(Sphere(0.4), Grasp())
    rock = Mesh(ball.vertices + np.array([0.0, 0.0, 0.2]), ball.faces)
    got = seating_on(rock, Grasp())
    assert got.rule == want.rule == "palm_on_rock"
    np.testing.assert_allclose(got.pose.position, want.pose.position, atol=1e-4)


@given_some(5, 60, seeds)
def test_a_seated_palm_is_on_the_rock_or_off_it_in_a_pinch(seed):
    rng = np.random.default_rng(seed)
    hold = random_mesh(rng) if rng.random() < 0.5 else random_profile(rng)
    grasp = Grasp(float(rng.choice([0.0, 1.0, math.pi])))
    seating = seating_on(hold, grasp)
    x, y = np.meshgrid(np.linspace(-0.055, 0.055, 23), np.linspace(-0.026, 0.026, 5))
    palm = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    gaps = distance(hold, seating.pose.inverse().apply(palm))
    # rock between the lines on which it is looked for may stand into the palm a little
    assert gaps.min() > -2e-3
    if seating.rule in ("palm_on_rock", "palm_on_rock_centred"):
        assert gaps.min() < 3e-3
    if seating.rule in ("pinch", "palm_on_rock"):
        model = HAND.finger
        face = Face(model.tile_range[0], model.joint_spacing, model.tile_height)

        def contact(lift: float) -> float:
            along = []
            for side in (1.0, -1.0):
                joint = HAND.inner_joint * [1.0, side, 1.0] + [0.0, 0.0, lift]
                joint = seating.pose.inverse().apply(joint)
                rock = hold.finger_rock(joint, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], HAND.finger.size)
                rest = rock.tile.rest(0j, face, model.joint_lower[0], model.joint_upper[0])
                along.append(model.joint_spacing if rest is None else rest.distance)
            return float(np.mean(along))

        # a higher base touches nearer to it; on flat rock the contact runs far with the height
        assert contact(HEIGHT) - 2e-4 < HAND.seated_contact < contact(-HEIGHT) + 2e-4


def bumpy(height: float) -> Profile:
    """A wall with a bump under the fingers' middles, so high over the palm's rock."""
    x = np.linspace(-0.4, 0.4, 801)
    return Profile(np.column_stack([x, -height * np.exp(-(((x - 0.12) / 0.03) ** 2))]))


def test_a_hand_backs_off_rock_that_would_stand_in_its_open_fingers():
    for height in (0.012, 0.02):
        settled = HAND.settle(bumpy(height), ROCK, Grasp())
        seat, seating = seating_on(bumpy(height), Grasp()), settled.seating
        assert 0.0 < seating.backed_off < HAND.back_off
        assert seating.rule == seat.rule
        np.testing.assert_allclose(
            seating.pose.position - seat.pose.position, [0.0, 0.0, seating.backed_off], atol=1e-12
        )
        # by no more than it must
        nearer = Pose(seating.pose.position - [0.0, 0.0, 2e-4], seating.pose.rotation)
        with pytest.raises(InvalidInputError, match="even with its joints fully open"):
            HAND.settle(bumpy(height), ROCK, Grasp(), nearer)
    with pytest.raises(InvalidInputError, match="even with its joints fully open"):
        HAND.settle(bumpy(0.08), ROCK, Grasp())


def test_a_hand_that_is_placed_does_not_back_off():
    seat = seating_on(bumpy(0.02), Grasp())
    with pytest.raises(InvalidInputError, match="even with its joints fully open"):
        HAND.settle(bumpy(0.02), ROCK, Grasp(), seat.pose)


def test_a_raised_ridge_under_the_palm_lifts_it():
    """A ridge 8 mm high, 20 mm behind the crest that the fingers take."""
    x = np.linspace(-0.2, 0.2, 2001)
    log = 0.15 - np.sqrt(np.maximum(0.15**2 - x**2, 0.0))
    ridge = 0.012 * np.exp(-(((x + 0.02) / 0.008) ** 2))
    plain, raised = (Profile(np.column_stack([x, z])) for z in (log, log - ridge))
    low, high = (seating_on(hold, Grasp(1.0)).pose.position[2] for hold in (plain, raised))
    assert low == pytest.approx(0.0, abs=1e-5)
    assert high == pytest.approx(0.012 - 0.02**2 / 0.3, abs=1.5e-3)


def test_without_rock_under_the_palm_the_hold_keeps_its_place():
    beside = Profile([[0.3, 0.0], [0.5, 0.0]])
    seating = seating_on(beside, Grasp())
    assert seating.rule == "palm_on_rock_centred"
    np.testing.assert_array_equal(seating.pose.position, 0.0)
