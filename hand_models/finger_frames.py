"""Where a hand's fingers and tiles are before it closes, for a rotation of its outer fingers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np

from hand_models.finger import PHALANGES
from hand_models.frames import Array, Pose
from hand_models.holds import Hold
from hand_models.laying import NONE
from hand_models.sections import Section
from hand_models.settled_hand import FINGERS, NAIL

if TYPE_CHECKING:
    from hand_models.hand import SpinyHand

__all__ = [
    "ALONG",
    "AXES",
    "BASES",
    "COLUMNS",
    "INTO",
    "JOINTS",
    "KIND",
    "NORMAL",
    "OUTER",
    "PARTS",
    "PLACES",
    "POSITION",
    "SHEAR",
    "TILES",
    "UP",
    "FingerFrame",
    "FingerFrames",
    "FrameStack",
]

OUTER: Final = slice(0, len(FINGERS), len(FINGERS) - 1)
"""Fingers with a base tile, the first and the last."""

BASES: Final = len(FINGERS[OUTER])
"""How many these are."""

JOINTS: Final = slice(0, len(FINGERS))
"""Rows of `FingerFrames.rows` that are the fingers' proximal joints."""

TILES: Final = slice(len(FINGERS), -len(FINGERS) - 1)
"""Those that are tiles which do not turn toward the rock: the two base tiles, then the palm's."""

PLACES: Final = slice(0, TILES.stop)
"""Those that are places."""

ALONG: Final = slice(TILES.stop, -1)
"""Those that are the directions of the fingers."""

INTO: Final = -1
"""The one that is the direction z of H, into the rock."""

PARTS: Final = ("base", *PHALANGES, NAIL)
"""Tiles that a finger may have, and its nail."""

POSITION, AXES, SHEAR, NORMAL, KIND = slice(0, 3), slice(3, 12), slice(12, 14), slice(14, 16), 16
"""Numbers of a tile: where it is [m], its axes row by row, its loads at zero tension [N] and per
newton, and the code of its contact; as of `SettledHand`."""

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
    def of(cls, hand: SpinyHand, outer_rotation: float) -> FingerFrames:
        """Return the frames of a hand whose outer fingers are turned outward by an angle [rad]."""
        fingers, bases = [], []
        for name in FINGERS:
            side = 1.0 if name.endswith("left") else -1.0
            mirror = np.array([1.0, side, 1.0])
            if name.startswith("inner"):
                joint, along = hand.inner_joint * mirror, np.array([1.0, 0.0, 0.0])
            else:
                along = np.array([math.cos(outer_rotation), side * math.sin(outer_rotation), 0.0])
                joint = hand.outer_axis * mirror + hand.outer_reach * along
                place = joint + along * (hand.base_tile_reach - hand.outer_reach)
                bases.append([place[0], place[1], hand.base_tile_surface])
            across = np.array([-along[1], along[0], 0.0])
            fingers.append(FingerFrame(joint, along, across))
        made = cls(tuple(fingers), np.array(bases), hand.palm_tiles)
        for array in (made.bases, *(v for f in fingers for v in (f.joint, f.along, f.across))):
            array.setflags(write=False)
        return made

    @cached_property
    def rows(self) -> Array:
        """All that is seen from a hold, shape (t + 11, 3); see `JOINTS` and its like [m]."""
        joints, alongs = ([getattr(f, name) for f in self.fingers] for name in ("joint", "along"))
        return np.vstack([joints, self.bases, self.palm, alongs, UP])

    @cached_property
    def planes(self) -> Array:
        """Axes of the fingers' planes F, along each finger and into the rock, (4, 2, 3)."""
        return np.stack([np.stack([frame.along, UP]) for frame in self.fingers])

    @cached_property
    def parts(self) -> Array:
        """Numbers of the fingers' `PARTS` where none is turned nor touches, (4, 5, `COLUMNS`)."""
        parts = np.zeros((len(FINGERS), len(PARTS), COLUMNS))
        parts[OUTER, PARTS.index("base"), POSITION] = self.bases
        for finger, frame in zip(parts, self.fingers, strict=True):
            finger[:, AXES] = np.concatenate([-frame.along, UP, frame.across])
        parts[..., KIND] = NONE
        return parts


@dataclass(frozen=True, eq=False)
class FrameStack:
    """The frames of n hands.

    Attributes
    ----------
    hands : tuple of FingerFrames
    rows : ndarray, shape (n, t + 11, 3)
        Of `FingerFrames.rows`.
    planes : ndarray, shape (n, 4, 2, 3)
        Of `FingerFrames.planes`.
    parts : ndarray, shape (n, 4, 5, `COLUMNS`)
        Of `FingerFrames.parts`.
    """

    hands: tuple[FingerFrames, ...]
    rows: Array
    planes: Array
    parts: Array

    @classmethod
    def of(cls, hands: Sequence[FingerFrames]) -> FrameStack:
        """Stack frames, read-only."""
        stacks = [
            np.array([getattr(frames, name) for frames in hands])
            for name in ("rows", "planes", "parts")
        ]
        for stack in stacks:
            stack.setflags(write=False)
        return cls(tuple(hands), *stacks)
