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

All fingers, and all states that are tried, go through the same arithmetic on arrays together
(`hand_models.finger.postures`, `hand_models.finger.posture_loads`); where phalanges balance
`hand_models.finger.joint_equilibrium` finds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.finger.closure import JOINTS, straight
from hand_models.finger.joint_equilibrium import JointEquilibrium
from hand_models.finger.limit_postures import OPEN_FIRST, PATTERNS, at_limits
from hand_models.finger.model import FingerModel, SettledFinger
from hand_models.finger.posture_loads import Loads, TendonBatch, loads, stay, turns
from hand_models.finger.postures import Postures, are_clear, settle_fingers
from hand_models.finger.sequential_closure import NONE
from hand_models.sections import Flags, Section, section_rows
from hand_models.tile import Surface

__all__ = ["ClosedFinger", "OpenFinger", "cling", "close", "close_all"]

NOTHING: Final = (-1, 0.0)
"""Contacts, and tendon drawn in [m], before any state has been found to stay."""


class OpenFinger(NamedTuple):
    """A finger that is to close.

    Attributes
    ----------
    section : Section or None
        Rock in the finger's plane, the proximal joint at its origin.
    surface : Surface
        What the tiles hold.
    tension : float
        At which the tiles catch the rock [N].
    base_tile : bool
        Whether a base tile comes first on the tendon.
    """

    section: Section | None
    surface: Surface
    tension: float
    base_tile: bool = False


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
    """Close one finger; see `close_all`."""
    return close_all(model, [OpenFinger(section, surface, closing_tension, base_tile)])[0]


def close_all(model: FingerModel, closings: Sequence[OpenFinger]) -> list[ClosedFinger | None]:
    """Close fingers on the rock, and find the contact states in which they stay.

    Parameters
    ----------
    model : FingerModel
    closings : sequence of OpenFinger

    Returns
    -------
    list of ClosedFinger or None
        With all three phalanges on the rock if they stay there. If no state balances at the
        closing tension, the bottom-up one as long as some tension keeps its tiles dragged forward
        and its stops pushing (a tile may be beyond its limit then), or else the open finger. None
        if the finger stands in rock wherever its joints turn.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        return _Search(model, closings).results()


class _Tried(NamedTuple):
    """Contact states that have been tried, one a column.

    Attributes
    ----------
    of : ndarray of int, shape (n,)
        Whose they are.
    fingers : Postures
    loads : Loads
    stays : ndarray of bool, shape (n,)
    """

    of: Indices
    fingers: Postures
    loads: Loads
    stays: Flags

    def closed(self, model: FingerModel, column: int) -> ClosedFinger:
        """Return one of them."""
        loads = (value[..., column].copy() for value in self.loads)
        return ClosedFinger(self.fingers.finger(model, column), *loads)


class _Search:
    """The search for the contact states of some fingers.

    Parameters
    ----------
    model : FingerModel
    closings : sequence of OpenFinger
    """

    def __init__(self, model: FingerModel, closings: Sequence[OpenFinger]) -> None:
        self._model = model
        self._rock = section_rows([closing.section for closing in closings])
        self._tendons = TendonBatch.of(
            model,
            [closing.tension for closing in closings],
            [closing.base_tile for closing in closings],
            [closing.surface for closing in closings],
        )
        self._in_air = [closing.section is None for closing in closings]
        self._hold = [NOTHING] * len(closings)
        self._found: list[ClosedFinger | None] = [None] * len(closings)

    def results(self) -> list[ClosedFinger | None]:
        """Return the fingers at rest."""
        everyone = np.arange(len(self._found))
        first = self._tried(everyone, settle_fingers(self._model, self._rock, len(everyone)))
        self._offer(first)
        # a closed finger in the air cannot hold more
        most = [0 if in_air else JOINTS for in_air in self._in_air]
        searching = [i for i, (contacts, _) in enumerate(self._hold) if contacts < most[i]]
        if searching:
            pulls = first.loads.at(self._tendons.closing).normals
            swings = JointEquilibrium(self._model, self._rock, self._tendons, first.fingers, pulls)
            self._offer(self._tried(*swings.balances(searching)))
        idle = [i for i in searching if self._hold[i][0] <= 0]
        if idle:
            self._turn_to_limits(idle, first)
        return self._found

    def _tried(self, of: Indices, fingers: Postures) -> _Tried:
        """Load fingers in some state, and find out whether they stay there."""
        rock, tendons = self._rock.take(of), self._tendons.take(of)
        loaded = loads(self._model, fingers, tendons)
        stays = stay(fingers, loaded, tendons)
        if stays.any():
            stays &= are_clear(self._model, rock, fingers)
        return _Tried(of, fingers, loaded, stays)

    def _offer(self, tried: _Tried) -> None:
        """Take states that stay: contacts count first, then tendon drawn in."""
        contacts = (tried.fingers.kinds != NONE).sum(axis=0)
        drawn = np.array(self._model.pulley_radii) @ turns(tried.fingers)
        for column in np.flatnonzero(tried.stays).tolist():
            of, hold = int(tried.of[column]), (int(contacts[column]), float(drawn[column]))
            if hold > self._hold[of]:
                self._hold[of] = hold
                self._found[of] = tried.closed(self._model, column)

    def _turn_to_limits(self, idle: list[int], first: _Tried) -> None:
        """Try all states with joints at their limits."""
        count = len(PATTERNS)
        of, patterns = np.repeat(idle, count), np.tile(np.arange(count), len(idle))
        rock, tendons = self._rock.take(of), self._tendons.take(of)
        fingers, possible = at_limits(self._model, rock, patterns)
        loaded = loads(self._model, fingers, tendons)
        stays = possible & stay(fingers, loaded, tendons, pressed=True)
        tried = _Tried(of, fingers, loaded, stays)
        self._offer(tried)
        # where no state balances at the closing tension
        lost = [i for i in idle if self._found[i] is None]
        if not lost:
            return
        columns = np.array(lost)
        clear = are_clear(self._model, self._rock.take(columns), first.fingers.take(columns))
        for i, free in zip(lost, clear.tolist(), strict=True):
            bottom_up = first.closed(self._model, i)
            if free and _some_tension(bottom_up):
                self._found[i] = bottom_up
                continue
            columns = count * idle.index(i) + OPEN_FIRST
            opened = columns[possible[columns]]
            if len(opened):
                self._found[i] = tried.closed(self._model, opened[0])


def _some_tension(closed: ClosedFinger) -> bool:
    """Whether some tension drags the tiles forward and presses bare frames and joints on stops."""
    if not np.isfinite(closed.normals).all():
        return False
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
