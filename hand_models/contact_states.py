"""In which contact state a finger comes to rest, found from hold and load (Section 5.7).

Bottom-up, all three phalanges are laid on the rock. Where that state cannot last at the closing
tension — a tile is pulled off beyond what its spines hold, a joint leaves its limit, a phalanx
without contact would stand in the rock — a contact gives way. Its phalanx swings back to where its
joint balances, held by the spines of its tile if they still reach the rock from there. If it
balances nowhere, joints turn until they reach a limit; all such states are tried. Of those that
stay, the finger comes to rest in one with as many contacts as possible, then with as much tendon
drawn in as possible (`close`).

A joint that balances without contact does so at the closing tension; at others it is taken as
locked where it is, one link like a joint at its limit.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

import numpy as np

from hand_models.finger import FingerModel, SettledFinger
from hand_models.frames import Array
from hand_models.sections import Section
from hand_models.settling import (
    JOINTS,
    OPEN_FIRST,
    PATTERNS,
    held,
    is_clear,
    posture,
    settle,
    straight,
)
from hand_models.spines import Surface

__all__ = ["ClosedFinger", "cling", "close", "stays"]

SWINGS: Final = 17
"""Angles at which a phalanx without contact is tried."""

HALVINGS: Final = 11
"""Of the interval between them."""

UNBALANCED: Final = 1e-3
"""Torque that may be left at a joint that balances without contact, about half a percent of a
tendon's [N·m]."""

BALANCED: Final = 1e-9
"""How much torque a stop may seem to pull, by rounding [N·m]."""


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


def cling(model: FingerModel, section: Section | None) -> ClosedFinger | None:
    """Return the straight finger, which carries nothing but by its nail; None if rock is there."""
    finger = straight(model, section)
    nothing = np.zeros((JOINTS, 2))
    return None if finger is None else ClosedFinger(finger, nothing, nothing, nothing)


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
            closed = staying(held(model, section, first.contacts[:i], angle))
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
            state = loaded(held(model, section, first.contacts[:i], angle))
            if state is None or not any(j > i for j in state.finger.bearing):
                return None
            bears = i in state.finger.bearing
            return bool((state.normals if bears else state.torques)[i] @ powers >= 0.0)

        # one that has been on the rock swings back a little rather than far
        backs = np.linspace(1.0, 0.0, SWINGS) ** (1 if contact.stop == "upper" else 2)
        swing = contact.angle - before - model.joint_lower[i]
        angles = (contact.angle - swing * backs).tolist()
        signs = [turned_in(angle) for angle in angles]
        crossings = [k for k in range(SWINGS - 1) if signs[k] and not signs[k + 1]]
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
    """Whether some tension drags the tiles forward and presses bare frames and joints on stops."""
    least, most = 0.0, math.inf
    sides = [{"upper": 1.0, "lower": -1.0}.get(c.stop or "", 0.0) for c in closed.finger.contacts]
    frames = [i for i in closed.finger.bearing if not closed.finger.touching[i]]
    for constant, slope in np.vstack(
        [closed.shears, np.array(sides)[:, None] * closed.torques, closed.normals[frames]]
    ):
        if slope > 0.0:
            least = max(least, -constant / slope)
        elif slope < 0.0:
            most = min(most, -constant / slope)
        elif constant < 0.0:
            return False
    return least <= most
