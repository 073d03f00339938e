"""Define ``crux route`` and ``crux climb``: plan climbs that are given, or search for one."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import click
import msgspec

import planner
from hand_models.base import InvalidInputError, UnsupportedError, to_install
from service import answering, bulk, climbs, requests, tables, wire
from service.commands import batch, options, stances
from service.commands.declaring import argument, command, flag, group, option

if TYPE_CHECKING:
    from hand_models.base import Array

__all__ = ["climb_command", "route_command", "search_climb"]


@command("route")
def route_command(
    routes: tuple[str, ...] = options.routes_argument,
    output: Path | None = option(
        "Where tables, stances, pictures and the trajectory of one route go; or of any number of "
        f"routes a file that ends in {batch.LISTED_ENDINGS}: the replies, one a line, or a table; "
        "with --stage a file that ends in .json: the stance.",
        options.ANY_PATH,
        usage="-o --output DIR",
    ),
    index: int | None = option(
        "Print the plan of one stage of a route, from zero, as crux plan does.",
        click.IntRange(min=0),
        usage="--stage K",
    ),
    resume: bool = flag(
        "Go on where many routes were broken off: what the file answers is not asked again."
    ),
    page: Path | None = options.page_option,
    parallel: options.WorkersOption = options.workers_options,
    wanted: options.Wanted = group(
        options.Wanted,
        spread=options.spread_option,
        draws=options.draws_option,
        unexplained=options.explain_option,
    ),
    own: options.Own = options.own_options,
    as_json: bool = options.json_option,
) -> int:
    """Plan climbs: every stage, and every move between two stages.

    ROUTE is the path of a JSON or TOML file, - for standard input, the name of a bundled route, or
    a folder: all files in it that end in .json. Many routes are answered in order, with an error in
    the place of each route that has one.

    The exit status of many routes is the worst that one of them has, as for crux batch.
    """
    if index is not None:
        return _stage(_Asked.of(routes, wanted, own), index, output, page, as_json)
    if output is None and page is None:
        lack = "missing: give -o DIR, --html FILE, or --stage K of one route"
        raise InvalidInputError(lack, field="-o")
    listing = climbs.route_listing()
    several = len(routes) > 1 or stances.is_folder(routes[0])
    if output is None and (several or resume):
        raise InvalidInputError("is for one route, planned at once", field="--html")
    if output is not None and batch.is_listed(output, listing, several, resume):
        one = {"--spread": wanted.spread, "--draws": wanted.draws, "--html": page}
        for field, asked_for in one.items():
            if asked_for:
                raise InvalidInputError(
                    f"is for one route, whose output -o is a folder, got {output}", field=field
                )
        names = [name for source in routes for name in stances.routes_of(source)]
        sources = climbs.Sources(names, lambda name: own.asked(stances.read_route(name)))
        unexplained = wanted.unexplained
        return _many(listing, sources, output, resume, parallel, own, as_json, unexplained)
    if parallel.dask is not None:
        said = f"requires -o FILE that ends in {batch.LISTED_ENDINGS}"
        raise InvalidInputError(said, field="--dask")
    return _one(_Asked.of(routes, wanted, own), output, page, parallel.workers, as_json)


def _above(words: str, most: float = 1e3, **more: Any) -> Any:
    """Return an option whose value is a number above zero."""
    return option(words, options.FiniteRange(0.0, most, min_open=True), **more)


END_FORMS: Final = "x,y,z in W, height:Z, or a stance"

sought_options = group(
    climbs.Sought,
    start=option(f"Start: {END_FORMS}.", usage="--from END", required=True),
    goal=option(f"Goal: {END_FORMS}.", usage="--to END", required=True),
    radius=_above("Of the body's origin about x,y,z [m]; 0.3 by default."),
    best_within=option("By which another climb may be better.", default="5%", usage="PART"),
    at_least=_above("Load factor that is enough in all stages."),
    time=_above("Of the search, after which the best climb so far is taken [s].", 1e6),
    refine=option(
        "That the weakest stage gets more places and poses, and all is searched again.",
        click.IntRange(0, 16),
        default=0,
        show_default=False,
    ),
    surface=option("A preset's name.", default="rock"),
    spacing=_above("Of the points at which hands are tried [m].", 10.0),
    body_spacing=_above("Of the places of the body [m].", 10.0),
    stand_off=_above("Of the body from the rock [m]; repeatable.", 10.0, multiple=True),
    lean=option(
        "Of a mesh's x from the vertical, away from the climber [rad].",
        options.FiniteRange(-1.57, 1.57),
        default=0.0,
    ),
    wrist=option(
        "compliant: plan the stages of the climb with wrists that give, too.",
        click.Choice(["fixed", "compliant"]),
    ),
    wrist_travel=option(
        "Of compliant wrists: either way, toward the rock, turn [m, m, rad].",
        (float, float, float),
    ),
)


@command("climb")
def climb_command(
    rocks: tuple[str, ...] = argument(nargs=-1, required=True, metavar="ROCK..."),
    sought: climbs.Sought = sought_options,
    output: Path = option(
        "Where route, trajectory, stances, pictures, tables and the proof of one rock go; or of "
        f"any number of rocks a file that ends in {batch.LISTED_ENDINGS}: the replies, one a line, "
        "or a table.",
        options.ANY_PATH,
        usage="-o --output DIR",
        required=True,
    ),
    resume: bool = flag(
        "Go on where many rocks were broken off: what the file answers is not asked again."
    ),
    page: Path | None = options.page_option,
    parallel: options.WorkersOption = options.workers_options,
    wanted: options.Wanted = group(
        options.Wanted, spread=options.spread_option, draws=options.draws_option
    ),
    own: options.Own = options.own_options,
    as_json: bool = options.json_option,
) -> int:
    """Search for the best climb on each ROCK, with proof how much better any other can be.

    ROCK is a mesh in metres with x up the rock and z into it, or a generated wall. height:Z is the
    height of the body's origin in W: at most Z at the start, at least Z at the goal. Many rocks are
    answered in order, with an error in the place of each rock that has one.

    Exit status: 0 with a climb, 3 if it is proven that there is none or no moves have a plan, 1 if
    none was found in time; of many rocks the worst that one of them has, as for crux batch.
    """
    listing = climbs.climb_listing()
    listed = batch.is_listed(output, listing, len(rocks) > 1, resume)
    one = {"--html": page, "--spread": wanted.spread, "--draws": wanted.draws}
    for field, asked_for in one.items():
        if listed and asked_for:
            raise InvalidInputError("is for one rock, whose output -o is a folder", field=field)
    with climbs.naming_options():
        asking = sought.asking(stances.read_request)
    sources = climbs.Sources(rocks, lambda rock: own.asked(asking(Path(rock))))
    if listed:
        return _many(listing, sources, output, resume, parallel, own, as_json)
    with climbs.naming_options():
        asked = own.asked(asking(Path(rocks[0])))
        inputs = {"ROCK": rocks[0], "--from": sought.start, "--to": sought.goal}
        return search_climb(asked, output, parallel, own, as_json, page, wanted, inputs)


def search_climb(
    request: requests.ClimbRequest,
    folder: Path,
    parallel: options.WorkersOption,
    own: options.Own,
    as_json: bool,
    page: Path | None = None,
    wanted: options.Wanted | None = None,
    inputs: Mapping[str, str] | None = None,
) -> int:
    """Search for a climb, write its files, and print the verdict; return the exit status.

    Files that are inputs, or not of an earlier climb in the folder, are not replaced or removed.
    """
    tables.fill_alone(folder)
    filled = climbs.ClimbFolder(folder, inputs or {})
    # a wall takes as long as some thousand plans
    on, workers = parallel.place(1000)
    found = climbs.seek(request, own.robots, on, workers, folder)
    with tables.filling_folder(), filled.filling():
        files = climbs.write_search(request, found, folder)
        if found.found.result is not None:
            asked = _Asked.of([str(files["route"])], options.Wanted(unexplained=True), own)
            climb = found.found.climb
            files |= climbs.write_route(found.found.result, climb, folder, asked.stage)[0]
            if wanted is not None and (wanted.spread or wanted.draws):
                route = answering.route_of(wanted.of(asked.request), own.robots)
                found = found._replace(found=climbs.with_spread(found.found, route))
    if page is not None:
        climbs.write_search_page(request, found, page)
        files["page"] = page
    if as_json:
        reply = msgspec.to_builtins(answering.climb_reply(request, found))
        if (spread := climbs.spread_of(found.found)) is not None:
            reply["deciding"]["spread"] = spread
        tables.say(reply | {"files": {name: str(path) for name, path in files.items()}})
    else:
        climbs.print_verdict(found.found, request.at_least, files, tables.console())
    return tables.ExitStatus.of(found.found.status)


class _Asked(NamedTuple):
    """A route request with its meshes, as its file has it with names of meshes, and whose it is."""

    request: requests.RouteRequest
    given: stances.Given[requests.RouteRequest]
    own: options.Own

    @classmethod
    def of(cls, routes: Sequence[str], wanted: options.Wanted, own: options.Own) -> _Asked:
        """Read the one route that is named, with the options of the command."""
        if len(routes) > 1:
            raise InvalidInputError("is for one route", field="--stage")
        request, given = stances.read_route_with_text(routes[0])
        return cls(wanted.of(own.asked(request)), given, own)

    def stage(
        self,
        stage: planner.RouteStage,
        joints: Mapping[str, Array] | None,
        folder: Path | None = None,
    ) -> requests.PlanRequest:
        """Return the plan request of a stage; for a file in a folder, with names of mesh files."""
        found = answering.stage_request(self.request, stage, joints)
        if folder is None or self.given.files is None:
            return found
        named = answering.stage_request(self.given.request, stage, joints)
        return self.given.files.named(found, named, folder)


def _one(
    asked: _Asked, folder: Path | None, page: Path | None, workers: int | None, as_json: bool
) -> int:
    """Evaluate one route, and write its report, its page or both."""
    route = answering.route_of(asked.request, asked.own.robots)
    if folder is not None:
        tables.fill_alone(folder)
    with tables.progress(f"planning the moves of {route.name}") as report:
        climb, lacks = _climb(route, report)
    with tables.progress(f"planning {route.name}") as report:
        result = planner.evaluate(route, workers, report, climb)
    _say_lacking(lacks)
    files: dict[str, Path] = {}
    digest = None
    if folder is not None:
        with tables.filling_folder():
            files, digest = climbs.write_route(result, climb, folder, asked.stage)
    if page is not None:
        climbs.write_page(result, page)
        files["page"] = page
    if as_json:
        tables.say(
            planner.summary(result, climb, digest)
            | {"files": {name: str(path) for name, path in files.items()}}
        )
    else:
        tables.print_route(result, files, tables.console(), climb)
        if "trajectory" in files and "trajectory table" not in files:
            tables.remark(f"for the trajectory as a table: {to_install('parquet')}")
    return tables.ExitStatus.of(result.status, fails=climb is not None and climb.fails)


def _climb(
    route: planner.Route, report: Callable[[int, int], None] | None = None
) -> tuple[planner.Climb | None, UnsupportedError | None]:
    """Plan the moves of a route, or return why these cannot be planned for what the route has."""
    try:
        return planner.plan_climb(route, progress=report), None
    except UnsupportedError as error:
        return None, error


def _say_lacking(error: UnsupportedError | None) -> None:
    """Say why there is no trajectory, once the stages are planned: an error of these says more."""
    if error is not None:
        tables.remark(f"no trajectory: {error}")


def _stage(asked: _Asked, index: int, file: Path | None, page: Path | None, as_json: bool) -> int:
    """Print the plan of one stage, and write its stance and its page."""
    if file is not None and file.suffix.lower() != ".json":
        raise InvalidInputError(f"{file}: must end in .json with --stage", field="-o")
    route = answering.route_of(asked.request, asked.own.robots)
    known = tuple(planner.stages(route))
    if index >= len(known):
        said = f"must be below {len(known)}, the number of stages, got {index}"
        raise InvalidInputError(said, field="--stage")
    stage = known[index]
    # later moves have a say in the joint angles, so that they can be kept
    with tables.working(f"planning the moves of {route.name}"):
        climb, lacks = _climb(route)
    joints = None if climb is None else climb.stage_joints.get(index)
    request = options.with_extras(asked.stage(stage, joints), whole=not as_json)
    answer = answering.planned(request, asked.own.robots)
    _say_lacking(lacks)
    if file is not None:
        with tables.writing(file):
            climbs.write_stance(asked.stage(stage, joints or answer.plan.joints, file.parent), file)
    if page is not None:
        tables.write_answer_page(answer, page, f"{route.name}, stage {index}")
    return tables.show(answer.reply, as_json)


def _many(
    listing: climbs.Listing,
    sources: climbs.Sources,
    file: Path,
    resume: bool,
    parallel: options.WorkersOption,
    own: options.Own,
    as_json: bool,
    unexplained: bool = True,
) -> int:
    """Answer any number of routes or climbs, and keep their results."""
    listing.refuse(file, sources.names)
    tables.write_alone(file)
    begun = perf_counter()
    with batch.writing_answers(file):
        sink = listing.run(file, sources, *own, explained=not unexplained, resume=resume)
    before = sink.tally.count
    left = max(1, sources.count - before)
    on, workers = parallel.place(listing.plans * left)
    answer = partial(
        bulk.answer_all,
        on=on,
        workers=None if workers is None else min(workers, left),
        robot=own.robot,
        explain=False if unexplained else None,
        kind=listing.kind,
    )

    def answers(asked: Iterator[bulk.Question]) -> Generator[wire.Answer, None, None]:
        return listing.answers(answer(asked))

    batch.answer_rest(sources, answers, sink, file, listing.work, listing.noun)
    elapsed = perf_counter() - begun
    batch.complain(sink.tally, sources.names.__getitem__, listing.noun)
    if as_json:
        counts = {"statuses": dict(sink.tally.statuses), "errors": dict(sink.tally.kinds)}
        tables.say({"v": 1, listing.noun: sources.count, **counts, "file": str(file)})
    else:
        listing.print(file, sources.names, before, elapsed)
    return batch.exit_status(sink.tally)
