"""Report of a climb: a table of stages, a picture and a summary."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from msgspec import structs

from hand_models.base import COLOUR_OF, Array, panel_grid, whole_file, write_picture
from planner.pictures.climb_plots import draw_climb, draw_support
from planner.result import SPREAD_SETTINGS, LimitName, Plan
from planner.route import Climb, OutOfReach, RouteResult, RouteStage

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw_route", "summary", "write_report"]

PHASE_COLOURS: Final = {
    "start": "0.4",
    "shift": COLOUR_OF["purple"],
    "lift": COLOUR_OF["amber"],
    "place": COLOUR_OF["blue"],
}


def write_report(
    result: RouteResult, folder: Path, climb: Climb | None = None, digest: str | None = None
) -> dict[str, Path]:
    """Write ``stages.csv``, ``margin.png`` and ``summary.json`` into a folder.

    The margin of a stage is the cap on the utilisation minus the stage's utilisation.

    Parameters
    ----------
    result : RouteResult
        Plans of all stages of the climb.
    folder : Path
        Created if missing; files of these names are replaced, and removed if not written.
    climb : Climb, optional
        Knots of the climb; with them ``climb.png`` shows the robot and its margins along the time,
        and ``support.png`` where the centre of mass may be and goes.
    digest : str, optional
        Digest of the file that has the climb's knots, for the summary.

    Returns
    -------
    dict of str to Path
        Files by the names ``table``, ``picture`` and ``summary``, ``climb`` and ``support``.
    """
    folder.mkdir(parents=True, exist_ok=True)
    files = {
        "table": folder / "stages.csv",
        "picture": folder / "margin.png",
        "summary": folder / "summary.json",
    }
    rows = [_row(*each) for each in zip(result.stages, result.plans, strict=True)]
    with whole_file(files["table"]) as part, part.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    for name in ("climb.png", "support.png"):
        # of an earlier climb
        (folder / name).unlink(missing_ok=True)
    pictures = {"picture": draw_route(result)}
    if climb is not None and climb.knots:
        files["climb"] = folder / "climb.png"
        pictures["climb"] = draw_climb(climb, result)
        if (support := draw_support(climb, result)) is not None:
            files["support"] = folder / "support.png"
            pictures["support"] = support
    for name, figure in pictures.items():
        write_picture(figure, files[name], 130, bbox_inches="tight")
    text = json.dumps(summary(result, climb, digest), indent=2, ensure_ascii=False)
    with whole_file(files["summary"]) as part:
        part.write_text(text + "\n", encoding="utf-8")
    return files


def summary(
    result: RouteResult, climb: Climb | None = None, digest: str | None = None
) -> dict[str, Any]:
    """Return the summary of a climb: statuses, the crux (its hardest stage), warnings and findings.

    Parameters
    ----------
    result : RouteResult
        Plans of all stages of the climb.
    climb : Climb, optional
        Knots of the climb; with them the summary has its moves, and why it fails.
    digest : str, optional
        Digest of the file that has the climb's knots.

    Returns
    -------
    dict of str to object
        Plain data for JSON.
    """
    crux = result.crux
    stage, plan = result.stages[crux], result.plans[crux]
    statuses = [p.status for p in result.plans]
    return {
        "v": 1,
        "route": result.route.name,
        "robot": result.route.start.robot.name,
        "feasible": result.feasible,
        "stages": len(statuses),
        "statuses": {status: statuses.count(status) for status in sorted(set(statuses))},
        "crux": {**_row(stage, plan), "sentence": _sentence(stage, plan)},
        "warnings": list(_warnings(result)),
        "findings": list(_findings(result)),
        **({} if climb is None else {"climb": _climb(climb, digest)}),
    }


def _climb(climb: Climb, digest: str | None) -> dict[str, Any]:
    """Return the moves of a climb, the start among them, and why it ends early."""
    failure = None if climb.failure is None else asdict(climb.failure)
    rows, begun = [], 0.0
    for move, group in groupby(climb.knots, key=lambda knot: knot.move):
        knots = list(group)
        most = max(knots, key=lambda knot: knot.utilisation)
        row = {
            "move": move,
            "limb": most.limb,
            "time": knots[-1].time - begun,
            "knots": len(knots),
            "utilisation": most.utilisation,
            "bound": max((k.bound for k in knots if k.bound is not None), default=None),
            "limiting": most.limiting and structs.asdict(most.limiting),
            "complete": failure is None or failure["move"] != move,
        }
        rows.append(row)
        begun = knots[-1].time
    return {
        "knots": len(climb.knots),
        "time": begun,
        "rates": dict(climb.rates),
        "digest": digest,
        "moves": rows,
        "failure": failure,
    }


def _warnings(result: RouteResult) -> Iterator[str]:
    """Yield what is odd about stances, once each, with their moves."""
    moves: dict[str, list[int]] = {}
    for stage, plan in zip(result.stages, result.plans, strict=True):
        for warning in plan.warnings:
            moves.setdefault(warning, []).append(stage.move)
    for warning, when in moves.items():
        yield f"{_spoken(when)}: {warning}"


def _spoken(moves: Sequence[int]) -> str:
    """Name moves in order, and the start: ``start, moves 1 to 3, 5``."""
    numbers = np.array(sorted({move for move in moves if move}), int)
    runs = np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1) if len(numbers) else []
    ranges = [f"{run[0]} to {run[-1]}" if len(run) > 1 else f"{run[0]}" for run in runs]
    named = ["move" + "s" * (len(numbers) > 1) + " " + ", ".join(ranges)] if ranges else []
    return ", ".join(["start"] * (0 in moves) + named)


def _findings(result: RouteResult) -> Iterator[dict[str, Any]]:
    """Yield the same structured, stage by stage; fields are those of each stage's question."""
    for stage, plan in zip(result.stages, result.plans, strict=True):
        for finding in plan.findings:
            yield {"stage": stage.index, "move": stage.move, **structs.asdict(finding)}


def _sentence(stage: RouteStage, plan: Plan | OutOfReach) -> str:
    limb = str(stage.limb).replace("_", " ")
    what = {
        "start": "the start stance",
        "shift": f"move {stage.move}, shifting the body before {limb} lifts"
        if stage.limb
        else "the shift of the body at the end",
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
        "load_factor_status": plan.load_factor_status,
        **_spread(stage, plan),
        "joint_utilisation": plan.joint_utilisation,
        "limiting_limb": name.limb or None,
        "limiting_finger": name.finger,
        "limiting_phalanx": name.phalanx,
        "limiting_limit": name.limit or None,
        "reason": plan.reason,
        "warnings": "; ".join(plan.warnings),
    }


def _spread(stage: RouteStage, plan: Plan | OutOfReach) -> dict[str, Any]:
    """Return the spread of a stage as columns of the table, where it was asked for."""
    if "spread" not in stage.question.want:
        return {}
    spread = plan.spread
    used, factor = (None, None) if spread is None else (spread.utilisation, spread.load_factor)
    return {
        "utilisation_low": used and used.low,
        "utilisation_high": used and used.high,
        "load_factor_low": factor and factor.low,
        "load_factor_high": factor and factor.high,
        "draws": spread and spread.draws,
        "holds": spread and spread.holds,
    }


def draw_route(result: RouteResult) -> Figure:
    """Draw utilisation and load factor, with their spread, over the stages of a climb.

    Parameters
    ----------
    result : RouteResult
        Plans of all stages of the climb.
    """
    index = np.arange(len(result.plans))
    stage_width = 0.32  # that a stage needs [inch]
    wide = float(np.clip(stage_width * len(index), *(11.0, 60.0)))
    figure, (upper, lower) = panel_grid(2, 1, (wide, 6.5), sharex=True)
    used = np.array([plan.utilisation for plan in result.plans], float)
    bands = [_band(result.plans, name) for name in ("utilisation", "load_factor")]
    cap = result.route.limits.utilisation
    # what is far beyond the limit is cut off and written in, so that the rest can be seen
    height = min(float(np.nanmax([*used, *bands[0][1], cap])), 2.0) * 1.1
    colours = [PHASE_COLOURS[stage.phase] for stage in result.stages]
    upper.bar(index, np.nan_to_num(np.minimum(used, height)), color=colours)
    # of what is written in a bar, from its upper end
    bold: dict[str, Any] = {"ha": "center", "weight": "bold"}
    in_bar: dict[str, Any] = {"rotation": 90, "va": "top", "fontsize": 9, **bold}
    on_white: dict[str, Any] = {"facecolor": "white", "edgecolor": "none", "pad": 1.5}
    for i in np.flatnonzero(used > height):
        upper.text(i, 0.97 * height, f"{used[i]:.3g}", color="white", **in_bar)
        gap = np.multiply((0.7, 0.73), height)
        upper.plot([i - 0.5, i + 0.5], gap, color="white", linewidth=3.0)
    for i in index[np.isnan(used)]:
        upper.bar(i, height, color="none", edgecolor=COLOUR_OF["red"], hatch="//")
        upper.text(i, 0.97 * height, result.plans[i].status, bbox=on_white, **in_bar)
    upper.axhline(cap, color=COLOUR_OF["red"], label=f"limit {cap:g}")
    for phase, colour in PHASE_COLOURS.items():
        if any(stage.phase == phase for stage in result.stages):
            upper.bar(0, 0, color=colour, label=phase)
    crux = result.crux
    over = float(np.nanmax([used[crux], bands[0][1, crux], 0.0]))
    place = crux, height if np.isnan(used[crux]) else min(over, height)
    note: dict[str, Any] = {"textcoords": "offset points", "bbox": on_white, **bold}
    upper.annotate("crux", place, xytext=(0, 14), arrowprops={"arrowstyle": "-|>"}, **note)
    upper.set(ylabel="utilisation [1]", ylim=(0.0, height * 1.2))
    figure.suptitle(result.route.name, parse_math=False)
    for axes, band in zip((upper, lower), bands, strict=True):
        _draw_band(axes, band, _of_draws(result.plans))
    upper.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=7, fontsize=8, frameon=False)
    factor = np.array([plan.load_factor for plan in result.plans], float)
    lower.plot(index, factor, "o-", color="0.2")
    lower.axhline(1.0, color=COLOUR_OF["red"])
    for i in np.flatnonzero(np.isnan(factor)):
        answer = result.plans[i]
        text = "unbounded" if answer.load_factor_unbounded else "none"
        text = "not finished" if answer.load_factor_status == "not_finished" else text
        lower.text(i, 0.05, text, rotation=90, ha="center", va="bottom", fontsize=8, color="0.4")
    lower.set(ylabel="load factor [1]", xlabel="stance")
    lower.set_ylim(0.0, 1.1 * float(np.nanmax([*factor, *bands[1][1], 1.0])))
    limbs = [(stage.limb or "").replace("_", " ") for stage in result.stages]
    labels = [
        f"{stage.move} {stage.phase}\n{limb}".strip() if stage.move else "start"
        for stage, limb in zip(result.stages, limbs, strict=True)
    ]
    shown = slice(None, None, math.ceil(stage_width * len(index) / wide))
    lower.set_xticks(index[shown], labels[shown], rotation=90, fontsize=8)
    lower.set_xlim(-1.0, len(index))
    for axes in (upper, lower):
        axes.grid(axis="y", alpha=0.3)
    return figure


def _band(plans: Sequence[Plan | OutOfReach], name: str) -> Array:
    """Return the ends of a spread at every stage, shape (2, n); NaN where there is none."""
    values = [None if plan.spread is None else getattr(plan.spread, name) for plan in plans]
    return np.array([(np.nan, np.nan) if s is None else (s.low, s.high) for s in values]).T


def _of_draws(plans: Sequence[Plan | OutOfReach]) -> str:
    """Return in words what the bands of the spread contain."""
    draws = max((plan.spread.draws for plan in plans if plan.spread is not None), default=0)
    part = "5 to 95 %" if draws >= SPREAD_SETTINGS.many_draws else "all"
    return f"{part} of {draws} draws"


def _draw_band(axes: Any, band: Array, label: str) -> None:
    """Draw a spread along a climb, if there is one; also of a stage between two that have none."""
    if np.isfinite(band).any():
        index = np.arange(band.shape[1])
        axes.fill_between(index, *band, color="0.15", alpha=0.25, linewidth=0.0, label=label)
        axes.vlines(index, *band, color="0.15", linewidth=1.5)
