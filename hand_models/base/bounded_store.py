"""Bounded LRU caches that threads may share, with statistics of all caches of the process."""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterable, Sequence
from functools import partial, wraps
from threading import Lock
from typing import Generic, NamedTuple, ParamSpec, Protocol, TypeVar
from weakref import WeakSet

__all__ = ["BoundedStore", "StoreInfo", "enlist", "stored", "stores"]

Question = TypeVar("Question", bound=Hashable)
Answer = TypeVar("Answer")
Args = ParamSpec("Args")


class StoreInfo(NamedTuple):
    """Statistics of the caches of one name.

    Attributes
    ----------
    hits, misses : int
        Lookups that were answered, and that were not, since the caches were cleared.
    kept, most : int
        Answers in the caches now, and at most.
    """

    hits: int
    misses: int
    kept: int
    most: int


class Store(Protocol):
    """Protocol of a cache that reports its statistics: its name, and a method `info`."""

    name: str

    def info(self) -> StoreInfo:
        """Return the cache's hits, misses, size and bound."""


_stores: WeakSet[Store] = WeakSet()
"""All that their owners still have."""

_listing = Lock()
"""Held while that is changed or read: stores are made by any thread."""


def enlist(store: Store) -> None:
    """Register a cache in the statistics of `stores`, until the cache is garbage-collected."""
    with _listing:
        _stores.add(store)


def stores() -> dict[str, StoreInfo]:
    """Return the statistics of all live caches of this process, by name, summed for equal names."""
    found: dict[str, StoreInfo] = {}
    with _listing:
        kept = list(_stores)
    for store in sorted(kept, key=lambda each: each.name):
        own, known = store.info(), found.get(store.name)
        found[store.name] = (
            own if known is None else StoreInfo(*map(sum, zip(own, known, strict=True)))
        )
    return found


class BoundedStore(Generic[Question, Answer]):
    """LRU cache from questions (keys) to answers, safe for threads.

    Copies and pickles of a cache are empty.

    Parameters
    ----------
    name : str
        Name in `stores`; several caches may share one.
    most : int
        Largest number of answers; the least recently used is dropped first.
    size : callable, optional
        Called with several answers; returns their total size, in the unit of ``largest``.
    largest : float, optional
        Largest total size; no bound by default.
    """

    def __init__(
        self,
        name: str,
        most: int,
        size: Callable[[Iterable[Answer]], float] | None = None,
        largest: float = math.inf,
    ) -> None:
        self.name, self.most = name, most
        self._size, self._largest = size, largest
        self._lock = Lock()
        self.clear()
        enlist(self)

    def __reduce__(self) -> tuple[type[BoundedStore[Question, Answer]], tuple[object, ...]]:
        return type(self), (self.name, self.most, self._size, self._largest)

    def clear(self) -> None:
        """Drop all answers and reset the statistics."""
        with self._lock:
            self._answers: OrderedDict[Question, Answer] = OrderedDict()
            self._hits = self._misses = 0

    def info(self) -> StoreInfo:
        """Return the cache's hits, misses, size and bound."""
        with self._lock:
            return StoreInfo(self._hits, self._misses, len(self._answers), self.most)

    def find(self, questions: Sequence[Question]) -> list[Answer | None]:
        """Look up answers, and mark them as recently used.

        Parameters
        ----------
        questions : sequence of Question

        Returns
        -------
        list of Answer or None
            The answers in the order of ``questions``; None for one that is not in the cache.
        """
        with self._lock:
            answers = self._answers
            found: list[Answer | None] = []
            for question in questions:
                answer = answers.get(question)
                if answer is None:
                    self._misses += 1
                else:
                    self._hits += 1
                    answers.move_to_end(question)
                found.append(answer)
            return found

    def get(self, question: Question, make: Callable[[], Answer]) -> Answer:
        """Return the answer to a question (key); on a miss call ``make`` and keep its result."""
        (answer,) = self.find([question])
        if answer is None:
            answer = make()
            self.keep([(question, answer)])
        return answer

    def keep(self, answers: Iterable[tuple[Question, Answer]]) -> None:
        """Add pairs (question, answer), and drop the least recently used ones beyond the bounds."""
        added = dict(answers)
        with self._lock:
            self._answers |= added
            # what has no size leaves the total as it was
            grows = self._size is not None and self._size(added.values()) > 0.0
            while len(self._answers) > self.most or (grows and self._too_large()):
                self._answers.popitem(last=False)

    def _too_large(self) -> bool:
        return self._size is not None and self._size(self._answers.values()) > self._largest


def stored(name: str, most: int) -> Callable[[Callable[Args, Answer]], Callable[Args, Answer]]:
    """Return a decorator that caches a function's results by its arguments (memoisation, LRU).

    Parameters
    ----------
    name : str
        Name of the cache in `stores`.
    most : int
        Largest number of results. Arguments must be hashable.
    """

    def owning(function: Callable[Args, Answer]) -> Callable[Args, Answer]:
        answers: BoundedStore[Hashable, Answer] = BoundedStore(name, most)

        @wraps(function)
        def asked(*args: Args.args, **kwargs: Args.kwargs) -> Answer:
            question = args, frozenset(kwargs.items())
            return answers.get(question, partial(function, *args, **kwargs))

        return asked

    return owning
