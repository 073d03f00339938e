"""First contact of turning faces with a boundary of short segments, for many faces at once.

A face that turns about a joint at the distance h above it meets such rock first either

(a) at a vertex of the boundary: a vertex at the distance ρ and bearing β from the joint is on the
    face at ``a = √(ρ² − h²)`` along it, when the phalanx is at the angle ``θ = β − atan2(h, a)``;
(b) or with one of its ends, whose circle about the joint cuts a segment of the boundary.

The face comes to rest at the first of all these angles. It touches at the lowest point of a
parabola fitted to the rock near that contact (at the contact itself, of facets), or in the middle
of the stretch that touches if that is longer.
"""

from __future__ import annotations

import numpy as np

from hand_models.base import BASE_TOLERANCES, Array
from hand_models.sections.boundary import Boundary
from hand_models.sections.section import Complexes, Face, Flags
from hand_models.sections.settings import SECTION_SETTINGS

__all__ = ["TurningFaces"]


class TurningFaces:
    """Faces that turn over a boundary about n joints, starting at one angle.

    Parameters
    ----------
    boundary : Boundary
    joint : ndarray of complex, shape (n,)
        Joints s + i t about which the faces turn [m].
    face : Face
        Face of each phalanx.
    low : float
        Angle of the phalanges at the start [rad].
    """

    def __init__(self, boundary: Boundary, joint: Complexes, face: Face, low: float) -> None:
        self._boundary, self._joint, self._low = boundary, np.ascontiguousarray(joint), low
        self._ends = np.array([complex(along, face.height) for along in face[:2]])
        self._face = np.array(face[:3])

    def clearances(self) -> Array:
        """Return the distance of each face from the rock at the start, shape (n,) [m].

        Negative where a face cuts the rock; for other faces the distance of the nearer end.
        """
        from hand_models.sections.compiled_contacts import pierced_faces

        vertices, _, lasts = self._boundary.runs
        joints = self._joint.view(float).reshape(-1, 2)
        points = self._joint + self._ends[:, None] * np.exp(1j * self._low)
        clear = self._boundary.clearances(points).min(axis=0)
        cut = pierced_faces(vertices, lasts, joints, self._face, self._low).nonzero()[0]
        if len(cut):
            # places along a face at which its distance from the rock is computed
            parts = np.linspace(0.0, 1.0, 17)[:, None]
            points = points[0, cut] + parts * (points[1, cut] - points[0, cut])
            clear[cut] = self._boundary.clearances(points).min(axis=0)
        return np.asarray(clear)

    def contacts(self, high: float, faceted: bool) -> tuple[Array, Array, Flags]:
        """Return the first contact of each face with the rock.

        Parameters
        ----------
        high : float
            Angle up to which the phalanges turn [rad].
        faceted : bool
            True if vertices are corners of the rock, False if they are places on a smooth curve.

        Returns
        -------
        angle, distance : ndarray, shape (n,)
            Angle of the phalanx [rad], and distance of the contact along it [m]; NaN without
            contact.
        flat : ndarray of bool, shape (n,)
            True where the face lies flat.
        """
        from hand_models.sections.compiled_contacts import first_contacts

        joints = self._joint.view(float).reshape(-1, 2)
        fitted, rounding = SECTION_SETTINGS.fitted_length, BASE_TOLERANCES.rounding
        face, low = self._face, self._low
        return first_contacts(
            *self._boundary.runs, joints, face, low, high, fitted, int(faceted), rounding
        )
