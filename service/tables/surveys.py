"""What a hand carries elsewhere: a floating one's search, a fixed one where it is not quite put."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any, Final

from rich.console import Console

from hand_models.finger import PHALANGES
from hand_models.hand import FINGERS, NAIL
from hand_models.wrench_spaces import Row
from planner import Survey
from service.replies import AXES
from service.tables.layout import in_order, name, number, print_rows, text, unit_of

__all__ = ["print_failures", "print_survey", "survey_json"]

DRAGGED: Final = "a tile dragged backwards"
"""What ends the way where no limit does: a part that can only push or only pull is about to do the
other, which is a tile nearly always."""

WHOLE: Final = "finger"
"""Column of a finger's limits that are no tile's."""

ORDER: Final = (WHOLE, "base", *PHALANGES, NAIL)
"""Of the columns of a finger's parts."""


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
    _print_ends(survey, out)
    if found.limiting:
        print_failures(found.limiting, out)


def _print_ends(survey: Survey, out: Console) -> None:
    """Print where the hand lets go along each axis."""
    columns = (
        name("axis", lambda row: f"{row[0]} {unit_of(row[0][1:])}"),
        number("reach", "1.reach", ".2f"),
        *(text(part, f"1.limiting.{part}") for part in ("finger", "phalanx", "limit")),
    )
    print_rows(zip(_names(), survey.ends, strict=True), columns, out)
    if any(end is None for end in survey.ends):
        out.print("reach -: no way along the axis was found that holds", markup=False)
    if any(end is not None and end.limiting is None for end in survey.ends):
        out.print(
            f"limit -: no limit binds there; the way ends at {DRAGGED}, or where the search "
            "stopped",
            markup=False,
        )


def print_failures(limiting: Sequence[Row | None], out: Console) -> None:
    """Print how often each tile of each finger lets go first, and what is no finger's."""
    counts = Counter((None, DRAGGED) if row is None else _place(row) for row in limiting)
    parts = [part for part in ORDER if any(finger and what == part for finger, what in counts)]
    rows = []
    for finger in FINGERS:
        own = [counts[finger, part] for part in parts]
        rows.append((finger, *(count or "-" for count in own), sum(own)))
    for (other, what), count in counts.items():
        if other is None:
            rows.append((what, *[""] * len(parts), count))
    columns = in_order([""], [*parts, "all"])
    title = f"what lets go first, at how many of {len(limiting)}"
    print_rows(rows, columns, out, title)


def _place(row: Row) -> tuple[str | None, str]:
    """Return finger and part of a limit; for what is no finger's, the limit in words."""
    if row.finger is None:
        return None, row.limit.replace("_", " ")
    return row.finger, row.phalanx or WHOLE
