"""Monte Carlo samples of a hand's place: forces that a hand can hold if not exactly placed.

Places are a scrambled Sobol sequence, which covers the six dimensions of a place more evenly than
random numbers. The hand's name and a seed scramble it: a hand's places depend neither on other
hands, nor on their order, nor on the machine.

A hand that was placed by contact (`contact_rest`) comes to rest anew at each place along x, y and
turned about z. Only there it is moved along z and turned about x and y, by what contact leaves.
So is a hand whose seat's frame on the rock is given: it is seated anew at each place.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple
from zlib import crc32

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import (
    Array,
    EmptySetError,
    InvalidInputError,
    Pose,
    check_positive,
    go_on,
    turns_about,
)
from hand_models.fixed_wrist.contact_rest import contact_slopes, rests_on_rock
from hand_models.fixed_wrist.pure_forces import FORCE_TOLERANCE, pure_reaches
from hand_models.fixed_wrist.space import wrench_spaces
from hand_models.hand import Placement, SettledHand, SpinyHand

__all__ = [
    "SCATTER_SETTINGS",
    "Robustness",
    "ScatterSettings",
    "closed_about",
    "robustness",
    "scattered_places",
]


@dataclass(frozen=True, slots=True)
class ScatterSettings:
    """Settings of the scatter of a hand's place: number of places, percentiles of results."""

    places: int = 128
    """Number of places of a hand by default: a power of two, as Sobol sequences need. With 64 the
    tenth of a slab's load factors changes by 7 % (rms) with the seed, with 128 by 2 %.
    """
    tenth: float = 10.0
    """Percentile that is exceeded at nine in ten places."""
    hundredth: float = 1.0
    """Percentile that stands for the worst place, which would depend on the number of places."""


SCATTER_SETTINGS = ScatterSettings()


class Robustness(NamedTuple):
    """Largest force or moment of a hand in k directions over a scatter of its place.

    A place where the hand cannot be, or where its wrench space is empty, counts as zero.

    Attributes
    ----------
    draws, without : int
        Number of places, and of those where the hand cannot be or its wrench space is empty.
    position, angle : float
        Half width of the scatter along each axis of H [m], and about each axis [rad].
    seed : int
        Seed of the places.
    worst : ndarray, shape (k,)
        Deprecated: the same as ``hundredth``. It was the least of the places.
    tenth, hundredth : ndarray, shape (k,)
        Value that is exceeded at nine in ten places, and at 99 in a hundred.
    contact : tuple of float, optional
        Half width along z [m], and about x and y [rad], of a hand that was placed by contact or is
        seated anew.
    pure_tenth : ndarray, shape (j,)
        Largest *pure* force in each of j directions, every other component zero, that nine in ten
        places have (the order statistic, never between two places) [N]. A place counts as zero
        where no such wrench is above zero.
    share : ndarray, shape (j,)
        Share of the places whose largest pure force is at least ``force`` [1].
    force : float
        Pure force that counts as held, for ``share`` [N].
    """

    draws: int
    without: int
    position: float
    angle: float
    seed: int
    worst: Array
    tenth: Array
    hundredth: Array
    contact: tuple[float, float] | None = None
    pure_tenth: Array = np.zeros(0)
    share: Array = np.zeros(0)
    force: float = FORCE_TOLERANCE


def robustness(
    hand: SpinyHand,
    settled: SettledHand,
    directions: ArrayLike,
    draws: int = SCATTER_SETTINGS.places,
    seed: int = 0,
    scatter: tuple[float, float] | None = None,
    *,
    at: Pose | None = None,
    pure: ArrayLike | None = None,
    force: float = FORCE_TOLERANCE,
) -> Robustness:
    """Return quantiles of the largest wrenches of a hand that is closed again at places nearby.

    Parameters
    ----------
    hand : SpinyHand
        Model of the settled hand.
    settled : SettledHand
    directions : array_like, shape (k, 6)
        Directions of wrenches on the rock, in H, for the support function.
    draws : int, optional
        Number of places.
    seed : int, optional
    scatter : tuple of float, optional
        Half width of a uniform scatter along each axis of H [m], and about each axis through the
        middle of the palm [rad]; by default that of the hand's parameters.
    at : Pose, optional
        Frame on the hold on which the hand was seated, to seat it anew at each place
        (`closed_about`).
    pure : array_like, shape (j, 6), optional
        Directions of forces on the rock, in H, for pure forces; none by default, as each place
        takes two linear programs for a direction and its opposite.
    force : float, optional
        Pure force that counts as held, above zero [N].

    Raises
    ------
    InvalidInputError
        If there is no draw, a scatter is negative, or ``force`` is not above zero.
    """
    position, angle = hand.seat_scatter if scatter is None else scatter
    if draws < 1:
        raise InvalidInputError(f"at least one is needed, got {draws}", field="draws")
    if not (0.0 <= position < np.inf and 0.0 <= angle <= np.pi):
        raise InvalidInputError(
            "must be a finite length of at least 0 m, and an angle from 0 to π rad, "
            f"got {position:g} m and {angle:g} rad",
            field="scatter",
        )
    check_positive(force, "N", "force")
    there: list[SettledHand] = []
    places = scattered_places("", draws, seed)
    for outcomes in closed_about(hand, settled, places, (position, angle), at=at):
        there += [each for each in outcomes if isinstance(each, SettledHand)]
    ways, reaches = np.atleast_2d(np.asarray(directions, dtype=float)), []
    alone = np.zeros((0, 6)) if pure is None else np.atleast_2d(np.asarray(pure, dtype=float))
    held = np.zeros((draws, len(alone)))
    for space in wrench_spaces(there):
        go_on()
        try:
            reaches.append([space.support(way) for way in ways])
        except EmptySetError:
            continue
        if len(alone):
            held[len(reaches) - 1] = np.fmax(pure_reaches(space, alone), 0.0)
    without = draws - len(reaches)
    reaches += [[0.0] * len(ways)] * without
    hundredth, tenth = np.percentile(
        reaches, [SCATTER_SETTINGS.hundredth, SCATTER_SETTINGS.tenth], axis=0
    )
    return Robustness(
        draws,
        without,
        position,
        angle,
        seed,
        worst=hundredth,
        tenth=tenth,
        hundredth=hundredth,
        contact=None if at is None and settled.seating.offset is None else hand.contact_scatter,
        pure_tenth=np.percentile(held, SCATTER_SETTINGS.tenth, axis=0, method="inverted_cdf"),
        share=(held >= force).mean(axis=0),
        force=force,
    )


def scattered_places(name: str, count: int, seed: int) -> Array:
    """Return samples of a hand's displacement from its place, each from −1 to 1 (scrambled Sobol).

    Parameters
    ----------
    name : str
        Name of the hand.
    count : int
        Number of places.
    seed : int
        Seed of the scrambling, beside the name.

    Returns
    -------
    ndarray, shape (count, 6)
        Displacements along x, y, z of H and turns about them, as shares of the half widths.
    """
    from scipy.stats import qmc

    own = np.random.default_rng([seed, crc32(name.encode())])
    sequence = qmc.Sobol(6, scramble=True, seed=own)
    return np.asarray(2.0 * sequence.random_base2((count - 1).bit_length())[:count] - 1.0)


def closed_about(
    hand: SpinyHand,
    settled: SettledHand,
    places: Array,
    scatter: tuple[float, float],
    contact_scatter: tuple[float, float] | None = None,
    at: Pose | None = None,
) -> Iterator[Sequence[SettledHand | InvalidInputError]]:
    """Close a hand again at places near its place, 64 at a time.

    Parameters
    ----------
    hand : SpinyHand
        Model of the settled hand.
    settled : SettledHand
    places : ndarray, shape (n, 6)
        Displacement along, and turn about, each axis of H, in units of ``scatter``; for a hand that
        was placed by contact or is seated anew, those along z and about x and y in units of
        ``contact_scatter``.
    scatter : tuple of float
        Unit along an axis [m], and about an axis [rad].
    contact_scatter : tuple of float, optional
        Units of the displacement along z [m] and of the turns about x and y [rad] that remain
        after contact; by default those of the hand's parameters.
    at : Pose, optional
        Frame on the hold on which a hand was seated (`Placement`). At each place the hand is then
        seated anew, at its x, y and turn about z, and moved by the rest of its displacement.

    Yields
    ------
    sequence of SettledHand or InvalidInputError
        The next 64 places, in order; an error in place of a hand that cannot be there.
    """
    at_once = 64  # hands that are closed together
    start = Placement(settled.hold, settled.surface, settled.grasp, settled.seating.pose)
    left = contact_scatter or hand.contact_scatter
    frames_of: Callable[[Array, tuple[float, float]], Sequence[Pose | InvalidInputError]] = _posed
    if settled.seating.offset is not None:
        frames_of = _ContactFrames(hand, settled, left)
    elif at is not None:
        frames_of = partial(_seated_frames, hand, settled, left, at)
    for first in range(0, len(places), at_once):
        frames = frames_of(places[first : first + at_once], scatter)
        there = [
            start._replace(hold_in_hand=frame.inverse() @ settled.seating.pose)
            for frame in frames
            if isinstance(frame, Pose)
        ]
        closed = iter(hand.settle_each(there))
        yield [next(closed) if isinstance(frame, Pose) else frame for frame in frames]


def _posed(places: Array, scatter: tuple[float, float]) -> Sequence[Pose]:
    """Return the frames of a hand at its places, in that where it was put."""
    position, angle = scatter
    return [Pose(position * by[:3], turns_about(angle * by[3:])) for by in places]


def _parted(
    places: Array, scatter: tuple[float, float], left: tuple[float, float]
) -> tuple[Sequence[Pose], Sequence[Pose]]:
    """Return the frames of moves along x and y and about z, and those that contact leaves."""
    wrist = np.array([1.0, 1.0, 0.0, 0.0, 0.0, 1.0])
    return _posed(places * wrist, scatter), _posed(places * (1.0 - wrist), left)


def _seated_frames(
    hand: SpinyHand,
    settled: SettledHand,
    left: tuple[float, float],
    at: Pose,
    places: Array,
    scatter: tuple[float, float],
) -> list[Pose | InvalidInputError]:
    """Return the frames of a hand that is seated anew at its places, in that where it was put."""
    moved, more = _parted(places, scatter, left)
    start = Placement(settled.hold, settled.surface, settled.grasp, None)
    seats = hand.settle_each([start._replace(at=at @ each) for each in moved])
    return [
        settled.seating.pose @ seat.seating.pose.inverse() @ by
        if isinstance(seat, SettledHand)
        else seat
        for seat, by in zip(seats, more, strict=True)
    ]


class _ContactFrames:
    """Frames of a hand that comes to rest anew at its places, in that where it was put.

    Parameters
    ----------
    hand : SpinyHand
    settled : SettledHand
        Placed by contact.
    left : tuple of float
        Unit of what contact leaves, along z [m] and about x and y [rad].
    """

    def __init__(self, hand: SpinyHand, settled: SettledHand, left: tuple[float, float]) -> None:
        assert settled.seating.offset is not None
        self._left = left
        self._hand, self._offset = hand, settled.seating.offset
        at_rest = self._offset @ settled.seating.pose
        self._rest = Placement(settled.hold, settled.surface, settled.grasp, at_rest)
        self._slopes = contact_slopes(hand, self._rest)

    def __call__(
        self, places: Array, scatter: tuple[float, float]
    ) -> list[Pose | InvalidInputError]:
        moved, left = _parted(places, scatter, self._left)
        assert self._rest.hold_in_hand is not None
        starts = [
            self._rest._replace(hold_in_hand=each.inverse() @ self._rest.hold_in_hand)
            for each in moved
        ]
        rests = rests_on_rock(self._hand, starts, self._slopes)
        back = self._offset.inverse()
        return [
            back @ each @ rest @ more @ self._offset if isinstance(rest, Pose) else rest
            for each, rest, more in zip(moved, rests, left, strict=True)
        ]
