"""A sweep: its rows, its table as CSV, its summary, and where it stops holding."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import msgspec

from hand_models.base import InvalidInputError, whole_file
from hand_models.parameters import ParameterTable
from service.requests import PlanRequest
from service.sweeping.border import TOLERANCE, Along, Border, border_in_words, borders
from service.sweeping.design import Design
from service.sweeping.evaluation import Ask, Row, asking, rows_at
from service.sweeping.table import table_text
from service.sweeping.variation import Value, Variation

if TYPE_CHECKING:
    from distributed import Client

    from planner import RobotFile

__all__ = ["Sweep", "sweep", "swept"]

STATUSES: Final = ("optimal", "overloaded", "infeasible", "failed", "error")


class Sweep(NamedTuple):
    """What plans come to where fields of a request vary.

    Attributes
    ----------
    design : Design
        What varies, and where.
    rows : tuple of Row
        In the order of the design's points.
    borders : tuple of Border
        Where it stops holding, over one variable.
    """

    design: Design
    rows: tuple[Row, ...]
    borders: tuple[Border, ...] = ()

    @property
    def counts(self) -> dict[str, int]:
        """How many points there are of each status."""
        found = Counter(row.status for row in self.rows)
        return {status: found[status] for status in STATUSES}

    def write_table(self, path: Path) -> None:
        """Write a row for each point, as CSV.

        Raises
        ------
        OSError
            If it cannot be written.
        """
        with whole_file(path) as part:
            part.write_text(table_text(self.design, self.rows), encoding="utf-8")

    def summary(self) -> dict[str, Any]:
        """Return what a program needs to know: what varied, how many hold, and the borders."""
        rows = [row for row in self.rows if row.utilisation is not None]
        least, most = (
            pick(rows, key=lambda row: row.utilisation or 0.0, default=None) for pick in (min, max)
        )
        design = self.design
        return {
            "v": 1,
            "variations": [
                {"path": each.path, "unit": target.unit, "values": _span(each, design.sampled)}
                for each, target in zip(design.variations, design.targets, strict=True)
            ],
            "points": len(design.points),
            "answered": sum(row.answered for row in self.rows),
            "statuses": self.counts,
            "errors": dict(Counter(row.error.kind for row in self.rows if row.error is not None)),
            "least_utilisation": None if least is None else _brief(least, design),
            "most_utilisation": None if most is None else _brief(most, design),
            "borders": [
                msgspec.structs.asdict(each) | {"words": border_in_words(each)}
                for each in self.borders
            ],
        }


def _span(variation: Variation, sampled: bool) -> dict[str, float] | tuple[Value, ...]:
    """Return the values of a variation, or between what samples of it are."""
    if sampled and variation.ranged:
        return {"low": variation.values[0], "high": variation.last}  # type: ignore[dict-item]
    return variation.values


def _brief(row: Row, design: Design) -> dict[str, Any]:
    paths = (each.path for each in design.variations)
    return {"at": dict(zip(paths, row.point, strict=True)), "utilisation": row.utilisation}


def swept(design: Design, rows: Sequence[Row], ask: Ask, tolerance: float) -> Sweep:
    """Return a sweep of which every point is answered, with its borders, which take more plans."""
    return Sweep(design, tuple(rows), tuple(_borders(design, rows, ask, tolerance)))


def has_borders(design: Design) -> bool:
    """Whether one number varies, and nothing else."""
    place, *others = design.varying
    return not others and design.variations[place].numbers


def _borders(design: Design, rows: Sequence[Row], ask: Ask, tolerance: float) -> Iterator[Border]:
    """Yield the borders over a number that alone varies."""
    if not has_borders(design):
        return
    (place,) = design.varying
    variation, target = design.variations[place], design.targets[place]
    unique: Mapping[Any, Row] = {row.point[place]: row for row in rows}
    ordered = [unique[value] for value in sorted(unique)]
    range_ = float(max(unique)) - float(min(unique))
    if not range_ > 0.0:
        return

    def plan(value: float) -> Row:
        point = list(ordered[0].point)
        point[place] = int(value) if target.whole else value
        (row,) = rows_at(design, [tuple(point)], ask)
        return row

    along = Along(place, variation.path, target.unit, target.whole)
    yield from borders(ordered, along, tolerance * range_, plan)


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
    tolerance: float = TOLERANCE,
) -> Sweep:
    """Return what plans come to where fields of a request vary.

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
        only is told in their rows.
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
    rows: list[Row] = []
    total = len(design.points)
    with asking(total, workers, robot, on) as ask:
        if progress is not None:
            progress(0, total)
        for row in rows_at(design, design.points, ask):
            rows.append(row)
            if progress is not None:
                progress(len(rows), total)
        return swept(design, rows, ask, tolerance)
