"""Questions that wait: in queues by their kind, in which each client has its turn."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable, Iterator
from enum import Enum
from itertools import chain
from typing import Final

from service.serving.question import LARGE, Question

__all__ = ["FairQueue", "Kind", "Waiting"]

EACH: Final = 32
"""Questions of one client that wait in a queue; further ones are told to come again."""

ALL: Final = 256
"""Questions of all clients that wait in a queue."""

HELD: Final = 2**28
"""Bytes of all large questions that wait."""

SHARE: Final = 2**26
"""Bytes of those of one client, unless it is one question."""


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
    """Questions by client: first in, first out among a client's, and clients in turn."""

    def __init__(self) -> None:
        self._of: dict[str, deque[Question]] = {}

    def __iter__(self) -> Iterator[Question]:
        return chain.from_iterable(self._of.values())

    def __len__(self) -> int:
        return sum(map(len, self._of.values()))

    def has_room(self, client: str) -> bool:
        """Whether one more question of a client may wait."""
        return len(self) < ALL and len(self._of.get(client, ())) < EACH

    def put(self, question: Question) -> None:
        """Let a question wait."""
        self._of.setdefault(question.client, deque()).append(question)

    def take(self) -> Question:
        """Return the next question; the client whose it is comes last from then on."""
        client = next(iter(self._of))
        questions = self._of.pop(client)
        question = questions.popleft()
        if questions:
            self._of[client] = questions
        return question

    def remove(self, unwanted: Callable[[Question], bool]) -> list[Question]:
        """Take some questions out, wherever they wait; return them."""
        gone = [question for question in self if unwanted(question)]
        for question in gone:
            self._of[question.client].remove(question)
        self._of = {client: questions for client, questions in self._of.items() if questions}
        return gone


class Waiting:
    """All questions that wait."""

    def __init__(self) -> None:
        self._queues = {kind: FairQueue() for kind in Kind}
        self._turns = deque([Kind.SHORT, Kind.OTHER, Kind.DEAR])

    def __iter__(self) -> Iterator[Question]:
        return chain.from_iterable(self._queues.values())

    def __len__(self) -> int:
        return sum(map(len, self._queues.values()))

    def counts(self) -> dict[str, int]:
        """Return how many there are, by kind."""
        return {kind.value: len(queue) for kind, queue in self._queues.items()}

    def has_room(self, kind: Kind, question: Question) -> bool:
        """Whether a question may wait, too."""
        return self._fits(question) and self._queues[kind].has_room(question.client)

    def _fits(self, question: Question) -> bool:
        """Whether there is room for a large question: what is small is no matter of bytes."""
        size = len(question.payload)
        if size <= LARGE:
            return True
        held: Counter[str] = Counter()
        for each in self:
            if len(each.payload) > LARGE:
                held[each.client] += len(each.payload)
        own = held[question.client]
        return not held or ((not own or own + size <= SHARE) and held.total() + size <= HELD)

    def put(self, kind: Kind, question: Question) -> None:
        """Let a question wait."""
        self._queues[kind].put(question)

    def take(self, *kinds: Kind) -> Question | None:
        """Return the next question of the first of some kinds that has one."""
        for kind in kinds:
            if self._queues[kind]:
                return self._queues[kind].take()
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

    def first_deadline(self) -> float:
        """Return when the first question's time is over; infinity where none waits."""
        return min((each.deadline for each in self), default=math.inf)

    def overdue(self, now: float) -> list[Question]:
        """Take out the questions whose time is over; return them."""
        if self.first_deadline() > now:
            return []
        return self.remove(lambda each: each.deadline <= now)
