"""Take the signals that end a service."""

from __future__ import annotations

import os
import signal

from service.processes import kill_children

__all__ = ["StopSignal"]


class StopSignal:
    """Handler of SIGTERM and Ctrl-C; at first they end this process and its child processes.

    A signal may arrive in a thread of zenoh or of a solver, and then does not wake the main
    thread. The byte that the handler writes to a pipe wakes it.
    """

    NUMBERS = (signal.SIGINT, signal.SIGTERM)

    def __init__(self) -> None:
        self._arrived, wakeup = os.pipe()
        os.set_blocking(wakeup, False)
        signal.set_wakeup_fd(wakeup, warn_on_full_buffer=False)
        for number in self.NUMBERS:
            signal.signal(number, _leave)

    def waits_for(self) -> None:
        """Let signals end `wait`, not the process, so that open questions are answered first."""
        for number in self.NUMBERS:
            signal.signal(number, lambda *_: None)

    def wait(self) -> None:
        """Wait for the first signal; a second one kills the process."""
        os.read(self._arrived, 1)
        for number in self.NUMBERS:
            signal.signal(number, signal.SIG_DFL)


def _leave(*_: object) -> None:
    try:
        # a child process may just be starting
        kill_children()
    finally:
        os._exit(0)
