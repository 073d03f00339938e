"""How fast climbs are found, how few programs they take, and how near the bound is.

``processor_seconds`` and ``solved`` (the share of all stances whose program was solved) of a wall
that is searched to its end, with the load factors of all its stances not known; ``first`` and
``gaps`` of a large one: processor time until a climb is known, and the gap to the bound after some
processor time.
"""

import time
from itertools import combinations, product

import numpy as np
import pytest

from planner.search import Ends, search
from tests.suite.helpers.walls import climbing_wall

pytestmark = pytest.mark.slow

LARGE = {
    "columns": 9,
    "rows": 18,
    "stand_offs": (0.35, 0.5),
    "step": 0.14,
    "radius": 0.5,
    "lean": 0.8,
    "size": (2.5, 4.0),
}


def from_foot_to_top(wall):
    heights = np.array([body.position[2] for body in wall.bodies])
    rows = np.round(heights / 0.01)
    foot, top = rows.min(), rows.max()
    return Ends(bodies=rows <= foot + 1), Ends(bodies=rows >= top - 1)


def stances_of(wall):
    """Number of states with three or four hands on the rock."""
    count, reached = 0, wall.reach.reached
    for body in range(len(wall.bodies)):
        own = [np.flatnonzero(reached[:, body, limb]) for limb in range(4)]
        for lifted in (-1, 0, 1, 2, 3):
            chosen = [own[limb] for limb in range(4) if limb != lifted]
            pairs = [
                (i, j, wall.apart[np.ix_(chosen[i], chosen[j])])
                for i, j in combinations(range(len(chosen)), 2)
            ]
            for row in product(*(range(len(each)) for each in chosen)):
                count += all(fits[row[i], row[j]] for i, j, fits in pairs)
    return count


@pytest.mark.benchmark(group="climbs of a wall, proven to be the best")
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_wall_is_searched_to_its_end(benchmark, seed):
    wall, _ = climbing_wall(seed, 50, columns=3, rows=9, radius=0.42)
    start, goal = from_foot_to_top(wall)
    count = stances_of(wall)
    begun = time.process_time()
    found = benchmark.pedantic(lambda: search(wall, start, goal), rounds=1)
    took = time.process_time() - begun
    benchmark.extra_info |= {
        "stances": count,
        "processor_seconds": took,
        "solved": found.programs / count,
    }
    print(f"{count} stances, {took:.1f} s, {100.0 * found.programs / count:.1f} % solved")
    assert found.finished


@pytest.mark.benchmark(group="climbs of a large wall")
def test_a_large_wall(benchmark):
    wall, _ = climbing_wall(1, 500, **LARGE)
    start, goal = from_foot_to_top(wall)
    # as a test, a climb is enough
    within = 0.2 if benchmark.disabled else 0.01
    begun, first, gaps = time.process_time(), [], {}

    def said(phase, least, bound, programs):
        now = time.process_time() - begun
        if least > 0.0:
            first.append(now)
            for end in (60, 300):
                if now <= end:
                    gaps[end] = bound / least - 1.0

    found = benchmark.pedantic(
        lambda: search(wall, start, goal, within=within, seconds=300.0, progress=said), rounds=1
    )
    took = time.process_time() - begun
    benchmark.extra_info |= {"first": first[0], "gaps": gaps, "end": found.gap, "took": took}
    shares = ", ".join(f"{100.0 * gap:.1f} % after {end} s" for end, gap in gaps.items())
    print(f"first climb {first[0]:.1f} s; gap {shares}; {100.0 * found.gap:.1f} % at {took:.0f} s")
    assert found.states
