"""Random real stances: no plan fails, and the solver needs few iterations."""

from __future__ import annotations

import time

import numpy as np
import pytest

from benchmarks.random_plans import answer

MINUTES = 3.0
"""What the test may take."""

MOST = 25
"""Iterations that 99 of 100 plans need at most."""


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_as_many_random_stances_as_fit_in_a_few_minutes_are_planned_in_few_iterations():
    """The command ``python -m benchmarks --only stances --stances 10000`` plans all."""
    end = time.perf_counter() + 60.0 * MINUTES
    iterations = []
    for seed in range(10_000):
        found = answer(seed)
        assert found.plan.status != "failed", f"seed {seed}: {found.reason}"
        iterations.append(found.plan.iterations)
        if time.perf_counter() > end:
            break
    print(len(iterations), np.percentile(iterations, [50, 99, 100]))
    assert len(iterations) > 100
    assert np.percentile(iterations, 99) <= MOST
