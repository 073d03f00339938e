"""End a command and its child processes on SIGINT or SIGTERM, with one line of error."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from shutil import rmtree
from types import FrameType
from typing import Final

__all__ = ["Interrupted", "interruptible", "kill_children"]

ENDING_SIGNALS: Final = (signal.SIGINT, signal.SIGTERM)

IMPORT_MODULE: Final = "_frozen_importlib"
"""Name of the module whose functions import modules."""


class Interrupted(BaseException):
    """Exception that SIGINT or SIGTERM raises in the main thread of a command.

    The argument, if there is one, says in words which part of the work is kept; it is printed.
    """


@contextmanager
def interruptible() -> Iterator[None]:
    """Return a context manager that ends a command cleanly on SIGINT or SIGTERM.

    The first signal raises `Interrupted` in the block, which has 5 s to save its work; then one
    line is printed and the process exits with status 1. A second signal, or a signal after the
    block, kills the process and its children at once. Signals that are ignored stay ignored.
    """
    for number in ENDING_SIGNALS:
        # one that is ignored is not for this process
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _interrupt)
    sys.unraisablehook = _unraisable
    try:
        yield
    except Interrupted as error:
        _report(str(error))
        sys.exit(1)
    finally:
        for number in ENDING_SIGNALS:
            if signal.getsignal(number) == _interrupt:
                signal.signal(number, _end)


def _interrupt(number: int, frame: FrameType | None) -> None:
    """Answer the first signal: let the command end by itself, but not for ever."""
    packages, caller = _above(frame)
    if caller is not None and IMPORT_MODULE not in packages:
        # a compiled function that takes its arguments goes on whatever is raised there, and what
        # comes of that is an error of another kind
        _interrupt_in(caller, number)
        return
    for each in ENDING_SIGNALS:
        signal.signal(each, _end)
    if IMPORT_MODULE in packages:
        # extension modules turn what is raised into errors of their own, or print it
        _end()
    # [s] to keep what is done, and to end
    timer = threading.Timer(5.0, _end)
    timer.daemon = True
    timer.start()
    raise Interrupted


def _above(frame: FrameType | None) -> tuple[set[str], FrameType | None]:
    """Return the packages of a frame and of all that called it, and what called numba, if any."""
    packages, caller = set[str](), None
    while frame is not None:
        package = frame.f_globals.get("__name__", "").partition(".")[0]
        packages.add(package)
        frame = frame.f_back
        if package == "numba":
            caller = frame
    return packages, caller


def _interrupt_in(frame: FrameType, number: int) -> None:
    """Answer a signal as soon as a frame goes on."""

    def trace(frame: FrameType, event: str, _: object) -> None:
        sys.settrace(None)
        frame.f_trace = None
        _interrupt(number, frame)

    frame.f_trace = trace
    # without one for all functions, those of frames are not called
    sys.settrace(lambda *_: None)


def _end(number: int = 0, frame: FrameType | None = None) -> None:
    """End here and now, and all processes that were started."""
    try:
        kill_children()
        if os.isatty(2):
            # show the cursor
            os.write(2, b"\x1b[?25h")
        _report("")
    finally:
        os._exit(1)


def kill_children() -> None:
    """Kill all child processes that `multiprocessing` has started."""
    # it may be half imported, and then there are none
    children = getattr(sys.modules.get("multiprocessing"), "active_children", None)
    for process in children() if children is not None else ():
        process.kill()
    if "multiprocessing.forkserver" in sys.modules:
        from multiprocessing.util import get_temp_dir

        # with the socket of the process that they are forked from, which then ends
        rmtree(get_temp_dir(), ignore_errors=True)


_reported: list[str] = []


def _report(kept: str) -> None:
    """Say once on standard error that the command was interrupted, and what is kept."""
    if not _reported:
        _reported.append(kept)
        os.write(2, f"crux: {': '.join(filter(None, ('interrupted', kept)))}\n".encode())


def _unraisable(what: sys.UnraisableHookArgs) -> None:
    """End where an interruption would be swallowed."""
    if issubclass(what.exc_type, Interrupted):
        _end()
    sys.__unraisablehook__(what)
