"""Deadline of an answer, and budgets of solver programs.

The deadline is kept in a context variable of the thread, so no function has to pass it on. Solvers
check it at each iteration, searches before each step, and so do the closing of hands, the listing
of sets and the welding of meshes. A budget counts programs, and ends alike on every machine.
"""

from __future__ import annotations

import threading
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
    "check_after",
    "expired",
    "late",
    "late_sentence",
    "left",
    "seconds",
    "within",
]


class _Clock(NamedTuple):
    """End of the time, on the clock of `time.perf_counter`, how long it was [s], and its stop."""

    end: float
    seconds: float
    stop: threading.Event | None = None

    @property
    def left(self) -> float:
        stopped = self.stop is not None and self.stop.is_set()
        return 0.0 if stopped else max(0.0, self.end - time.perf_counter())


_clock: ContextVar[_Clock | None] = ContextVar("_clock", default=None)


Unfinished = Literal[
    "least_utilisation",
    "tie_break",
    "wrists",
    "least_effort",
    "least_hazard",
    "robust_tensions",
    "load_factor",
    "path",
    "certificate",
    "explanation",
    "robust",
    "open_loop",
    "spread",
    "survival",
    "redundancy",
    "com_region",
    "advice",
]

UNFINISHED_RESULTS: Final[dict[Unfinished, str]] = {
    "least_utilisation": "it was proven that no plan uses less",
    "tie_break": "the one of least effort was found of the plans that use as little",
    "wrists": "the search for the poses of the floating wrists ended",
    "least_effort": "the plan of least effort was found",
    "least_hazard": "the plan of least hazard was found",
    "robust_tensions": "the tensions that serve all samples were found",
    "load_factor": "the load factor was found",
    "path": "it was found whether the way from the present tensions is safe",
    "certificate": "it was found what keeps the hands from a plan within the limits",
    "explanation": "it was found which limits alone leave no balance",
    "robust": "the load factor was found at all places of the hands",
    "open_loop": "the plan was executed on all displaced hands",
    "spread": "a plan was found in all draws of the numbers",
    "survival": "all draws of strengths were simulated",
    "redundancy": "the stance was planned without each tile, finger and hand",
    "com_region": "it was found where the centre of mass may be",
    "advice": "all changes were tried that might make it hold",
}
"""Results that a deadline can prevent, in words that follow "expired before"."""


class DeadlineError(CruxError):
    """Error: the client's deadline expired before a plan was verified or infeasibility proven.

    Parameters
    ----------
    seconds : float
        The deadline [s].
    missing : str
        What was not finished, as a clause: ``the hands' sets were known``.

    Attributes
    ----------
    seconds : float
        The deadline [s].
    missing : str
        What was not finished.
    """

    kind = "deadline"

    def __init__(self, seconds: float, missing: str) -> None:
        super().__init__(
            f"{seconds:g} s expired before {missing}; give a longer deadline", field="deadline"
        )
        self.seconds = seconds
        self.missing = missing


@contextmanager
def within(
    seconds: float | None, *, started: float | None = None, stop: threading.Event | None = None
) -> Iterator[None]:
    """Context manager that sets a deadline for the code inside the ``with`` block.

    An earlier deadline of an enclosing block stays in force.

    Parameters
    ----------
    seconds : float or None
        Duration until the deadline [s]; None sets no deadline.
    started : float, optional
        Start of that duration, in seconds of `time.perf_counter`; now by default.
    stop : threading.Event, optional
        Another thread sets it to end the duration at once.

    Raises
    ------
    DeadlineError
        From the closing of hands and the computation of wrench spaces inside the block, once the
        deadline has expired. Other code inside calls `check` or `expired`.
    """
    if seconds is None:
        yield
        return
    start = time.perf_counter() if started is None else started
    own, clock = _Clock(start + seconds, seconds, stop), _clock.get()
    token = _clock.set(own if clock is None or own.end < clock.end else clock)
    try:
        with broken_off_by(_mind_hands):
            yield
    finally:
        _clock.reset(token)


def _mind_hands() -> None:
    check("the hands were closed on their holds and their wrench spaces known")


def seconds() -> float | None:
    """Return the duration of the deadline in force [s]; None without a deadline."""
    clock = _clock.get()
    return None if clock is None else clock.seconds


def left() -> float | None:
    """Return the time until the deadline [s], not below zero; None without a deadline."""
    clock = _clock.get()
    return None if clock is None else clock.left


def expired() -> bool:
    """Return whether the deadline has expired; False without a deadline."""
    clock = _clock.get()
    return clock is not None and clock.left <= 0.0


def check(missing: str) -> None:
    """Raise `DeadlineError` if the deadline has expired.

    Parameters
    ----------
    missing : str
        Clause for the error's message: what was not finished, such as ``the load factor was
        found``.

    Raises
    ------
    DeadlineError
        If the deadline has expired.
    """
    clock = _clock.get()
    if clock is not None and clock.left <= 0.0:
        raise DeadlineError(clock.seconds, missing)


def check_after(part: str, took: float) -> None:
    """Raise `DeadlineError` if the deadline has expired before a plan is looked for.

    Parameters
    ----------
    part : str
        What was done until now, in words that precede "took": ``closing the hands``.
    took : float
        Time that it took [s].

    Raises
    ------
    DeadlineError
        If the deadline has expired; the message says how long ago it was set, too.
    """
    clock = _clock.get()
    if clock is not None and clock.left <= 0.0:
        gone = max(took, time.perf_counter() - clock.end + clock.seconds)
        words = f"{gone:.2g} s had gone by then, of which {part} took {took:.2g} s"
        raise DeadlineError(clock.seconds, f"a plan was looked for; {words}")


def late(name: Unfinished) -> tuple[Unfinished, ...]:
    """Return a tuple with an unfinished result's name if the deadline has expired, else ().

    Parameters
    ----------
    name : str
        A key of `UNFINISHED_RESULTS`.
    """
    return (name,) if expired() else ()


def late_sentence(seconds: float, names: Sequence[Unfinished]) -> str:
    """Return a sentence that names the results which a deadline prevented.

    Parameters
    ----------
    seconds : float
        The deadline [s].
    names : sequence of str
        Unfinished results, keys of `UNFINISHED_RESULTS`.
    """
    missing = ", before ".join(UNFINISHED_RESULTS[name] for name in names)
    sentence = f"the deadline of {seconds:g} s expired before {missing}"
    for name, more in (("least_effort", "effort"), ("least_hazard", "hazard")):
        if name in names:
            sentence += f"; the plan is one of less utilisation and more {more}"
    return sentence


class Budget:
    """Number of solver programs that a search may still solve; the deadline ends it, too.

    A search checks ``ended`` before each step, so the last step may overdraw the budget.

    Parameters
    ----------
    programs : int
        Number of programs.
    whole : Budget, optional
        Larger budget of which this budget is a part: `spend` here also spends there.
    """

    def __init__(self, programs: int, whole: Budget | None = None) -> None:
        self._left = programs
        self._whole = whole

    @property
    def ended(self) -> bool:
        """True if this budget or the whole is used up, or the deadline has expired."""
        if self._left <= 0 or expired():
            return True
        return self._whole is not None and self._whole.ended

    def spend(self, programs: int = 1) -> None:
        """Subtract a number of programs from this budget, and from the whole."""
        self._left -= programs
        if self._whole is not None:
            self._whole.spend(programs)

    def part(self, programs: int) -> Budget:
        """Return a new budget of some programs that is part of this budget."""
        return Budget(programs, self)
