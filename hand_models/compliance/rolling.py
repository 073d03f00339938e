"""Settle a finger again when its base moves a little: it rolls on the rock where it touches.

A settled finger's contacts are kept, and around each of them the rock is taken as the circle that
fits it there (a straight line where it is flat or hollow). A phalanx whose face touches rolls on
that circle; one that touches with an edge of its tile, or lies flat, slides with that point. Both
have a closed form, so that thousands of positions of the base are solved at once.

A face touches the circle where it is tangent to it, at c⁰. Where its force acts is the middle of
the pressures of the bed that the tile rests on (`hand_models.finger.phalanx_gaps`), which an end of
the tile may cut short: as c⁰ rolls, that goes with it, but never beyond the tile.

With the base displaced by (x, z) in the coordinates F of the settled finger and turned by ψ from x
toward z, phalanx i slips along the rock by

    δx_i = δc⁰_i − δs_i,

positive toward the finger's base, with c⁰ its contact from the joint and s the arc length of the
contact on the rock; its tile, anchored in the rock, makes up for that (Section 5.3).

All functions here also take complex numbers, so that derivatives are found by complex steps.
"""

from __future__ import annotations

import cmath
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.finger import PHALANGES, Contact, SettledFinger, middle_of_bed
from hand_models.sections import Section, Vector2

__all__ = ["MovedPosture", "Numbers", "RollingContact", "bearing_angle"]

Numbers = NDArray[Any]
"""Real numbers, or complex ones of a complex step."""


class MovedPosture(NamedTuple):
    """Fingers after their bases have moved, shapes (..., 3) or (..., 3, 2).

    Attributes
    ----------
    angles : ndarray
        θ of each phalanx [rad].
    turns : ndarray
        δq of each joint, closing [rad].
    slips : ndarray
        δx of each phalanx along the rock, toward the base; 0 without contact [m].
    joints, points : ndarray
        (x, z) in F of each joint and of each contact [m].
    reached : ndarray of bool, shape (...)
        Whether every phalanx still finds its rock.
    """

    angles: Numbers
    turns: Numbers
    slips: Numbers
    joints: Numbers
    points: Numbers
    reached: NDArray[np.bool_]


def bearing_angle(x: Numbers, z: Numbers) -> Numbers:
    """Return the angle of (x, z) from x toward z, analytic in both [rad]."""
    angle = np.arctan2(z.real, x.real)
    if not (np.iscomplexobj(x) or np.iscomplexobj(z)):
        return np.asarray(angle)
    square = x.real**2 + z.real**2
    return np.asarray(angle + 1j * (x.real * z.imag - z.real * x.imag) / square)


@dataclass(frozen=True)
class _Link:
    """Phalanges that turn as one about a free joint, and the rock under the one that bears.

    Lengths "along" and "above" are in axes of the bearing phalanx that are turned by its contact's
    tilt: the contact presses upward in them.

    Attributes
    ----------
    bearing : int
    along, above : float
        The bearing phalanx's joint from the link's first [m].
    height : float
        Of the contact above that joint [m].
    rest : float
        Angle of the axes at rest [rad].
    rolls : bool
        Whether its face rolls on the circle; otherwise its point slides.
    start, end : float
        Where on the phalanx the contact may roll to [m].
    contact : float
        c⁰ at rest, or the place of the point that slides [m].
    depth : float
        How far the tile is pressed in [m].
    point, into : tuple of float
        A place (x, z) of the face, at c⁰ [m], and the unit vector into the rock there.
    radius : float
        Of the rock there; infinite where it is flat [m].
    offset : float
        Of the contact's path from the rock: what spines reach across [m].
    """

    bearing: int
    along: float
    above: float
    height: float
    rest: float
    rolls: bool
    start: float
    end: float
    contact: float
    depth: float
    point: Vector2
    into: Vector2
    radius: float
    offset: float

    def turn(self, jx: Numbers, jz: Numbers) -> tuple[Numbers, Numbers, Numbers]:
        """Return how far the bearing phalanx turns, the contact goes along it, and it slips.

        NaN where it finds no rock. ``jx``, ``jz``: places of the link's joint.
        """
        c: Numbers = np.full(jx.shape, self.contact)
        if math.isinf(self.radius):
            turn = self._touch_line(jx, jz)
            px, pz = self._place(jx, jz, turn, c)
            # along the line, from the tangent (into_z, −into_x) that points away from the base
            arc = (px - self.point[0]) * self.into[1] - (pz - self.point[1]) * self.into[0]
            return turn, 0.0 * c, -arc
        reach = self.radius + self.offset
        ox = self.point[0] + reach * self.into[0]
        oz = self.point[1] + reach * self.into[1]
        dx, dz = ox - jx, oz - jz
        square = dx * dx + dz * dz
        distance, bearing = np.sqrt(square), bearing_angle(dx, dz)
        above = self.above + self.height
        if self.rolls:
            away = reach + above
            rolled = np.sqrt(square - away * away) - self.along
            angle = bearing - np.arcsin(away / distance)
            near = ~(rolled.real >= self.start)
            far = rolled.real > self.end
            c = np.where(near, self.start, np.where(far, self.end, rolled))
            beyond = near | far
        else:
            angle, beyond = bearing, np.ones(jx.shape, dtype=bool)
        if beyond.any():
            ahead = self.along + c
            arm = np.sqrt(ahead * ahead + above * above)
            cosine = (arm * arm + square - reach * reach) / (2.0 * arm * distance)
            touch = bearing - np.arccos(cosine) - bearing_angle(ahead, above + 0.0 * ahead)
            angle = np.where(beyond, touch, angle)
        turn = _within_half_a_turn(angle - self.rest)
        px, pz = self._place(jx, jz, turn, c)
        # the contact seen from the circle's centre, turned from where it was at rest
        ax, az = -self.into[0], -self.into[1]
        cosine, sine = (px - ox) * ax + (pz - oz) * az, (pz - oz) * ax - (px - ox) * az
        rolled = c - self.contact
        arc = self.radius * bearing_angle(cosine, sine)
        aside = self._aside(c) - self._aside(np.array(self.contact))
        return turn, rolled + aside, rolled - arc

    def _aside(self, c: Numbers) -> Numbers:
        """Return how far from c⁰ the middle of the pressures is: of a parabola cut short [m]."""
        if not (self.rolls and self.depth > 0.0):
            return 0.0 * c
        widest = math.sqrt(2.0 * self.depth * self.radius)
        reaches = [
            np.where(room.real < widest, room, widest) for room in (c - self.start, self.end - c)
        ]
        return middle_of_bed(reaches, [1.0 / self.radius] * 2, self.depth)

    def _touch_line(self, jx: Numbers, jz: Numbers) -> Numbers:
        ahead, above = self.along + self.contact, self.above + self.height
        arm = math.hypot(ahead, above)
        gap = (self.point[0] - jx) * self.into[0] + (self.point[1] - jz) * self.into[1]
        toward = math.atan2(self.into[1], self.into[0])
        angle = toward - np.arccos(gap / arm) - math.atan2(above, ahead)
        return _within_half_a_turn(angle - self.rest)

    def _place(
        self, jx: Numbers, jz: Numbers, turn: Numbers, c: Numbers
    ) -> tuple[Numbers, Numbers]:
        """Return (x, z) of the contact."""
        cosine, sine = np.cos(self.rest + turn), np.sin(self.rest + turn)
        ahead, above = self.along + c, self.above + self.height
        return jx + ahead * cosine - above * sine, jz + ahead * sine + above * cosine


def _within_half_a_turn(angle: Numbers) -> Numbers:
    return np.asarray(angle - math.tau * np.round(angle.real / math.tau))


class RollingContact:
    """A settled finger whose base may move.

    Parameters
    ----------
    finger : SettledFinger
        At rest, its proximal joint at the origin of F.
    section : Section or None
        The rock in its plane, in F; None if there is none.
    depths : sequence of float, optional
        How far its tiles are pressed in; not at all by default [m].
    """

    def __init__(
        self,
        finger: SettledFinger,
        section: Section | None,
        depths: Sequence[float] = (0.0,) * len(PHALANGES),
    ) -> None:
        self.finger = finger
        self._angles = [contact.angle for contact in finger.contacts]
        self._links: dict[int, _Link] = {}
        free = list(finger.free)
        for joint, end in itertools.pairwise([*free, len(finger.contacts)]):
            phalanges = range(joint, end)
            bears = [i for i in phalanges if finger.contacts[i].kind != "none"]
            if bears and section is not None:
                self._links[joint] = _link(finger, section, joint, bears[0], depths[bears[0]])

    def move(self, x: Numbers, z: Numbers, turn: Numbers) -> MovedPosture:
        """Return the finger after displacements of its base.

        Parameters
        ----------
        x, z : ndarray, shape (...)
            Of the proximal joint in F [m].
        turn : ndarray, shape (...)
            ψ of the base, from x toward z [rad].
        """
        contacts, spacing = self.finger.contacts, self.finger.model.joint_spacing
        nothing = 0.0 * (x + z + turn)
        jx, jz = x + nothing, z + nothing
        base = turned = turn + nothing
        angles: list[Numbers] = []
        rolled: list[Numbers] = [nothing] * len(contacts)
        slips: list[Numbers] = [nothing] * len(contacts)
        joints: list[tuple[Numbers, Numbers]] = []
        for i, rest in enumerate(self._angles):
            if i in self._links:
                link = self._links[i]
                with np.errstate(invalid="ignore", divide="ignore"):
                    turned, rolled[link.bearing], slips[link.bearing] = link.turn(jx, jz)
            angle = rest + turned
            angles.append(angle)
            joints.append((jx, jz))
            jx, jz = jx + spacing * np.cos(angle), jz + spacing * np.sin(angle)
        theta = np.stack(angles, axis=-1)
        on = np.stack(rolled, axis=-1)
        starts = np.stack([np.stack(pair, axis=-1) for pair in joints], axis=-2)
        cosine, sine = np.cos(theta), np.sin(theta)
        tilts = np.array([each.tilt for each in contacts])
        c = np.array([each.along for each in contacts]) + on * np.cos(tilts)
        height = self.finger.model.tile_height + np.array([each.rise for each in contacts])
        height = height + on * np.sin(tilts)
        points = starts + np.stack(
            [c * cosine - height * sine, c * sine + height * cosine], axis=-1
        )
        change = theta - np.array(self._angles)
        before = np.concatenate([base[..., None], change[..., :-1]], axis=-1)
        return MovedPosture(
            angles=theta,
            turns=change - before,
            slips=np.stack(slips, axis=-1),
            joints=starts,
            points=points,
            reached=np.isfinite(theta.real).all(axis=-1),
        )


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
        above=ahead.imag,
        height=arm.imag,
        rest=contact.angle + contact.tilt,
        rolls=rolls,
        start=start,
        end=end,
        contact=arm.real,
        depth=depth,
        point=point,
        into=into,
        radius=math.inf if flat else 1.0 / curvature,
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
