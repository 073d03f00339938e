"""A command that plans many requests from a file, one a line."""

from __future__ import annotations

import contextlib
import statistics
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from time import perf_counter
from typing import IO, TYPE_CHECKING, Final

import click
import msgspec

from hand_models.base import InvalidInputError
from hand_models.parameters import ParameterTable
from service.commands.options import hand_option, json_option, robot_option
from service.commands.terminal import (
    BAD_INPUT,
    DONE,
    EXIT_STATUS,
    FAILED,
    OVERLOADED,
    note,
    progress,
    say,
)
from service.processes import Answered, Planners, worth
from service.replies import ErrorDetail, Time
from service.tables import console, table_of
from service.wire import REQUEST_KINDS

if TYPE_CHECKING:
    from planner.robots import RobotFile

__all__ = ["batch"]

WORST_FIRST: Final = (FAILED, BAD_INPUT, OVERLOADED, DONE)
"""Exit statuses: that of a batch is the worst of its requests'."""


class _Told(msgspec.Struct):
    """What the summary needs to know of an answer."""

    status: str | None = None
    time: Time | None = None
    error: ErrorDetail | None = None

    @property
    def exit_status(self) -> int:
        """As that of the request alone would be."""
        if self.error is not None:
            return BAD_INPUT if self.error.kind in REQUEST_KINDS else FAILED
        return EXIT_STATUS.get(str(self.status), FAILED)


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
    "--workers", type=click.IntRange(min=1), help="Processes; by default as many as are worth it."
)
@hand_option
@robot_option
@json_option
def batch(
    requests: str,
    file: Path | None,
    workers: int | None,
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
    numbers, lines = _lines(requests)
    folder = Path() if requests == "-" else Path(requests).parent
    told: list[_Told] = []
    begun = perf_counter()
    with (
        _written(file, as_json) as out,
        Planners(worth(len(lines), workers), robot=robot, hand=hand, folder=folder) as many,
        progress(f"planning {requests}") as tell,
    ):
        for answer in _in_order(many.answers(lines)):
            if out is not None:
                out.write(answer.payload + b"\n")
            told.append(msgspec.json.decode(answer.payload, type=_Told))
            tell(len(told), len(lines))
    elapsed = perf_counter() - begun
    _complain(numbers, told)
    if not as_json:
        _print(told, elapsed, file)
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


@contextlib.contextmanager
def _written(file: Path | None, as_json: bool) -> Iterator[IO[bytes] | None]:
    """Yield where replies are written: a file, standard output, or nowhere."""
    if file is None:
        yield sys.stdout.buffer if as_json else None
        return
    try:
        with file.open("wb") as out:
            yield out
    except OSError as error:
        raise InvalidInputError(f"cannot write {file}: {error.strerror}", field="-o") from None


def _in_order(answers: Iterator[tuple[int, Answered]]) -> Iterator[Answered]:
    """Yield answers in the order of their requests, each as soon as those before it are there."""
    early: dict[int, Answered] = {}
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


def _print(told: Sequence[_Told], elapsed: float, file: Path | None) -> None:
    out = console()
    statuses, kinds = _counts(told)
    table = table_of("answer")
    for name in ("requests", "median ms", "longest ms"):
        table.add_column(name, justify="right")
    for status in (*EXIT_STATUS, "failed"):
        times = [1e3 * one.time.total for one in told if one.status == status and one.time]
        shown = [f"{statistics.median(times):.1f}", f"{max(times):.1f}"] if times else ["-", "-"]
        table.add_row(status, str(statuses[status]), *shown)
    for kind, count in sorted(kinds.items()):
        table.add_row(f"error: {kind}", str(count), "-", "-")
    out.print(table)
    rate = len(told) / elapsed if elapsed > 0.0 else 0.0
    out.print(f"{len(told)} requests in {elapsed:.1f} s, {rate:.0f} a second", markup=False)
    if file is not None:
        out.print(f"replies: {file}", markup=False, soft_wrap=True)
