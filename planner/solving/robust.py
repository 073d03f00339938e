"""Robust load factor: quantiles over places of the hands near the given ones (Monte Carlo).

Every hand is closed at 128 places about the given one, independent of the other hands; a hand that
was placed by contact comes to rest anew there (`hand_models.fixed_wrist.seat_scatter`). A sample
puts each hand at one of its places; over all samples each place is used equally often, and the
places of the hands are combined at random: closing a hand is costly, and the hands' combinations
need more samples than there are places. A sample in which a hand cannot close, or which has no load
factor, counts as zero.

With compliant wrists each sample takes a search of its own, which begins at the plan of the given
places, and its plan is verified. There are fewer samples, each of which has places of its own. A
deadline leaves those that are planned, if these are enough for an interval.

The confidence interval of a quantile p follows from how the samples below the quantile depend on
the place of each hand. With σ_h² the variance, over the places of hand h, of the share of samples
below it, the variance of the share of all samples below is

    Σ_h σ_h² / places + (p (1 − p) − Σ_h σ_h²) / samples.

The formula holds for random places, which are less even than the ones used here. The interval has
the order statistics at the quantiles 1.96 standard deviations to either side.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final
from zlib import crc32

import numpy as np

from hand_models.base import Array, Indices
from hand_models.fixed_wrist import (
    SCATTER_SETTINGS,
    closed_about,
    scattered_places,
    wrench_spaces,
)
from hand_models.hand import SettledHand
from hand_models.wrench_spaces import WrenchSpace
from planner import deadline
from planner.advice import Attempt
from planner.deadline import DeadlineError
from planner.explanation import LimitUse
from planner.prepare import PreparedStance
from planner.result import RobustLoadFactor, RobustQuantiles
from planner.solving.fixed_wrists import most_of_fixed
from planner.solving.solution import Solution

__all__ = ["find_robust_load_factor"]


@dataclass(frozen=True, slots=True)
class RobustSettings:
    """Number of the samples that are planned, and the seed of their random numbers."""

    seed: int = 0  # of the places and of their combinations
    rounds: int = 16
    """Samples that take each place: with 4 the tenth of an overhang's load factors changes by 6 %
    (rms) with the seed, with 8 by 3 %."""
    searches: int = 64
    """Samples where wrists are compliant, a power of two: they take about a second each."""
    least: int = 16
    """Least number of these that count where a deadline leaves no time for all."""
    late: str = "all samples were planned"  # what a deadline may leave unfinished


SETTINGS: Final = RobustSettings()

Places = Sequence[SettledHand | None]
"""A hand closed at its places; None where it cannot be."""


def find_robust_load_factor(
    prepared: PreparedStance,
    idle: Sequence[LimitUse],
    usual: Solution,
    attempt: Attempt,
    *,
    overloaded: bool,
) -> RobustLoadFactor | None:
    """Return quantiles of the load factor over places of the hands near the given ones.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.
    idle : sequence of LimitUse
        Limits of limbs without a hand, the same in every sample.
    usual : Solution
        Solution for the hands at their given places.
    attempt : callable
        Plans a stance with other hands (`try_stance`), where wrists are compliant.
    overloaded : bool
        True if a limb without a hand cannot carry its own weight: every factor is zero then.

    Returns
    -------
    RobustLoadFactor or None
        None if the deadline passed before all samples were planned.
    """
    count, rounds, least = SCATTER_SETTINGS.places, SETTINGS.rounds, math.inf
    if moving := prepared.hands.floating:
        count, rounds, least = SETTINGS.searches, 1, SETTINGS.least
    try:
        reasons: dict[str, str] = {}
        places = [_places(prepared, i, count, reasons) for i in range(len(prepared.limbs))]
        taken = np.array([_taken(limb, count, rounds) for limb in prepared.limbs])
        if overloaded:
            factors = np.zeros(taken.shape[1])
        else:
            factor_of = (
                _replanned_factor(prepared, places, idle, usual, attempt)
                if moving
                else _fixed_factor(prepared, places)
            )
            factors = _factors(places, taken, factor_of, least)
    except DeadlineError:
        return None
    taken = taken[:, : len(factors)]
    absent = [
        sum(own[at] is None for at in row) for own, row in zip(places, taken.tolist(), strict=True)
    ]
    refused = {limb: n for limb, n in zip(prepared.limbs, absent, strict=True) if n}
    quantiles = [SCATTER_SETTINGS.hundredth, SCATTER_SETTINGS.tenth]
    hundredth, tenth = np.percentile(factors, quantiles).tolist()
    replanned = RobustQuantiles(
        tenth=tenth,
        tenth_interval=_interval(factors, taken, SCATTER_SETTINGS.tenth, count),
        hundredth=hundredth,
        hundredth_interval=_interval(factors, taken, SCATTER_SETTINGS.hundredth, count),
    )
    stance = prepared.question.stance
    position, angle = stance.robot.hand.seat_scatter
    by_contact = any(hand.contact_offset is not None for hand in stance.hands)
    contact = stance.robot.hand.contact_scatter if by_contact else (None, None)
    return RobustLoadFactor(
        draws=len(factors),
        without=int((factors <= 0.0).sum()),
        refused=refused,
        position=position,
        angle=angle,
        seed=SETTINGS.seed,
        worst=hundredth,
        tenth=replanned.tenth,
        tenth_interval=replanned.tenth_interval,
        hundredth=replanned.hundredth,
        hundredth_interval=replanned.hundredth_interval,
        places=count,
        replanned=replanned,
        reasons=reasons,
        contact_position=contact[0],
        contact_angle=contact[1],
    )


def _places(prepared: PreparedStance, i: int, count: int, reasons: dict[str, str]) -> Places:
    """Return a hand closed at so many places.

    ``reasons``: takes why the hand cannot be at the first place where it cannot, by limb.
    """
    settled = prepared.batch.hands[i]
    hand, found = prepared.question.stance.robot.hand, list[SettledHand | None]()
    where = scattered_places(prepared.limbs[i], count, SETTINGS.seed)
    for outcomes in closed_about(hand, settled, where, hand.seat_scatter):
        for each in outcomes:
            if not isinstance(each, SettledHand):
                reasons.setdefault(prepared.limbs[i], each.message)
        found += [each if isinstance(each, SettledHand) else None for each in outcomes]
        deadline.check(SETTINGS.late)
    return found


def _taken(limb: str, places: int, rounds: int) -> Indices:
    """Return which place of a hand each sample takes, shape (samples,)."""
    own = np.random.default_rng([SETTINGS.seed, crc32(limb.encode()), rounds])
    return np.concatenate([own.permutation(places) for _ in range(rounds)])


FactorOf = Callable[[Sequence[int]], float]
"""Returns the load factor with each hand at one of its places, by index; zero without one."""


def _fixed_factor(prepared: PreparedStance, places: Sequence[Places]) -> FactorOf:
    """Return the function for the load factor of fixed wrists, whose sets are computed once."""
    cap, sets = prepared.question.limits.tendon_tension, list[list[WrenchSpace | None]]()
    for added, own in zip(prepared.hands.added, places, strict=True):
        spaces = iter(wrench_spaces([each for each in own if each is not None], cap))
        sets.append([None if each is None else added.on(next(spaces)) for each in own])
        deadline.check(SETTINGS.late)

    def factor(sample: Sequence[int]) -> float:
        there = [own[at] for own, at in zip(sets, sample, strict=True)]
        moved = prepared.hands.with_sets([each for each in there if each is not None])
        return most_of_fixed(moved, moved.sets(moved.at_rest()).data) or 0.0

    return factor


def _replanned_factor(
    prepared: PreparedStance,
    places: Sequence[Places],
    idle: Sequence[LimitUse],
    usual: Solution,
    attempt: Attempt,
) -> FactorOf:
    """Return the function for the load factor of compliant wrists; each call is a search."""
    plain = replace(prepared, question=prepared.question.bare())

    def factor(sample: Sequence[int]) -> float:
        there = [own[at] for own, at in zip(places, sample, strict=True)]
        moved = plain.with_hands([each for each in there if each is not None])
        return attempt(moved, idle, usual).load_factor().factor or 0.0

    return factor


def _factors(places: Sequence[Places], taken: Indices, factor_of: FactorOf, least: float) -> Array:
    """Return the load factors of samples, shape (n,); zero where there is none.

    ``taken``: which place each hand has in them, shape (hands, n); ``least``: number of samples
    with which a deadline may end it.
    """
    factors = np.zeros(taken.shape[1])
    for k, sample in enumerate(taken.T.tolist()):
        try:
            if all(own[at] is not None for own, at in zip(places, sample, strict=True)):
                factors[k] = factor_of(sample)
            deadline.check(SETTINGS.late)
        except DeadlineError:
            if k < least:
                raise
            return factors[:k]
    return factors


def _interval(factors: Array, taken: Indices, percent: float, places: int) -> list[float]:
    """Return the ends between which a quantile is in 95 %."""
    share, samples = percent / 100.0, len(factors)
    rounds = samples // places
    below = factors <= np.percentile(factors, percent)
    whole = share * (1.0 - share)
    between = 0.0
    for own in taken if rounds > 1 else ():  # else no two samples share a place
        means = np.bincount(own, below, places) / rounds
        # what so few samples at each place vary by themselves is taken off
        own_share = 1.0 / rounds
        between += max(float(means.var(ddof=1)) - whole / rounds, 0.0) / (1.0 - own_share)
    between = min(between, whole)
    # 1.96 standard deviations to either side hold it in 95 %
    off = 1.96 * math.sqrt(between / places + (whole - between) / samples)
    ends = np.clip([share - off, share + off], 0.0, 1.0)
    found: list[float] = np.quantile(factors, ends).tolist()
    return found
