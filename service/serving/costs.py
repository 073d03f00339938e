"""What questions have cost so far: of a stance that is known, and of a client.

Only an expectation: it decides in which queue a question waits, never whether it is answered.
"""

from __future__ import annotations

from collections import OrderedDict
from typing import Any, Final

__all__ = ["DEAR", "Costs"]

KEPT: Final = 4096
"""Stances and clients that are remembered, those that asked last."""

SHORT: Final = 0.05
"""A question about a known stance that takes no longer may use the lane that nothing delays [s]."""

SOON: Final = 0.3
"""So may a stance take when it was new [s]: the lane's process has to make it known there, too."""

DEAR: Final = 0.1
"""A client whose questions take longer leaves the last process to others [s]."""

NEWEST: Final = 0.3
"""Weight of the newest of a client's questions in the mean."""


class _Stance:
    """Which processes know a stance, and what it took when it was new and since [s]."""

    def __init__(self, first: float) -> None:
        self.known_to: set[object] = set()
        self.first = first
        self.again: float | None = None


class Costs:
    """What has been seen of stances and clients."""

    def __init__(self) -> None:
        self._stances: OrderedDict[int | None, _Stance] = OrderedDict()
        self._clients: OrderedDict[str, float] = OrderedDict()

    def took(self, client: str, stance: int | None, process: object | None, seconds: float) -> None:
        """Remember what an answer took.

        Parameters
        ----------
        client : str
        stance : int or None
            A hash of it, where it can be known from now on.
        process : object or None
            That answered.
        seconds : float
        """
        mean = self._clients.pop(client, seconds)
        self._clients[client] = mean + NEWEST * (seconds - mean)
        _forget(self._clients)
        if stance is None or process is None:
            return
        seen = self._stances.pop(stance, None) or _Stance(seconds)
        self._stances[stance] = seen
        if process in seen.known_to:
            seen.again = seconds
        seen.known_to.add(process)
        _forget(self._stances)

    def lost(self, process: object) -> None:
        """Forget a process that has ended."""
        for seen in self._stances.values():
            seen.known_to.discard(process)

    def is_short(self, stance: int | None) -> bool:
        """Whether a question about a stance is sure to be answered soon."""
        seen = self._stances.get(stance)
        if seen is None or seen.again is None:
            return False
        return seen.again <= SHORT and seen.first <= SOON

    def is_cheap(self, stance: int | None) -> bool:
        """Whether questions about a stance have taken little so far."""
        seen = self._stances.get(stance)
        return seen is not None and (seen.first if seen.again is None else seen.again) <= DEAR

    def knows(self, process: object, stance: int | None) -> bool:
        """Whether a process knows a stance."""
        seen = self._stances.get(stance)
        return seen is not None and process in seen.known_to

    def is_dear(self, client: str) -> bool:
        """Whether a client's questions take long."""
        return self._clients.get(client, 0.0) > DEAR


def _forget(kept: OrderedDict[Any, Any]) -> None:
    if len(kept) > KEPT:
        kept.popitem(last=False)
