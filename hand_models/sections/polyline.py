"""Rock in a finger's plane whose surface is a chain of short straight pieces.

Its boundary is one or more polylines, open or closed, that have the rock on their left (turning
from s toward t), convex or not. How far places are from it `hand_models.sections.boundary` finds,
and where a face that turns first meets it `hand_models.sections.first_contact`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from hand_models.base import Array
from hand_models.sections.boundary import Boundary
from hand_models.sections.first_contact import TurningFaces
from hand_models.sections.rows import Rests, Span
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

    @cached_property
    def boundary(self) -> Boundary:
        """Where places are near it; a line that only `highest` is asked of needs none."""
        return Boundary(self.pieces)

    def rest(
        self, joint: Vector2, start: float, end: float, height: float, low: float, high: float
    ) -> Rest | None:
        joints = np.array([complex(*joint)])
        with np.errstate(invalid="ignore", divide="ignore"):
            sweep = self._sweep(joints, Span.of(start, end, height), low)
            angle, distance, flat = sweep.contacts(np.array([high]), self.faceted)
        if math.isnan(angle.item()):
            return None
        middle = 0.5 * (start + end)
        return Rest(angle.item(), middle if flat.item() else distance.item(), flat.item())

    def rests(
        self, joints: Complexes, start: float, end: float, height: float, low: float, high: float
    ) -> Rests:
        """Return what `rest` does for joints (n,)."""
        with np.errstate(invalid="ignore", divide="ignore"):
            sweep = self._sweep(joints, Span.of(start, end, height), low)
            angle, distance, flat = sweep.contacts(np.full(len(joints), high), self.faceted)
            distance = np.where(flat, 0.5 * (start + end), distance)
            return Rests(angle, distance, flat, sweep.clearances() <= 0.0)

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
        with np.errstate(invalid="ignore", divide="ignore"):
            sweep = self._sweep(joints, Span.of(start, end, height), angle)
            return float(sweep.clearances()[0])

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
