"""Rock under overhangs, as a finger with a width meets it: by hand, and as overhangs grow."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import strategies as st

from hand_models import SettledHand
from hand_models.fixed_wrist import wrench_space
from hand_models.hand import Placement
from hand_models.rock import Mesh, grid
from hand_models.rock.compiled_outlines import (
    least_heights,
    opened_overhangs,
    raised_outlines,
    seen_outlines,
    widened_outline,
)
from hand_models.sections import PolylineSection
from tests.suite.helpers.hands import HAND, PINCH, ROCK
from tests.suite.helpers.rocks import fractal_wall
from tests.suite.helpers.shares import given_some

seeds = st.integers(0, 2**32 - 1)
PLACES = np.linspace(-0.1, 0.1, 401)
SIZE = HAND.finger.size
BRIDGED = 0.005
"""Overhang up to which all rock across a finger counts; from twice that on none does [m]."""
# a roof that ends at s = 3, rock 1 under it from s = 1 on
ROOF = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 0.2], [1.0, 0.2], [1.0, 1.0], [5.0, 1.0]])


def mirrored(line: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(line[::-1] * [-1.0, 1.0])


@pytest.mark.parametrize("turned", [False, True])
def test_an_overhang_is_open_so_far_behind_its_lip(turned: bool) -> None:
    want = np.array([[0, 0], [3, 0], [3, 0.2], [2.5, 0.2], [2.5, 1.0], [5, 1.0]])
    roof = mirrored(ROOF) if turned else ROOF
    found = opened_overhangs(roof, 0.5)
    np.testing.assert_allclose(mirrored(found) if turned else found, want, atol=1e-15)
    np.testing.assert_array_equal(opened_overhangs(roof, math.inf), roof)


def folded(rng: np.random.Generator) -> np.ndarray:
    """An outline that goes to and fro along s while t grows."""
    u = np.linspace(0.0, 1.0, 120)
    waves = rng.uniform(0.0, 0.02) * np.sin(rng.uniform(5.0, 30.0) * u + 1.0) * np.sin(math.pi * u)
    line = np.column_stack([0.15 * (u - 0.5) + waves, 0.05 * u + 1e-5 * np.cumsum(rng.random(120))])
    return mirrored(line) if rng.random() < 0.5 else line


@given_some(20, 200, seeds)
def test_no_overhang_is_deeper_than_it_is_open(seed: int) -> None:
    rng = np.random.default_rng(seed)
    line, depth = folded(rng), rng.uniform(0.0, 0.02)
    found = opened_overhangs(line, depth)
    before, after = (
        seen_outlines(each, np.array([len(each)]), math.inf)[2] for each in (line, found)
    )
    assert after <= min(before, depth) + 1e-12


@given_some(20, 200, seeds)
def test_without_overhangs_the_whole_share_is_the_envelope(seed: int) -> None:
    rng = np.random.default_rng(seed)
    own = np.cumsum(rng.normal(0.0, 3e-4, len(PLACES)))
    least = own - np.maximum(rng.normal(0.0, 1e-3, len(own)), 0.0)
    s = np.sort(rng.uniform(-0.099, 0.099, 300))
    line = np.column_stack([s, np.interp(s, PLACES, own) + rng.normal(0.0, 1e-4, 300)])
    line = np.vstack([[PLACES[0], own[0]], line, [PLACES[-1], own[-1]]])
    own = np.interp(PLACES, *line.T)
    least = np.minimum(least, own)
    ends = np.full((2, len(PLACES), 2), np.nan)
    want, _ = raised_outlines(line, PLACES, own, least, ends, BRIDGED, 1e-9)
    found = widened_outline(line, PLACES, own, least, 1.0, 1e-9)
    np.testing.assert_allclose(found, want, atol=1e-12)
    # by no share nothing is moved
    same = widened_outline(line, PLACES, own, least, 0.0, 1e-9)
    np.testing.assert_allclose(same[:, 1], np.interp(same[:, 0], *line.T), atol=1e-12)


@given_some(20, 200, seeds)
def test_what_an_overhang_hides_stays_in_order(seed: int) -> None:
    """Points on a line along t keep their order, so that no outline crosses itself."""
    rng = np.random.default_rng(seed)
    line = folded(rng)
    points, stops, _ = seen_outlines(line, np.array([len(line)]), math.inf)
    own = least_heights(points, stops, PLACES)
    least = own - np.maximum(np.cumsum(rng.normal(0.0, 5e-4, len(own))), 0.0)
    share = rng.uniform(0.0, 0.99)
    found = widened_outline(line, PLACES, own, least, share, 0.0)
    here = widened_outline(line, PLACES, own, own, share, 0.0)
    np.testing.assert_allclose(found[:, 0], here[:, 0], atol=1e-15)
    for place in PLACES[np.isfinite(own)]:
        at = np.flatnonzero(np.abs(here[:, 0] - place) < 1e-12)
        order = np.argsort(here[at, 1])
        assert (np.diff(found[at[order], 1]) >= -1e-12).all()
    assert (found[:, 1] <= here[:, 1] + 1e-12).all()


def ledge(over: float, seed: int, rough: float = 0.004) -> Mesh:
    """Rock, rough [m], whose two lips, 90 mm before and behind its middle, hang over so far [m]."""
    lip, drop, edge = 0.09, 0.03, 0.0012
    turn = np.linspace(-math.pi / 2.0, math.pi / 2.0, 15)[1:]
    back, floor = lip + edge - over, 2.0 * edge + drop
    side = np.vstack(
        [
            np.column_stack([np.linspace(0.0, lip, 60), np.zeros(60)]),
            np.column_stack([lip + edge * np.cos(turn), edge + edge * np.sin(turn)]),
            np.column_stack([np.linspace(lip, back, 6)[1:], np.full(5, 2.0 * edge)]),
            np.column_stack([np.full(8, back), np.linspace(2.0 * edge, floor, 9)[1:]]),
            np.column_stack([np.linspace(back, 0.3, 50)[1:], np.full(49, floor)]),
        ]
    )
    x, z = np.vstack([mirrored(side), side[1:]]).T
    wall, _ = fractal_wall(seed, size=0.7, count=151, height=rough)
    heights, line = wall[:, 2].reshape(151, 151), np.linspace(-0.35, 0.35, 151)
    y = np.linspace(-0.2, 0.2, 121)
    from scipy.interpolate import RegularGridInterpolator

    beside = np.stack(np.broadcast_arrays(x[:, None], y), axis=-1)
    deep = z[:, None] + RegularGridInterpolator((line, line), heights)(beside)
    vertices, faces = grid(np.concatenate([beside, deep[..., None]], axis=-1))
    return Mesh(vertices, faces[:, ::-1], anywhere=True)


def off(one: PolylineSection, other: PolylineSection) -> float:
    """Return how far points of a section are off another, where a finger reaches them [m]."""
    points = np.vstack(one.pieces)
    points = points[np.hypot(*points.T) < SIZE.reach]
    return float(np.abs(other.clearances(points @ [1.0, 1j])).max())


@pytest.mark.parametrize("at", [BRIDGED, 2.0 * BRIDGED])
def test_the_envelope_does_not_jump_as_an_overhang_grows(at: float) -> None:
    step = 2e-6
    for seed in range(2):
        for joint in (-0.01, 0.05):
            plane = np.array([joint, 0.0, -0.01]), np.array([1.0, 0.0, 0.0]), np.array([0, 0, 1.0])
            one, other = (ledge(at + d, seed).finger_rock(*plane, SIZE) for d in (-step, step))
            assert isinstance(one.tile, PolylineSection)
            assert isinstance(other.tile, PolylineSection)
            assert max(off(one.tile, other.tile), off(other.tile, one.tile)) < 5e-5


@pytest.mark.slow
def test_what_a_hand_holds_does_not_jump_as_an_overhang_grows() -> None:
    ways = np.concatenate([np.eye(6), -np.eye(6)])
    changes = []
    for seed in range(8):
        pose = HAND.settle(ledge(BRIDGED, seed), ROCK, PINCH).seating.pose
        for at in (BRIDGED, 2.0 * BRIDGED):
            rocks = [ledge(at + d, seed) for d in (-1e-5, 1e-5)]
            hands = HAND.settle_each([Placement(rock, ROCK, PINCH, pose) for rock in rocks])
            settled = [each for each in hands if isinstance(each, SettledHand)]
            if len(settled) == 2:
                held = np.array([list(map(wrench_space(each).support, ways)) for each in settled])
                most = np.abs(held[0]).reshape(2, 2, 3).max(axis=(0, 2)).repeat(3)
                changes.append(np.abs((held[1] - held[0]) / np.tile(most, 2)).max())
    assert len(changes) >= 12
    # a finger with two equilibria may take the other one, at any overhang
    assert np.sort(changes)[-2] < 0.01


def test_an_overhang_is_seen_where_a_plane_passes_through_vertices() -> None:
    """Cut there, an outline has each of its points twice."""
    rock, axes = ledge(2.5 * BRIDGED, 0), ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    for aside in (0.0, 1e-6):
        met = rock.finger_rock([0.0, aside, -0.01], *axes, SIZE)
        assert met.frame is None
        assert len(met.strips.across) == 1


def test_rock_across_counts_less_the_more_an_overhang_hides() -> None:
    """A strip beside a finger's plane is as far behind as its share, and no strip is in the end."""
    plane = np.array([0.0, 0.0, -0.01]), np.array([1.0, 0.0, 0.0]), np.array([0, 0, 1.0])
    behind = []
    for over in (1.0, 1.25, 1.5, 1.75, 1.99, 2.01):
        strips = ledge(over * BRIDGED, 0).finger_rock(*plane, SIZE).strips
        near = np.abs(strips.places) < 0.07
        behind.append(strips.behind[near].mean() if near.any() else 0.0)
    assert behind[0] > 2e-4
    assert (np.diff(behind) < 0.0).all()
    assert behind[-1] == 0.0
    np.testing.assert_allclose(behind[2] / behind[0], 0.5, atol=0.05)
