"""Start worker processes: forked with libraries loaded where that is safe, or else spawned."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from multiprocessing import resource_tracker
from types import FrameType
from typing import Any, Final

from hand_models.base import THREAD_VARIABLES

__all__ = [
    "SETTINGS",
    "ProcessSettings",
    "begin_fork_server",
    "fork_server_died",
    "start_method",
    "starting_children",
]


@dataclass(frozen=True, slots=True)
class ProcessSettings:
    """Constants of worker processes and of the process that starts them."""

    signals: tuple[signal.Signals, ...] = (signal.SIGINT, signal.SIGTERM)
    part_bytes: int = 2**13  # of an answer, sent at once: no process can be stopped within them
    out_of_memory: int = 77  # exit status of one that may not have the memory it needs
    unknown: int = 255  # the same, by `multiprocessing`, of one whose fork server is dead
    preloaded: str = "service.processes.loaded"  # module that a fork server imports for workers
    starts: int = 2  # in a row that may fail, or die before they are ready; then no more are tried


SETTINGS: Final = ProcessSettings()


def begin_fork_server() -> None:
    """Start the process that workers are forked from, which loads their modules, if there is none.

    Returns at once. Without effect where workers are spawned: on systems other than Linux, whose
    libraries do not survive a fork.
    """
    if sys.platform == "linux":
        from multiprocessing import forkserver

        forkserver.set_forkserver_preload([SETTINGS.preloaded])
        with starting_children(), suppress(OSError):
            forkserver.ensure_running()


def start_method() -> Any:
    """Return the context of `multiprocessing` that starts workers, once it can.

    A signal may interrupt the wait for a fork server. Workers are spawned if none can be had, and
    once it has died: nobody waits for another to load its modules.
    """
    forked = not _fork_server_died.is_set() and _fork_server_works()
    return multiprocessing.get_context("forkserver" if forked else "spawn")


def fork_server_died() -> None:
    """Spawn all workers that are started from now on."""
    _fork_server_died.set()


_fork_server_died = threading.Event()


@cache
def _fork_server_works() -> bool:
    """Wait until the fork server has forked a process, which does nothing; false if it cannot."""
    if sys.platform != "linux":
        return False
    begin_fork_server()
    try:
        multiprocessing.get_context("forkserver").Process(target=int, daemon=True).start()
    except (OSError, EOFError):
        return False
    return True


@contextmanager
def starting_children(*signals: signal.Signals) -> Iterator[None]:
    """Context manager in which worker processes are started: no signal interrupts a start.

    Signals that arrive are handled in this process when the block ends. A child receives them only
    once it calls `_begin_child`, never if it does not. Children run their linear algebra on one
    thread.

    Parameters
    ----------
    *signals : Signals
        Signals to hold back; SIGINT and SIGTERM by default.
    """
    signals = signals or SETTINGS.signals
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
    before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
