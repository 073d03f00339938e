"""The service on zenoh: one queryable a key, one question at a time.

Each key has a small first-in-first-out channel and a thread that answers from it. The channel is
small on purpose: zenoh lets a client wait whose query does not fit, so that a flood of questions
waits in its own client's link, and the next client's question gets its turn. Such a link keeps one
of zenoh's receiving threads, so there have to be more of those than clients that flood. A lock
keeps the models, which are not thread-safe, to one question; only set-points of streams, which are
there already, do not wait for it. Nothing of it runs on zenoh's threads.
"""

from __future__ import annotations

import logging
import os
import threading
import time
from types import TracebackType
from typing import Final, Self

import zenoh
from zenoh.handlers import FifoChannel, Handler

from hand_models.parameters import ParameterTable
from planner.programs import build_ahead
from planner.robots import RobotFile
from service.answering import SERVICES, Streams, builder_of, handle, robots_of
from service.wire import ALIVE, service_key

__all__ = ["PlanService", "prepare_zenoh"]

log = logging.getLogger(__name__)

CHANNEL: Final = 2
"""Queries that wait at a key; more wait in their clients' links."""

RECEIVERS: Final = 32
"""Zenoh's receiving threads; with its own default of two, two floods delay others by seconds."""

SEARCH: Final = 1.0
"""How long another service of the same robot is looked for at most [s]."""

PATIENCE: Final = 0.5
"""How long a stop waits for a question that is being answered [s]."""


def prepare_zenoh() -> None:
    """Give zenoh its receiving threads, unless ``ZENOH_RUNTIME`` is set; before any session."""
    os.environ.setdefault("ZENOH_RUNTIME", f"(rx: (worker_threads: {RECEIVERS}))")


class PlanService:
    """A robot's plan service while it is entered.

    Parameters
    ----------
    session : zenoh.Session
        Not closed by the service.
    robot : RobotFile, optional
        The robot that is planned for; RoboSimian by default.
    hand : ParameterTable, optional
        Entries in which its hands are not the bundled one; a request's own go on top.

    Attributes
    ----------
    robot : str
        Its name.
    keys : tuple of str
        That it answers at.
    turn : Lock
        Held by the one question that is answered.
    """

    def __init__(
        self,
        session: zenoh.Session,
        robot: RobotFile | None = None,
        hand: ParameterTable | None = None,
    ) -> None:
        self._hand = hand
        self._robots = robots_of(robot)
        (self.robot,) = self._robots
        self.keys = tuple(service_key(self.robot, name) for name in SERVICES)
        self._alive = service_key(self.robot, ALIVE)
        self._session = session
        self.turn = threading.Lock()
        self._streams = Streams()
        self._threads: list[threading.Thread] = []
        self._queryables: list[zenoh.Queryable[Handler[zenoh.Query]]] = []
        self._token: zenoh.LivelinessToken | None = None

    def has_rival(self) -> bool:
        """Say whether another service answers for the robot; to be asked before entering."""
        replies = self._session.liveliness().get(self._alive, timeout=SEARCH)
        return any(reply.ok is not None for reply in replies)

    def __enter__(self) -> Self:
        for key in self.keys:
            queryable = self._session.declare_queryable(key, FifoChannel(CHANNEL), complete=True)
            thread = threading.Thread(
                target=self._serve, args=(key, queryable.handler), name=key, daemon=True
            )
            thread.start()
            self._queryables.append(queryable)
            self._threads.append(thread)
        self._token = self._session.liveliness().declare_token(self._alive)
        robot = builder_of(None, self._robots)(None)
        build_ahead(len(robot.shoulders))
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if self._token is not None:
            self._token.undeclare()
        for queryable in self._queryables:
            queryable.undeclare()
        patient_until = time.monotonic() + PATIENCE
        for thread in self._threads:
            thread.join(max(0.0, patient_until - time.monotonic()))
        self._streams.close()

    def _serve(self, key: str, queries: Handler[zenoh.Query]) -> None:
        while True:
            try:
                query = queries.recv()
            except zenoh.ZError:  # undeclared
                return
            # without the with, the client would wait until its timeout
            with query:
                try:
                    self._answer(key, query)
                except Exception:
                    log.exception("a reply at %s was lost", key)

    def _answer(self, key: str, query: zenoh.Query) -> None:
        started = time.perf_counter()
        payload = b"" if query.payload is None else query.payload.to_bytes()
        encoding = "" if query.encoding is None else str(query.encoding)
        answer = handle(
            key,
            payload,
            encoding,
            self._hand,
            self._robots,
            started=started,
            turn=self.turn,
            streams=self._streams,
        )
        if answer.good:
            query.reply(key, answer.payload, encoding=answer.encoding)
        else:
            query.reply_err(answer.payload, encoding=answer.encoding)
