"""How a finger settles anew when its base moves a little: rolling on the rock where it touches.

A settled finger's contacts are kept, and around each of them the rock is taken as the circle that
fits it there (a straight line where it is flat or hollow). A phalanx whose face touches rolls on
that circle; one that touches with an edge of its tile, or lies flat, slides with that point. Both
have a closed form, so that thousands of positions of the base are solved at once.

With the base displaced by (x, z) in the coordinates F of the settled finger and turned by ψ from x
toward z, phalanx i slips along the rock by

    δx_i = δc_i − δs_i,

positive toward the finger's base, with c its contact from the joint and s the arc length of the
contact on the rock; its tile, anchored in the rock, makes up for that (Section 5.3).

Everything here also takes complex numbers, so that derivatives are found by complex steps.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.finger import Contact, SettledFinger
from hand_models.sections import Section, Vector2

__all__ = ["MovedPosture", "Numbers", "RollingContact", "bearing_angle"]

Numbers = NDArray[Any]
"""Real numbers, or complex ones of a complex step."""

FLATTEST: Final = 10.0
"""Radius from which on rock counts as flat [m]."""

PROBE: Final = 0.5
"""How far to both sides of a contact the rock's curve is looked at, in half tile lengths."""


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

    Attributes
    ----------
    phalanges : range
    bearing : int
    along, rise : float
        The bearing phalanx's joint from the link's first, along it and above it [m].
    rolls : bool
        Whether its face rolls on the circle; otherwise its point ``along`` slides.
    start, end : float
        Where on the phalanx the contact may roll to [m].
    contact : float
        c at rest [m].
    height : float
        Of the face above the joint's axis [m].
    point, into : tuple of float
        The contact at rest (x, z) [m], and the unit vector into the rock there.
    radius : float
        Of the rock there; infinite where it is flat [m].
    offset : float
        Of the contact's path from the rock: what spines reach across [m].
    """

    phalanges: range
    bearing: int
    along: float
    rise: float
    rolls: bool
    start: float
    end: float
    contact: float
    height: float
    point: Vector2
    into: Vector2
    radius: float
    offset: float

    def turn(self, jx: Numbers, jz: Numbers, rest: float) -> tuple[Numbers, Numbers, Numbers]:
        """Return angle, c and slip of the bearing phalanx for places of the link's joint.

        NaN where it finds no rock. ``rest`` is its angle at rest.
        """
        c: Numbers = np.full(jx.shape, self.contact)
        if math.isinf(self.radius):
            angle = self._touch_line(jx, jz, rest)
            px, pz = self._place(jx, jz, angle, c)
            # along the line, from the tangent (into_z, −into_x) that points away from the base
            arc = (px - self.point[0]) * self.into[1] - (pz - self.point[1]) * self.into[0]
            return angle, c, -arc
        reach = self.radius + self.offset
        ox = self.point[0] + reach * self.into[0]
        oz = self.point[1] + reach * self.into[1]
        dx, dz = ox - jx, oz - jz
        square = dx * dx + dz * dz
        distance, bearing = np.sqrt(square), bearing_angle(dx, dz)
        if self.rolls:
            away = self.radius + self.rise + self.height
            rolled = np.sqrt(square - away * away) - self.along
            angle = bearing - np.arcsin(away / distance)
            near = ~(rolled.real >= self.start)
            far = rolled.real > self.end
            c = np.where(near, self.start, np.where(far, self.end, rolled))
            beyond = near | far
        else:
            angle, beyond = bearing, np.ones(jx.shape, dtype=bool)
        if beyond.any():
            ahead, above = self.along + c, self.rise + self.height
            arm = np.sqrt(ahead * ahead + above * above)
            cosine = (arm * arm + square - reach * reach) / (2.0 * arm * distance)
            touch = bearing - np.arccos(cosine) - bearing_angle(ahead, above + 0.0 * ahead)
            angle = np.where(beyond, touch, angle)
        angle = angle - math.tau * np.round((angle.real - rest) / math.tau)
        px, pz = self._place(jx, jz, angle, c)
        # the contact seen from the circle's centre, turned from where it was at rest
        ax, az = -self.into[0], -self.into[1]
        cosine, sine = (px - ox) * ax + (pz - oz) * az, (pz - oz) * ax - (px - ox) * az
        arc = self.radius * bearing_angle(cosine, sine)
        return angle, c, (c - self.contact) - arc

    def _touch_line(self, jx: Numbers, jz: Numbers, rest: float) -> Numbers:
        ahead, above = self.along + self.contact, self.rise + self.height
        arm = math.hypot(ahead, above)
        gap = (self.point[0] - jx) * self.into[0] + (self.point[1] - jz) * self.into[1]
        toward = math.atan2(self.into[1], self.into[0])
        angle = toward - np.arccos(gap / arm) - math.atan2(above, ahead)
        return np.asarray(angle - math.tau * np.round((angle.real - rest) / math.tau))

    def _place(
        self, jx: Numbers, jz: Numbers, angle: Numbers, c: Numbers
    ) -> tuple[Numbers, Numbers]:
        """Return (x, z) of the contact."""
        cosine, sine = np.cos(angle), np.sin(angle)
        ahead, above = self.along + c, self.rise + self.height
        return jx + ahead * cosine - above * sine, jz + ahead * sine + above * cosine


class RollingContact:
    """A settled finger whose base may move.

    Parameters
    ----------
    finger : SettledFinger
        At rest, its proximal joint at the origin of F.
    section : Section or None
        The rock in its plane, in F; None if there is none.
    """

    def __init__(self, finger: SettledFinger, section: Section | None) -> None:
        self.finger = finger
        self._angles = [contact.angle for contact in finger.contacts]
        self._links: dict[int, _Link] = {}
        free = list(finger.free)
        for joint, end in itertools.pairwise([*free, len(finger.contacts)]):
            phalanges = range(joint, end)
            bears = [i for i in phalanges if finger.contacts[i].kind != "none"]
            if bears and section is not None:
                self._links[joint] = _link(finger, section, phalanges, bears[0])

    def move(self, x: Numbers, z: Numbers, turn: Numbers) -> MovedPosture:
        """Return the finger after displacements of its base.

        Parameters
        ----------
        x, z : ndarray, shape (...)
            Of the proximal joint in F [m].
        turn : ndarray, shape (...)
            ψ of the base, from x toward z [rad].
        """
        with np.errstate(invalid="ignore", divide="ignore"):
            return self._move(np.asarray(x), np.asarray(z), np.asarray(turn))

    def _move(self, x: Numbers, z: Numbers, turn: Numbers) -> MovedPosture:
        contacts, spacing = self.finger.contacts, self.finger.model.joint_spacing
        nothing = 0.0 * (x + z + turn)
        jx, jz = x + nothing, z + nothing
        turned = turn + nothing
        angles: list[Numbers] = []
        along = [contact.along + nothing for contact in contacts]
        slips: list[Numbers] = [nothing] * len(contacts)
        joints: list[tuple[Numbers, Numbers]] = []
        for i, rest in enumerate(self._angles):
            if i in self._links:
                link = self._links[i]
                angle, along[link.bearing], slips[link.bearing] = link.turn(
                    jx, jz, self._angles[link.bearing]
                )
                turned = angle - self._angles[link.bearing]
            angle = rest + turned
            angles.append(angle)
            joints.append((jx, jz))
            jx, jz = jx + spacing * np.cos(angle), jz + spacing * np.sin(angle)
        theta = np.stack(angles, axis=-1)
        c = np.stack(along, axis=-1)
        starts = np.stack([np.stack(pair, axis=-1) for pair in joints], axis=-2)
        cosine, sine = np.cos(theta), np.sin(theta)
        height = self.finger.model.tile_height
        points = starts + np.stack(
            [c * cosine - height * sine, c * sine + height * cosine], axis=-1
        )
        change = theta - np.array(self._angles)
        before = np.concatenate([(turn + nothing)[..., None], change[..., :-1]], axis=-1)
        return MovedPosture(
            angles=theta,
            turns=change - before,
            slips=np.stack(slips, axis=-1),
            joints=starts,
            points=points,
            reached=np.isfinite(theta.real).all(axis=-1),
        )


def _link(finger: SettledFinger, section: Section, phalanges: range, bearing: int) -> _Link:
    model, contacts = finger.model, finger.contacts
    contact, pivot = contacts[bearing], contacts[phalanges.start].joint
    u, v = math.cos(contact.angle), math.sin(contact.angle)
    ahead = (contact.joint[0] - pivot[0], contact.joint[1] - pivot[1])
    near, far = model.tile_range
    if contact.kind == "frame":
        near, far = far, model.joint_spacing
    point = contact.point(model.tile_height)
    gap = max(section.clearance(point), 0.0)
    curvature = _curvature(section, contact, point, model.tile_length, gap)
    flat = curvature * FLATTEST <= 1.0
    rolls = not flat and contact.kind != "edge"
    into = (-v, u)
    if contact.kind == "edge":
        out = section.normal(point)
        into = (-out[0], -out[1])
    return _Link(
        phalanges=phalanges,
        bearing=bearing,
        along=ahead[0] * u + ahead[1] * v,
        rise=ahead[1] * u - ahead[0] * v,
        rolls=rolls,
        start=near,
        end=far,
        contact=contact.along,
        height=model.tile_height,
        point=point,
        into=into,
        radius=math.inf if flat else 1.0 / curvature,
        offset=0.0 if rolls else gap,
    )


def _curvature(
    section: Section, contact: Contact, point: Vector2, length: float, gap: float
) -> float:
    """Return the rock's curvature near a contact, from its distance beside it [1/m]."""
    out = section.normal(point)
    foot = (point[0] - gap * out[0], point[1] - gap * out[1])
    reach = PROBE * 0.5 * length
    sides: Sequence[float] = (-reach, reach)
    falls = [section.clearance((foot[0] - s * out[1], foot[1] + s * out[0])) for s in sides]
    fall = 0.5 * sum(falls)
    # on a circle of radius R the distance is √(R² + e²) − R
    return 2.0 * fall / (reach**2 - fall**2) if fall > 0.0 else 0.0
