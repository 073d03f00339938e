"""How many triples of hands are screened, directions learnt and hand poses solved in a second.

The wall has 500 hands of bundled stances, turned at random. ``per_second`` of each benchmark is the
figure: choices of three placements (screened together, or as index arrays), supports of a hand in a
direction, stances whose linear program is solved, and poses for which joint angles are searched.
"""

from functools import cache

import numpy as np
import pytest

from planner.limbs import LimbChain
from planner.reach import Starts, reach_poses
from planner.robots import robosimian
from planner.screening import ScreeningTable, StanceIndices, learn, solve_stance
from tests.suite.helpers.walls import random_wall

pytestmark = pytest.mark.slow

PLACEMENTS = 500


@cache
def learnt():
    """A table with directions learnt from triples, candidates of three limbs, the best factor."""
    wall, rng = random_wall(1, PLACEMENTS), np.random.default_rng(0)
    sides = np.array([pose.position @ wall.lean for pose in wall.poses])[:, 1:] > 0.0
    corners = [np.flatnonzero((sides == corner).all(axis=1)) for corner in ((0, 0), (0, 1), (1, 0))]
    table = ScreeningTable.of(wall.hands, wall.wrench(np.array([-0.35, 0.0, 0.0]))[None])
    best = 0.0
    for _ in range(3):
        found = learn(table, triples(rng, corners, 40_000), count=10, programs=100)
        table, best = found.table, max(best, found.best)
    return table.reordered(triples(rng, corners, 20_000), 0.9 * best), corners, best


def triples(rng, corners, count):
    members = np.column_stack([rng.choice(corner, count) for corner in corners])
    return StanceIndices(np.zeros(count, dtype=np.intp), members)


def measured(benchmark, count, ask, rounds=5):
    found = benchmark.pedantic(ask, rounds=rounds, warmup_rounds=1)
    if benchmark.stats is not None:  # None with --benchmark-disable
        rate = count / benchmark.stats.stats.median
        benchmark.extra_info["per_second"] = rate
        print(f"{benchmark.name}: {rate:.3g} a second")
    return found


@pytest.mark.benchmark(group="triples screened")
@pytest.mark.parametrize("share", [0.9, 0.7])
def test_triples_of_all_choices(benchmark, share):
    table, corners, best = learnt()
    count = int(np.prod([len(corner) for corner in corners]))
    passing = measured(benchmark, count, lambda: table.passing(0, corners, share * best))
    print(f"at {share} of the best load factor {100.0 * len(passing) / count:.2g} % pass")
    assert 0 < len(passing) < 0.1 * count


@pytest.mark.benchmark(group="triples screened")
def test_triples_as_indices(benchmark):
    table, corners, best = learnt()
    stances = triples(np.random.default_rng(1), corners, 1_000_000)
    bounds = measured(benchmark, 1_000_000, lambda: table.bounds(stances, 0.9 * best))
    assert 0.0 < (bounds >= 0.9 * best).mean() < 0.1


@pytest.mark.benchmark(group="supports")
def test_supports_in_directions(benchmark):
    table, _, _ = learnt()
    found = measured(
        benchmark, table.supports.size, lambda: table.hands.supports(table.directions), rounds=2
    )
    np.testing.assert_allclose(found, table.supports, atol=1e-9)


@pytest.mark.benchmark(group="linear programs of stances")
def test_programs_of_triples(benchmark):
    table, corners, _ = learnt()
    stances = triples(np.random.default_rng(2), corners, 100)
    wrench = table.wrenches[0]
    found = measured(
        benchmark,
        100,
        lambda: [solve_stance(table.hands, row, wrench).factor for row in stances.members],
        rounds=2,
    )
    assert np.isfinite(found).any()


@pytest.mark.benchmark(group="hand poses solved")
@pytest.mark.parametrize("branches", [1, 3])
def test_reachable_poses(benchmark, branches):
    robot = robosimian()
    chain = LimbChain.of(robot, robot.limbs[0])
    starts, rng = Starts(chain), np.random.default_rng(3)
    targets = chain.frames(rng.uniform(chain.lower, chain.upper, (5000, len(chain.lower))))
    _, count = measured(
        benchmark, 5000, lambda: reach_poses(chain, starts, targets, branches), rounds=3
    )
    assert (count > 0).mean() > 0.99
