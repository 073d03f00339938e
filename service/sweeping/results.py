"""A sweep: its rows, its table as CSV, its summary, and where it stops holding."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec

from hand_models.base import InvalidInputError
from hand_models.parameters import ParameterTable
from service.bulk import write_csv
from service.requests import PlanRequest
from service.sweeping.border import BORDER_TOLERANCE, Border, borders
from service.sweeping.design import Design
from service.sweeping.rows import SweepRow, asking, rows_at, sweep_columns
from service.sweeping.variation import Variation

if TYPE_CHECKING:
    from distributed import Client

    from planner import RobotFile

__all__ = ["Sweep", "sweep", "with_borders"]


class Sweep(NamedTuple):
    """Results of plans while fields of a request vary.

    Attributes
    ----------
    design : Design
        What varies, and where.
    rows : tuple of SweepRow
        In the order of the design's points.
    borders : tuple of Border
        Where it stops holding, over one variable.
    """

    design: Design
    rows: tuple[SweepRow, ...]
    borders: tuple[Border, ...] = ()

    @property
    def counts(self) -> dict[str, int]:
        """Number of points of each status."""
        found = Counter(row.status for row in self.rows)
        statuses = ("optimal", "overloaded", "infeasible", "failed", "error")
        return {status: found[status] for status in statuses}

    @property
    def extremes(self) -> tuple[SweepRow, ...]:
        """The points of least and of most utilisation; none where no point has one."""
        rows = [row for row in self.rows if row.utilisation is not None]
        return tuple(
            pick(rows, key=lambda row: row.utilisation or 0.0) for pick in (min, max) if rows
        )

    def write_table(self, path: Path) -> None:
        """Write a row for each point, as CSV.

        Raises
        ------
        OSError
            If it cannot be written.
        """
        write_csv(path, sweep_columns(self.design), (row.cells for row in self.rows))

    def summary(self) -> dict[str, Any]:
        """Return what a program needs to know: what varied, how many hold, and the borders."""
        variations, sampled = self.design.variations, self.design.sampled
        paths = [each.path for each in variations]
        ends: list[Any] = [
            {"at": dict(zip(paths, row.point, strict=True)), "utilisation": row.utilisation}
            for row in self.extremes
        ] or [None, None]
        values = [
            {"low": each.values[0], "high": each.values[-1]}
            if sampled and each.ranged
            else each.values
            for each in variations
        ]
        return {
            "v": 1,
            "variations": [
                {"path": path, "unit": target.unit, "values": given}
                for path, target, given in zip(paths, self.design.targets, values, strict=True)
            ],
            "points": len(self.design.points),
            "answered": sum(row.answered for row in self.rows),
            "statuses": self.counts,
            "errors": dict(Counter(row.error.kind for row in self.rows if row.error is not None)),
            "least_utilisation": ends[0],
            "most_utilisation": ends[1],
            "borders": [
                msgspec.structs.asdict(each) | {"words": each.words} for each in self.borders
            ],
        }


def with_borders(
    design: Design, rows: Sequence[SweepRow], robot: RobotFile | None, tolerance: float
) -> Sweep:
    """Return a sweep of which every point is answered, with its borders, which take more plans."""
    ask = asking(1, 1, robot)

    def plan(value: float) -> SweepRow:
        point = list(design.points[0])
        point[place] = int(value) if design.targets[place].whole else value
        (row,) = rows_at(design, [tuple(point)], ask)
        return row

    place = design.number or 0
    return Sweep(design, tuple(rows), tuple(borders(design, rows, tolerance, plan)))


def sweep(
    request: PlanRequest,
    variations: Sequence[Variation | str],
    *,
    samples: int | None = None,
    seed: int = 0,
    workers: int | None = None,
    on: str | Client | None = None,
    hand: ParameterTable | None = None,
    robot: RobotFile | None = None,
    progress: Callable[[int, int], None] | None = None,
    tolerance: float = BORDER_TOLERANCE,
) -> Sweep:
    """Return the results of plans while fields of a request vary.

    Parameters
    ----------
    request : PlanRequest
    variations : sequence of Variation or str
        As ``load.mass=60:120:7`` or ``hands.front_left.surface=rock,concrete-fine``.
    samples : int, optional
        Points of a Latin hypercube, in place of the grid of all values.
    seed : int, optional
        Of the samples.
    workers : int, optional
        Processes; by default as many as are worth it.
    on : str or distributed.Client, optional
        As of `service.bulk.evaluate`; by default processes, where they are worth it.
    hand : ParameterTable, optional
        Entries in which hands are not the bundled one.
    robot : RobotFile, optional
        In place of the bundled ones.
    progress : callable, optional
        Called with (points done, points in all).
    tolerance : float, optional
        Of the border over one variable, over the range that varies.

    Raises
    ------
    InvalidInputError
        If a path means nothing in the request, or a value cannot be. What is wrong at some points
        only is reported in their rows.
    LimitError
        If there are too many points.
    """
    from service.answering import robots_of, with_hand, with_robot

    if not tolerance > 0.0:
        raise InvalidInputError(f"must be above 0, got {tolerance:g}", field="tolerance")
    chosen = [
        each if isinstance(each, Variation) else Variation.parse(each, sampled=samples is not None)
        for each in variations
    ]
    asked = with_robot(with_hand(request, hand), robot)
    design = Design.of(asked, chosen, samples, seed, robots_of(robot))
    report, total = progress or (lambda *_: None), len(design.points)
    report(0, total)
    rows = []
    for row in rows_at(design, design.points, asking(total, workers, robot, on)):
        rows.append(row)
        report(len(rows), total)
    return with_borders(design, rows, robot, tolerance)
