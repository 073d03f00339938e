"""How far two answers are apart: numbers by the largest of their kind, sets without order."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from tests.suite.helpers.requests import dotted

__all__ = ["MISSING", "Difference", "differences", "kind_of", "scales", "worst"]

KINDS = {
    "shear": "force",
    "normal": "force",
    "lateral": "force",
    "gap": "utilisation",
}
"""Fields that are measured as others are."""

SMALLEST = 1e-2
"""Least size that a kind's numbers are measured by, in SI units: below it all is rounding."""

SETS = {
    *("vertices", "half_spaces", "inner", "outer", "hull_vertices", "full_hull_vertices"),
    *("prices", "effort_prices", "blocking", "irreducible", "sufficient", "limiting"),
}
"""Fields whose rows have no order."""

MISSING = "(missing)"

Path = tuple[str | int, ...]


class Difference(NamedTuple):
    """What differs between two answers.

    ``size`` is relative to the largest number of its kind; infinite for what is no number.
    """

    path: str
    expected: Any
    got: Any
    size: float

    @property
    def names(self) -> list[str]:
        """Of the fields that it is in."""
        return re.split(r"[.\[]", self.path)

    @property
    def field(self) -> str:
        """Path without the places in lists."""
        return re.sub(r"\[\d+\]", "", self.path).lstrip(".")

    def __str__(self) -> str:
        return f"{self.path}: expected {self.expected!r}, got {self.got!r} ({self.size:.1e})"


def differences(expected: Any, got: Any) -> list[Difference]:
    """Return all that differs between two answers, however little.

    Parameters
    ----------
    expected, got : dict
        Of `answers.told`.
    """
    return list(_apart(expected, got, (), scales(expected)))


def scales(answer: Any) -> dict[str, float]:
    """Return the largest number of each kind in an answer, `SMALLEST` at least."""
    largest: dict[str, float] = defaultdict(lambda: SMALLEST)
    for path, value in _leaves(answer):
        if _is_number(value):
            kind = kind_of(path)
            largest[kind] = max(largest[kind], abs(value))
    return largest


def worst(found: list[Difference]) -> float:
    """Return the size of the largest difference; zero where there is none."""
    return max((each.size for each in found), default=0.0)


def _apart(expected: Any, got: Any, path: Path, scales: dict[str, float]) -> Iterator[Difference]:
    if isinstance(expected, dict) and isinstance(got, dict):
        for key in sorted({*expected, *got}):
            if key in expected and key in got:
                yield from _apart(expected[key], got[key], (*path, key), scales)
            else:
                pair = expected.get(key, MISSING), got.get(key, MISSING)
                yield Difference(dotted((*path, key)), *pair, math.inf)
    elif isinstance(expected, list) and isinstance(got, list):
        if path and path[-1] in SETS:
            yield from _unmatched(expected, got, path, scales, "got")
            yield from _unmatched(got, expected, path, scales, "expected")
        elif len(expected) != len(got):
            yield Difference(dotted(path) + ".length", len(expected), len(got), math.inf)
        else:
            for i, pair in enumerate(zip(expected, got, strict=True)):
                yield from _apart(*pair, (*path, i), scales)
    elif _is_number(expected) and _is_number(got):
        if expected != got:
            size = abs(expected - got) / scales[kind_of(path)]
            yield Difference(dotted(path), expected, got, size)
    elif type(expected) is not type(got) or expected != got:
        yield Difference(dotted(path), expected, got, math.inf)


def _unmatched(
    rows: list[Any], others: list[Any], path: Path, scales: dict[str, float], where: str
) -> Iterator[Difference]:
    """Tell how far each row is from the nearest one of the other set that has its names."""
    known = defaultdict(list)
    for row in others:
        names, numbers = _split(row, path, scales)
        known[names].append(numbers)
    for i, row in enumerate(rows):
        names, numbers = _split(row, path, scales)
        near = [np.abs(other - numbers).max(initial=0.0) for other in known[names]]
        size = float(min(near, default=math.inf))
        if size > 0.0:
            pair = (row, f"no such row in what was {where}")
            yield Difference(dotted((*path, i)), *(pair if where == "got" else pair[::-1]), size)


def _split(row: Any, path: Path, scales: dict[str, float]) -> tuple[tuple[Any, ...], np.ndarray]:
    """Return what a row says in words, with where it says so, and its scaled numbers."""
    leaves = [((*path, *below), value) for below, value in _leaves(row)]
    numbers = [value / scales[kind_of(place)] for place, value in leaves if _is_number(value)]
    names = tuple(
        (place[len(path) :], None if _is_number(value) else value) for place, value in leaves
    )
    return names, np.array(numbers)


def _leaves(value: Any, path: Path = ()) -> Iterator[tuple[Path, Any]]:
    if isinstance(value, dict):
        for key in sorted(value):
            yield from _leaves(value[key], (*path, key))
    elif isinstance(value, list):
        for i, part in enumerate(value):
            yield from _leaves(part, (*path, i))
    else:
        yield path, value


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def kind_of(path: Path) -> str:
    """Return the name that a number at a path is measured by."""
    name = next((str(step) for step in reversed(path) if isinstance(step, str)), "")
    return KINDS.get(name, name)
