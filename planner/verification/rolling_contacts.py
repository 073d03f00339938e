"""Contacts of tiles that roll and slide on rock: where they touch, and how far they slip.

For the check of a floating hand (`planner.verification.floating`), from normals and distances of
the rock alone.
"""

from __future__ import annotations

import cmath
import math
from typing import NamedTuple

import numpy as np

from hand_models.finger import PHALANGES, Contact, FingerModel
from hand_models.hand import FINGERS, SettledHand
from hand_models.sections import Section

__all__ = ["RestingContact", "TileFace", "finger_contacts"]

PRESSURE_NODES = np.transpose(np.polynomial.legendre.leggauss(3)).tolist()
"""Nodes and weights of Gauss-Legendre quadrature, exact for a tile's parabolic pressure."""


class TileFace(NamedTuple):
    """A tile's face in the axes of its phalanx, turned by the contact's tilt.

    Attributes
    ----------
    along, height : float
        Position of the contact at rest from the phalanx's joint: along the face, and normal to it
        [m].
    near, far : float
        Positions along the face at which it begins and ends [m].
    way : complex
        Unit vector along the face at rest, x + i z of the finger's plane.
    depth : float
        Depth to which the face is pressed in [m].
    lies : bool
        True if the tile touches with its face, False if with an edge.
    """

    along: float
    height: float
    near: float
    far: float
    way: complex
    depth: float
    lies: bool

    @classmethod
    def of(cls, contact: Contact, model: FingerModel, depth: float) -> TileFace:
        """Return the face of a tile that is pressed in to a depth [m], from its contact."""
        way = contact.angle + contact.tilt
        arm = complex(contact.along, model.tile_height + contact.rise)
        arm *= cmath.rect(1.0, -contact.tilt)
        near, far = (arm.real + each - contact.along for each in model.tile_range)
        axis = cmath.rect(1.0, way)
        return cls(arm.real, arm.imag, near, far, axis, depth, contact.kind == "face")

    def bears(self, touches: float, radius: float) -> float:
        """Return the centre of pressure of the face on a circle of rock, along the face [m].

        Parameters
        ----------
        touches : float
            Position along the face at which it touches the circle [m].
        radius : float
            Radius of the circle [m].
        """
        widest = math.sqrt(2.0 * self.depth * radius)
        start, end = max(self.near, touches - widest), min(self.far, touches + widest)
        if not start < end:
            return touches
        middle, half, pressed, moment = (start + end) / 2.0, (end - start) / 2.0, 0.0, 0.0
        for node, weight in PRESSURE_NODES:
            place = middle + half * node
            pressure = weight * (self.depth - (place - touches) ** 2 / (2.0 * radius))
            pressed, moment = pressed + pressure, moment + pressure * place
        return moment / pressed


class RestingContact(NamedTuple):
    """A tile's contact with the rock at rest, from which `slip` measures.

    Attributes
    ----------
    section : Section
        Rock in the finger's plane.
    face : TileFace
        The tile's face.
    radius : float or None
        Radius of the rock at the contact [m]; infinite where it is flat, None where it is neither a
        circle nor a line.
    point : complex
        Point from which the way along the rock counts, x + i z of the finger's plane [m].
    normal : complex
        Outward normal of the rock there.
    gap : float
        Distance of the point from the rock [m].
    touches : float
        Position along the face at which it touches the rock [m].
    bears : float or None
        Centre of pressure along a face that rolls on the rock [m]; None if the face slides.
    """

    section: Section
    face: TileFace
    radius: float | None
    point: complex
    normal: complex
    gap: float
    touches: float
    bears: float | None

    @classmethod
    def of(cls, section: Section, face: TileFace, point: complex) -> RestingContact:
        """Return the contact of a face that touches at x + i z of the finger's plane [m]."""
        radius, touches, bears = _radius(section, point), face.along, None
        # from a radius of 10 m on the model lets faces slide as on a flat
        if radius is not None and face.lies and radius < 10.0:
            beside = face.along + _beside(section, radius, point, face.way)
            if face.near <= beside <= face.far:
                touches, bears = beside, face.bears(beside, radius)
        start = point + (touches - face.along) * face.way
        gap = section.distance(start)
        return cls(section, face, radius, start, _normal(section, start), gap, touches, bears)

    def slip(self, point: complex, along: float, way: complex) -> tuple[float | None, float]:
        """Return the slip of the tile on the rock, and the error of its reported contact [m].

        A rolling face slips by the travel of the contact along the face minus its travel along the
        rock.

        Parameters
        ----------
        point : complex
            Contact point after the motion, x + i z of the finger's plane [m].
        along : float
            Position of that point along the phalanx [m].
        way : complex
            Unit vector along the face after the motion.

        Returns
        -------
        slip : float or None
            Slip along the rock [m]; None where the rock near the contact is neither a circle nor a
            line, or the contact goes on from one to the other.
        off : float
            Distance along the phalanx from the reported contact to the recomputed one [m].
        """
        face, radius = self.face, self.radius
        if radius is None:
            return None, 0.0
        off = along - face.along
        if self.bears is None:
            arc = self._arc(point, way, face.way if face.lies else None)
            return None if arc is None else off - arc, off
        touches = along + _beside(self.section, radius, point, way)
        touches = min(max(touches, face.near), face.far)
        went = face.bears(touches, radius) - self.bears
        arc = self._arc(point + (touches - along) * way, way, face.way)
        return None if arc is None else touches - self.touches - arc, off - went

    def _arc(self, after: complex, u: complex, lies: complex | None) -> float | None:
        """Return how far the contact went along the rock, positive away from the base [m].

        From the chord and the turn of the rock's normal, as on a circle; None if that is no chord
        of a circle. ``lies``: along a face that touches at rest, which on a flat is the rock's own
        way but for the search's tolerance.
        """
        first, last = self.normal, _normal(self.section, after)
        turn, middle = cmath.phase(last * first.conjugate()), first + last
        if abs(turn) > 1e-3 and abs(_dot(after - self.point, middle / abs(middle))) > 1e-8:
            # [rad, m] where an edge's fillet ends, for one
            return None
        tangent = 1j * middle / abs(middle)
        straight = 1e-12  # [rad] turn of the normal of flat rock
        if lies is not None and abs(turn) < straight:
            tangent = lies
        sign = math.copysign(1.0, _dot(tangent, u))
        chord = _dot(after - self.point, tangent)
        path = chord if abs(turn) < straight else chord * (turn / 2.0) / math.sin(turn / 2.0)
        return sign * (path - self.gap * turn)


def finger_contacts(
    hand: SettledHand, index: int
) -> tuple[tuple[TileFace, ...], tuple[RestingContact | None, ...]]:
    """Return the faces of a finger's tiles, and their contacts with the rock."""
    settled = hand.fingers[index]
    model = settled.model
    own = np.flatnonzero(hand.finger_of == index)
    section = hand.hand.section(FINGERS[index], hand.hold, hand.grasp, hand.seating.pose)
    depths = model.depths(len(own) > len(PHALANGES)) * hand.closing_tension
    faces, contacts = [], list[RestingContact | None]()
    for contact, depth in zip(settled.contacts, depths, strict=True):
        faces.append(face := TileFace.of(contact, model, float(depth)))
        at = complex(*contact.point(model.tile_height))
        if section is None or contact.kind not in ("face", "edge"):
            contacts.append(None)
        else:
            contacts.append(RestingContact.of(section, face, at))
    return tuple(faces), tuple(contacts)


def _dot(a: complex, b: complex) -> float:
    return a.real * b.real + a.imag * b.imag


def _normal(section: Section, point: complex) -> complex:
    return complex(*section.normal((point.real, point.imag)))


def _beside(section: Section, radius: float, point: complex, way: complex) -> float:
    """Return how far along a line through a point it is nearest to a circle [m]."""
    return -(radius + section.distance(point)) * _dot(_normal(section, point), way)


def _radius(section: Section, point: complex) -> float | None:
    """Return the radius of a section that is a circle about a place, or a line: infinite [m].

    Beside a circle of radius R a point at e along its tangent is √(R² + e²) − R away from it. None
    where the rock is neither: the model takes it as one, which only the model knows.
    """
    out = _normal(section, point)
    foot, aside = point - section.distance(point) * out, 1j * out
    beside = 4e-3  # [m] from the contact, and twice that, the rock is looked at
    near = [section.distance(foot + side * beside * aside) for side in (1.0, -1.0)]
    far = [section.distance(foot + 2.0 * side * beside * aside) for side in (1.0, -1.0)]
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
