"""Fingernails of hands that cling with them: whether they hook, and their conditions."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, InvalidInputError
from hand_models.finger import CONTACT_KINDS
from hand_models.hand.closed_fingers import ClosedFingers
from hand_models.hand.finger_frames import HAND_Z, TILE_COLUMNS
from hand_models.hand.names import CONTACT_NAMES, FINGERS, NAIL
from hand_models.hand.placement import PlacedHands

__all__ = ["Nails", "hook_nails"]


class Nails(NamedTuple):
    """Fingernails of one hand: whether and where each hooks on the rock.

    Attributes
    ----------
    angles : ndarray, shape (4,)
        Angle of each finger's nail; fully retracted if it does not hook [rad].
    normals : ndarray, shape (4, 3)
        Unit vector out of the rock at each nail's hook, in the hand frame H; zero if the nail does
        not hook.
    rows : tuple of (ndarray, ndarray)
        ``H`` and ``h`` of the `Cling` of each nail that hooks, in the order of `FINGERS`.
    tiles : ndarray, shape (4, 18)
        Numbers of the nails as tiles, in the order of `TileColumns`; empty without a fingernail
        grasp.
    """

    angles: Array
    normals: Array
    rows: tuple[tuple[Array, Array], ...]
    tiles: Array


def hook_nails(placed: PlacedHands, closed: ClosedFingers, index: int, closing: float) -> Nails:
    """Return the nails of a hand: hooked on the rock in a fingernail grasp, else retracted.

    Parameters
    ----------
    placed : PlacedHands
    closed : ClosedFingers
    index : int
        Index of the hand.
    closing : float
        Closing tension of the hand [N].

    Raises
    ------
    InvalidInputError
        If rock is in the way of a nail that points straight ahead.
    """
    nail = placed.hand.nail
    angles, normals = np.full(len(FINGERS), nail.retraction), np.zeros((len(FINGERS), 3))
    clinging = len(FINGERS) if placed.placements[index].grasp.fingernail else 0
    column = TILE_COLUMNS
    rows, tiles = [], np.zeros((clinging, column.total))
    tiles[:, column.kind] = CONTACT_KINDS.index("none")
    frames = placed.frames.hands[index]
    for i, (name, frame, tip) in enumerate(zip(FINGERS, frames, tiles, strict=False)):
        section = placed.section(index, i)
        finger = closed.alone[len(FINGERS) * index + i].finger
        if nail.stuck(section, finger.pin):
            raise InvalidInputError(
                f"the hold is in the way of the nail of {name}, straight ahead; "
                "move the hand away from the rock",
                field="hold",
            )
        cling = nail.cling(section, finger, closing, name.startswith("outer"))
        reach = nail.length
        if cling is not None:
            angles[i], reach = cling.hook.angle, cling.hook.distance
            s, t = cling.hook.normal
            normals[i] = s * frame.along + t * HAND_Z
            rows.append((cling.H, cling.h))
            tip[column.kind], tip[column.normal] = CONTACT_NAMES.index(NAIL), cling.force
        cosine, sine = math.cos(angles[i]), math.sin(angles[i])
        w = cosine * frame.along + sine * HAND_Z
        tip[column.position] = frame.joint + finger.pin[0] * frame.along + reach * w
        tip[column.axes] = np.concatenate([-w, cosine * HAND_Z - sine * frame.along, frame.across])
    for array in (angles, normals, *(part for pair in rows for part in pair)):
        array.setflags(write=False)
    return Nails(angles, normals, tuple(rows), tiles)
