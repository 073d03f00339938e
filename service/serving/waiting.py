"""Questions that wait: in queues by their kind, in which each client has its turn."""

from __future__ import annotations

import heapq
import itertools
import math
from collections import Counter, OrderedDict, deque
from collections.abc import Callable
from enum import Enum
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

STALE: Final = 16
"""Deadlines that are kept for each question that waits, of those that waited before."""


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
        self._of: OrderedDict[str, deque[Question]] = OrderedDict()
        self._size = 0

    def __len__(self) -> int:
        return self._size

    def has_room(self, client: str) -> bool:
        """Whether one more question of a client may wait."""
        return self._size < ALL and len(self._of.get(client, ())) < EACH

    def put(self, question: Question) -> None:
        """Let a question wait."""
        self._of.setdefault(question.client, deque()).append(question)
        self._size += 1

    def take(self) -> Question:
        """Return the next question; the client whose it is comes last from then on."""
        client, questions = next(iter(self._of.items()))
        question = questions.popleft()
        if questions:
            self._of.move_to_end(client)
        else:
            del self._of[client]
        self._size -= 1
        return question

    def remove(self, unwanted: Callable[[Question], bool]) -> list[Question]:
        """Take some questions out, wherever they wait; return them."""
        gone = []
        for client, questions in list(self._of.items()):
            out = [question for question in questions if unwanted(question)]
            if not out:
                continue
            gone += out
            kept = deque(question for question in questions if not unwanted(question))
            if kept:
                self._of[client] = kept
            else:
                del self._of[client]
        self._size -= len(gone)
        return gone


class Waiting:
    """All questions that wait."""

    def __init__(self) -> None:
        self._queues = {kind: FairQueue() for kind in Kind}
        self._turns = deque([Kind.SHORT, Kind.OTHER, Kind.DEAR])
        self._bytes: Counter[str] = Counter()
        """Of large questions, by client."""
        self._ends: list[tuple[float, int, Question]] = []
        """A heap; also of questions that wait no longer."""
        self._order = itertools.count()

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
        size, own = len(question.payload), self._bytes[question.client]
        if size <= LARGE or not self._bytes:
            return True
        return (not own or own + size <= SHARE) and self._bytes.total() + size <= HELD

    def put(self, kind: Kind, question: Question) -> None:
        """Let a question wait."""
        if len(question.payload) > LARGE:
            self._bytes[question.client] += len(question.payload)
        self._queues[kind].put(question)
        question.waits = True
        heapq.heappush(self._ends, (question.deadline, next(self._order), question))
        if len(self._ends) > STALE * (len(self) + 1):
            self._ends = [end for end in self._ends if end[-1].waits]
            heapq.heapify(self._ends)

    def take(self, *kinds: Kind) -> Question | None:
        """Return the next question of the first of some kinds that has one."""
        for kind in kinds:
            if self._queues[kind]:
                question = self._queues[kind].take()
                self._let_go(question)
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
        gone = [each for queue in self._queues.values() for each in queue.remove(unwanted)]
        for question in gone:
            self._let_go(question)
        return gone

    def first_deadline(self) -> float:
        """Return when the first question's time is over; infinity where none waits."""
        while self._ends and not self._ends[0][-1].waits:
            heapq.heappop(self._ends)
        return self._ends[0][0] if self._ends else math.inf

    def overdue(self, now: float) -> list[Question]:
        """Take out the questions whose time is over; return them."""
        if self.first_deadline() > now:
            return []
        return self.remove(lambda each: each.deadline <= now)

    def _let_go(self, question: Question) -> None:
        question.waits = False
        size, client = len(question.payload), question.client
        if size > LARGE:
            self._bytes[client] -= size
            if not self._bytes[client]:
                del self._bytes[client]
