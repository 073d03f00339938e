"""Sections of any kinds as rows of arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from hand_models.base import Array, Indices
from hand_models.sections.polyline import PolylineSection
from hand_models.sections.polyline_rows import PolylineRows
from hand_models.sections.profile_section import ProfileSection
from hand_models.sections.rows import Complexes, FlatRows, Rests, RoundRows, SectionRows, Span
from hand_models.sections.section import FlatSection, RoundSection, Section

__all__ = ["section_rows"]


def section_rows(sections: Sequence[Section | None]) -> SectionRows:
    """Gather sections, one a row; None where there is no rock."""
    kinds = [_kind(section) for section in sections]
    parts: list[SectionRows] = []
    part, place = np.empty((2, len(sections)), dtype=np.intp)
    for kind in dict.fromkeys(kinds):
        rows = [i for i, other in enumerate(kinds) if other == kind]
        part[rows], place[rows] = len(parts), np.arange(len(rows))
        parts.append(_GATHERED[kind[0]]([sections[i] for i in rows]))
    return parts[0] if len(parts) == 1 else _MixedRows(parts, part, place)


def _kind(section: Section | None) -> tuple[type, bool]:
    """Return what sections have in common that are gathered together."""
    return type(section), isinstance(section, ProfileSection) and section.half_angle is not None


class _NoRows(SectionRows):
    """No rock."""

    def take(self, rows: Indices) -> _NoRows:
        return self

    def clearances(self, points: Complexes) -> Array:
        return np.full(points.shape, np.inf)

    def face_clearances(self, joint: Complexes, span: Span, angle: Array) -> Array:
        return np.full(angle.shape, np.inf)

    def rests(self, joint: Complexes, span: Span, low: Array, high: Array) -> Rests:
        nothing, no = np.full(low.shape, np.nan), np.zeros(low.shape, dtype=bool)
        return Rests(nothing, nothing.copy(), no, no.copy())


class _MixedRows(SectionRows):
    """Sections of several kinds.

    Parameters
    ----------
    parts : sequence of SectionRows
        Each of one kind.
    part, place : ndarray of int, shape (n,)
        Which of them a row is in, and its row there.
    """

    def __init__(self, parts: Sequence[SectionRows], part: Indices, place: Indices) -> None:
        self._parts, self._part, self._place = parts, part, place
        among = [np.flatnonzero(part == i) for i in range(len(parts))]
        self._each = [
            (rows, rock.take(place[rows]))
            for rows, rock in zip(among, parts, strict=True)
            if len(rows)
        ]

    def take(self, rows: Indices) -> _MixedRows:
        return _MixedRows(self._parts, self._part[rows], self._place[rows])

    def clearances(self, points: Complexes) -> Array:
        found = np.empty(points.shape)
        for rows, rock in self._each:
            found[..., rows] = rock.clearances(points[..., rows])
        return found

    def face_clearances(self, joint: Complexes, span: Span, angle: Array) -> Array:
        found = np.empty(angle.shape)
        for rows, rock in self._each:
            found[rows] = rock.face_clearances(joint[rows], span.take(rows), angle[rows])
        return found

    def rests(self, joint: Complexes, span: Span, low: Array, high: Array) -> Rests:
        numbers, flags = np.empty((2, len(low))), np.empty((2, len(low)), dtype=bool)
        found = Rests(*numbers, *flags)
        for rows, rock in self._each:
            part = rock.rests(joint[rows], span.take(rows), low[rows], high[rows])
            for values, own in zip(found, part, strict=True):
                values[rows] = own
        return found


_GATHERED: Final[dict[type, Callable[[Sequence[Any]], SectionRows]]] = {
    type(None): lambda _: _NoRows(),
    FlatSection: FlatRows.of,
    RoundSection: RoundRows.of,
    ProfileSection: ProfileSection.gathered,
    PolylineSection: PolylineRows,
}
