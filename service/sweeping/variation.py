"""Variation of a sweep: the path of a request's field, and the values that the field takes."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Self

import numpy as np

from hand_models.base import InvalidInputError

__all__ = ["Value", "Variation", "word_of"]

Value = float | bool | str | None
"""Value of a field: a number, a word, a boolean, or None for null."""


@dataclass(frozen=True)
class Variation:
    """Field of a request that varies in a sweep, and the values that it takes.

    Attributes
    ----------
    path : str
        Path of the field, with dots, as ``load.mass`` or
        ``hands.front_left.surface.shear_limit``. Hands are named by limb, entries of lists by
        index; ``*`` stands for all hands or entries.
    values : tuple of float, bool, str or None
        Different values, in the order in which they are shown. For a range that is sampled, its
        two ends are enough.
    ranged : bool
        True if samples may take any value between the first and the last.

    Raises
    ------
    InvalidInputError
        If there is no value, a value is repeated or not finite, or a range is empty.
    """

    path: str
    values: tuple[Value, ...]
    ranged: bool = False

    def __post_init__(self) -> None:
        if not self.values:
            raise InvalidInputError("at least one value is needed, got none", field=self.path)
        for i, value in enumerate(self.values):
            if isinstance(value, float) and not math.isfinite(value):
                raise InvalidInputError(f"must be finite numbers, got {value}", field=self.path)
            if value in self.values[:i]:
                raise InvalidInputError(
                    f"has the value {value} twice; give it once", field=self.path
                )
        low, high = self.values[0], self.values[-1]
        if self.ranged and not (self.numbers and low < high):  # type: ignore[operator]
            raise InvalidInputError(f"LOW must be below HIGH, got {low}:{high}", field=self.path)

    @property
    def numbers(self) -> bool:
        """True if all values are numbers."""
        return all(type(value) in (int, float) for value in self.values)

    def text(self, *, sampled: bool = False) -> str:
        """Return the variation as text that `parse` reads.

        Parameters
        ----------
        sampled : bool, optional
            True to write a range without its count, ``PATH=LOW:HIGH``.
        """
        if not self.ranged:
            return f"{self.path}={','.join(map(word_of, self.values))}"
        count = "" if sampled else f":{len(self.values)}"
        return f"{self.path}={word_of(self.values[0])}:{word_of(self.values[-1])}{count}"

    @classmethod
    def over(cls, path: str, low: float, high: float, count: int = 2) -> Self:
        """Return a variation over a range, with values at equal distances.

        Parameters
        ----------
        path : str
            Path of the field.
        low, high : float
            Ends of the range, in the unit of the field.
        count : int, optional
            Number of values, from 2 to 10,000.

        Raises
        ------
        InvalidInputError
            If ``low`` is not below ``high``, or the count is out of range.
        """
        if not (math.isfinite(low) and math.isfinite(high)):
            raise InvalidInputError(f"must be finite numbers, got {low:g}:{high:g}", field=path)
        if not low < high:
            raise InvalidInputError(f"LOW must be below HIGH, got {low:g}:{high:g}", field=path)
        most = 10_000
        if not 2 <= count <= most:
            alone = f"one value alone is {path}={low:g}"
            raise InvalidInputError(
                f"COUNT must be from 2 to {most}, got {count}; {alone}", field=path
            )
        values = [float(f"{value:.12g}") for value in np.linspace(low, high, count)]
        return cls(path, tuple(values), ranged=True)

    @classmethod
    def parse(cls, text: str, *, sampled: bool = False) -> Self:
        """Read a variation from ``PATH=LOW:HIGH:COUNT`` or ``PATH=VALUE,VALUE,...``.

        Parameters
        ----------
        text : str
            Text of the variation; numbers are in SI units.
        sampled : bool, optional
            True if a range may have no count, because samples need none.

        Raises
        ------
        InvalidInputError
            If the text is not of this form, or its values are invalid.
        """
        path, _, given = (part.strip() for part in text.partition("="))
        if not path or not given:
            raise _unreadable(text)
        ends = given.split(":")
        if len(ends) == 1:
            return cls(path, tuple(_value(each.strip(), path) for each in given.split(",")))
        try:
            low, high, *counts = float(ends[0]), float(ends[1]), *map(int, ends[2:])
            (count,) = counts or ([2] if sampled else [])
        except ValueError:
            more = " (with --samples also PATH=LOW:HIGH)"
            raise _unreadable(text, path, more) from None
        return cls.over(path, low, high, count)


def word_of(value: Value) -> str:
    """Return a value as a variation is written: six digits, ``true``, ``false`` or ``null``."""
    if value is None or isinstance(value, bool):
        return "null" if value is None else str(value).lower()
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _value(text: str, path: str) -> Value:
    """Return the number or word that a text is."""
    if not text:
        raise InvalidInputError(
            "has an empty value between its commas; remove a comma, or add a value", field=path
        )
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    # two numbers that are parted by something else than colons
    if re.fullmatch(r"-?[\d.]+ *(-|–|\.\.|to) *-?[\d.]+", text):
        raise _unreadable(text, path)
    words: dict[str, Value] = {"true": True, "false": False, "null": None}
    return words.get(text, text)


def _unreadable(text: str, path: str | None = None, more: str = "") -> InvalidInputError:
    form = f"must be PATH=LOW:HIGH:COUNT or PATH=VALUE,VALUE,...{more}"
    return InvalidInputError(f"{form}, got {text!r}", field=path)
