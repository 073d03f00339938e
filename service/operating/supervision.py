"""Notify systemd, or another supervisor (sd_notify), that a service is ready and alive."""

from __future__ import annotations

import os
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

__all__ = ["supervised"]


@contextmanager
def supervised(is_alive: Callable[[], bool]) -> Iterator[None]:
    """Say READY=1, WATCHDOG=1 in time while the service is alive, and STOPPING=1 at the end.

    Nothing is said unless the environment has ``NOTIFY_SOCKET``; the watchdog is fed twice in
    ``WATCHDOG_USEC``, if that is given and meant for this process (``WATCHDOG_PID``).

    Parameters
    ----------
    is_alive : callable
        Returns whether the service answers; called in a thread of its own. While it does not, the
        watchdog is not fed, so that the service is started again.
    """
    done = threading.Event()

    def feed(period: float) -> None:
        while not done.wait(period):
            if is_alive():
                _say("WATCHDOG=1")

    _say("READY=1", "STATUS=answers questions")
    if period := _period():
        threading.Thread(target=feed, args=(period,), name="crux-watchdog", daemon=True).start()
    try:
        yield
    finally:
        done.set()
        _say("STOPPING=1")


def _period() -> float | None:
    """Return how often the watchdog is to be fed [s]; None where there is none."""
    given, pid = os.environ.get("WATCHDOG_USEC", ""), os.environ.get("WATCHDOG_PID")
    if not given.isdecimal() or int(given) == 0 or pid not in (None, str(os.getpid())):
        return None
    return 0.5e-6 * int(given)


def _say(*lines: str) -> None:
    address = os.environ.get("NOTIFY_SOCKET", "")
    if not address.startswith(("/", "@")):
        return
    # Linux has addresses that are no files, which begin with a zero
    address = f"\0{address[1:]}" if address[0] == "@" else address
    with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as link:
        link.sendto("\n".join(lines).encode(), address)
