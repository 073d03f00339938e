"""Frames of a hand's fingers and tiles before it closes, for a rotation of its outer fingers."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Pose
from hand_models.finger import CONTACT_KINDS, PHALANGES
from hand_models.hand.names import FINGERS
from hand_models.rock import Hold
from hand_models.sections import Section

__all__ = ["HAND_Z", "OUTER_FINGERS", "STACK_ROWS", "TILE_COLUMNS", "FingerFrame", "FrameStack"]

OUTER_FINGERS: Final = slice(0, len(FINGERS), len(FINGERS) - 1)
"""Fingers with a base tile, the first and the last."""

HAND_Z: Final = np.array([0.0, 0.0, 1.0])
"""z of H."""

HAND_Z.setflags(write=False)


class StackRows(NamedTuple):
    """Rows of `FrameStack.rows`, by what they are.

    Attributes
    ----------
    tiles : slice
        Tiles which do not turn toward the rock: those of the bases, then the palm's.
    base_count : int
        How many are those of the bases.
    joints, alongs : slice
        The fingers' proximal joints, and their directions.
    into : int
        The direction z of H, into the rock.
    """

    tiles: slice = slice(0, -2 * len(FINGERS) - 1)
    base_count: int = len(FINGERS[OUTER_FINGERS])
    joints: slice = slice(-2 * len(FINGERS) - 1, -len(FINGERS) - 1)
    alongs: slice = slice(-len(FINGERS) - 1, -1)
    into: int = -1


class TileColumns(NamedTuple):
    """Numbers of a tile, as of `SettledHand`.

    Attributes
    ----------
    position, axes : slice
        Where it is [m], and its axes row by row.
    shear, normal : slice
        Its loads at zero tension [N] and per newton.
    engagement, kind : int
        The share of its spines that are on the rock, and the code of its contact.
    total : int
        How many numbers these are.
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
    """A finger's frame in H: the proximal joint, and unit vectors along and across the finger."""

    joint: Array
    along: Array
    across: Array

    def cut(self, hold: Hold, hand_in_hold: Pose, *, raw: bool = False) -> Section | None:
        """Return the rock in the finger's plane, in its coordinates F; raw as `Hold` has it."""
        cut = hold.raw_section if raw else hold.section
        rotation = hand_in_hold.rotation
        return cut(hand_in_hold.apply(self.joint), rotation @ self.along, rotation[:, 2])


@dataclass(frozen=True, eq=False)
class FrameStack:
    """Frames of the fingers of n hands, and their tiles that do not turn, in H; arrays read-only.

    Attributes
    ----------
    hands : tuple of tuple of FingerFrame
        Of each hand, in the order of `FINGERS`.
    rows : ndarray, shape (n, t + 11, 4)
        All that is seen from a hold, see `StackRows`, in homogeneous coordinates: (p, 1)
        for a place p [m], (d, 0) for a direction d.
    planes : ndarray, shape (n, 4, 3, 3)
        Fingers' planes F: along, into the rock, the joint; (x, z, 1) there is the place x, z, and
        (x, z, 0) is a direction.
    across : ndarray, shape (n, 4, 3, 3)
        Across the fingers, for each of their phalanges.
    base_tiles : ndarray, shape (n, 2, 18)
        `TileColumns` of the base tiles where they touch nothing.
    """

    hands: tuple[tuple[FingerFrame, ...], ...]
    rows: Array
    planes: Array
    across: Array
    base_tiles: Array

    @classmethod
    def of(cls, joints: Array, alongs: Array, bases: Array, palm: Array) -> FrameStack:
        """Return the frames of n hands.

        Parameters
        ----------
        joints, alongs : ndarray, shape (n, 4, 3)
            Proximal joints of their fingers [m], and the fingers' directions.
        bases : ndarray, shape (n, 2, 3)
            Base tiles of the outer fingers, left first [m].
        palm : ndarray, shape (t, 3)
            The palm's tiles [m].
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
            tuple(itertools.starmap(FingerFrame, zip(*hand, strict=True)))
            for hand in zip(joints, alongs, acrosses, strict=True)
        ]
        return cls(tuple(hands), *stacks)
