"""From the planner's numbers to plain ones, and the hands of replies that are made of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np
from msgspec import UNSET, Struct, UnsetType

from hand_models.base import Pose
from hand_models.hand import Seating
from hand_models.wrench_spaces import WrenchSpace
from planner import HandPlan, Stance, WristPlan
from service import replies

__all__ = [
    "hand_reply",
    "placed_poses",
    "plain",
    "seating_reply",
    "told",
    "wrench_set_reply",
    "wrist_reply",
]

S = TypeVar("S", bound=Struct)


def told(kind: type[S], source: object, **own: object) -> S:
    """Return a message with an object's attributes, plain, as its fields, but for fields given."""
    names = (name for name in kind.__struct_fields__ if name not in own and hasattr(source, name))
    return kind(**{name: plain(getattr(source, name)) for name in names}, **own)


def plain(value: Any) -> Any:
    """Return a value as it travels: arrays and tuples as lists, without numbers of numpy's.

    What is infinite does not exist.
    """
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, (tuple, list)):
        return [plain(each) for each in value]
    if isinstance(value, Mapping):
        return {name: plain(each) for name, each in value.items()}
    return value


def hand_reply(part: HandPlan, model: bool) -> replies.Hand:
    """Return a hand of a plan as a reply has it, with its wrench space if ``model``."""
    return told(
        replies.Hand,
        part,
        fingers=part.finger_by_finger(model=model),
        palm=told(replies.Palm, part.palm),
        seating=seating_reply(part.seating),
        wrist=wrist_reply(part.wrist),
        wrench_space=wrench_set_reply(part.space) if model else UNSET,
    )


def wrist_reply(wrist: WristPlan | None) -> replies.Wrist:
    """Return how a wrist is; none for one that is fixed."""
    return told(replies.Wrist, wrist, mode="fixed" if wrist is None else "floating")


def placed_poses(stance: Stance) -> dict[str, replies.PlacedFrame] | UnsetType:
    """Return H in W of the hands that were given by a place on a rock; unset if there is none."""
    poses = {hand.limb: _frame(hand.pose) for hand in stance.hands if hand.at is not None}
    return poses or UNSET


def _frame(pose: Pose) -> replies.PlacedFrame:
    return replies.PlacedFrame(plain(pose.position), plain(pose.quaternion()))


def seating_reply(seating: Seating) -> replies.Seating:
    """Return where a hold is in H."""
    return told(replies.Seating, seating, pose=_frame(seating.pose))


def wrench_set_reply(space: WrenchSpace) -> replies.WrenchSet:
    """Return the generators and named rows of a wrench space."""
    numbers = (
        np.vstack([space.L, space.H]),
        np.concatenate([space.l0, np.zeros(len(space.h))]),
        np.concatenate([space.s, space.h]),
    )
    return replies.WrenchSet(
        origin=plain(space.origin),
        generators=[
            replies.Generator(name, column)
            for name, column in zip(space.columns, space.generators.T.tolist(), strict=True)
        ],
        rows=[
            # there are hundreds: not by name, which takes ten times as long
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
