"""Write the page of a route: with what would help at its crux, and how sure its plans are."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import planner
from service import answering, tables

__all__ = ["write_page"]


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
    spreads = [plan.spread for plan in result.plans]
    sure = [tables.spread_sentences(each) if each is not None else [] for each in spreads]
    with tables.writing(page, "--html"):
        planner.write_route_page(result, page, sure)
