"""Polylines of many fingers: what is asked of rows of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from hand_models.base import Array, Indices
from hand_models.sections.first_contact import TurningFaces
from hand_models.sections.polyline import PolylineSection
from hand_models.sections.rows import Complexes, Rests, SectionRows, Span

__all__ = ["PolylineRows"]


class PolylineRows(SectionRows):
    """Polylines, each asked for all of its rows at once.

    Parameters
    ----------
    sections : sequence of PolylineSection
    of : ndarray of int, shape (n,), optional
        Which of them is in each row; one after the other by default, a single one in all rows.
    """

    def __init__(self, sections: Sequence[PolylineSection], of: Indices | None = None) -> None:
        self._sections = sections
        self._of = np.arange(len(sections)) if of is None else of

    def take(self, rows: Indices) -> PolylineRows:
        return self if len(self._sections) == 1 else PolylineRows(self._sections, self._of[rows])

    def clearances(self, points: Complexes) -> Array:
        found = np.empty(points.shape)
        for section, rows in self._each():
            found[..., rows] = section.boundary.clearances(points[..., rows])
        return found

    def face_clearances(self, joint: Complexes, span: Span, angle: Array) -> Array:
        found = np.empty(angle.shape)
        for section, rows in self._each():
            sweep = TurningFaces(section.boundary, joint[rows], span.take(rows), angle[rows])
            found[rows] = sweep.clearances()
        return found

    def rests(self, joint: Complexes, span: Span, low: Array, high: Array) -> Rests:
        shape = 2, len(low)
        (angle, distance), (flat, blocked) = np.empty(shape), np.empty(shape, dtype=bool)
        for section, rows in self._each():
            sweep = TurningFaces(section.boundary, joint[rows], span.take(rows), low[rows])
            blocked[rows] = sweep.clearances() <= 0.0
            angle[rows], distance[rows], flat[rows] = sweep.contacts(high[rows], section.faceted)
        return Rests(angle, distance, flat, blocked)

    def _each(self) -> Iterator[tuple[PolylineSection, Indices | slice]]:
        """Yield sections and their rows."""
        if len(self._sections) == 1:
            yield self._sections[0], slice(None)
            return
        for i, section in enumerate(self._sections):
            rows = (self._of == i).nonzero()[0]
            if len(rows):
                yield section, rows
