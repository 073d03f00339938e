"""Posture of a finger whose base moves a little: the finger rolls on the rock where it touches.

A settled finger's contacts are kept, and the rock near each of them is approximated by the circle
that fits it (a straight line where rock is flat or hollow). A phalanx whose face touches rolls on
that circle; one that touches with an edge of its tile, or lies flat, slides with that point. Both
have a closed form, so that thousands of poses of the base are solved at once.

A face touches the circle where it is tangent to it, at c⁰. Its force acts at the centre of pressure
of the tile's bed of springs (`hand_models.finger.phalanx_gaps`), which an end of the tile may cut
short: as c⁰ rolls, the centre of pressure goes with it, but never beyond the tile.

With the base displaced by (x, z) in the coordinates F of the settled finger and turned by ψ from x
toward z, phalanx i slips along the rock by

    δx_i = δc⁰_i − δs_i,

positive toward the finger's base, with c⁰ its contact from the joint and s the arc length of the
contact on the rock; its tile, anchored in the rock, makes up for the slip (Section 5.3).

All functions here also take complex numbers, so that derivatives are found by complex steps.
"""

from __future__ import annotations

import cmath
import itertools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hand_models.base import Array
from hand_models.finger import PHALANGES, Contact, SettledFinger, middle_of_bed
from hand_models.sections import Section, Vector2

__all__ = ["MovedPosture", "Numbers", "RollingContact", "bearing_angle"]

Numbers = NDArray[Any]
"""Array of real numbers, or of complex numbers for complex-step derivatives."""


class MovedPosture(NamedTuple):
    """Postures of F fingers after m displacements of their bases, shapes (F, 3, m) or (F, 3, 2, m).

    Attributes
    ----------
    angles : ndarray
        θ, angle of each phalanx from x toward z of F [rad].
    turns : ndarray
        δq, change of each joint's angle, closing [rad].
    slips : ndarray
        δx of each phalanx along the rock, toward the base; 0 without contact [m].
    joints, points : ndarray
        (x, z) in F of each joint and of each contact [m].
    directions : ndarray
        Unit vector (x, z) along each phalanx, turned by its contact's ``tilt``.
    reached : ndarray of bool, shape (F, m)
        Whether every phalanx with a contact still meets rock.
    """

    angles: Numbers
    turns: Numbers
    slips: Numbers
    joints: Numbers
    points: Numbers
    directions: Numbers
    reached: NDArray[np.bool_]


def bearing_angle(x: Numbers, z: Numbers) -> Numbers:
    """Return the angle of the vector (x, z) from x toward z [rad]; valid for complex steps."""
    angle = np.arctan2(z.real, x.real)
    if not (np.iscomplexobj(x) or np.iscomplexobj(z)):
        return np.asarray(angle)
    square = x.real**2 + z.real**2
    return np.asarray(angle + 1j * (x.real * z.imag - z.real * x.imag) / square)


class _Link(NamedTuple):
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
        place = _turned_back(toward, np.stack([near, beside], axis=1)) / square[:, None]
        rest = self.rest * ahead[:, None] + self.raised
        way = _turned_back(place, rest) / arm[:, None]
        # the contact seen from the circle's centre, turned from where it was at rest; on a line
        # along the tangent that points away from the base
        seen = apart - place
        line = dot(seen, self.back)
        arc = self.radius * bearing_angle(dot(seen, self.into), line)
        went = c - self.contact
        slip = went - np.where(self.flat, line, arc)
        return way, went + (self.off(c) - self.off_at_rest), slip

    def off(self, c: Any) -> Any:
        """Return how far from c⁰ the middle of the pressures is: of a parabola cut short [m]."""
        rooms = c - self.start, self.end - c
        cut = np.minimum(rooms[0].real, rooms[1].real) < self.widest
        if not cut.any():
            return 0.0
        reaches = [np.where(room.real < self.widest, room, self.widest) for room in rooms]
        middle = middle_of_bed(reaches, [1.0 / self.radius] * 2, self.depth)
        return np.where(cut, middle, 0.0)


def _unit(angle: Numbers) -> Numbers:
    """Return unit vectors (x, z), shape (..., 2, m), at angles (..., m) from x toward z."""
    return np.stack([np.cos(angle), np.sin(angle)], axis=-2)


def dot(a: Numbers, b: Numbers) -> Numbers:
    """Return inner products (..., m) of vectors (x, z), shape (..., 2, m), without conjugation."""
    return np.asarray(a[..., 0, :] * b[..., 0, :] + a[..., 1, :] * b[..., 1, :])


def across(vectors: Numbers) -> Numbers:
    """Return vectors (x, z), shape (..., 2, m), turned by a quarter from x toward z."""
    return np.asarray(vectors[..., ::-1, :] * np.array([[-1.0], [1.0]]))


def _turned(vectors: Numbers, by: Numbers) -> Numbers:
    """Return vectors turned as ``by`` is from x, and as much longer."""
    return np.asarray(vectors * by[..., :1, :] + across(vectors) * by[..., 1:, :])


def _turned_back(vectors: Numbers, by: Numbers) -> Numbers:
    """Return vectors turned by as much the other way, and as much longer."""
    return np.asarray(vectors * by[..., :1, :] - across(vectors) * by[..., 1:, :])


class RollingContact:
    """F settled fingers as functions from displacements of their bases to postures.

    Parameters
    ----------
    fingers : sequence of SettledFinger, length F
        Fingers at rest, each with its proximal joint at the origin of its finger frame F.
    sections : sequence of Section or None, length F
        Rock in each finger's plane, in its frame F; None if there is none.
    depths : array_like, shape (F, 3), optional
        Depth to which tiles are pressed into their beds of springs [m]; zero by default.
    """

    def __init__(
        self,
        fingers: Sequence[SettledFinger],
        sections: Sequence[Section | None],
        depths: ArrayLike = 0.0,
    ) -> None:
        pressed = np.broadcast_to(np.asarray(depths), (len(fingers), len(PHALANGES)))
        each = [_links(*own) for own in zip(fingers, sections, pressed.tolist(), strict=True)]
        self._links = [
            _Link(*(np.array(column)[..., None] for column in zip(*links, strict=True)))
            for links in zip(*each, strict=True)
        ]

        def of_contacts(name: str) -> Array:
            return np.array([[getattr(c, name) for c in f.contacts] for f in fingers])[..., None]

        self._angles = of_contacts("angle")
        self._rest, self._tilt = _unit(self._angles), _unit(of_contacts("tilt"))
        heights = np.array([finger.model.tile_height for finger in fingers])[:, None, None]
        self._contact = np.stack([of_contacts("along"), heights + of_contacts("rise")], axis=2)
        self._spacing = np.array([finger.model.joint_spacing for finger in fingers])[:, None, None]

    def move(self, x: Numbers, z: Numbers, turn: Numbers) -> MovedPosture:
        """Return the postures of the fingers after m displacements of their bases.

        Parameters
        ----------
        x, z : ndarray, shape (F, m)
            Displacement of the proximal joint in the finger frame F [m].
        turn : ndarray, shape (F, m)
            ψ, rotation of the base from x toward z [rad].
        """
        base = turn + 0.0 * (x + z)
        way = _unit(base)
        joint = np.stack([x, z], axis=1) + 0.0 * way
        shape = (len(base), len(PHALANGES), *way.shape[1:])
        joints, ways, along = (np.empty(shape, dtype=base.dtype) for _ in range(3))
        rolled, slips = (np.zeros_like(ways[:, :, 0]) for _ in range(2))
        with np.errstate(invalid="ignore", divide="ignore"):
            for i, link in enumerate(self._links):
                begins = link.bearing >= 0
                own = begins[:, 0].nonzero()[0]
                if len(own):
                    turned, roll, slip = link.turn(joint)
                    way = np.where(begins[:, None], turned, way)
                    bears = own, link.bearing[own, 0]
                    rolled[bears], slips[bears] = roll[own], slip[own]
                joints[:, i], ways[:, i] = joint, way
                along[:, i] = _turned(way, self._rest[:, i])
                joint = joint + self._spacing * along[:, i]
        changes = bearing_angle(ways[:, :, 0], ways[:, :, 1])
        contacts = self._contact + rolled[:, :, None] * self._tilt
        return MovedPosture(
            angles=self._angles + changes,
            turns=np.diff(changes, axis=1, prepend=base[:, None]),
            slips=slips,
            joints=joints,
            points=joints + _turned(along, contacts),
            directions=_turned(along, self._tilt),
            reached=np.isfinite(changes.real).all(axis=1),
        )


def _links(finger: SettledFinger, section: Section | None, depths: Sequence[float]) -> list[_Link]:
    """Return the link that begins at each joint of a finger."""
    found = [_Link() for _ in PHALANGES]
    for joint, end in itertools.pairwise([*finger.free, len(finger.contacts)]):
        bears = [i for i in range(joint, end) if finger.contacts[i].kind != "none"]
        if bears and section is not None:
            found[joint] = _link(finger, section, joint, bears[0], depths[bears[0]])
    return found


def _link(finger: SettledFinger, section: Section, first: int, bearing: int, depth: float) -> _Link:
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
        curvature = _curvature(section, contact, point, model.tile_length, gap)
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
    link = _Link(
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


def _curvature(
    section: Section, contact: Contact, point: Vector2, length: float, gap: float
) -> float:
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
