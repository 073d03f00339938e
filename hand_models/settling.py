"""Where a finger can be on rock: laid on it from the base, or with joints at their limits.

A finger has three joints, so three conditions fix it: each phalanx on the rock is one, each joint
at a limit another. Bottom-up, each phalanx turns until its face meets the rock (`settle`); with all
three on the rock this is the paper's closing (Section 5.1). With fewer contacts, joints at their
limits make one link of the phalanges on both sides (Section 5.7); `PATTERNS` lists all such states,
`posture` finds them. In which of them a finger stays is decided by its loads
(`hand_models.contact_states`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from hand_models.finger import Contact, FingerModel, SettledFinger, Stop
from hand_models.sections import Rest, Section, Vector2

__all__ = [
    "JOINTS",
    "OPEN_FIRST",
    "PATTERNS",
    "Pattern",
    "held",
    "intrusion",
    "is_clear",
    "posture",
    "settle",
    "straight",
]

CLEAR: Final = 2e-5
"""How far a face may seem to stand in the rock, by sampling and rounding [m]."""

JOINTS: Final = 3


@dataclass(frozen=True)
class Pattern:
    """A contact state: which joints stand at which limit, and which phalanges bear.

    The phalanges from a free joint to the next one are a link; one of each link bears.

    Attributes
    ----------
    stops : tuple of {'upper', 'lower', None}
        Of each joint; None where it is free.
    bearing : tuple of int
        Phalanges on the rock.
    """

    stops: tuple[Stop | None, ...]
    bearing: tuple[int, ...]


def _links(stops: tuple[Stop | None, ...]) -> list[range]:
    """Return the phalanges of each link that can turn."""
    free = [i for i, stop in enumerate(stops) if stop is None]
    return [range(i, j) for i, j in itertools.pairwise([*free, len(stops)])]


def _patterns() -> Iterator[Pattern]:
    choices: tuple[Stop | None, ...] = (None, "upper", "lower")
    for stops in itertools.product(choices, repeat=JOINTS):
        for bearing in itertools.product(*_links(stops)):
            yield Pattern(stops, bearing)


PATTERNS: Final = tuple(sorted(_patterns(), key=lambda pattern: -len(pattern.bearing)))
"""Every contact state that Eq. 6 can be solved for, those with most contacts first."""

OPEN_FIRST: Final = tuple(
    sorted(
        (pattern for pattern in PATTERNS if not pattern.bearing),
        key=lambda pattern: -pattern.stops.count("lower"),
    )
)
"""Those without contact, the open finger first."""


def settle(
    model: FingerModel,
    section: Section | None,
    joint: Vector2,
    laid: Sequence[Contact] = (),
) -> SettledFinger:
    """Close a finger on a section of rock, phalanx by phalanx from the base.

    Each phalanx turns until its face meets the rock. Where it meets it beyond its tile, the spines
    at the tile's far edge reach across the gap, if it is within their travel; otherwise the bare
    frame rests there and only presses. A face that lies flat is held by its tile's centre. A
    phalanx that finds no rock within its joint's range stops at the upper limit, one that has rock
    in its way at the lower one.

    Parameters
    ----------
    model : FingerModel
    section : Section or None
        Rock in the finger's plane, in the coordinates (x, z) of F; None if there is none.
    joint : tuple of float
        The proximal joint in the same coordinates [m].
    laid : sequence of Contact, optional
        Phalanges from the base on that are where they are already.
    """
    contacts = list(laid)
    before = 0.0
    if laid:
        before, joint = laid[-1].angle, laid[-1].end(model.joint_spacing)
    ranges = list(zip(model.joint_lower, model.joint_upper, strict=True))
    for lower, upper in ranges[len(laid) :]:
        contact = _lay(model, section, joint, before + lower, before + upper)
        contacts.append(contact)
        before = contact.angle
        joint = contact.end(model.joint_spacing)
    return SettledFinger(model, tuple(contacts))


def _lay(
    model: FingerModel, section: Section | None, joint: Vector2, low: float, high: float
) -> Contact:
    near, _ = model.tile_range
    if section is None:
        return Contact(high, joint, model.tile_centre, "none", "upper")
    face = (near, model.joint_spacing, model.tile_height)
    if section.face_clearance(joint, *face, low) <= 0.0:
        return Contact(low, joint, model.tile_centre, "none", "lower")
    rest = section.rest(joint, *face, low, high)
    if rest is None:
        return Contact(high, joint, model.tile_centre, "none", "upper")
    return _bearing(model, section, rest, joint, None)


def _bearing(
    model: FingerModel, section: Section, rest: Rest, joint: Vector2, stop: Stop | None
) -> Contact:
    """Return how a phalanx bears that rests on rock at a distance from its joint."""
    near, far = model.tile_range
    if rest.flat:
        return Contact(rest.angle, joint, model.tile_centre, "face", stop)
    if rest.distance <= far:
        kind = "face" if near < rest.distance < far else "edge"
        return Contact(rest.angle, joint, rest.distance, kind, stop)
    edge = Contact(rest.angle, joint, far, "edge", stop)
    if section.clearance(edge.point(model.tile_height)) <= model.spine_travel:
        return edge
    return Contact(rest.angle, joint, rest.distance, "frame", stop)


def held(
    model: FingerModel, section: Section, laid: Sequence[Contact], angle: float
) -> SettledFinger:
    """Return the finger whose phalanx after those laid is at an angle, the others laid beyond.

    It is held there by the spines of its tile, if they reach the rock.
    """
    joint = laid[-1].end(model.joint_spacing) if laid else (0.0, 0.0)
    reaching = _reaching(model, section, angle, joint)
    return settle(model, section, (0.0, 0.0), [*laid, reaching])


def _reaching(model: FingerModel, section: Section, angle: float, joint: Vector2) -> Contact:
    """Return how a phalanx that is held at an angle reaches the rock: with its nearer edge."""
    edges = [Contact(angle, joint, along, "edge") for along in model.tile_range]
    gaps = [section.clearance(edge.point(model.tile_height)) for edge in edges]
    nearer = int(np.argmin(gaps))
    if 0.0 <= gaps[nearer] <= model.spine_travel:
        return edges[nearer]
    return Contact(angle, joint, model.tile_centre, "none", "balance")


def posture(model: FingerModel, section: Section | None, pattern: Pattern) -> SettledFinger | None:
    """Return the finger in a contact state, its proximal joint at the origin of F.

    None if a phalanx that is to bear finds no rock, or one that is to be free stands in it.
    """
    contacts: list[Contact] = []
    joint, before = (0.0, 0.0), 0.0
    limits = [_limit(model, i, stop) for i, stop in enumerate(pattern.stops)]
    first = next((i for i, stop in enumerate(pattern.stops) if stop is None), JOINTS)
    for i in range(first):
        contacts.append(
            Contact(before + limits[i], joint, model.tile_centre, "none", pattern.stops[i])
        )
        joint, before = contacts[-1].end(model.joint_spacing), contacts[-1].angle
    for link, bearing in zip(_links(pattern.stops), pattern.bearing, strict=True):
        if section is None:
            return None
        turned = _turn(model, section, pattern, link, bearing, limits, joint, before)
        if turned is None:
            return None
        contacts += turned
        joint, before = contacts[-1].end(model.joint_spacing), contacts[-1].angle
    finger = SettledFinger(model, tuple(contacts))
    return finger if is_clear(finger, section) else None


def _limit(model: FingerModel, i: int, stop: Stop | None) -> float:
    if stop is None:
        return 0.0
    return model.joint_upper[i] if stop == "upper" else model.joint_lower[i]


def _turn(
    model: FingerModel,
    section: Section,
    pattern: Pattern,
    link: range,
    bearing: int,
    limits: list[float],
    pivot: Vector2,
    before: float,
) -> list[Contact] | None:
    """Turn a link about its first joint until one of its phalanges bears."""
    # in the frame of the link's first phalanx: angle and joint of each, up to the one that bears
    angles, joints = [0.0], [(0.0, 0.0)]
    for i in link[1:]:
        there = Contact(angles[-1], joints[-1], 0.0, "none").end(model.joint_spacing)
        angles.append(angles[-1] + limits[i])
        joints.append(there)
    k = bearing - link.start
    u, v = math.cos(angles[k]), math.sin(angles[k])
    along = joints[k][0] * u + joints[k][1] * v
    rise = joints[k][1] * u - joints[k][0] * v
    near, _ = model.tile_range
    face = (along + near, along + model.joint_spacing, rise + model.tile_height)
    low = before + model.joint_lower[link.start]
    high = before + model.joint_upper[link.start]
    if section.face_clearance(pivot, *face, low + angles[k]) <= 0.0:
        return None
    rest = section.rest(pivot, *face, low + angles[k], high + angles[k])
    if rest is None:
        return None
    contacts: list[Contact] = []
    joint = pivot
    for i, angle in zip(link, angles, strict=True):
        stop = pattern.stops[i]
        turned = rest.angle - angles[k] + angle
        if i == bearing:
            own = Rest(turned, rest.distance - along, rest.flat)
            contacts.append(_bearing(model, section, own, joint, stop))
        else:
            contacts.append(Contact(turned, joint, model.tile_centre, "none", stop))
        joint = contacts[-1].end(model.joint_spacing)
    return contacts


def straight(model: FingerModel, section: Section | None) -> SettledFinger | None:
    """Return the straight finger, its tiles off the rock; None where it stands in it."""
    contacts: list[Contact] = []
    joint = (0.0, 0.0)
    for _ in range(JOINTS):
        contacts.append(Contact(0.0, joint, model.tile_centre, "none", "balance"))
        joint = contacts[-1].end(model.joint_spacing)
    finger = SettledFinger(model, tuple(contacts))
    return finger if is_clear(finger, section) else None


def intrusion(model: FingerModel, section: Section, *, straight: bool = False) -> float:
    """Return about how deep the rock stands in the tiles of an open, or straight, finger [m]."""
    joint, angle, deepest = (0.0, 0.0), 0.0, -math.inf
    for lower in model.joint_lower:
        angle += 0.0 if straight else lower
        clearance = section.face_clearance(joint, *model.tile_range, model.tile_height, angle)
        deepest = max(deepest, -clearance)
        joint = Contact(angle, joint, 0.0, "none").end(model.joint_spacing)
    return deepest


def is_clear(finger: SettledFinger, section: Section | None) -> bool:
    """Whether the tiles of phalanges without contact stand clear of the rock.

    Those with contact do, as `Section.rest` has laid them.
    """
    if section is None:
        return True
    model = finger.model
    return all(
        section.face_clearance(c.joint, *model.tile_range, model.tile_height, c.angle) >= -CLEAR
        for c in finger.contacts
        if c.kind == "none"
    )
