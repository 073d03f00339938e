"""f_t(max) of Eqs. 14 and 15: how far a tendon can be tightened before a tile lets go."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import assume, strategies as st

from hand_models import FINGERS, Cylinder, Pose, Surface, tension_limits
from hand_models.fixed_wrist import wrench_space
from tests.suite.helpers.hands import HAND, ROCK, own_tiles, pinch, settled_at, tile_load
from tests.suite.helpers.shares import given_some

seeds = st.integers(0, 2**32 - 1)


def law(surface, shear, normal):
    """Eq. 21 for a load in the finger plane: the force at which it lets go [N]."""
    angle = math.atan2(-normal, shear)
    if angle < 0.0:
        slope = math.cos(angle) + surface.compression_gain * math.sin(angle)
        return surface.shear_limit / slope if slope > 0.0 else math.inf
    share = min(angle / surface.pull_off_angle, 1.0)
    return surface.shear_limit - (surface.shear_limit - surface.pull_off_limit) * share


def beyond(settled, t, tension):
    load = tile_load(settled, t, tension) / settled.engagement[t]
    return np.hypot(*load) > law(settled.surface, *load)


@given_some(5, 60, seeds)
def test_from_closing_up_to_f_t_max_a_scan_finds_no_tile_beyond_its_law(seed):
    settled = settled_at(seed)
    assume(settled is not None)
    start = settled.closing_tension
    for i, limit in enumerate(tension_limits(settled)):
        assert limit.finger == FINGERS[i]
        tiles = own_tiles(settled, i)
        if any(beyond(settled, t, start) for t in tiles):
            assert limit.tension < start
            continue
        scan = np.geomspace(start, min(limit.tension * (1.0 - 1e-9), 7000.0), 300)
        assert not any(beyond(settled, t, f) for f in scan for t in tiles)
        assert (limit.phalanx is None) == math.isinf(limit.tension)


@given_some(5, 100, seeds)
def test_just_below_f_t_max_every_tile_holds_and_just_above_its_tile_lets_go(seed):
    settled = settled_at(seed)
    assume(settled is not None)
    for i, limit in enumerate(tension_limits(settled)):
        if not math.isfinite(limit.tension) or limit.tension == 0.0:
            continue
        (tile,) = (t for t in own_tiles(settled, i) if settled.tiles[t].phalanx == limit.phalanx)
        assert beyond(settled, tile, limit.tension * (1.0 + 1e-6))
        # the others are followed up from the closing tension only
        holding = own_tiles(settled, i) if limit.tension > settled.closing_tension else [tile]
        for t in holding:
            assert not beyond(settled, t, limit.tension * (1.0 - 1e-6))


@pytest.mark.parametrize("diameter", [0.2, 0.3, 0.7])
@pytest.mark.parametrize("strength", [40.0, 60.0, 120.0])
def test_the_papers_iteration_of_equation_15_ends_at_f_t_max(diameter, strength):
    surface = ROCK.from_values({"shear_limit": strength})
    settled = pinch(diameter, surface)
    for i, limit in enumerate(tension_limits(settled)):
        (tile,) = (t for t in own_tiles(settled, i) if settled.tiles[t].phalanx == limit.phalanx)
        tension = settled.closing_tension
        for _ in range(2000):
            load = tile_load(settled, tile, tension)
            # damped: with a shear that keeps an offset, loading angles do turn with tension
            tension *= (law(surface, *load) / np.hypot(*load)) ** 0.25
        assert tension == pytest.approx(limit.tension, rel=1e-6)


def test_a_tile_beyond_its_law_by_closing_alone_is_safe_only_at_less_tension():
    """Closing drags the distal tile with 0.2006 of 37 N: 7.42 N, and g less for each newton less.

    g = c_p k_c / (k_c + K_p)
    """
    settled = pinch(0.3, ROCK.from_values({"shear_limit": 7.0}))
    gain = 2.0 * 8.215 / (8.215 + 11.5)
    for limit in tension_limits(settled)[1:3]:
        assert limit.phalanx == "distal"
        assert limit.tension == pytest.approx(37.0 - (0.2006 * 37.0 - 7.0) / gain, abs=1e-5)
    weaker = pinch(0.3, ROCK.from_values({"shear_limit": 1.0}))
    assert [limit.tension for limit in tension_limits(weaker)] == [0.0] * 4


def test_a_load_that_cuts_the_notch_of_the_curve_lets_go_there():
    """Pulled off with 3.92 N while shear grows from 7 N, past the kink at 10 N and 0.4 rad.

    Out of the arc of 10 N at T = √(10² − 3.92²) N, back inside the linear part 0.15 N later, out
    again for good at T = 32 N: the first counts.
    """
    surface = Surface(40.0, 10.0, 0.4, 20.0, 0.0)
    settled = pinch(surface=surface)
    loads = np.zeros_like(settled.loads)
    tile = own_tiles(settled, 1)[0]
    loads[tile] = [[-30.0, 1.0], [-3.92, 0.0]]
    limits = tension_limits(dataclasses.replace(settled, loads=loads))
    back_inside = np.array([9.35, -3.92])
    assert np.hypot(*back_inside) < law(surface, *back_inside)
    assert limits[1].tension == pytest.approx(30.0 + math.sqrt(100.0 - 3.92**2), rel=1e-9)
    assert limits[0].tension == math.inf


def test_a_finger_in_the_air_never_lets_go():
    settled = HAND.settle(Cylinder(0.3), ROCK, None, Pose(np.array([0.0, 0.0, 0.5]), np.eye(3)))
    assert tension_limits(settled) == tuple((finger, math.inf, None) for finger in FINGERS)
    np.testing.assert_array_equal(wrench_space(settled).vertices(), np.zeros((1, 6)))
