"""Contacts of tiles that roll and slide on rock: where they touch it, and how far they slip.

Of the check of a floating hand (`planner.verification.floating`): from the rock's normals and
distances alone.
"""

from __future__ import annotations

import cmath
import math
from typing import NamedTuple

import numpy as np

from hand_models.base import Array
from hand_models.finger import Contact, FingerModel
from hand_models.sections import Section

__all__ = ["TileFace", "slip_of"]


class TileFace(NamedTuple):
    """A tile's face in its phalanx's axes, turned by the contact's tilt.

    Attributes
    ----------
    along, height : float
        Of the contact at rest from the phalanx's joint [m].
    near, far : float
        Where along them the face begins and ends [m].
    way : ndarray, shape (2,)
        Along it at rest.
    depth : float
        How far it is pressed in [m].
    lies : bool
        Whether it touches with the face itself, and not with an edge.
    """

    along: float
    height: float
    near: float
    far: float
    way: Array
    depth: float
    lies: bool

    @classmethod
    def of(cls, contact: Contact, model: FingerModel, depth: float) -> TileFace:
        way = contact.angle + contact.tilt
        arm = complex(contact.along, model.tile_height + contact.rise)
        arm *= cmath.rect(1.0, -contact.tilt)
        near, far = (arm.real + each - contact.along for each in model.tile_range)
        axis = np.array([math.cos(way), math.sin(way)])
        return cls(arm.real, arm.imag, near, far, axis, depth, contact.kind == "face")

    def bears(self, touches: float, radius: float) -> float:
        """Return the middle of the pressures on a circle that it touches at a place [m]."""
        widest = math.sqrt(2.0 * self.depth * radius)
        start, end = max(self.near, touches - widest), min(self.far, touches + widest)
        if not start < end:
            return touches
        nodes, weights = np.polynomial.legendre.leggauss(3)
        places = (start + end) / 2.0 + (end - start) / 2.0 * nodes
        pressures = weights * (self.depth - (places - touches) ** 2 / (2.0 * radius))
        return float(pressures @ places / pressures.sum())


def slip_of(
    section: Section, face: TileFace, points: tuple[Array, Array], after: tuple[float, Array]
) -> tuple[float | None, float]:
    """Return how far a tile slipped, and how far off the place is where it is said to bear [m].

    A face rolls: it slips by how far the place where it touches goes along it, less its way along
    the rock. No slip where that is not known. ``points``: of the contact, before and after.
    ``after``: how far along the phalanx it is then, and along what axis.
    """
    before, there = points
    along, way = after
    radius = _radius(section, before)
    if radius is None:
        return None, 0.0
    # from a radius of 10 m on the model lets faces slide as on a flat
    rolls, touches = face.lies and radius < 10.0, [face.along, along]
    if rolls:
        touches[0] += _beside(section, radius, before, face.way)
        touches[1] += _beside(section, radius, there, way)
    if not (rolls and face.near <= touches[0] <= face.far):
        off = along - face.along
        return off - _arc(section, before, there, way, face.way if face.lies else None), off
    touches[1] = min(max(touches[1], face.near), face.far)
    went = face.bears(touches[1], radius) - face.bears(touches[0], radius)
    first = before + (touches[0] - face.along) * face.way
    last = there + (touches[1] - along) * way
    arc = _arc(section, first, last, way, face.way)
    return touches[1] - touches[0] - arc, along - face.along - went


def _beside(section: Section, radius: float, point: Array, way: Array) -> float:
    """Return how far along a line through a point it is nearest to a circle [m]."""
    out = np.array(section.normal((float(point[0]), float(point[1]))))
    return -(radius + _clearance(section, point)) * float(out @ way)


def _arc(section: Section, before: Array, after: Array, u: Array, lies: Array | None) -> float:
    """Return how far the contact went along the rock, positive away from the base [m].

    From the chord and the turn of the rock's normal, as on a circle. ``lies``: along a face that
    touches at rest, which on a flat is the rock's own way but for the search's tolerance.
    """
    first, last = (np.array(section.normal((float(p[0]), float(p[1])))) for p in (before, after))
    gap = _clearance(section, before)
    turn = math.atan2(first[0] * last[1] - first[1] * last[0], float(first @ last))
    middle = first + last
    tangent = np.array([-middle[1], middle[0]]) / float(np.linalg.norm(middle))
    straight = 1e-12  # [rad] turn of the normal of flat rock
    if lies is not None and abs(turn) < straight:
        tangent = lies
    sign = math.copysign(1.0, float(tangent @ u))
    chord = float((after - before) @ tangent)
    path = chord if abs(turn) < straight else chord * (turn / 2.0) / math.sin(turn / 2.0)
    return sign * (path - gap * turn)


def _clearance(section: Section, point: Array) -> float:
    return section.clearance((float(point[0]), float(point[1])))


def _radius(section: Section, point: Array) -> float | None:
    """Return the radius of a section that is a circle about a place, or a line: infinite [m].

    Beside a circle of radius R a point at e along its tangent is √(R² + e²) − R away from it. None
    where the rock is neither: the model takes it as one, which only the model knows.
    """
    out = np.array(section.normal((float(point[0]), float(point[1]))))
    foot, aside = point - _clearance(section, point) * out, np.array([-out[1], out[0]])
    beside = 4e-3  # [m] from the contact, and twice that, the rock is looked at
    near = [_clearance(section, foot + side * beside * aside) for side in (1.0, -1.0)]
    far = [_clearance(section, foot + 2.0 * side * beside * aside) for side in (1.0, -1.0)]
    away = 0.5 * sum(near)
    if away < 0.0:
        return None
    radius, expected = math.inf, 0.0
    rounding = 1e-11  # [m] off a circle or a line
    if away > rounding:
        radius = (beside**2 - away**2) / (2.0 * away)
        expected = math.hypot(radius, 2.0 * beside) - radius
    spread = [*(x - away for x in near), *(x - expected for x in far)]
    return radius if max(map(abs, spread)) <= rounding else None
