"""Frames of a hand's fingers and tiles before it closes, for a rotation of its outer fingers."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Final

import numpy as np

from hand_models.base import Array, Pose
from hand_models.finger import CONTACT_KINDS, PHALANGES
from hand_models.hand.names import FINGERS
from hand_models.rock import Hold
from hand_models.sections import Section

__all__ = [
    "ALONG",
    "AXES",
    "BASES",
    "COLUMNS",
    "ENGAGEMENT",
    "INTO",
    "JOINTS",
    "KIND",
    "NORMAL",
    "OUTER",
    "POSITION",
    "SHEAR",
    "TILES",
    "UP",
    "FingerFrame",
    "FrameStack",
]

OUTER: Final = slice(0, len(FINGERS), len(FINGERS) - 1)
"""Fingers with a base tile, the first and the last."""

BASES: Final = len(FINGERS[OUTER])
"""How many these are."""

TILES: Final = slice(0, -2 * len(FINGERS) - 1)
"""Rows of `FrameStack.rows` that are tiles which do not turn toward the rock: the two base tiles,
then the palm's."""

JOINTS: Final = slice(TILES.stop, TILES.stop + len(FINGERS))
"""Those that are the fingers' proximal joints."""

ALONG: Final = slice(JOINTS.stop, -1)
"""Those that are the directions of the fingers."""

INTO: Final = -1
"""The one that is the direction z of H, into the rock."""

POSITION, AXES, SHEAR, NORMAL = slice(0, 3), slice(3, 12), slice(12, 14), slice(14, 16)
ENGAGEMENT, KIND = 16, 17
"""Numbers of a tile: where it is [m], its axes row by row, its loads at zero tension [N] and per
newton, the share of its spines that are on the rock, and the code of its contact; as of
`SettledHand`."""

COLUMNS: Final = KIND + 1

UP: Final = np.array([0.0, 0.0, 1.0])
"""z of H."""

UP.setflags(write=False)


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
        All that is seen from a hold, see `TILES` and its like, in homogeneous coordinates: (p, 1)
        for a place p [m], (d, 0) for a direction d.
    planes : ndarray, shape (n, 4, 3, 3)
        Fingers' planes F: along, into the rock, the joint; (x, z, 1) there is the place x, z, and
        (x, z, 0) is a direction.
    across : ndarray, shape (n, 4, 3, 3)
        Across the fingers, for each of their phalanges.
    base_tiles : ndarray, shape (n, 2, `COLUMNS`)
        Numbers of the base tiles where they touch nothing.
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
        count, into = len(joints), np.broadcast_to(UP, alongs.shape)
        acrosses = np.stack(
            [-alongs[..., 1], alongs[..., 0], np.zeros_like(alongs[..., 0])], axis=-1
        )
        palms = np.broadcast_to(palm, (count, *palm.shape))
        places = np.insert(np.concatenate([bases, palms, joints], axis=1), 3, 1.0, axis=2)
        directions = np.insert(np.concatenate([alongs, into[:, :1]], axis=1), 3, 0.0, axis=2)
        tiles = np.zeros((count, BASES, COLUMNS))
        tiles[..., POSITION], tiles[..., KIND] = bases, CONTACT_KINDS.index("none")
        tiles[..., AXES] = np.concatenate([-alongs, into, acrosses], axis=2)[:, OUTER]
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
