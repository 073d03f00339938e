"""Page of a climb: its stages one by one, and the margin along it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from planner.pages.documents import write_document
from planner.pages.plan_page import shown_plan
from planner.pages.scenes import Meshes
from planner.result import Plan
from planner.route import OutOfReach, RouteResult, RouteStage

__all__ = ["shown_stages", "write_route_page"]


def write_route_page(
    result: RouteResult, path: Path, sure: Sequence[Sequence[str]] | None = None
) -> None:
    """Write the plans of a climb as a page for a browser, with a slider over its stages.

    Parameters
    ----------
    result : RouteResult
        Plans of all stages of the climb.
    path : Path
        File of HTML to write.
    sure : sequence of sequence of str, optional
        Sentences of each stage that say how sure its plan is.

    Raises
    ------
    UnsupportedError
        If plotly is not installed.
    """
    meshes = Meshes()
    stages = shown_stages(result, meshes)
    if sure is not None:
        stages = [stage | {"sure": list(said)} for stage, said in zip(stages, sure, strict=True)]
    data = {"stages": stages, "crux": result.crux, "meshes": meshes.packed, "said": meshes.said}
    write_document(result.route.name, data, path)


def shown_stages(result: RouteResult, meshes: Meshes) -> list[dict[str, Any]]:
    """Return what a page shows of each stage, as plain data.

    Parameters
    ----------
    result : RouteResult
        Plans of all stages of the climb.
    meshes : Meshes
        Meshes of the page, to which those of the stages are added.
    """
    return [_shown(*each, meshes) for each in zip(result.stages, result.plans, strict=True)]


def _shown(stage: RouteStage, plan: Plan | OutOfReach, meshes: Meshes) -> dict[str, Any]:
    """Return what the page shows of a stage; of one out of reach, only why."""
    limb = (stage.limb or "").replace("_", " ")
    name = "start" if stage.move == 0 else f"{stage.move} {stage.phase} {limb}".rstrip()
    if isinstance(plan, Plan):
        return {"name": name} | shown_plan(plan, stage.question, meshes)
    limit = stage.question.limits.utilisation
    return {"name": name, "status": plan.status, "sentence": plan.reason, "limit": limit}
