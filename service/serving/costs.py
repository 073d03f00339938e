"""What questions about a stance have cost so far, and so in which queue the next one waits.

Only an expectation: it decides in which queue a question waits, never whether it is answered. It
goes by the median of the last costs, in processor time: neither one costly question nor a loaded
machine decides it, and who asks for less has the shorter way again.
"""

from __future__ import annotations

import statistics
from collections import deque
from typing import Final
from weakref import WeakSet

from cachetools import LRUCache

from service.serving.question import Question
from service.serving.shares import DEAR, LAST, Shares
from service.serving.waiting import Kind
from service.wire import PLAN, SET_POINTS

__all__ = ["Costs"]

KEPT: Final = 4096
"""Stances that are remembered, those that were asked about last."""

SHORT: Final = 0.05
"""A question about a known stance that costs no more may use the lane that nothing delays [s]."""

SOON: Final = 0.3
"""So may a stance cost when it was new [s]: the lane's process has to make it known there, too."""


class _Stance:
    """Which processes know a stance, and what it cost where it was new and since [s]."""

    def __init__(self) -> None:
        self.known_to: WeakSet[object] = WeakSet()
        self.new: deque[float] = deque(maxlen=LAST)
        self.again: deque[float] = deque(maxlen=LAST)


class Costs:
    """What has been seen of stances, by their hashes.

    Parameters
    ----------
    shares : Shares
        Has what questions of a place have cost.
    """

    def __init__(self, shares: Shares) -> None:
        self._shares = shares
        self._stances: LRUCache[int | None, _Stance] = LRUCache(KEPT)

    def took(self, stance: int, process: object, seconds: float) -> None:
        """Remember what an answer about a stance has cost in a process [s]."""
        seen = self._stances.setdefault(stance, _Stance())
        (seen.again if process in seen.known_to else seen.new).append(seconds)
        seen.known_to.add(process)

    def kind(self, question: Question) -> Kind:
        """Return the queue in which a question is to wait."""
        if question.name == SET_POINTS:
            return Kind.SET_POINTS
        if question.dear:
            return Kind.DEAR
        if question.name == PLAN and self.is_short(question.stance):
            return Kind.SHORT
        dear = self._shares.is_dear(question.place) and not self._is_cheap(question.stance)
        return Kind.DEAR if dear else Kind.OTHER

    def is_short(self, stance: int | None) -> bool:
        """Whether a question about a stance is sure to be answered soon."""
        seen = self._stances.get(stance)
        if seen is None or not seen.again:
            return False
        return statistics.median(seen.again) <= SHORT and statistics.median_low(seen.new) <= SOON

    def _is_cheap(self, stance: int | None) -> bool:
        """Whether questions about a stance have cost little so far."""
        seen = self._stances.get(stance)
        return seen is not None and statistics.median(seen.again or seen.new) <= DEAR

    def knows(self, process: object, stance: int | None) -> bool:
        """Whether a process knows a stance."""
        seen = self._stances.get(stance)
        return seen is not None and process in seen.known_to
