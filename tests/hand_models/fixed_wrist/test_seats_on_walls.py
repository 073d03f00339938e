"""On rough walls hands are seated nearly everywhere, and a seat that is looked for holds more."""

import math

import numpy as np
import pytest

from hand_models import InvalidInputError
from hand_models.fixed_wrist import grid_of_trials, try_holds
from hand_models.rock import Mesh
from tests.suite.helpers.hands import HAND, ROCK
from tests.suite.helpers.rocks import fractal_wall

HEIGHTS = (0.002, 0.004, 0.008, 0.016, 0.03)
"""Of the walls' roughness, root mean squares over a metre [m]."""


def pull_offs(found):
    """How far hands that can be there reach in the pull-off; NaN where they hold nothing."""
    return [each.support[0] for each in found if not isinstance(each, InvalidInputError)]


PLACES, SEARCHED = 40, 6
"""On each wall."""


@pytest.mark.slow
def test_hands_are_seated_and_best_seats_hold_more():
    seated, tried, rest, best = 0, 0, [], []
    for seed, height in enumerate(HEIGHTS):
        wall = Mesh(*fractal_wall(seed, size=1.0, count=201, height=height), anywhere=True)
        trials = grid_of_trials(wall, 0.04, 4, (0.0, math.pi), radius=0.055)
        inside = [each for each in trials if max(map(abs, each.point[:2])) < 0.28]
        rng = np.random.default_rng(seed)
        drawn = [inside[i] for i in rng.permutation(len(inside))[:PLACES]]
        found = pull_offs(try_holds(HAND, wall, ROCK, drawn))
        seated, tried = seated + len(found), tried + len(drawn)
        looked_for = pull_offs(try_holds(HAND, wall, ROCK, drawn[:SEARCHED], "best"))
        assert len(looked_for) >= 0.95 * SEARCHED
        rest += pull_offs(try_holds(HAND, wall, ROCK, drawn[:SEARCHED]))
        best += looked_for
    assert seated >= 0.85 * tried
    # where most seats at rest cannot even be let alone, most of those that were looked for hold
    assert np.nanmedian(best) > max(2.0 * np.nanmedian(rest), 10.0)
