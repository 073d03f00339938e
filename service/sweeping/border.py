"""Find the border of feasibility over one variable, by bisection and interpolation."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Final, NamedTuple

import msgspec
import numpy as np

from service.sweeping.design import Design
from service.sweeping.rows import SweepRow

__all__ = ["BORDER_TOLERANCE", "Border", "Held", "borders", "held"]

BORDER_TOLERANCE: Final = 1e-3
"""Default tolerance of a border, as a share of the range that varies."""


class Border(msgspec.Struct, frozen=True):
    """Border of feasibility over one variable: two close values, one feasible and one not.

    Both values have been planned.

    Attributes
    ----------
    path : str
        Path of the request's field that varies.
    unit : str or None
        Unit of the field, if it is known.
    holds : float
        Value at which the stance is feasible.
    fails : float
        Value at which the stance is overloaded or infeasible.
    tolerance : float
        Largest distance of the two values, in the unit: the tolerance that was wanted, or more
        where values are whole numbers or a plan failed.
    plans : int
        Number of plans that the search took, besides the points of the sweep.
    """

    path: str
    unit: str | None
    holds: float
    fails: float
    tolerance: float
    plans: int

    @property
    def words(self) -> str:
        """The border as a sentence, with the feasible value first."""
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
    """Interval of one variable in which the points of a sweep are feasible.

    Attributes
    ----------
    low, high : float or None
        Ends of the interval, interpolated between neighbouring points; None where the interval goes
        on to the end of the range.
    """

    low: float | None
    high: float | None


def borders(
    design: Design, rows: Sequence[SweepRow], tolerance: float, plan: Callable[[float], SweepRow]
) -> Iterator[Border]:
    """Search for the border between any two neighbouring points of which exactly one is feasible.

    Nothing is searched unless exactly one number varies. Points without an answer are passed over.

    Parameters
    ----------
    design : Design
        Points of the sweep.
    rows : sequence of SweepRow
        Results of all points.
    tolerance : float
        Tolerance of a border, as a share of the range that varies.
    plan : callable
        Plans the request at a given value of the variable; returns a `SweepRow`.

    Yields
    ------
    Border
        In the order of the variable.
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
    """Find the intervals of a variable in which rows are feasible, by interpolation between rows.

    Parameters
    ----------
    rows : sequence of SweepRow
        Results that differ in one variable, in the order of this variable.
    place : int
        Index of the variable in the points.

    Yields
    ------
    Held
        Each interval, in the order of the variable.
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
    """Interpolate where the utilisation equals the cap, between a feasible row and another row.

    Parameters
    ----------
    holds : SweepRow
        Feasible row.
    fails : SweepRow
        Row beyond the cap.
    place : int
        Index of the variable in the points.

    Returns
    -------
    float or None
        Value of the variable; None if a utilisation is unknown, or does not grow towards ``fails``.
    """
    if holds.margin is None or fails.margin is None or not fails.margin > holds.margin:
        return None
    ends = at(holds, place), at(fails, place)
    return float(np.interp(1.0, (holds.margin, fails.margin), ends))


def at(row: SweepRow, place: int) -> float:
    """Return a row's value of the variable with the given index, as a float."""
    return float(row.point[place])  # type: ignore[arg-type]
