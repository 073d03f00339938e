"""Rock in the planes of many fingers, a row of arrays each: what laying asks, all at once.

The same questions as `hand_models.sections.section` answers one by one, with the same answers.
Arrays have a row as their last axis; numbers of a single section serve any number of rows.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Generic, NamedTuple, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hand_models.base import Array, Indices
from hand_models.sections.section import LEVEL, FlatSection, RoundSection

__all__ = [
    "Complexes",
    "Flags",
    "FlatRows",
    "Rests",
    "RoundRows",
    "SectionRows",
    "SmoothRows",
    "Span",
    "angles_within",
]

Complexes = NDArray[np.complex128]
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


class SectionRows(ABC):
    """Sections of one kind."""

    @abstractmethod
    def take(self, rows: Indices) -> SectionRows:
        """Return some of the rows, or the same ones more than once."""

    @abstractmethod
    def clearances(self, points: Complexes) -> Array:
        """Return about how far points (..., n) are from the rock, negative inside [m]."""

    @abstractmethod
    def face_clearances(self, joint: Complexes, span: Span, angle: Array) -> Array:
        """Return about how far faces at an angle are from the rock, negative if they cut it [m]."""

    @abstractmethod
    def rests(self, joint: Complexes, span: Span, low: Array, high: Array) -> Rests:
        """Return where faces first meet the rock as their phalanges turn from low to high."""


Numbers = TypeVar("Numbers", bound=tuple[Array | Complexes, ...])


class SmoothRows(SectionRows, Generic[Numbers]):
    """Sections that a face touches with its line, or else with one of its ends.

    Parameters
    ----------
    numbers : tuple of ndarray, shapes (..., n)
        What describes the sections; of a single one, for any number of rows.
    """

    def __init__(self, numbers: Numbers) -> None:
        self._numbers = numbers

    def take(self, rows: Indices) -> Self:
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


class _Flat(NamedTuple):
    """Half-planes: angle and components of the direction into the rock, and its offset."""

    bearing: Array
    s: Array
    t: Array
    offset: Array


class FlatRows(SmoothRows[_Flat]):
    """Half-planes."""

    @classmethod
    def of(cls, sections: Sequence[FlatSection]) -> FlatRows:
        """Gather sections, one a row."""
        s, t, offset = np.array([(*each.direction, each.offset) for each in sections]).T
        return cls(_Flat(np.arctan2(t, s), s, t, offset))

    def touches(self, joint: Complexes, span: Span, low: Array, high: Array) -> Array:
        # the cosine of how far both ends are from the direction into the rock, from outside
        turn = np.arccos(self.clearances(joint) / span.arms)
        return angles_within(self._numbers.bearing - turn - span.phases, low, high)

    def clearances(self, points: Complexes) -> Array:
        _, s, t, offset = self._numbers
        return np.asarray(offset - s * points.real - t * points.imag)

    def face_clearances(self, joint: Complexes, span: Span, angle: Array) -> Array:
        turn = angle - self._numbers.bearing
        start, end = span.ends * np.cos(turn)
        level = self.clearances(joint) + span.height * np.sin(turn)
        return np.asarray(level - np.maximum(start, end))

    def _straight(self, joint: Complexes, span: Span, angle: Array) -> bool:
        return True


class _Round(NamedTuple):
    """Discs: centre, as s + i t, and radius."""

    centre: Complexes
    radius: Array


class RoundRows(SmoothRows[_Round]):
    """Discs."""

    @classmethod
    def of(cls, sections: Sequence[RoundSection]) -> RoundRows:
        """Gather sections, one a row."""
        s, t, radius = np.array([(*each.centre, each.radius) for each in sections]).T
        return cls(_Round(s + 1j * t, radius))

    def tangents(
        self, joint: Complexes, span: Span, low: Array, high: Array
    ) -> tuple[Array, Array]:
        centre, radius = self._numbers
        way, offset = centre - joint, radius + span.height
        distance = np.abs(way)
        angle = np.arctan2(way.imag, way.real) - np.arcsin(offset / distance)
        return angles_within(angle, low, high), np.sqrt((distance - offset) * (distance + offset))

    def touches(self, joint: Complexes, span: Span, low: Array, high: Array) -> Array:
        centre, radius = self._numbers
        way, arms = centre - joint, span.arms
        distance = np.abs(way)
        cosine = (arms * arms + distance * distance - radius * radius) / (2.0 * arms * distance)
        angle = np.arctan2(way.imag, way.real) - np.arccos(cosine)
        return angles_within(angle - span.phases, low, high)

    def clearances(self, points: Complexes) -> Array:
        centre, radius = self._numbers
        return np.asarray(np.abs(points - centre) - radius)

    def face_clearances(self, joint: Complexes, span: Span, angle: Array) -> Array:
        centre, radius = self._numbers
        way = (centre - joint) * np.exp(-1j * angle)
        start, end = span.ends
        beside = way.real - np.minimum(np.maximum(way.real, start), end)
        return np.asarray(np.hypot(beside, way.imag - span.height) - radius)


def angles_within(angle: Array, low: Array, high: Array) -> Array:
    """Return angles plus the whole turns that bring them into [low, high]; else NaN."""
    angle = low + (angle - low) % math.tau
    angle[angle > high] = np.nan
    return angle
