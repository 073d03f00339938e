"""Make walls to climb with the chunks of their work spread over parallel workers."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from planner import BodyPoses, MadeWall, WallProgress, WallSource, wall_of
from service.bulk import Setting, answered, pool_on
from service.processes.finished_chunks import FinishedChunks
from service.wire import Answer, Format

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["make_wall"]


def make_wall(
    source: WallSource,
    on: str | Client = "processes",
    *,
    workers: int | None = None,
    kept: Path | None = None,
    report: WallProgress | None = None,
) -> MadeWall:
    """Make a wall from its source, the placements and their reach on parallel workers.

    The wall is the same to the last digit wherever it is made. When a worker dies, it is replaced
    and its chunk tried again; what is lost after that is counted.

    Parameters
    ----------
    source : WallSource
    on : str or distributed.Client, optional
        Where chunks are answered: ``processes`` of this machine, ``here`` in this process,
        ``tcp://HOST:PORT`` of a Dask scheduler or its client, ``dask:local`` for a Dask cluster on
        this machine.
    workers : int, optional
        Number of worker processes of this machine; by default the number of cores.
    kept : Path, optional
        File of finished chunks: what it has is not worked out again, and what is finished is added
        at once. A file that does not exist is begun.
    report : callable, optional
        Called with the phase, ``placements`` or ``reach``, the number of finished chunks, and that
        of all.

    Raises
    ------
    InvalidInputError
        If ``on``, ``workers`` or ``kept`` is impossible, no hand holds anything on the rock, or no
        pose of the body is clear of it.
    CruxError
        If no process can be started, or the cluster is gone; ``kept`` has what was finished.
    """
    finished = FinishedChunks(kept, source.digest)
    bodies = source.poses()
    setting = Setting(make=partial(_answering, source, bodies))
    with finished.open(), pool_on(on, workers, setting) as pool:

        def ask(questions: Sequence[bytes]) -> Generator[bytes | None, None, None]:
            known = [finished.find(each) for each in questions]
            new = [each for each, answer in zip(questions, known, strict=True) if answer is None]
            with closing(answered(new, pool, Format.MSGPACK)) as answers:
                for question, answer in zip(questions, known, strict=True):
                    if answer is None:
                        found = next(answers)
                        answer = found.payload if found.good else None
                        if answer is not None:
                            finished.add(question, answer)
                    yield answer

        return wall_of(source, bodies, ask, report)


def _answering(source: WallSource, bodies: BodyPoses) -> Callable[[bytes], Answer]:
    """Return the function that answers a chunk's question; called once in each process."""

    def answer(question: bytes) -> Answer:
        start = time.perf_counter()
        found = source.answer(question, bodies)
        return Answer(found, "application/octet-stream", seconds=time.perf_counter() - start)

    return answer
