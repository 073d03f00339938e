"""How long an answer may still take: a clock that reaches every solver it starts.

The clock is that of the thread's context, so that nothing on the way has to hand it on. Solvers ask
it at each of their iterations, searches before each of their steps.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

__all__ = ["expired", "left", "within"]

_end: ContextVar[float | None] = ContextVar("_end", default=None)


@contextmanager
def within(seconds: float | None, *, started: float | None = None) -> Iterator[None]:
    """Let what is done inside take so long at most; an earlier end outside stays.

    Parameters
    ----------
    seconds : float or None
        None for as long as it takes.
    started : float, optional
        On the clock of `time.perf_counter`; now by default.
    """
    start = time.perf_counter() if started is None else started
    ends = [end for end in (_end.get(), None if seconds is None else start + seconds) if end]
    token = _end.set(min(ends, default=None))
    try:
        yield
    finally:
        _end.reset(token)


def left() -> float | None:
    """Return how much time is left [s], not below zero; None without a deadline."""
    end = _end.get()
    return None if end is None else max(0.0, end - time.perf_counter())


def expired() -> bool:
    """Whether the time is over."""
    end = _end.get()
    return end is not None and time.perf_counter() >= end
