"""Queue questions that wait for a worker: one queue for each kind, in which clients take turns.

The past cost of questions about a stance, and of the client's questions, decides in which queue a
question waits. The cost is only an expectation: it never decides whether a question is answered. It
is the median processor time of the last answers, so that neither one costly question nor a loaded
machine decides it, and a client that asks for less gets back to the faster queue.
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
    """Kinds of questions, each with a queue of its own."""

    SET_POINTS = "set_points"
    """Questions for set-points of streams."""
    DECLARED = "declared"
    """Declarations of streams that a worker has already planned successfully."""
    SHORT = "short"
    """Questions about known stances, which are answered soon."""
    OTHER = "other"
    DEAR = "dear"
    """Questions that may take long."""
    CLIMB = "climb"
    """Searches for climbs, which have workers of their own."""


class _Stance:
    """Processes that know a stance, and its costs where it was new and since [s]."""

    def __init__(self) -> None:
        self.known_to: WeakSet[object] = WeakSet()
        most = SERVING_SETTINGS.remembered_costs
        self.new: deque[float] = deque(maxlen=most)
        self.again: deque[float] = deque(maxlen=most)


class Costs:
    """Observed processor times of questions by their stance, in an LRU cache of stance hashes.

    Parameters
    ----------
    shares : Shares
        Record of the costs of each client's questions.
    """

    def __init__(self, shares: Shares) -> None:
        self._shares = shares
        self._stances: LRUCache[int | None, _Stance] = LRUCache(SERVING_SETTINGS.remembered)

    def took(self, stance: int, process: object, seconds: float) -> None:
        """Record what an answer about a stance has cost.

        Parameters
        ----------
        stance : int
            Hash of the stance.
        process : object
            Worker that answered; from then on it knows the stance.
        seconds : float
            Processor time [s].
        """
        seen = self._stances.setdefault(stance, _Stance())
        (seen.again if process in seen.known_to else seen.new).append(seconds)
        seen.known_to.add(process)

    def kind(self, question: PendingQuestion) -> Kind:
        """Return the kind of queue in which a question must wait."""
        if question.name == ServiceName.SET_POINTS:
            return Kind.SET_POINTS
        if question.name == ServiceName.CLIMB:
            return Kind.CLIMB
        if question.dear:
            return Kind.DEAR
        if question.name == ServiceName.PLAN and self.is_short(question.stance):
            return Kind.SHORT
        dear = self._shares.is_dear(question.place) and not self._is_cheap(question.stance)
        return Kind.DEAR if dear else Kind.OTHER

    def is_short(self, stance: int | None) -> bool:
        """Return whether a question about a stance is expected to be short.

        True where the stance has been asked about again by a worker that knew it, with a median
        cost of at most 0.05 s, and a median cost of at most 0.3 s where a worker did not know it.
        """
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
        """Return whether a worker has answered a question about a stance before."""
        seen = self._stances.get(stance)
        return seen is not None and process in seen.known_to


class Waiting:
    """All waiting questions, in one queue for each kind.

    In a queue, the place (client, or all clients that cannot be distinguished) that has used least
    of the workers' time is next. Clients within one place take turns. The questions of one client
    are served first in, first out.

    Parameters
    ----------
    shares : Shares
        Record of the workers' time that each place has used.
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
        """Return the number of waiting questions, by the kind of their queue."""
        return {kind.value: self.count(kind) for kind in Kind}

    def count(self, kind: Kind) -> int:
        """Return the number of waiting questions of a kind."""
        return len(self._queues[kind])

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
        """Put a question into a queue, if there is room.

        Parameters
        ----------
        kind : Kind
            The queue.
        question : PendingQuestion
            The question.

        Returns
        -------
        PendingQuestion or None
            The question that must be refused as busy: the given one; or, where a full queue takes
            it, the last question of the place with most questions. None if there was room.
        """
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
        """Remove and return the next question from the first of the given queues that has one.

        Places that must wait because they have ended a worker are passed over. The question's place
        and client then come last among equals in that queue.

        Parameters
        ----------
        *kinds : Kind
            Queues in order of priority.

        Returns
        -------
        PendingQuestion or None
            None where no queue has a question whose turn it is.
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
        """Remove and return the next question; short, other and long ones take turns (round robin).

        Parameters
        ----------
        dear : bool
            True if a question that may take long is allowed.

        Returns
        -------
        PendingQuestion or None
            None where there is no such question. Its ``dear`` is set by the queue it comes from.
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
        """Remove questions from all queues.

        Parameters
        ----------
        wanted : callable
            Returns whether to remove a question.

        Returns
        -------
        list of (Kind, PendingQuestion)
            The removed questions, each with its queue.
        """
        found = [(kind, each) for kind, own in self._queues.items() for each in own if wanted(each)]
        for kind, question in found:
            self._queues[kind].remove(question)
        return found

    def remove(self, unwanted: Callable[[PendingQuestion], bool]) -> list[PendingQuestion]:
        """Remove questions from all queues, and return them without their queues.

        Parameters
        ----------
        unwanted : callable
            Returns whether to remove a question.
        """
        return [question for _, question in self.take_out(unwanted)]

    def held(self) -> float:
        """Return how soon a place that is held back for having ended a worker may be served again.

        Returns
        -------
        float
            Time from now [s]; infinity where no place with a waiting question is held back.
        """
        waits = (
            self._waits(kind, place)
            for kind, queue in self._queues.items()
            for place in {each.place for each in queue}
        )
        return min((each for each in waits if each > 0.0), default=math.inf)

    def first_deadline(self) -> float:
        """Return the earliest deadline of all waiting questions.

        Returns
        -------
        float
            Time on the clock of `time.perf_counter` [s]; infinity where no question waits.
        """
        return min((each.deadline for each in self), default=math.inf)


def _turn_after(question: PendingQuestion, taken: PendingQuestion) -> int:
    """Return when a question has its turn after one that is taken, the first of equals before."""
    if question.place != taken.place:
        return 0
    return 1 if question.client != taken.client else 2
