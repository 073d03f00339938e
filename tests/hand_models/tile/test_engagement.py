"""The share of a tile's spines that are on rock across a gap."""

import numpy as np
import pytest

from hand_models.tile import engaged_share

TRAVEL = 0.005


def test_it_falls_from_all_where_the_tile_touches_to_none_at_the_spines_travel():
    gaps = [-0.001, 0.0, 0.001, 0.0025, 0.004, 0.005, 0.006, np.inf]
    expected = [1.0, 1.0, 0.8, 0.5, 0.2, 0.0, 0.0, 0.0]
    np.testing.assert_allclose(engaged_share(gaps, TRAVEL), expected, atol=1e-15)
    assert engaged_share([[0.001]], TRAVEL).shape == (1, 1)


@pytest.mark.parametrize(
    ("exponent", "expected"),
    # written out for gaps of 1, 2.5 and 4 mm of 5 mm
    [(2.0, [0.96, 0.75, 0.36]), (0.5, [0.5527864, 0.2928932, 0.1055728]), (1.0, [0.8, 0.5, 0.2])],
)
def test_other_laws_keep_their_ends(exponent, expected):
    gaps = [-0.001, 0.0, 0.001, 0.0025, 0.004, 0.005, 0.006, np.inf]
    found = engaged_share(gaps, TRAVEL, exponent)
    np.testing.assert_allclose(found, [1.0, 1.0, *expected, 0.0, 0.0, 0.0], atol=1e-7)


def test_the_ends_of_the_range_are_close_to_the_laws_that_they_stand_for():
    """Whole up to four fifths of the travel, and the square of what is left of it."""
    part = np.linspace(0.0, 1.0, 101)
    whole = np.clip((1.0 - part) / 0.2, 0.0, 1.0)
    assert np.abs(engaged_share(part, 1.0, 8.0) - whole).max() < 0.18
    assert np.abs(engaged_share(part, 1.0, 0.5) - (1.0 - part) ** 2).max() < 0.14


def test_it_does_not_jump():
    gaps = np.linspace(-0.001, 0.006, 7001)
    assert np.abs(np.diff(engaged_share(gaps, TRAVEL))).max() <= 1e-6 / TRAVEL + 1e-15


def test_a_millionth_of_the_spines_is_none():
    shares = engaged_share(TRAVEL * (1.0 - np.array([2e-6, 0.9e-6, 1e-12])), TRAVEL)
    np.testing.assert_allclose(shares, [2e-6, 0.0, 0.0], atol=1e-12)


def test_spines_that_do_not_reach_out_hold_where_the_tile_touches_alone():
    np.testing.assert_array_equal(engaged_share([0.0, 1e-9, np.inf], 0.0), [1.0, 0.0, 0.0])
