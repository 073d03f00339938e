"""How a finger comes to rest on rock, and on which of its phalanges (Sections 5.1, 5.7).

A finger has three joints, so three conditions fix it: each phalanx on the rock is one, each joint
at a limit another. Bottom-up, each phalanx turns until its face meets the rock (`settle`): with all
three on the rock this is the paper's closing. Where that state cannot last at the closing tension
— a tile is pulled off beyond what its spines hold, a joint leaves its limit, a phalanx without
contact would stand in the rock — a contact gives way. Its phalanx swings back to where its joint
balances, held by the spines of its tile if they still reach the rock from there. If it balances
nowhere, joints turn until they reach a limit, which makes one link of their two phalanges; all such
states are tried (`PATTERNS`). Of the states that stay, the finger comes to rest in one with as many
contacts as possible, then with as much tendon drawn in as possible (`close`).

A joint that balances without contact does so at the closing tension; at others it is taken as
locked where it is, one link like a joint at its limit.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from hand_models.finger import Contact, FingerModel, SettledFinger, Stop
from hand_models.frames import Array
from hand_models.sections import Rest, Section, Vector2
from hand_models.spines import Surface

__all__ = [
    "PATTERNS",
    "ClosedFinger",
    "Pattern",
    "close",
    "intrusion",
    "is_clear",
    "posture",
    "settle",
    "stays",
    "straight",
]

CLEAR: Final = 2e-5
"""How far a face may seem to stand in the rock, by sampling and rounding [m]."""

JOINTS: Final = 3

SWINGS: Final = 13
"""Angles at which a phalanx without contact is tried."""

HALVINGS: Final = 11
"""Of the interval between them."""

UNBALANCED: Final = 1e-3
"""Torque that may be left at a joint that balances without contact, about half a percent of a
tendon's [N·m]."""

BALANCED: Final = 1e-9
"""How much torque a stop may seem to pull, by rounding [N·m]."""


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


class ClosedFinger(NamedTuple):
    """A finger at rest, and its loads as affine functions of tension.

    Attributes
    ----------
    finger : SettledFinger
    shears, normals, torques : ndarray, shape (3, 2)
        Of `SettledFinger.shears`, `normals` and `stop_torques`.
    """

    finger: SettledFinger
    shears: Array
    normals: Array
    torques: Array


# Where a finger can be --------------------------------------------------------------------------


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
        before, joint = laid[-1].angle, _next_joint(model, laid[-1])
    ranges = list(zip(model.joint_lower, model.joint_upper, strict=True))
    for lower, upper in ranges[len(laid) :]:
        contact = _lay(model, section, joint, before + lower, before + upper)
        contacts.append(contact)
        before = contact.angle
        joint = _next_joint(model, contact)
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


def _held(
    model: FingerModel, section: Section, laid: Sequence[Contact], angle: float
) -> SettledFinger:
    """Return the finger whose phalanx after those laid is at an angle, the others laid beyond."""
    joint = _next_joint(model, laid[-1]) if laid else (0.0, 0.0)
    held = _reaching(model, section, angle, joint)
    return settle(model, section, (0.0, 0.0), [*laid, held])


def _reaching(model: FingerModel, section: Section, angle: float, joint: Vector2) -> Contact:
    """Return how a phalanx that is held at an angle reaches the rock: with its nearer edge."""
    edges = [Contact(angle, joint, along, "edge") for along in model.tile_range]
    gaps = [section.clearance(edge.point(model.tile_height)) for edge in edges]
    nearer = int(np.argmin(gaps))
    if 0.0 <= gaps[nearer] <= model.spine_travel:
        return edges[nearer]
    return Contact(angle, joint, model.tile_centre, "none", "balance")


def _next_joint(model: FingerModel, contact: Contact) -> Vector2:
    return (
        contact.joint[0] + model.joint_spacing * math.cos(contact.angle),
        contact.joint[1] + model.joint_spacing * math.sin(contact.angle),
    )


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
        joint, before = _next_joint(model, contacts[-1]), contacts[-1].angle
    for link, bearing in zip(_links(pattern.stops), pattern.bearing, strict=True):
        if section is None:
            return None
        turned = _turn(model, section, pattern, link, bearing, limits, joint, before)
        if turned is None:
            return None
        contacts += turned
        joint, before = _next_joint(model, contacts[-1]), contacts[-1].angle
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
        there = _next_joint(model, Contact(angles[-1], joints[-1], 0.0, "none"))
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
        joint = _next_joint(model, contacts[-1])
    return contacts


def straight(model: FingerModel, section: Section | None) -> ClosedFinger | None:
    """Return the straight finger, its tiles off the rock; None where it stands in it."""
    contacts: list[Contact] = []
    joint = (0.0, 0.0)
    for _ in range(JOINTS):
        contacts.append(Contact(0.0, joint, model.tile_centre, "none", "balance"))
        joint = _next_joint(model, contacts[-1])
    finger = SettledFinger(model, tuple(contacts))
    nothing = np.zeros((JOINTS, 2))
    if not is_clear(finger, section):
        return None
    return ClosedFinger(finger, nothing, nothing, nothing)


def intrusion(model: FingerModel, section: Section, *, straight: bool = False) -> float:
    """Return about how deep the rock stands in the tiles of an open, or straight, finger [m]."""
    joint, angle, deepest = (0.0, 0.0), 0.0, -math.inf
    for lower in model.joint_lower:
        angle += 0.0 if straight else lower
        clearance = section.face_clearance(joint, *model.tile_range, model.tile_height, angle)
        deepest = max(deepest, -clearance)
        joint = _next_joint(model, Contact(angle, joint, 0.0, "none"))
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


# Where it stays ---------------------------------------------------------------------------------


def close(
    model: FingerModel,
    section: Section | None,
    surface: Surface,
    closing_tension: float,
    base_tile: bool = False,
) -> ClosedFinger | None:
    """Close a finger on the rock, and find the contact state in which it stays.

    Parameters
    ----------
    model : FingerModel
    section : Section or None
        Rock in the finger's plane, the proximal joint at its origin.
    surface : Surface
        What the tiles hold.
    closing_tension : float
        At which the tiles catch the rock [N].
    base_tile : bool, optional
        Whether a base tile comes first on the tendon.

    Returns
    -------
    ClosedFinger or None
        With all three phalanges on the rock if they stay there. If no state balances at the
        closing tension, the bottom-up one as long as some tension keeps its tiles dragged forward
        and its stops pushing (a tile may be beyond its limit then), or else the open finger. None
        if the finger stands in rock wherever its joints turn.
    """

    def loaded(finger: SettledFinger | None) -> ClosedFinger | None:
        if finger is None:
            return None
        shears = finger.shears(closing_tension, base_tile)
        try:
            normals = finger.normals(shears, base_tile)
        except np.linalg.LinAlgError:
            return None
        torques = finger.stop_torques(shears, normals, base_tile)
        return ClosedFinger(finger, shears, normals, torques)

    def staying(finger: SettledFinger | None, pressed: bool = False) -> ClosedFinger | None:
        closed = loaded(finger)
        if closed is None or not stays(closed, surface, closing_tension, pressed=pressed):
            return None
        return closed if is_clear(closed.finger, section) else None

    first = settle(model, section, (0.0, 0.0))
    closed = staying(first)
    if closed is not None and len(first.bearing) == JOINTS:
        return closed
    # the search for other states goes over a sketch; what it finds is laid on the rock itself
    sketch = None if section is None else section.sketch(model.reach)
    states = [] if closed is None else [closed]
    if section is not None and sketch is not None:
        for i, angle in _balances(model, sketch, loaded, closing_tension):
            closed = staying(_held(model, section, first.contacts[:i], angle))
            states += [closed] if closed is not None else []
    if not any(state.finger.bearing for state in states):
        states += _at_limits(model, section, sketch, staying)
    if states:
        return max(states, key=_hold)
    closed = loaded(first)
    if closed is not None and is_clear(first, section) and _tensions(closed):
        return closed
    return loaded(next((f for p in OPEN_FIRST if (f := posture(model, section, p))), None))


def _at_limits(
    model: FingerModel,
    section: Section | None,
    sketch: Section | None,
    staying: Callable[[SettledFinger | None, bool], ClosedFinger | None],
) -> list[ClosedFinger]:
    """Return the states with joints at their limits that stay, of those with most contacts."""
    for _, patterns in itertools.groupby(PATTERNS, lambda pattern: len(pattern.bearing)):
        found = [p for p in patterns if staying(posture(model, sketch, p), True) is not None]
        states = [state for p in found if (state := staying(posture(model, section, p), True))]
        if states:
            return states
    return []


def stays(closed: ClosedFinger, surface: Surface, tension: float, *, pressed: bool = False) -> bool:
    """Whether no contact breaks at a tension, and no joint leaves its limit.

    A contact breaks where its tile is pulled off beyond its limit curve; a bare frame only presses.
    A tile that slips under shear keeps its contact.

    Parameters
    ----------
    closed : ClosedFinger
    surface : Surface
    tension : float
        [N]
    pressed : bool, optional
        Whether tiles may only press as well: spines that were not on the rock before are not
        engaged by pulling.
    """
    finger = closed.finger
    powers = np.array([1.0, tension])
    shears, normals, torques = (
        closed.shears @ powers,
        closed.normals @ powers,
        closed.torques @ powers,
    )
    for contact, torque in zip(finger.contacts, torques.tolist(), strict=True):
        if contact.stop == "upper" and torque < -BALANCED:
            return False
        if contact.stop == "lower" and torque > BALANCED:
            return False
        if contact.stop == "balance" and abs(torque) > UNBALANCED:
            return False
    for i in finger.bearing:
        if normals[i] >= 0.0:
            continue
        if pressed or not finger.touching[i] or shears[i] < 0.0:
            return False
        held = float(surface.strength(math.atan2(-normals[i], shears[i])))
        if shears[i] <= surface.shear_limit and math.hypot(shears[i], normals[i]) > held:
            return False
    return True


def _balances(
    model: FingerModel,
    section: Section,
    loaded: Callable[[SettledFinger | None], ClosedFinger | None],
    tension: float,
) -> Iterator[tuple[int, float]]:
    """Yield phalanges, and the angle at which each balances with no rock that presses on it.

    Those that their contact pulls at, that find no rock of their own, or that put a later phalanx
    into the rock. Where they balance, phalanges beyond them bear; a little closer the joint would
    be turned back, a little opener turned in.
    """
    powers = np.array([1.0, tension])
    first = settle(model, section, (0.0, 0.0))
    closed = loaded(first)
    pulls = np.zeros(JOINTS) if closed is None else closed.normals @ powers
    before = 0.0
    for i, contact in enumerate(first.contacts):
        blocks = any(later.stop == "lower" for later in first.contacts[i + 1 :])
        if contact.stop != "upper" and pulls[i] >= 0.0 and not blocks:
            before = contact.angle
            continue

        def turned_in(angle: float, i: int = i) -> bool | None:
            """Whether a joint is turned in at an angle; None where nothing beyond it bears."""
            state = loaded(_held(model, section, first.contacts[:i], angle))
            if state is None or not any(j > i for j in state.finger.bearing):
                return None
            bears = i in state.finger.bearing
            return bool((state.normals if bears else state.torques)[i] @ powers >= 0.0)

        # one that has been on the rock swings back a little rather than far
        backs = np.linspace(1.0, 0.0, SWINGS) ** (1 if contact.stop == "upper" else 2)
        swing = contact.angle - before - model.joint_lower[i]
        angles = (contact.angle - swing * backs).tolist()
        signs = [turned_in(angle) for angle in angles]
        crossings = [k for k in range(SWINGS - 1) if signs[k] and signs[k + 1] is False]
        for k in reversed(crossings):
            low, high = angles[k], angles[k + 1]
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if turned_in(middle) else (low, middle)
            yield i, low
        before = contact.angle


def _hold(closed: ClosedFinger) -> tuple[int, float]:
    """Rank a contact state: contacts first, then tendon drawn in."""
    return len(closed.finger.bearing), _drawn(closed)


def _drawn(closed: ClosedFinger) -> float:
    """Return how much tendon the joints have drawn in [m]."""
    finger = closed.finger
    return float(np.asarray(finger.model.pulley_radii) @ finger.joint_angles)


def _tensions(closed: ClosedFinger) -> bool:
    """Whether some tension drags the tiles forward and presses every joint on its stop."""
    least, most = 0.0, math.inf
    sides = [{"upper": 1.0, "lower": -1.0}.get(c.stop or "", 0.0) for c in closed.finger.contacts]
    for constant, slope in np.vstack([closed.shears, np.array(sides)[:, None] * closed.torques]):
        if slope > 0.0:
            least = max(least, -constant / slope)
        elif slope < 0.0:
            most = min(most, -constant / slope)
        elif constant < 0.0:
            return False
    return least <= most
