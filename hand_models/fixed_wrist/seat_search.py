"""Search for the best seat: of many places near the seat of a hand, the one where it holds most.

From the seat (`hand_models.hand.seating`) the hand is backed off along −z of its frame H, turned
about that axis and tilted about x and y, all about the middle of its palm, within the bounds of the
hand's parameters. Its best seat is where the largest wrench in a given direction, with every other
component zero, is greatest; where no place allows that, the largest support function decides.

The search has two stages, each of them one batch: stand-offs and turns on a grid, then tilts and
smaller steps about the best of these. So it is deterministic, and the best seat holds no less than
the seat that it began with.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import (
    Array,
    EmptySetError,
    InvalidInputError,
    Pose,
    finite_vector,
    go_on,
    turns_about,
)
from hand_models.fixed_wrist.space import wrench_spaces
from hand_models.hand import Placement, PlacementKey, Seating, SettledHand, SpinyHand, seated
from hand_models.wrench_spaces import WrenchSpace

__all__ = ["PULL_OFF", "best_seats"]

PULL_OFF: Final = (0.0, 0.0, -1.0, 0.0, 0.0, 0.0)
"""Direction of the wrench on the rock, in H, of a hand that is pulled off the rock."""


class _Move(NamedTuple):
    """Move of a hand off its seat: parts of the farthest stand-off, largest turn, largest tilts."""

    off: float
    turn: float
    tilt: tuple[float, float] = (0.0, 0.0)

    def of(self, hand: SpinyHand) -> Pose:
        """Return the frame of a hand that has moved, in that where it was seated."""
        tilted = turns_about([hand.seat_tilt * self.tilt[0], hand.seat_tilt * self.tilt[1], 0.0])
        turned = turns_about([0.0, 0.0, hand.seat_turn * self.turn])
        return Pose(np.array([0.0, 0.0, -hand.back_off * self.off]), turned @ tilted)


def _about(move: _Move) -> list[_Move]:
    """Return the moves of the second stage."""
    tilts = (-1.0, 0.0, 1.0)
    tilted = [move._replace(tilt=tilt) for tilt in itertools.product(tilts, tilts) if any(tilt)]
    nearer = ((-0.125, 0.0), (0.125, 0.0), (0.0, -0.25), (0.0, 0.25))
    moved = [move._replace(off=move.off + off, turn=move.turn + turn) for off, turn in nearer]
    return tilted + [each for each in moved if 0.0 <= each.off <= 1.0 and abs(each.turn) <= 1.0]


def best_seats(
    hand: SpinyHand, placements: Sequence[Placement], direction: ArrayLike = PULL_OFF
) -> list[SettledHand | InvalidInputError]:
    """Seat hands near their usual seats, where they can hold the largest wrench in a direction.

    A cache of the hand's model keeps seats that were found before.

    Parameters
    ----------
    hand : SpinyHand
        Model of all hands.
    placements : sequence of Placement
        Hands on their holds, with ``hold_in_hand`` None.
    direction : array_like, shape (6,), optional
        Direction of the wrench on the rock, in H; the pull-off by default.

    Returns
    -------
    list of SettledHand or InvalidInputError
        Hands in the order of ``placements``, with the seating rule ``best``; for a hand that can
        close at none of the places tried, the error at the first of them.

    Raises
    ------
    InvalidInputError
        If the direction is not six finite numbers or is zero, or a placement has a pose.
    """
    d = finite_vector(direction, 6, "direction")
    if not d.any():
        raise InvalidInputError(
            "must be the direction of a wrench, not zero: give one such as [0, 0, -1, 0, 0, 0]",
            field="direction",
        )
    d = d / np.abs(d).max()
    for each in placements:
        if each.hold_in_hand is not None:
            raise InvalidInputError(
                "'best' cannot be combined with a hold's pose: remove the pose, or use the seat "
                "'rest'",
                field="seat",
            )
    keys = [(PlacementKey(each), *d.tolist()) for each in placements]
    stored = zip(keys, hand.seated_best.find(keys), strict=True)
    known: dict[Hashable, SettledHand | InvalidInputError | None] = dict(stored)
    new = {key: each for key, each in zip(keys, placements, strict=True) if known[key] is None}
    found = dict(zip(new, _searched(hand, list(new.values()), d), strict=True)) if new else {}
    hand.seated_best.keep(
        [(key, each) for key, each in found.items() if isinstance(each, SettledHand)]
    )
    known.update(found)
    return [settled for key in keys if (settled := known[key]) is not None]


class _Found(NamedTuple):
    """A place that was looked at, and how far a hand reaches there."""

    reach: tuple[float, float]
    move: _Move
    settled: SettledHand


def _reach(space: WrenchSpace, direction: Array) -> tuple[float, float]:
    """Return how far a set reaches in a direction: alone, and with whatever else; −∞ if not."""
    try:
        ends = space.capability(direction)
        return -math.inf if ends is None else ends[1], space.support(direction)
    except EmptySetError:
        return -math.inf, -math.inf


def _searched(
    hand: SpinyHand, placements: Sequence[Placement], direction: Array
) -> list[SettledHand | InvalidInputError]:
    """Return hands where they hold most, of all places of both stages."""
    seats = seated(hand, placements)
    refused: list[InvalidInputError | None] = [None] * len(placements)
    best: list[_Found | None] = [None] * len(placements)

    def look(moves: Sequence[Iterable[_Move]]) -> None:
        """Close each hand at each of its places, and keep the best of them."""
        tries = [(i, move) for i, own in enumerate(moves) for move in own]
        outcomes = hand.settle_each(
            [
                placements[i]._replace(
                    hold_in_hand=move.of(hand).inverse() @ seats[i].pose, at=None
                )
                for i, move in tries
            ]
        )
        spaces = iter(wrench_spaces([each for each in outcomes if isinstance(each, SettledHand)]))
        for (i, move), outcome in zip(tries, outcomes, strict=True):
            if isinstance(outcome, InvalidInputError):
                refused[i] = refused[i] or outcome
                continue
            go_on()
            reach, known = _reach(next(spaces), direction), best[i]
            if known is None or reach > known.reach:
                best[i] = _Found(reach, move, outcome)

    offs, turns = (0.0, 0.125, 0.25, 0.5, 1.0), (-1.0, -0.5, 0.0, 0.5, 1.0)
    first = tuple(itertools.starmap(_Move, itertools.product(offs, turns)))
    # first also where a hand comes to rest that backs off for that
    rests = [
        each.seating.backed_off / hand.back_off if isinstance(each, SettledHand) else 0.0
        for each in hand.settle_each(placements)
    ]
    look([first if off in offs else (*first, _Move(off, 0.0)) for off in rests])
    look([[] if found is None else _about(found.move) for found in best])
    outcomes: list[SettledHand | InvalidInputError] = []
    for found, error in zip(best, refused, strict=True):
        if found is None:
            assert error is not None
            outcomes.append(error)
            continue
        seating = Seating(found.settled.seating.pose, "best", hand.back_off * found.move.off)
        outcomes.append(replace(found.settled, seating=seating))
    return outcomes
