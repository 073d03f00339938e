"""Find where on a scan a hand can hold, and how much: a hand is closed at each of many places."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import (
    Array,
    EmptySetError,
    InvalidInputError,
    LimitError,
    Pose,
    Progress,
    check_positive,
)
from hand_models.finger import CONTACT_KINDS
from hand_models.fixed_wrist.placing import ALONG_FINGERS, approach_frame
from hand_models.fixed_wrist.seat_scatter import robustness
from hand_models.fixed_wrist.seat_search import best_seats
from hand_models.fixed_wrist.space import wrench_spaces
from hand_models.hand import FINGERS, Grasp, Placement, SettledHand, SpinyHand
from hand_models.rock import Mesh
from hand_models.tile import Surface

__all__ = ["AT_BORDER", "TRIAL_WAYS", "FoundHold", "HoldTrial", "grid_of_trials", "try_holds"]

AT_BORDER: Final = "the scan ends, or has a hole, within a finger's reach"
"""Why a hand is not asked for there."""

TRIAL_WAYS: Final = {"-fz": 2, "-fx": 0, "+fx": 0, "-fy": 1, "+fy": 1}
"""Wrenches on the rock, in H: the pull-off, and shear to all sides; and their axes."""


class HoldTrial(NamedTuple):
    """A hand that may be at a point of a rock; all in the rock's frame.

    Attributes
    ----------
    point, approach : tuple of float
        On the rock [m], and into it.
    wrist_angle, outer_rotation : float
        As of `approach_frame` and `Grasp` [rad].
    """

    point: tuple[float, float, float]
    approach: tuple[float, float, float]
    wrist_angle: float
    outer_rotation: float


class FoundHold(NamedTuple):
    """Seat of a hand at a place, and what it can hold there.

    Attributes
    ----------
    pose : Pose
        H in the rock's frame.
    rule : str
    backed_off : float
        Distance that its seating backed off [m].
    support : ndarray, shape (5,)
        Reach in each of `TRIAL_WAYS`, with whatever else [N]; NaN if it holds nothing.
    pure : float
        Reach in pull-off with every other component zero [N]; NaN if nowhere.
    worst, tenth, hundredth : ndarray, shape (5,), or None
        As of `Robustness`.
    """

    pose: Pose
    rule: str
    backed_off: float
    support: Array
    pure: float
    worst: Array | None = None
    tenth: Array | None = None
    hundredth: Array | None = None


def grid_of_trials(
    rock: Mesh,
    spacing: float,
    angles: int,
    rotations: Sequence[float] = (0.0,),
    approach: tuple[float, float, float] | None = None,
    *,
    radius: float,
    most: int | None = None,
    report: Progress | None = None,
) -> list[HoldTrial]:
    """Return places on a grid across z of a rock's frame.

    Parameters
    ----------
    rock : Mesh
    spacing : float
        Of the grid [m].
    angles : int
        Of the wrist, evenly over a whole turn.
    rotations : sequence of float, optional
        Of the outer fingers [rad].
    approach : tuple of float, optional
        Of all hands; by default across the mean plane of the rock about the point.
    radius : float
        Half the side of the square about a point in which that is found [m].
    most : int, optional
        Places that there may be, before it is known which of them are on rock.
    report : callable, optional
        Called with (points done, points in all).

    Raises
    ------
    InvalidInputError
        If a number is impossible; a `LimitError` if there would be more than ``most``.
    """
    if not 1e-3 <= spacing < math.inf:
        raise InvalidInputError(f"must be at least 0.001 m, got {spacing:g}", field="spacing")
    check_positive(radius, "m", "radius")
    if angles < 1:
        raise InvalidInputError(f"at least one is needed, got {angles}", field="angles")
    low, high = (end(rock.triangles.vertices, axis=0) for end in (np.min, np.max))
    above = float(low[2]) - spacing
    # five rays along each side of the square in which the plane of the rock is found
    beside = np.stack(np.meshgrid(*[np.linspace(-radius, radius, 5)] * 2), axis=-1)
    each_way = [math.floor((b - a) / spacing) + 1 for a, b in zip(low[:2], high[:2], strict=True)]
    count = math.prod(each_way) * angles * len(rotations)
    if most is not None and count > most:
        raise LimitError(
            f"{spacing:g} m makes up to {count:,} places to try (a grid of {each_way[0]:,} by "
            f"{each_way[1]:,} points, {angles * len(rotations)} at each); the maximum is "
            f"{most:,}: use a wider spacing",
            field="spacing",
        )
    # in the middle of what is left over
    sides = [
        a + 0.5 * ((b - a) % spacing) + spacing * np.arange(number)
        for a, b, number in zip(low[:2], high[:2], each_way, strict=True)
    ]
    found: list[HoldTrial] = []
    into = (0.0, 0.0, 1.0)  # z of a rock's frame
    points = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 2).tolist()
    for number, (x, y) in enumerate(points):
        if report is not None:
            report(number, len(points))
        depth = rock.entry((x, y, above), into)
        if not math.isfinite(depth):
            continue
        point = x, y, above + depth
        toward = approach
        if toward is None:
            around = beside.reshape(-1, 2) + np.array([x, y])
            depths = np.array([rock.entry((*each, above), into) for each in around.tolist()])
            met = np.isfinite(depths)
            plane = np.column_stack([around[met], np.ones(met.sum())])
            slope = np.linalg.lstsq(plane, depths[met])[0]
            size = math.hypot(slope[0], slope[1], 1.0)
            toward = -float(slope[0]) / size, -float(slope[1]) / size, 1.0 / size
        found += [
            HoldTrial(point, toward, math.tau * k / angles, rotation)
            for k in range(angles)
            for rotation in rotations
        ]
    return found


def _at_border(hand: SpinyHand, settled: SettledHand) -> bool:
    """Return True if a scan ends within a finger's reach, or has no rock at all for one."""
    if min(settled.rock_ends) < hand.finger.reach:
        return True
    off = (settled.postures.kinds == CONTACT_KINDS.index("none")).all(axis=1)
    at = settled.hold, settled.grasp, settled.seating.pose
    return bool(len(settled.hold.border)) and any(
        hand.section(name, *at) is None for name in np.array(FINGERS)[off].tolist()
    )


def try_holds(
    hand: SpinyHand,
    rock: Mesh,
    surface: Surface,
    trials: Sequence[HoldTrial],
    seat: str = "rest",
    *,
    robust: bool = False,
) -> list[FoundHold | InvalidInputError]:
    """Close hands at places, all at once, and return what they hold.

    Parameters
    ----------
    hand : SpinyHand
    rock : Mesh
    surface : Surface
    trials : sequence of HoldTrial
    seat : {'rest', 'best'}, optional
    robust : bool, optional
        Whether also what is left of it over a scatter of each place.

    Returns
    -------
    list of FoundHold or InvalidInputError
        In order; why a hand cannot be there in place of one that cannot. Where the scan ends within
        a finger's reach that is one, too: the finger would take the scan's border for an edge.
    """
    placements = [
        Placement(
            rock,
            surface,
            Grasp(each.outer_rotation),
            None,
            approach_frame(each.point, each.approach, each.wrist_angle, ALONG_FINGERS),
        )
        for each in trials
    ]
    outcomes = best_seats(hand, placements) if seat == "best" else hand.settle_each(placements)
    spaces = iter(wrench_spaces([each for each in outcomes if isinstance(each, SettledHand)]))
    found: list[FoundHold | InvalidInputError] = []
    axes = np.eye(6)[list(TRIAL_WAYS.values())]
    directions = axes * [[1.0 if way[0] == "+" else -1.0] for way in TRIAL_WAYS]
    for outcome in outcomes:
        if isinstance(outcome, InvalidInputError):
            found.append(outcome)
            continue
        space = next(spaces)
        if _at_border(hand, outcome):
            found.append(InvalidInputError(AT_BORDER, field="place.point"))
            continue
        support, pure = np.full(len(TRIAL_WAYS), math.nan), math.nan
        try:
            support = np.array([space.support(way) for way in directions])
            ends = space.capability(directions[0])
            pure = math.nan if ends is None else ends[1]
        except EmptySetError:
            pass
        seating = outcome.seating
        made = FoundHold(seating.pose.inverse(), seating.rule, seating.backed_off, support, pure)
        if robust:
            left = robustness(hand, outcome, directions)
            made = made._replace(worst=left.worst, tenth=left.tenth, hundredth=left.hundredth)
        found.append(made)
    return found
