"""Report the progress of long work, and let a caller stop it, however deep its calls go."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

__all__ = ["Progress", "broken_off_by", "go_on"]

Progress = Callable[[int, int], None]
"""Callback that gets the number of steps done, and of all steps."""

_check: ContextVar[Callable[[], object] | None] = ContextVar("_check", default=None)


@contextmanager
def broken_off_by(check: Callable[[], object] | None) -> Iterator[None]:
    """Let long work inside call this again and again; what it raises ends the work.

    Parameters
    ----------
    check : callable or None
        None lets the work go on to its end.
    """
    token = _check.set(check)
    try:
        yield
    finally:
        _check.reset(token)


def go_on() -> None:
    """Go on with long work, unless who asked for it breaks it off."""
    check = _check.get()
    if check is not None:
        check()
