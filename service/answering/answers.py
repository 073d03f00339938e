"""From the planner's answer to a reply: plain numbers, every name spelled out."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np
from msgspec import UNSET

from hand_models.base import Array, EmptySetError
from hand_models.finger import PHALANGES
from hand_models.fixed_wrist import Robustness, TensionLimit
from hand_models.hand import FINGERS, NearbyClosure, Seating, SettledHand, Tile, closing_sequence
from hand_models.tile import HalfPlane
from hand_models.wrench_spaces import WrenchSpace
from planner.result import HandPlan, LimitName, Plan, Price, TensionPath, WristPlan
from service import replies
from service.replies import AXES

__all__ = ["BOTH_WAYS", "limit_reply", "plan_reply", "vector", "wrench_space_reply"]

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
        utilisation=_number(answer.utilisation),
        effort=_number(answer.effort),
        load_factor=_number(answer.load_factor),
        load_factor_unbounded=answer.load_factor_unbounded,
        limiting=None if answer.limiting is None else limit_reply(answer.limiting),
        hands=None if answer.hands is None else [_hand(h, model) for h in answer.hands],
        joints=_by_limb(answer.joints),
        joint_torque=_by_limb(answer.joint_torque),
        joint_torque_limit=_by_limb(answer.joint_torque_limit),
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
    limits: Iterable[TensionLimit],
    nearby: Iterable[NearbyClosure],
    wrist: WristPlan | None = None,
    robust: Robustness | None = None,
) -> replies.WrenchSpaceReply:
    """Return one hand's wrench space as a reply, with its views at utilisation 1.

    Where nothing is left at utilisation 1 there are no vertices, and the other views are null.

    Raises
    ------
    SolverError
        If a view could not be computed.
    """
    try:
        views = _Views(
            vertices=_vectors(space.vertices()),
            half_spaces=_half_spaces(space),
            dimension=space.dimension,
            capability=_capability(space),
        )
    except EmptySetError:
        views = _Views([], None, None, None)
    parts = _wrench_set(space)
    return replies.WrenchSpaceReply(
        robot=robot,
        limb=limb,
        wrist=_wrist(wrist),
        seating=_seating(settled.seating),
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
            replies.TensionLimit(limit.finger, _number(limit.tension), limit.phalanx)
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
        dict(zip(SIDES, map(_number, reach.tolist()), strict=True))
        for reach in (found.worst, found.tenth)
    )
    numbers = found._asdict() | {"worst": worst, "tenth": tenth}
    return replies.RobustCapability(**numbers)


def _stop(settled: SettledHand, tile: Tile) -> str | None:
    if tile.phalanx not in PHALANGES:
        return None
    finger = settled.fingers[FINGERS.index(tile.finger)]
    return finger.contacts[PHALANGES.index(tile.phalanx)].stop


class _Views(NamedTuple):
    """What a reply says of a set at utilisation 1."""

    vertices: list[list[float]]
    half_spaces: replies.HalfSpaces | None
    dimension: int | None
    capability: dict[str, replies.AxisCapability] | None


def _half_spaces(space: WrenchSpace) -> replies.HalfSpaces:
    faces = space.half_spaces()
    return replies.HalfSpaces(
        _vectors(faces.normals),
        vector(faces.offsets),
        replies.HalfSpaceEquations(
            _vectors(faces.equation_normals), vector(faces.equation_offsets)
        ),
    )


def vector(values: Array) -> list[float]:
    """Return an array as it travels."""
    return np.asarray(values, dtype=float).tolist()  # type: ignore[no-any-return]


def _vectors(values: Array) -> list[list[float]]:
    return np.asarray(values, dtype=float).tolist()  # type: ignore[no-any-return]


def _number(value: float | None) -> float | None:
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


def _by_limb(values: Mapping[str, Array] | None) -> dict[str, list[float]] | None:
    return None if values is None else {limb: vector(value) for limb, value in values.items()}


def _certificate(answer: Plan, model: bool) -> replies.Certificate | None:
    """Return the proof; with the hands' sets where no plan's hands carry them."""
    proof = answer.certificate
    if proof is None:
        return None
    return replies.Certificate(
        utilisation=_number(proof.utilisation),
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
        wrench_spaces={limb: _wrench_set(space) for limb, space in proof.spaces.items()}
        if model and answer.hands is None
        else UNSET,
    )


def _path(path: TensionPath) -> replies.TensionPath:
    return replies.TensionPath(
        safe=path.safe,
        safe_part=float(path.safe_part),
        utilisation_at_present=_number(path.utilisation_at_present),
        largest_change=float(path.largest_change),
        limiting=[limit_reply(name) for name in path.limiting],
    )


def _hand(part: HandPlan, model: bool) -> replies.Hand:
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
        seating=_seating(part.seating),
        wrist=_wrist(part.wrist),
        wrench_space=_wrench_set(part.space) if model else UNSET,
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


def _wrist(wrist: WristPlan | None) -> replies.Wrist:
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


def _seating(seating: Seating) -> replies.Seating:
    pose = seating.pose
    frame = replies.PlacedFrame(vector(pose.position), vector(pose.quaternion()))
    return replies.Seating(seating.rule, frame, seating.backed_off)


def _wrench_set(space: WrenchSpace) -> replies.WrenchSet:
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


def _capability(space: WrenchSpace) -> dict[str, replies.AxisCapability]:
    reaches = {}
    for axis, direction in zip(AXES, np.eye(len(AXES)), strict=True):
        ends = space.capability(direction)
        low, high = (None, None) if ends is None else (-float(ends[0]), float(ends[1]))
        for sign, pure, way in (("+", high, direction), ("-", low, -direction)):
            reaches[f"{sign}{axis}"] = replies.AxisCapability(pure, float(space.support(way)))
    return reaches
