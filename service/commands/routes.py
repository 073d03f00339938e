"""Define ``crux route``: plan one climb with a report, or many as table rows or replies."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import islice
from pathlib import Path
from time import perf_counter
from typing import Any, Final

import click
import msgspec

import planner
from hand_models.base import CruxError, InvalidInputError
from service import answering, bulk, requests, tables, wire
from service.commands import options, stances
from service.commands.batch import answer_rest, complain, exit_status, new_run

__all__ = ["route_command"]

LISTED_ENDINGS: Final = ".jsonl or .csv or .parquet"


@click.command("route")
@options.routes_argument
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    required=True,
    metavar="DIR",
    help="Where the table, the picture and the summary of one route go; or of any number of routes "
    f"a file that ends in {LISTED_ENDINGS}: the replies, one a line, or a table.",
)
@click.option(
    "--resume",
    is_flag=True,
    help="Go on where many routes were broken off: what the file answers is not asked again.",
)
@options.workers_options
@options.spread_option
@options.wanted_options
@options.own_options
@options.json_option
def route_command(
    routes: tuple[str, ...],
    output: Path,
    resume: bool,
    parallel: options.WorkersOption,
    wanted: options.Wanted,
    own: options.Own,
    as_json: bool,
) -> int:
    """Evaluate climbs: every stance, and every one with a limb in the air.

    ROUTE is the path of a JSON file, - for standard input, the name of a bundled route, or a
    folder: all files in it that end in .json. Many routes are answered in order, with an error in
    the place of each route that has one.

    The exit status of many routes is the worst that one of them has, as for crux batch.
    """
    if output.suffix.lower() in {".jsonl", ".csv", ".parquet"}:
        for option, asked_for in (("--spread", wanted.spread), ("--draws", wanted.draws)):
            if asked_for:
                raise InvalidInputError(
                    f"is for one route, whose output -o is a folder, got {output}", field=option
                )
        return _many(_Routes(routes, own), output, resume, parallel, wanted, own, as_json)
    if len(routes) > 1 or Path(routes[0]).is_dir():
        raise InvalidInputError(
            f"{output}: many routes need a file that ends in {LISTED_ENDINGS}", field="-o"
        )
    for option, given in (("--resume", resume), ("--dask", parallel.dask is not None)):
        if given:
            raise InvalidInputError(f"requires -o FILE that ends in {LISTED_ENDINGS}", field=option)
    if output.exists() and not output.is_dir():
        raise InvalidInputError(
            f"{output}: must be a folder, or end in {LISTED_ENDINGS}", field="-o"
        )
    request = wanted.of(own.asked(stances.read_route(routes[0])))
    return _one(request, output, parallel.workers, own, as_json)


def _one(
    request: requests.RouteRequest,
    folder: Path,
    workers: int | None,
    own: options.Own,
    as_json: bool,
) -> int:
    """Evaluate one route, and write its report."""
    climb = answering.route_of(request, own.robots)
    with tables.filling_folder():
        folder.mkdir(parents=True, exist_ok=True)
    tables.write_alone(folder / "route", folder)
    with tables.progress(f"planning {climb.name}") as report:
        result = planner.evaluate(climb, workers, report)
    with tables.filling_folder():
        files = planner.write_report(result, folder)
    if as_json:
        tables.say(
            planner.summary(result) | {"files": {name: str(path) for name, path in files.items()}}
        )
    else:
        tables.print_route(result, files, tables.console())
    return tables.ExitStatus.of(result.status)


class _Routes:
    """Files of routes; each is read when its turn comes, with its meshes put in.

    Parameters
    ----------
    sources : sequence of str
        As `read_route` takes them, and folders.
    own : Own

    Attributes
    ----------
    names : list of str
        Name of each route.
    count : int

    Raises
    ------
    InvalidInputError
        If a folder has none, or one is standard input, which is read once.
    """

    def __init__(self, sources: Sequence[str], own: options.Own) -> None:
        self.names = [name for source in sources for name in _files(source)]
        self.count = len(self.names)
        self._own = own

    def __iter__(self) -> Iterator[bytes]:
        return (
            each.payload if isinstance(each, wire.Answer) else each for each in self.questions()
        )

    def questions(self) -> Iterator[bytes | wire.Answer]:
        """Yield routes, or the errors of their files."""
        for name in self.names:
            # an id has 256 characters at most
            known = name[-256:]
            try:
                request = self._own.asked(stances.read_route(name))
                request = msgspec.structs.replace(request, id=request.id or known)
                yield wire.Format.JSON.encode(request)
            except CruxError as error:
                yield wire.encode_error(error, wire.Format.JSON, known)


def _files(source: str) -> list[str]:
    """Return the routes of a folder in the order of their names, or the one that is meant."""
    if source == "-":
        raise InvalidInputError(
            "standard input is one route: give it alone, with -o DIR", field="ROUTE"
        )
    if not Path(source).is_dir():
        return [source]
    found = sorted(str(path) for path in Path(source).glob("*.json"))
    if not found:
        raise InvalidInputError(f"{source}: no file in this folder ends in .json", field="ROUTE")
    return found


def _many(
    routes: _Routes,
    file: Path,
    resume: bool,
    parallel: options.WorkersOption,
    wanted: options.Wanted,
    own: options.Own,
    as_json: bool,
) -> int:
    """Evaluate any number of routes, and keep their results."""
    if any(os.path.abspath(name) == os.path.abspath(file) for name in routes.names):
        raise InvalidInputError(
            f"{file} is one of the routes and would be overwritten; name another file", field="-o"
        )
    tables.write_alone(file)
    begun = perf_counter()
    if file.suffix.lower() == ".jsonl" and file.exists() and not file.is_file():
        raise InvalidInputError(
            f"{file}: must be a file, not a device or pipe; name another", field="-o"
        )
    sink = new_run(
        file, routes, bulk.route_columns, own, explained=not wanted.unexplained, resume=resume
    )
    before = sink.tally.count
    # a route takes as long as 50 plans
    on, workers = parallel.place(50 * (routes.count - before))
    answers = partial(
        bulk.evaluate,
        on=on,
        workers=workers,
        robot=own.robot,
        explain=False if wanted.unexplained else None,
        kind=wire.ServiceName.ROUTE,
    )
    answer_rest(routes, answers, sink, file, "planning routes", "routes")
    elapsed = perf_counter() - begun
    complain(sink.tally, routes.names.__getitem__, "routes")
    if as_json:
        counts = {"statuses": dict(sink.tally.statuses), "errors": dict(sink.tally.kinds)}
        tables.say({"v": 1, "routes": routes.count, **counts, "file": str(file)})
    else:
        _print(file, routes, before, elapsed)
    return exit_status(sink.tally)


def _print(file: Path, routes: _Routes, before: int, elapsed: float) -> None:
    """Print the result of each route, and the file of the results."""
    from service.tables import name

    out = tables.console()
    crux = ("crux_phase", "crux_limb")
    columns = (
        name("status", lambda row: row["status"] or f"error: {row['error_kind']}"),
        name("crux", lambda row: " ".join(filter(None, map(row.get, crux))) or None),
        tables.number("move", "crux_move"),
        tables.number("util", "utilisation", lambda value: f"{float(value):.2f}"),
        tables.number("load factor", "load_factor", lambda value: f"{float(value):.2f}"),
        tables.text("route"),
    )
    if tables.verbosity() >= 0:
        most = 100
        named = zip(routes.names, islice(_rows(file), most), strict=False)
        tables.print_rows([row | {"route": route} for route, row in named], columns, out)
        if routes.count > most:
            out.print(f"and {routes.count - most} more", markup=False)
    known = f", {before} were answered before" if before else ""
    out.print(f"{routes.count - before} routes in {elapsed:.1f} s{known}", markup=False)
    out.print(f"written: {file}", markup=False, soft_wrap=True)


def _rows(file: Path) -> Iterator[dict[str, Any]]:
    """Yield each route's row of a file of any form."""
    if file.suffix.lower() == ".parquet":
        from pyarrow import parquet

        yield from parquet.read_table(file).to_pylist()
    elif file.suffix.lower() == ".csv":
        with file.open(newline="", encoding="utf-8") as stream:
            for row in csv.DictReader(stream):
                yield {name: value or None for name, value in row.items()}
    else:
        columns = bulk.route_columns()
        names = [column.name for column in columns if not column.is_index]
        with file.open("rb") as lines:
            for line in lines:
                yield dict(zip(names, bulk.row_of(line, columns).values, strict=True))
