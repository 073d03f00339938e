"""Opening and closing of a hand: tensions, wrench on the rock, and tiles that let go or catch.

The four tendons have the same tension f at a time, and each finger moves on its own
(`hand_models.finger.finger_path` names the laws), while the palm and the bases of the fingers stay
where they are. So the hand's wrench is the sum of its fingers', functions of f.

Where spines let go, the finger snaps to another balance at the same tension: two knots, before and
after it, whose tensions differ by a rounding.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, InvalidFieldError, UnsupportedError
from hand_models.finger import (
    PHALANGES,
    FingerPath,
    closing_paths,
    opening_paths,
)
from hand_models.hand import FINGERS, SettledHand
from hand_models.opening.knots import deviations, few_knots
from hand_models.opening.parts import (
    PATH_SETTINGS,
    Part,
    base_parts,
    nail_parts,
    open_fingers,
    phalanx_parts,
)

__all__ = ["HandPath", "Jam", "TileEvent", "closing_path", "opening_path"]


class TileEvent(NamedTuple):
    """A tile that lets go of the rock, or catches it.

    Attributes
    ----------
    finger : str
        One of `FINGERS`.
    phalanx : str
        As of `SettledTile`.
    tension : float
        Of the finger's tendon [N].
    """

    finger: str
    phalanx: str
    tension: float


class Jam(NamedTuple):
    """A finger that does not let go of the rock.

    Attributes
    ----------
    finger : str
    friction : float or None
        Friction μ of the surface above which the first of its spines would let go at zero
        tension; None if no equilibrium was found on the way.
    reason : str
        One sentence.
    """

    finger: str
    friction: float | None
    reason: str


@dataclass(frozen=True, eq=False, kw_only=True)
class HandPath:
    """Knots of a hand whose tendons let go, or tighten; between them all numbers are linear.

    Attributes
    ----------
    tensions : ndarray, shape (k, 4)
        Tension of each tendon [N].
    wrenches : ndarray, shape (k, 6)
        Wrench of the hand on the rock, in H [N, N·m].
    joints : ndarray, shape (k, 4, 3)
        Joint angles of each finger [rad].
    engagement : ndarray, shape (k, n)
        Share of each tile's spines that hold, in the order of `SettledHand.tiles`; of a nail that
        is hooked 1.
    bearing : ndarray of bool, shape (k, n)
        Whether each phalanx presses on the rock or is held to it, with spines or without.
    events : tuple of TileEvent
        Tiles that let go, or catch, in their order.
    deviation : ndarray, shape (k - 1, 6)
        Largest distance of the wrench from the straight line between neighbouring knots.
    jammed : tuple of Jam
        Fingers that do not let go.
    resting : tuple of str
        Fingers that their springs press on the rock at the end of opening, as rock is in the way
        of the straight finger; their spines let go as the hand retreats.
    friction : float
        μ of the surface, on which it depends whether spines let go.
    """

    tensions: Array
    wrenches: Array
    joints: Array
    engagement: Array
    bearing: NDArray[np.bool_]
    events: tuple[TileEvent, ...]
    deviation: Array
    jammed: tuple[Jam, ...]
    resting: tuple[str, ...]
    friction: float


def opening_path(hand: SettledHand, *, force: float = PATH_SETTINGS.force) -> HandPath:
    """Lower all tendons of a closed hand together, from the closing tension to zero.

    The hand begins without load of its palm and without lateral loads.

    Parameters
    ----------
    hand : SettledHand
    force : float, optional
        Largest distance of the force from straight lines between knots [N]; that of the moment is
        a tenth of it in N·m.

    Returns
    -------
    HandPath

    Raises
    ------
    UnsupportedError
        If tiles of the hand have slipped.
    InvalidFieldError
        If ``force`` is below zero or not a number.
    """
    return _path(hand, force, opens=True)


def closing_path(hand: SettledHand, *, force: float = PATH_SETTINGS.force) -> HandPath:
    """Tighten all tendons of the open hand together, from zero to the closing tension.

    The last knot is the closed hand. Arguments, result and errors are those of `opening_path`.
    """
    return _path(hand, force, opens=False)


def _path(hand: SettledHand, force: float, *, opens: bool) -> HandPath:
    if not force >= 0.0:
        raise InvalidFieldError(f"must be 0 N or more, got {force:g}", field="force")
    if hand.closed is not None:
        raise UnsupportedError("the path of a hand some of whose tiles have slipped is not known")
    paths: list[FingerPath] = []
    if not hand.grasp.fingernail:
        opened = open_fingers(hand)
        paths = (
            opening_paths(hand.hand.finger, opened, hand.fingers)
            if opens
            else closing_paths(hand.hand.finger, opened)
        )
    parts = [
        *(phalanx_parts(hand, paths, opens=opens) if paths else ()),
        *base_parts(hand, opens=opens),
        *nail_parts(hand, opens=opens),
    ]
    closing = hand.closing_tension
    at = np.unique(np.concatenate([[0.0, closing], *(part.at for part in parts)]))
    wrenches, joints = np.zeros((len(at), 6)), np.zeros((len(at), len(FINGERS), len(PHALANGES)))
    engagement = np.zeros((len(at), len(hand.tiles)))
    bearing = np.zeros(engagement.shape, dtype=bool)
    for part in parts:
        wrenches += _interpolated(at, part.at, part.wrenches)
        last, tiles = np.searchsorted(part.at, at, side="right") - 1, list(part.tiles)
        engagement[:, tiles] = part.engagement[last.clip(0)]
        bearing[:, tiles] = part.bearing[last.clip(0)]
        if part.joints is not None:
            finger = hand.finger_of[tiles[0]]
            joints[:, finger] = _interpolated(at, part.at, part.joints)
    tolerance = np.repeat([force, force * PATH_SETTINGS.moment / PATH_SETTINGS.force], 3)
    knots = few_knots(at, wrenches, tolerance)
    tensions = (closing - at if opens else at).clip(0.0, closing)
    jammed = tuple(_jams(hand, paths)) if opens and paths else ()
    return HandPath(
        tensions=np.repeat(tensions[knots, None], len(FINGERS), axis=1),
        wrenches=wrenches[knots],
        joints=joints[knots],
        engagement=engagement[knots],
        bearing=bearing[knots],
        events=_events(hand, parts, opens=opens),
        deviation=deviations(at, wrenches, knots),
        jammed=jammed,
        resting=_resting(paths, jammed) if opens and paths else (),
        friction=hand.surface.friction,
    )


def _interpolated(at: Array, known: Array, values: Array) -> Array:
    return np.column_stack([np.interp(at, known, each) for each in values.T])


def _events(hand: SettledHand, parts: list[Part], *, opens: bool) -> tuple[TileEvent, ...]:
    """Return the tiles that let go, or catch, in their order."""
    # mirrored fingers differ by rounding
    found = sorted(
        (round(s, 6), k, s)
        for part in parts
        for k, s in zip(part.tiles, part.turns, strict=True)
        if not math.isnan(s)
    )
    closing = hand.closing_tension
    return tuple(
        TileEvent(*hand.tiles[k][:2], tension=closing - s if opens else s) for _, k, s in found
    )


def _jams(hand: SettledHand, paths: Sequence[FingerPath]) -> Iterator[Jam]:
    """Yield fingers that do not let go."""
    mu = hand.surface.friction
    for name, path in zip(FINGERS, paths, strict=True):
        if not path.rests:
            f = path.tensions[-1]
            yield Jam(name, None, f"no balance of {name} was found below {f:.3g} N of tension")
            continue
        pull, shear = -path.normals[-1], path.shears[-1]
        holds = (path.engagement[-1] > 0.0) & (pull > PATH_SETTINGS.pull)
        if holds.any():
            needed = float((shear[holds] / pull[holds]).min())
            names = " and ".join(PHALANGES[j] for j in holds.nonzero()[0].tolist())
            yield Jam(
                name,
                needed,
                f"the spines of {name} ({names}) hold at zero tension; the first would let go if "
                f"the surface's friction were above {needed:.3g}, it is {mu:.3g}",
            )


def _resting(paths: Sequence[FingerPath], jammed: Sequence[Jam]) -> tuple[str, ...]:
    """Return the fingers that their springs press on the rock at zero tension."""
    stuck = {jam.finger for jam in jammed}
    return tuple(
        name
        for name, path in zip(FINGERS, paths, strict=True)
        if name not in stuck and (path.normals[-1] > PATH_SETTINGS.pull).any()
    )
