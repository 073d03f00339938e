"""From the planner's answer to a reply: plain numbers, every name spelled out."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Final

import numpy as np
from msgspec import UNSET

from hand_models.base import Array
from hand_models.finger import PHALANGES
from hand_models.fixed_wrist import Robustness, TensionLimit
from hand_models.hand import FINGERS, NearbyClosure, SettledHand, Tile, closing_sequence
from hand_models.wrench_spaces import WrenchSpace
from planner.result import LimitName, Plan, Price, TensionPath, WristPlan
from service import replies
from service.answering.hand_answers import (
    hand_reply,
    seating_reply,
    vector,
    wrench_set_reply,
    wrist_reply,
)
from service.answering.set_views import SetViews
from service.replies import AXES

__all__ = [
    "BOTH_WAYS",
    "limbs_reply",
    "limit_reply",
    "number",
    "plan_reply",
    "wrench_space_reply",
]

SIDES: Final = tuple(f"{sign}{axis}" for sign in "+-" for axis in AXES)
"""Names of both directions along each axis, in the order of `BOTH_WAYS`."""

BOTH_WAYS: Final = np.vstack([np.eye(len(AXES)), -np.eye(len(AXES))])


def plan_reply(answer: Plan, identifier: str | None, *, model: bool) -> replies.PlanReply:
    """Return a plan as a reply.

    Parameters
    ----------
    answer : Plan
    identifier : str or None
        The request's, echoed.
    model : bool
        Whether tiles carry their load laws and hands their wrench spaces.
    """
    return replies.PlanReply(
        id=identifier,
        status=answer.status,
        reason=answer.reason,
        warnings=list(answer.warnings),
        unfinished=list(answer.unfinished),
        body_wrench=vector(answer.body_wrench),
        utilisation=number(answer.utilisation),
        effort=number(answer.effort),
        load_factor=number(answer.load_factor),
        load_factor_unbounded=answer.load_factor_unbounded,
        limiting=None if answer.limiting is None else limit_reply(answer.limiting),
        hands=None if answer.hands is None else [hand_reply(h, model) for h in answer.hands],
        joints=limbs_reply(answer.joints),
        joint_torque=limbs_reply(answer.joint_torque),
        joint_torque_limit=limbs_reply(answer.joint_torque_limit),
        prices=_prices(answer.prices),
        effort_prices=_prices(answer.effort_prices),
        certificate=_certificate(answer, model),
        residual=None if answer.residual is None else vector(answer.residual),
        path=None if answer.path is None else _path(answer.path),
        verified=answer.verified,
        solver=replies.Solver(
            answer.solver.name, answer.solver.status, int(answer.solver.iterations)
        ),
        time=replies.Time(answer.time.model, answer.time.solve, answer.time.total),
        robust=UNSET
        if answer.robust is None
        else replies.RobustLoadFactor(**answer.robust._asdict()),
    )


def wrench_space_reply(
    robot: str,
    limb: str,
    settled: SettledHand,
    space: WrenchSpace,
    views: SetViews,
    limits: Iterable[TensionLimit],
    nearby: Iterable[NearbyClosure],
    wrist: WristPlan | None = None,
    robust: Robustness | None = None,
) -> replies.WrenchSpaceReply:
    """Return one hand's wrench space as a reply, with its views at utilisation 1."""
    parts = wrench_set_reply(space)
    return replies.WrenchSpaceReply(
        robot=robot,
        limb=limb,
        wrist=wrist_reply(wrist),
        seating=seating_reply(settled.seating),
        contacts=[
            replies.Contact(
                finger=tile.finger,
                phalanx=tile.phalanx,
                contact=tile.contact,
                stop=_stop(settled, tile),
                position=vector(position),
                shear_axis=vector(axes[0]),
                normal_axis=vector(axes[1]),
                lateral_axis=vector(axes[2]),
            )
            for tile, position, axes in zip(
                settled.tiles, settled.positions, settled.axes, strict=True
            )
        ],
        closing=[
            replies.ClosingSequence(
                closing.finger,
                [replies.ClosingStage(*stage) for stage in closing.stages],
                closing.in_order,
                closing.closure,
                list(there.closures),
                there.turn,
            )
            for closing, there in zip(closing_sequence(settled), nearby, strict=True)
        ],
        tension_limits=[
            replies.TensionLimit(limit.finger, number(limit.tension), limit.phalanx)
            for limit in limits
        ],
        origin=parts.origin,
        generators=parts.generators,
        rows=parts.rows,
        robust=UNSET if robust is None else _robust(robust),
        **views._asdict(),
    )


def _robust(found: Robustness) -> replies.RobustCapability:
    worst, tenth = (
        dict(zip(SIDES, map(number, reach.tolist()), strict=True))
        for reach in (found.worst, found.tenth)
    )
    numbers = found._asdict() | {"worst": worst, "tenth": tenth}
    return replies.RobustCapability(**numbers)


def _stop(settled: SettledHand, tile: Tile) -> str | None:
    if tile.phalanx not in PHALANGES:
        return None
    finger = settled.fingers[FINGERS.index(tile.finger)]
    return finger.contacts[PHALANGES.index(tile.phalanx)].stop


def number(value: float | None) -> float | None:
    """Return a number as it travels: what is infinite does not exist."""
    return float(value) if value is not None and math.isfinite(value) else None


def limit_reply(name: LimitName) -> replies.LimitName:
    """Return a limit's name as it travels."""
    return replies.LimitName(
        limb=name.limb,
        finger=name.finger,
        phalanx=name.phalanx,
        limit=name.limit,
        joint=name.joint,
    )


def _price(price: Price) -> replies.Price:
    name = price.name
    return replies.Price(
        limb=name.limb,
        finger=name.finger,
        phalanx=name.phalanx,
        limit=name.limit,
        joint=name.joint,
        price=float(price.price),
        unit=price.unit,
    )


def _prices(prices: Iterable[Price] | None) -> list[replies.Price] | None:
    return None if prices is None else [_price(price) for price in prices]


def limbs_reply(values: Mapping[str, Array] | None) -> dict[str, list[float]] | None:
    """Return the limbs' numbers as they travel."""
    return None if values is None else {limb: vector(value) for limb, value in values.items()}


def _certificate(answer: Plan, model: bool) -> replies.Certificate | None:
    """Return the proof; with the hands' sets where no plan's hands carry them."""
    proof = answer.certificate
    if proof is None:
        return None
    return replies.Certificate(
        utilisation=number(proof.utilisation),
        direction=vector(proof.direction),
        held={limb: vector(part) for limb, part in proof.held.items()},
        supremum=float(proof.supremum),
        needed=float(proof.needed),
        shortfall=None if proof.shortfall is None else vector(proof.shortfall),
        nearest=None if proof.nearest is None else vector(proof.nearest),
        blocking=[limit_reply(name) for name in proof.blocking],
        irreducible=None
        if proof.irreducible is None
        else [limit_reply(name) for name in proof.irreducible],
        sufficient=None
        if proof.sufficient is None
        else [limit_reply(name) for name in proof.sufficient],
        wrench_spaces={limb: wrench_set_reply(space) for limb, space in proof.spaces.items()}
        if model and answer.hands is None
        else UNSET,
    )


def _path(path: TensionPath) -> replies.TensionPath:
    return replies.TensionPath(
        safe=path.safe,
        safe_part=float(path.safe_part),
        utilisation_at_present=number(path.utilisation_at_present),
        largest_change=float(path.largest_change),
        limiting=[limit_reply(name) for name in path.limiting],
    )
