"""Keep a record of the services of a robot that are there, and choose which is asked next."""

from __future__ import annotations

import threading
import time
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

import zenoh
from zenoh.handlers import Callback

from service.wire import server_key

__all__ = ["LiveServers"]

DOUBT_TIME: Final = 10.0
"""How long a service that did not answer in time is asked only if there is no other [s]: until then
zenoh has seen that a machine is gone, by the lease of its link."""


@dataclass
class _Server:
    """A service that is there.

    Attributes
    ----------
    asked : int
        Number of questions of this client that it has.
    doubted_until : float
        Until when others are asked first, on the clock of `time.monotonic` [s].
    """

    asked: int = 0
    doubted_until: float = 0.0


class LiveServers:
    """Services of a robot whose liveliness tokens are there. Safe to use from several threads.

    Parameters
    ----------
    session : zenoh.Session
        The client's session.
    robot : str
        Name of the robot.
    wait : float
        Longest wait for the first service to be seen [s].
    """

    def __init__(self, session: zenoh.Session, robot: str, wait: float) -> None:
        self._changed = threading.Condition()
        # the one that was asked longest ago is first
        self._servers: dict[str, _Server] = {}
        tokens = Callback(self._see, indirect=False)
        key = server_key(robot, "*")
        self._tokens = session.liveliness().declare_subscriber(key, tokens, history=True)
        with self._changed:
            self._changed.wait_for(lambda: self._servers, wait)

    def close(self) -> None:
        """See no more services."""
        self._tokens.undeclare()

    def _see(self, sample: zenoh.Sample) -> None:
        server = str(sample.key_expr).rpartition("/")[2]
        with self._changed:
            if sample.kind == zenoh.SampleKind.PUT:
                self._servers.setdefault(server, _Server())
            else:
                self._servers.pop(server, None)
            self._changed.notify_all()

    def names(self) -> tuple[str, ...]:
        """Return the identifiers of all services that are there."""
        with self._changed:
            return tuple(self._servers)

    def next(self, besides: Collection[str] = ()) -> str | None:
        """Return the service that has fewest questions of this client, in turns where equal.

        One that has not answered in time is last.

        Parameters
        ----------
        besides : collection of str
            Services that have been asked already.

        Returns
        -------
        str or None
            None where there is no other.
        """
        now = time.monotonic()
        with self._changed:
            there = [name for name in self._servers if name not in besides]
            if not there:
                return None

            def busy(name: str) -> tuple[bool, int]:
                server = self._servers[name]
                return server.doubted_until > now, server.asked

            found = min(there, key=busy)
            self._servers[found] = self._servers.pop(found)
            return found

    @contextmanager
    def asking(self, server: str) -> Iterator[None]:
        """Return a context manager, within which a service has one question more."""
        with self._changed:
            asked = self._servers.get(server, _Server())
            asked.asked += 1
        try:
            yield
        finally:
            with self._changed:
                asked.asked -= 1

    def doubt(self, server: str) -> None:
        """Record that a service has not answered in time."""
        with self._changed:
            if server in self._servers:
                self._servers[server].doubted_until = time.monotonic() + DOUBT_TIME
