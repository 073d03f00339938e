"""Progress, cancellation and garbage of long computations, however deep their calls go."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

__all__ = ["Progress", "broken_off_by", "go_on", "without_collection"]

Progress = Callable[[int, int], None]
"""Callback that gets the number of steps done and the number of all steps."""

_check: ContextVar[Callable[[], object] | None] = ContextVar("_check", default=None)


@contextmanager
def broken_off_by(check: Callable[[], object] | None) -> Iterator[None]:
    """Context manager that makes long work inside it cancellable.

    The work calls `go_on` again and again, and `go_on` calls ``check``: an exception that ``check``
    raises ends the work.

    Parameters
    ----------
    check : callable or None
        Called without arguments; None lets the work run to its end.
    """
    token = _check.set(check)
    try:
        yield
    finally:
        _check.reset(token)


def go_on() -> None:
    """Check for cancellation of long work: call the check of the enclosing `broken_off_by`."""
    check = _check.get()
    if check is not None:
        check()


@contextmanager
def without_collection() -> Iterator[None]:
    """Context manager that pauses the garbage collector, where much is made and little is lost."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()
