"""Weibull distributions of tiles' strengths, against SciPy's and published moduli."""

import math

import numpy as np
import pytest
from scipy.stats import weibull_min

from hand_models.base import InvalidInputError
from hand_models.tile import hazards, mean_factor, weibull_modulus


@pytest.mark.parametrize(("ratio", "modulus"), [(0.364, 3.0), (0.258, 4.4)])
def test_the_moduli_of_measured_tiles(ratio, modulus):
    assert weibull_modulus(ratio) == pytest.approx(modulus, abs=0.05)


@pytest.mark.parametrize("ratio", [0.05, 0.19, 0.364, 0.9])
def test_the_scatter_is_that_of_the_distribution(ratio):
    mean, variance = weibull_min(weibull_modulus(ratio)).stats("mv")
    assert math.sqrt(variance) / mean == pytest.approx(ratio, rel=1e-9)


def test_the_hazard_is_that_of_the_distribution():
    m, uses = weibull_modulus(0.364), np.array([0.0, 0.3, 1.0])
    strengths = weibull_min(m, scale=1.0 / mean_factor(m))
    assert strengths.mean() == pytest.approx(1.0)
    np.testing.assert_allclose(np.exp(-hazards(uses, m)), strengths.sf(uses))
    assert hazards(-1.0, m) == 0.0


@pytest.mark.parametrize("ratio", [0.0, 0.04, 0.91, -1.0, math.nan, math.inf])
def test_a_scatter_without_a_modulus_is_refused(ratio):
    with pytest.raises(InvalidInputError, match=r"0\.05 to 0\.9 times the mean"):
        weibull_modulus(ratio)
