"""Rock in a finger's plane: what settling asks of it.

A section has coordinates (s, t), t growing into the rock; places in it are complex numbers s + i t
[m], and directions complex numbers of length one. Its rock is the cut of a smooth hold, a
half-plane, a disc, an ellipse or one of these swept along two faces
(`hand_models.sections.smooth`), or it is known by polylines (`hand_models.sections.polyline`).

Settling asks one question: at which angle does the face of a phalanx that turns about its joint
first meet the rock (`Section.rest`).
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array
from hand_models.sections.settings import SECTION_SETTINGS

__all__ = ["Complexes", "Face", "Flags", "Rest", "Section", "Vector2"]

Vector2 = tuple[float, float]

Complexes = NDArray[np.complex128]

Flags = NDArray[np.bool_]


class Face(NamedTuple):
    """The face of a phalanx, on the side of the rock.

    Attributes
    ----------
    start, end : float
        Where along the phalanx it begins and ends [m].
    height : float
        Of it above the phalanx [m].
    level : float
        How near the rock both ends are for it to lie flat [m].
    """

    start: float
    end: float
    height: float
    level: float = SECTION_SETTINGS.level_distance


class Rest(NamedTuple):
    """A face at rest on the rock.

    Attributes
    ----------
    angle : float
        Of the phalanx, from the section's first axis toward its second [rad].
    distance : float
        Of the contact from the joint, along the phalanx; the face's middle if it lies flat [m].
    flat : bool
        Whether the face lies flat, so that it touches all along.
    """

    angle: float
    distance: float
    flat: bool = False


class Section(ABC):
    """Rock in a plane with coordinates (s, t); t grows into the rock."""

    @abstractmethod
    def outline(self, reach: float, spacing: float) -> Sequence[Complexes]:
        """Return the boundary of the rock as chains of points s + i t, rock on their left [m].

        Parameters
        ----------
        reach : float
            From the origin; what is farther off may be missing [m].
        spacing : float
            Of points along curved rock, about [m].
        """

    @abstractmethod
    def distance(self, point: complex) -> float:
        """Return about how far a point is from the rock, negative inside [m].

        Exact on flat and round sections, and everywhere its sign is.
        """

    @abstractmethod
    def rest(self, joint: complex, face: Face, low: float, high: float) -> Rest | None:
        """Return where a face first meets the rock as its phalanx turns.

        Parameters
        ----------
        joint : complex
            About which the phalanx turns [m].
        face : Face
        low, high : float
            The angle grows from one to the other; at ``low`` the face is free [rad].

        Returns
        -------
        Rest or None
            None if it meets no rock on its way.
        """

    def clearance(self, point: Vector2) -> float:
        """Return `distance` of a point (s, t) [m]."""
        return self.distance(complex(*point))

    def clearances(self, places: Complexes) -> Array:
        """Return the distances of places (...) from the rock [m]."""
        return np.array(list(map(self.distance, places.ravel().tolist()))).reshape(places.shape)

    def face_clearance(self, joint: complex, u: complex, face: Face) -> float:
        """Return about how far the face of a phalanx along u is from the rock [m].

        Negative where it cuts into it.
        """
        along = np.linspace(face.start, face.end, 9).tolist()
        return min(self.distance(joint + complex(a, face.height) * u) for a in along)

    def normal(self, point: Vector2) -> Vector2:
        """Return the unit vector out of the rock at the place nearest a point."""
        s, t = point
        step = 1e-7  # [m] of the gradient's differences
        ds = self.clearance((s + step, t)) - self.clearance((s - step, t))
        dt = self.clearance((s, t + step)) - self.clearance((s, t - step))
        length = math.hypot(ds, dt)
        return (ds / length, dt / length) if length > 0.0 else (0.0, -1.0)
