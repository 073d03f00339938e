"""How far a hand's wrenches go in a direction."""

import numpy as np
import pytest
from scipy.optimize import linprog

from planner.prepare import hand_space
from planner.programs import Support
from tests.suite.helpers.stances import random_question


@pytest.mark.parametrize("cap", [1.0, 0.4])
@pytest.mark.parametrize("seed", range(1, 13))
def test_a_support_is_that_of_another_solver_in_one_direction_after_the_other(seed, cap):
    stance = random_question(seed).stance
    _, space = hand_space(stance, stance.hands[0].limb)
    rng, support = np.random.default_rng(seed), Support(space, cap)
    A = np.vstack([space.L, space.H])
    b = np.concatenate([cap * space.s - space.l0, space.h])
    for direction in rng.normal(size=(6, 6)) * [1.0, 1.0, 1.0, 10.0, 10.0, 10.0]:
        other = linprog(
            -direction @ space.generators, A_ub=A, b_ub=b, bounds=(None, None), method="highs-ipm"
        )
        if other.x is None:
            assert support(direction) == -np.inf
            continue
        expected = direction @ space.origin - other.fun
        assert support(direction) == pytest.approx(expected, rel=1e-5, abs=1e-4)
