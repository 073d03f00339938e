"""A command that plans many requests from a file, one a line."""

from __future__ import annotations

import os
import statistics
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Final

import click
import msgspec

from hand_models.base import CruxError, InvalidInputError
from hand_models.parameters import ParameterTable
from planner.result import Time
from service.commands.interruption import Interrupted
from service.commands.options import explain_option, hand_option, json_option, robot_option
from service.commands.terminal import (
    BAD_INPUT,
    DONE,
    EXIT_STATUS,
    FAILED,
    OVERLOADED,
    note,
    progress,
    say,
    writing,
)
from service.processes import Planners, worth
from service.replies import ErrorDetail
from service.requests import PlanRequest
from service.tables import console, table_of
from service.wire import REQUEST_KINDS, Answer, Format, decode_request, identifier

if TYPE_CHECKING:
    from planner.robots import RobotFile

__all__ = ["batch"]

WORST_FIRST: Final = (FAILED, BAD_INPUT, OVERLOADED, DONE)
"""Exit statuses: that of a batch is the worst of its requests'."""


REPLY: Final = b'{"v":1,'
"""How each line of a batch begins."""


class _Told(msgspec.Struct):
    """What the summary needs to know of an answer."""

    id: str | None = None
    status: str | None = None
    time: Time | None = None
    error: ErrorDetail | None = None

    @property
    def exit_status(self) -> int:
        """As that of the request alone would be."""
        if self.error is not None:
            return BAD_INPUT if self.error.kind in REQUEST_KINDS else FAILED
        return EXIT_STATUS.get(str(self.status), FAILED)


@contextmanager
def _writing_replies(
    file: Path | None, as_json: bool, resume: bool
) -> Iterator[Callable[[bytes], None]]:
    """Yield what writes a reply, one a line: to a file, standard output, or nowhere.

    A file has whole lines at any time but while one of them is being written.
    """

    def say_line(payload: bytes) -> None:
        if as_json:
            sys.stdout.buffer.write(payload + b"\n")
            sys.stdout.buffer.flush()

    if file is None:
        yield say_line
        return
    with writing(file, "-o"):
        out = file.open("ab" if resume else "wb", buffering=0)

    def write(payload: bytes) -> None:
        line, written = payload + b"\n", 0
        try:
            with writing(file, "-o"):
                while written < len(line):
                    written += out.write(line[written:])
        except BaseException:
            # a line that is cut off would be read by nobody
            with suppress(OSError):
                out.truncate(file.stat().st_size - written)
            raise

    with out:
        yield write


@click.command()
@click.argument("requests")
@click.option(
    "-o",
    "--output",
    "file",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Where the replies go, one a line.",
)
@click.option(
    "--resume",
    is_flag=True,
    help="Go on where a batch that was broken off ended: what FILE answers is not asked again.",
)
@click.option(
    "--workers", type=click.IntRange(min=1), help="Processes; by default as many as are worth it."
)
@explain_option
@hand_option
@robot_option
@json_option
def batch(
    requests: str,
    file: Path | None,
    resume: bool,
    workers: int | None,
    unexplained: bool,
    hand: ParameterTable | None,
    robot: RobotFile | None,
    as_json: bool,
) -> int:
    """Answer many plan requests: one a line in, one reply or error a line out, in order.

    REQUESTS is the path of a file of JSON lines, or - for standard input; blank lines are skipped.
    Lines are as the service takes them: extras are those that a request wants itself, and the
    numbers of --hand are those that it leaves open. Only meshes may be in files, relative to that
    of the lines; one that many lines name is read once. With --json the replies are
    written on standard output, or with -o a summary is.

    Exit status: the worst of what the requests alone would have: 1 where one failed or was lost, or
    else 2 where one is bad input, or else 3 where one is overloaded or infeasible.
    """
    if resume and file is None:
        raise InvalidInputError("needs the FILE of -o that it is to go on with", field="--resume")
    if file is not None:
        _check_output(file, requests, resume)
    numbers, lines = _lines(requests)
    folder = Path() if requests == "-" else Path(requests).parent
    if unexplained:
        lines = [_unexplained(line) for line in lines]
    told = _answered(file, lines) if resume and file is not None else []
    before, begun = len(told), perf_counter()
    try:
        with (
            _writing_replies(file, as_json, resume) as write,
            Planners(
                worth(len(lines) - before, workers), robot=robot, hand=hand, folder=folder
            ) as many,
            progress(f"planning {requests}") as tell,
        ):
            tell(before, len(lines))
            for answer in _in_order(many.answers(lines[before:])):
                write(answer.payload)
                told.append(msgspec.json.decode(answer.payload, type=_Told))
                tell(len(told), len(lines))
    except Interrupted:
        raise Interrupted(_kept(told, lines, file)) from None
    except InvalidInputError:
        raise
    except CruxError as error:
        raise CruxError(f"{error.message}; {_kept(told, lines, file)}") from None
    elapsed = perf_counter() - begun
    _complain(numbers, told)
    if not as_json:
        _print(told, before, elapsed, file)
    elif file is not None:
        say(_summary(told, elapsed) | {"file": str(file)})
    return min((one.exit_status for one in told), key=WORST_FIRST.index, default=DONE)


def _lines(source: str) -> tuple[list[int], list[bytes]]:
    """Return the lines of a file, or of standard input, that are not blank, and their numbers."""
    try:
        data = sys.stdin.buffer.read() if source == "-" else Path(source).read_bytes()
    except OSError as error:
        raise InvalidInputError(f"{error.strerror}: {source}", field="REQUESTS") from None
    kept = [(i, line) for i, line in enumerate(data.split(b"\n"), start=1) if line.strip()]
    return [i for i, _ in kept], [line for _, line in kept]


def _unexplained(line: bytes) -> bytes:
    """Return a request that is not to be explained; one that is none stays as it is."""
    try:
        request = decode_request(line, PlanRequest, Format.JSON)
    except CruxError:
        return line
    return Format.JSON.encode(msgspec.structs.replace(request, explain=False))


def _check_output(file: Path, requests: str, resume: bool) -> None:
    """Refuse a file for replies that is the requests' own, or that nothing can be resumed in."""
    try:
        if resume and file.exists() and not file.is_file():
            raise InvalidInputError(f"{file}: no file that a batch has written", field="--resume")
        given = os.fstat(sys.stdin.fileno()) if requests == "-" else os.stat(requests)
        if file.is_file() and os.path.samestat(file.stat(), given):
            raise InvalidInputError(f"{file}: the requests are there", field="-o")
    except OSError:
        # reading or writing tells
        return


def _answered(file: Path, lines: Sequence[bytes]) -> list[_Told]:
    """Return what the whole lines of a file tell, and drop a last one that is cut off."""
    with writing(file, "-o"):
        data = file.read_bytes() if file.exists() else b""
    whole = data.rfind(b"\n") + 1
    replies = data[:whole].split(b"\n")[:-1]
    if len(replies) > len(lines):
        raise InvalidInputError(
            f"{file} has {len(replies)} replies, and there are {len(lines)} requests; "
            "is it of another batch?",
            field="--resume",
        )
    told = []
    for number, (reply, line) in enumerate(zip(replies, lines, strict=False), start=1):
        try:
            one = msgspec.json.decode(reply, type=_Told)
        except (msgspec.DecodeError, UnicodeDecodeError):
            raise InvalidInputError(f"{file}, line {number}: no reply", field="--resume") from None
        asked = identifier(line, Format.JSON)
        if one.id != asked:
            raise InvalidInputError(
                f"{file}, line {number}: answers {one.id!r}, and the request is {asked!r}; "
                "is it of another batch?",
                field="--resume",
            )
        if one.status is None and one.error is None:
            raise InvalidInputError(f"{file}, line {number}: no reply", field="--resume")
        told.append(one)
    if whole < len(data):
        if not data[whole:].startswith(REPLY[: len(data) - whole]):
            raise InvalidInputError(f"{file}: its end is of no reply", field="--resume")
        with writing(file, "-o"), file.open("r+b") as stream:
            stream.truncate(whole)
    return told


def _kept(told: Sequence[_Told], lines: Sequence[bytes], file: Path | None) -> str:
    """Say how much of a batch that is broken off is done."""
    done = f"{len(told)} of {len(lines)} requests are answered"
    return done if file is None else f"{done} in {file}; --resume goes on"


def _in_order(answers: Iterator[tuple[int, Answer]]) -> Iterator[Answer]:
    """Yield answers in the order of their requests, each as soon as those before it are there."""
    early: dict[int, Answer] = {}
    following = 0
    for i, answer in answers:
        early[i] = answer
        while following in early:
            yield early.pop(following)
            following += 1


def _complain(numbers: Sequence[int], told: Sequence[_Told]) -> None:
    """Name the first line that is bad input, and how many more are."""
    bad = [
        (number, one.error)
        for number, one in zip(numbers, told, strict=True)
        if one.error is not None and one.exit_status == BAD_INPUT
    ]
    if bad:
        number, error = bad[0]
        field = "" if error.field is None else f"{error.field}: "
        more = f"; {len(bad) - 1} more lines are bad input" if len(bad) > 1 else ""
        note(f"line {number}: {field}{error.message}{more}")


def _counts(told: Sequence[_Told]) -> tuple[Counter[str], Counter[str]]:
    """Return how many answers are of each status, and how many errors of each kind."""
    statuses = Counter(one.status for one in told if one.status is not None)
    kinds = Counter(one.error.kind for one in told if one.error is not None)
    return statuses, kinds


def _summary(told: Sequence[_Told], elapsed: float) -> dict[str, object]:
    statuses, kinds = _counts(told)
    times = [one.time.total for one in told if one.time is not None]
    return {
        "v": 1,
        "requests": len(told),
        **{status: statuses[status] for status in (*EXIT_STATUS, "failed")},
        "errors": dict(kinds),
        "time": {
            "median": statistics.median(times) if times else None,
            "longest": max(times, default=None),
            "elapsed": elapsed,
        },
    }


def _print(told: Sequence[_Told], before: int, elapsed: float, file: Path | None) -> None:
    out = console()
    statuses, kinds = _counts(told)
    table = table_of("answer", numbers=("requests", "median ms", "longest ms"))
    for status in (*EXIT_STATUS, "failed"):
        times = [1e3 * one.time.total for one in told if one.status == status and one.time]
        shown = [f"{statistics.median(times):.1f}", f"{max(times):.1f}"] if times else ["-", "-"]
        table.add_row(status, str(statuses[status]), *shown)
    for kind, count in sorted(kinds.items()):
        table.add_row(f"error: {kind}", str(count), "-", "-")
    out.print(table)
    done = len(told) - before
    rate = done / elapsed if elapsed > 0.0 else 0.0
    known = f", {before} were answered before" if before else ""
    out.print(f"{done} requests in {elapsed:.1f} s, {rate:.0f} a second{known}", markup=False)
    if file is not None:
        out.print(f"replies: {file}", markup=False, soft_wrap=True)
