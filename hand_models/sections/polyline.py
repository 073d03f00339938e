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
from hand_models.sections.rows import Flags, Span
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
        found = self.rests(np.array([complex(*joint)]), start, end, height, low, high)
        angle, distance, flat = (values.item() for values in found)
        return None if math.isnan(angle) else Rest(angle, distance, bool(flat))

    def rests(
        self, joints: Complexes, start: float, end: float, height: float, low: float, high: float
    ) -> tuple[Array, Array, Flags]:
        """Return what `rest` does for joints (n,): angles, distances, and whether faces lie flat.

        NaN where they meet no rock.
        """
        with np.errstate(invalid="ignore", divide="ignore"):
            sweep = self._sweep(joints, Span.of(start, end, height), low)
            angles, distances, flat = sweep.contacts(np.full(len(joints), high), self.faceted)
        return angles, np.where(flat, 0.5 * (start + end), distances), flat

    def touch(
        self, joint: Vector2, along: float, height: float, low: float, high: float
    ) -> float | None:
        with np.errstate(invalid="ignore", divide="ignore"):
            joints = np.array([complex(*joint)])
            touches = self._sweep(joints, Span.of(along, along, height), low).touches()
        angle = float(touches[0, 0])
        return angle if angle <= high else None

    def face_clearance(
        self, joint: Vector2, start: float, end: float, height: float, angle: float
    ) -> float:
        joints = np.array([complex(*joint)])
        return float(self.face_clearances(joints, start, end, height, angle)[0])

    def face_clearances(
        self, joints: Complexes, start: float, end: float, height: float, angle: float
    ) -> Array:
        """Return what `face_clearance` does for joints (n,)."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return self._sweep(joints, Span.of(start, end, height), angle).clearances()

    def _sweep(self, joints: Complexes, span: Span, low: float) -> TurningFaces:
        return TurningFaces(self.boundary, joints, span, np.full(len(joints), low))

    def outline(self, reach: float, spacing: float) -> list[Complexes]:
        return [piece[:, 0] + 1j * piece[:, 1] for piece in self.pieces]

    def clearance(self, point: Vector2) -> float:
        return float(self.boundary.clearances(np.array(complex(*point))))

    def clearances(self, places: Complexes) -> Array:
        return self.boundary.clearances(places)

    def normal(self, point: Vector2) -> Vector2:
        out = self.boundary.normal(complex(*point))
        return out.real, out.imag

    def highest(self, low: Array, high: Array) -> Array:
        """Return the least t of the rock between values of s, (n,); infinite if there is none."""
        least = np.full(len(low), math.inf)
        for piece in self.pieces:
            s, t = piece[:, 0], piece[:, 1]
            between = (s >= low[:, None]) & (s <= high[:, None])
            np.minimum(least, np.where(between, t, math.inf).min(axis=1), out=least)
            for bound in (low, high):
                below = s < bound[:, None]
                window, first = (below[:, :-1] != below[:, 1:]).nonzero()
                part = (bound[window] - s[first]) / (s[first + 1] - s[first])
                np.minimum.at(least, window, t[first] + part * (t[first + 1] - t[first]))
        return least
