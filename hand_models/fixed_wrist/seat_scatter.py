"""What a hand can carry where it is not quite where it was put."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from hand_models.base import Array, EmptySetError, InvalidInputError, Pose
from hand_models.fixed_wrist.space import wrench_spaces
from hand_models.hand import Placement, SettledHand, SpinyHand

__all__ = ["Robustness", "robustness"]

DRAWS: Final = 50
"""Places of a hand that are drawn, unless another number is asked for."""

TENTH: Final = 10.0
"""Percentile that is told beside the least."""


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
    drawn = np.random.default_rng(seed).uniform(-1.0, 1.0, (draws, 6))
    frames = [
        Pose(position * each[:3], Rotation.from_rotvec(angle * each[3:]).as_matrix())
        for each in drawn
    ]
    outcomes = hand.settle_each(
        [
            Placement(
                settled.hold,
                settled.surface,
                settled.grasp,
                frame.inverse() @ settled.seating.pose,
            )
            for frame in frames
        ]
    )
    there = [each for each in outcomes if isinstance(each, SettledHand)]
    ways, reaches = np.atleast_2d(np.asarray(directions, dtype=float)), []
    for space in wrench_spaces(there):
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
