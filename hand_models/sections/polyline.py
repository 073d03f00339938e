"""Rock in a finger's plane whose surface is a chain of short straight pieces.

Its boundary is one or more polylines, open or closed, that have the rock on their left (turning
from s toward t), convex or not. How far places are from it `hand_models.sections.boundary` finds,
and where a face that turns first meets it `hand_models.sections.first_contact`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hand_models.base import Array
from hand_models.sections.boundary import Boundary
from hand_models.sections.first_contact import TurningFaces
from hand_models.sections.rows import Span
from hand_models.sections.section import Complexes, Rest, Section, Vector2

__all__ = ["PolylineSection"]


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
        self.boundary = Boundary(pieces)

    def rest(
        self, joint: Vector2, start: float, end: float, height: float, low: float, high: float
    ) -> Rest | None:
        with np.errstate(invalid="ignore", divide="ignore"):
            sweep = self._sweep(joint, Span.of(start, end, height), low)
            found = sweep.contacts(np.array([high]), self.faceted)
        angle, distance, flat = (value.item() for value in found)
        if math.isnan(angle):
            return None
        return Rest(angle, 0.5 * (start + end) if flat else distance, bool(flat))

    def touch(
        self, joint: Vector2, along: float, height: float, low: float, high: float
    ) -> float | None:
        with np.errstate(invalid="ignore", divide="ignore"):
            touches = self._sweep(joint, Span.of(along, along, height), low).touches()
        angle = float(touches[0, 0])
        return angle if angle <= high else None

    def face_clearance(
        self, joint: Vector2, start: float, end: float, height: float, angle: float
    ) -> float:
        with np.errstate(invalid="ignore", divide="ignore"):
            return float(self._sweep(joint, Span.of(start, end, height), angle).clearances()[0])

    def _sweep(self, joint: Vector2, span: Span, low: float) -> TurningFaces:
        return TurningFaces(self.boundary, np.array([complex(*joint)]), span, np.array([low]))

    def outline(self, reach: float, spacing: float) -> list[Complexes]:
        return [piece[:, 0] + 1j * piece[:, 1] for piece in self.pieces]

    def clearance(self, point: Vector2) -> float:
        return float(self.boundary.clearances(np.array(complex(*point))))

    def clearances(self, places: Complexes) -> Array:
        return self.boundary.clearances(places)

    def normal(self, point: Vector2) -> Vector2:
        out = self.boundary.normal(complex(*point))
        return out.real, out.imag

    def highest(self, low: float, high: float) -> float | None:
        """Return the least t of the rock between two values of s; None if there is none [m]."""
        least = math.inf
        for piece in self.pieces:
            s, t = piece[:, 0], piece[:, 1]
            least = min(least, float(t[(s >= low) & (s <= high)].min(initial=math.inf)))
            for bound in (low, high):
                crossing = np.flatnonzero((s[:-1] < bound) != (s[1:] < bound))
                part = (bound - s[crossing]) / (s[crossing + 1] - s[crossing])
                there = t[crossing] + part * (t[crossing + 1] - t[crossing])
                least = min(least, float(there.min(initial=math.inf)))
        return least if math.isfinite(least) else None
