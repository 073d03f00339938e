"""Conics and the unit circle: every crossing is found, and nothing else."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hand_models.sections.conics import circle_crossings

seeds = st.integers(0, 2**32 - 1)
TURN = np.linspace(-math.pi, math.pi, 4001)


def crossings(*numbers):
    with np.errstate(invalid="ignore", divide="ignore"):
        return circle_crossings(*(np.atleast_1d(np.asarray(n, dtype=float)) for n in numbers))


def value(angle, A, B, D, E, F):
    x, y = np.cos(angle), np.sin(angle)
    return A * x * x + B * y * y + 2.0 * D * x + 2.0 * E * y + F


@settings(max_examples=500, deadline=None)
@given(seeds)
def test_the_crossings_are_where_the_conic_changes_its_sign_on_the_circle(seed):
    rng = np.random.default_rng(seed)
    A = 10.0 ** rng.uniform(-4.0, 2.0)
    # a circle, one but for rounding, or an ellipse as long as any
    B = A * rng.choice([1.0, 1.0 - 1e-15, 1.0 - 1e-9, 10.0 ** -rng.uniform(0.0, 6.0)])
    D, E = rng.normal(size=2) * 10.0 ** rng.uniform(-4.0, 2.0, 2) * (rng.random(2) < 0.9)
    somewhere = rng.uniform(-math.pi, math.pi)
    F = -value(somewhere, A, B, D, E, 0.0) if rng.random() < 0.7 else 10.0 ** rng.uniform(-4, 2)
    if math.hypot(D, E) < 1e-9 * A and B > (1.0 - 1e-6) * A:
        return  # no crossing, or the unit circle itself
    angles, slopes = crossings(A, B, D, E, F)
    found = np.isfinite(angles)
    size = A + abs(D) + abs(E) + abs(F)
    assert np.abs(value(angles[found], A, B, D, E, F)).max(initial=0.0) < 1e-7 * size
    sharp = found & (np.abs(slopes) > 1e-4 * size)
    assert np.abs(value(angles[sharp], A, B, D, E, F)).max(initial=0.0) < 1e-13 * size
    step = 1e-6
    rise = value(angles + step, A, B, D, E, F) - value(angles - step, A, B, D, E, F)
    np.testing.assert_allclose(slopes[found], rise[found] / (2.0 * step), atol=1e-7 * size)
    sampled = value(TURN, A, B, D, E, F)
    turned = (angles[found] + math.pi) % math.tau - math.pi
    for i in np.flatnonzero(np.sign(sampled[1:]) * np.sign(sampled[:-1]) < 0.0):
        assert ((turned > TURN[i] - 1e-9) & (turned < TURN[i + 1] + 1e-9)).any()


def test_an_ellipse_through_four_points_of_the_circle():
    """x² + 4 y² = 2: x² = 2/3 and y² = 1/3, at ± 35.26° from both ends of x."""
    angles, slopes = crossings(4.0, 1.0, 0.0, 0.0, -2.0)
    # the longer axis of the form comes first: x and y change places
    expected = [math.atan(math.sqrt(2.0)), math.pi - math.atan(math.sqrt(2.0))]
    found = np.sort(np.abs((angles.ravel() + math.pi) % math.tau - math.pi))
    np.testing.assert_allclose(found, np.repeat(expected, 2), atol=1e-14)
    np.testing.assert_allclose(np.abs(slopes), 2.0 * math.sqrt(2.0), atol=1e-6)


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9])
def test_a_conic_that_just_reaches_the_circle_crosses_it_twice(gap):
    """A disc of radius 1 about (2 − gap, 0): cos of the angle is (1 + d² − 1) / (2 d)."""
    d = 2.0 - gap
    angles, _ = crossings(1.0, 1.0, -d, 0.0, d * d - 1.0)
    found = np.sort(angles[np.isfinite(angles)])
    np.testing.assert_allclose(np.abs(found), math.acos(0.5 * d), rtol=1e-6)
    assert len(found) == 2
    assert not np.isfinite(crossings(1.0, 1.0, -2.0 - gap, 0.0, (2.0 + gap) ** 2 - 1.0)[0]).any()
