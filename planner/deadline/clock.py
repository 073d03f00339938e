"""How long an answer may still take: a clock that reaches every solver it starts.

The clock is that of the thread's context, so that nothing on the way has to hand it on. Solvers ask
it at each of their iterations, searches before each of their steps, hands while they close.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import NamedTuple

from hand_models.base import CruxError, broken_off_by

__all__ = ["DeadlineError", "check", "expired", "left", "seconds", "within"]


class _Clock(NamedTuple):
    """When the time is over, on the clock of `time.perf_counter`, and how long it was [s]."""

    end: float
    seconds: float


_clock: ContextVar[_Clock | None] = ContextVar("_clock", default=None)


class DeadlineError(CruxError):
    """A deadline that came before there was any plan which passes its checks, or a proof of none.

    Parameters
    ----------
    seconds : float
        The deadline [s].
    missing : str
        What was not there yet: ``the hands' sets were known``.

    Attributes
    ----------
    seconds, missing
    """

    kind = "deadline"

    def __init__(self, seconds: float, missing: str) -> None:
        super().__init__(
            f"{seconds:g} s were over before {missing}; allow longer", field="deadline"
        )
        self.seconds = seconds
        self.missing = missing


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
    clock = _clock.get()
    if seconds is not None:
        start = time.perf_counter() if started is None else started
        own = _Clock(start + seconds, seconds)
        clock = own if clock is None or own.end < clock.end else clock
    token = _clock.set(clock)
    try:
        with broken_off_by(None if clock is None else _mind_hands):
            yield
    finally:
        _clock.reset(token)


def _mind_hands() -> None:
    check("the hands were closed on their holds")


def seconds() -> float | None:
    """Return the deadline [s]; None without one."""
    clock = _clock.get()
    return None if clock is None else clock.seconds


def left() -> float | None:
    """Return how much time is left [s], not below zero; None without a deadline."""
    clock = _clock.get()
    return None if clock is None else max(0.0, clock.end - time.perf_counter())


def expired() -> bool:
    """Whether the time is over."""
    clock = _clock.get()
    return clock is not None and time.perf_counter() >= clock.end


def check(missing: str) -> None:
    """Go on only if there is time left.

    Parameters
    ----------
    missing : str
        What is not there yet, for the error.

    Raises
    ------
    DeadlineError
        If there is none.
    """
    clock = _clock.get()
    if clock is not None and time.perf_counter() >= clock.end:
        raise DeadlineError(clock.seconds, missing)
