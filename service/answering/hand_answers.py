"""From the planner's arrays to the plain numbers of replies, and the hands of these."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from msgspec import UNSET, UnsetType

from hand_models.base import Array, Pose
from hand_models.hand import Seating
from hand_models.wrench_spaces import WrenchSpace
from planner import HandPlan, Stance, WristPlan
from service import replies

__all__ = [
    "finite",
    "hand_reply",
    "listed",
    "listed_by_limb",
    "placed_poses",
    "seating_reply",
    "wrench_set_reply",
    "wrist_reply",
]


def finite(value: float | None) -> float | None:
    """Return a number as it travels; None where it is infinite, or there is none."""
    return float(value) if value is not None and math.isfinite(value) else None


def listed(array: Array | None) -> replies.Vector | None:
    """Return an array as a list, if there is one."""
    return None if array is None else array.tolist()


def listed_by_limb(arrays: Mapping[str, Array] | None) -> dict[str, replies.Vector] | None:
    """Return arrays by limb as lists, if there are any."""
    return None if arrays is None else {limb: array.tolist() for limb, array in arrays.items()}


def hand_reply(part: HandPlan, model: bool) -> replies.Hand:
    """Return a hand of a plan as a reply has it, with its wrench space if ``model``."""
    palm = part.palm
    return replies.Hand(
        limb=part.limb,
        wrench=part.wrench.tolist(),
        fingers=part.finger_by_finger(model=model),
        palm=replies.Palm(
            position=palm.position.tolist(),
            force=palm.force.tolist(),
            moment=palm.moment.tolist(),
            engaged=list(palm.engaged),
            utilisation=float(palm.utilisation),
        ),
        utilisation=float(part.utilisation),
        seating=seating_reply(part.seating),
        wrist=wrist_reply(part.wrist),
        wrench_space=wrench_set_reply(part.space) if model else UNSET,
    )


def wrist_reply(wrist: WristPlan | None) -> replies.Wrist:
    """Return how a wrist is; none for one that is fixed."""
    if wrist is None:
        return replies.Wrist(mode="fixed")
    return replies.Wrist(
        mode="floating",
        twist=wrist.twist.tolist(),
        palm=wrist.palm,
        rounds=wrist.rounds,
        error=finite(wrist.error),
    )


def placed_poses(stance: Stance) -> dict[str, replies.PlacedFrame] | UnsetType:
    """Return H in W of the hands that were given by a place on a rock; unset if there is none."""
    poses = {hand.limb: _frame(hand.pose) for hand in stance.hands if hand.at is not None}
    return poses or UNSET


def _frame(pose: Pose) -> replies.PlacedFrame:
    return replies.PlacedFrame(pose.position.tolist(), pose.quaternion().tolist())


def seating_reply(seating: Seating) -> replies.Seating:
    """Return where a hold is in H."""
    return replies.Seating(
        rule=seating.rule, pose=_frame(seating.pose), backed_off=float(seating.backed_off)
    )


def wrench_set_reply(space: WrenchSpace) -> replies.WrenchSet:
    """Return the generators and named rows of a wrench space."""
    numbers = (
        np.vstack([space.L, space.H]),
        np.concatenate([space.l0, np.zeros(len(space.h))]),
        np.concatenate([space.s, space.h]),
    )
    return replies.WrenchSet(
        origin=space.origin.tolist(),
        generators=[
            replies.Generator(name, column)
            for name, column in zip(space.columns, space.generators.T.tolist(), strict=True)
        ],
        rows=[
            replies.Row(
                name=row.label,
                kind=row.kind,
                finger=row.finger,
                phalanx=row.phalanx,
                limit=row.limit,
                joint=row.joint,
                coefficients=coefficients,
                constant=constant,
                capacity=capacity,
            )
            for row, coefficients, constant, capacity in zip(
                space.rows, *(array.tolist() for array in numbers), strict=True
            )
        ],
    )
