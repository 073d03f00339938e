"""Hands in replies: who carries what in each finger, where the hold is, and its wrench space."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from msgspec import UNSET, UnsetType

from hand_models.base import Array, Pose
from hand_models.hand import FINGERS, Seating
from hand_models.tile import HalfPlane
from hand_models.wrench_spaces import WrenchSpace
from planner.question import Stance
from planner.result import HandPlan, WristPlan
from service import replies

__all__ = [
    "hand_reply",
    "placed_poses",
    "seating_reply",
    "vector",
    "vectors",
    "wrench_set_reply",
    "wrist_reply",
]


def hand_reply(part: HandPlan, model: bool) -> replies.Hand:
    """Return a hand of a plan as a reply has it, with its wrench space if ``model``."""
    palm = part.palm
    return replies.Hand(
        limb=part.limb,
        wrench=vector(part.wrench),
        fingers=_fingers(part, model),
        palm=replies.Palm(
            position=vector(palm.position),
            force=vector(palm.force),
            moment=vector(palm.moment),
            engaged=[int(tile) for tile in palm.engaged],
            utilisation=float(palm.utilisation),
        ),
        utilisation=float(part.utilisation),
        seating=seating_reply(part.seating),
        wrist=wrist_reply(part.wrist),
        wrench_space=wrench_set_reply(part.space) if model else UNSET,
    )


def _fingers(part: HandPlan, model: bool) -> list[replies.Finger]:
    """Return a hand's fingers, from its arrays as a whole."""
    numbers = (part.loads, part.positions, part.forces, part.axes, part.tile_utilisations)
    columns = zip(part.tiles, *(array.tolist() for array in numbers), strict=True)
    tiles: dict[str, list[replies.Tile]] = {name: [] for name in FINGERS}
    for (finger, phalanx, contact), load, position, force, axes, used in columns:
        tiles[finger].append(
            replies.Tile(
                phalanx=phalanx,
                contact=contact,
                position=position,
                force=force,
                shear=load[0],
                normal=load[1],
                lateral=load[2],
                shear_axis=axes[0],
                normal_axis=axes[1],
                lateral_axis=axes[2],
                utilisation=used,
            )
        )
    if model:
        _add_models(part, [tile for own in tiles.values() for tile in own])
    drives = zip(FINGERS, part.closures, part.tensions.tolist(), *part.drives.tolist(), strict=True)
    return [
        replies.Finger(
            name=name,
            closure=closure,
            tendon_tension=tension,
            motor_torque=torque,
            motor_current=current,
            winch_angle=angle,
            tiles=tiles[name],
        )
        for name, closure, tension, torque, current, angle in drives
    ]


def _add_models(part: HandPlan, tiles: Sequence[replies.Tile]) -> None:
    """Give tiles, in their hand's order, their load laws and half-planes."""
    laws = None if part.laws is None else part.laws.transpose(0, 2, 1).tolist()
    for t, tile in enumerate(tiles):
        if laws is not None:
            tile.load_at_zero, tile.load_per_newton = laws[t]
        tile.half_planes = [row for plane in part.limits_of(t) for row in _both_signs(plane)]


def wrist_reply(wrist: WristPlan | None) -> replies.Wrist:
    """Return how a wrist is; none for one that is fixed."""
    if wrist is None:
        return replies.Wrist(mode="fixed")
    return replies.Wrist(
        mode="floating",
        twist=vector(wrist.twist),
        palm=wrist.palm,
        rounds=wrist.rounds,
        error=float(wrist.error),
    )


def _both_signs(plane: HalfPlane) -> list[list[float]]:
    """Return ``a · (shear, normal, lateral) ≤ capacity`` for a lateral load of either sign."""
    signs = (1.0, -1.0) if plane.a_lateral > 0.0 else (1.0,)
    return [
        [plane.a_shear, plane.a_normal, sign * plane.a_lateral, plane.capacity] for sign in signs
    ]


def placed_poses(stance: Stance) -> dict[str, replies.PlacedFrame] | UnsetType:
    """Return H in W of the hands that were given by a place on a rock; unset if there is none."""
    poses = {hand.limb: _frame(hand.pose) for hand in stance.hands if hand.at is not None}
    return poses or UNSET


def _frame(pose: Pose) -> replies.PlacedFrame:
    return replies.PlacedFrame(vector(pose.position), vector(pose.quaternion()))


def seating_reply(seating: Seating) -> replies.Seating:
    """Return where a hold is in H."""
    return replies.Seating(seating.rule, _frame(seating.pose), seating.backed_off)


def wrench_set_reply(space: WrenchSpace) -> replies.WrenchSet:
    """Return the generators and named rows of a wrench space."""
    numbers = (
        np.vstack([space.L, space.H]),
        np.concatenate([space.l0, np.zeros(len(space.h))]),
        np.concatenate([space.s, space.h]),
    )
    return replies.WrenchSet(
        origin=vector(space.origin),
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


def vector(values: Array) -> list[float]:
    """Return an array as it travels."""
    return np.asarray(values, dtype=float).tolist()  # type: ignore[no-any-return]


def vectors(values: Array) -> list[list[float]]:
    """Return rows as plain numbers."""
    return np.asarray(values, dtype=float).tolist()  # type: ignore[no-any-return]
