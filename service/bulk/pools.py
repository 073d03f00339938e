"""Where chunks are answered: here, in processes of this machine, or on Dask."""

from __future__ import annotations

import os
import pickle
from collections import deque
from collections.abc import Callable, Hashable
from functools import partial
from typing import Any, Final, Protocol, Self

from hand_models.base import InvalidInputError
from planner import Lost, Workers, cores
from service.bulk.chunks import Setting, answer_chunk

__all__ = ["Here", "Pool", "Processes", "pool_on"]

LARGEST: Final = 64
"""Most questions in a chunk: what is tried again where its process has died."""


class Pool(Protocol):
    """Takes chunks and gives their answers back, while it is entered.

    Attributes
    ----------
    width : int
        Chunks that are worked on at a time.
    largest : int
        Most questions that a chunk may have.
    deaths : int
        Processes that have died of a chunk that is lost.
    """

    largest: int
    deaths: int

    @property
    def width(self) -> int: ...

    def __enter__(self) -> Self: ...

    def __exit__(self, *error: object) -> None: ...

    def put(self, number: int, chunk: bytes, about: Hashable = None) -> None:
        """Let a chunk be answered; those about the same are best answered in one process."""

    def collect(self) -> list[tuple[int, bytes | Lost]]:
        """Wait until some chunks are answered, and return their numbers and answers."""


class Here:
    """The calling process itself; it answers one question at a time."""

    width = largest = deaths = 1

    def __init__(self, setting: Setting) -> None:
        self._setting = pickle.dumps(setting)
        self._line: deque[tuple[int, bytes]] = deque()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._line.clear()

    def put(self, number: int, chunk: bytes, about: Hashable = None) -> None:
        """Keep a chunk until answers are collected."""
        self._line.append((number, chunk))

    def collect(self) -> list[tuple[int, bytes | Lost]]:
        """Answer a chunk."""
        number, chunk = self._line.popleft()
        return [(number, answer_chunk(self._setting, chunk))]


class Processes(Workers[bytes, bytes]):
    """Processes of this machine; this one only hands out.

    Parameters
    ----------
    setting : Setting
    count : int
    """

    largest = LARGEST
    deaths = 1

    def __init__(self, setting: Setting, count: int) -> None:
        super().__init__(partial(_answering, pickle.dumps(setting)), count)
        self.width = count


def _answering(setting: bytes) -> Callable[[bytes], bytes]:
    return partial(answer_chunk, setting)


def pool_on(on: Any, workers: int | None, setting: Setting) -> Pool:
    """Return where chunks are answered.

    Parameters
    ----------
    on : str or Client
        ``processes``, ``here``, ``dask:local`` for a cluster of this machine's own, the address of
        a Dask scheduler, or a `distributed.Client`.
    workers : int or None
        Processes of this machine; by default one a core.
    setting : Setting

    Raises
    ------
    InvalidInputError
        If ``on`` is nothing of that kind, or ``workers`` is given for a cluster that has its own.
    """
    if on == "here":
        return Here(setting)
    if workers is not None and (isinstance(workers, bool) or workers < 1):
        raise InvalidInputError(
            f"must be a whole number of at least 1, got {workers!r}", field="workers"
        )
    if on == "processes":
        return Processes(setting, cores() if workers is None else workers)
    from service.bulk.dask_pools import DaskPool

    if setting.folder is not None:
        # which a worker may begin elsewhere
        setting = setting._replace(folder=type(setting.folder)(os.path.abspath(setting.folder)))
    return DaskPool(on, workers, pickle.dumps(setting))
