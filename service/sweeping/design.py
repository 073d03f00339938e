"""Design of a sweep: the points, a grid or Latin hypercube samples, and the request at each."""

from __future__ import annotations

import itertools
import math
import operator
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import msgspec
import numpy as np

from hand_models.base import InvalidInputError, LimitError
from service.requests import PlanRequest
from service.sweeping.paths import Paths, Target
from service.sweeping.variation import Value, Variation
from service.wire import Format, decode_request, dotted

if TYPE_CHECKING:
    from service.answering import Robots

__all__ = ["Design", "Point"]

Point = tuple[Value, ...]
"""Point of a sweep: one value for each variation."""


@dataclass(frozen=True)
class Design:
    """Points of a sweep, and the request at each point.

    Attributes
    ----------
    variations : tuple of Variation
        Fields that vary, with their values.
    targets : tuple of Target
        Places in the request that the paths of the variations lead to.
    points : tuple of Point
        Values of all variations at each point; in a grid the last variation varies fastest.
    sampled : bool
        True for samples of a Latin hypercube, false for a grid.
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
        """Build the points of a sweep: a grid of all values, or a Latin hypercube of samples.

        Parameters
        ----------
        request : PlanRequest
            Request in which the fields vary. Its plans have the load factor, no other extras and no
            explanation.
        variations : sequence of Variation
            Fields that vary, with their values.
        samples : int, optional
            Number of Latin hypercube samples, in place of the grid. A range has one sample in each
            of as many equal parts; the values of a list occur equally often, as far as possible.
        seed : int, optional
            Seed of the random numbers.
        robots : Robots, optional
            Robots that the request may name; bundled robots by default.

        Raises
        ------
        InvalidInputError
            If a path leads to no field, two variations set the same field, or a value is invalid.
        LimitError
            If there are too many points.
        """
        if not variations:
            raise InvalidInputError(
                "at least one is needed, got none; give a Variation", field="variations"
            )
        count = math.prod(len(each.values) for each in variations) if samples is None else samples
        most = 100_000
        if not 1 <= count <= most:
            change = "give fewer values" if samples is None else "change samples"
            raise LimitError(f"must be 1 to {most:,} points, got {count:,}: {change}")
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
        _check_apart(targets)
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
        """Yield the request at each point, encoded as MessagePack."""
        return map(self.payload, self.points)

    questions = __iter__

    @property
    def labels(self) -> tuple[str, ...]:
        """Path and unit of each variation, such as ``load.mass [kg]``."""
        return tuple(target.label for target in self.targets)

    @property
    def varying(self) -> list[int]:
        """Indices of the variations with more than one value; ``[0]`` if there is none."""
        return [i for i, each in enumerate(self.variations) if len(each.values) > 1] or [0]

    @property
    def number(self) -> int | None:
        """Index of the variation, if exactly one varies and its values are numbers; else None."""
        place, *others = self.varying
        return None if others or not self.variations[place].numbers else place

    def places_of(self, over: Sequence[str]) -> list[int]:
        """Return the indices of two variations.

        Parameters
        ----------
        over : sequence of str, length 2
            Paths of the two variations.

        Raises
        ------
        InvalidInputError
            If the paths are not two different variations of this design.
        """
        paths = [each.path for each in self.variations]
        if len(paths) == 1:
            raise InvalidInputError(
                f"requires two varied fields; only {paths[0]} varies: vary another too, or leave "
                "this out"
            )
        if len(over) != 2 or over[0] == over[1] or not {*over} <= {*paths}:
            raise InvalidInputError(
                f"two different ones of {', '.join(paths)} are wanted, got {','.join(over)}"
            )
        return [paths.index(path) for path in over]

    def payload(self, point: Point, form: Format = Format.MSGPACK) -> bytes:
        """Return the encoded request at a point.

        Parameters
        ----------
        point : Point
            A value for each variation.
        form : Format, optional
            Encoding of the request.

        Returns
        -------
        bytes
            The request of the sweep, with the values of the point in it.
        """
        return form.encode(self._document(point))

    def cap(self, point: Point) -> float:
        """Return the cap on the utilisation at a point, up to which the stance is feasible."""
        return float(self._document(point)["limits"]["utilisation"])

    def _document(self, point: Point) -> dict[str, Any]:
        """Return the request at a point as plain lists and dicts; the next call changes it."""
        pairs = zip(self.targets, point, strict=True)
        self._paths.set_values({at: value for target, value in pairs for at in target.steps})
        return self._paths.document

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
                    if f".{error.field}" in map(dotted, self.targets[i].steps):
                        raise


def _check_apart(targets: Sequence[Target]) -> None:
    """Refuse a value that would be set twice."""
    ends = [(steps, target.path) for target in targets for steps in target.steps]
    for (first, path), (steps, again) in itertools.combinations(ends, 2):
        if all(map(operator.eq, first, steps)):
            same = "is given twice" if path == again else f"varies the same field as {path}"
            raise InvalidInputError(f"{same}; vary the field once", field=again)


def _whole_numbers(variation: Variation, target: Target) -> Variation:
    """Return a variation whose values are whole where those of its field are."""
    if not target.whole or not variation.numbers:
        return variation
    values = [float(value) for value in variation.values]  # type: ignore[arg-type]
    if any(not value.is_integer() for value in values):
        given = ", ".join(f"{value:g}" for value in values[:9])
        raise InvalidInputError(f"takes whole numbers, got {given}", field=variation.path)
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
    low, high = variation.values[0], variation.values[-1]
    if variation.ranged and not target.whole:
        return low + share * (high - low)  # type: ignore[operator]
    choices = range(low, high + 1) if variation.ranged else variation.values  # type: ignore[arg-type, operator]
    return choices[int(share * len(choices))]
