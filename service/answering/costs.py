"""What the hands of a stance may cost together, known before any is settled."""

from __future__ import annotations

from typing import Final

import msgspec

from hand_models.base import LimitError
from service import requests

__all__ = ["check_costs"]

MOST_HALF_PLANES: Final = 256
"""Of all hands of a stance: 64 each of four, some 7500 rows in a plan's program."""

FLOATING: Final = 4
"""How many times over a floating hand's half-planes count: its plan is found in several rounds."""

MOST_POINTS: Final = 40_000
"""Of the outlines of all hands of a stance, of some 0.1 ms each."""


def check_costs(stance: requests.Stance) -> None:
    """Refuse hands that would cost too much together.

    Raises
    ------
    LimitError
        The field is relative to the stance.
    """
    planes = sum(map(_half_planes, stance.hands))
    if planes > MOST_HALF_PLANES:
        raise LimitError(
            f"half_planes of all hands are {planes} together, those of a floating hand counted "
            f"{FLOATING} times; at most {MOST_HALF_PLANES} are worked with",
            field="hands",
        )
    points = sum(_points(hand.hold, stance.rocks) for hand in stance.hands)
    if points > MOST_POINTS:
        raise LimitError(
            f"profiles of all hands have {points} points together; at most {MOST_POINTS} are "
            "worked with",
            field="hands",
        )


def _half_planes(hand: requests.Hand) -> int:
    given = hand.surface.half_planes if isinstance(hand.surface, requests.Surface) else None
    return (FLOATING if hand.wrist == "floating" else 1) * (given or 1)


def _points(hold: requests.Hold, rocks: dict[str, requests.Rock]) -> int:
    """Return how many points the outlines of a hold have, those of a shared rock as its own."""
    if isinstance(hold, requests.RockReference):
        return _points(rocks[hold.rock], {}) if hold.rock in rocks else 0
    if not isinstance(hold, requests.Profile):
        return 0
    strips = () if hold.profiles is None else msgspec.structs.astuple(hold.profiles)
    return sum(map(len, strips)) + len(hold.points or ())
