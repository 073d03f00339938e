"""Questions that wait: in queues by their kind, in which each client has its turn."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable, Iterator
from enum import Enum
from itertools import chain
from typing import Final

from service.serving.question import LARGE, Question
from service.serving.shares import Shares

__all__ = ["FairQueue", "Kind", "Waiting"]

EACH: Final = 32
"""Questions of one client that wait in a queue; further ones are told to come again."""

ALL: Final = 256
"""Questions of all clients that wait in a queue; beyond it the place that has most loses its last
one."""

HELD: Final = 2**28
"""Bytes of all large questions that wait."""

SHARE: Final = 2**26
"""Bytes of those of one place, unless it is one question."""


class Kind(Enum):
    """Queues, and what their questions are."""

    SET_POINTS = "set_points"
    """To streams."""
    DECLARED = "declared"
    """Streams that a process has found to be possible."""
    SHORT = "short"
    """About stances that are known."""
    OTHER = "other"
    DEAR = "dear"
    """That may take long."""


class FairQueue:
    """Questions by place, and there by client: first in, first out among a client's.

    The place that has had least of the processes' time is next, and there clients have their turns.

    Parameters
    ----------
    shares : Shares
    holds : bool
        Whether places wait that have ended a process.
    """

    def __init__(self, shares: Shares, *, holds: bool) -> None:
        self._shares, self._holds = shares, holds
        self._at: dict[str, dict[str, deque[Question]]] = {}

    def __iter__(self) -> Iterator[Question]:
        return chain.from_iterable(self._all(place) for place in self._at)

    def __len__(self) -> int:
        return sum(self._size(place) for place in self._at)

    def _all(self, place: str) -> Iterator[Question]:
        return chain.from_iterable(self._at[place].values())

    def _size(self, place: str) -> int:
        return sum(map(len, self._at.get(place, {}).values()))

    def put(self, question: Question) -> Question | None:
        """Let a question wait; return the one that has no room then: this one, or another's."""
        own = self._at.get(question.place, {}).get(question.client, ())
        if len(own) >= EACH:
            return question
        gone = None
        if len(self) >= ALL:
            most = max(self._at, key=self._size)
            if self._size(most) <= self._size(question.place) + 1:
                return question
            gone = max(self._at[most].values(), key=len)[-1]
            self.remove(lambda each: each is gone)
        clients = self._at.setdefault(question.place, {})
        clients.setdefault(question.client, deque()).append(question)
        return gone

    def take(self) -> Question | None:
        """Return the next question, if there is one that need not wait.

        Its place and its client come last among equals from then on.
        """
        places = [place for place in self._at if not self._waits(place)]
        place = self._shares.next(places)
        if place is None:
            return None
        clients = self._at.pop(place)
        client = next(iter(clients))
        questions = clients.pop(client)
        question = questions.popleft()
        if questions:
            clients[client] = questions
        if clients:
            self._at[place] = clients
        return question

    def remove(self, unwanted: Callable[[Question], bool]) -> list[Question]:
        """Take some questions out, wherever they wait; return them."""
        gone = [question for question in self if unwanted(question)]
        for question in gone:
            clients = self._at[question.place]
            clients[question.client].remove(question)
            if not clients[question.client]:
                del clients[question.client]
            if not clients:
                del self._at[question.place]
        return gone

    def held(self) -> float:
        """Return how long it is until a place that has to wait is next [s]; infinity without."""
        waits = map(self._waits, self._at)
        return min((each for each in waits if each > 0.0), default=math.inf)

    def _waits(self, place: str) -> float:
        return self._shares.waits(place) if self._holds else 0.0


class Waiting:
    """All questions that wait.

    Parameters
    ----------
    shares : Shares
    """

    def __init__(self, shares: Shares) -> None:
        self._queues = {
            # set-points end no process, and others are not to end with one
            kind: FairQueue(shares, holds=kind is not Kind.SET_POINTS)
            for kind in Kind
        }
        self._turns = deque([Kind.SHORT, Kind.OTHER, Kind.DEAR])

    def __iter__(self) -> Iterator[Question]:
        return chain.from_iterable(self._queues.values())

    def __len__(self) -> int:
        return sum(map(len, self._queues.values()))

    def counts(self) -> dict[str, int]:
        """Return how many there are, by kind."""
        return {kind.value: len(queue) for kind, queue in self._queues.items()}

    def _fits(self, question: Question) -> bool:
        """Whether there is room for a large question: what is small is no matter of bytes."""
        size = len(question.payload)
        if size <= LARGE:
            return True
        held: Counter[str] = Counter()
        for each in self:
            if len(each.payload) > LARGE:
                held[each.place] += len(each.payload)
        own = held[question.place]
        return not held or ((not own or own + size <= SHARE) and held.total() + size <= HELD)

    def put(self, kind: Kind, question: Question) -> Question | None:
        """Let a question wait; return the one that has no room then, if any."""
        return self._queues[kind].put(question) if self._fits(question) else question

    def take(self, *kinds: Kind) -> Question | None:
        """Return the next question of the first of some kinds that has one."""
        for kind in kinds:
            if (question := self._queues[kind].take()) is not None:
                return question
        return None

    def next(self, *, dear: bool) -> Question | None:
        """Return the next question of those kinds that have their turns one after another.

        Parameters
        ----------
        dear : bool
            Whether it may be one that takes long.
        """
        for _ in range(len(self._turns)):
            kind = self._turns[0]
            self._turns.rotate(-1)
            if kind is Kind.DEAR and not dear:
                continue
            question = self.take(kind)
            if question is not None:
                question.dear = kind is Kind.DEAR
                return question
        return None

    def remove(self, unwanted: Callable[[Question], bool]) -> list[Question]:
        """Take some questions out, wherever they wait; return them."""
        return [each for queue in self._queues.values() for each in queue.remove(unwanted)]

    def take_out(self, wanted: Callable[[Question], bool]) -> list[tuple[Kind, Question]]:
        """Take some questions out of their queues; return them with these."""
        return [
            (kind, each) for kind, queue in self._queues.items() for each in queue.remove(wanted)
        ]

    def held(self) -> float:
        """Return how long it is until a place that has to wait is next [s]; infinity without."""
        return min(queue.held() for queue in self._queues.values())

    def first_deadline(self) -> float:
        """Return when the first question's time is over; infinity where none waits."""
        return min((each.deadline for each in self), default=math.inf)

    def overdue(self, now: float) -> list[Question]:
        """Take out the questions whose time is over; return them."""
        if self.first_deadline() > now:
            return []
        return self.remove(lambda each: each.deadline <= now)
