"""Rock in a finger's plane whose surface is a chain of short straight pieces.

Its boundary is one or more polylines, open or closed, that have the rock on their left (turning
from s toward t), convex or not. How far places are from it `hand_models.sections.boundary` finds,
and where a face that turns first meets it `hand_models.sections.first_contact`.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from hand_models.base import Array
from hand_models.sections.boundary import Boundary
from hand_models.sections.first_contact import TurningFaces
from hand_models.sections.section import Complexes, Face, Flags, Rest, Section, Vector2

__all__ = ["PolylineSection"]


class Rests(NamedTuple):
    """Faces that turn until they rest on the rock, shape (n,) each.

    Attributes
    ----------
    angle, distance : ndarray
        As of `Rest`; NaN where a face meets no rock [rad, m].
    flat : ndarray of bool
        Whether it lies flat.
    blocked : ndarray of bool
        Whether there is rock in its way from the first; the others mean nothing then.
    """

    angle: Array
    distance: Array
    flat: Flags
    blocked: Flags


class PolylineSection(Section):
    """Rock on the left of polylines.

    Parameters
    ----------
    pieces : sequence of ndarray, shape (n, 2)
        Points (s, t) in order, each unlike the one before it; a closed piece ends where it begins.
        Where an open one ends, rock ends: nothing is touched beyond [m].
    faceted : bool, optional
        Whether the points are corners of the rock, not places on a smooth curve, so that what rests
        on a corner touches there and not at the lowest place of a fit.
    """

    def __init__(self, pieces: Sequence[Array], *, faceted: bool = False) -> None:
        self.pieces = tuple(pieces)
        self.faceted = faceted

    @cached_property
    def boundary(self) -> Boundary:
        """Boundary of the line, made when first used; `highest` alone does not need it."""
        return Boundary(self.pieces)

    def rest(self, joint: complex, face: Face, low: float, high: float) -> Rest | None:
        found = self.rests(np.array([joint]), face, low, high)
        if math.isnan(found.angle[0]):
            return None
        return Rest(float(found.angle[0]), float(found.distance[0]), bool(found.flat[0]))

    def rests(self, joints: Complexes, face: Face, low: float, high: float) -> Rests:
        """Return what `rest` does for joints (n,)."""
        with np.errstate(invalid="ignore", divide="ignore"):
            faces = TurningFaces(self.boundary, joints, face, low)
            angle, distance, flat = faces.contacts(high, self.faceted)
            distance = np.where(flat, 0.5 * (face.start + face.end), distance)
            return Rests(angle, distance, flat, faces.clearances() <= 0.0)

    def face_clearance(self, joint: complex, u: complex, face: Face) -> float:
        with np.errstate(invalid="ignore", divide="ignore"):
            faces = TurningFaces(self.boundary, np.array([joint]), face, cmath.phase(u))
            return float(faces.clearances()[0])

    def outline(self, reach: float, spacing: float) -> list[Complexes]:
        return [piece[:, 0] + 1j * piece[:, 1] for piece in self.pieces]

    def distance(self, point: complex) -> float:
        return float(self.boundary.clearances(np.array(point)))

    def clearances(self, places: Complexes) -> Array:
        return self.boundary.clearances(places)

    def normal(self, point: Vector2) -> Vector2:
        out = self.boundary.normal(complex(*point))
        return out.real, out.imag

    def highest(self, low: Array, high: Array) -> Array:
        """Return the least t of the rock between values of s, (n,); infinite if there is none."""
        least = np.full(len(low), math.inf)
        # what all windows hold is looked at once, and what none does not at all
        inner, outer = (low.max(), high.min()), (low.min(), high.max())
        for piece in self.pieces:
            s, t = piece[:, 0], piece[:, 1]
            always = (s >= inner[0]) & (s <= inner[1])
            np.minimum(least, t[always].min(initial=math.inf), out=least)
            some = (~always & (s >= outer[0]) & (s <= outer[1])).nonzero()[0]
            between = (s[some] >= low[:, None]) & (s[some] <= high[:, None])
            apart = np.where(between, t[some], math.inf).min(axis=1, initial=math.inf)
            np.minimum(least, apart, out=least)
            first, last = np.minimum(s[:-1], s[1:]), np.maximum(s[:-1], s[1:])
            for bound in (low, high):
                crossed = ((last >= bound.min()) & (first < bound.max())).nonzero()[0]
                after = crossed + 1
                window, which = (
                    (s[crossed] < bound[:, None]) != (s[after] < bound[:, None])
                ).nonzero()
                i, j = crossed[which], after[which]
                part = (bound[window] - s[i]) / (s[j] - s[i])
                np.minimum.at(least, window, t[i] + part * (t[j] - t[i]))
        return least
