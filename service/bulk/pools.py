"""Pools that answer chunks of requests: this process, processes of this machine, or Dask."""

from __future__ import annotations

import logging
import operator
import pickle
import signal
from collections import deque
from collections.abc import Callable, Hashable
from contextlib import ExitStack, nullcontext, suppress
from functools import partial
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, Final, Protocol, Self
from urllib.parse import urlsplit

from hand_models.base import CruxError, InvalidInputError, to_install
from planner import Lost, Workers, cores, starting_children
from service.bulk.chunks import BULK_SETTINGS, Setting, answer_chunk, own_versions
from service.wire import Answer

if TYPE_CHECKING:
    from distributed import Client, Future

__all__ = ["LOCAL_CLUSTER", "Here", "Pool", "check_address", "pool_on", "whole_number"]

log = logging.getLogger(__name__)

LOCAL_CLUSTER: Final = "dask:local"
"""Value of ``on`` for a temporary Dask cluster on this machine."""


class Pool(Protocol):
    """Protocol of a pool of workers that answer chunks of requests, while its context is entered.

    Attributes
    ----------
    width : int
        Number of chunks that are answered at the same time.
    """

    @property
    def width(self) -> int: ...

    def __enter__(self) -> Self: ...

    def __exit__(self, *error: object) -> None: ...

    def put(self, number: int, item: list[bytes], about: Hashable = None) -> None:
        """Queue a chunk for the workers; `collect` returns its answers.

        Parameters
        ----------
        number : int
            Number of the chunk, chosen by the caller.
        item : list of bytes
            Encoded requests.
        about : hashable, optional
            Digest of the chunk's rocks; a pool may prefer a worker that has had the same digest.
        """

    def collect(self) -> list[tuple[int, list[Answer] | Lost]]:
        """Wait until at least one chunk is answered or lost.

        Returns
        -------
        list of (int, list of Answer or Lost)
            Number of each finished chunk, with its answers in request order, or why it was lost.
        """


class Here:
    """Pool without workers: the calling process answers the chunks, one at a time.

    Parameters
    ----------
    setting : bytes
        A pickled `Setting`.
    """

    width = 1

    def __init__(self, setting: bytes) -> None:
        self._setting = setting
        self._queue: deque[tuple[int, list[bytes]]] = deque()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._queue.clear()

    def put(self, number: int, item: list[bytes], about: Hashable = None) -> None:
        """Queue a chunk, which `collect` answers; ``about`` is ignored."""
        self._queue.append((number, item))

    def collect(self) -> list[tuple[int, list[Answer] | Lost]]:
        """Answer the oldest queued chunk, and return its number and answers."""
        number, chunk = self._queue.popleft()
        return [(number, answer_chunk(self._setting, chunk))]


def _answering(setting: bytes) -> Callable[[list[bytes]], list[Answer]]:
    return partial(answer_chunk, setting)


def whole_number(workers: Any) -> int:
    """Check a number of processes, and return it as an int.

    Parameters
    ----------
    workers : object
        Number of processes.

    Raises
    ------
    InvalidInputError
        If the value is no whole number of at least 1.
    """
    try:
        count = 0 if isinstance(workers, bool) else operator.index(workers)
    except TypeError:
        count = 0
    if count < 1:
        raise InvalidInputError(
            f"must be a whole number of at least 1, got {workers!r}", field="workers"
        )
    return count


def pool_on(on: Any, workers: int | None, setting: Setting) -> Pool:
    """Return the pool of workers that a name or an address stands for.

    Parameters
    ----------
    on : str or distributed.Client
        ``processes``, ``here``, ``dask:local`` for a temporary cluster on this machine, the address
        of a Dask scheduler, or its client.
    workers : int or None
        Number of processes of this machine; None for one on each core.
    setting : Setting
        Settings that all requests share.

    Returns
    -------
    Pool
        Enter its context to start or connect the workers.

    Raises
    ------
    InvalidInputError
        If ``on`` is none of these, Dask is not installed, or ``workers`` is given with an address
        or a client.
    """
    if on == "here":
        return Here(pickle.dumps(setting))
    count = None if workers is None else whole_number(workers)
    if on == "processes":
        return Workers(partial(_answering, pickle.dumps(setting)), count or cores())
    # a worker may have other packages, and may have begun in another folder
    folder = None if setting.folder is None else setting.folder.absolute()
    there = setting._replace(versions=own_versions(), folder=folder)
    return DaskPool(on, count, pickle.dumps(there))


def check_address(address: object) -> None:
    """Raise an error for a text that is not the address of a Dask scheduler, ``tcp://HOST:PORT``.

    Raises
    ------
    InvalidInputError
        If the scheme of the address is unknown.
    """
    text = str(address)
    try:
        good = urlsplit(text).scheme in ("tcp", "tls", "ucx", "ws", "wss", "inproc")
    except ValueError:
        good = False
    if not good:
        raise InvalidInputError(
            f"{text!r} is unknown; valid are processes, here, {LOCAL_CLUSTER}, tcp://HOST:PORT of "
            "a Dask scheduler, or a client of a scheduler",
            field="on",
        )


class DaskPool:
    """Pool of Dask workers; the Dask scheduler balances the load over their threads.

    Parameters
    ----------
    on : str or distributed.Client
        `LOCAL_CLUSTER`, the address of a scheduler, or a client of one.
    workers : int or None
        Number of processes of a local cluster; None for one on each core.
    setting : bytes
        A pickled `Setting`, which workers unpickle once.

    Raises
    ------
    InvalidInputError
        If ``distributed`` is not installed, ``on`` is no address, or ``workers`` is given with an
        address.
    """

    def __init__(self, on: Any, workers: int | None, setting: bytes) -> None:
        try:
            import distributed
        except ImportError:
            raise InvalidInputError(
                f"needs distributed, which is not installed: {to_install('dask')}", field="dask"
            ) from None
        self._own = not isinstance(on, distributed.Client)
        if self._own and on != LOCAL_CLUSTER:
            check_address(on)
            if workers is not None:
                raise InvalidInputError(
                    "not available with a cluster, which has its own workers: leave workers out",
                    field="workers",
                )
        self._on, self._workers, self._setting = on, workers, setting
        self._stack = ExitStack()
        self._open: dict[int, Future[list[Answer]]] = {}
        self._alone = 0
        self._done: SimpleQueue[tuple[int, Future[list[Answer]]]] = SimpleQueue()

    def __enter__(self) -> Self:
        try:
            self._client: Client = self._stack.enter_context(self._connected())
            self._client.wait_for_workers(1, timeout=BULK_SETTINGS.scheduler_timeout)
        except BaseException as error:
            self._stack.close()
            if isinstance(error, OSError | TimeoutError):
                raise CruxError(
                    f"no Dask scheduler with a worker answers at {self._on} within "
                    f"{BULK_SETTINGS.scheduler_timeout:g} s; start them with: dask scheduler, dask "
                    "worker ADDRESS"
                ) from None
            raise
        self._address = self._client.scheduler.address
        return self

    def _connected(self) -> Any:
        from distributed import Client, LocalCluster

        if not self._own:
            return nullcontext(self._on)
        # what it loses is reported in the answers, or in one line
        for name in logging.root.manager.loggerDict:
            if name.split(".")[0] == "distributed":
                logging.getLogger(name).setLevel(logging.CRITICAL)
        where: Any = self._on
        if where == LOCAL_CLUSTER:
            # a shell sends Ctrl-C to all of them, and each worker would print its traceback
            with starting_children(signal.SIGINT):
                where = LocalCluster(
                    n_workers=cores() if self._workers is None else self._workers,
                    threads_per_worker=1,
                    dashboard_address="127.0.0.1:0",
                    silence_logs=logging.CRITICAL,
                )
            self._stack.enter_context(where)
        return Client(where, timeout=BULK_SETTINGS.scheduler_timeout, set_as_default=False)

    def __exit__(self, *error: object) -> None:
        if self._client.status == "running":
            self._client.cancel(list(self._open.values()), force=True)
        self._open.clear()
        self._stack.close()

    @property
    def width(self) -> int:
        """Number of threads of all workers now, at least 1; workers may join and leave."""
        try:
            threads: dict[str, int] = self._client.nthreads()
        except OSError:
            raise self._gone() from None
        return max(1, sum(threads.values()))

    def put(self, number: int, item: list[bytes], about: Hashable = None) -> None:
        """Submit a chunk to the Dask scheduler; ``about`` is ignored."""
        future = self._client.submit(answer_chunk, self._setting, item, pure=False)
        self._open[number] = future
        self._await(number, future)

    def _await(self, number: int, future: Future[list[Answer]]) -> None:
        future.add_done_callback(lambda done: self._done.put((number, done)))

    def collect(self) -> list[tuple[int, list[Answer] | Lost]]:
        """Wait until a chunk is answered or lost, and return its number and answers.

        Raises
        ------
        CruxError
            If the scheduler is gone, or a worker raised an error instead of answering.
        """
        while True:
            if self._client.status != "running":
                raise self._gone()
            try:
                number, future = self._done.get(timeout=BULK_SETTINGS.check_interval)
            except Empty:
                self._warn_if_alone()
                continue
            if number not in self._open:
                continue
            try:
                if future.status == "pending":
                    raise TimeoutError
                found = self._found(future)
            except TimeoutError:
                # its worker has left with the result: another works it out again
                self._await(number, future)
                continue
            except OSError:
                raise self._gone() from None
            del self._open[number]
            return [(number, found)]

    def _warn_if_alone(self) -> None:
        """Say once that there is no worker to wait for."""
        with suppress(OSError):
            self._alone = 0 if self._client.nthreads() else self._alone + 1
        # a warning after so many checks in a row, as workers come and go
        if self._alone == 5:
            log.warning(
                "the Dask scheduler at %s has no worker left: waiting for one; start it with: dask "
                "worker %s, or break off with Ctrl-C, and go on later with --resume",
                self._address,
                self._address,
            )

    def _gone(self) -> CruxError:
        return CruxError(f"the Dask scheduler at {self._address} is gone")

    def _found(self, future: Future[list[Answer]]) -> list[Answer] | Lost:
        from distributed import KilledWorker

        if future.status == "finished":
            answers: list[Answer] = future.result(timeout=BULK_SETTINGS.scheduler_timeout)
            return answers
        if future.cancelled():
            raise self._gone()
        error = future.exception(timeout=BULK_SETTINGS.scheduler_timeout)
        if isinstance(error, KilledWorker):
            # distributed.scheduler.allowed-failures is 3 by default
            return Lost("4 Dask workers died of it")
        if isinstance(error, MemoryError):
            return Lost("a Dask worker had no memory for it")
        if isinstance(error, CruxError):
            raise error
        raise CruxError(
            f"a Dask worker cannot answer ({type(error).__name__}: {error}); it needs the same "
            "crux, Python and packages as this process"
        )
