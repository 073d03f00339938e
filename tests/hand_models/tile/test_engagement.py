"""The share of a tile's spines that are on rock across a gap."""

import numpy as np

from hand_models.tile import engaged_share

TRAVEL = 0.005


def test_it_falls_from_all_where_the_tile_touches_to_none_at_the_spines_travel():
    gaps = [-0.001, 0.0, 0.001, 0.0025, 0.004, 0.005, 0.006, np.inf]
    expected = [1.0, 1.0, 0.8, 0.5, 0.2, 0.0, 0.0, 0.0]
    np.testing.assert_allclose(engaged_share(gaps, TRAVEL), expected, atol=1e-15)
    assert engaged_share([[0.001]], TRAVEL).shape == (1, 1)


def test_it_does_not_jump():
    gaps = np.linspace(-0.001, 0.006, 7001)
    assert np.abs(np.diff(engaged_share(gaps, TRAVEL))).max() <= 1e-6 / TRAVEL + 1e-15


def test_a_millionth_of_the_spines_is_none():
    shares = engaged_share(TRAVEL * (1.0 - np.array([2e-6, 0.9e-6, 1e-12])), TRAVEL)
    np.testing.assert_allclose(shares, [2e-6, 0.0, 0.0], atol=1e-12)


def test_spines_that_do_not_reach_out_hold_where_the_tile_touches_alone():
    np.testing.assert_array_equal(engaged_share([0.0, 1e-9, np.inf], 0.0), [1.0, 0.0, 0.0])
