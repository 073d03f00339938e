"""Rock in a finger's plane that is the oblique cut of a profile: a log, an edge or a boulder."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from hand_models.base import Array
from hand_models.sections.profile_rows import ProfileRows
from hand_models.sections.rows import Complexes, Span
from hand_models.sections.section import Rest, Section, Vector2

__all__ = ["ProfileSection"]

ROUGH: Final = 256
"""Parts of the disc of which those near a finger are looked at closely."""


@dataclass(frozen=True, eq=False)
class ProfileSection(Section):
    """The preimage of a profile (a disc swept along a wedge) under ``p = M q + m``.

    What is asked of it is answered by `ProfileRows`, with a single row.

    Attributes
    ----------
    M : ndarray, shape (2, 2)
    m : ndarray, shape (2,)
        From the section's coordinates to the profile's.
    radius : float
        Of the disc, which touches the profile's origin from below [m].
    half_angle : float or None
        Of the wedge, about the profile's second axis; None if the profile is round [rad].
    """

    M: Array
    m: Array
    radius: float
    half_angle: float | None = None

    @staticmethod
    def gathered(sections: Sequence[ProfileSection]) -> ProfileRows:
        """Gather sections, one a row; all with flat faces or none."""
        halves = [section.half_angle for section in sections]
        return ProfileRows(
            np.array([section.M for section in sections]),
            np.array([section.m for section in sections]),
            np.array([section.radius for section in sections]),
            None if halves[0] is None else np.array(halves),
        )

    @cached_property
    def _rows(self) -> ProfileRows:
        return self.gathered([self])

    def tangent(self, joint: Vector2, height: float, low: float, high: float) -> Rest | None:
        span = Span.of(0.0, 0.0, height)
        with np.errstate(invalid="ignore", divide="ignore"):
            angle, distance = self._rows.tangents(_place(joint), span, *_row(low, high))
        return None if np.isnan(angle) else Rest(angle.item(), distance.item())

    def touch(
        self, joint: Vector2, along: float, height: float, low: float, high: float
    ) -> float | None:
        span = Span.of(along, along, height)
        with np.errstate(invalid="ignore", divide="ignore"):
            angle = self._rows.touches(_place(joint), span, *_row(low, high))[0].item()
        return None if math.isnan(angle) else angle

    def outline(self, reach: float, spacing: float) -> list[Complexes]:
        half = -0.5 * math.pi if self.half_angle is None else self.half_angle
        # how far the normal out of the disc turns from the crest to each side
        most = 0.5 * math.pi - half
        turns = np.linspace(-most, most, ROUGH + 1)
        places = self._on_disc(turns)
        steps = np.abs(np.diff(places))
        near = np.abs(places[:-1]) <= reach + steps
        parts = np.where(near, np.ceil(steps / spacing), 1.0).clip(1.0)
        at = np.append(0.0, np.cumsum(parts))
        places = self._on_disc(np.interp(np.arange(at[-1] + 1.0), at, turns))
        if self.half_angle is not None:
            ends = []
            for end, side in ((places[0], -1.0), (places[-1], 1.0)):
                x, z = np.linalg.solve(self.M, [side * math.sin(half), math.cos(half)])
                face = complex(x, z)
                ends.append(end + (abs(end) + reach) / abs(face) * face)
            places = np.concatenate([ends[:1], places, ends[1:]])
        return [places if np.linalg.det(self.M) > 0.0 else places[::-1]]

    def _on_disc(self, turns: Array) -> Complexes:
        """Return places of the section on its disc, where the normal has turned from the crest."""
        profile = self.radius * np.array([np.sin(turns), 1.0 - np.cos(turns)])
        s, t = np.linalg.solve(self.M, profile - self.m[:, None])
        return np.asarray(s + 1j * t)

    def clearance(self, point: Vector2) -> float:
        return float(self._rows.clearances(_place(point)).item())

    def clearances(self, places: Complexes) -> Array:
        return self._rows.clearances(places)

    def rest(
        self, joint: Vector2, start: float, end: float, height: float, low: float, high: float
    ) -> Rest | None:
        span = Span.of(start, end, height)
        with np.errstate(invalid="ignore", divide="ignore"):
            found = self._rows.rests(_place(joint), span, *_row(low, high))
        angle, distance, flat, _ = (value.item() for value in found)
        if math.isnan(angle):
            return None
        return Rest(angle, 0.5 * (start + end) if flat else distance, bool(flat))

    def face_clearance(
        self, joint: Vector2, start: float, end: float, height: float, angle: float
    ) -> float:
        span = Span.of(start, end, height)
        found = self._rows.face_clearances(_place(joint), span, np.array([angle]))
        return float(found.item())


def _place(point: Vector2) -> Complexes:
    return np.array([complex(*point)])


def _row(low: float, high: float) -> tuple[Array, Array]:
    return np.array([low]), np.array([high])
