"""Hands at points of a rock that stands still."""

from __future__ import annotations

import math
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import InvalidInputError, Pose, finite_vector, turns_about
from hand_models.fixed_wrist.seat_search import PULL_OFF, best_seats
from hand_models.hand import Grasp, Placement, SettledHand, SpinyHand, spiny_hand
from hand_models.rock import Hold
from hand_models.tile import Surface

__all__ = ["ALONG_FINGERS", "SEAT_RULES", "SeatRule", "approach_frame", "place"]

ALONG_FINGERS: Final = (1.0, 0.0, 0.0)
"""Direction along the fingers of a hand that is seated at a rock's origin, in the rock's frame."""

SeatRule = Literal["rest", "best"]

SEAT_RULES: Final = get_args(SeatRule)
"""How a hand is seated: as its grasp would have it, or near there where it holds most."""


def approach_frame(
    point: ArrayLike, approach: ArrayLike, wrist_angle: float = 0.0, up: ArrayLike = ALONG_FINGERS
) -> Pose:
    """Return the frame of a point that a hand approaches.

    Parameters
    ----------
    point : array_like, shape (3,)
        On the rock [m].
    approach : array_like, shape (3,)
        z of the frame, into the rock, of any length.
    wrist_angle : float, optional
        By which the frame is turned about z from where its x is nearest to ``up`` [rad].
    up : array_like, shape (3,), optional
        Of any length; all in one frame.

    Raises
    ------
    InvalidInputError
        If numbers are not finite, a direction is zero, or the approach is along ``up``.
    """
    z, above = (
        finite_vector(value, 3, field) for value, field in ((approach, "approach"), (up, "up"))
    )
    for value, field in ((z, "approach"), (above, "up")):
        if not value.any():
            raise InvalidInputError("must not be zero", field=field)
    if not np.isfinite(wrist_angle):
        raise InvalidInputError(f"must be finite, got {wrist_angle}", field="wrist_angle")
    z, above = (value / np.abs(value).max() for value in (z, above))
    z, above = z / np.linalg.norm(z), above / np.linalg.norm(above)
    across = np.cross(z, above)
    if np.linalg.norm(across) < 1e-6:  # sine of the angle between them
        raise InvalidInputError(
            f"is parallel to up, {above.tolist()}, which leaves wrist_angle undefined: give "
            "another up",
            field="approach",
        )
    y = across / np.linalg.norm(across)
    axes = np.column_stack([np.cross(y, z), y, z])
    turn = turns_about([0.0, 0.0, math.remainder(wrist_angle, math.tau)])
    return Pose(finite_vector(point, 3, "point"), axes @ turn)


def place(
    rock: Hold,
    point: ArrayLike,
    approach: ArrayLike,
    wrist_angle: float = 0.0,
    grasp: Grasp | None = None,
    surface: Surface | None = None,
    *,
    up: ArrayLike = ALONG_FINGERS,
    seat: SeatRule = "rest",
    direction: ArrayLike = PULL_OFF,
    hand: SpinyHand | None = None,
) -> SettledHand:
    """Seat a hand at a point of a rock, and close it.

    The hand is seated as on a hold whose frame is that of `approach_frame`: the crest of a pinch,
    and where the palm is looked for a place, are at the point; along the approach the palm rests
    where the rock is.

    Parameters
    ----------
    rock : Hold
    point, approach, wrist_angle, up
        As of `approach_frame`, in the rock's frame.
    grasp : Grasp, optional
    surface : Surface, optional
        The preset ``rock`` by default.
    seat : {'rest', 'best'}, optional
        As its grasp would have it, or near there where it holds most in a direction.
    direction : array_like, shape (6,), optional
        As of `best_seats`.
    hand : SpinyHand, optional
        The bundled one by default.

    Returns
    -------
    SettledHand
        ``seating.pose.inverse()`` is H in the rock's frame.

    Raises
    ------
    InvalidInputError
        If a number is impossible, or the hand cannot be there.
    """
    if seat not in SEAT_RULES:
        raise InvalidInputError(
            f"unknown seat {seat!r}; known are {', '.join(SEAT_RULES)}", field="seat"
        )
    at = approach_frame(point, approach, wrist_angle, up)
    rock.check_place(at)
    kind = hand or spiny_hand()
    placement = Placement(rock, surface or Surface.named("rock"), grasp or Grasp(), None, at)
    if seat == "best":
        (found,) = best_seats(kind, [placement], direction)
    else:
        (found,) = kind.settle_each([placement])
    if isinstance(found, InvalidInputError):
        raise found
    return found
