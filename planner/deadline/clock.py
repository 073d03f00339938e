"""The time that an answer may still take, and the programs that it may still solve.

A clock reaches every solver that is started. It is that of the thread's context, so that nothing on
the way has to hand it on. Solvers ask it at each of their iterations, searches before each of their
steps, hands while they close, sets while they are listed, meshes while they are welded. A budget is
a count of programs, the same on every machine.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Final, Literal, NamedTuple

from hand_models.base import CruxError, broken_off_by

__all__ = [
    "Budget",
    "DeadlineError",
    "Unfinished",
    "check",
    "expired",
    "late",
    "late_sentence",
    "left",
    "seconds",
    "within",
]


class _Clock(NamedTuple):
    """End of the time, on the clock of `time.perf_counter`, and how long it was [s]."""

    end: float
    seconds: float


_clock: ContextVar[_Clock | None] = ContextVar("_clock", default=None)


Unfinished = Literal[
    "least_utilisation",
    "tie_break",
    "wrists",
    "least_effort",
    "load_factor",
    "path",
    "certificate",
    "explanation",
    "robust",
    "spread",
    "advice",
]

UNFINISHED_RESULTS: Final[dict[Unfinished, str]] = {
    "least_utilisation": "it was proven that no plan uses less",
    "tie_break": "the one of least effort was found of the plans that use as little",
    "wrists": "the search for the poses of the floating wrists ended",
    "least_effort": "the plan of least effort was found",
    "load_factor": "the load factor was found",
    "path": "it was found whether the way from the present tensions is safe",
    "certificate": "it was found what keeps the hands from a plan within the limits",
    "explanation": "it was found which limits alone leave no balance",
    "robust": "the load factor was found at all places of the hands",
    "spread": "a plan was found in all draws of the numbers",
    "advice": "all changes were tried that might make it hold",
}
"""Results that were not there yet, in words."""


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
            f"{seconds:g} s expired before {missing}; give a longer deadline", field="deadline"
        )
        self.seconds = seconds
        self.missing = missing


@contextmanager
def within(seconds: float | None, *, started: float | None = None) -> Iterator[None]:
    """Limit the time of what is done inside; an earlier end outside stays.

    Parameters
    ----------
    seconds : float or None
        None for as long as it takes.
    started : float, optional
        On the clock of `time.perf_counter`; now by default.
    """
    if seconds is None:
        yield
        return
    start = time.perf_counter() if started is None else started
    own, clock = _Clock(start + seconds, seconds), _clock.get()
    token = _clock.set(own if clock is None or own.end < clock.end else clock)
    try:
        with broken_off_by(_mind_hands):
            yield
    finally:
        _clock.reset(token)


def _mind_hands() -> None:
    check("the hands were closed on their holds and their wrench spaces known")


def seconds() -> float | None:
    """Return the deadline [s]; None without one."""
    clock = _clock.get()
    return None if clock is None else clock.seconds


def left() -> float | None:
    """Return how much time is left [s], not below zero; None without a deadline."""
    clock = _clock.get()
    return None if clock is None else max(0.0, clock.end - time.perf_counter())


def expired() -> bool:
    """Return whether the time is over."""
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


def late(name: Unfinished) -> tuple[Unfinished, ...]:
    """Return the name of what is not finished, if that is for the time."""
    return (name,) if expired() else ()


def late_sentence(seconds: float, names: Sequence[Unfinished]) -> str:
    """Say what came too late for a deadline [s], and what the answer is therefore."""
    missing = ", before ".join(UNFINISHED_RESULTS[name] for name in names)
    sentence = f"the deadline of {seconds:g} s expired before {missing}"
    if "least_effort" in names:
        sentence += "; the plan is one of less utilisation and more effort"
    return sentence


class Budget:
    """A count of programs that may still be solved; a deadline, where there is one, ends it, too.

    A search asks before each step whether it has ended, so that the last step may overdraw it.

    Parameters
    ----------
    programs : int
    whole : Budget, optional
        Of which this one is a part: what is spent here is spent there.
    """

    def __init__(self, programs: int, whole: Budget | None = None) -> None:
        self._left = programs
        self._whole = whole

    @property
    def ended(self) -> bool:
        """True where nothing is left, here or of the whole, or the time is over."""
        if self._left <= 0 or expired():
            return True
        return self._whole is not None and self._whole.ended

    def spend(self, programs: int = 1) -> None:
        """Take some programs off."""
        self._left -= programs
        if self._whole is not None:
            self._whole.spend(programs)

    def part(self, programs: int) -> Budget:
        """Return a part of this budget."""
        return Budget(programs, self)
