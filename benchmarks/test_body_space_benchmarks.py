"""How long it takes to find what a stance can hold, and one direction of it by another solver.

``pytest benchmarks --benchmark-enable -m slow`` measures; else each runs once, as a test.
"""

import numpy as np
import pytest

from planner.capability import BodySpace
from planner.question import Load
from tests.suite.helpers import peer
from tests.suite.helpers.stances import ask, on_wall

pytestmark = pytest.mark.slow

WAY = np.array([0.0, 0.6, 0.8, 0.0, 0.0, 0.0])


@pytest.fixture(scope="module")
def space() -> BodySpace:
    return BodySpace(ask(on_wall(), load=Load(80.0, (0.0, 0.0, 0.05))))


@pytest.mark.benchmark(group="farthest body wrench of four hands")
def test_support(benchmark, space):
    assert benchmark(space.support, WAY).reach > 0.0


@pytest.mark.benchmark(group="farthest body wrench of four hands")
def test_support_by_highs(benchmark, space):
    rows = peer.rows(space.question)
    A, b = np.vstack([rows.L, rows.H]), np.concatenate([rows.s - rows.l0, rows.h])
    found = benchmark(peer.solve, -(WAY @ rows.B), A, b)
    assert WAY @ rows.b - found.fun == pytest.approx(space.support(WAY).reach, rel=1e-6)


@pytest.mark.benchmark(group="a plane of four hands' body wrenches")
@pytest.mark.parametrize("others", ["needed", "free"])
def test_section(benchmark, space, others):
    polygon = benchmark(space.section, ("fx", "fz"), others).polygon
    assert len(polygon.inner) > 4


@pytest.mark.benchmark(group="a plane of four hands' body wrenches")
def test_accelerations(benchmark, space):
    polygon = benchmark(space.acceleration_section, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    assert len(polygon.inner) > 4
