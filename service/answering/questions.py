"""From a request to the planner's own terms."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Final, Literal, cast, get_args

import msgspec
import numpy as np

from hand_models.base import Array, InvalidInputError, Pose
from hand_models.fixed_wrist import UP, approach_frame
from hand_models.hand import Grasp, SpinyHand
from hand_models.parameters import ParameterTable, own_hand
from hand_models.tile import Surface
from planner.prepare import settle_each
from planner.question import EARTH, ForceCap, HandOnHold, Limits, Load, Objective, Question, Stance
from planner.route import Move, Route
from service import requests
from service.answering.costs import check_costs
from service.answering.holds import Rocks, placed, pose_of, rocks_of
from service.answering.own_robot import ROBOTS, Robots, builder_of

__all__ = ["question", "route", "stance"]

VERTICAL: Final = (0.0, 0.0, 1.0)
"""Up in W."""

GRASPS: Final = 64
"""Grasps that are kept, those asked for last: most hands are asked to take their holds alike."""


class _within:  # noqa: N801 (reads as the statement it makes)
    """Put a path before the field of an error."""

    def __init__(self, path: str) -> None:
        self.path = path

    def __enter__(self) -> None: ...

    def __exit__(self, kind: object, error: BaseException | None, traceback: object) -> None:
        if isinstance(error, InvalidInputError):
            raise error.within(self.path) from None


def question(request: requests.PlanRequest, robots: Robots = ROBOTS) -> Question:
    """Return what a plan request asks.

    Parameters
    ----------
    request : PlanRequest
    robots : Robots, optional
        Those that may be asked about.

    Raises
    ------
    InvalidInputError
        If a part of it is impossible; the field is relative to the request.
    """
    if request.body_wrench is not None and request.load is not None:
        raise InvalidInputError("give body_wrench or load, not both", field="body_wrench")
    return Question(
        stance=stance(request.stance, robots),
        body_wrench=None if request.body_wrench is None else np.array(request.body_wrench),
        load=_load(request.load),
        limits=_limits(request.limits),
        want=frozenset(request.want),
        objective=_objective(request.objective),
        present={limb: np.array(tensions) for limb, tensions in request.present.items()},
        deadline=request.deadline,
    )


def route(request: requests.RouteRequest, robots: Robots = ROBOTS) -> Route:
    """Return the climb of a route file; parameters as for `question`.

    Raises
    ------
    InvalidInputError
        If a part of it is impossible; the field is relative to the file.
    """
    start, rocks = _stance(request.stance, robots)
    kind = start.robot.hand
    moved = [_hand(move, kind.table, rocks, f"moves[{i}]") for i, move in enumerate(request.moves)]
    bodies = [pose_of(move.body, f"moves[{i}].body") for i, move in enumerate(request.moves)]
    return Route(
        name=request.name,
        start=start,
        moves=tuple(map(Move, _placed(kind, moved, "moves"), bodies)),
        load=_load(request.load),
        limits=_limits(request.limits),
        objective=_objective(request.objective),
    )


def stance(message: requests.Stance, robots: Robots = ROBOTS) -> Stance:
    """Return the stance of a request; parameters as for `question`.

    Raises
    ------
    InvalidInputError
        If a part of it is impossible; the field begins with ``stance``.
    """
    return _stance(message, robots)[0]


def _stance(message: requests.Stance, robots: Robots) -> tuple[Stance, Rocks]:
    with _within("stance"):
        check_costs(message)
        build = builder_of(message.robot, robots)
        with _within("hand"):
            own = None if message.hand is None else own_hand(ParameterTable.of(message.hand))
            robot = build(own)
        numbers = robot.hand.table
        rocks = rocks_of(message, numbers)
        hands = [_hand(hand, numbers, rocks, f"hands[{i}]") for i, hand in enumerate(message.hands)]
        found = Stance(
            hands=tuple(_placed(robot.hand, hands, "hands")),
            body=pose_of(message.body, "body"),
            gravity=np.array(EARTH if message.gravity is None else message.gravity),
            robot=robot,
            joints=_joints(message.joints),
        )
        return found, rocks


def _joints(
    message: dict[str, list[float]] | Literal["solve"] | None,
) -> dict[str, Array] | Literal["solve"] | None:
    if not isinstance(message, dict):
        return message
    return {limb: np.array(angles) for limb, angles in message.items()}


def _objective(name: str) -> Objective:
    for known in get_args(Objective):
        if name == known:
            return cast(Objective, known)
    raise InvalidInputError(f"{name} is not supported", field="objective")


def _load(message: requests.Load | None) -> Load:
    message = message or requests.Load()
    return Load(message.mass, message.com, message.acceleration, message.angular_acceleration)


def _limits(message: requests.Limits) -> Limits:
    torque: float | dict[str, float | tuple[float, ...]] | None
    if isinstance(message.joint_torque, dict):
        torque = {
            limb: tuple(most) if isinstance(most, list) else most
            for limb, most in message.joint_torque.items()
        }
    else:
        torque = message.joint_torque
    with _within("limits"):
        return Limits(
            utilisation=message.utilisation,
            tendon_tension=message.tendon_tension,
            joint_torque=torque,
            per_hand={limb: _force_cap(cap, limb) for limb, cap in message.per_hand.items()},
            tension_change=message.tension_change,
        )


def _force_cap(message: requests.ForceCap, limb: str) -> ForceCap:
    given = message.largest_force
    most = tuple(_range(axis) for axis in given) if isinstance(given, list) else given
    with _within(f"per_hand.{limb}"):
        return ForceCap(most, message.frame)


def _range(axis: requests.AxisForce) -> tuple[float, float]:
    """Return the least and the largest force along an axis."""
    if axis is None:
        return -math.inf, math.inf
    return (axis[0], axis[1]) if isinstance(axis, list) else (-axis, axis)


def _hand(message: requests.Hand, numbers: ParameterTable, rocks: Rocks, path: str) -> HandOnHold:
    with _within(path):
        grasp, surface = _grasp(message.grasp), _surface(message.surface)
        hold, hold_pose, hold_in_hand = placed(
            message.hold, numbers, rocks, anywhere=message.place is not None
        )
        pose, at = pose_of(message.pose, "pose"), None
        if message.place is not None:
            if pose is not None or hold_in_hand is not None:
                which = "pose" if pose is not None else "hold.pose_in_hand"
                raise InvalidInputError("give a place or a pose, not both", field=which)
            # of the rock, until the hand has been seated there
            pose, hold_pose = hold_pose or Pose.identity(), None
            at = _frame(message.place, pose)
            hold.check_place(at)
        if pose is None:
            raise InvalidInputError("missing", field="pose")
        return HandOnHold(
            limb=message.limb,
            pose=pose,
            hold=hold,
            surface=surface,
            hold_pose=hold_pose,
            hold_in_hand=hold_in_hand,
            at=at,
            grasp=grasp,
            wrist=message.wrist,
            tendon_preload=None
            if message.tendon_preload is None
            else np.array(message.tendon_preload),
            wrench=message.wrench,
            seat=message.seat,
            seat_direction=None
            if message.seat_direction is None
            else np.array(message.seat_direction),
        )


def _frame(place: requests.Place, rock_pose: Pose) -> Pose:
    """Return where on a rock a hand is seated, in the rock's frame."""
    up = place.up
    if place.frame == "world":
        from_world = rock_pose.inverse()
        axes, point, up = from_world.rotation, from_world.apply(place.point), up or VERTICAL
    else:
        axes, point, up = np.eye(3), np.array(place.point), up or UP
    with _within("place"):
        return approach_frame(point, axes @ place.approach, place.wrist_angle, axes @ up)


def _placed(kind: SpinyHand, hands: Sequence[HandOnHold], path: str) -> list[HandOnHold]:
    """Return hands of which those with a place on the rock have the poses that they take there."""
    placed = [i for i, hand in enumerate(hands) if hand.at is not None]
    found = list(hands)
    for i, outcome in zip(placed, settle_each(kind, [hands[i] for i in placed]), strict=True):
        if isinstance(outcome, InvalidInputError):
            raise outcome.within(f"{path}[{i}]")
        found[i] = replace(hands[i], pose=hands[i].pose @ outcome.seating.pose.inverse())
    return found


@lru_cache(maxsize=GRASPS)
def _grasp(message: requests.Grasp) -> Grasp:
    try:
        return Grasp(**msgspec.structs.asdict(message))
    except InvalidInputError as error:
        raise error.within("grasp") from None


def _surface(message: str | requests.Surface) -> Surface:
    try:
        if isinstance(message, str):
            return Surface.named(message)
        given = msgspec.structs.asdict(message)
        return Surface.from_values({name: v for name, v in given.items() if v is not None})
    except InvalidInputError as error:
        raise error.within("surface") from None
