"""Processes that are started here end with this one, and leave signals to it."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker
from multiprocessing.connection import wait
from types import FrameType
from typing import Any, Final

__all__ = ["begin_child", "starting_children"]

SIGNALS: Final = (signal.SIGINT, signal.SIGTERM)

ORPHANED: Final = 1.0
"""How long a process may go on without the one that started it [s]."""

THREADS: Final = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""What keeps a library of linear algebra to one thread, before it is loaded."""


def begin_child(*, stays: bool = False) -> None:
    """Leave Ctrl-C to the process that started this one, and end soon after that one does.

    Parameters
    ----------
    stays : bool, optional
        Whether SIGTERM is left to that one, too.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN if stays else signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        time.sleep(ORPHANED)
        os._exit(1)


@contextmanager
def starting_children(*signals: signal.Signals) -> Iterator[None]:
    """Start processes that call `begin_child`: no signal interrupts that on either side.

    One that arrives here meanwhile is answered at the end; there it waits for `begin_child`, for
    good where that is not called. They do their linear algebra on one thread.

    Parameters
    ----------
    *signals : Signals
        By default SIGINT and SIGTERM.
    """
    signals = signals or SIGNALS
    # or else it is started with the first process, and lets signals in again
    resource_tracker.ensure_running()
    arrived: list[int] = []

    def later(number: int, _: FrameType | None) -> None:
        arrived.append(number)

    handlers: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():
        for each in signals:
            if signal.getsignal(each) not in (None, signal.SIG_IGN):
                handlers[each] = signal.signal(each, later)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, signals)
    try:
        with _one_thread():
            yield
    finally:
        # what has waited here arrives now
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        for number, handler in handlers.items():
            signal.signal(number, handler)
        for number in arrived:
            signal.raise_signal(number)


@contextmanager
def _one_thread() -> Iterator[None]:
    """Let processes that are started here do their linear algebra on one thread."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
