"""Where a stance stops holding over one variable: between two points, and found to a tolerance."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import msgspec

from service.sweeping.evaluation import Row

__all__ = ["TOLERANCE", "Along", "Border", "Held", "border_in_words", "borders", "held"]

TOLERANCE: Final = 1e-3
"""Of a border, over the range that varies."""


class Border(msgspec.Struct, frozen=True):
    """Two values next to each other, of which real plans tell that one holds and one does not.

    Attributes
    ----------
    path : str
    unit : str or None
    holds, fails : float
        No farther apart than the tolerance.
    tolerance : float
        In the unit; what it was asked for, but where whole numbers or a point without an answer
        leave more.
    plans : int
        That were needed to find it, beside the points.
    """

    path: str
    unit: str | None
    holds: float
    fails: float
    tolerance: float
    plans: int


class Along(NamedTuple):
    """A number that varies: its place in points, its path, its unit, and if it is a whole one."""

    place: int
    path: str
    unit: str | None
    whole: bool


class Held(NamedTuple):
    """An interval of one variable in which points hold; its ends where they stop, interpolated.

    ``low`` or ``high`` is None where it goes on to the end of what varied.
    """

    low: float | None
    high: float | None


def borders(
    rows: Sequence[Row], along: Along, tolerance: float, plan: Callable[[float], Row]
) -> list[Border]:
    """Return every border over one variable that two neighbouring points show.

    Parameters
    ----------
    rows : sequence of Row
        In the order of the variable.
    along : Along
        What varies.
    tolerance : float
        In its unit.
    plan : callable
        Plans at one more value.
    """
    found = []
    for before, after in itertools.pairwise(rows):
        if "error" in (before.state, after.state) or before.holds == after.holds:
            continue
        first, last = (before, after) if before.holds else (after, before)
        found.append(_narrowed(first, last, along, tolerance, plan))
    return found


def _narrowed(
    held: Row, failed: Row, along: Along, tolerance: float, plan: Callable[[float], Row]
) -> Border:
    """Return a border between two points: by interpolation, and every third time bisection."""
    plans, place = 0, along.place
    enough = max(tolerance, 1.0) if along.whole else tolerance
    while (gap := abs(_at(failed, place) - _at(held, place))) > enough:
        low, high = sorted((_at(held, place), _at(failed, place)))
        value = 0.5 * (low + high)
        estimate = crossing(held, failed, place) if plans % 3 < 2 else None
        if estimate is not None:
            # a little beyond it, so that the next plan is likely to be on the other side
            step = math.copysign(0.45 * tolerance, value - estimate)
            value = min(max(estimate + step, low + 0.05 * gap), high - 0.05 * gap)
        if along.whole:
            value = min(max(round(value), low + 1), high - 1)
        row = plan(value)
        plans += 1
        if row.state == "error":
            break
        held, failed = (row, failed) if row.holds else (held, row)
    ends = _at(held, place), _at(failed, place)
    reached = max(tolerance, abs(ends[1] - ends[0]))
    return Border(along.path, along.unit, *ends, reached, plans)


def held(rows: Sequence[Row], place: int) -> list[Held]:
    """Return where rows hold, in the order of a variable, by interpolation between them.

    Parameters
    ----------
    rows : sequence of Row
        That differ in one variable, in its order.
    place : int
        Of that variable in their points.
    """
    found: list[Held] = []
    low: float | None = None
    inside = False
    for i, row in enumerate(rows):
        if row.holds and not inside:
            inside, low = True, None if i == 0 else between(row, rows[i - 1], place)
        elif not row.holds and inside:
            inside = False
            found.append(Held(low, between(rows[i - 1], row, place)))
    return [*found, Held(low, None)] if inside else found


def between(held: Row, failed: Row, place: int) -> float:
    """Return where utilisation passes its cap between two points, halfway if it is not known."""
    estimate = crossing(held, failed, place)
    return 0.5 * (_at(held, place) + _at(failed, place)) if estimate is None else estimate


def crossing(held: Row, failed: Row, place: int) -> float | None:
    """Return where utilisation over its cap passes 1 by linear interpolation; None if unknown."""
    if held.margin is None or failed.margin is None or not failed.margin > held.margin:
        return None
    share = (1.0 - held.margin) / (failed.margin - held.margin)
    start = _at(held, place)
    return start + min(max(share, 0.0), 1.0) * (_at(failed, place) - start)


def _at(row: Row, place: int) -> float:
    value = row.point[place]
    assert isinstance(value, (int, float))
    return float(value)


def border_in_words(border: Border) -> str:
    """Return a border in one sentence; the value told is on the side that holds."""
    towards = "up to" if border.fails > border.holds else "from"
    unit = "" if border.unit is None else f" {border.unit}"
    whole = border.tolerance >= 1.0 and border.holds.is_integer() and border.fails.is_integer()
    digits = 0 if whole else max(0, 1 - math.floor(math.log10(border.tolerance)))
    values = [f"{value:.{digits}f}" for value in (border.holds, border.fails)]
    return (
        f"holds {towards} {border.path} = {values[0]}{unit}; at {values[1]} it does not "
        f"(to {border.tolerance:.2g}{unit}, {border.plans} more plans)"
    )
