"""A command that evaluates climbs: one with its report, or many as rows or replies."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import islice
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, Final

import click
import msgspec

from hand_models.base import CruxError, InvalidInputError
from service.commands.batch import answer_rest, complain, exit_status, place, writing_answers
from service.commands.options import (
    asked,
    dask_option,
    draws_option,
    explain_option,
    hand_option,
    json_option,
    robot_option,
    routes_argument,
    spread_option,
    workers_option,
)
from service.commands.stances import read_route
from service.tables import (
    EXIT_STATUS,
    FAILED,
    OVERLOADED,
    filling_folder,
    progress,
    say,
    verbosity,
    write_alone,
)
from service.wire import ROUTE, Answer, Format, encode_error

if TYPE_CHECKING:
    from rich.console import Console

    from hand_models.parameters import ParameterTable
    from planner import RobotFile
    from service.bulk import Run
    from service.requests import Draw, RouteRequest

__all__ = ["route"]

LINES, CSV, PARQUET = ENDINGS = (".jsonl", ".csv", ".parquet")
LISTED: Final = " or ".join(ENDINGS)

STATUSES: Final = EXIT_STATUS | {"unreachable": OVERLOADED}

PLANS: Final = 50
"""As which a route counts where it is asked whether processes are worth it."""

LONGEST: Final = 256
"""Of an ``id``."""

SHOWN: Final = 100
"""Routes that a person is shown."""


@click.command()
@routes_argument
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    required=True,
    metavar="DIR",
    help="Where the table, the picture and the summary of one route go; or of any number of routes "
    f"a file that ends in {LISTED}: the replies, one a line, or a table.",
)
@click.option(
    "--resume",
    is_flag=True,
    help="Go on where many routes were broken off: what the file answers is not asked again.",
)
@workers_option
@dask_option
@spread_option
@draws_option
@explain_option
@hand_option
@robot_option
@json_option
def route(
    routes: tuple[str, ...],
    output: Path,
    resume: bool,
    workers: int | None,
    dask: str | None,
    spread: bool,
    draws: list[Draw] | None,
    unexplained: bool,
    hand: ParameterTable | None,
    robot: RobotFile | None,
    as_json: bool,
) -> int:
    """Evaluate climbs: every stance, and every one with a limb in the air.

    ROUTE is the path of a JSON file, - for standard input, the name of a bundled route, or a
    folder: all files in it that end in .json. Many routes are answered in order, errors in their
    places.

    Exit status of many: the worst of theirs, as of crux batch.
    """
    if output.suffix.lower() in ENDINGS:
        for option, asked_for in (("--spread", spread), ("--draws", draws is not None)):
            if asked_for:
                raise InvalidInputError("is told of one route: needs -o DIR", field=option)
        return _many(routes, output, resume, workers, dask, unexplained, hand, robot, as_json)
    if len(routes) > 1 or Path(routes[0]).is_dir():
        raise InvalidInputError(
            f"{output}: many routes need a file that ends in {LISTED}", field="-o"
        )
    for option, given in (("--resume", resume), ("--dask", dask is not None)):
        if given:
            raise InvalidInputError(f"needs -o FILE that ends in {LISTED}", field=option)
    if output.exists() and not output.is_dir():
        raise InvalidInputError(f"{output}: is no folder", field="-o")
    spread = spread or draws is not None
    return _one(routes[0], output, workers, spread, draws, unexplained, hand, robot, as_json)


def _one(
    source: str,
    folder: Path,
    workers: int | None,
    spread: bool,
    draws: list[Draw] | None,
    unexplained: bool,
    hand: ParameterTable | None,
    robot: RobotFile | None,
    as_json: bool,
) -> int:
    """Evaluate a route in all detail."""
    from planner import evaluate, summary, write_report
    from service import answering
    from service.answering import robots_of
    from service.tables import console, print_route

    request = asked(read_route(source), hand, robot)
    if spread:
        request = msgspec.structs.replace(request, want=["spread"], draws=draws or request.draws)
    if unexplained:
        request = msgspec.structs.replace(request, explain=False)
    climb = answering.route(request, robots_of(robot))
    with filling_folder():
        folder.mkdir(parents=True, exist_ok=True)
    write_alone(folder / "route", folder)
    with progress(f"planning {climb.name}") as tell:
        result = evaluate(climb, workers, tell)
    with filling_folder():
        files = write_report(result, folder)
    if as_json:
        say(summary(result) | {"files": {name: str(path) for name, path in files.items()}})
    else:
        print_route(result, files, console())
    return STATUSES.get(result.status, FAILED)


class _Routes:
    """The files of routes, each read when it is its turn; their meshes are put into them.

    Parameters
    ----------
    sources : sequence of str
        As `read_route` takes them, and folders.
    hand : ParameterTable or None
    robot : RobotFile or None

    Attributes
    ----------
    names : list of str
        Of each route.
    count : int

    Raises
    ------
    InvalidInputError
        If a folder has none, or one is standard input, which is read once.
    """

    def __init__(
        self, sources: Sequence[str], hand: ParameterTable | None, robot: RobotFile | None
    ) -> None:
        self.names = [name for source in sources for name in _files(source)]
        self.count = len(self.names)
        self._asked = partial(asked, hand=hand, robot=robot)

    def __iter__(self) -> Iterator[bytes]:
        return (each.payload if isinstance(each, Answer) else each for each in self.questions())

    def questions(self) -> Iterator[bytes | Answer]:
        """Yield routes, or what is wrong with their files."""
        for name in self.names:
            known = name[-LONGEST:]
            try:
                request: RouteRequest = self._asked(read_route(name))
                request = msgspec.structs.replace(request, id=request.id or known)
                yield Format.JSON.encode(request)
            except CruxError as error:
                yield encode_error(error, Format.JSON, known)


def _files(source: str) -> list[str]:
    """Return the routes of a folder in the order of their names, or the one that is meant."""
    if source == "-":
        raise InvalidInputError("standard input is one route: give it alone, -o DIR", field="ROUTE")
    if not Path(source).is_dir():
        return [source]
    found = sorted(str(path) for path in Path(source).glob("*.json"))
    if not found:
        raise InvalidInputError(f"{source}: no file in it ends in .json", field="ROUTE")
    return found


def _many(
    sources: Sequence[str],
    file: Path,
    resume: bool,
    workers: int | None,
    dask: str | None,
    unexplained: bool,
    hand: ParameterTable | None,
    robot: RobotFile | None,
    as_json: bool,
) -> int:
    """Evaluate any number of routes, and keep what they come to."""
    from service.bulk import (
        ReplyLines,
        TableLines,
        evaluate,
        exporter_at,
        new_header,
        route_columns,
    )

    is_table = exporter_at(file) is not None
    routes = _Routes(sources, hand, robot)
    if any(os.path.abspath(name) == os.path.abspath(file) for name in routes.names):
        raise InvalidInputError(f"{file}: is one of the routes", field="-o")
    write_alone(file)
    begun = perf_counter()
    with writing_answers(file):
        if not is_table:
            if file.exists() and not file.is_file():
                raise InvalidInputError(f"{file}: is no file", field="-o")
            sink: Run = ReplyLines(file, False, resume, routes)
        else:
            columns = route_columns()
            header = new_header(columns, not unexplained, hand, robot)
            sink = TableLines(file, columns, header, resume, routes)
    before = sink.tally.count
    on, workers = place(dask, workers, PLANS * (routes.count - before))
    answers = partial(
        evaluate,
        on=on,
        workers=workers,
        robot=robot,
        explain=False if unexplained else None,
        columns=sink.columns,
        kind=ROUTE,
    )
    answer_rest(routes, answers, sink, file, "planning routes", "routes")
    elapsed = perf_counter() - begun
    complain(sink.tally, routes.names.__getitem__, "routes")
    if as_json:
        told = {"statuses": dict(sink.tally.statuses), "errors": dict(sink.tally.kinds)}
        say({"v": 1, "routes": routes.count, **told, "file": str(file)})
    else:
        _print(file, routes, before, elapsed)
    return exit_status(sink.tally, STATUSES)


def _print(file: Path, routes: _Routes, before: int, elapsed: float) -> None:
    """Print what each route came to, and where that is."""
    from service.tables import console

    out = console()
    if verbosity() >= 0:
        _print_table(file, routes, out)
    known = f", {before} were answered before" if before else ""
    out.print(f"{routes.count - before} routes in {elapsed:.1f} s{known}", markup=False)
    out.print(f"written: {file}", markup=False, soft_wrap=True)


def _print_table(file: Path, routes: _Routes, out: Console) -> None:
    from rich.markup import escape

    from service.tables import table_of

    table = table_of("status", "crux", numbers=("move", "util", "load factor"), words=("route",))
    for name, row in zip(routes.names, islice(_rows(file), SHOWN), strict=False):
        numbers = (_number(row[part]) for part in ("utilisation", "load_factor"))
        error = f"error: {row['error_kind']}"
        crux = " ".join(filter(None, (row["crux_phase"], row["crux_limb"])))
        move = row["crux_move"]
        shown = (row["status"] or error, crux or "-", "-" if move is None else str(move))
        table.add_row(*shown, *numbers, escape(name))
    out.print(table)
    if routes.count > SHOWN:
        out.print(f"and {routes.count - SHOWN} more", markup=False)


def _number(value: Any) -> str:
    return "-" if value is None else f"{float(value):.2f}"


def _rows(file: Path) -> Iterator[dict[str, Any]]:
    """Yield what a file tells of each route, whatever form it has."""
    from service.bulk import Row, route_columns, row_of

    if file.suffix.lower() == PARQUET:
        from pyarrow import parquet

        yield from parquet.read_table(file).to_pylist()
    elif file.suffix.lower() == CSV:
        with file.open(newline="", encoding="utf-8") as stream:
            for row in csv.DictReader(stream):
                yield {name: value or None for name, value in row.items()}
    else:
        names = [column.name for column in route_columns()]
        with file.open("rb") as lines:
            for line in lines:
                told = row_of(Answer(line, Format.JSON.value), Format.JSON, names).payload
                values = msgspec.msgpack.decode(told, type=Row).values
                yield dict(zip(names[1:], values, strict=True))
