"""Rock that a finger meets with its whole width, in the coordinates of the finger's plane."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hand_models.base import Array
from hand_models.sections.section import Complexes, Section

__all__ = ["NO_STRIPS", "FingerRock", "RockStrips"]


class RockStrips(NamedTuple):
    """Rock in k strips side by side under a finger's tiles, by how far it lies behind the envelope.

    Attributes
    ----------
    across : ndarray, shape (k,)
        Middle of each strip: distance from the finger's plane, along z × the finger [m].
    places : ndarray of complex, shape (c,)
        s + i t of places on the envelope [m].
    behind : ndarray, shape (c, k)
        Depth of each strip's rock behind the envelope, along its normal, at these places; infinite
        where a strip has no rock [m].
    """

    across: Array
    places: Complexes
    behind: Array


NO_STRIPS = RockStrips(np.zeros(1), np.zeros(0, dtype=complex), np.zeros((0, 1)))
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
