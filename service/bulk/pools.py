"""Where chunks are answered: here, in processes of this machine, or on Dask."""

from __future__ import annotations

import operator
import pickle
from collections import deque
from collections.abc import Callable, Hashable
from functools import partial
from typing import Any, Final, Protocol, Self

from hand_models.base import InvalidInputError
from planner import Lost, Workers, cores
from service.bulk.chunks import Setting, answer_chunk, own_versions
from service.wire import Answer

__all__ = ["LARGEST", "Here", "Pool", "pool_on", "whole_number"]

LARGEST: Final = 64
"""Most questions in a chunk: what is tried again where its process has died."""


class Pool(Protocol):
    """Takes chunks and gives their answers back, while it is entered.

    Attributes
    ----------
    width : int
        Chunks that are worked on at a time.
    """

    @property
    def width(self) -> int: ...

    def __enter__(self) -> Self: ...

    def __exit__(self, *error: object) -> None: ...

    def put(self, number: int, item: list[bytes], about: Hashable = None) -> None:
        """Let a chunk be answered; those about the same are best answered in one process."""

    def collect(self) -> list[tuple[int, list[Answer] | Lost]]:
        """Wait until some chunks are answered, and return their numbers and answers."""


class Here:
    """The calling process itself; it answers one question at a time."""

    width = 1

    def __init__(self, setting: bytes) -> None:
        self._setting = setting
        self._queue: deque[tuple[int, list[bytes]]] = deque()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._queue.clear()

    def put(self, number: int, item: list[bytes], about: Hashable = None) -> None:
        """Keep a chunk until answers are collected."""
        self._queue.append((number, item))

    def collect(self) -> list[tuple[int, list[Answer] | Lost]]:
        """Answer a chunk."""
        number, chunk = self._queue.popleft()
        return [(number, answer_chunk(self._setting, chunk))]


def _answering(setting: bytes) -> Callable[[list[bytes]], list[Answer]]:
    return partial(answer_chunk, setting)


def whole_number(workers: Any) -> int:
    """Return a number of processes, checked.

    Raises
    ------
    InvalidInputError
        If it is no whole number of at least 1.
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
        return Here(pickle.dumps(setting))
    count = None if workers is None else whole_number(workers)
    if on == "processes":
        return Workers(partial(_answering, pickle.dumps(setting)), count or cores())
    from service.bulk.dask_pools import DaskPool

    # a worker may have other packages, and may have begun in another folder
    folder = None if setting.folder is None else setting.folder.absolute()
    there = setting._replace(versions=own_versions(), folder=folder)
    return DaskPool(on, count, pickle.dumps(there))
