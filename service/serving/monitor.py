"""Monitor a service: one log line for each question, its health, and metrics for Prometheus.

The log is written in a separate thread, so that a reader that is slow blocks nothing else.
"""

from __future__ import annotations

import json
import logging
import os
import threading
import time
from collections import Counter as Counts
from collections.abc import Callable, Iterator
from contextlib import suppress
from queue import Full, Queue
from typing import NamedTuple

from prometheus_client import (
    CONTENT_TYPE_LATEST,
    CollectorRegistry,
    Counter,
    Histogram,
    generate_latest,
    start_http_server,
)
from prometheus_client.core import GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from hand_models.base import installed_version
from service.recording import Recorder
from service.replies import HealthReply, LastFailure, ProcessHealth
from service.serving.question import PendingQuestion
from service.wire import Answer, Format

__all__ = ["JsonLines", "LogThread", "ServiceMonitor", "ServiceState"]

log = logging.getLogger(__name__)


class ServiceState(NamedTuple):
    """Snapshot of a service: its worker processes and its queues.

    Attributes
    ----------
    processes : list of ProcessHealth
        One entry for each worker process.
    waiting : dict of str to int
        Number of waiting questions, by the kind of their queue.
    clients, streams : int
        Number of clients that are connected, and of streams that are kept.
    """

    processes: list[ProcessHealth]
    waiting: dict[str, int]
    clients: int = 0
    streams: int = 0


class ServiceMonitor:
    """Counter and log of what happens in a service; to be called from the dispatcher's thread.

    Parameters
    ----------
    robot : str
        Name of the robot.
    state : callable
        Returns the current `ServiceState`.

    Attributes
    ----------
    registry : prometheus_client.CollectorRegistry
        All metrics of the service.
    recorder : Recorder or None
        Recorder of the service.
    """

    def __init__(self, robot: str, state: Callable[[], ServiceState]) -> None:
        self._robot, self._version, self._state = robot, installed_version(), state
        self._started = time.time()
        self._failure: LastFailure | None = None
        self._replied = 0
        self.recorder: Recorder | None = None
        self.registry = kept = CollectorRegistry()
        # upper ends of the buckets in which times are counted [s]
        buckets = (1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
        self._questions = Counter(
            "crux_questions",
            "Questions that have been replied to.",
            ["key", "status"],
            registry=kept,
        )
        self._waited = Histogram(
            "crux_waiting_seconds",
            "From arrival to work.",
            ["key"],
            buckets=buckets,
            registry=kept,
        )
        self._worked = Histogram(
            "crux_work_seconds", "Of a process.", ["key"], buckets=buckets, registry=kept
        )
        self._ended = Counter(
            "crux_processes_ended", "Processes that were replaced.", registry=kept
        )
        self.registry.register(_Now(state, self._started))

    def serve(self, port: int) -> None:
        """Serve the metrics to Prometheus over HTTP on 127.0.0.1, in a thread of its own.

        Parameters
        ----------
        port : int
            TCP port.

        Raises
        ------
        OSError
            If the port is in use.
        """
        start_http_server(port, addr="127.0.0.1", registry=self.registry)

    def count(self, question: PendingQuestion, status: str, worked: float) -> None:
        """Count and log the reply to a question; remember failures of the service for `health`.

        Parameters
        ----------
        question : PendingQuestion
            The question that gets the reply.
        status : str
            Status of the reply, or the kind of an error.
        worked : float
            Time that a worker took for the answer [s]; zero if no worker answered.
        """
        self._replied += 1
        now = time.perf_counter()
        waited = (now if question.begun < 0.0 else question.begun) - question.arrived
        self._questions.labels(question.name, status).inc()
        self._waited.labels(question.name).observe(waited)
        if worked > 0.0:
            self._worked.labels(question.name).observe(worked)
        # these are the service's, and not the question's
        if status in {"failed", "internal", "lost", "deadline"}:
            self._failure = LastFailure(
                kind=status, about=question.name, id=question.id, at=time.time()
            )
        if log.isEnabledFor(logging.INFO):
            line = {
                "key": question.key,
                "id": question.id,
                "client": question.client or None,
                "waited": round(waited, 6),
                "worked": round(worked, 6),
                "total": round(now - question.arrived, 6),
                "status": status,
            }
            log.info(
                "%s %s: %s after %.1f ms, %.1f ms of them at work; client %s",
                question.key,
                "-" if question.id is None else repr(question.id),
                status,
                1e3 * (now - question.arrived),
                1e3 * worked,
                question.client or "unnamed",
                extra={"question": line},
            )

    def ended(self, pid: int | None, how: str) -> None:
        """Count and log a worker process that has ended and is replaced.

        Parameters
        ----------
        pid : int or None
            Process identifier.
        how : str
            How the process ended, in words.
        """
        self._ended.inc()
        self._failure = LastFailure(kind="lost", about=f"process {pid} {how}", at=time.time())
        log.warning("process %s %s; another takes its place", pid, how)

    def health(self) -> Answer:
        """Return the service's health, a `HealthReply` encoded as JSON."""
        state = self._state()
        reply = HealthReply(
            robot=self._robot,
            version=self._version,
            uptime=time.time() - self._started,
            replied=self._replied,
            waiting=state.waiting,
            processes=state.processes,
            last_failure=self._failure,
            clients=state.clients,
            streams=state.streams,
            recording=None if self.recorder is None else self.recorder.health(),
        )
        return Answer(Format.JSON.encode(reply), Format.JSON.label(reply))

    def metrics(self) -> Answer:
        """Return all metrics in the text format of Prometheus."""
        return Answer(generate_latest(self.registry), CONTENT_TYPE_LATEST)


class _Now(Collector):
    """Metrics that are read at the moment when they are asked for."""

    def __init__(self, state: Callable[[], ServiceState], started: float) -> None:
        self._state, self._started = state, started

    def describe(self) -> list[Metric]:
        return []

    def collect(self) -> Iterator[Metric]:
        state = self._state()
        up = "Since the service was started."
        yield GaugeMetricFamily("crux_uptime_seconds", up, time.time() - self._started)
        waiting = GaugeMetricFamily(
            "crux_questions_waiting", "Questions that wait, by kind.", labels=["kind"]
        )
        for kind, count in state.waiting.items():
            waiting.add_metric([kind], count)
        yield waiting
        for name, words, count in (
            ("clients", "Clients that are connected.", state.clients),
            ("streams", "Streams that are kept.", state.streams),
        ):
            yield GaugeMetricFamily(f"crux_{name}", words, count)
        processes = GaugeMetricFamily(
            "crux_processes", "Processes by what they do.", labels=["purpose", "state"]
        )
        for (purpose, does), count in Counts((p.purpose, p.state) for p in state.processes).items():
            processes.add_metric([purpose, does], count)
        yield processes
        memory = GaugeMetricFamily(
            "crux_process_resident_bytes", "Memory of each process.", labels=["pid", "purpose"]
        )
        for each in state.processes:
            if each.resident is not None:
                memory.add_metric([str(each.pid), each.purpose], each.resident)
        yield memory


class LogThread(logging.Handler):
    """Logging handler that writes lines to standard error in a background thread.

    A stopped terminal, or a pipe that nobody reads, blocks that thread alone. At most 10,000 lines
    wait; further lines are dropped, and their number is logged.
    """

    def __init__(self) -> None:
        super().__init__()
        # further lines that wait to be written are left out, and counted
        self._lines: Queue[str | None] = Queue(10_000)
        self._left_out = 0
        self._thread = threading.Thread(target=self._run, name="crux-log", daemon=True)
        self._thread.start()

    def emit(self, record: logging.LogRecord) -> None:
        try:
            self._lines.put_nowait(self.format(record))
        except Full:
            self._left_out += 1

    def close(self) -> None:
        """Stop the thread; wait up to half a second until the lines that are left are written."""
        with suppress(Full):
            self._lines.put_nowait(None)
        self._thread.join(timeout=0.5)
        super().close()

    def _run(self) -> None:
        while (line := self._lines.get()) is not None:
            self._write(line)
            if self._left_out and self._lines.empty():
                left_out, self._left_out = self._left_out, 0
                log.warning("%d lines of this log are left out: they were not read", left_out)

    def _write(self, line: str) -> None:
        data = line.encode(errors="replace") + b"\n"
        # not sys.stderr: the interpreter cannot end while a thread is at work on that
        with suppress(OSError):
            while data:
                data = data[os.write(2, data) :]


class JsonLines(logging.Formatter):
    """Logging formatter that turns each record into one line of JSON.

    A line has ``time`` (Unix time [s]) and ``level``; then ``message``, or for an answered question
    its fields (key, id, client, times [s], status); and ``traceback`` where there is an exception.
    """

    def format(self, record: logging.LogRecord) -> str:
        line: dict[str, object] = {"time": record.created, "level": record.levelname.lower()}
        question = getattr(record, "question", None)
        line |= {"message": record.getMessage()} if question is None else question
        if record.exc_info:
            line["traceback"] = self.formatException(record.exc_info)
        return json.dumps(line)
