"""Which questions a sweep asks: the points where it varies a request, and the request at each."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Self

import msgspec
import numpy as np

from hand_models.base import InvalidInputError, LimitError
from service.requests import PlanRequest
from service.sweeping.paths import Paths, Steps, Target, put
from service.sweeping.variation import Value, Variation
from service.wire import Format, decode_request

if TYPE_CHECKING:
    from service.answering import Robots

__all__ = ["Design", "Point"]

Point = tuple[Value, ...]
"""A value of each variation."""

MOST_POINTS: Final = 100_000


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
            raise InvalidInputError("something must vary", field="variations")
        asked = msgspec.structs.replace(
            request,
            detail="hands",
            want=["load_factor"],
            draws=[],
            explain=False,
            id=None,
            max_reply_bytes=None,
        )
        paths = Paths(msgspec.json.decode(msgspec.json.encode(asked)))
        targets = tuple(paths.target(each.path) for each in variations)
        _check_apart(variations, targets)
        count = math.prod(len(each.values) for each in variations) if samples is None else samples
        if not 1 <= count <= MOST_POINTS:
            raise LimitError(f"{count:,} points; from 1 to {MOST_POINTS:,} are asked at once")
        whole = tuple(map(_whole_numbers, variations, targets))
        points = (
            tuple(itertools.product(*(each.values for each in whole)))
            if samples is None
            else _hypercube(whole, targets, samples, seed)
        )
        design = cls(whole, targets, points, samples is not None, paths)
        design._check_values(robots)
        return design

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

    def payload(self, point: Point, form: Format = Format.MSGPACK) -> bytes:
        """Return the encoded request at a point."""
        document = self._paths.document
        varied: list[Steps] = []
        for target, value in zip(self.targets, point, strict=True):
            for steps in target.steps:
                put(document, steps, value)
                varied.append(steps)
        self._paths.follow(document, varied)
        return form.encode(document)

    def cap(self, point: Point) -> float:
        """Return the utilisation up to which a point holds."""
        for target, value in zip(self.targets, point, strict=True):
            if target.steps == (CAP,) and isinstance(value, (int, float)):
                return float(value)
        limits: dict[str, Any] = self._paths.document.get("limits", {})
        return float(limits.get("utilisation", 1.0))

    def _check_values(self, robots: Robots | None) -> None:
        """Refuse values that no request can have: of a range its ends tell, of words the names."""
        first = tuple(each.values[0] for each in self.variations)
        for i, each in enumerate(self.variations):
            for value in (each.values[0], each.last) if each.ranged else each.values:
                point = (*first[:i], value, *first[i + 1 :])
                asked = decode_request(self.payload(point, Format.JSON), PlanRequest)
                if isinstance(value, str):
                    _check_word(asked, self.targets[i], robots)


CAP: Final[Steps] = ("limits", "utilisation")


def _check_word(asked: PlanRequest, target: Target, robots: Robots | None) -> None:
    """Refuse a name that nothing has, as of a surface; whatever else is wrong is told later."""
    from service.answering import question, robots_of

    try:
        question(asked, robots_of(None) if robots is None else robots)
    except InvalidInputError as error:
        fields = [
            "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in steps)
            for steps in target.steps
        ]
        if f".{error.field}" in fields:
            raise


def _check_apart(variations: Sequence[Variation], targets: Sequence[Target]) -> None:
    """Refuse a value that would be set twice."""
    met: list[tuple[Steps, str]] = []
    for variation, target in zip(variations, targets, strict=True):
        for steps in target.steps:
            for other, path in met:
                shared = min(len(steps), len(other))
                if steps[:shared] == other[:shared]:
                    raise InvalidInputError(f"varies what {path} varies, too", field=variation.path)
        met += [(steps, variation.path) for steps in target.steps]


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
) -> tuple[Point, ...]:
    from scipy.stats import qmc

    generator = np.random.default_rng(seed)
    drawn = qmc.LatinHypercube(d=len(variations), seed=generator).random(count)
    columns = [
        list(_spread(variation, target, shares.tolist()))
        for variation, target, shares in zip(variations, targets, drawn.T, strict=True)
    ]
    return tuple(zip(*columns, strict=True))


def _spread(variation: Variation, target: Target, shares: Sequence[float]) -> Iterator[Value]:
    """Yield the values of a variation at shares of it in [0, 1)."""
    low, high = variation.values[0], variation.last
    for share in shares:
        if not variation.ranged:
            yield variation.values[int(share * len(variation.values))]
            continue
        assert isinstance(low, (int, float))
        assert isinstance(high, (int, float))
        if target.whole:
            yield int(low) + int(share * (int(high) - int(low) + 1))
        else:
            yield low + share * (high - low)
