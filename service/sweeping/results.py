"""Run a sweep, and return its rows, borders, table and summary."""

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
    """Results of a sweep.

    Attributes
    ----------
    design : Design
        Fields that vary, and the points.
    rows : tuple of SweepRow
        Result of each point, in the order of the design's points.
    borders : tuple of Border
        Borders between feasible and other points; empty unless exactly one number varies.
    """

    design: Design
    rows: tuple[SweepRow, ...]
    borders: tuple[Border, ...] = ()

    @property
    def counts(self) -> dict[str, int]:
        """Number of points by status: optimal, overloaded, infeasible, failed and error."""
        none = dict.fromkeys(("optimal", "overloaded", "infeasible", "failed", "error"), 0)
        return none | Counter(row.status for row in self.rows)

    @property
    def extremes(self) -> tuple[SweepRow, ...]:
        """Rows with the least and the largest utilisation; empty if no row has a utilisation."""
        used = {row.utilisation: row for row in self.rows[::-1] if row.utilisation is not None}
        return (used[min(used)], used[max(used)]) if used else ()

    def write_table(self, path: Path) -> None:
        """Write the rows as a CSV file.

        Parameters
        ----------
        path : Path
            File to write.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        write_csv(path, sweep_columns(self.design), (row.cells for row in self.rows))

    def summary(self) -> dict[str, Any]:
        """Summarise the sweep as JSON values.

        Returns
        -------
        dict
            Variations, number of points, of answers and of each status, errors by kind, the points
            of least and largest utilisation, and the borders.
        """
        design = self.design
        paths = [each.path for each in design.variations]
        ends: list[Any] = [
            {"at": dict(zip(paths, row.point, strict=True)), "utilisation": row.utilisation}
            for row in self.extremes
        ] or [None, None]
        varied = []
        for each, target in zip(design.variations, design.targets, strict=True):
            low_high = {"low": each.values[0], "high": each.values[-1]}
            values = low_high if design.sampled and each.ranged else each.values
            varied.append({"path": each.path, "unit": target.unit, "values": values})
        return {
            "v": 1,
            "variations": varied,
            "points": design.count,
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
    """Search for the borders of feasibility of a design whose points are all planned.

    Parameters
    ----------
    design : Design
        Points of the sweep.
    rows : sequence of SweepRow
        Result of each point.
    robot : RobotFile or None
        The only robot that is planned for; None for the bundled robots.
    tolerance : float
        Tolerance of a border, as a share of the range that varies.

    Returns
    -------
    Sweep
        The rows with the borders. If exactly one number varies, the search has planned some more
        points in this process.
    """
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
    """Plan a stance at all points of a sweep, and find the borders of feasibility.

    Parameters
    ----------
    request : PlanRequest
        Request in which fields vary.
    variations : sequence of Variation or str
        Fields that vary, as ``load.mass=60:120:7`` or
        ``hands.front_left.surface=rock,concrete-fine``.
    samples : int, optional
        Number of Latin hypercube samples, in place of the grid of all values.
    seed : int, optional
        Seed of the random numbers.
    workers : int, optional
        Number of processes; by default one for few points, and one for each core for many.
    on : str or distributed.Client, optional
        Where points are planned: ``processes``, ``here``, ``dask:local``, the address of a Dask
        scheduler, or its client; by default ``here`` for one worker, otherwise ``processes``.
    hand : ParameterTable, optional
        Hand parameters that differ from the bundled hand.
    robot : RobotFile, optional
        The only robot that is planned for; by default the bundled robots.
    progress : callable, optional
        Called with (points done, points in all).
    tolerance : float, optional
        Tolerance of a border, as a share of the range that varies.

    Returns
    -------
    Sweep
        A point whose request is invalid, or whose plan failed, has its error in its row.

    Raises
    ------
    InvalidInputError
        If a path leads to no field of the request, or a value is invalid.
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
    report, total = progress or (lambda *_: None), design.count
    report(0, total)
    rows = []
    for row in rows_at(design, design.points, asking(total, workers, robot, on)):
        rows.append(row)
        report(len(rows), total)
    return with_borders(design, rows, robot, tolerance)
