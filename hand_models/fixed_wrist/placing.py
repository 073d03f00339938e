"""Place hands at points of a rock that does not move."""

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
"""Rules for a hand's seat: 'rest' as its grasp seats it, 'best' near there where it holds most."""


def approach_frame(
    point: ArrayLike, approach: ArrayLike, wrist_angle: float = 0.0, up: ArrayLike = ALONG_FINGERS
) -> Pose:
    """Return the frame of a hand's approach to a point: z into the rock, x toward ``up``.

    Parameters
    ----------
    point : array_like, shape (3,)
        Origin of the frame, on the rock [m].
    approach : array_like, shape (3,)
        Direction of z, into the rock, of any length.
    wrist_angle : float, optional
        Turn of the frame about z; at 0, x is as near to ``up`` as can be [rad].
    up : array_like, shape (3,), optional
        Direction of any length, in the same frame as point and approach.

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
            raise InvalidInputError(
                "must be a direction, not zero: give one such as [0, 0, 1]", field=field
            )
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
    """Seat a hand at a point of a rock, and close its fingers.

    The hand is seated as on a hold whose frame is `approach_frame` of the point: the crest of a
    pinch is at the point, the search for a palm's place begins there, and along the approach the
    palm rests on the rock.

    Parameters
    ----------
    rock : Hold
    point : array_like, shape (3,)
        Place on the rock, in its frame [m].
    approach : array_like, shape (3,)
        Direction into the rock, of any length, in the rock's frame.
    wrist_angle : float, optional
        Turn of the hand about the approach; at 0, x is as near to ``up`` as can be [rad].
    grasp : Grasp, optional
    surface : Surface, optional
        The preset ``rock`` by default.
    up : array_like, shape (3,), optional
        Direction of any length, in the rock's frame.
    seat : {'rest', 'best'}, optional
        'rest' as the grasp seats the hand; 'best' near there where it holds most in a direction.
    direction : array_like, shape (6,), optional
        Direction of the wrench on the rock, in H, for 'best'; the pull-off by default.
    hand : SpinyHand, optional
        The bundled one by default.

    Returns
    -------
    SettledHand
        ``seating.pose.inverse()`` is H in the rock's frame.

    Raises
    ------
    InvalidInputError
        If a number is not possible, or the hand cannot be there.
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
