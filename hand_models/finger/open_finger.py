"""A finger that is to close, and how it ended."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hand_models.base import Array
from hand_models.finger.model import PHALANGES, SettledFinger
from hand_models.sections import Section
from hand_models.tile import Surface

__all__ = ["ClosedFinger", "OpenFinger", "Refused"]


class OpenFinger(NamedTuple):
    """A finger that is to close.

    Attributes
    ----------
    section : Section or None
        Rock in the finger's plane, the proximal joint at its origin.
    surface : Surface
        What the tiles hold.
    tension : float
        At which the tiles catch the rock [N].
    base_tile : bool
        Whether a base tile comes first on the tendon.
    """

    section: Section | None
    surface: Surface
    tension: float
    base_tile: bool = False


class ClosedFinger(NamedTuple):
    """A finger at rest, and its loads as affine functions of tension.

    Attributes
    ----------
    finger : SettledFinger
    shears, normals, torques : ndarray, shape (3, 2)
        Of `SettledFinger.shears`, `normals` and `stop_torques`.
    touches : tuple of float
        Tensions at which phalanges first came to the rock; NaN for those that did not [N].
    """

    finger: SettledFinger
    shears: Array
    normals: Array
    torques: Array
    touches: tuple[float, ...] = (np.nan,) * len(PHALANGES)


class Refused(NamedTuple):
    """A finger that cannot be where it is.

    Attributes
    ----------
    depth : float
        Of the rock in the open finger [m]; zero where it does not come to rest.
    lift : float
        Of the finger out of the rock, along −z of F, that would clear it; infinite if none up to
        the length of a finger does, NaN where it is not looked for [m].
    """

    depth: float
    lift: float
