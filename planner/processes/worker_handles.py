"""Handles of worker processes that answer questions; each lane of a worker answers them in order.

A worker can be killed at any time, which loses the questions in its lanes and nothing else. Workers
end with the process that started them, and leave SIGINT to that process.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from contextvars import ContextVar
from functools import partial
from multiprocessing.connection import Connection, wait
from typing import Any, Generic, TypeVar

from planner.processes.starting import (
    SETTINGS,
    fork_server_died,
    start_method,
    starting_children,
)

__all__ = ["Make", "PriorityLane", "WorkerHandle", "resident", "send_part"]

Input = TypeVar("Input")
Output = TypeVar("Output")

Make = Callable[[], Callable[[Input], Output]]
"""Factory that is called once in a worker and returns the function that answers questions."""

_sender: ContextVar[Callable[[object], None] | None] = ContextVar("_sender", default=None)


class PriorityLane(Generic[Input, Output]):
    """One of a worker's lanes: a pipe and a thread that answers one question after another.

    Attributes
    ----------
    handle : WorkerHandle
        Worker that has this lane.
    number : int
        Index among the worker's lanes.
    pipe : Connection
        This end of the pipe to the worker.
    ready : bool
        Whether the worker has reported that this lane can answer.
    """

    def __init__(self, handle: WorkerHandle[Input, Output], number: int, pipe: Connection) -> None:
        self.handle = handle
        self.number = number
        self.pipe = pipe
        self.ready = False
        self._parts: list[bytes] = []
        self._sender: threading.Thread | None = None

    def give(self, question: Input) -> None:
        """Send a question to the worker without waiting.

        A question too large for the pipe's buffer is sent by a background thread, as a busy or
        suspended worker does not read. If the worker has died, `take` raises.
        """
        data, before = pickle.dumps(question, protocol=pickle.HIGHEST_PROTOCOL), self._sender
        # [bytes]: every pipe has room for them
        if len(data) < 2**14 and (before is None or not before.is_alive()):
            self._send(data)
            return
        self._sender = threading.Thread(target=self._send, args=(data, before), daemon=True)
        self._sender.start()

    def _send(self, data: bytes, before: threading.Thread | None = None) -> None:
        """Send a pickled question, after what a thread sends."""
        if before is not None:
            before.join()
        with suppress(OSError):
            self.pipe.send_bytes(data)

    def close(self) -> None:
        """Close the pipe, once the worker has ended."""
        if self._sender is not None:
            self._sender.join()
        self.pipe.close()

    def take(self) -> Output | None:
        """Return the next answer of the worker, if all of it has arrived, or what `send_part` sent.

        To be called when the pipe has data. Never waits for the rest of an answer.

        Returns
        -------
        object or None
            None if only a part of an answer has arrived, or the report that the lane is ready.

        Raises
        ------
        EOFError
            If the worker has died.
        """
        try:
            self._parts.append(self.pipe.recv_bytes())
            while len(self._parts[-1]) == SETTINGS.part_bytes:
                if not self.pipe.poll():
                    return None
                self._parts.append(self.pipe.recv_bytes())
        except OSError:
            raise EOFError from None
        whole, self._parts = b"".join(self._parts), []
        found: Output | None = pickle.loads(whole)
        self.ready = True
        return found


class WorkerHandle(Generic[Input, Output]):
    """Worker process that answers questions in one or several lanes.

    Parameters
    ----------
    make : callable
        Factory that is called once in the worker and returns the function that answers a question.
        Factory, questions and answers must be picklable. An exception in the factory ends the
        worker, and so does one in the first lane's function; in another lane it ends that lane's
        thread only.
    lanes : int
        Number of questions answered at a time, each by a thread of its own.
    memory : int, optional
        Limit of the worker's memory [bytes]; enforced on Linux only.
    stays : bool, optional
        Whether the worker ignores SIGTERM, so that the process that started it handles that signal.

    Attributes
    ----------
    process : Process
        The worker's process.
    lanes : tuple of PriorityLane
        The worker's lanes, in the order of their numbers.
    """

    def __init__(
        self,
        make: Make[Input, Output],
        lanes: int = 1,
        memory: int | None = None,
        *,
        stays: bool = False,
    ) -> None:
        context = start_method()
        ends = [context.Pipe() for _ in range(lanes)]
        others = [other for _, other in ends]
        with starting_children():
            run = partial(_answer_each, others, memory, stays, dict(os.environ))
            self.process = context.Process(target=run, daemon=True)
            try:
                self.process.start()
            except EOFError:
                fork_server_died()
                raise ChildProcessError("the process that workers are forked from died") from None
        for other in others:
            # the process has the other ends alone, so that its death ends the pipes
            other.close()
        self.lanes = tuple(PriorityLane(self, i, pipe) for i, (pipe, _) in enumerate(ends))
        # by a pipe, which reports a death: it may be large
        with suppress(OSError):
            ends[0][0].send(make)

    @property
    def ready(self) -> bool:
        """True if all lanes have reported that they can answer."""
        return all(lane.ready for lane in self.lanes)

    def kill(self, *, dead: bool = False) -> str:
        """Kill the worker, close its lanes, and return words for how it ended.

        Parameters
        ----------
        dead : bool, optional
            Whether the worker has already died: then wait up to 1 s for its exit status.

        Returns
        -------
        str
            Such as ``was stopped``, ``was killed by signal 9`` or ``ended with status 70``.
        """
        self.process.join(1.0 if dead else 0.0)  # [s] its pipes end a moment earlier
        status = self.process.exitcode
        self.process.kill()
        if status == SETTINGS.unknown:
            fork_server_died()
            if not dead and self.process.pid is not None:
                status = None
                with suppress(ProcessLookupError):
                    os.kill(self.process.pid, signal.SIGKILL)
        self.process.join()
        for lane in self.lanes:
            lane.close()
        if status is None:
            return "was stopped"
        if status == SETTINGS.out_of_memory:
            return "had not enough memory"
        if status == SETTINGS.unknown:
            return "ended, and so did the process that would know how"
        return f"was killed by signal {-status}" if status < 0 else f"ended with status {status}"


def resident(pid: int | None) -> int | None:
    """Return the resident memory of a process [bytes]; None if the system does not report it."""
    try:
        with open(f"/proc/{pid}/statm") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError, IndexError):
        return None


def send_part(part: object) -> None:
    """Send a part of the answer on which this thread of a worker is at work, before the answer.

    The process that asked gets parts by `PriorityLane.take`, as it gets answers, and must be able
    to distinguish them. In other threads and processes nothing is sent.
    """
    if (send := _sender.get()) is not None:
        send(part)


def _answer_each(
    pipes: list[Connection], memory: int | None, stays: bool, variables: dict[str, str]
) -> None:
    """Answer what comes through pipes until their other ends are gone: a process's whole run."""
    _begin_child(stays=stays)
    # a fork server has those with which it was started
    os.environ.clear()
    os.environ.update(variables)
    # [s], a tenth of Python's own: a short question would wait that long for a long one at
    # each of its steps
    sys.setswitchinterval(5e-4)
    try:
        make = pipes[0].recv()
    except (EOFError, OSError):
        return
    try:
        answer = make()
    except BaseException:
        traceback.print_exc()
        sys.exit(70)  # exit status of what cannot be made ready
    # what is loaded stays: to look through it for garbage takes a quarter of a second
    gc.freeze()
    _keep_to(memory)
    for pipe in pipes[1:]:
        threading.Thread(target=_lane, args=(answer, pipe), daemon=True).start()
    _lane(answer, pipes[0])
    os._exit(0)


def _lane(answer: Callable[[Any], Any], pipe: Connection) -> None:
    """Answer what comes through one pipe."""
    _sender.set(partial(_send_parts, pipe))
    with suppress(EOFError, OSError):
        _send_parts(pipe, None)
        while True:
            question = pipe.recv()
            try:
                result = answer(question)
                _send_parts(pipe, result)
            except MemoryError:
                # nothing here can be trusted to go on
                os._exit(SETTINGS.out_of_memory)
            del question, result


def _send_parts(pipe: Connection, result: object) -> None:
    """Send a result in parts that are there whole or not at all; the last is a shorter one."""
    whole = pickle.dumps(result, protocol=pickle.HIGHEST_PROTOCOL)
    for at in range(0, len(whole) + 1, SETTINGS.part_bytes):
        pipe.send_bytes(whole[at : at + SETTINGS.part_bytes])


def _keep_to(memory: int | None) -> None:
    """Let allocations fail that would take this process beyond its memory, where that exists."""
    if memory is None or sys.platform != "linux":
        return
    import resource

    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    resource.setrlimit(resource.RLIMIT_DATA, (memory, hard))


def _begin_child(*, stays: bool = False) -> None:
    """Leave Ctrl-C to the process that started this one, and end soon after that one does.

    Parameters
    ----------
    stays : bool, optional
        Whether SIGTERM is left to that one, too.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN if stays else signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SETTINGS.signals)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        time.sleep(1.0)  # [s] for what it is about to end by itself
        os._exit(1)
