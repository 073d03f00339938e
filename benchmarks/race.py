"""Timing several ways to the same answer: they take turns, so that noise meets all alike.

Who answers one query after the other finds the processor's caches full of his own; who has others
between does not. A turn is some queries, as of a planner in its loop, or one.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

__all__ = ["TURN", "WARM", "Race", "Way", "race"]

Way = Callable[[int], object]
"""Answers the query of that number."""

WARM = 2
"""Rounds before the ones that count, for what is built on first use."""

TURN = 20
"""Queries in a row, where they are those of a loop."""


@dataclass(frozen=True)
class Race:
    """Durations of each way in each round, shape (rounds,) [s]."""

    times: dict[Hashable, np.ndarray]

    def median(self, name: Hashable) -> float:
        """Return the median duration [s]."""
        return float(np.median(self.times[name]))

    def ratio(self, name: Hashable, to: Hashable) -> float:
        """Return the median over the rounds of one way's duration over another's."""
        return float(np.median(self.times[name] / self.times[to]))


def race(
    ways: Mapping[Any, Way],
    rounds: int,
    tick: Callable[[], object] = lambda: None,
    turn: int = 1,
) -> Race:
    """Time each way once a round, with the same query; they take turns, each time in another order.

    Parameters
    ----------
    ways : mapping of names to callables
        They get the number of the round, from zero; the rounds to warm up have the last numbers.
    rounds : int
    tick : callable, optional
        Called once a round.
    turn : int, optional
        Rounds of a turn.
    """
    times = {name: np.empty(rounds) for name in ways}
    order = list(ways)
    for number in range(rounds, rounds + WARM):
        for name in order:
            ways[name](number)
    gc.collect()
    for first in range(0, rounds, turn):
        numbers = range(first, min(first + turn, rounds))
        for name in order:
            way, own = ways[name], times[name]
            for number in numbers:
                start = time.perf_counter()
                way(number)
                own[number] = time.perf_counter() - start
        order.append(order.pop(0))
        for _ in numbers:
            tick()
    return Race(times)
