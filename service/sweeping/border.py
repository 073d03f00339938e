"""Find where a stance stops holding over one variable: between two points, to a tolerance."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Final, NamedTuple

import msgspec

from service.sweeping.design import Design
from service.sweeping.rows import SweepRow

__all__ = ["BORDER_TOLERANCE", "Border", "Held", "borders", "held"]

BORDER_TOLERANCE: Final = 1e-3
"""Tolerance of a border, over the range that varies."""


class Border(msgspec.Struct, frozen=True):
    """Two values next to each other, of which one holds and one does not, as real plans show.

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

    @property
    def words(self) -> str:
        """The border in one sentence; the value shown is on the side that holds."""
        towards = "up to" if self.fails > self.holds else "from"
        unit = "" if self.unit is None else f" {self.unit}"
        whole = self.tolerance >= 1.0 and self.holds.is_integer() and self.fails.is_integer()
        digits = 0 if whole else max(0, 1 - math.floor(math.log10(self.tolerance)))
        return (
            f"holds {towards} {self.path} = {self.holds:.{digits}f}{unit}; at "
            f"{self.fails:.{digits}f} it does not "
            f"(to {self.tolerance:.2g}{unit}, {self.plans} more plans)"
        )


class Held(NamedTuple):
    """An interval of one variable in which points hold; its ends where they stop, interpolated.

    ``low`` or ``high`` is None where it goes on to the end of what varied.
    """

    low: float | None
    high: float | None


def borders(
    design: Design, rows: Sequence[SweepRow], tolerance: float, plan: Callable[[float], SweepRow]
) -> Iterator[Border]:
    """Yield every border that two neighbouring points show, if one number varies alone.

    Parameters
    ----------
    design : Design
    rows : sequence of SweepRow
        Of its points.
    tolerance : float
        Over the range of the number.
    plan : callable
        Plans at one more value.
    """
    place = design.number
    if place is None:
        return
    ordered = sorted(rows, key=lambda row: at(row, place))
    tolerance *= at(ordered[-1], place) - at(ordered[0], place)
    variation, target = design.variations[place], design.targets[place]
    for pair in itertools.pairwise(ordered):
        if "error" not in (pair[0].state, pair[1].state) and pair[0].holds != pair[1].holds:
            holds, fails = sorted(pair, key=lambda row: not row.holds)
            holds, fails, plans = _narrowed(holds, fails, place, target.whole, tolerance, plan)
            ends = at(holds, place), at(fails, place)
            reached = max(tolerance, abs(ends[1] - ends[0]))
            yield Border(variation.path, target.unit, *ends, reached, plans)


def _narrowed(
    holds: SweepRow,
    fails: SweepRow,
    place: int,
    whole: bool,
    tolerance: float,
    plan: Callable[[float], SweepRow],
) -> tuple[SweepRow, SweepRow, int]:
    """Return two rows that are closer: by interpolation, and every third time bisection."""
    enough = max(tolerance, 1.0) if whole else tolerance
    for plans in itertools.count():
        low, high = sorted((at(holds, place), at(fails, place)))
        if high - low <= enough:
            break
        value = 0.5 * (low + high)
        estimate = crossing(holds, fails, place) if plans % 3 < 2 else None
        if estimate is not None:
            # a little beyond it, so that the next plan is likely to be on the other side
            beyond = estimate + math.copysign(0.45 * tolerance, value - estimate)
            least = 0.05 * (high - low)
            value = min(max(beyond, low + least), high - least)
        row = plan(min(max(round(value), low + 1), high - 1) if whole else value)
        if row.state == "error":
            return holds, fails, plans + 1
        holds, fails = (row, fails) if row.holds else (holds, row)
    return holds, fails, plans


def held(rows: Sequence[SweepRow], place: int) -> Iterator[Held]:
    """Yield where rows hold, in the order of a variable, by interpolation between them.

    Parameters
    ----------
    rows : sequence of SweepRow
        That differ in one variable, in its order.
    place : int
        Of that variable in their points.
    """
    groups = [list(group) for _, group in itertools.groupby(rows, lambda row: row.holds)]
    for before, group, after in zip([None, *groups], groups, [*groups[1:], None], strict=False):
        if group[0].holds:
            low = None if before is None else _between(group[0], before[-1], place)
            yield Held(low, None if after is None else _between(group[-1], after[0], place))


def _between(holds: SweepRow, fails: SweepRow, place: int) -> float:
    """Return where utilisation passes its cap between two points, halfway if it is not known."""
    estimate = crossing(holds, fails, place)
    return 0.5 * (at(holds, place) + at(fails, place)) if estimate is None else estimate


def crossing(holds: SweepRow, fails: SweepRow, place: int) -> float | None:
    """Return where utilisation over its cap passes 1 by linear interpolation; None if unknown."""
    if holds.margin is None or fails.margin is None or not fails.margin > holds.margin:
        return None
    share = (1.0 - holds.margin) / (fails.margin - holds.margin)
    start = at(holds, place)
    return start + min(max(share, 0.0), 1.0) * (at(fails, place) - start)


def at(row: SweepRow, place: int) -> float:
    """Return the number that varies in a row."""
    value = row.point[place]
    assert isinstance(value, (int, float))
    return float(value)
