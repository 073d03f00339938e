"""What questions have cost so far: about a stance that is known, and of a client.

Only an expectation: it decides in which queue a question waits, never whether it is answered. It
goes by the median of the last costs, in processor time: neither one costly question nor a loaded
machine decides it, and who asks for less has the shorter way again.
"""

from __future__ import annotations

import statistics
from collections import OrderedDict, deque
from typing import Any, Final

from service.serving.question import Question
from service.serving.waiting import Kind
from service.wire import PLAN, SET_POINTS

__all__ = ["DEAR", "Costs"]

KEPT: Final = 4096
"""Stances and clients that are remembered, those that asked last."""

LAST: Final = 20
"""Costs that are remembered of each."""

SHORT: Final = 0.05
"""A question about a known stance that costs no more may use the lane that nothing delays [s]."""

SOON: Final = 0.3
"""So may a stance cost when it was new [s]: the lane's process has to make it known there, too."""

DEAR: Final = 0.1
"""A client whose questions cost more leaves the last process to others [s]."""


class _Stance:
    """Which processes know a stance, and what it cost where it was new and since [s]."""

    def __init__(self) -> None:
        self.known_to: set[object] = set()
        self.new: deque[float] = deque(maxlen=LAST)
        self.again: deque[float] = deque(maxlen=LAST)


class Costs:
    """What has been seen of stances and clients."""

    def __init__(self) -> None:
        self._stances: OrderedDict[int | None, _Stance] = OrderedDict()
        self._clients: OrderedDict[str, deque[float]] = OrderedDict()

    def took(self, client: str, stance: int | None, process: object | None, seconds: float) -> None:
        """Remember what an answer has cost.

        Parameters
        ----------
        client : str
        stance : int or None
            A hash of it, where it can be known from now on.
        process : object or None
            That answered.
        seconds : float
        """
        costs = self._clients.pop(client, None) or deque(maxlen=LAST)
        costs.append(seconds)
        self._clients[client] = costs
        _forget(self._clients)
        if stance is None or process is None:
            return
        seen = self._stances.pop(stance, None) or _Stance()
        self._stances[stance] = seen
        (seen.again if process in seen.known_to else seen.new).append(seconds)
        seen.known_to.add(process)
        _forget(self._stances)

    def lost(self, process: object) -> None:
        """Forget a process that has ended."""
        for seen in self._stances.values():
            seen.known_to.discard(process)

    def kind(self, question: Question) -> Kind:
        """Return the queue in which a question is to wait."""
        if question.name == SET_POINTS:
            return Kind.SET_POINTS
        if question.dear:
            return Kind.DEAR
        if question.name == PLAN and self.is_short(question.stance):
            return Kind.SHORT
        dear = self.is_dear(question.place) and not self.is_cheap(question.stance)
        return Kind.DEAR if dear else Kind.OTHER

    def is_short(self, stance: int | None) -> bool:
        """Whether a question about a stance is sure to be answered soon."""
        seen = self._stances.get(stance)
        if seen is None or not seen.again:
            return False
        return statistics.median(seen.again) <= SHORT and statistics.median_low(seen.new) <= SOON

    def is_cheap(self, stance: int | None) -> bool:
        """Whether questions about a stance have cost little so far."""
        seen = self._stances.get(stance)
        return seen is not None and statistics.median(seen.again or seen.new) <= DEAR

    def knows(self, process: object, stance: int | None) -> bool:
        """Whether a process knows a stance."""
        seen = self._stances.get(stance)
        return seen is not None and process in seen.known_to

    def is_dear(self, client: str) -> bool:
        """Whether a client's questions cost much."""
        costs = self._clients.get(client)
        return costs is not None and statistics.median(costs) > DEAR


def _forget(kept: OrderedDict[Any, Any]) -> None:
    if len(kept) > KEPT:
        kept.popitem(last=False)
