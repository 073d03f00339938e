"""The Monte Carlo of a spine array, its laws written out anew, and its fits to what is known."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.integrate import quad
from scipy.stats import truncnorm

from hand_models import InvalidInputError, Surface
from hand_models.parameters import surface_table
from hand_models.tile import (
    LEAST_SPINES,
    SpineArray,
    fit_lateral,
    fit_line,
    measured_tile_shear,
    statistics,
    surface_names,
)
from hand_models.tile.spine_array import spine_forces
from hand_models.tile.spine_calibration import (
    TileShear,
)

FINE = SpineArray.named("concrete-fine")
COARSE = SpineArray.named("concrete-coarse")
PULL_OFF_ANGLE = surface_table().scalar("defaults", "pull_off_angle")


def rng(seed=7):
    return np.random.default_rng(seed)


# The tile's law ---------------------------------------------------------------------------------


def test_forces_of_three_spines_by_hand():
    """k = 10 N/mm: the first reaches 5 N after 0.5 mm; the second, 0.1 mm late, then holds 4 N."""
    forces = spine_forces(np.array([5.0, 8.0, np.inf]), np.array([0.0, 1e-4, 0.0]), 1e4)
    np.testing.assert_allclose(forces, [5.0, 4.0, 0.0])
    # 0.2 mm of play keep the second out, if the first holds only 1 N
    forces = spine_forces(np.array([1.0, 8.0]), np.array([0.0, 2e-4]), 1e4)
    np.testing.assert_allclose(forces, [1.0, 0.0])
    np.testing.assert_array_equal(spine_forces(np.full(3, np.inf), np.zeros(3), 1e4), 0.0)


@given(st.integers(1, 30), st.floats(0.0, 1e-3), st.integers(0, 10_000))
def test_the_first_spine_at_its_limit_ends_the_travel(spines, backlash, seed):
    numbers = rng(seed)
    limits = numbers.uniform(0.1, 20.0, (5, spines))
    limits[numbers.random(limits.shape) < 0.4] = np.inf
    play = backlash * numbers.random(limits.shape)
    forces = spine_forces(limits, play, 17500.0)
    assert (forces <= limits * (1.0 + 1e-9)).all()
    assert (forces[np.isinf(limits)] == 0.0).all()
    for force, limit, slack in zip(forces, limits, play, strict=True):
        if np.isinf(limit).all():
            continue
        travel = min(f / 17500.0 + s for f, s in zip(limit, slack, strict=True))
        first = int(np.argmin(limit / 17500.0 + slack))
        assert force[first] == pytest.approx(limit[first])
        taken = [17500.0 * (travel - s) for f, s in zip(limit, slack, strict=True) if f < np.inf]
        assert force.sum() == pytest.approx(sum(max(t, 0.0) for t in taken))


def test_one_spine_holds_what_its_asperity_does():
    """A Gaussian of 6 ± 4 N, cut to 0 to 10 N, on 30 % of the area."""
    one = replace(
        FINE,
        spines=1,
        asperity_fraction=0.3,
        strength_mean=6.0,
        strength_deviation=4.0,
        shaft_strength=10.0,
    )
    held = one.simulate_drag(rng(), 200_000)
    cut = truncnorm(-6.0 / 4.0, 4.0 / 4.0, loc=6.0, scale=4.0)
    assert np.mean(held > 0.0) == pytest.approx(0.3, abs=0.005)
    assert held[held > 0.0].mean() == pytest.approx(cut.mean(), rel=0.005)
    assert held[held > 0.0].std() == pytest.approx(cut.std(), rel=0.01)
    assert held.max() <= 10.0


def test_without_backlash_all_spines_pull_alike():
    """n spines on asperities hold n times the weakest of them."""
    tight = replace(FINE, backlash=0.0, asperity_fraction=1.0, strength_deviation=1e-6)
    np.testing.assert_allclose(tight.simulate_drag(rng(), 5), 40 * tight.strength_mean, rtol=1e-5)


def test_simulations_are_seeded_and_shaped_like_the_directions():
    angles, azimuths = np.array([[0.0], [0.3]]), np.array([0.0, 0.5, 1.0])
    first = FINE.simulate(rng(), 10, angles, azimuths)
    assert first.shape == (10, 2, 3)
    np.testing.assert_array_equal(first, FINE.simulate(rng(), 10, angles, azimuths))
    assert (first != FINE.simulate(rng(8), 10, angles, azimuths)).any()


def test_statistics_by_hand():
    found = statistics(np.array([[1.0, 10.0], [2.0, 10.0], [3.0, 10.0]]))
    np.testing.assert_allclose(found.mean, [2.0, 10.0])
    np.testing.assert_allclose(found.deviation, [1.0, 0.0])
    np.testing.assert_allclose(found.quantiles[1], [2.0, 10.0])
    np.testing.assert_allclose(found.quantiles[:, 0], [1.1, 2.0, 2.9])


# Direction --------------------------------------------------------------------------------------


def held_over(array, angle, azimuth):
    """∫ C_c C_i f dψ over the slopes that hold, by quadrature."""
    width = array.slope_max - array.slope_min
    tilt = math.asin(math.sin(array.channel_tilt) * math.cos(azimuth))
    cone = math.atan(array.channel_friction)
    channel = 1.0
    if angle > tilt + cone:
        channel = max(0.0, math.sin(tilt + math.pi / 2 - angle - cone))
        channel *= 1.0 + array.channel_friction**2
    shaft = tilt + math.pi / 2 - array.tip_cone / 2
    least = angle + math.pi / 2 - math.atan(array.asperity_friction)

    def density(slope):
        part = 2.0 / width - 2.0 / width**2 * (slope - array.slope_min)
        return part * (1.0 if slope <= shaft else array.shaft_contact)

    low = min(max(least, array.slope_min), array.slope_max)
    breaks = [b for b in (shaft,) if low < b < array.slope_max]
    return channel * quad(density, low, array.slope_max, points=breaks or None)[0]


@given(
    st.floats(0.0, math.pi / 2),
    st.floats(0.0, math.pi),
    st.floats(0.0, 1.0),
    st.floats(0.3, 2.0),
    st.floats(1.8, 3.0),
)
def test_share_is_the_integral_over_the_slopes_that_hold(angle, azimuth, shaft, friction, steepest):
    array = replace(FINE, shaft_contact=shaft, asperity_friction=friction, slope_max=steepest)
    expected = held_over(array, angle, azimuth) / held_over(array, 0.0, 0.0)
    assert float(array.share(angle, azimuth)) == pytest.approx(expected, abs=1e-8)


def test_share_by_hand():
    """μ = tan 30° and slopes of 60° to 150°, tips only: a hold at 15° asks for 75°, (75/90)²."""
    array = replace(FINE, shaft_contact=1.0, asperity_friction=math.tan(math.radians(30.0)))
    assert float(array.share(0.0)) == 1.0
    assert float(array.share(math.radians(15.0))) == pytest.approx((75.0 / 90.0) ** 2)
    # sideways and backwards in the tile's plane nothing slips: as along the drag
    np.testing.assert_allclose(array.share(0.0, np.radians([90.0, 180.0])), 1.0)
    # a shaft that holds nothing: tips reach 97.5° along the drag and 82.5° sideways
    bare = replace(array, shaft_contact=0.0)
    along, sideways = 1.0 - (52.5 / 90.0) ** 2, 1.0 - (67.5 / 90.0) ** 2
    assert float(bare.share(0.0, math.pi / 2)) == pytest.approx(sideways / along)


def test_a_pressed_tile_adds_friction_of_its_body():
    """Pressed at 45° with μ_t = 0.3, Y = F(0) + 0.3 N with N = Y: F = √2 F(0) / 0.7."""
    pressed = replace(FINE, tile_friction=0.3)
    assert float(pressed.share(-math.pi / 4)) == pytest.approx(math.sqrt(2.0) / 0.7)
    assert np.isinf(replace(FINE, tile_friction=1.2).share(-math.pi / 4))
    one = FINE.simulate(rng(), 50, [0.0, -math.pi / 4])
    np.testing.assert_allclose(one[:, 1], one[:, 0] * float(FINE.share(-math.pi / 4)))


@pytest.mark.parametrize("array", [FINE, COARSE], ids=["fine", "coarse"])
def test_the_monte_carlo_has_the_mean_of_the_published_law(array):
    angles = np.radians([0.0, 15.0, 30.0, 45.0, 60.0])[:, None]
    azimuths = np.radians([0.0, 45.0, 90.0, 150.0])
    trials = 4_000
    held = array.simulate(rng(), trials, angles, azimuths)
    drag = array.simulate_drag(rng(9), 100_000).mean()
    found = statistics(held)
    error = 4.5 * np.maximum(found.deviation, 1e-9) / math.sqrt(trials) + 0.005 * found.mean
    assert (np.abs(found.mean - drag * array.share(angles, azimuths)) <= error).all()


def test_more_spines_scatter_less_in_proportion():
    small, large = (statistics(replace(FINE, spines=n).simulate(rng(), 5000)) for n in (10, 60))
    assert large.deviation / large.mean < 0.85 * small.deviation / small.mean


# What is published ------------------------------------------------------------------------------


@pytest.mark.parametrize(("concrete", "array"), [("fine", FINE), ("coarse", COARSE)])
def test_the_tile_shear_table_is_met_within_its_bars(concrete, array):
    """20, 40, 60 spines, two backlashes; the tiles of 5 and 10, not fitted, are met as well."""
    for cell in measured_tile_shear(concrete):
        tile = replace(array, spines=cell.spines, backlash=cell.backlash)
        mean = tile.simulate_drag(rng(99), 5000).mean()
        assert abs(mean - cell.mean) <= (0.5 if cell.spines >= LEAST_SPINES else 0.8) * cell.error


@pytest.mark.parametrize("array", [FINE, COARSE], ids=["fine", "coarse"])
def test_the_trends_of_the_table_are_met(array):
    """More spines hold more, but each of them less; looser channels hold less."""
    means = np.array(
        [
            [
                replace(array, spines=n, backlash=b).simulate_drag(rng(3), 5000).mean()
                for n in (5, 10, 20, 40, 60)
            ]
            for b in (1e-4, 5e-4)
        ]
    )
    assert (np.diff(means, axis=1) > 0.0).all()
    assert (np.diff(means / [5, 10, 20, 40, 60], axis=1) < 0.0).all()
    assert (means[1] < means[0]).all()


def test_the_table_is_that_of_the_figure():
    cells = measured_tile_shear("coarse")
    assert len(cells) == 10
    assert cells[3] == TileShear(40, 1e-4, 49.5, 18.0)
    assert cells[-1] == TileShear(60, 5e-4, 37.5, 23.0)
    with pytest.raises(InvalidInputError, match="medium"):
        measured_tile_shear("medium")


# Fits -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("surface", "like"), [("sandpaper-36", "concrete-fine"), ("rock", "concrete-coarse")]
)
def test_unmeasured_surfaces_are_scaled_to_their_shear_limit(surface, like):
    limit, array = Surface.named(surface).shear_limit, SpineArray.named(surface)
    measured = SpineArray.named(like)
    factor = array.strength_mean / measured.strength_mean
    assert array.strength_deviation == pytest.approx(factor * measured.strength_deviation, rel=1e-3)
    assert array.simulate_drag(rng(5), 20_000).mean() == pytest.approx(limit, rel=0.02)


@pytest.mark.parametrize("surface", surface_names())
def test_the_friction_of_the_file_meets_the_pull_off_ratio(surface):
    ratio = surface_table().scalar("defaults", "pull_off_ratio")
    array = SpineArray.named(surface)
    assert float(array.share(PULL_OFF_ANGLE)) == pytest.approx(ratio, rel=1e-3)


def test_the_lateral_law_of_the_surfaces_is_the_arrays():
    """The fit gives the numbers of the file, and its error is that of the planner's surface.

    They are of tips that fall to √2 / 5 at 45° (T + 4 P = T_max); those that fall to the file's
    pull-off hold as much sideways without pull, and a little more under it.
    """
    array = replace(FINE, asperity_friction=1.0960)
    assert float(array.share(PULL_OFF_ANGLE)) == pytest.approx(math.sqrt(2.0) / 5.0, rel=1e-3)
    fit, defaults = fit_lateral(array, PULL_OFF_ANGLE), surface_table().sections["defaults"]
    assert fit.lateral_ratio == pytest.approx(defaults["lateral_ratio"].value, abs=1e-4)
    assert fit.lateral_pull_off_ratio == pytest.approx(
        defaults["lateral_pull_off_ratio"].value, abs=1e-4
    )
    assert (fit.rms, fit.worst) == pytest.approx((0.043, 0.148), abs=1e-3)
    rock = Surface.named("rock")
    angles = np.linspace(0.0, PULL_OFF_ANGLE, 46)[:, None]
    azimuths = np.linspace(0.0, math.pi / 2, 46)
    of_surface = rock.strength(angles, azimuths) / rock.strength(angles)
    error = of_surface - array.share(angles, azimuths) / array.share(angles)
    assert float(np.sqrt(np.mean(error**2))) == pytest.approx(fit.rms, abs=1e-4)
    assert float(np.abs(error).max()) == pytest.approx(fit.worst, abs=1e-3)
    ours = fit_lateral(FINE, PULL_OFF_ANGLE)
    assert ours.lateral_ratio == pytest.approx(fit.lateral_ratio, rel=1e-9)
    assert 0.0 < ours.lateral_pull_off_ratio - fit.lateral_pull_off_ratio < 0.02


@pytest.mark.parametrize(("shaft", "ratio"), [(0.0, 0.663), (0.5, 0.866), (1.0, 1.0)])
def test_the_lateral_ratio_hangs_on_what_a_shaft_holds(shaft, ratio):
    array = replace(FINE, shaft_contact=shaft)
    assert float(array.share(0.0, math.pi / 2)) == pytest.approx(ratio, abs=1e-3)


def test_a_line_is_fitted_by_hand():
    """60 N at 0 and 20 N at 40°, up and down by 1 N in turn; what is beyond 40° does not count."""
    angles = np.radians([-10.0, 0.0, 10.0, 20.0, 30.0, 40.0, 60.0])
    fit = fit_line(angles, np.array([99.0, 60.0, 50.0, 40.0, 30.0, 20.0, 99.0]), math.radians(40.0))
    assert fit == pytest.approx((60.0, 20.0, 0.0, 0.0, 1.0), abs=1e-9)
    # bumps that no line can follow, even in part
    bumps = np.array([0.0, 1.0, -2.0, 0.0, 2.0, -1.0, 0.0])
    off = fit_line(
        angles, np.array([99.0, 60.0, 50.0, 40.0, 30.0, 20.0, 99.0]) + bumps, math.radians(40.0)
    )
    assert off.shear_limit == pytest.approx(60.0)
    assert off.pull_off_limit == pytest.approx(20.0)
    assert off.rms == pytest.approx(math.sqrt(2.0))
    assert off.worst == pytest.approx(2.0)


# What is refused --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("spines", 0),
        ("spines", 1.5),
        ("backlash", -1e-4),
        ("contact_stiffness", 0.0),
        ("shaft_contact", 1.1),
        ("asperity_fraction", 1.1),
        ("strength_mean", math.nan),
        ("strength_deviation", 0.0),
        ("channel_friction", 0.1),
        ("slope_max", 1.0),
        ("slope_max", 3.2),
    ],
)
def test_impossible_arrays_are_refused_by_field(field, value):
    with pytest.raises(InvalidInputError) as caught:
        replace(FINE, **{field: value})
    assert caught.value.field == field


def test_an_unknown_surface_has_no_spine_array():
    with pytest.raises(InvalidInputError, match=r"granite.*concrete-fine, concrete-coarse, rock"):
        SpineArray.named("granite")
