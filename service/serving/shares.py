"""Share the workers' time fairly among clients: record the time that each used, and who is next.

A *place* is one client, or all clients that cannot be distinguished. The place that has used least
time is next (fair scheduling). A place that returns after a pause starts with as much used time as
the place that is next: unused time is not saved up.
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
    """Record of the workers' time that each place (client) has used.

    Attributes
    ----------
    start : float
        Time that a worker takes to start [s].
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
        """Record that a place has sent a question now."""
        known = self._of(place)
        known.spent = max(known.spent, self._level)
        known.asked = time.perf_counter()
        self._places.move_to_end(place)

    def charge(self, place: str, seconds: float) -> None:
        """Add the time of an answer to the time that a place has used.

        Parameters
        ----------
        place : str
            The place.
        seconds : float
            Processor time of the answer [s].
        """
        known = self._of(place)
        known.spent += seconds
        known.costs.append(seconds)

    def ended_process(self, place: str, seconds: float) -> None:
        """Charge a place for a question that ended its worker: for the work, and for a new worker.

        While other clients ask, questions of the place then wait four times as long as a worker
        takes to start.

        Parameters
        ----------
        place : str
            The place.
        seconds : float
            Time that the worker spent on the question [s].
        """
        self.charge(place, seconds)
        known = self._of(place)
        known.spent += self.start
        waits = SERVING_SETTINGS.starts_waited * self.start
        known.held_until = time.perf_counter() + waits

    def gone(self, place: str) -> None:
        """Record that a place has disconnected: it is no longer active, and no longer held back."""
        if known := self._places.get(place):
            known.asked = known.held_until = -math.inf

    def next(self, places: Sequence[str]) -> str | None:
        """Return the place that has used least time, the first of equals.

        Parameters
        ----------
        places : sequence of str
            Places with a waiting question.

        Returns
        -------
        str or None
            None where ``places`` is empty.
        """
        if not places:
            return None
        place = min(places, key=self._spent)
        self._level = max(self._level, self._spent(place))
        return place

    def _spent(self, place: str) -> float:
        known = self._places.get(place)
        return self._level if known is None else known.spent

    def waits(self, place: str) -> float:
        """Return for how long a place must still wait because it has ended a worker.

        Returns
        -------
        float
            Time [s]; zero where the place need not wait, or where no other place has asked lately.
        """
        known, now = self._places.get(place), time.perf_counter()
        if known is None or known.held_until <= now:
            return 0.0
        others = (each.asked for name, each in self._places.items() if name != place)
        # where nobody else asks, nobody is kept waiting
        active_until = max(others, default=-math.inf) + SERVING_SETTINGS.active_time
        return max(min(known.held_until, active_until) - now, 0.0)

    def is_dear(self, place: str) -> bool:
        """Return whether the median processor time of a place's last answers is above 0.1 s."""
        known = self._places.get(place)
        if known is None or not known.costs:
            return False
        return statistics.median(known.costs) > SERVING_SETTINGS.dear_cost
