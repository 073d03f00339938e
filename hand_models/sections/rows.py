"""Rock in the planes of many fingers, a row of arrays each: what laying asks, all at once.

The same questions as `hand_models.sections.section` answers one by one, with the same answers.
Arrays have a row as their last axis; numbers of a single section serve any number of rows.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hand_models.base import Array, Indices
from hand_models.sections.section import Complexes

__all__ = [
    "Complexes",
    "Flags",
    "Rests",
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


def angles_within(angle: Array, low: Array, high: Array) -> Array:
    """Return angles plus the whole turns that bring them into [low, high]; else NaN."""
    angle = low + (angle - low) % math.tau
    angle[angle > high] = np.nan
    return angle
