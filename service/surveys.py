"""A floating hand's search, as JSON and as a table."""

from __future__ import annotations

from collections import Counter
from typing import Any

from rich.console import Console

from hand_models.wrench_space import Row
from planner.wrist_survey import Survey
from service.replies import AXES
from service.tables import table_of

__all__ = ["print_survey", "survey_json"]


def survey_json(survey: Survey) -> dict[str, Any]:
    """Return the search as JSON has it: extreme wrenches, poses, and what lets go at each."""
    found = survey.found
    return {
        "tried": found.tried,
        "held": found.held,
        "wrenches": found.wrenches.tolist(),
        "twists": found.poses.tolist(),
        "limiting": [_limit(row) for row in found.limiting],
        "ends": {
            name: None
            if end is None
            else {
                "reach": end.reach,
                "wrench": end.wrench.tolist(),
                "twist": end.twist.tolist(),
                "limiting": _limit(end.limiting),
            }
            for name, end in zip(_names(), survey.ends, strict=True)
        },
    }


def _names() -> list[str]:
    return [f"{sign}{axis}" for axis in AXES for sign in "+-"]


def _limit(row: Row | None) -> dict[str, str | None] | None:
    if row is None:
        return None
    return {"finger": row.finger, "phalanx": row.phalanx, "limit": row.limit}


def print_survey(survey: Survey, out: Console) -> None:
    """Print how far the hand goes along each axis, and which tiles let go first."""
    found = survey.found
    out.print(
        f"search: at {found.held} of {found.tried} poses of the wrist nothing lets go; "
        f"{len(found.poses)} extreme wrenches",
        markup=False,
    )
    table = table_of("axis")
    table.add_column("reach", justify="right")
    for name in ("finger", "phalanx", "limit"):
        table.add_column(name)
    for name, end in zip(_names(), survey.ends, strict=True):
        unit = "N" if name[1] == "f" else "N·m"
        if end is None:
            table.add_row(f"{name} {unit}", "-", "", "", "")
            continue
        row = end.limiting
        cells = ("-",) * 3 if row is None else (row.finger or "-", row.phalanx or "-", row.limit)
        table.add_row(f"{name} {unit}", f"{end.reach:.2f}", *cells)
    out.print(table)
    failing = Counter(
        "a tile dragged backwards or the palm"
        if row is None
        else " ".join(part for part in (row.finger, row.phalanx) if part) or row.limit
        for row in found.limiting
    )
    listed = ", ".join(f"{name} {count}" for name, count in failing.most_common())
    out.print(f"what lets go first at the extreme wrenches: {listed}", markup=False)
