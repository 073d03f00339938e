"""The rock in a finger's plane: base class of sections, and the contact of a turning phalanx.

A section has coordinates (s, t), t growing into the rock; places are complex numbers s + i t [m],
directions complex numbers of length one, and angles grow from s toward t [rad]. The rock is the cut
of a smooth hold (a half-plane, a disc, an ellipse or one of these swept along two faces,
`hand_models.sections.smooth`), or is bounded by polylines (`hand_models.sections.polyline`).

`Section.rest` finds the angle at which the face of a phalanx that turns about its joint first meets
the rock.
"""

from __future__ import annotations

import cmath
import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array
from hand_models.sections.settings import SECTION_SETTINGS

__all__ = ["Complexes", "Face", "Flags", "Rest", "Section", "Turned", "Vector2"]

Vector2 = tuple[float, float]

Complexes = NDArray[np.complex128]

Flags = NDArray[np.bool_]


class Face(NamedTuple):
    """The face of a phalanx, on the side of the rock: a straight line parallel to the phalanx.

    Attributes
    ----------
    start, end : float
        Distances along the phalanx, from its joint, at which the face begins and ends [m].
    height : float
        Distance of the face from the phalanx's axis [m].
    level : float
        Distance from the rock up to which both ends count as touching, so that the face lies flat
        [m].
    """

    start: float
    end: float
    height: float
    level: float = SECTION_SETTINGS.level_distance


class Rest(NamedTuple):
    """Contact of a face that has turned until it rests on the rock.

    Attributes
    ----------
    angle : float
        Angle of the phalanx from the section's s axis toward t [rad].
    distance : float
        Distance of the contact from the joint, along the phalanx; the face's middle if it lies
        flat [m].
    flat : bool
        True if the face lies flat, so that its whole length touches.
    """

    angle: float
    distance: float
    flat: bool = False


Turned = tuple[float, complex, float, bool]
"""Angle by which a phalanx turns until its face rests [rad], the phalanx's direction, the contact's
distance along it [m], and True if the face lies flat.
"""


class Section(ABC):
    """The rock in a finger's plane: s along the finger, t into the rock; base class of sections.

    Attributes
    ----------
    skew : bool
        True if the plane is nearly parallel to the axis of the shape that it cuts.
    """

    skew = False

    @abstractmethod
    def outline(self, reach: float, spacing: float) -> Sequence[Complexes]:
        """Return the boundary of the rock as chains of points s + i t, with rock on their left [m].

        Parameters
        ----------
        reach : float
            Distance from the origin beyond which rock may be left out [m].
        spacing : float
            Approximate distance of neighbouring points on curved rock [m].
        """

    @abstractmethod
    def distance(self, point: complex) -> float:
        """Return the approximate signed distance of a point s + i t from the rock [m].

        Negative inside. The distance is exact on flat and round sections, its sign on all.
        """

    @abstractmethod
    def rest(self, joint: complex, face: Face, low: float, high: float) -> Rest | None:
        """Return the contact at which a face first meets the rock as its phalanx turns.

        Parameters
        ----------
        joint : complex
            Joint about which the phalanx turns [m].
        face : Face
        low, high : float
            Angle of the phalanx from which it turns, and up to which; at ``low`` the face is clear
            of the rock [rad].

        Returns
        -------
        Rest or None
            None if the face meets no rock up to ``high``.
        """

    def turned(self, joint: complex, face: Face, low: complex, span: float) -> Turned | None:
        """Return the first contact of a face as its phalanx turns from ``low`` by up to ``span``.

        Parameters
        ----------
        joint : complex
            Joint about which the phalanx turns [m].
        face : Face
        low : complex
            Direction of the phalanx at the start, of length one.
        span : float
            Largest angle of turning [rad].

        Returns
        -------
        tuple of (float, complex, float, bool), or None
            Angle turned [rad], the phalanx's direction, the contact's distance along it [m], and
            True if the face lies flat; None if the face meets no rock.
        """
        start = cmath.phase(low)
        found = self.rest(joint, face, start, start + span)
        if found is None:
            return None
        return found.angle - start, cmath.rect(1.0, found.angle), found.distance, found.flat

    def clear(self, joint: complex, u: complex, face: Face) -> bool:
        """Return True if the face of a phalanx does not touch the rock.

        Parameters
        ----------
        joint : complex
            Joint of the phalanx, s + i t [m].
        u : complex
            Unit direction of the phalanx.
        face : Face
        """
        return self.face_clearance(joint, u, face) > 0.0

    def clearance(self, point: Vector2) -> float:
        """Return the approximate signed distance of (s, t) from the rock, negative inside [m]."""
        return self.distance(complex(*point))

    def clearances(self, places: Complexes) -> Array:
        """Return the signed distance of each of several places from the rock, negative inside.

        Parameters
        ----------
        places : ndarray of complex
            s + i t [m].

        Returns
        -------
        ndarray
            Distances, in the shape of ``places``; approximate, as `distance` [m].
        """
        return np.array(list(map(self.distance, places.ravel().tolist()))).reshape(places.shape)

    def face_clearance(self, joint: complex, u: complex, face: Face) -> float:
        """Return the approximate distance between the rock and the face of a phalanx [m].

        Negative where the face cuts into the rock.

        Parameters
        ----------
        joint : complex
            Joint of the phalanx, s + i t [m].
        u : complex
            Unit direction of the phalanx.
        face : Face
        """
        along = np.linspace(face.start, face.end, 9).tolist()
        return min(self.distance(joint + complex(a, face.height) * u) for a in along)

    def normal(self, point: Vector2) -> Vector2:
        """Return the unit vector (s, t) out of the rock at the place nearest a point (s, t)."""
        s, t = point
        step = 1e-7  # [m] of the gradient's differences
        ds = self.clearance((s + step, t)) - self.clearance((s - step, t))
        dt = self.clearance((s, t + step)) - self.clearance((s, t - step))
        length = math.hypot(ds, dt)
        return (ds / length, dt / length) if length > 0.0 else (0.0, -1.0)
