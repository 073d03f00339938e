"""Rock in the planes of many fingers, a row of arrays each: what laying asks, all at once.

The same questions as `hand_models.sections.section` answers one by one, with the same answers.
Arrays have a row as their last axis; numbers of a single section serve any number of rows.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Generic, NamedTuple, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hand_models.base import Array, Indices
from hand_models.sections.section import LEVEL, Complexes

__all__ = [
    "Complexes",
    "Flags",
    "Rests",
    "SmoothRows",
    "Span",
    "angles_within",
]

Flags = NDArray[np.bool_]


class Span(NamedTuple):
    """Faces of phalanges: where they are on them; one row for all, or a row each.

    Attributes
    ----------
    ends : ndarray, shape (2, n)
        Where along the phalanx the face begins and ends [m].
    height : ndarray, shape (n,)
        Of the face above the phalanx, on the side of the rock [m].
    arms, phases : ndarray, shape (2, n)
        Of both ends from the joint, and of their bearings from the phalanx [m, rad].
    """

    ends: Array
    height: Array
    arms: Array
    phases: Array

    @classmethod
    def of(cls, start: ArrayLike, end: ArrayLike, height: ArrayLike) -> Span:
        """Return faces from their beginnings, ends and heights."""
        ends, heights = np.array([np.atleast_1d(start), np.atleast_1d(end)]), np.atleast_1d(height)
        return cls(ends, heights, np.hypot(ends, heights), np.arctan2(heights, ends))

    def take(self, rows: Indices | slice) -> Span:
        """Return some of the rows."""
        return self if len(self.height) == 1 else Span(*(value[..., rows] for value in self))


class Rests(NamedTuple):
    """Faces that turn until they rest on the rock, shape (n,) each.

    Attributes
    ----------
    angle, distance : ndarray
        As of `hand_models.sections.Rest`; NaN where a face meets no rock [rad, m].
    flat : ndarray of bool
        Whether it lies flat; its distance means nothing then.
    blocked : ndarray of bool
        Whether there is rock in its way from the first; the others mean nothing then.
    """

    angle: Array
    distance: Array
    flat: Flags
    blocked: Flags


Numbers = TypeVar("Numbers", bound=tuple[Array | Complexes, ...])


class SmoothRows(ABC, Generic[Numbers]):
    """Sections that a face touches with its line, or else with one of its ends.

    Parameters
    ----------
    numbers : tuple of ndarray, shapes (..., n)
        What describes the sections; of a single one, for any number of rows.
    """

    def __init__(self, numbers: Numbers) -> None:
        self._numbers = numbers

    @abstractmethod
    def clearances(self, points: Complexes) -> Array:
        """Return about how far points (..., n) are from the rock, negative inside [m]."""

    @abstractmethod
    def face_clearances(self, joint: Complexes, span: Span, angle: Array) -> Array:
        """Return about how far faces at an angle are from the rock, negative if they cut it [m]."""

    def take(self, rows: Indices) -> Self:
        """Return some of the rows, or the same ones more than once."""
        if self._numbers[0].shape[-1] == 1:
            return self
        taken = object.__new__(type(self))
        taken._numbers = type(self._numbers)(*(value[..., rows] for value in self._numbers))
        return taken

    def tangents(
        self, joint: Complexes, span: Span, low: Array, high: Array
    ) -> tuple[Array, Array] | None:
        """Return angle and distance at which the faces' lines touch the curved part of the rock.

        NaN where they do not; None if no rock is curved.
        """
        return None

    @abstractmethod
    def touches(self, joint: Complexes, span: Span, low: Array, high: Array) -> Array:
        """Return the first angle at which both ends of faces are on the rock, (2, n); or NaN."""

    def _straight(self, joint: Complexes, span: Span, angle: Array) -> Flags | bool:
        """Whether the rock nearest both ends of faces at an angle is straight."""
        return False

    def rests(self, joint: Complexes, span: Span, low: Array, high: Array) -> Rests:
        """Return where faces first meet the rock as their phalanges turn from low to high."""
        blocked = self.face_clearances(joint, span, low) <= 0.0
        tangents = self.tangents(joint, span, low, high)
        if tangents is None:
            return Rests(*self._ends(joint, span, low, high), blocked)
        angle, distance = tangents
        start, end = span.ends
        on = (angle <= high) & (distance >= start) & (distance <= end)
        flat = np.zeros(on.shape, dtype=bool)
        off = (~on).nonzero()[0]
        if len(off):
            rock, rest = self.take(off), (joint[off], span.take(off), low[off], high[off])
            angle[off], distance[off], flat[off] = rock._ends(*rest)
        return Rests(angle, distance, flat, blocked)

    def _ends(
        self, joint: Complexes, span: Span, low: Array, high: Array
    ) -> tuple[Array, Array, Flags]:
        """Return where faces meet the rock with one of their ends, or both."""
        first, last = self.touches(joint, span, low, high)
        start, end = span.ends
        angle = np.fmin(first, last)
        distance = np.where((first <= last) | np.isnan(last), start, end)
        flat = np.abs(first - last) * (end - start) <= LEVEL
        if flat.any():
            flat &= self._straight(joint, span, angle)
        return angle, distance, flat


def angles_within(angle: Array, low: Array, high: Array) -> Array:
    """Return angles plus the whole turns that bring them into [low, high]; else NaN."""
    angle = low + (angle - low) % math.tau
    angle[angle > high] = np.nan
    return angle
