"""Holds drawn as outlines, against shapes that have formulas and against sampled distances."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st
from scipy.optimize import lsq_linear

from hand_models import Cylinder, Grasp, InvalidInputError, Plane
from hand_models.rock import Profile
from hand_models.rock.profile import STRIP_NAMES
from tests.suite.helpers.hands import HAND, ROCK
from tests.suite.helpers.rocks import distance, random_axes, random_profile
from tests.suite.helpers.shares import given_some

seeds = st.integers(0, 2**32 - 1)


def arc(radius, count=600):
    """The upper side of a circle, from its crest outward."""
    turn = np.linspace(-1.5, 1.5, count)
    return np.column_stack([radius * np.sin(turn), radius - radius * np.cos(turn)])


@pytest.mark.parametrize("rotation", [0.0, 0.8, math.pi])
def test_a_drawn_cylinder_is_the_cylinder(rotation):
    want = HAND.settle(Cylinder(0.3), ROCK, Grasp(rotation))
    got = HAND.settle(Profile(arc(0.15)), ROCK, Grasp(rotation))
    assert got.tiles == want.tiles
    assert got.seating.rule == want.seating.rule
    np.testing.assert_allclose(got.seating.pose.position, want.seating.pose.position, atol=1e-4)
    np.testing.assert_allclose(got.positions, want.positions, atol=2e-4)


@pytest.mark.parametrize("rotation", [0.0, math.pi / 2.0])
def test_a_drawn_wall_is_the_wall_also_along_its_y(rotation):
    want = HAND.settle(Plane(), ROCK, Grasp(rotation))
    got = HAND.settle(Profile([[-0.5, 0.0], [0.5, 0.0]]), ROCK, Grasp(rotation))
    assert got.tiles == want.tiles
    np.testing.assert_allclose(got.positions, want.positions, atol=2e-4)


def test_it_may_be_drawn_from_either_end():
    forward, back = Profile(arc(0.15)), Profile(arc(0.15)[::-1])
    np.testing.assert_array_equal(forward.outlines[0], back.outlines[0])


@pytest.mark.parametrize("rotation", [0.0, math.pi])
def test_every_finger_has_the_strip_of_its_name(rotation):
    radii = dict(zip(STRIP_NAMES, (0.1, 0.15, 0.2, 0.3), strict=True))
    # pulled harder than usual, so that no phalanx is held off the rock by more than is said below
    grasp = Grasp(rotation, closing_tension=50.0)
    # and whatever is drawn holds on, so that its path ends as the closed form of a cylinder does
    rock = replace(ROCK, friction=0.0)
    got = HAND.settle(Profile({name: arc(r) for name, r in radii.items()}), rock, grasp)
    for i, radius in enumerate(radii.values()):
        drawn = HAND.settle(Profile(arc(radius)), rock, grasp, got.seating.pose)
        np.testing.assert_array_equal(got.fingers[i].joint_angles, drawn.fingers[i].joint_angles)
        alone = HAND.settle(Cylinder(2.0 * radius), rock, grasp, got.seating.pose)
        # laid in closed form on the cylinder, a middle phalanx is held a tenth of a millimetre
        # short of the rock at the end of its path
        np.testing.assert_allclose(
            got.fingers[i].joint_angles, alone.fingers[i].joint_angles, atol=2e-2
        )
        base = next(t for t in range(14) if got.tiles[t].finger == STRIP_NAMES[i])
        if got.tiles[base].phalanx == "base":
            np.testing.assert_allclose(got.positions[base], alone.positions[base], atol=1e-4)
    # palm tiles: left ones over inner_left's strip, right ones over inner_right's
    for name, rows in (("inner_left", slice(0, None, 2)), ("inner_right", slice(1, None, 2))):
        alone = HAND.settle(Cylinder(2.0 * radii[name]), rock, grasp, got.seating.pose)
        np.testing.assert_allclose(got.palm.gaps[rows], alone.palm.gaps[rows], atol=1e-5)


@given_some(12, 100, seeds)
def test_entry_is_where_a_line_first_meets_the_rock(seed):
    rng = np.random.default_rng(seed)
    hold = Profile(random_profile(rng).outlines[0])
    direction = random_axes(rng, 0.6)[:, 2]
    point = np.array([*rng.uniform(-0.1, 0.1, 2), rng.uniform(-0.1, 0.02)])
    found = hold.entry(point, direction)
    if not math.isfinite(found):
        assert distance(hold, point + np.linspace(0.0, 1.0, 3000)[:, None] * direction).min() > 0.0
        return
    assert distance(hold, (point + found * direction)[None])[0] == pytest.approx(0.0, abs=1e-12)
    before = point + np.linspace(0.0, 1.0, 500)[:-1, None] * found * direction
    inside = distance(hold, point[None])[0] < 0.0
    assert inside == (found < 0.0)
    if not inside:
        assert distance(hold, before).min() > -1e-12


@given_some(8, 60, seeds)
def test_a_section_never_leaves_raw_rock_outside(seed):
    rng = np.random.default_rng(seed)
    hold = Profile(random_profile(rng).outlines[0])
    axes = random_axes(rng, 0.5)
    origin = np.array([*rng.uniform(-0.05, 0.05, 2), -0.02])
    section = hold.section(origin, axes[:, 0], axes[:, 2])
    points = rng.uniform(-0.12, 0.12, (200, 2))
    clear = section.clearances(points @ [1.0, 1j])
    raw = distance(hold, origin + points[:, :1] * axes[:, 0] + points[:, 1:] * axes[:, 2])
    x = (origin + points[:, :1] * axes[:, 0] + points[:, 1:] * axes[:, 2])[:, 0]
    ends = hold.outlines[0][[0, -1], 0]
    inner = (x > ends[0] + 0.03) & (x < ends[1] - 0.03)
    # a place clear of the section is clear of the rock, within 0.1 mm
    assert raw[inner & (clear > 0.0)].min(initial=1.0) > -1e-4


@pytest.mark.parametrize(
    ("points", "field", "words"),
    [
        ([[0.0, 0.0]], "points", "2 to 5000 points"),
        ([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], "points", "2 to 5000 points"),
        ([[0.0, 0.0], [1.0]], "points", "two numbers"),
        ([[0.0, 0.0], [0.1, math.nan]], "points[1]", "finite"),
        ([[0.0, 0.0], [300.0, 0.0]], "points[1]", "within ±10 m, got "),
        ([[0.0, 0.0], [0.1, 0.1], [0.0, 0.2]], "points", "another x"),
        ([[-0.1, 0.0], [0.1, 0.1], [0.1, 0.0], [-0.1, 0.1], [0.2, 0.3]], "points", "crosses"),
        ([[-0.1, 0.0], [0.2, 0.0], [0.1, 0.0], [0.3, 0.1]], "points", "crosses"),
        ([[-0.1, 0.0], [0.1, 0.1], [0.1, 0.0], [-0.1, 0.0], [0.2, 0.3]], "points", "crosses"),
        (
            np.column_stack([np.arange(50) / 100, np.arange(50) % 2]),
            "points",
            "maximum is 10 times",
        ),
        ({"outer_left": [[0.0, 0.0], [0.1, 0.0]]}, "profiles", "one outline for each of"),
        (
            {name: [[0.0, 0.0], [0.1, 0.0]][: 1 + (name != "inner_right")] for name in STRIP_NAMES},
            "profiles.inner_right",
            "2 to 5000 points",
        ),
    ],
)
def test_impossible_outlines_are_refused_by_field(points, field, words):
    with pytest.raises(InvalidInputError, match=words) as caught:
        Profile(points)
    assert caught.value.field == field


@given(seeds)
def test_an_outline_is_refused_if_and_only_if_two_of_its_pieces_meet(seed):
    rng = np.random.default_rng(seed)
    points = np.round(rng.uniform(-1.0, 1.0, (rng.integers(3, 8), 2)) * 3.0) / 3.0
    points = points[np.append(True, (np.diff(points, axis=0) != 0.0).any(axis=1))]
    assume(points[0, 0] != points[-1, 0])
    pieces = [(points[i], points[i + 1]) for i in range(len(points) - 1)]
    meet = any(
        gap(*one, *other) < 1e-9 if j > i + 1 else turns_back(*one, other[1])
        for (i, one), (j, other) in itertools.combinations(enumerate(pieces), 2)
    )
    if meet:
        with pytest.raises(InvalidInputError, match="crosses"):
            Profile(points)
    else:
        Profile(points)


def gap(a, b, c, d):
    """Least distance between two straight pieces, by quadratic programming over a square."""
    basis = np.column_stack([b - a, c - d])
    return math.sqrt(2.0 * lsq_linear(basis, c - a, (0.0, 1.0), method="bvls", tol=1e-15).cost)


def turns_back(a, b, c):
    one, other = b - a, c - b
    return one[0] * other[1] == one[1] * other[0] and float(one @ other) < 0.0
