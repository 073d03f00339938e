"""Phalanges that turn about a joint while one of them bears on rock, and the rock under it.

A phalanx whose face touches rolls on the circle that fits the rock; one that touches with an edge
of its tile, or lies flat, slides with that point (`hand_models.compliance.rolling`).
"""

from __future__ import annotations

import cmath
import itertools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.finger import PHALANGES, SettledFinger, middle_of_bed
from hand_models.sections import Section, Vector2

__all__ = ["FingerLink", "Numbers", "across", "bearing_angle", "dot", "links_of", "turned", "unit"]

STANDING_ANGLE = 0.1
"""From this angle between its arm and the rock's normal on, a phalanx stands on its end [rad].

The arm of the contact force about the joint is then less than a tenth of the arm from joint to
contact, and would be nothing where the contact is lost: turns and loads for a way of the base would
grow without bound within the last tenths of a millimetre. From here on the arm stays as it is, as
on a rounded end.
"""
ROUNDING_ANGLE = 1e-12
"""Turn at rest that is rounding, not the arm that a standing phalanx keeps [rad]."""
LOST_DISTANCE = 1.1
"""Distance of a joint from the rock, in arms from joint to contact, from which on rock is lost [1].

A sharp end would lose it at 1. The search for wrist poses needs some way beyond; that contacts are
no longer those of the closed hand is found by closing it anew at the pose of the plan.
"""

Numbers = NDArray[Any]
"""Array of real numbers, or of complex numbers for complex-step derivatives."""


def bearing_angle(x: Numbers, z: Numbers) -> Numbers:
    """Return the angle of the vector (x, z) from x toward z [rad]; valid for complex steps."""
    angle = np.arctan2(z.real, x.real)
    if not (np.iscomplexobj(x) or np.iscomplexobj(z)):
        return np.asarray(angle)
    square = x.real**2 + z.real**2
    return np.asarray(angle + 1j * (x.real * z.imag - z.real * x.imag) / square)


class FingerLink(NamedTuple):
    """Phalanges that turn as one about a free joint, and the rock under the one that bears.

    Lengths "along" and "above" are in axes of the bearing phalanx that are turned by its contact's
    tilt: the contact presses upward in them. Of one finger these are numbers and vectors (x, z) in
    F, of F fingers arrays of shapes (F, 1) and (F, 2, 1).

    Attributes
    ----------
    bearing : int
        -1 where no link begins.
    along, above : float
        Where the contact's axes begin, and how high the contact is, from the link's joint [m].
    rest, raised : (float, float)
        Unit vector along the axes at rest, and ``above`` as a vector [m].
    rolls : bool
        Whether its face rolls on the circle; otherwise its point slides.
    flat : bool
        Whether the rock is a straight line; ``radius`` then stands for nothing.
    start, end : float
        Where on the phalanx the contact may roll to [m].
    contact : float
        c⁰ at rest, or the place of the point that slides [m].
    depth, widest : float
        How far the tile is pressed in, and how far it then presses to both sides of the contact
        where its end is not nearer [m]; ``widest`` is −∞ where no bed is pressed.
    centre : (float, float)
        Centre of the circle, or a place on the line [m].
    into, back : (float, float)
        Unit vectors at c⁰: into the rock, and along it toward the base.
    radius : float
        Of the rock there [m].
    reach : float
        Distance of the contact's path from the centre: spines may reach across a gap [m].
    off_at_rest : float
        How far from c⁰ the middle of the pressures is at rest [m].
    slip_at_rest : float
        Slip of a phalanx at rest, by the arm that it keeps where it stands on its end [m].
    """

    bearing: Any = -1
    along: Any = 0.0
    above: Any = 0.0
    rest: Any = (1.0, 0.0)
    raised: Any = (0.0, 0.0)
    rolls: Any = False
    flat: Any = False
    start: Any = 0.0
    end: Any = 0.0
    contact: Any = 0.0
    depth: Any = 1.0
    widest: Any = -math.inf
    centre: Any = (0.0, 2.0)
    into: Any = (0.0, 1.0)
    back: Any = (-1.0, 0.0)
    radius: Any = 1.0
    reach: Any = 1.0
    off_at_rest: Any = 0.0
    slip_at_rest: Any = 0.0

    def turn(self, joint: Numbers) -> tuple[Numbers, Numbers, Numbers]:
        """Return the turns of bearing phalanges, and how far contacts go along them, and slip.

        A turn is the unit vector, shape (F, 2, m), to which it turns x. NaN where a phalanx finds
        no rock.

        Parameters
        ----------
        joint : ndarray, shape (F, 2, m)
            Places of the links' joints [m].
        """
        apart = self.centre - joint
        toward = np.where(self.flat[:, None], self.into, apart)
        square = dot(toward, toward)
        # a face is tangent to the circle up to its ends; a point slides on it, or along the line
        rolled = np.sqrt(square - (self.reach + self.above) ** 2) - self.along
        rolled = np.where(rolled.real > self.end, self.end, rolled)
        rolled = np.where(rolled.real >= self.start, rolled, self.start)
        c = np.where(self.rolls, rolled, self.contact)
        ahead = self.along + c
        arm = ahead * ahead + self.above * self.above
        # of the arm from joint to contact: what is toward the centre, and what is across
        near = 0.5 * (arm + square - self.reach * self.reach)
        near = np.where(self.flat, dot(apart, self.into), near)
        beside = np.sqrt(arm * square - near * near)
        whole = np.sqrt(arm * square)
        stands = near.real > math.cos(STANDING_ANGLE) * whole.real
        if stands.any():
            # the angle goes on as steeply as it is there
            away = near / whole
            angle = STANDING_ANGLE - (away - math.cos(STANDING_ANGLE)) / math.sin(STANDING_ANGLE)
            angle = np.where(away.real < LOST_DISTANCE, angle, np.nan)
            near = np.where(stands, whole * np.cos(angle), near)
            beside = np.where(stands, whole * np.sin(angle), beside)
        place = _turned_back(toward, np.stack([near, beside], axis=1)) / square[:, None]
        rest = self.rest * ahead[:, None] + self.raised
        way = _turned_back(place, rest) / arm[:, None]
        # the contact seen from the circle's centre, turned from where it was at rest; on a line
        # along the tangent that points away from the base
        seen = apart - place
        line = dot(seen, self.back)
        arc = self.radius * bearing_angle(dot(seen, self.into), line)
        went = c - self.contact
        slip = went - np.where(self.flat, line, arc) - self.slip_at_rest
        return way, went + (self.off(c) - self.off_at_rest), slip

    def settled(self, joint: Numbers) -> FingerLink:
        """Return links that have neither turned nor slipped where they are at rest.

        Parameters
        ----------
        joint : ndarray, shape (F, 2, 1)
            Places of the links' joints at rest [m].
        """
        with np.errstate(invalid="ignore", divide="ignore"):
            way, _, slip = self.turn(joint)
        # others keep their numbers to the last bit
        stands = (self.bearing >= 0) & (np.abs(way[:, 1]) > ROUNDING_ANGLE)
        return self._replace(
            rest=np.where(stands[:, None], turned(self.rest, way), self.rest),
            raised=np.where(stands[:, None], turned(self.raised, way), self.raised),
            slip_at_rest=np.where(stands, slip, 0.0),
        )

    def off(self, c: Any) -> Any:
        """Return how far from c⁰ the middle of the pressures is: of a parabola cut short [m]."""
        rooms = c - self.start, self.end - c
        cut = np.minimum(rooms[0].real, rooms[1].real) < self.widest
        if not cut.any():
            return 0.0
        reaches = [np.where(room.real < self.widest, room, self.widest) for room in rooms]
        middle = middle_of_bed(reaches, [1.0 / self.radius] * 2, self.depth)
        return np.where(cut, middle, 0.0)


def unit(angle: Numbers) -> Numbers:
    """Return unit vectors (x, z), shape (..., 2, m), at angles (..., m) from x toward z."""
    return np.stack([np.cos(angle), np.sin(angle)], axis=-2)


def dot(a: Numbers, b: Numbers) -> Numbers:
    """Return inner products (..., m) of vectors (x, z), shape (..., 2, m), without conjugation."""
    return np.asarray(a[..., 0, :] * b[..., 0, :] + a[..., 1, :] * b[..., 1, :])


def across(vectors: Numbers) -> Numbers:
    """Return vectors (x, z), shape (..., 2, m), turned by a quarter from x toward z."""
    return np.asarray(vectors[..., ::-1, :] * np.array([[-1.0], [1.0]]))


def turned(vectors: Numbers, by: Numbers) -> Numbers:
    """Return vectors turned as ``by`` is from x, and as much longer."""
    return np.asarray(vectors * by[..., :1, :] + across(vectors) * by[..., 1:, :])


def _turned_back(vectors: Numbers, by: Numbers) -> Numbers:
    """Return vectors turned by as much the other way, and as much longer."""
    return np.asarray(vectors * by[..., :1, :] - across(vectors) * by[..., 1:, :])


def links_of(
    finger: SettledFinger, section: Section | None, depths: Sequence[float]
) -> list[FingerLink]:
    """Return the link that begins at each joint of a finger."""
    found = [FingerLink() for _ in PHALANGES]
    for joint, end in itertools.pairwise([*finger.free, len(finger.contacts)]):
        bears = [i for i in range(joint, end) if finger.contacts[i].kind != "none"]
        if bears and section is not None:
            found[joint] = _link(finger, section, joint, bears[0], depths[bears[0]])
    return found


def _link(
    finger: SettledFinger, section: Section, first: int, bearing: int, depth: float
) -> FingerLink:
    model, contacts = finger.model, finger.contacts
    contact, pivot = contacts[bearing], complex(*contacts[first].joint)
    u = cmath.rect(1.0, contact.angle + contact.tilt)
    point = contact.point(model.tile_height)
    joint = complex(*contact.joint)
    ahead, arm = (joint - pivot) / u, (complex(*point) - joint) / u
    into = (-u.imag, u.real)
    if contact.kind == "edge":
        out = section.normal(point)
        into = (-out[0], -out[1])
        gap, away = max(section.clearance(point), 0.0), 0.0
        curvature = _curvature(section, point, model.tile_length, gap)
    else:
        curvature, away, gap = _under_face(section, point, u, model.tile_length)
    near, far = model.tile_range
    if contact.kind == "frame":
        near, far, depth = far, model.joint_spacing, 0.0
    start, end = (arm.real + (each - contact.along) for each in (near, far))
    flat = curvature * 10.0 <= 1.0  # from a radius of 10 m on
    radius = 10.0 if flat else 1.0 / curvature
    # beyond its radius there is no more of the circle that the rock is taken for
    near_by = not flat and abs(away) < radius
    rolls = near_by and contact.kind != "edge" and start <= arm.real + away <= end
    if rolls:
        arm += away
        point = (point[0] + away * u.real, point[1] + away * u.imag)
        # of the face's line from the rock
        gap = math.sqrt((radius + gap) ** 2 - away**2) - radius
    reach = radius + (gap if rolls else max(gap, 0.0))
    pressed, beyond = rolls and depth > 0.0, 0.0 if flat else reach
    above = ahead.imag + arm.imag
    link = FingerLink(
        bearing=bearing,
        along=ahead.real,
        above=above,
        rest=(u.real, u.imag),
        raised=(-above * u.imag, above * u.real),
        rolls=rolls,
        flat=flat,
        start=start,
        end=end,
        contact=arm.real,
        depth=depth if pressed else 1.0,
        widest=math.sqrt(2.0 * depth * radius) if pressed else -math.inf,
        centre=(point[0] + beyond * into[0], point[1] + beyond * into[1]),
        into=into,
        back=(-into[1], into[0]),
        radius=radius,
        reach=reach,
    )
    return link._replace(off_at_rest=float(link.off(arm.real)))


def _under_face(
    section: Section, point: Vector2, u: complex, length: float
) -> tuple[float, float, float]:
    """Return the rock's curvature under a face, and how far along it touches the circle there.

    From the distances d of three places of the face, here and at e to both sides: of a circle whose
    centre is at (a, b) from here, (R + d)² = (s − a)² + b² for s = −e, 0, e.

    Returns
    -------
    curvature : float
        1/R; zero where rock is flat or hollow [1/m].
    away : float
        a [m].
    gap : float
        The middle distance [m].
    """
    e = _probe(length)
    before, here, after = (
        section.clearance((point[0] + s * u.real, point[1] + s * u.imag)) for s in (-e, 0.0, e)
    )
    fall = before + after - 2.0 * here
    square = 2.0 * e**2 - (before**2 + after**2 - 2.0 * here**2)
    if not (fall > 0.0 and square > 0.0):
        return 0.0, 0.0, here
    radius = square / (2.0 * fall)
    return 1.0 / radius, (before - after) * (2.0 * radius + before + after) / (4.0 * e), here


def _curvature(section: Section, point: Vector2, length: float, gap: float) -> float:
    """Return the rock's curvature near a contact, from its distance beside it [1/m]."""
    out = section.normal(point)
    foot = (point[0] - gap * out[0], point[1] - gap * out[1])
    reach = _probe(length)
    sides: Sequence[float] = (-reach, reach)
    falls = [section.clearance((foot[0] - s * out[1], foot[1] + s * out[0])) for s in sides]
    fall = 0.5 * sum(falls)
    # on a circle of radius R the distance is √(R² + e²) − R
    return 2.0 * fall / (reach**2 - fall**2) if fall > 0.0 else 0.0


def _probe(length: float) -> float:
    """Return how far to both sides of a contact the rock is looked at, of a tile so long [m]."""
    return 0.25 * length
