"""Strengths of tiles as random numbers: moments, probabilities and samples."""

import math

import numpy as np
import pytest
from scipy import integrate, stats

from hand_models import InvalidInputError, Surface
from hand_models.tile import StrengthScatter, TileStrengths, weibull_modulus

ALONE = StrengthScatter(0.0, 0.0)
ROCK = Surface.named("rock")


@pytest.mark.parametrize("variation", [1e-3, 0.1, 0.258, 0.364, 1.0, 5.0])
def test_the_modulus_gives_the_coefficient_of_variation(variation):
    law = stats.weibull_min(weibull_modulus(variation))
    assert law.std() / law.mean() == pytest.approx(
        variation, rel=1e-9 if variation > 0.01 else 1e-6
    )


def test_moduli_of_the_measured_scatters():
    assert weibull_modulus(0.258) == pytest.approx(4.387, abs=1e-3)
    assert weibull_modulus(0.364) == pytest.approx(2.995, abs=1e-3)
    # of an exponential distribution
    assert weibull_modulus(1.0) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("variation", [-0.1, math.nan, math.inf])
def test_what_is_no_coefficient_of_variation_is_refused(variation):
    with pytest.raises(InvalidInputError, match="variation"):
        weibull_modulus(variation)


def test_a_mean_of_weakest_tiles_is_not_weakened_twice():
    hand = np.zeros(12, dtype=np.intp)
    for n in (1, 6, 12):
        law = TileStrengths.of([ROCK], hand[:n], ALONE)
        weakest = law.sample(200_000, 0).min(axis=1)
        m = law.modulus[0]
        assert weakest.mean() == pytest.approx((6.0 / n) ** (1.0 / m), rel=3e-3)
    # strengths of single arrays are means of one tile
    fine = TileStrengths.of([Surface.named("concrete-fine")], hand[:1], ALONE)
    assert fine.mean == pytest.approx(1.0)


def test_no_slip_is_the_product_of_weibull_tails():
    used = np.array([0.9, 0.5, -0.2, 0.0, 0.3])
    law = TileStrengths.of([ROCK, Surface.named("concrete-fine")], np.array([0, 0, 0, 1, 1]), ALONE)
    expected = 1.0
    for u, h in zip(used, law.hand, strict=True):
        m = law.modulus[h]
        scale = 1.3 * law.mean[h] / math.gamma(1.0 + 1.0 / m)
        expected *= stats.weibull_min(m, scale=scale).sf(max(u, 0.0))
    assert law.no_slip(used, 1.3) == pytest.approx(expected, rel=1e-12)
    assert law.no_slip(used, law.factor_for(used, 0.9)) == pytest.approx(0.9, abs=1e-12)
    assert law.factor_for(np.zeros(5), 0.9) == 0.0
    assert law.no_slip(np.zeros(5)) == 1.0


@pytest.mark.parametrize("spread", [0.15, 0.44, 0.78])
def test_quadrature_over_factors_is_an_adaptive_integral(spread):
    used = np.array([0.9, 0.8, 0.7])
    alone = TileStrengths.of([ROCK], np.zeros(3, dtype=np.intp), ALONE)
    law = TileStrengths.of([ROCK], np.zeros(3, dtype=np.intp), StrengthScatter(0.0, spread))

    def weighted(z):
        factor = math.exp(spread * z - 0.5 * spread**2)
        return stats.norm.pdf(z) * alone.no_slip(used, 1.2 * factor)

    expected = integrate.quad(weighted, -9.0, 9.0, epsabs=1e-10, limit=400)[0]
    assert law.no_slip(used, 1.2) == pytest.approx(expected, abs=2e-5)
    # one hand: a factor of its hold does what one of the rock does
    own = TileStrengths.of([ROCK], np.zeros(3, dtype=np.intp), StrengthScatter(spread, 0.0))
    assert own.no_slip(used, 1.2) == pytest.approx(law.no_slip(used, 1.2), rel=1e-12)


def test_samples_follow_the_formula_and_share_their_factors():
    hand = np.repeat([0, 1], 4)
    law = TileStrengths.of([ROCK, ROCK], hand, StrengthScatter(0.3, 0.4))
    used = np.linspace(0.2, 0.9, 8)
    sample = law.sample(200_000, 7, 1.4)
    held = (sample >= used).all(axis=1).mean()
    expected = law.no_slip(used, 1.4)
    assert held == pytest.approx(expected, abs=4.0 * math.sqrt(0.25 / 200_000))
    logs = np.log(sample)
    between = np.corrcoef(logs.T)
    # covariances: of the rock's factor alone, and of both
    tile = np.var(logs[:, 0]) - 0.3**2 - 0.4**2
    assert tile == pytest.approx((math.pi / law.modulus[0]) ** 2 / 6.0, rel=0.02)
    assert between[0, 4] * np.var(logs[:, 0]) == pytest.approx(0.16, rel=0.03)
    assert between[0, 1] * np.var(logs[:, 0]) == pytest.approx(0.25, rel=0.03)
    assert sample.mean() == pytest.approx(1.4 * law.mean[0], rel=5e-3)
    assert np.array_equal(law.sample(5, 7), law.sample(5, 7))
    assert not np.array_equal(law.sample(5, 7), law.sample(5, 8))


def test_order_of_the_tiles_does_not_matter():
    rng = np.random.default_rng(3)
    used, hand = rng.uniform(0.0, 1.0, 9), np.repeat([0, 1, 2], 3)
    order = rng.permutation(9)
    surfaces = [ROCK, Surface.named("sandpaper-36"), ROCK]
    there = TileStrengths.of(surfaces, hand[order]).no_slip(used[order])
    assert there == pytest.approx(TileStrengths.of(surfaces, hand).no_slip(used), rel=1e-12)
