"""Define ``crux sweep`` and ``crux simulate``: a stance over varied fields, or slips at random."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import msgspec
import numpy as np
from click.core import ParameterSource

import planner
from hand_models.base import CruxError, InvalidInputError, errors_under
from service import answering, processes, replies, requests, sweeping, tables
from service.commands import options, stances
from service.commands.batch import answer_rest, writing_answers
from service.commands.declaring import argument, command, flag, group, option

__all__ = ["simulate_command", "sweep_command"]


@command("sweep")
def sweep_command(
    stance: str = options.stance_argument,
    variations: tuple[str, ...] = option(
        "A field of the request and its values: LOW:HIGH:COUNT, or a,b,c of numbers or words. "
        "Once for each field.",
        usage="--vary PATH=VALUES",
        multiple=True,
        required=True,
    ),
    samples: int | None = option(
        "Points of a Latin hypercube over the ranges, in place of the grid of all values.",
        click.IntRange(min=1),
    ),
    seed: int | None = option("Of the samples; by default 0.", click.IntRange(min=0)),
    over: str | None = option(
        "Which two fields the picture is over, across and up, where more than two vary.",
        usage="PATH,PATH",
    ),
    tolerance: float = option(
        "Of where it stops holding, if one number varies: a share of the range.",
        options.FiniteRange(1e-9, 0.5),
        default=sweeping.BORDER_TOLERANCE,
    ),
    resume: bool = flag(
        "Go on where this sweep was broken off: points that the table of DIR has are kept."
    ),
    parallel: options.WorkersOption = options.workers_options,
    folder: Path = options.folder_option("Where the table and the picture go."),
    own: options.Own = options.own_options,
    as_json: bool = options.json_option,
) -> int:
    """Plan a stance over varied fields: a table, a picture, and where it stops holding.

    A PATH has the names of the request with dots between them, as load.mass, gravity.2 or
    hands.front_left.surface.shear_limit; hands are named by their limbs, entries of lists by their
    index, and * is all of them. Certificates and all extras but the load factor are left out.
    The table grows as points are answered; a sweep that is broken off goes on with --resume.

    Exit status: 0 whatever holds, 2 bad input, also where no point can be answered for it, 1 where
    a point failed or was lost.
    """
    if seed is not None and samples is None:
        raise InvalidInputError("requires --samples; give it, or leave --seed out", field="--seed")
    request = own.asked(stances.read_request(stance))
    try:
        chosen = [
            sweeping.Variation.parse(each, sampled=samples is not None) for each in variations
        ]
        design = sweeping.Design.of(request, chosen, samples, seed or 0, own.robots)
    except InvalidInputError as error:
        where = "--vary" if error.field is None else f"--vary {error.field}"
        raise InvalidInputError(error.message, field=where) from None
    given = click.get_current_context().get_parameter_source("tolerance")
    if given is ParameterSource.COMMANDLINE and design.number is None:
        paths = ", ".join(design.variations[i].path for i in design.varying)
        raise InvalidInputError(
            "requires exactly one varied field, and numbers as its values; varied: "
            f"{paths}; vary one number only, or remove --tolerance",
            field="--tolerance",
        )
    pair = None if over is None else over.split(",")
    if pair is not None:
        with errors_under("--over"):
            design.places_of(pair)
    tables.fill_alone(folder)
    table, picture = folder / "sweep.csv", folder / "sweep.png"
    with writing_answers(table):
        sink = sweeping.PointRows(request, design, seed or 0, table, resume, *own)
    left = design.count - sink.tally.count
    ask = sweeping.asking(left, parallel.workers, own.robot, parallel.dask)
    answer_rest(design, ask, sink, table, f"sweeping {stance}", "points")
    try:
        result = sweeping.with_borders(design, sink.points, own.robot, tolerance)
    except processes.Interrupted:
        raise processes.Interrupted(
            f"all points are answered in {table}, but not all borders of what is feasible are "
            "found; --resume goes on"
        ) from None
    with tables.filling_folder():
        sweeping.plot_sweep(result, picture, Path(stance).stem, pair)
    if as_json:
        tables.say(result.summary() | {"files": {"table": str(table), "picture": str(picture)}})
    else:
        out = tables.console()
        tables.print_sweep(result, out)
        if odd := sum(bool(row.warnings) for row in result.rows):
            out.print(f"warnings: at {odd} of {len(result.rows)} points, in the table")
        out.print(f"table: {table}\npicture: {picture}", soft_wrap=True)
    return _status(result)


def _status(result: sweeping.Sweep) -> int:
    """Return the exit status, and print the first error if no point can be answered."""
    if not all(row.answered for row in result.rows):
        return tables.ExitStatus.FAILED
    if all(row.error is not None for row in result.rows):
        tables.note(f"no point can be answered: {result.rows[0].complaint}")
        return tables.ExitStatus.BAD_INPUT
    return tables.ExitStatus.DONE


@command("simulate")
def simulate_command(
    source: str = argument(
        metavar="STANCE|ROUTE",
        shell_complete=stances.beginning_so(
            stances.bundled() + stances.bundled(requests.RouteRequest), files=True
        ),
    ),
    chosen: dict[str, Any] = group(
        dict,
        draws=option("Draws of strengths.", click.IntRange(1, 1_000_000)),
        replanned=option(
            "Of these with new set-points after each slip.", click.IntRange(0, 100_000)
        ),
        seed=option("Of the draws.", click.IntRange(0, 2**31)),
        strength=option(
            "True mean strength of tiles over the assumed one.", options.FiniteRange(0.01, 100.0)
        ),
        delay=option(
            "From a slip to the new set-points.", options.FiniteRange(0.0, 10.0), usage="SECONDS"
        ),
    ),
    picture: Path | None = options.plot_option(
        "Draw a cascade, survival over the load, and predicted against simulated; of a route, "
        "survival by stage."
    ),
    workers: int | None = option("Processes; by default one for each core.", click.IntRange(min=1)),
    own: options.Own = options.own_options,
    as_json: bool = options.json_option,
) -> int:
    """Let tiles slip at random: count how often all hands hold, with new set-points or without.

    The strengths of all tiles are drawn, and the weakest slips until all rest or a hand is lost.
    What a STANCE says of survival counts where no option says otherwise. Of a ROUTE, a file with
    moves, every stage is simulated at its plan, with so many draws each.

    Exit status: that of the plan, however likely slips are: 0 if it is within all limits, 3 if not,
    2 bad input. Of a route, that of its worst stage.
    """
    request = stances.read_stance_or_route(source)
    settings = planner.SurvivalSettings()
    if isinstance(request, requests.PlanRequest) and request.survival is not None:
        settings = request.survival
    given = {name: value for name, value in chosen.items() if value is not None}
    # no more than there are draws, where nobody asked for a number
    given.setdefault("replanned", min(settings.replanned, given.get("draws", settings.draws)))
    settings = msgspec.structs.replace(settings, **given)
    if isinstance(request, requests.RouteRequest):
        return _simulate_route(own.asked(request), settings, picture, workers, own, as_json)
    return _simulate_stance(own.asked(request), settings, source, picture, workers, own, as_json)


def _simulate_route(
    request: requests.RouteRequest,
    settings: planner.SurvivalSettings,
    picture: Path | None,
    workers: int | None,
    own: options.Own,
    as_json: bool,
) -> int:
    """Simulate every stage of a route, and show its survival."""
    plain = msgspec.structs.replace(request, want=[], draws=[], explain=False)
    climb = answering.route_of(plain, own.robots)
    with tables.progress(f"planning {climb.name}") as progress:
        result = planner.evaluate(climb, workers, progress)
    with tables.progress(f"simulating {climb.name}") as progress:
        found = planner.find_route_survival(result, settings, workers, progress)
    if picture is not None:
        with tables.writing(picture):
            planner.plot_route_survival(found, picture)
    if as_json:
        tables.say(msgspec.to_builtins(found))
    else:
        tables.print_route_survival(found, tables.console())
        tail = next((s.survival.tail for s in found.stages if s.survival and s.survival.tail), None)
        if tail is not None:
            tables.remark(tail)
    return tables.ExitStatus.of(found.status)


def _simulate_stance(
    request: requests.PlanRequest,
    settings: planner.SurvivalSettings,
    stance: str,
    picture: Path | None,
    workers: int | None,
    own: options.Own,
    as_json: bool,
) -> int:
    """Simulate a stance in several processes, and show its survival."""
    count = planner.cores() if workers is None else workers
    first = msgspec.structs.replace(
        request,
        want=["survival"],
        survival=settings,
        draws=[],
        open_loop=None,
        detail=None,
        max_reply_bytes=None,
        explain=False,
    )
    question, plan, reply = answering.planned(
        msgspec.structs.replace(first, want=[], survival=None), own.robots
    )[:3]
    assert isinstance(reply, replies.PlanReply)
    if plan.hands is None:
        return tables.show(reply, as_json)
    with (
        tables.progress(f"simulating {stance}") as progress,
        planner.deadline.within(question.deadline),
    ):
        found = planner.find_survival(question, plan.hands, settings, count, progress)
    if picture is not None and found.holds is not None:
        few = min(settings.replanned, max(settings.replanned // 4, 10))
        fewer = msgspec.structs.replace(settings, replanned=few)
        others = [load for load in np.linspace(0.25, 1.25, 9).tolist() if load != 1.0]
        with (
            processes.Planners(count, robot=own.robot) as planners,
            tables.progress(f"simulating {stance} at other loads") as progress,
        ):
            wrenches = [[load * each for each in reply.body_wrench] for load in others]
            asked = [
                msgspec.structs.replace(first, body_wrench=each, load=None, survival=fewer)
                for each in wrenches
            ]
            answers = _replies(planners.plan_many(asked, progress))
        curve = [(1.0, found)] + [
            (load, each.survival)
            for load, each in zip(others, answers, strict=True)
            if isinstance(each.survival, planner.Survival)
        ]
        with tables.writing(picture):
            planner.plot_survival(found, sorted(curve, key=lambda at: at[0]), picture, stance)
    if as_json:
        more = {"utilisation": reply.utilisation, "status": reply.status}
        tables.say(more | msgspec.to_builtins(found))
    else:
        tables.print_survival(found, tables.console())
        if found.tail is not None:
            tables.remark(found.tail)
    return tables.ExitStatus.of(reply.status)


def _replies(answers: list[Any]) -> list[replies.PlanReply]:
    """Return the replies; raise the first error in their place."""
    for answer in answers:
        if isinstance(answer, replies.ErrorReply):
            error = CruxError(answer.error.message, field=answer.error.field)
            error.kind = answer.error.kind
            raise error
    return answers
