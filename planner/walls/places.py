"""Placements on a rock: hands closed at the points of a grid, and the best at each point."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import (
    Array,
    EmptySetError,
    InvalidInputError,
    Pose,
    RefusedPlaceError,
    UnsupportedError,
)
from hand_models.fixed_wrist import (
    HoldTrial,
    closed_holds,
    grid_of_trials,
    trials_at,
    wrench_spaces,
)
from hand_models.hand import Grasp, SpinyHand
from hand_models.rock import Mesh
from hand_models.tile import Surface
from hand_models.wrench_spaces import ends_along
from planner.question import HandOnHold
from planner.screening import HandParts
from planner.walls.grids import PlaceGrid

__all__ = ["HandPlace", "best_places", "hand_at", "palms_apart", "place_trials"]


def place_trials(
    grid: PlaceGrid, rock: Mesh, hand: SpinyHand, more: Sequence[tuple[float, float]] = ()
) -> list[list[HoldTrial]]:
    """Return the hands that are tried at each point of a grid on a rock, then at further points.

    Parameters
    ----------
    grid : PlaceGrid
    rock : Mesh
    hand : SpinyHand
    more : sequence of (float, float)
        Further points along x and y of the rock's frame [m].

    Raises
    ------
    InvalidInputError
        If no point of the grid is on rock that faces −z of its frame.
    """
    radius = 0.5 * hand.table.scalar("palm", "length")
    every = grid_of_trials(rock, grid.spacing, grid.angles, grid.rotations, radius=radius)
    if not every:
        raise InvalidInputError(
            "no grid point is on rock that faces −z of its frame; is the mesh flipped, or "
            "smaller than the spacing?",
            field="spacing",
        )
    if more:
        above = float(rock.triangles.vertices[:, 2].min()) - grid.spacing
        points = np.array(more), grid.angles, grid.rotations, None
        every += trials_at(rock, *points, above, radius)
    return [list(there) for _, there in groupby(every, lambda trial: trial.point)]


class HandPlace(NamedTuple):
    """A hand that was closed at a place of a rock, with its set.

    Attributes
    ----------
    rock_in_hand : Pose
        The rock's frame in H, as the hand was closed.
    outer_rotation : float
        Rotation of its outer fingers [rad].
    lift : float
        Largest force straight against gravity that the rock exerts on the robot by this hand,
        whatever moments come with it [N].
    parts : HandParts
    """

    rock_in_hand: Pose
    outer_rotation: float
    lift: float
    parts: HandParts


def best_places(
    hand: SpinyHand,
    rock: Mesh,
    surface: Surface,
    points: Sequence[Sequence[HoldTrial]],
    up: Array,
    kept: int,
) -> tuple[list[HandPlace], Counter[str]]:
    """Close hands at points of a rock, and return those that lift most at each.

    Parameters
    ----------
    hand : SpinyHand
    rock : Mesh
    surface : Surface
    points : sequence of sequence of HoldTrial
        Hands to try at each point.
    up : ndarray, shape (3,)
        Direction against gravity, in the rock's frame.
    kept : int
        Hands that are kept at each point at most; of equal ones the first.

    Returns
    -------
    places : list of HandPlace
        Point by point, the best first. Hands that lift nothing are left out.
    refused : Counter of str
        Number of the others by reason: that of a `RefusedPlaceError`, ``other``,
        ``holds_nothing``, or ``unbounded`` without bounds of a part's own.
    """
    outcomes = closed_holds(hand, rock, surface, [trial for each in points for trial in each])
    spaces = iter(wrench_spaces([o for o in outcomes if not isinstance(o, InvalidInputError)]))
    found, refused = list[HandPlace](), Counter[str]()
    rest = iter(outcomes)
    down = -up / np.linalg.norm(up)
    for trials in points:
        here = list[HandPlace]()
        for trial in trials:
            outcome = next(rest)
            if isinstance(outcome, InvalidInputError):
                reason = outcome.reason if isinstance(outcome, RefusedPlaceError) else "other"
                refused[reason] += 1
                continue
            try:
                space = next(spaces)
                parts = HandParts.of(space)
            except EmptySetError:
                refused["holds_nothing"] += 1
                continue
            except UnsupportedError:
                refused["unbounded"] += 1
                continue
            at = outcome.seating.pose
            # of the hand on the rock, in H
            way = at.rotation @ down
            ends = ends_along(way, space.origin[:3], space.generators[:3], space.A, space.b)
            lift = 0.0 if ends is None else ends[1]
            if lift > 0.0:
                here.append(HandPlace(at, trial.outer_rotation, lift, parts))
            else:
                refused["holds_nothing"] += 1
        best = sorted(here, key=lambda place: -place.lift)[:kept]
        refused["less_lift"] += len(here) - len(best)
        found += best
    return found, +refused


def hand_at(
    place: HandPlace, rock: Mesh, rock_pose: Pose, surface: Surface, limb: str
) -> HandOnHold:
    """Return a placement as a hand of a stance, with its pose given: it is not seated again.

    Parameters
    ----------
    place : HandPlace
    rock : Mesh
    rock_pose : Pose
        The rock's frame in the world frame W.
    surface : Surface
    limb : str
        Limb that has the hand; any of the robot may, as all have the same hand.
    """
    return HandOnHold(
        limb=limb,
        pose=rock_pose @ place.rock_in_hand.inverse(),
        hold=rock,
        surface=surface,
        hold_in_hand=place.rock_in_hand,
        grasp=Grasp(place.outer_rotation),
    )


def palms_apart(hands: Sequence[HandOnHold], least: float) -> NDArray[np.bool_]:
    """Return which hands may be on the rock together, shape (P, P): palms so far apart [m]."""
    places = np.array([hand.pose.position for hand in hands]).reshape(-1, 3)
    distances = np.linalg.norm(places[:, None] - places, axis=2)
    return np.asarray(distances >= least)
