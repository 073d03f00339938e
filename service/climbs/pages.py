"""Write pages of climbs: with what would help at the crux, and how sure the plans are."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import planner
from service import answering, requests, tables
from service.climbs.verdict import verdict_sentences

__all__ = ["with_spread", "write_page", "write_search_page"]


def write_page(result: planner.RouteResult, page: Path) -> None:
    """Write the plans of a route as a page for a browser.

    If the crux does not hold, changes that would help are searched for.

    Parameters
    ----------
    result : RouteResult
        Plans of all stages of the route.
    page : Path
        File of HTML to write.

    Raises
    ------
    InvalidInputError
        If the file cannot be written.
    CruxError
        If the disk is full or fails.
    UnsupportedError
        If plotly is not installed.
    """
    crux = result.crux
    hardest = result.plans[crux]
    if isinstance(hardest, planner.Plan) and hardest.status in {"overloaded", "infeasible"}:
        name = result.route.name
        with (
            tables.working(f"searching for feasible changes of stage {crux} of {name}"),
            planner.deadline.within(answering.ADVICE_TIME),
        ):
            advised = planner.with_advice(result.stages[crux].question, hardest)
        plans = (*result.plans[:crux], advised, *result.plans[crux + 1 :])
        result = replace(result, plans=plans)
    sure = [_sure(result, k, palms=k == crux) for k in range(len(result.plans))]
    with tables.writing(page, "--html"):
        planner.write_route_page(result, page, sure)


def write_search_page(
    request: requests.ClimbRequest, sought: answering.SoughtClimb, page: Path
) -> None:
    """Write a climb that was searched for as a page, or the rock alone; raise as `write_page`.

    Parameters
    ----------
    request : ClimbRequest
    sought : SoughtClimb
    page : Path
        File of HTML to write.
    """
    found, sure = sought.found, list[str]()
    said = tuple(verdict_sentences(found, request.at_least, raises=False))  # as advice
    with (
        tables.working("planning changes of the stage that decides"),
        tables.writing(page, "--html"),
    ):
        if found.result is not None and found.deciding is not None:
            sure = _sure(found.result, found.deciding.stage, palms=True)
        planner.write_climb_page(
            found, sought.rock, sought.rock_pose, page, request.name, said, sure
        )


def with_spread(found: planner.FoundClimb, asked: planner.Route) -> planner.FoundClimb:
    """Return a climb whose deciding stage is planned over samples, too.

    Parameters
    ----------
    found : FoundClimb
        With a climb or without.
    asked : Route
        Whose extras and samples the stage is to have.
    """
    if found.result is None or found.deciding is None:
        return found
    k, plans = found.deciding.stage, list(found.result.plans)
    stage = found.result.stages[k].question
    with tables.working("planning samples of the stage that decides"):
        plans[k] = planner.plan(replace(stage, want=stage.want | asked.want, draws=asked.draws))
    return replace(found, result=replace(found.result, plans=tuple(plans)))


def _sure(result: planner.RouteResult, k: int, *, palms: bool) -> list[str]:
    """Return how sure the plan of a stage is, and if asked for without palms."""
    plan, question = result.plans[k], result.stages[k].question
    if not isinstance(plan, planner.Plan):
        return []
    if not palms:
        return tables.sure_sentences(plan)
    without = planner.plan_without_palms(question)
    return tables.sure_sentences(plan, without, planner.load_factors_without_palm_loads(question))
