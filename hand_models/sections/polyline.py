"""Sections bounded by polylines: rock in a finger's plane whose surface is many straight pieces.

The boundary is one or more polylines, open or closed, that have the rock on their left (turning
from s toward t), convex or not. `hand_models.sections.boundary` finds distances from it, and
`hand_models.sections.first_contact` finds where a turning face first meets it.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hand_models.base import Array
from hand_models.sections.boundary import Boundary
from hand_models.sections.first_contact import TurningFaces
from hand_models.sections.section import Complexes, Face, Flags, Rest, Section, Vector2

__all__ = ["PolylineSection"]


class Rests(NamedTuple):
    """Contacts of n faces that turn until they rest on the rock, shape (n,) each.

    Attributes
    ----------
    angle, distance : ndarray
        Angle of the phalanx from s toward t [rad], and distance of the contact from the joint,
        along the phalanx [m]; NaN where a face meets no rock.
    flat : ndarray of bool
        True where the face lies flat.
    blocked : ndarray of bool
        True where the face cuts rock before it turns; the other arrays mean nothing there.
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
        Points (s, t) in order, each different from the one before it; a closed piece ends where it
        begins. Rock ends where an open piece ends: nothing is touched beyond [m].
    faceted : bool, optional
        True if the points are corners of the rock: a contact is then at the corner itself. False if
        they are places on a smooth curve: a contact is at the lowest place of a fitted parabola.
    """

    def __init__(self, pieces: Sequence[Array], *, faceted: bool = False) -> None:
        self.pieces, self.boundary = tuple(pieces), Boundary(pieces)
        self.faceted = faceted

    def rest(self, joint: complex, face: Face, low: float, high: float) -> Rest | None:
        found = self.rests(np.array([joint]), face, low, high)
        if math.isnan(found.angle[0]):
            return None
        return Rest(float(found.angle[0]), float(found.distance[0]), bool(found.flat[0]))

    def rests(self, joints: Complexes, face: Face, low: float, high: float) -> Rests:
        """Return the first contacts of faces that turn about n joints; see `rest`.

        Parameters
        ----------
        joints : ndarray of complex, shape (n,)
            Joints s + i t [m].
        face : Face
        low, high : float
            Angle of the phalanges from which they turn, and up to which [rad].
        """
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
        return [np.ascontiguousarray(piece).view(complex)[:, 0] for piece in self.pieces]

    def distance(self, point: complex) -> float:
        return float(self.boundary.clearances(np.array(point)))

    def clearances(self, places: Complexes) -> Array:
        return self.boundary.clearances(places)

    def normal(self, point: Vector2) -> Vector2:
        out = self.boundary.normal(complex(*point))
        return out.real, out.imag

    def highest(self, low: Array, high: Array) -> Array:
        """Return the least t of the rock in each of n windows of s.

        Parameters
        ----------
        low, high : ndarray, shape (n,)
            Bounds of the windows, low ≤ s ≤ high [m].

        Returns
        -------
        ndarray, shape (n,)
            Least t in each window; infinite without rock [m].
        """
        from hand_models.sections.compiled_polylines import highest_rock

        places, ends = self.boundary.places, self.boundary.ends
        return highest_rock(places, ends, np.ascontiguousarray(low), np.ascontiguousarray(high))
