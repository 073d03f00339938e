"""Where a hand's fingers and tiles are before it closes, for a rotation of its outer fingers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Pose
from hand_models.finger import NONE, PHALANGES
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
    "FingerFrames",
    "FrameStack",
    "PalmLayout",
]

OUTER: Final = slice(0, len(FINGERS), len(FINGERS) - 1)
"""Fingers with a base tile, the first and the last."""

BASES: Final = len(FINGERS[OUTER])
"""How many these are."""

TILES: Final = slice(0, -2 * len(FINGERS) - 1)
"""Rows of `FingerFrames.rows` that are tiles which do not turn toward the rock: the two base tiles,
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


class PalmLayout(NamedTuple):
    """Where fingers and flat tiles are attached to the palm, in H [m].

    Attributes
    ----------
    inner_joint : ndarray, shape (3,)
        Proximal joint of the inner left finger; the right one's is its mirror image.
    outer_axis : ndarray, shape (3,)
        Where the outer left finger turns on its base; the right one's is its mirror image.
    outer_reach : float
        From there to the proximal joint.
    base_tile_reach : float
        From there to the base tile.
    base_tile_surface : float
        Height of the base tiles, z of H.
    palm : ndarray, shape (t, 3)
        The palm's tiles.
    """

    inner_joint: Array
    outer_axis: Array
    outer_reach: float
    base_tile_reach: float
    base_tile_surface: float
    palm: Array


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
class FingerFrames:
    """Frames of a hand's fingers and its tiles that do not turn, in H. Arrays are read-only.

    Attributes
    ----------
    fingers : tuple of FingerFrame
        In the order of `FINGERS`.
    bases : ndarray, shape (2, 3)
        Base tiles of the outer fingers, left first [m].
    palm : ndarray, shape (t, 3)
        The palm's tiles [m].
    """

    fingers: tuple[FingerFrame, ...]
    bases: Array
    palm: Array

    @classmethod
    def of(cls, layout: PalmLayout, outer_rotation: float) -> FingerFrames:
        """Return the frames of a hand whose outer fingers are turned outward by an angle [rad]."""
        fingers, bases = [], []
        for name in FINGERS:
            side = 1.0 if name.endswith("left") else -1.0
            mirror = np.array([1.0, side, 1.0])
            if name.startswith("inner"):
                joint, along = layout.inner_joint * mirror, np.array([1.0, 0.0, 0.0])
            else:
                along = np.array([math.cos(outer_rotation), side * math.sin(outer_rotation), 0.0])
                joint = layout.outer_axis * mirror + layout.outer_reach * along
                place = joint + along * (layout.base_tile_reach - layout.outer_reach)
                bases.append([place[0], place[1], layout.base_tile_surface])
            across = np.array([-along[1], along[0], 0.0])
            fingers.append(FingerFrame(joint, along, across))
        made = cls(tuple(fingers), np.array(bases), layout.palm)
        for array in (made.bases, *(v for f in fingers for v in (f.joint, f.along, f.across))):
            array.setflags(write=False)
        return made

    @cached_property
    def rows(self) -> Array:
        """All that is seen from a hold, shape (t + 11, 4); see `TILES` and its like.

        In homogeneous coordinates: (p, 1) for a place p [m], (d, 0) for a direction d.
        """
        joints, alongs = ([getattr(f, name) for f in self.fingers] for name in ("joint", "along"))
        places, directions = np.vstack([self.bases, self.palm, joints]), np.vstack([alongs, UP])
        return np.vstack([np.insert(places, 3, 1.0, axis=1), np.insert(directions, 3, 0.0, axis=1)])

    @cached_property
    def planes(self) -> Array:
        """Fingers' planes F, (4, 3, 3): along, into the rock, the joint; (x, z, 1) there is x, z.

        And (x, z, 0) is a direction.
        """
        return np.array([(frame.along, UP, frame.joint) for frame in self.fingers])

    @cached_property
    def across(self) -> Array:
        """Across the fingers, for each of their phalanges, (4, 3, 3)."""
        return np.array([[frame.across] * len(PHALANGES) for frame in self.fingers])

    @cached_property
    def base_tiles(self) -> Array:
        """Numbers of the base tiles where they touch nothing, (2, `COLUMNS`)."""
        tiles = np.zeros((BASES, COLUMNS))
        tiles[:, POSITION], tiles[:, KIND] = self.bases, NONE
        for tile, frame in zip(tiles, self.fingers[OUTER], strict=True):
            tile[AXES] = np.concatenate([-frame.along, UP, frame.across])
        return tiles


@dataclass(frozen=True, eq=False)
class FrameStack:
    """The frames of n hands.

    Attributes
    ----------
    hands : tuple of FingerFrames
    rows : ndarray, shape (n, t + 11, 4)
        Of `FingerFrames.rows`.
    planes : ndarray, shape (n, 4, 3, 3)
        Of `FingerFrames.planes`.
    across : ndarray, shape (n, 4, 3, 3)
        Of `FingerFrames.across`.
    base_tiles : ndarray, shape (n, 2, `COLUMNS`)
        Of `FingerFrames.base_tiles`.
    """

    hands: tuple[FingerFrames, ...]
    rows: Array
    planes: Array
    across: Array
    base_tiles: Array

    @classmethod
    def of(cls, hands: Sequence[FingerFrames]) -> FrameStack:
        """Stack frames, read-only."""
        stacks = [
            np.array([getattr(frames, name) for frames in hands])
            for name in ("rows", "planes", "across", "base_tiles")
        ]
        for stack in stacks:
            stack.setflags(write=False)
        return cls(tuple(hands), *stacks)
