"""Build the questions of a sweep: points where a request varies, and the request at each."""

from __future__ import annotations

import itertools
import math
import operator
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import msgspec
import numpy as np

from hand_models.base import InvalidInputError, LimitError
from service.requests import PlanRequest
from service.sweeping.paths import Paths, Steps, Target, set_value
from service.sweeping.variation import Value, Variation
from service.wire import Format, decode_request

if TYPE_CHECKING:
    from service.answering import Robots

__all__ = ["Design", "Point"]

Point = tuple[Value, ...]
"""A value of each variation."""


@dataclass(frozen=True)
class Design:
    """Points at which a request is asked, with the fields that vary at each.

    Attributes
    ----------
    variations : tuple of Variation
    targets : tuple of Target
        What their paths mean.
    points : tuple of Point
        Of a grid, the last variation fastest.
    sampled : bool
        Whether they are samples, and no grid.
    """

    variations: tuple[Variation, ...]
    targets: tuple[Target, ...]
    points: tuple[Point, ...]
    sampled: bool
    _paths: Paths

    @classmethod
    def of(
        cls,
        request: PlanRequest,
        variations: Sequence[Variation],
        samples: int | None = None,
        seed: int = 0,
        robots: Robots | None = None,
    ) -> Self:
        """Return a grid of all values, or samples of them.

        Parameters
        ----------
        request : PlanRequest
            What stays as it is. What it wants besides the load factor is left out, and so is every
            explanation.
        variations : sequence of Variation
        samples : int, optional
            Points of a Latin hypercube in place of the grid: of each range they have one value in
            each of so many equal parts, of a list each value as often as another, if that is
            possible.
        seed : int, optional
            Of the samples.
        robots : Robots, optional
            Those that may be asked about; by default those that are bundled.

        Raises
        ------
        InvalidInputError
            If a path means nothing in the request, one variation is within another, or a value
            cannot be.
        LimitError
            If there are too many points.
        """
        if not variations:
            raise InvalidInputError("at least one is needed", field="variations")
        count = math.prod(len(each.values) for each in variations) if samples is None else samples
        most = 100_000
        if not 1 <= count <= most:
            raise LimitError(f"must be 1 to {most:,} points, got {count:,}")
        asked = msgspec.structs.replace(
            request,
            detail="hands",
            want=["load_factor"],
            explain=False,
            id=None,
            max_reply_bytes=None,
        )
        paths = Paths.into(asked)
        targets = tuple(paths.target(each.path) for each in variations)
        _check_apart(variations, targets)
        varied = tuple(map(_whole_numbers, variations, targets))
        if samples is None:
            points = tuple(itertools.product(*(each.values for each in varied)))
        else:
            points = tuple(_hypercube(varied, targets, samples, seed))
        design = cls(varied, targets, points, samples is not None, paths)
        design._check_values(robots)
        return design

    @property
    def count(self) -> int:
        """Number of points."""
        return len(self.points)

    def __iter__(self) -> Iterator[bytes]:
        """Yield the encoded request at each point."""
        return map(self.payload, self.points)

    questions = __iter__

    @property
    def labels(self) -> tuple[str, ...]:
        """Paths with their units, as ``load.mass [kg]``."""
        return tuple(
            each.path if target.unit is None else f"{each.path} [{target.unit}]"
            for each, target in zip(self.variations, self.targets, strict=True)
        )

    @property
    def varying(self) -> list[int]:
        """The places of the variations with more than one value; the first if there is none."""
        return [i for i, each in enumerate(self.variations) if len(each.values) > 1] or [0]

    @property
    def number(self) -> int | None:
        """The place of the one number that varies alone; None where it does not."""
        place, *others = self.varying
        return None if others or not self.variations[place].numbers else place

    def places_of(self, over: Sequence[str]) -> list[int]:
        """Return the places of two variations by their paths.

        Raises
        ------
        InvalidInputError
            If there are none, or they are the same.
        """
        paths = [each.path for each in self.variations]
        if len(over) != 2 or over[0] == over[1] or not {*over} <= {*paths}:
            raise InvalidInputError(
                f"two different ones of {', '.join(paths)} are wanted, got {','.join(over)}"
            )
        return [paths.index(path) for path in over]

    def payload(self, point: Point, form: Format = Format.MSGPACK) -> bytes:
        """Return the encoded request at a point."""
        varied: list[Steps] = []
        for target, value in zip(self.targets, point, strict=True):
            for steps in target.steps:
                set_value(self._paths.document, steps, value)
            varied += target.steps
        self._paths.follow(varied)
        return form.encode(self._paths.document)

    def cap(self, point: Point) -> float:
        """Return the utilisation up to which a point holds."""
        for target, value in zip(self.targets, point, strict=True):
            is_cap = target.steps == (("limits", "utilisation"),)
            if is_cap and isinstance(value, (int, float)):
                return float(value)
        return float(self._paths.document["limits"]["utilisation"])

    def _check_values(self, robots: Robots | None) -> None:
        """Refuse values that no request can have; check a range by its ends, and words as names."""
        from service.answering import question, robots_of

        first = tuple(each.values[0] for each in self.variations)
        for i, each in enumerate(self.variations):
            for value in (each.values[0], each.values[-1]) if each.ranged else each.values:
                point = (*first[:i], value, *first[i + 1 :])
                asked = decode_request(self.payload(point, Format.JSON), PlanRequest)
                if not isinstance(value, str):
                    continue
                try:
                    question(asked, robots or robots_of(None))
                except InvalidInputError as error:
                    # whatever else is wrong is an error at its point
                    if f".{error.field}" in map(_dotted, self.targets[i].steps):
                        raise


def _dotted(steps: Steps) -> str:
    """Return steps as the field of an error has them, after a dot."""
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in steps)


def _check_apart(variations: Sequence[Variation], targets: Sequence[Target]) -> None:
    """Refuse a value that would be set twice."""
    ends = [
        (steps, each.path)
        for each, target in zip(variations, targets, strict=True)
        for steps in target.steps
    ]
    for (first, path), (steps, again) in itertools.combinations(ends, 2):
        if all(map(operator.eq, first, steps)):
            raise InvalidInputError(f"varies the same field as {path}", field=again)


def _whole_numbers(variation: Variation, target: Target) -> Variation:
    """Return a variation whose values are whole where those of its field are."""
    if not target.whole or not variation.numbers:
        return variation
    values = [float(value) for value in variation.values]  # type: ignore[arg-type]
    if any(not value.is_integer() for value in values):
        raise InvalidInputError(
            f"takes whole numbers, got {', '.join(f'{value:g}' for value in values[:9])}",
            field=variation.path,
        )
    return Variation(variation.path, tuple(map(int, values)), variation.ranged)


def _hypercube(
    variations: Sequence[Variation], targets: Sequence[Target], count: int, seed: int
) -> Iterator[Point]:
    """Yield points of a Latin hypercube over the values."""
    from scipy.stats import qmc

    generator = np.random.default_rng(seed)
    for shares in qmc.LatinHypercube(d=len(variations), seed=generator).random(count).tolist():
        yield tuple(map(_value_at, variations, targets, shares))


def _value_at(variation: Variation, target: Target, share: float) -> Value:
    """Return the value of a variation at a share of it in [0, 1)."""
    if not variation.ranged:
        return variation.values[int(share * len(variation.values))]
    low, high = variation.values[0], variation.values[-1]
    assert isinstance(low, (int, float))
    assert isinstance(high, (int, float))
    if target.whole:
        return int(low) + int(share * (int(high) - int(low) + 1))
    return low + share * (high - low)
