"""Bound the cost of a stance: half-planes and points of outlines of all its hands."""

from __future__ import annotations

import msgspec

from hand_models.base import LimitError
from service import requests

__all__ = ["check_costs"]


def check_costs(stance: requests.Stance) -> None:
    """Refuse a stance whose hands have too many half-planes or outline points in all.

    Parameters
    ----------
    stance : requests.Stance
        Stance of the request.

    Raises
    ------
    LimitError
        If the half-planes, or the points of outlines, are more than a request may have; the field
        is relative to the stance.
    """
    # a plan of wrists that move is found in several rounds
    rounds = 4
    # four hands with 64 half-planes have some 7500 rows in a program
    most_planes = 256
    planes = sum(
        (1 if hand.wrist == "fixed" else rounds) * _half_planes(hand) for hand in stance.hands
    )
    if planes > most_planes:
        raise LimitError(
            f"half_planes of all hands are {planes} together, those of a compliant or floating "
            f"hand counted {rounds} times; the maximum is {most_planes}: use fewer half_planes",
            field="hands",
        )
    points = sum(_points(hand.hold, stance.rocks) for hand in stance.hands)
    # some 0.1 ms for each point of an outline
    most_points = 40_000
    if points > most_points:
        raise LimitError(
            f"profiles of all hands have {points} points together, those of a shared rock counted "
            f"for each hand on it; the maximum is {most_points}: use fewer points",
            field="hands",
        )


def _half_planes(hand: requests.Hand) -> int:
    given = hand.surface.half_planes if isinstance(hand.surface, requests.Surface) else None
    return given or 1


def _points(hold: requests.Hold, rocks: dict[str, requests.Rock]) -> int:
    """Return how many points the outlines of a hold have, those of a shared rock as its own."""
    if isinstance(hold, requests.RockReference):
        return _points(rocks[hold.rock], {}) if hold.rock in rocks else 0
    if not isinstance(hold, requests.Profile):
        return 0
    strips = () if hold.profiles is None else msgspec.structs.astuple(hold.profiles)
    return sum(map(len, strips)) + len(hold.points or ())
