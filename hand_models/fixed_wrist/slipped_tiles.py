"""A settled hand some of whose tiles have slipped, in the posture in which it closed.

A tile that has slipped drags on along the rock while it is pressed: its spines carry nothing, and
with friction μ and normal load N ≥ 0 its shear is T = μ N, in the direction in which the tendon
drags it. Its finger's joints stay balanced by the forces of all its phalanges; with the moments A
of normal loads and B of shears about the joints, and the loads N₀, T₀ of the finger as it closed,

    A N + B T = A N₀ + B T₀,   T = μ N of slipped tiles,   T = T₀ of the others.

So loads stay affine in the tendon's tension. They hold where every slipped tile is pressed
(N ≥ 0), which is a hard row of the hand's set. A finger of which no tile holds, or in which no
tension presses all slipped tiles, is *released*: off the rock, it carries nothing.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices
from hand_models.finger import CONTACT_KINDS, JOINT_STOPS, PHALANGES
from hand_models.hand import FINGERS, SettledHand

__all__ = ["SLIPPED_TILE", "slipped_hand"]

SLIPPED_TILE: Final = "slipped"
"""Contact state of a tile that has slipped, and drags on along the rock."""


def slipped_hand(
    hand: SettledHand,
    tiles: Collection[int],
    released: Collection[int] = (),
    *,
    palm: bool = True,
) -> SettledHand:
    """Return a hand with a fixed wrist after tiles have slipped; its fingers stay as they closed.

    Parameters
    ----------
    hand : SettledHand
        The hand as it closed, without fingernails that hook.
    tiles : collection of int
        Indices of the tiles that have slipped; each was on the rock.
    released : collection of int, optional
        Indices of fingers that are taken off the rock, whatever their tiles do.
    palm : bool, optional
        False if the palm is off the rock, too.

    Returns
    -------
    SettledHand
        With the contact states ``slipped`` and, for the tiles of released fingers, ``none``.
    """
    loads, engagement = hand.loads.copy(), hand.engagement.copy()
    contacts = [tile.contact for tile in hand.tiles]
    torques = {(finger, joint): torque for finger, joint, torque in hand.stops}
    engagement[list(tiles)] = 0.0
    for finger in range(len(FINGERS)):
        own = np.flatnonzero(hand.finger_of == finger)
        lost = [t for t in own.tolist() if t in tiles]
        if not (lost or finger in released):
            continue
        found = None
        if finger not in released and engagement[own].any():
            found = _dragging(hand, finger, own, lost)
        if found is None:
            loads[own], engagement[own] = 0.0, 0.0
            for t in own.tolist():
                contacts[t] = "none"
            for joint in range(len(PHALANGES)):
                if (finger, joint) in torques:
                    torques[finger, joint] = np.zeros(2)
            continue
        loads[own], stops = found
        for t in lost:
            contacts[t] = SLIPPED_TILE
        torques |= {(finger, joint): torque for joint, torque in stops.items()}
    for array in (loads, engagement):
        array.setflags(write=False)
    return replace(
        hand,
        tiles=tuple(
            [
                tile._replace(contact=contact)
                for tile, contact in zip(hand.tiles, contacts, strict=True)
            ]
        ),
        loads=loads,
        engagement=engagement,
        stops=tuple([(finger, joint, torques[finger, joint]) for finger, joint, _ in hand.stops]),
        palm=hand.palm if palm else hand.palm._replace(engaged=(), engagement=()),
        closed=hand,
    )


def _dragging(
    hand: SettledHand, finger: int, own: Indices, lost: Collection[int]
) -> tuple[Array, dict[int, Array]] | None:
    """Return a finger's loads, shape (n, 2, 2), and the torques on its stops, with dragging tiles.

    None if there is no tension at which all of them are pressed, and the other tiles hold.

    Parameters
    ----------
    hand : SettledHand
    finger : int
    own : ndarray of int, shape (n,)
        The finger's tiles, of which ``lost`` have slipped.
    lost : collection of int
    """
    friction, loads = hand.surface.friction, hand.loads[own].copy()
    slipped = np.array([t in lost for t in own.tolist()])
    pressed = np.array([hand.tiles[t].phalanx in PHALANGES for t in own.tolist()])
    # a tile on the rotating base is pressed by no joint
    loads[slipped & ~pressed] = 0.0
    on = np.flatnonzero(pressed)
    normals, shears = _moments(hand, finger, own[on])
    pressed = loads[on, 1].copy()
    before = normals @ pressed + shears @ loads[on, 0]
    drags, bears = slipped[on], hand.postures.kinds[finger] != CONTACT_KINDS.index("none")
    at = on[drags]
    loads[at] = 0.0
    free = np.flatnonzero(hand.postures.stops[finger] == 0)
    joined = normals + shears * np.where(drags, friction, 0.0)
    bearing = np.flatnonzero(bears)
    # each joint that no stop holds has its phalanx on the rock
    A, share = joined[np.ix_(free, bearing)], hand.postures.bearing_shares[finger, bearing, None]
    # what locked joints carried beside their contacts, these bear in the same shares
    locked = (1.0 - share) * normals[free, bearing, None] * pressed[bearing]
    A = share * A + np.diag((1.0 - share[:, 0]) * np.diag(A))
    try:
        found = np.linalg.solve(A, share * (before - shears @ loads[on, 0])[free] + locked)
    except np.linalg.LinAlgError:
        return None
    loads[on[bearing], 1] = found
    loads[at, 0] = friction * loads[at, 1]
    left = before - normals @ loads[on, 1] - shears @ loads[on, 0]
    stops = {}
    for where, joint, torque in hand.stops:
        if where == finger:
            upper = JOINT_STOPS[hand.postures.stops[finger, joint]] == "upper"
            stops[joint] = torque + (left[joint] if upper else -left[joint])
    return (loads, stops) if _lasts(hand, own, loads, slipped, stops) else None


def _moments(hand: SettledHand, finger: int, phalanges: Indices) -> tuple[Array, Array]:
    """Return the moments of unit normal loads and of unit shears about the joints, (3, 3) each [m].

    Row: joint; column: phalanx; positive if the joint would close.
    """
    frame = hand.hand.frames(hand.grasp.outer_rotation)[finger]
    joints = hand.postures.joints[finger][:, None]
    places, axes = hand.positions[phalanges] - frame.joint, hand.axes[phalanges]
    x, z = places @ frame.along - joints.real, places[:, 2] - joints.imag
    shears, normals = (np.triu(x * axes[:, i, 2] - z * (axes[:, i] @ frame.along)) for i in (0, 1))
    return normals, shears


def _lasts(
    hand: SettledHand,
    own: Indices,
    loads: Array,
    slipped: NDArray[np.bool_],
    stops: dict[int, Array],
) -> bool:
    """Return whether there is a tension at which a finger's contacts last."""
    pressed = loads[:, 1].copy()
    for i in range(len(own)):
        if hand.tiles[own[i]].phalanx == "base":
            pressed[i] = hand.engagement[own[i]] * pressed[i + 1]
    holds = loads[:, 0] + hand.surface.friction * pressed
    holds[:, 0] += hand.drag_allowances[own] * ~slipped
    framed = [hand.tiles[t].contact == "frame" for t in own]
    touching = hand.touching[own]
    rows = np.concatenate(
        [holds[touching], loads[framed, 1], np.array(list(stops.values())).reshape(-1, 2)]
    )
    start, slope = rows.T
    least, most = 0.0, hand.hand.maximum_tension
    rising, falling = slope > 0.0, slope < 0.0
    least = max(least, float((-start[rising] / slope[rising]).max(initial=0.0)))
    most = min(most, float((-start[falling] / slope[falling]).min(initial=most)))
    constant = start[~rising & ~falling]
    return least <= most and bool((constant >= 0.0).all())
