"""Retreat of an opened hand until its straight fingers are clear of the rock."""

from __future__ import annotations

import math

from hand_models.finger import straight_lift
from hand_models.hand import SettledHand
from hand_models.opening.parts import open_fingers

__all__ = ["clear_retreat"]


def clear_retreat(hand: SettledHand) -> float | None:
    """Return the least retreat along −z of H that clears all straight fingers of the rock [m].

    The springs straighten the fingers of an open hand. None if a finger's length is not enough.

    Parameters
    ----------
    hand : SettledHand
    """
    most = max(straight_lift(hand.hand.finger, opened) for opened in open_fingers(hand))
    return most if math.isfinite(most) else None
