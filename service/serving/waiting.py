"""Questions that wait: in queues by their kind, in which each client has its turn.

The past cost of questions about its stance, and of its client, decides in which queue a question
waits. That is only an expectation, and never decides whether one is answered. It is the median of
the last costs, in processor time: neither one costly question nor a loaded machine decides it, and
a client that asks for less gets to the faster queue again.
"""

from __future__ import annotations

import math
import statistics
from collections import Counter, deque
from collections.abc import Callable, Iterator
from enum import Enum
from itertools import chain
from weakref import WeakSet

from cachetools import LRUCache

from service.serving.question import PendingQuestion
from service.serving.settings import SERVING_SETTINGS
from service.serving.shares import Shares
from service.wire import ServiceName

__all__ = ["Costs", "Kind", "Waiting"]


class Kind(Enum):
    """Queues, and what their questions are."""

    SET_POINTS = "set_points"
    """Set-points of streams."""
    DECLARED = "declared"
    """Streams that a process has found to be possible."""
    SHORT = "short"
    """Questions about stances that are known."""
    OTHER = "other"
    DEAR = "dear"
    """Questions that may take long."""


class _Stance:
    """Processes that know a stance, and its costs where it was new and since [s]."""

    def __init__(self) -> None:
        self.known_to: WeakSet[object] = WeakSet()
        most = SERVING_SETTINGS.remembered_costs
        self.new: deque[float] = deque(maxlen=most)
        self.again: deque[float] = deque(maxlen=most)


class Costs:
    """Observed costs of stances, by their hashes.

    Parameters
    ----------
    shares : Shares
        Has what questions of a place have cost.
    """

    def __init__(self, shares: Shares) -> None:
        self._shares = shares
        self._stances: LRUCache[int | None, _Stance] = LRUCache(SERVING_SETTINGS.remembered)

    def took(self, stance: int, process: object, seconds: float) -> None:
        """Remember what an answer about a stance has cost in a process [s]."""
        seen = self._stances.setdefault(stance, _Stance())
        (seen.again if process in seen.known_to else seen.new).append(seconds)
        seen.known_to.add(process)

    def kind(self, question: PendingQuestion) -> Kind:
        """Return the queue in which a question is to wait."""
        if question.name == ServiceName.SET_POINTS:
            return Kind.SET_POINTS
        if question.dear:
            return Kind.DEAR
        if question.name == ServiceName.PLAN and self.is_short(question.stance):
            return Kind.SHORT
        dear = self._shares.is_dear(question.place) and not self._is_cheap(question.stance)
        return Kind.DEAR if dear else Kind.OTHER

    def is_short(self, stance: int | None) -> bool:
        """Return whether a question about a stance is sure to be answered soon."""
        seen = self._stances.get(stance)
        if seen is None or not seen.again:
            return False
        # [s] its costs, also when it was new: the process that nothing delays prepares it, too
        short, new = 0.05, 0.3
        return statistics.median(seen.again) <= short and statistics.median_low(seen.new) <= new

    def _is_cheap(self, stance: int | None) -> bool:
        """Return whether questions about a stance have cost little so far."""
        seen = self._stances.get(stance)
        if seen is None:
            return False
        return statistics.median(seen.again or seen.new) <= SERVING_SETTINGS.dear_cost

    def knows(self, process: object, stance: int | None) -> bool:
        """Return whether a process knows a stance."""
        seen = self._stances.get(stance)
        return seen is not None and process in seen.known_to


class Waiting:
    """All questions that wait, by kind.

    The place that has had least of the processes' time is next, and there clients have their turns;
    first in, first out among a client's.

    Parameters
    ----------
    shares : Shares
    """

    def __init__(self, shares: Shares) -> None:
        self._shares = shares
        self._queues: dict[Kind, list[PendingQuestion]] = {kind: [] for kind in Kind}
        self._turns = deque([Kind.SHORT, Kind.OTHER, Kind.DEAR])

    def __iter__(self) -> Iterator[PendingQuestion]:
        return chain.from_iterable(self._queues.values())

    def __len__(self) -> int:
        return sum(map(len, self._queues.values()))

    def counts(self) -> dict[str, int]:
        """Return how many there are, by kind."""
        return {kind.value: len(queue) for kind, queue in self._queues.items()}

    def _fits(self, question: PendingQuestion) -> bool:
        """Return whether there is room for a question; bytes are limited only for large ones."""
        size, large = len(question.payload), SERVING_SETTINGS.large_payload
        if size <= large:
            return True
        held: Counter[str] = Counter()
        for each in self:
            if len(each.payload) > large:
                held[each.place] += len(each.payload)
        own = held[question.place]
        fits = held.total() + size <= SERVING_SETTINGS.waiting_bytes
        fits_own = not own or own + size <= SERVING_SETTINGS.waiting_bytes_of_place
        return not held or (fits_own and fits)

    def put(self, kind: Kind, question: PendingQuestion) -> PendingQuestion | None:
        """Let a question wait; return the one that has no room then: this one, or another's."""
        queue = self._queues[kind]
        clients = Counter((each.place, each.client) for each in queue)
        own_count = clients[question.place, question.client]
        if own_count >= SERVING_SETTINGS.waiting_of_client or not self._fits(question):
            return question
        removed = None
        if len(queue) >= SERVING_SETTINGS.waiting_in_queue:
            places = Counter(each.place for each in queue)
            most, count = places.most_common(1)[0]
            if count <= places[question.place] + 1:
                return question
            _, client = max((each for each in clients if each[0] == most), key=clients.__getitem__)
            own = [each for each in queue if (each.place, each.client) == (most, client)]
            removed = own[-1]
            queue.remove(removed)
        queue.append(question)
        return removed

    def take(self, *kinds: Kind) -> PendingQuestion | None:
        """Return the next question of the first of some kinds that has one that need not wait.

        Its place and its client come last among equals of its queue from then on.
        """
        for kind in kinds:
            queue = self._queues[kind]
            places = dict.fromkeys(each.place for each in queue)
            place = self._shares.next([each for each in places if not self._waits(kind, each)])
            if place is not None:
                question = next(each for each in queue if each.place == place)
                queue.remove(question)
                queue.sort(key=lambda each: _turn_after(each, question))
                return question
        return None

    def _waits(self, kind: Kind, place: str) -> float:
        """Return how long a place has to wait in a queue because it has ended a process [s]."""
        # set-points end no process, and others are not to end with one
        return 0.0 if kind is Kind.SET_POINTS else self._shares.waits(place)

    def next(self, *, dear: bool) -> PendingQuestion | None:
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

    def take_out(
        self, wanted: Callable[[PendingQuestion], bool]
    ) -> list[tuple[Kind, PendingQuestion]]:
        """Take some questions out, wherever they wait; return them with their queues."""
        found = [(kind, each) for kind, own in self._queues.items() for each in own if wanted(each)]
        for kind, question in found:
            self._queues[kind].remove(question)
        return found

    def remove(self, unwanted: Callable[[PendingQuestion], bool]) -> list[PendingQuestion]:
        """Take some questions out, wherever they wait; return them."""
        return [question for _, question in self.take_out(unwanted)]

    def held(self) -> float:
        """Return how long it is until a place that has to wait is next [s]; infinity without."""
        waits = (
            self._waits(kind, place)
            for kind, queue in self._queues.items()
            for place in {each.place for each in queue}
        )
        return min((each for each in waits if each > 0.0), default=math.inf)

    def first_deadline(self) -> float:
        """Return when the first question's time is over; infinity where none waits."""
        return min((each.deadline for each in self), default=math.inf)


def _turn_after(question: PendingQuestion, taken: PendingQuestion) -> int:
    """Return when a question has its turn after one that is taken, the first of equals before."""
    if question.place != taken.place:
        return 0
    return 1 if question.client != taken.client else 2
