"""Offer the service on zenoh: one queryable for each key, which passes queries to a dispatcher.

Nothing is computed in zenoh's threads, and none of them ever blocks.
"""

from __future__ import annotations

import os
import socket
import struct
from collections.abc import Callable
from contextlib import ExitStack, suppress
from functools import partial
from socket import AF_INET, AF_INET6
from typing import Any, Self

import msgspec
import zenoh
from zenoh.handlers import Callback

from hand_models.base import InvalidInputError
from hand_models.parameters import ParameterTable
from planner import Make, RobotFile, cores
from service.answering import SERVICES_BY_NAME, robots_of
from service.processes import Job, answering
from service.publishing import PublishedWrenches
from service.recording import Recorder
from service.replies import HealthReply
from service.requests import DEFAULT_DEADLINE, LONGEST_DEADLINE
from service.ros2 import RosNode
from service.servers import rivals_in_words
from service.serving.dispatcher import Dispatcher
from service.serving.player import play
from service.serving.settings import SERVING_SETTINGS
from service.serving.worker_pool import WorkerPool
from service.wire import Answer, ServiceName, server_key, service_key

__all__ = ["PlanService", "service_keys"]


def service_keys(robot: str) -> tuple[str, ...]:
    """Return the zenoh keys of the questions that a service for a robot answers."""
    return tuple(service_key(robot, name) for name in (*SERVICES_BY_NAME, ServiceName.CANCEL))


class PlanService:
    """Plan service of one robot on a zenoh session; it answers inside its ``with`` block.

    Questions are answered in worker processes, which import the program: one that serves needs its
    ``if __name__ == "__main__":``.

    Parameters
    ----------
    session : zenoh.Session
        Open session; the service does not close it.
    robot : RobotFile, optional
        The robot that is planned for; RoboSimian by default.
    hand : ParameterTable, optional
        Entries that replace those of the bundled hand; entries in a request override them.
    workers : int, optional
        Number of workers that answer questions; by default the number of cores, but at least 2. One
        more worker keeps the streams.
    seconds : float, optional
        Deadline of a question that names none [s].
    memory : int, optional
        Largest memory of each worker [bytes], where the operating system can limit it.
    ros_domain : int, optional
        Number of the ROS domain in which the service is a node of ROS 2, too; by default it is
        none.
    recorder : Recorder, optional
        Records questions and answers, and what the node of ROS 2 takes and publishes; the caller
        closes it.
    make : callable, optional
        Called once in each worker; returns the function that answers a `Job`. Pickled. By default
        the planner answers.

    Attributes
    ----------
    robot : str
        Name of the robot.
    keys : tuple of str
        Zenoh keys of the questions that the service answers.
    operators : tuple of str
        Zenoh keys of the service's health and of its metrics.
    server : str
        Identifier of the service among several, that of its session. At
        ``crux/<robot>/server/<server>/<question>`` it alone answers.
    ros : RosNode or None
        The node of ROS 2.

    Raises
    ------
    InvalidInputError
        If ``workers`` is below 1, or ``seconds`` is not above 0 and at most 600 s; or if there can
        be no node of ROS 2.
    LostError
        On entering, if no worker starts.
    RuntimeError
        On entering, in a worker of a program that lacks its ``if __name__ == "__main__":``.
    """

    def __init__(
        self,
        session: zenoh.Session,
        robot: RobotFile | None = None,
        hand: ParameterTable | None = None,
        *,
        workers: int | None = None,
        seconds: float = DEFAULT_DEADLINE,
        memory: int = 2 * 2**30,
        ros_domain: int | None = None,
        recorder: Recorder | None = None,
        make: Make[Job, Answer] | None = None,
    ) -> None:
        # even on one core, what takes long leaves a process to others
        count = max(2, cores()) if workers is None else workers
        if count < 1:
            raise InvalidInputError(f"must be at least 1, got {count}", field="workers")
        if not 0.0 < seconds <= LONGEST_DEADLINE:
            raise InvalidInputError(
                f"must be above 0 s and at most {LONGEST_DEADLINE:g} s, got {seconds:g}",
                field="seconds",
            )
        (self.robot,) = robots_of(robot)
        self.keys = service_keys(self.robot)
        self.operators = tuple(
            service_key(self.robot, name) for name in (ServiceName.HEALTH, ServiceName.METRICS)
        )
        self._alive = service_key(self.robot, ServiceName.ALIVE)
        self._session, self.server = session, str(session.info.zid())
        self._takers: dict[str, Callable[[zenoh.Query, str], None]] = {}
        self.ros = None if ros_domain is None else RosNode(session, self.robot, ros_domain)
        made = make or partial(answering, robot, hand)
        self._wrenches = PublishedWrenches(session, self.robot)
        pool = WorkerPool(made, count, memory, self._wrenches.keep)
        self._dispatcher = Dispatcher(pool, seconds, self.robot, self._inquire)
        self._monitor = self._dispatcher.monitor
        self._monitor.recorder = recorder
        self._wrenches.record = None if recorder is None else recorder.add
        self._open = ExitStack()

    def rivals(self) -> str | None:
        """Return what happens to questions, as others answer for the robot; None if nobody does.

        The search takes up to 1 s. Of two services that start at a time, each finds the other only
        once it has entered.
        """
        return rivals_in_words(self._session, self.robot, SERVING_SETTINGS.search_timeout)

    def serve_metrics(self, port: int) -> None:
        """Serve the metrics to Prometheus over HTTP, on this machine alone.

        Parameters
        ----------
        port : int
            TCP port on 127.0.0.1.

        Raises
        ------
        InvalidInputError
            If the port cannot be opened.
        """
        try:
            self._monitor.serve(port)
        except OSError as error:
            raise InvalidInputError(
                f"port {port} cannot be opened: {error.strerror}; give another",
                field="--metrics-port",
            ) from None

    def is_alive(self) -> bool:
        """Return whether questions are taken in and given to workers; it may take up to 1 s."""
        state = msgspec.json.decode(self._monitor.health().payload, type=HealthReply)
        return any(each.purpose == "questions" for each in state.processes)

    def __enter__(self) -> Self:
        self._dispatcher.start()
        self._open.callback(self._dispatcher.close)
        self._takers = dict.fromkeys(self.keys, self._dispatcher.ask)
        for key in self.keys:
            self._declare(key, self._takers[key])
        health, metrics = self.operators
        looks = ((health, self._monitor.health), (metrics, self._monitor.metrics))
        self._takers |= {key: partial(self._dispatcher.look, made) for key, made in looks}
        for key in self.operators:
            self._declare(key, self._takers[key])
        self._open.callback(self._wrenches.close)
        self._wrenches.take(self._dispatcher.ask)
        own = Callback(self._own, indirect=False)
        key = server_key(self.robot, self.server, "*")
        self._until_the_end(self._session.declare_queryable(key, own, complete=True))
        # clients in this process need no link
        self._dispatcher.linked(str(self._session.info.zid()))
        links, info = Callback(self._transport, indirect=False), self._session.info
        self._until_the_end(info.declare_transport_events_listener(links, history=True))
        liveliness = self._session.liveliness()
        self._until_the_end(liveliness.declare_subscriber(self._client_key("*"), self._client))
        if self.ros is not None:
            self._open.callback(self.ros.close)
            player = partial(play, self._session, self.robot)
            recorder = self._monitor.recorder
            record = None if recorder is None else recorder.add
            self.ros.open(self._dispatcher.ask, self._monitor.health, player, record)
        self._open.callback(self._dispatcher.stop)
        for token in (self._alive, server_key(self.robot, self.server)):
            self._until_the_end(liveliness.declare_token(token))
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()

    def _until_the_end(self, declared: Any) -> None:
        self._open.callback(declared.undeclare)

    def _declare(self, key: str, take: Callable[[zenoh.Query, str], None]) -> None:
        def callback(query: zenoh.Query) -> None:
            # for the key itself, and not for every one that it happens to match
            if str(query.key_expr).rpartition("/")[2] == key.rpartition("/")[2]:
                take(query, key)
            else:
                query.drop()

        taker = Callback(callback, indirect=False)
        self._until_the_end(self._session.declare_queryable(key, taker, complete=True))

    def _own(self, query: zenoh.Query) -> None:
        """Take a query at a key of this service alone; no wildcard reaches it."""
        key = str(query.key_expr)
        folder, _, name = key.rpartition("/")
        take = self._takers.get(service_key(self.robot, name))
        if take is None or folder != server_key(self.robot, self.server):
            query.drop()
        else:
            take(query, key)

    def _client_key(self, name: str) -> str:
        return service_key(self.robot, f"{ServiceName.CLIENTS}/{name}")

    def _transport(self, event: zenoh.TransportEvent) -> None:
        name = str(event.transport.zid)
        if event.kind == zenoh.SampleKind.DELETE:
            self._dispatcher.gone(name)
        else:
            close_at_once()
            self._dispatcher.linked(name)

    def _client(self, sample: zenoh.Sample) -> None:
        """See a client's token come or go, in a thread that may wait."""
        if sample.kind != zenoh.SampleKind.DELETE:
            return
        name = str(sample.key_expr).rpartition("/")[2]
        # the one that has gone may be another session's of the same key
        left = self._session.liveliness().get(
            self._client_key(name), timeout=SERVING_SETTINGS.search_timeout
        )
        if not any(reply.ok is not None for reply in left):
            self._dispatcher.gone(name, token=True)

    def _inquire(self, name: str) -> None:
        """Ask the session of a name for the digest of its secret; only its own reply counts."""

        def received(reply: zenoh.Reply) -> None:
            replier = reply.replier_id
            if reply.ok is not None and replier is not None and str(replier.zid) == name:
                self._dispatcher.proven(name, reply.ok.payload.to_bytes())

        self._session.get(
            self._client_key(name),
            Callback(received, indirect=False),
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            congestion_control=zenoh.CongestionControl.DROP,
            timeout=SERVING_SETTINGS.search_timeout,
        )


def close_at_once() -> None:
    """Disable the linger time of this process's TCP connections, so that closing does not wait.

    By default, zenoh's sockets wait for 10 s (`SO_LINGER`) until the other end has read what is
    left, in a thread and under locks that all of zenoh's links need (zenoh issues 1101 and 2718).
    Without the linger time the operating system sends what is left in the background.
    """
    no_linger = struct.pack("ii", 0, 0)
    # the numbers of this process's open files
    for name in os.listdir("/dev/fd"):
        with suppress(OSError):
            # what is no socket is refused here
            link = socket.socket(fileno=int(name))
            try:
                if link.type == socket.SOCK_STREAM and link.family in (AF_INET, AF_INET6):
                    link.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, no_linger)
            finally:
                # it stays open: it is another's
                link.detach()
