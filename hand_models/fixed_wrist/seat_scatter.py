"""Hands that are not quite where they were put, and what one can carry there."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import Array, EmptySetError, InvalidInputError, Pose, go_on, turns_about
from hand_models.fixed_wrist.space import wrench_spaces
from hand_models.hand import Placement, SettledHand, SpinyHand

__all__ = ["DRAWS", "TENTH", "Robustness", "robustness", "scattered_hands"]

DRAWS: Final = 50
"""Places of a hand that are drawn, unless another number is asked for."""

TENTH: Final = 10.0
"""Percentile that is told beside the least."""

AT_ONCE: Final = 64
"""Hands that are closed together: all the draws of one, unless more are asked for."""


class Robustness(NamedTuple):
    """How far a hand reaches in some directions over a scatter of its place.

    Attributes
    ----------
    draws, without : int
        Places that were drawn, and those of them where the hand cannot be or holds nothing.
    position, angle : float
        The scatter: to either side along each axis of H [m], and about each [rad].
    seed : int
        Of the draws.
    worst, tenth : ndarray, shape (k,)
        The least that it reaches at the other places, and what it exceeds at nine in ten of them;
        NaN if there are none.
    """

    draws: int
    without: int
    position: float
    angle: float
    seed: int
    worst: Array
    tenth: Array


def robustness(
    hand: SpinyHand,
    settled: SettledHand,
    directions: ArrayLike,
    draws: int = DRAWS,
    seed: int = 0,
    scatter: tuple[float, float] | None = None,
) -> Robustness:
    """Close a hand anew at random places about its own, and tell how far it still reaches.

    Parameters
    ----------
    hand : SpinyHand
        Which it is.
    settled : SettledHand
    directions : array_like, shape (k, 6)
        Of wrenches on the rock, in H.
    draws, seed : int, optional
    scatter : tuple of float, optional
        To either side along each axis of H [m], and about each [rad], about the middle of the palm;
        evenly distributed. As in the hand's parameters by default.

    Raises
    ------
    InvalidInputError
        If there is no draw, or a scatter is negative.
    """
    position, angle = hand.seat_scatter if scatter is None else scatter
    if draws < 1:
        raise InvalidInputError(f"at least one is needed, got {draws}", field="draws")
    if not (0.0 <= position < np.inf and 0.0 <= angle <= np.pi):
        raise InvalidInputError(
            f"must be from 0 m, and from 0 to π rad, got {position:g} and {angle:g}",
            field="scatter",
        )
    there = []
    for (each,) in scattered_hands(hand, [settled], draws, seed, (position, angle)):
        there += [each] if isinstance(each, SettledHand) else []
    ways, reaches = np.atleast_2d(np.asarray(directions, dtype=float)), []
    for space in wrench_spaces(there):
        go_on()
        try:
            reaches.append([space.support(way) for way in ways])
        except EmptySetError:
            continue
    without = draws - len(reaches)
    if not reaches:
        nothing = np.full(len(ways), np.nan)
        return Robustness(draws, without, position, angle, seed, nothing, nothing)
    worst, tenth = np.percentile(reaches, [0.0, TENTH], axis=0)
    return Robustness(draws, without, position, angle, seed, worst, tenth)


def scattered_hands(
    hand: SpinyHand,
    settled: Sequence[SettledHand],
    draws: int,
    seed: int,
    scatter: tuple[float, float],
) -> Iterator[list[SettledHand | InvalidInputError]]:
    """Close hands anew at random places about their own, each drawn apart from the others.

    Parameters
    ----------
    hand : SpinyHand
        Which all of them are.
    settled : sequence of SettledHand
    draws, seed, scatter
        As of `robustness`.

    Yields
    ------
    list of SettledHand or InvalidInputError
        Of each draw, in order; an error in place of a hand that cannot be there.
    """
    position, angle = scatter
    drawn = np.random.default_rng(seed).uniform(-1.0, 1.0, (draws, len(settled), 6))
    step = max(1, AT_ONCE // len(settled))
    for start in range(0, draws, step):
        placements = [
            Placement(
                each.hold,
                each.surface,
                each.grasp,
                Pose(position * by[:3], turns_about(angle * by[3:])).inverse() @ each.seating.pose,
            )
            for one in drawn[start : start + step]
            for each, by in zip(settled, one, strict=True)
        ]
        outcomes = hand.settle_each(placements)
        for first in range(0, len(outcomes), len(settled)):
            yield outcomes[first : first + len(settled)]
