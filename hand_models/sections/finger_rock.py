"""Rock that a finger meets with its whole width, in the coordinates of the finger's plane."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hand_models.base import Array
from hand_models.sections.section import Complexes, Section

__all__ = ["NO_STRIPS", "FingerRock", "FingerSize", "RockStrips"]


class FingerSize(NamedTuple):
    """Sizes of a finger that say which rock it meets.

    Attributes
    ----------
    reach : float
        Distance from the proximal joint beyond which it meets none [m].
    tile_width, frame_width : float
        Widths of its tiles and of its phalanges' frames [m].
    strip : float
        Largest width of the strips across a tile in which its spines reach the rock or not [m].
    """

    reach: float
    tile_width: float
    frame_width: float
    strip: float

    @property
    def strips(self) -> Array:
        """Distance of the middle of each strip across a tile from the tile's middle, (k,) [m]."""
        half = math.ceil(0.5 * self.tile_width / self.strip - 0.5)
        return np.asarray(self.tile_width / (2 * half + 1) * np.arange(-half, half + 1))


class RockStrips(NamedTuple):
    """Rock in k strips side by side under a finger's tiles, by how far it lies behind the envelope.

    Attributes
    ----------
    across : ndarray, shape (k,)
        Middle of each strip: distance from the finger's plane, along z × the finger [m].
    places : ndarray of complex, shape (c,)
        s + i t of places on the envelope [m].
    ways : ndarray of complex, shape (c,)
        Unit vectors into the rock, along which depths are measured there.
    behind : ndarray, shape (c, k)
        Depth of each strip's rock behind the envelope, along these ways; infinite where a strip has
        no rock [m].
    """

    across: Array
    places: Complexes
    ways: Complexes
    behind: Array


NO_STRIPS = RockStrips(
    np.zeros(1), np.zeros(0, dtype=complex), np.zeros(0, dtype=complex), np.zeros((0, 1))
)
"""Rock that is alike across a finger: one strip, nowhere behind the envelope."""


class FingerRock(NamedTuple):
    """Rock under a finger, as its envelope: the least t anywhere across the finger's width.

    Attributes
    ----------
    tile : Section or None
        Envelope across the tiles; None if there is no rock.
    frame : Section or None
        Envelope across the phalanges' frames, which are wider than their tiles; None where it is
        the same.
    strips : RockStrips
        Depth of the rock behind the envelope in strips across the tiles.
    """

    tile: Section | None
    frame: Section | None = None
    strips: RockStrips = NO_STRIPS

    @property
    def sections(self) -> tuple[Section, ...]:
        """Sections of ``tile`` and ``frame`` that are not None."""
        return tuple([each for each in (self.tile, self.frame) if each is not None])
