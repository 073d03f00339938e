"""Answer any number of requests in order: dispatch chunks to workers, and retry lost ones."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from hand_models.parameters import ParameterTable
from planner import Lost
from service.bulk.chunks import BULK_SETTINGS, Setting, about, grouping_order
from service.bulk.pools import Here, Pool, pool_on
from service.requests import ClimbRequest, PlanRequest, RouteRequest
from service.wire import (
    Answer,
    Format,
    LostError,
    MalformedError,
    ServiceName,
    encode_error,
    identifier,
)

if TYPE_CHECKING:
    from distributed import Client

    from planner import RobotFile

__all__ = ["Question", "answer_all", "answered"]

Question = bytes | PlanRequest | RouteRequest | ClimbRequest | Answer


def answer_all(
    questions: Iterable[Question],
    on: str | Client = "processes",
    *,
    workers: int | None = None,
    hand: ParameterTable | None = None,
    robot: RobotFile | None = None,
    folder: Path | None = None,
    form: Format = Format.JSON,
    explain: bool | None = None,
    brief: bool = False,
    kind: str = ServiceName.PLAN,
) -> Generator[Answer, None, None]:
    """Answer any number of requests of one kind; yield answers and errors in request order.

    Requests are read as they are needed; only a bounded number of chunks is in work at a time. When
    a worker dies, it is replaced and its chunk is retried once. If the chunk is lost again, its
    requests are retried one by one; a request that is lost twice on its own gets an error of kind
    ``lost``. Close the generator to cancel the work.

    Parameters
    ----------
    questions : iterable of bytes, PlanRequest, RouteRequest, ClimbRequest or Answer
        Bytes are encoded requests. An `Answer` is returned in its place, unchanged.
    on : str or distributed.Client, optional
        Where the requests are answered: ``processes`` of this machine, ``here`` in this process,
        ``tcp://HOST:PORT`` of a Dask scheduler or its client, or ``dask:local`` for a temporary
        Dask cluster on this machine.
    workers : int, optional
        Number of processes of this machine; by default one for each core.
    hand : ParameterTable, optional
        Hand parameters that differ from the bundled hand; values that a request gives replace
        these.
    robot : RobotFile, optional
        The only robot that is planned for; by default the bundled robots.
    folder : Path, optional
        Folder that relative names of mesh files start from; by default requests may not name files.
    form : Format, optional
        Encoding of requests and answers.
    explain : bool, optional
        Whether infeasible stances are explained (irreducible infeasible subset); by default as each
        request says.
    brief : bool, optional
        True to return only the values of a table: of the extras that requests want only the load
        factor, and hands in brief unless they are explained.
    kind : str, optional
        Type of all requests: ``plan``, ``route`` or ``climb``.

    Yields
    ------
    Answer
        Encoded reply or error reply of each request. All kinds of workers return the same bytes,
        except for ``time``, ``seconds`` and results that a deadline, or the time of a search, has
        cut.

    Raises
    ------
    InvalidInputError
        If ``on`` or ``workers`` is impossible, or Dask is not installed.
    CruxError
        If no process can be started, or the cluster is gone. Requests without an answer can then be
        asked again.
    """
    setting = Setting(robot, hand, folder, form, explain, brief, kind=kind)
    with pool_on(on, workers, setting) as pool:
        yield from answered(questions, pool, form)


class _Chunk(NamedTuple):
    """Questions with their places."""

    places: list[int]
    payloads: list[bytes]

    @property
    def size(self) -> int:
        """Bytes of its questions."""
        return sum(map(len, self.payloads))


def answered(
    questions: Iterable[Question],
    pool: Pool,
    form: Format = Format.JSON,
) -> Generator[Answer, None, None]:
    """Answer requests with a pool of workers; yield the answers in the order of the requests.

    Parameters
    ----------
    questions : iterable of bytes, PlanRequest, RouteRequest, ClimbRequest or Answer
        Encoded or decoded requests; an `Answer` is returned in its place, unchanged.
    pool : Pool
        Pool of workers whose context has been entered.
    form : Format, optional
        Encoding of requests and answers.

    Yields
    ------
    Answer
        Encoded reply or error reply of each request.

    Raises
    ------
    CruxError
        If no process can be started, or the cluster is gone.
    """
    work = _Work(enumerate(questions), pool, form)
    following = 0
    while True:
        work.take_more(following)
        while following in work.early:
            yield work.early.pop(following)
            following += 1
        if not work.chunks:
            if work.ended:
                return
            continue
        work.collect()


class _Work:
    """Questions that are out, and answers that are due later.

    Attributes
    ----------
    ended : bool
        Whether there are no more questions.
    early : dict of int to Answer
        By the places of their questions.
    chunks : dict of int to _Chunk
        Those that are out, by number.
    """

    def __init__(
        self,
        source: Iterator[tuple[int, Question]],
        pool: Pool,
        form: Format,
    ) -> None:
        self._source, self._pool, self._form = source, pool, form
        self.ended = False
        self.early: dict[int, Answer] = {}
        self.chunks: dict[int, _Chunk] = {}
        self._asked = self._put = self._bytes = 0
        self._largest = 1 if isinstance(pool, Here) else BULK_SETTINGS.most_questions
        self._together = 1
        """Questions in a chunk."""

    def take_more(self, following: int) -> None:
        """Dispatch chunks of new requests, up to a bounded number beyond the next answer."""
        width = self._pool.width
        count = self._together * width * BULK_SETTINGS.window
        most, ahead = width * BULK_SETTINGS.most_bytes, BULK_SETTINGS.windows_ahead - 1
        while (
            not self.ended
            and self._asked - following <= ahead * count
            and self._bytes <= ahead * most
        ):
            self._give_all(self._window(count, most))

    def collect(self) -> None:
        """Wait for answers; dispatch the requests of a lost chunk again, one by one."""
        for number, result in self._pool.collect():
            chunk = self.chunks.pop(number)
            self._bytes -= chunk.size
            if not isinstance(result, Lost):
                self._learn(result)
                self.early.update(zip(chunk.places, result, strict=True))
            elif len(chunk.places) > 1:
                for place, payload in zip(*chunk, strict=True):
                    self._give(_Chunk([place], [payload]))
            else:
                (place,), (payload,) = chunk
                name = identifier(payload, self._form)
                self.early[place] = encode_error(LostError(result.reason), self._form, name)

    def _window(self, count: int, most: int) -> list[tuple[int, bytes]]:
        """Take new questions, no more than so many or so many bytes."""
        found: list[tuple[int, bytes]] = []
        size = taken = 0
        while taken < count and size < most:
            following = next(self._source, None)
            if following is None:
                self.ended = True
                break
            i, question = following
            self._asked, taken = i + 1, taken + 1
            payload = _encoded(question, self._form)
            if isinstance(payload, Answer):
                self.early[i] = payload
            else:
                found.append((i, payload))
                size += len(payload)
        return found

    def _give_all(self, window: list[tuple[int, bytes]]) -> None:
        """Give out chunks of questions about the same, as far as may be."""
        abouts = [about(payload, self._form) for _, payload in window]
        chunk, size, rock = _Chunk([], []), 0, b""
        for k in grouping_order(abouts):
            place, payload = window[k]
            size += len(payload)
            full = len(chunk.places) == self._together or size > BULK_SETTINGS.most_bytes
            if chunk.places and full:
                self._give(chunk, rock)
                chunk, size = _Chunk([], []), len(payload)
            chunk.places.append(place)
            chunk.payloads.append(payload)
            rock = abouts[k].rock
        if chunk.places:
            self._give(chunk, rock)

    def _give(self, chunk: _Chunk, rock: bytes = b"") -> None:
        self.chunks[self._put] = chunk
        self._bytes += chunk.size
        self._pool.put(self._put, chunk.payloads, rock or None)
        self._put += 1

    def _learn(self, answers: list[Answer]) -> None:
        """Let chunks be as large as is worth it, at most twice as large as before."""
        each = sum(answer.seconds for answer in answers) / len(answers)
        # [s] long against the cost of sending a chunk, short against any wait
        duration = 0.5
        best = int(duration / max(each, 1e-6))
        self._together = max(1, min(best, 2 * self._together, self._largest))


def _encoded(question: Question, form: Format) -> bytes | Answer:
    """Return a question's bytes, or its answer where that is known: the error of what is none."""
    if isinstance(question, bytes | Answer):
        return question
    try:
        return form.encode(question)
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        name: Any = getattr(question, "id", None)
        known = name if isinstance(name, str) else None
        return encode_error(
            MalformedError(f"not a request, or the bytes of one: {error}"),
            form,
            known,
        )
