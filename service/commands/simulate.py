"""Define ``crux simulate``: let tiles of a planned stance slip at random."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import msgspec
import numpy as np

import planner
from hand_models.base import CruxError
from service import processes, replies, requests, tables
from service.commands import options, stances

__all__ = ["simulate_command"]

LOADS = np.linspace(0.25, 1.25, 9).tolist()
"""Multiples of the load for which the picture has the survival."""


@click.command("simulate")
@options.stance_argument
@click.option("--draws", type=click.IntRange(1, 1_000_000), help="Draws of strengths.")
@click.option(
    "--replanned",
    type=click.IntRange(0, 100_000),
    help="Of these with new set-points after each slip.",
)
@click.option("--seed", type=click.IntRange(0, 2**31), help="Of the draws.")
@click.option(
    "--strength",
    type=options.FiniteRange(0.01, 100.0),
    help="True mean strength of tiles over the assumed one.",
)
@click.option(
    "--delay",
    type=options.FiniteRange(0.0, 10.0),
    metavar="SECONDS",
    help="From a slip to the new set-points.",
)
@options.plot_option("Draw a cascade, survival over the load, and predicted against simulated.")
@click.option(
    "--workers", type=click.IntRange(min=1), help="Processes; by default one for each core."
)
@options.own_options
@options.json_option
def simulate_command(
    stance: str,
    picture: Path | None,
    workers: int | None,
    own: options.Own,
    as_json: bool,
    **chosen: Any,
) -> int:
    """Let tiles slip at random: tell how often all hands hold, with new set-points or without.

    The strengths of all tiles are drawn, and the weakest slips until all rest or a hand is lost.
    What a STANCE says of survival counts where no option says otherwise.
    """
    request = own.asked(stances.read_request(stance))
    settings = request.survival or planner.SurvivalSettings()
    given = {name: value for name, value in chosen.items() if value is not None}
    settings = msgspec.structs.replace(settings, **given)
    if "replanned" not in given:
        settings = msgspec.structs.replace(
            settings, replanned=min(settings.replanned, settings.draws)
        )
    count = planner.cores() if workers is None else workers
    first = _with(request, settings)
    parts = [_with(request, each) for each in _parts(settings, count)]
    with (
        processes.Planners(count, robot=own.robot) as planners,
        tables.progress(f"simulating {stance}") as progress,
    ):
        whole = _replies(planners.plan_many(parts, progress))
        if whole[0].survival is msgspec.UNSET:
            return tables.show(whole[0], as_json)
        found = planner.Survival.merged([_survival(each) for each in whole])
        curve = []
        if picture is not None and found.reason is None:
            fewer = msgspec.structs.replace(settings, replanned=settings.replanned // 4)
            asked = [_at_load(first, whole[0], load, fewer) for load in LOADS]
            answers = _replies(planners.plan_many(asked, progress))
            curve = [
                (load, _survival(each))
                for load, each in zip(LOADS, answers, strict=True)
                if each.survival is not msgspec.UNSET
            ]
    if picture is not None and found.reason is None:
        with tables.writing(picture):
            planner.plot_survival(found, curve, picture, Path(stance).stem)
    if as_json:
        more = {"utilisation": whole[0].utilisation, "status": whole[0].status}
        tables.say(more | msgspec.to_builtins(found))
    else:
        tables.print_survival(found, tables.console())
        if found.tail is not None:
            tables.remark(found.tail)
    return tables.ExitStatus.of(whole[0].status)


def _with(
    request: requests.PlanRequest, settings: planner.SurvivalSettings
) -> requests.PlanRequest:
    """Return a request for the survival alone."""
    return msgspec.structs.replace(
        request,
        want=["survival"],
        survival=settings,
        draws=[],
        open_loop=None,
        detail=None,
        max_reply_bytes=None,
        explain=False,
    )


def _parts(settings: planner.SurvivalSettings, count: int) -> list[planner.SurvivalSettings]:
    """Return settings that share the draws between processes, each with a seed of its own."""
    found = []
    for i in range(min(count, settings.draws)):
        draws, replanned = (
            (whole + count - 1 - i) // count for whole in (settings.draws, settings.replanned)
        )
        found.append(
            msgspec.structs.replace(
                settings, draws=draws, replanned=min(replanned, draws), seed=settings.seed + i
            )
        )
    return found


def _at_load(
    request: requests.PlanRequest,
    reply: replies.PlanReply,
    load: float,
    settings: planner.SurvivalSettings,
) -> requests.PlanRequest:
    """Return the request for a multiple of its body wrench."""
    wrench = [load * each for each in reply.body_wrench]
    return msgspec.structs.replace(request, body_wrench=wrench, load=None, survival=settings)


def _survival(reply: replies.PlanReply) -> planner.Survival:
    assert isinstance(reply.survival, planner.Survival)
    return reply.survival


def _replies(answers: list[Any]) -> list[replies.PlanReply]:
    """Return the replies; raise the first error in their place."""
    for answer in answers:
        if isinstance(answer, replies.ErrorReply):
            error = CruxError(answer.error.message, field=answer.error.field)
            error.kind = answer.error.kind
            raise error
    return answers
