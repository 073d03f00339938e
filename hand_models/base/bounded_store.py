"""Answers to the last questions that were asked: a bounded store that threads may share."""

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
    """Statistics of the stores of one name.

    Attributes
    ----------
    hits, misses : int
        Answers found and missed since they were cleared.
    kept, most : int
        Answers kept now, and at most.
    """

    hits: int
    misses: int
    kept: int
    most: int


class Store(Protocol):
    """Protocol of a cache that reports its statistics."""

    name: str

    def info(self) -> StoreInfo:
        """Return how it has served."""


_stores: WeakSet[Store] = WeakSet()
"""All that their owners still have."""

_listing = Lock()
"""Held while that is changed or read: stores are made by any thread."""


def enlist(store: Store) -> None:
    """Let `stores` list a store as long as its owner has it."""
    with _listing:
        _stores.add(store)


def stores() -> dict[str, StoreInfo]:
    """Return how the stores of this process have served, those of one name together."""
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
    """The answers to the questions that were asked last.

    Its answers are not part of what it is: a copy, and what another process gets, begins empty.

    Parameters
    ----------
    name : str
        What its answers are; several stores may have one name, each with its own owner.
    most : int
        Answers kept; the one that was asked for longest ago goes first.
    size : callable, optional
        Returns how large answers are together; by default their size does not matter.
    largest : float, optional
        What that may come to.
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
        """Forget all."""
        with self._lock:
            self._answers: OrderedDict[Question, Answer] = OrderedDict()
            self._hits = self._misses = 0

    def info(self) -> StoreInfo:
        """Return how the store has served."""
        with self._lock:
            return StoreInfo(self._hits, self._misses, len(self._answers), self.most)

    def find(self, questions: Sequence[Question]) -> list[Answer | None]:
        """Return the answer to each question, None where it is not known."""
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
        """Return the answer to a question, made and kept where it is not known."""
        (answer,) = self.find([question])
        if answer is None:
            answer = make()
            self.keep([(question, answer)])
        return answer

    def keep(self, answers: Iterable[tuple[Question, Answer]]) -> None:
        """Add answers, and let those go that were not asked for longest."""
        with self._lock:
            for question, answer in answers:
                self._answers[question] = answer
            while len(self._answers) > self.most or self._too_large():
                self._answers.popitem(last=False)

    def _too_large(self) -> bool:
        return self._size is not None and self._size(self._answers.values()) > self._largest


def stored(name: str, most: int) -> Callable[[Callable[Args, Answer]], Callable[Args, Answer]]:
    """Keep a function's last answers, by its arguments, in a store of this name that it owns."""

    def owning(function: Callable[Args, Answer]) -> Callable[Args, Answer]:
        answers: BoundedStore[Hashable, Answer] = BoundedStore(name, most)

        @wraps(function)
        def asked(*args: Args.args, **kwargs: Args.kwargs) -> Answer:
            question = args, frozenset(kwargs.items())
            return answers.get(question, partial(function, *args, **kwargs))

        return asked

    return owning
