"""Frames of a hand's fingers and tiles in H before closing, by the outer fingers' rotation."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Pose
from hand_models.finger import CONTACT_KINDS, PHALANGES
from hand_models.hand.names import FINGERS
from hand_models.rock import Hold
from hand_models.sections import FingerRock, FingerSize, Section

__all__ = [
    "HAND_Z",
    "OUTER_FINGERS",
    "STACK_ROWS",
    "TILE_COLUMNS",
    "FingerFrame",
    "FrameStack",
    "border_distances",
]

OUTER_FINGERS: Final = slice(0, len(FINGERS), len(FINGERS) - 1)
"""Slice of `FINGERS` with the two outer fingers, which have a base tile."""

HAND_Z: Final = np.array([0.0, 0.0, 1.0])
"""Unit vector along z of H, into the rock."""

HAND_Z.setflags(write=False)


class StackRows(NamedTuple):
    """Meaning of the rows of `FrameStack.rows`.

    Attributes
    ----------
    tiles : slice
        Places of the tiles that do not turn toward the rock: the base tiles, then the palm's.
    base_count : int
        Number of base tiles among them.
    joints, alongs : slice
        Places of the fingers' proximal joints, and directions of the fingers.
    into : int
        Row of the direction z of the hand frame H, into the rock.
    """

    tiles: slice = slice(0, -2 * len(FINGERS) - 1)
    base_count: int = len(FINGERS[OUTER_FINGERS])
    joints: slice = slice(-2 * len(FINGERS) - 1, -len(FINGERS) - 1)
    alongs: slice = slice(-len(FINGERS) - 1, -1)
    into: int = -1


class TileColumns(NamedTuple):
    """Columns of the arrays that hold 18 numbers for each tile.

    Attributes
    ----------
    position, axes : slice
        Place of the contact [m]; unit forces of shear, normal and lateral load, row by row; in the
        hand frame H.
    shear, normal : slice
        Load at zero tension [N], and per newton of tension.
    engagement, kind : int
        Spine engagement, and the contact state by code (`CONTACT_NAMES`).
    total : int
        Count of numbers for each tile.
    """

    position: slice = slice(0, 3)
    axes: slice = slice(3, 12)
    shear: slice = slice(12, 14)
    normal: slice = slice(14, 16)
    engagement: int = 16
    kind: int = 17
    total: int = 18


STACK_ROWS = StackRows()
TILE_COLUMNS = TileColumns()


@dataclass(frozen=True)
class FingerFrame:
    """Frame of a finger in the hand frame H.

    Attributes
    ----------
    joint : ndarray, shape (3,)
        Place of the proximal joint [m].
    along, across : ndarray, shape (3,)
        Unit vectors along the open finger, and across its plane (z × along).
    size : FingerSize
        Sizes of the finger that say which rock it meets.
    """

    joint: Array
    along: Array
    across: Array
    size: FingerSize

    def cut(self, hold: Hold, hand_in_hold: Pose, *, raw: bool = False) -> Section | None:
        """Return the rock in the finger's plane, in its coordinates F; None if there is none.

        Parameters
        ----------
        hold : Hold
            The rock.
        hand_in_hold : Pose
            The hand frame H in the hold's frame.
        raw : bool, optional
            Whether to use `Hold.raw_section`, with steps and edges smaller than a tile.
        """
        plane = self._plane(hand_in_hold)
        if raw:
            return hold.raw_section(*plane)
        return hold.finger_rock(*plane, self.size, tiles_only=True).tile

    def rock(self, hold: Hold, hand_in_hold: Pose) -> FingerRock:
        """Return the rock under the finger's whole width, in its frame F; arguments as of `cut`."""
        return hold.finger_rock(*self._plane(hand_in_hold), self.size)

    def _plane(self, hand_in_hold: Pose) -> tuple[Array, Array, Array]:
        """Return origin and axes of the finger's plane in the hold's frame."""
        rotation = hand_in_hold.rotation
        return hand_in_hold.apply(self.joint), rotation @ self.along, rotation[:, 2]


@dataclass(frozen=True, eq=False)
class FrameStack:
    """Frames of the fingers of n hands, and their tiles that do not turn, in H; arrays read-only.

    Attributes
    ----------
    hands : tuple of tuple of FingerFrame
        Frames of each hand, in the order of `FINGERS`.
    rows : ndarray, shape (n, t + 11, 4)
        Places p as (p, 1) [m] and directions d as (d, 0), homogeneous coordinates in H; the order
        is that of `StackRows`. t palm tiles.
    planes : ndarray, shape (n, 4, 3, 3)
        Plane F of each finger, rows: along, into the rock, joint. A place (x, z, 1) or a direction
        (x, z, 0) in the finger frame F times these rows is the place or direction in H.
    across : ndarray, shape (n, 4, 3, 3)
        Unit vector across each finger's plane, repeated for its three phalanges.
    base_tiles : ndarray, shape (n, 2, 18)
        Numbers of the base tiles without contact, in the order of `TileColumns`.
    """

    hands: tuple[tuple[FingerFrame, ...], ...]
    rows: Array
    planes: Array
    across: Array
    base_tiles: Array

    @classmethod
    def of(
        cls, joints: Array, alongs: Array, bases: Array, palm: Array, size: FingerSize
    ) -> FrameStack:
        """Return the frames of n hands.

        Parameters
        ----------
        joints, alongs : ndarray, shape (n, 4, 3)
            Proximal joints [m] and directions of the fingers, in the hand frame H.
        bases : ndarray, shape (n, 2, 3)
            Base tiles of the outer fingers, left first, in H [m].
        palm : ndarray, shape (t, 3)
            Tiles of the palm, in H [m].
        size : FingerSize
            Of each finger.
        """
        count, into = len(joints), np.broadcast_to(HAND_Z, alongs.shape)
        acrosses = np.stack(
            [-alongs[..., 1], alongs[..., 0], np.zeros_like(alongs[..., 0])], axis=-1
        )
        palms = np.broadcast_to(palm, (count, *palm.shape))
        places = np.insert(np.concatenate([bases, palms, joints], axis=1), 3, 1.0, axis=2)
        directions = np.insert(np.concatenate([alongs, into[:, :1]], axis=1), 3, 0.0, axis=2)
        column = TILE_COLUMNS
        tiles = np.zeros((count, STACK_ROWS.base_count, column.total))
        tiles[..., column.position], tiles[..., column.kind] = bases, CONTACT_KINDS.index("none")
        axes = np.concatenate([-alongs, into, acrosses], axis=2)
        tiles[..., column.axes] = axes[:, OUTER_FINGERS]
        stacks = (
            np.concatenate([places, directions], axis=1),
            np.stack([alongs, into, joints], axis=2),
            acrosses[:, :, None].repeat(len(PHALANGES), axis=2),
            tiles,
        )
        for array in (joints, alongs, acrosses, *stacks):
            array.setflags(write=False)
        hands = [
            tuple(FingerFrame(*finger, size) for finger in zip(*hand, strict=True))
            for hand in zip(joints, alongs, acrosses, strict=True)
        ]
        return cls(tuple(hands), *stacks)


def border_distances(frames: Iterable[FingerFrame], border: Array) -> tuple[float, ...]:
    """Return the distance from each finger's joint to a border in the finger's plane [m].

    Parameters
    ----------
    frames : iterable of FingerFrame
    border : ndarray, shape (n, 2, 3)
        End points of its edges, in H [m].

    Returns
    -------
    tuple of float
        Infinite where the finger's plane does not cut the border.
    """
    found = []
    for frame in frames:
        off = (border - frame.joint) @ frame.across
        cut = (off[:, 0] < 0.0) != (off[:, 1] < 0.0)
        (p, q), (a, b) = off[cut].T, (border[cut] - frame.joint).transpose(1, 0, 2)
        points = (p[:, None] * b - q[:, None] * a) / (p - q)[:, None]
        found.append(float(np.linalg.norm(points, axis=1).min(initial=math.inf)))
    return tuple(found)
