"""Try holds on a scan: close a hand at each of many places, and compute the forces it can hold."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, Literal, NamedTuple, get_args

import numpy as np

from hand_models.base import (
    Array,
    EmptySetError,
    InvalidInputError,
    Pose,
    RefusedPlaceError,
)
from hand_models.finger import CONTACT_KINDS
from hand_models.fixed_wrist.contact_rest import placed_by_contact
from hand_models.fixed_wrist.placing import ALONG_FINGERS, approach_frame
from hand_models.fixed_wrist.pure_forces import (
    FORCE_TOLERANCE,
    TRIAL_WAYS,
    force_directions,
    impossible_forces,
    pure_reaches,
)
from hand_models.fixed_wrist.seat_scatter import Robustness, robustness
from hand_models.fixed_wrist.seat_search import best_seats
from hand_models.fixed_wrist.space import wrench_spaces
from hand_models.hand import FINGERS, Grasp, Placement, SettledHand, SpinyHand
from hand_models.rock import Mesh
from hand_models.tile import Surface

__all__ = [
    "AT_BORDER",
    "AT_HOLE",
    "HOLD_RANKS",
    "REFUSAL_WORDS",
    "FoundHold",
    "HoldRank",
    "HoldTrial",
    "closed_holds",
    "ranked_holds",
    "try_holds",
]

AT_BORDER: Final = "the scan ends, or has a hole, within a finger's reach"
"""Message for a place where a finger may reach the scan's border, so that no hand is tried."""

AT_HOLE: Final = "the scan has a hole within a finger's reach"
"""Message for a place where a finger may reach holes of the scan, but not its outline."""

REFUSAL_WORDS: Final = {
    "scan_border": AT_BORDER,
    "palm_in_rock": "rock is inside the palm",
    "finger_in_rock": "rock is inside a finger even with its joints fully open",
    "tendon_slack": "the closing tension does not close the fingers",
    "no_equilibrium": "no equilibrium of a finger was found",
    "no_rest": "the closed hand comes to rest nowhere near its seat",
    "unstable_rest": "the closed hand does not stay where its net force is zero",
    "other": "other reasons",
    "holds_nothing": "a hand can be there, but holds nothing in any direction",
    "unbounded": "no limit of its own bounds what a finger or the palm carries",
}
"""Reasons why there is no hold at a place, in words by kind (`RefusedPlaceError.reason`)."""

HoldRank = Literal["robust", "share", "pure", "support"]

HOLD_RANKS: Final = get_args(HoldRank)
"""Measures by which holds are ranked (`ranked_holds`); each breaks the ties of those before it."""


class HoldTrial(NamedTuple):
    """A place at which a hand is to be tried, in the rock's frame.

    Attributes
    ----------
    point : tuple of float
        Point on the rock [m].
    approach : tuple of float
        Direction of approach, into the rock.
    wrist_angle : float
        Turn of the hand about the approach (`approach_frame`) [rad].
    outer_rotation : float
        Rotation of the outer fingers (`Grasp`) [rad].
    """

    point: tuple[float, float, float]
    approach: tuple[float, float, float]
    wrist_angle: float
    outer_rotation: float


class FoundHold(NamedTuple):
    """Seat of a hand at a place, and the forces that it can hold there.

    Attributes
    ----------
    pose : Pose
        The hand's frame H in the rock's frame.
    rule : str
        Name of the rule by which the hand was seated.
    backed_off : float
        Distance that the hand was moved back along −z of H by its seating [m].
    support : ndarray, shape (5,)
        Largest force in each of `TRIAL_WAYS`, whatever the other components [N]; NaN if the wrench
        space is empty.
    pure : ndarray, shape (5,)
        Largest force in each of `TRIAL_WAYS` with every other component zero [N]; NaN if the wrench
        space has no such force.
    robust : Robustness or None
        The same two forces over a scatter of the place; None if not asked for.
    """

    pose: Pose
    rule: str
    backed_off: float
    support: Array
    pure: Array
    robust: Robustness | None = None

    @property
    def cannot(self) -> dict[str, str]:
        """Forces that the hand cannot exert alone, by direction, in words (`impossible_forces`)."""
        pure, support = (
            dict(zip(TRIAL_WAYS, each.tolist(), strict=True)) for each in (self.pure, self.support)
        )
        return impossible_forces(pure, support)


def _border_message(hand: SpinyHand, settled: SettledHand) -> str | None:
    """Return the message if a scan ends within a finger's reach, or has no rock at all for one."""
    reach = hand.finger.reach
    if min(settled.rock_ends) < reach:
        outline = min(settled.distances_to(settled.hold.outline))
        return AT_BORDER if outline < reach else AT_HOLE
    off = (settled.postures.kinds == CONTACT_KINDS.index("none")).all(axis=1)
    at = settled.hold, settled.grasp, settled.seating.pose
    without = bool(len(settled.hold.border)) and any(
        hand.section(name, *at) is None for name in np.array(FINGERS)[off].tolist()
    )
    return AT_BORDER if without else None


def closed_holds(
    hand: SpinyHand,
    rock: Mesh,
    surface: Surface,
    trials: Sequence[HoldTrial],
    seat: str = "rest",
    *,
    placing: str = "given",
) -> list[SettledHand | InvalidInputError]:
    """Close hands at places, all together.

    Parameters as in `try_holds`.

    Returns
    -------
    list of SettledHand or InvalidInputError
        Hands in the order of the trials; an error, with the reason, where one cannot be. A place
        where the scan ends within a finger's reach is an error, too: the finger would take the
        scan's border for an edge.
    """
    placements = [
        Placement(rock, surface, Grasp(each.outer_rotation), None, _approach(each))
        for each in trials
    ]
    outcomes = best_seats(hand, placements) if seat == "best" else hand.settle_each(placements)
    if placing == "contact":
        seated = [each for each in outcomes if isinstance(each, SettledHand)]
        rests = iter(placed_by_contact(hand, seated))
        outcomes = [next(rests) if isinstance(each, SettledHand) else each for each in outcomes]
    return [
        RefusedPlaceError(words, reason="scan_border", field="place.point")
        if isinstance(each, SettledHand) and (words := _border_message(hand, each)) is not None
        else each
        for each in outcomes
    ]


def _approach(trial: HoldTrial) -> Pose:
    return approach_frame(trial.point, trial.approach, trial.wrist_angle, ALONG_FINGERS)


def try_holds(
    hand: SpinyHand,
    rock: Mesh,
    surface: Surface,
    trials: Sequence[HoldTrial],
    seat: str = "rest",
    *,
    placing: str = "given",
    samples: int = 0,
    force: float = FORCE_TOLERANCE,
) -> list[FoundHold | InvalidInputError]:
    """Close hands at places, all together, and return the forces that they can hold.

    Parameters
    ----------
    hand : SpinyHand
    rock : Mesh
    surface : Surface
    trials : sequence of HoldTrial
    seat : {'rest', 'best'}, optional
        Rule for the seat: 'rest' as the grasp seats the hand, 'best' by `best_seats`.
    placing : {'given', 'contact'}, optional
        'contact' to move each hand from its seat to where it rests on the rock.
    samples : int, optional
        Number of places about each one at which the hand is tried, too; none by default. A hand
        with the seat 'rest' is seated anew at each (`closed_about`).
    force : float, optional
        Pure force that counts as held, for `Robustness.share` [N].

    Returns
    -------
    list of FoundHold or InvalidInputError
        Hands in the order of the trials; an error, with the reason, where one cannot be
        (`closed_holds`).
    """
    outcomes = closed_holds(hand, rock, surface, trials, seat, placing=placing)
    spaces = iter(wrench_spaces([each for each in outcomes if isinstance(each, SettledHand)]))
    found: list[FoundHold | InvalidInputError] = []
    directions = force_directions()
    for trial, outcome in zip(trials, outcomes, strict=True):
        if isinstance(outcome, InvalidInputError):
            found.append(outcome)
            continue
        space = next(spaces)
        support = pure = np.full(len(TRIAL_WAYS), math.nan)
        try:
            support = np.array([space.support(way) for way in directions])
            pure = pure_reaches(space, directions)
        except EmptySetError:
            pass
        seating = outcome.seating
        made = FoundHold(seating.pose.inverse(), seating.rule, seating.backed_off, support, pure)
        if samples:
            robust = robustness(
                hand,
                outcome,
                directions,
                samples,
                at=_approach(trial) if seat == "rest" else None,
                pure=directions,
                force=force,
            )
            made = made._replace(robust=robust)
        found.append(made)
    return found


def ranked_holds(
    found: Sequence[FoundHold | InvalidInputError], by: HoldRank = "robust", way: str = "-fz"
) -> list[int]:
    """Return the indices of places where a hand holds something in any way, the best first.

    Parameters
    ----------
    found : sequence of FoundHold or InvalidInputError
        Results of `try_holds`.
    by : {'robust', 'share', 'pure', 'support'}, optional
        Figure by which places are ranked: ``robust``, the pure force that nine in ten samples have;
        ``share``, the share of samples that hold the wanted force; ``pure`` and ``support``, as in
        `FoundHold`. Ties are broken by the others, in this order. A pure force below zero, or none,
        counts as zero. A place without samples comes after those with.
    way : str, optional
        Direction of the force: one of `TRIAL_WAYS`.
    """
    if by not in HOLD_RANKS:
        raise InvalidInputError(f"must be one of {', '.join(HOLD_RANKS)}, got {by!r}", field="by")
    if way not in TRIAL_WAYS:
        raise InvalidInputError(f"must be one of {', '.join(TRIAL_WAYS)}, got {way!r}", field="way")
    k, ranks = list(TRIAL_WAYS).index(way), []
    for i, each in enumerate(found):
        if isinstance(each, InvalidInputError) or not each.support.max() >= FORCE_TOLERANCE:
            continue
        robust = each.robust
        values = {
            "robust": -math.inf if robust is None else float(robust.pure_tenth[k]),
            "share": -math.inf if robust is None else float(robust.share[k]),
            "pure": float(np.fmax(each.pure[k], 0.0)),
            "support": float(each.support[k]),
        }
        order = values.pop(by), *values.values()
        ranks.append(([-value for value in order], i))
    return [i for _, i in sorted(ranks)]
