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
    """Postures of F fingers after m displacements of their bases, shapes (F, m, 3) or (F, m, 3, 2).

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
    reached : ndarray of bool, shape (F, m)
        Whether every phalanx with a contact still meets rock.
    """

    angles: Numbers
    turns: Numbers
    slips: Numbers
    joints: Numbers
    points: Numbers
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
    tilt: the contact presses upward in them. Of one finger these are numbers, of F fingers arrays
    of shape (F, 1).

    Attributes
    ----------
    bearing : int
        -1 where no link begins.
    along, above : float
        Where the contact's axes begin, and how high the contact is, from the link's joint [m].
    rest : float
        Angle of the axes at rest [rad].
    rolls : bool
        Whether its face rolls on the circle; otherwise its point slides.
    flat : bool
        Whether the rock is a straight line; ``radius`` then stands for nothing.
    start, end : float
        Where on the phalanx the contact may roll to [m].
    contact : float
        c⁰ at rest, or the place of the point that slides [m].
    depth : float
        How far the tile is pressed in [m].
    point_x, point_z, into_x, into_z : float
        A place of the face, at c⁰ [m], and the unit vector into the rock there.
    radius : float
        Of the rock there [m].
    offset : float
        Of the contact's path from the rock: what spines reach across [m].
    """

    bearing: Any = -1
    along: Any = 0.0
    above: Any = 0.0
    rest: Any = 0.0
    rolls: Any = False
    flat: Any = False
    start: Any = 0.0
    end: Any = 0.0
    contact: Any = 0.0
    depth: Any = 0.0
    point_x: Any = 0.0
    point_z: Any = 1.0
    into_x: Any = 0.0
    into_z: Any = 1.0
    radius: Any = 1.0
    offset: Any = 0.0

    def turn(self, jx: Numbers, jz: Numbers) -> tuple[Numbers, Numbers, Numbers]:
        """Return how far bearing phalanges turn, contacts go along them, and they slip.

        NaN where a phalanx finds no rock.

        Parameters
        ----------
        jx, jz : ndarray, shape (F, m)
            Places of the links' joints [m].
        """
        reach = self.radius + self.offset
        ox, oz = self.point_x + reach * self.into_x, self.point_z + reach * self.into_z
        dx, dz = ox - jx, oz - jz
        square = dx * dx + dz * dz
        away = reach + self.above
        rolled = np.sqrt(square - away * away) - self.along
        near = ~(rolled.real >= self.start)
        far = rolled.real > self.end
        c = np.where(near, self.start, np.where(far, self.end, rolled))
        c = np.where(self.rolls, c, self.contact)
        ahead = self.along + c
        arm = np.sqrt(ahead * ahead + self.above * self.above)
        # a face is tangent to the circle; a point slides on it, or along the line
        tangent = bearing_angle(dx, dz) - np.arcsin(away / np.sqrt(square))
        cosine = (arm * arm + square - reach * reach) / (2.0 * arm * np.sqrt(square))
        gap = (self.point_x - jx) * self.into_x + (self.point_z - jz) * self.into_z
        toward = np.where(
            self.flat,
            np.arctan2(self.into_z, self.into_x) - np.arccos(gap / arm),
            bearing_angle(dx, dz) - np.arccos(cosine),
        )
        touch = toward - bearing_angle(ahead, self.above + 0.0 * ahead)
        angle = np.where(self.rolls & ~near & ~far, tangent, touch)
        turn = _within_half_a_turn(angle - self.rest)
        cosine, sine = np.cos(self.rest + turn), np.sin(self.rest + turn)
        px = jx + ahead * cosine - self.above * sine
        pz = jz + ahead * sine + self.above * cosine
        # the contact seen from the circle's centre, turned from where it was at rest; on a line
        # along the tangent (into_z, −into_x) that points away from the base
        seen = bearing_angle(
            (ox - px) * self.into_x + (oz - pz) * self.into_z,
            (px - ox) * self.into_z - (pz - oz) * self.into_x,
        )
        line = (px - self.point_x) * self.into_z - (pz - self.point_z) * self.into_x
        went = c - self.contact
        aside = self._aside(c) - self._aside(self.contact)
        return turn, went + aside, went - np.where(self.flat, line, self.radius * seen)

    def _aside(self, c: Any) -> Numbers:
        """Return how far from c⁰ the middle of the pressures is: of a parabola cut short [m]."""
        pressed = self.rolls & (self.depth > 0.0)
        depth = np.where(pressed, self.depth, 1.0)
        widest = np.sqrt(2.0 * depth * self.radius)
        rooms = (c - self.start, self.end - c)
        reaches = [np.where(pressed & (room.real < widest), room, widest) for room in rooms]
        middle = middle_of_bed(reaches, [1.0 / self.radius] * 2, depth)
        return np.asarray(np.where(pressed, middle, 0.0))


def _within_half_a_turn(angle: Numbers) -> Numbers:
    return np.asarray(angle - math.tau * np.round(angle.real / math.tau))


class RollingContact:
    """F settled fingers as functions from displacements of their bases to postures.

    Parameters
    ----------
    fingers : sequence of SettledFinger, length F
        Fingers at rest, each with its proximal joint at the origin of its F.
    sections : sequence of Section or None
        Rock in each finger's plane, in its F; None if there is none.
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
            _Link(*(np.array(column)[:, None] for column in zip(*links, strict=True)))
            for links in zip(*each, strict=True)
        ]

        def of_contacts(name: str) -> Array:
            return np.array([[getattr(c, name) for c in f.contacts] for f in fingers])[:, None]

        self._angles, self.tilts = of_contacts("angle"), of_contacts("tilt")
        heights = np.array([finger.model.tile_height for finger in fingers])[:, None, None]
        self._along, self._heights = of_contacts("along"), heights + of_contacts("rise")
        self._spacing = np.array([finger.model.joint_spacing for finger in fingers])[:, None]

    def move(self, x: Numbers, z: Numbers, turn: Numbers) -> MovedPosture:
        """Return the postures of the fingers after m displacements of their bases.

        Parameters
        ----------
        x, z : ndarray, shape (F, m)
            Displacement of the proximal joint in the finger frame F [m].
        turn : ndarray, shape (F, m)
            ψ, rotation of the base from x toward z [rad].
        """
        jx = x + 0.0 * (z + turn)
        jz, base = z + 0.0 * jx, turn + 0.0 * jx
        shape = (*jx.shape, len(PHALANGES))
        theta, rolled, slips = (np.zeros(shape, dtype=jx.dtype) for _ in range(3))
        joints = np.zeros((*shape, 2), dtype=jx.dtype)
        turned = base
        for i, link in enumerate(self._links):
            begins = link.bearing >= 0
            if begins.any():
                with np.errstate(invalid="ignore", divide="ignore"):
                    turn, roll, slip = link.turn(jx, jz)
                turned = np.where(begins, turn, turned)
                for j in range(i, len(PHALANGES)):
                    bears = link.bearing == j
                    rolled[..., j] += np.where(bears, roll, 0.0)
                    slips[..., j] += np.where(bears, slip, 0.0)
            theta[..., i] = self._angles[..., i] + turned
            joints[..., i, 0], joints[..., i, 1] = jx, jz
            jx = jx + self._spacing * np.cos(theta[..., i])
            jz = jz + self._spacing * np.sin(theta[..., i])
        cosine, sine = np.cos(theta), np.sin(theta)
        c = self._along + rolled * np.cos(self.tilts)
        height = self._heights + rolled * np.sin(self.tilts)
        points = joints + np.stack(
            [c * cosine - height * sine, c * sine + height * cosine], axis=-1
        )
        change = theta - self._angles
        before = np.concatenate([base[..., None], change[..., :-1]], axis=-1)
        return MovedPosture(
            angles=theta,
            turns=change - before,
            slips=slips,
            joints=joints,
            points=points,
            reached=np.isfinite(theta.real).all(axis=-1),
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
    # beyond its radius there is no more of the circle that the rock is taken for
    near_by = not flat and abs(away) < 1.0 / curvature
    rolls = near_by and contact.kind != "edge" and start <= arm.real + away <= end
    if rolls:
        arm += away
        point = (point[0] + away * u.real, point[1] + away * u.imag)
        # of the face's line from the rock
        gap = math.sqrt((1.0 / curvature + gap) ** 2 - away**2) - 1.0 / curvature
    return _Link(
        bearing=bearing,
        along=ahead.real,
        above=ahead.imag + arm.imag,
        rest=contact.angle + contact.tilt,
        rolls=rolls,
        flat=flat,
        start=start,
        end=end,
        contact=arm.real,
        depth=depth,
        point_x=point[0],
        point_z=point[1],
        into_x=into[0],
        into_z=into[1],
        radius=10.0 if flat else 1.0 / curvature,
        offset=gap if rolls else max(gap, 0.0),
    )


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
