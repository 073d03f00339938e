"""How much of the processes' time each place has had, and whose turn it is by that.

A place is one client, or all those whom nothing tells apart. The one that has had least is next.
Who comes back after a while begins with as much as the one whose turn it is: time that nobody asked
for is not saved up.
"""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Sequence
from typing import Final

__all__ = ["Shares"]

KEPT: Final = 4096
"""Places that are remembered, those that asked last."""

START: Final = 3.0
"""How long a process takes to start, before any has been seen to [s]."""

PAYS: Final = 4.0
"""A place that has ended a process waits for this many times what it takes to start one, so that
starting takes no more than a fifth of a core from the others."""

ACTIVE: Final = 10.0
"""How long after its last question a place counts as one that others are to leave time to [s]."""


class Shares:
    """Processes' time by place.

    Attributes
    ----------
    start : float
        How long a process takes to start [s].
    """

    def __init__(self) -> None:
        self.start = START
        self._spent: OrderedDict[str, float] = OrderedDict()
        self._asked: dict[str, float] = {}
        self._held: dict[str, float] = {}
        self._level = 0.0

    def asks(self, place: str) -> None:
        """Take note of a question."""
        self._spent[place] = max(self._spent.pop(place, self._level), self._level)
        self._asked[place] = time.perf_counter()
        while len(self._spent) > KEPT:
            oldest, _ = self._spent.popitem(last=False)
            self._asked.pop(oldest, None)

    def charge(self, place: str, seconds: float) -> None:
        """Take off time that a place's question has cost [s]."""
        self._spent[place] = self._spent.get(place, self._level) + seconds

    def ended_process(self, place: str, seconds: float) -> None:
        """Take off time of a question that has ended its process, and of the start of another."""
        self.charge(place, seconds + self.start)
        self._held[place] = time.perf_counter() + PAYS * self.start

    def gone(self, place: str) -> None:
        """Take note that a place will not ask again soon."""
        self._asked.pop(place, None)
        self._held.pop(place, None)

    def next(self, places: Sequence[str]) -> str | None:
        """Return which of some places with a question is next, the first of equals."""
        if not places:
            return None
        place = min(places, key=lambda each: self._spent.get(each, self._level))
        self._level = max(self._level, self._spent.get(place, self._level))
        return place

    def waits(self, place: str) -> float:
        """Return how long a place has to wait because it has ended a process [s]."""
        until = self._held.get(place)
        if until is None:
            return 0.0
        now = time.perf_counter()
        others = [at for each, at in self._asked.items() if each != place]
        # where nobody else asks, nobody is kept waiting
        until = min(until, max(others, default=0.0) + ACTIVE)
        if until <= now:
            del self._held[place]
        return max(until - now, 0.0)
