"""Random real stances: no plan fails, and the solver needs few iterations."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.random_plans import answer

STANCES = 300
"""How many are planned; the 99th percentile has three beyond it."""

MOST = 25
"""Iterations that 99 of 100 plans need at most."""


@pytest.mark.slow
def test_three_hundred_random_stances_are_planned_in_few_iterations():
    """The command ``python -m benchmarks --only stances --stances 10000`` plans more."""
    iterations = []
    for seed in range(STANCES):
        found = answer(seed)
        assert found.plan.status != "failed", f"seed {seed}: {found.reason}"
        iterations.append(found.plan.iterations)
    print(len(iterations), np.percentile(iterations, [50, 99, 100]))
    assert np.percentile(iterations, 99) <= MOST
