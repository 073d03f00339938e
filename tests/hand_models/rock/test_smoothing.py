"""The parts of smoothing, against what they are defined as."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, strategies as st
from scipy.ndimage import uniform_filter1d
from scipy.signal import savgol_filter

from hand_models.rock import compiled_cuts, compiled_smoothing
from hand_models.rock.smoothing import Scale, smooth
from hand_models.sections import PolylineSection

seeds = st.integers(0, 2**32 - 1)


def folded(rng: np.random.Generator) -> np.ndarray:
    """A curve that goes to and fro, or around, with steps of any size."""
    turn = np.cumsum(rng.normal(0.0, rng.choice([0.05, 0.5]), 150))
    steps = rng.uniform(1e-4, 1e-3, (150, 1)) * np.column_stack([np.cos(turn), np.sin(turn)])
    return np.cumsum(steps, axis=0)


def standing_out(curve, outward, raw):
    """Places on a curve, in steps of it, nearest to raw points, and how far these stand out."""
    places, outs = np.zeros(len(raw)), np.zeros(len(raw))
    for i, point in enumerate(raw):
        vertex, least = int(np.linalg.norm(point - curve, axis=1).argmin()), math.inf
        for begin in range(max(vertex - 1, 0), min(vertex + 1, len(curve) - 1)):
            along = curve[begin + 1] - curve[begin]
            part = np.clip((point - curve[begin]) @ along / (along @ along), 0.0, 1.0)
            away = point - curve[begin] - part * along
            if np.linalg.norm(away) < least:
                least, places[i] = np.linalg.norm(away), begin + part
                outs[i] = away @ (outward[begin] + part * (outward[begin + 1] - outward[begin]))
    return places, outs


def raised(places, outs, count, part):
    """Largest excess within so many steps of each point; over one step more it fades to none."""
    near = np.clip(part + 1.0 - np.abs(np.arange(count)[:, None] - places), 0.0, 1.0)
    return np.maximum((near * outs).max(axis=1), 0.0)


@given(seeds)
def test_a_raw_point_stands_out_of_the_place_of_the_curve_that_is_nearest(seed):
    rng = np.random.default_rng(seed)
    curve = folded(rng)
    outward = rng.normal(size=curve.shape)
    raw = curve[rng.integers(0, len(curve), 80)] + rng.normal(0.0, 5e-4, (80, 2))
    # as Python, which is had sooner than these parts compiled alone
    guesses = rng.integers(0, len(curve), 80)
    excess = compiled_smoothing._excess.py_func(curve, outward, raw, guesses, 0.0)
    got = compiled_smoothing._highest.py_func(excess, 24, 0)
    want = raised(*standing_out(curve, outward, raw), len(curve), 24)
    np.testing.assert_allclose(got, want, atol=1e-15)


def test_a_line_that_begins_a_micrometre_on_is_smoothed_without_a_jump():
    """Sampled at other places of its length, and with raw points nearest to other vertices."""
    for seed in range(150):
        rng, scale = np.random.default_rng(seed), Scale.of()
        x = np.sort(rng.uniform(-0.1, 0.1, 120))
        line = np.column_stack([x, np.cumsum(rng.normal(0.0, 5e-4, 120))])
        one, other = (
            smooth(np.vstack([line[0] + [first, 0.0], line[1:]]), scale) for first in (0.0, 1e-6)
        )
        count = min(len(one), len(other)) - 2
        away = PolylineSection([one]).clearances(other[2:count] @ [1.0, 1.0j])
        assert np.abs(away).max() < 1.5e-6


def test_a_line_that_grows_by_micrometres_is_smoothed_without_a_jump():
    """Also where it has one more step than before, every 0.5 mm."""
    for seed in range(40):
        rng, scale = np.random.default_rng(seed), Scale.of()
        line = np.column_stack([np.linspace(0.0, 0.08, 60), np.cumsum(rng.normal(0.0, 4e-4, 60))])
        onward = np.diff(line[-2:], axis=0)[0]
        length = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
        # around where the last step is whole, and some places between
        whole = math.ceil(length / scale.spacing) * scale.spacing - length
        grown = whole + 1e-6 * np.append(np.arange(-3.0, 4.0), [101.0, 102.0, 301.0, 302.0])
        curves = [
            smooth(np.vstack([line[:-1], line[-1] + far * onward / np.hypot(*onward)]), scale)
            for far in grown
        ]
        for i in (0, 1, 2, 3, 4, 5, 7, 9):
            for one, other in ((curves[i], curves[i + 1]), (curves[i + 1], curves[i])):
                away = PolylineSection([one]).clearances(other @ [1.0, 1.0j])
                assert np.abs(away).max() < 1.5e-6


@given(seeds)
def test_a_smoothed_line_is_fitted_twice_and_raised_by_what_stands_out(seed):
    """On points at equal steps, of a line so rough that it is raised."""
    scale, rng = Scale.of(), np.random.default_rng(seed)
    rise = 1e-3 * rng.random(401)
    turn = np.cumsum(rng.normal(0.0, 0.1, 400))
    turn = np.clip(turn, -1.0, 1.0) + rise[1:]
    raw = np.vstack([[0.0, 0.0], np.cumsum(np.column_stack([np.cos(turn), np.sin(turn)]), axis=0)])
    raw *= scale.spacing
    half = round(0.5 * scale.tile / scale.spacing)
    curve = savgol_filter(
        savgol_filter(raw, 2 * half + 1, 2, axis=0), 2 * (half // 2) + 1, 2, axis=0
    )
    for _ in range(4):
        step = np.gradient(curve, axis=0)
        outward = np.column_stack([step[:, 1], -step[:, 0]]) / np.hypot(*step.T)[:, None]
        places, outs = standing_out(curve, outward, raw)
        if outs.max() <= 1e-6:
            break
        up = raised(places, outs, len(curve), half)
        for size in (2 * (half // 2) + 1, 2 * (half - half // 2) + 1):
            up = uniform_filter1d(up, size, mode="nearest")
        curve = curve + up[:, None] * outward
    np.testing.assert_allclose(smooth(raw, scale)[: len(curve)], curve, atol=1e-9)


@given(seeds)
def test_what_is_within_reach_of_a_line_is_cut_where_it_leaves(seed):
    rng = np.random.default_rng(seed)
    line = np.cumsum(rng.normal(0.0, 0.1, (40, 2)), axis=0)
    if rng.random() < 0.5:
        line = np.vstack([line, line[:1]])
    points, ends, length = compiled_cuts.reached(line, np.array([len(line)]), 0.2)
    assert np.abs(points).max(initial=0.0) <= 0.2 + 1e-12
    inner = np.delete(np.arange(len(points) - 1), ends[:-1] - 1) if len(points) else []
    steps = [math.dist(points[i], points[i + 1]) for i in inner]
    assert length == np.float64(sum(steps)) or abs(length - sum(steps)) < 1e-12
    # as long as what of a finely sampled line is within
    fine = np.linspace(line[:-1], line[1:], 2001, axis=1)
    within = (np.abs(0.5 * (fine[:, 1:] + fine[:, :-1])) <= 0.2).all(axis=2)
    want = (np.linalg.norm(np.diff(fine, axis=1), axis=2) * within).sum()
    assert abs(length - want) < 1e-2 * max(want, 0.1)
