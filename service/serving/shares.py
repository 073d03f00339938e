"""Share the processes' time among places: time that each has had, and so whose turn it is.

A place is one client, or all clients that cannot be distinguished. The one that has had least is
next. A place that comes back after a while begins with as much as the one whose turn it is: time
that nobody asked for is not saved up.
"""

from __future__ import annotations

import math
import statistics
import time
from collections import OrderedDict, deque
from collections.abc import Sequence
from dataclasses import dataclass, field

from service.serving.settings import SERVING_SETTINGS

__all__ = ["Shares"]


@dataclass
class _Place:
    """Record of a place: times in s, on the clock of `time.perf_counter`.

    Attributes
    ----------
    spent : float
        The processes' time that it has had.
    costs : deque of float
        Processor times of its last answers.
    asked : float
        When it asked last.
    held_until : float
        When it need no longer wait for having ended a process.
    """

    spent: float
    costs: deque[float] = field(
        default_factory=lambda: deque(maxlen=SERVING_SETTINGS.remembered_costs)
    )
    asked: float = -math.inf
    held_until: float = -math.inf


class Shares:
    """Processes' time by place.

    Attributes
    ----------
    start : float
        How long a process takes to start [s].
    """

    def __init__(self) -> None:
        # before any has been seen to start
        self.start = 3.0
        self._places: OrderedDict[str, _Place] = OrderedDict()
        self._level = 0.0

    def _of(self, place: str) -> _Place:
        """Return what is remembered of a place, from now on if nothing is."""
        found = self._places.setdefault(place, _Place(self._level))
        if len(self._places) > SERVING_SETTINGS.remembered:
            self._places.popitem(last=False)
        return found

    def asks(self, place: str) -> None:
        """Take note of a question."""
        known = self._of(place)
        known.spent = max(known.spent, self._level)
        known.asked = time.perf_counter()
        self._places.move_to_end(place)

    def charge(self, place: str, seconds: float) -> None:
        """Take off time that an answer to a place has cost [s]."""
        known = self._of(place)
        known.spent += seconds
        known.costs.append(seconds)

    def ended_process(self, place: str, seconds: float) -> None:
        """Charge a question that has ended its process, and the start of another.

        Parameters
        ----------
        place : str
        seconds : float
            How long its process has worked on it [s].
        """
        self.charge(place, seconds)
        known = self._of(place)
        known.spent += self.start
        waits = SERVING_SETTINGS.starts_waited * self.start
        known.held_until = time.perf_counter() + waits

    def gone(self, place: str) -> None:
        """Take note that a place will not ask again soon."""
        if known := self._places.get(place):
            known.asked = known.held_until = -math.inf

    def next(self, places: Sequence[str]) -> str | None:
        """Return which of some places with a question is next, the first of equals."""
        if not places:
            return None
        place = min(places, key=self._spent)
        self._level = max(self._level, self._spent(place))
        return place

    def _spent(self, place: str) -> float:
        known = self._places.get(place)
        return self._level if known is None else known.spent

    def waits(self, place: str) -> float:
        """Return how long a place has to wait because it has ended a process [s]."""
        known, now = self._places.get(place), time.perf_counter()
        if known is None or known.held_until <= now:
            return 0.0
        others = (each.asked for name, each in self._places.items() if name != place)
        # where nobody else asks, nobody is kept waiting
        active_until = max(others, default=-math.inf) + SERVING_SETTINGS.active_time
        return max(min(known.held_until, active_until) - now, 0.0)

    def is_dear(self, place: str) -> bool:
        """Return whether a place's questions cost much."""
        known = self._places.get(place)
        if known is None or not known.costs:
            return False
        return statistics.median(known.costs) > SERVING_SETTINGS.dear_cost
