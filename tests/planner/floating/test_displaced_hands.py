"""Plans of compliant hands that are not quite where they were meant to be."""

import numpy as np
import pytest

from planner.solving import plan
from tests.suite.helpers.displaced_hands import as_given, displaced


@pytest.mark.slow
def test_where_the_utilisation_stays_a_little_beyond_1_the_load_factor_is_found() -> None:
    """Each search for a smaller load ends some 1e-4 beyond 1, as far as the one before."""
    found = plan(displaced("boulders", 3))
    assert found.verified
    assert found.load_factor is not None
    assert 0.9 < found.load_factor < 1.0
    assert not any("lower bound" in each for each in found.warnings)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["wall-300", "boulders"])
def test_hands_that_are_displaced_hold_nearly_what_they_were_to_hold(name: str) -> None:
    found = [plan(displaced(name, i)).load_factor or 0.0 for i in range(12)]
    assert np.quantile(found, 0.1) >= 0.95 * plan(as_given(name)).load_factor
