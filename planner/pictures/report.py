"""What is left of a climb on disk: a table, a picture and a summary."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

from hand_models.base import whole_file
from planner.pictures.route_plots import plot_route
from planner.result import LimitName, Plan
from planner.route import OutOfReach, RouteResult, RouteStage

__all__ = ["summary", "write_report"]


def write_report(result: RouteResult, folder: Path) -> dict[str, Path]:
    """Write ``stages.csv``, ``margin.png`` and ``summary.json`` into a folder.

    Returns
    -------
    dict of str to Path
        By the names ``table``, ``picture`` and ``summary``.
    """
    folder.mkdir(parents=True, exist_ok=True)
    files = {
        "table": folder / "stages.csv",
        "picture": folder / "margin.png",
        "summary": folder / "summary.json",
    }
    with (
        whole_file(files["table"]) as part,
        part.open("w", newline="", encoding="utf-8") as stream,
    ):
        rows = [_row(*each) for each in zip(result.stages, result.plans, strict=True)]
        writer = csv.DictWriter(stream, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    plot_route(result, files["picture"])
    text = json.dumps(summary(result), indent=2, ensure_ascii=False)
    with whole_file(files["summary"]) as part:
        part.write_text(text + "\n", encoding="utf-8")
    return files


def summary(result: RouteResult) -> dict[str, Any]:
    """Return the climb in short: whether it goes, and its crux."""
    crux = result.crux
    stage, plan = result.stages[crux], result.plans[crux]
    statuses = [p.status for p in result.plans]
    return {
        "v": 1,
        "route": result.route.name,
        "feasible": result.feasible,
        "stages": len(statuses),
        "statuses": {status: statuses.count(status) for status in sorted(set(statuses))},
        "crux": {**_row(stage, plan), "sentence": _sentence(stage, plan)},
    }


def _sentence(stage: RouteStage, plan: Plan | OutOfReach) -> str:
    limb = str(stage.limb).replace("_", " ")
    what = {
        "start": "the start stance",
        "shift": f"move {stage.move}, shifting the body before {limb} lifts",
        "lift": f"move {stage.move}, with {limb} in the air",
        "place": f"move {stage.move}, with {limb} on its new hold",
    }[stage.phase]
    used = "no plan" if plan.utilisation is None else f"utilisation {plan.utilisation:.2f}"
    return f"The crux is {what}: {used}; {plan.reason}."


def _row(stage: RouteStage, plan: Plan | OutOfReach) -> dict[str, Any]:
    name = plan.limiting or LimitName("", None, None, "")
    used = plan.utilisation
    return {
        "stage": stage.index,
        "move": stage.move,
        "phase": stage.phase,
        "limb": stage.limb,
        "status": plan.status,
        "utilisation": used,
        "margin": None if used is None else stage.question.limits.utilisation - used,
        "load_factor": plan.load_factor,
        "joint_utilisation": plan.joint_utilisation,
        "limiting_limb": name.limb or None,
        "limiting_finger": name.finger,
        "limiting_phalanx": name.phalanx,
        "limiting_limit": name.limit or None,
        "reason": plan.reason,
    }
