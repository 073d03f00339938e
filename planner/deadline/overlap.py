"""Work that is done while a solver runs, which leaves the interpreter to another thread."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from contextvars import ContextVar
from typing import Any, Final, Generic, Self, TypeVar

__all__ = ["Overlap", "begin_overlap", "waiting"]

T = TypeVar("T")

waiting: Final[ContextVar[Overlap[Any] | None]] = ContextVar("waiting", default=None)
"""What the next solver of the context begins."""


class Overlap(Generic[T]):
    """Work for the first solver that runs while this is entered; without one it is done after.

    Parameters
    ----------
    work : callable
        Safe to call from another thread.
    known : optional
        What comes of it, where it is done already.

    Attributes
    ----------
    begun : Future or None
        The work, once a solver has begun it.
    """

    def __init__(self, work: Callable[[], T], known: T | None = None) -> None:
        self._work, self._known = work, known
        self.begun: Future[T] | None = None

    def __enter__(self) -> Self:
        if self._known is None:
            waiting.set(self)
        return self

    def __exit__(self, *_: object) -> None:
        waiting.set(None)

    def result(self) -> T:
        """Return what comes of it; raises what it raises."""
        if self._known is None:
            begun = self.begun
            # what still waits for the other thread is sooner done here
            waits = begun is None or begun.cancel()
            self._known = self._work() if begun is None or waits else begun.result()
        return self._known


def begin_overlap() -> None:
    """Begin what waits for a solver to run, which is just about to."""
    overlap = waiting.get()
    if overlap is not None:
        waiting.set(None)
        # at the interpreter's end there are no more threads
        with suppress(RuntimeError):
            overlap.begun = _threads[0].submit(overlap._work)


def _new() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(1, "beside")


_threads = [_new()]
"""The one thread: the interpreter is its own as long as all others wait."""


def _after_fork() -> None:
    """Begin anew in a forked process, which the thread did not come along to."""
    _threads[0] = _new()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)
