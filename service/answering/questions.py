"""From a request to the planner's own terms."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final, Literal

import msgspec
import numpy as np

from hand_models.base import Array, InvalidInputError, LimitError, Pose, within
from hand_models.fixed_wrist import UP, approach_frame
from hand_models.hand import SpinyHand
from hand_models.parameters import Draw, ParameterTable, own_draw, own_hand
from hand_models.tile import Surface
from planner import (
    EARTH,
    HandOnHold,
    Load,
    Question,
    Stance,
    settle_each,
)
from service import requests
from service.answering.holds import Rocks, placed_holds, poses_of, rocks_of
from service.answering.own_models import ROBOTS, Robots, builder_of

if TYPE_CHECKING:
    from planner import Route

__all__ = ["question", "route", "stance"]

VERTICAL: Final = (0.0, 0.0, 1.0)
"""Up in W."""

MOST_HALF_PLANES: Final = 256
"""Of all hands of a stance: 64 each of four, some 7500 rows in a plan's program."""

FLOATING: Final = 4
"""How many times over a floating hand's half-planes count: its plan is found in several rounds."""

MOST_POINTS: Final = 40_000
"""Of the outlines of all hands of a stance, of some 0.1 ms each."""

MOST_TURNED: Final = 4.0 * math.pi
"""Largest angle of a wrist that is taken for one [rad]: beyond two turns, it is in degrees."""


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
        body_wrench=_array(request.body_wrench),
        load=request.load or Load(),
        limits=request.limits,
        want=frozenset(request.want),
        objective=request.objective,
        present={limb: np.array(tensions) for limb, tensions in request.present.items()},
        deadline=request.deadline,
        draws=_draws(request.draws),
        explain=request.explain,
        body_range=request.body_range,
    )


def route(request: requests.RouteRequest, robots: Robots = ROBOTS) -> Route:
    """Return the climb of a route file; parameters as for `question`.

    Raises
    ------
    InvalidInputError
        If a part of it is impossible; the field is relative to the file.
    """
    from planner import Move, Route

    start, rocks = _stance(request.stance, robots)
    kind = start.robot.hand
    moved = _hands(request.moves, kind.table, rocks, "moves")
    places = [f"moves[{i}].body" for i in range(len(request.moves))]
    bodies = poses_of({at: each.body for at, each in zip(places, request.moves, strict=True)})
    angles = [_joints(move.joints) or "solve" for move in request.moves]
    return Route(
        name=request.name,
        start=start,
        moves=tuple(map(Move, _placed(kind, moved, "moves"), map(bodies.get, places), angles)),
        load=request.load or Load(),
        limits=request.limits,
        objective=request.objective,
        explain=request.explain,
        want=frozenset(request.want),
        draws=_draws(request.draws),
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
    with within("stance"):
        _check_costs(message)
        build = builder_of(message.robot, robots)
        with within("hand"):
            own = None if message.hand is None else own_hand(ParameterTable.of(message.hand))
            robot = build(own)
        numbers = robot.hand.table
        rocks = rocks_of(message, numbers)
        hands = _hands(message.hands, numbers, rocks, "hands")
        found = Stance(
            hands=tuple(_placed(robot.hand, hands, "hands")),
            body=poses_of({"body": message.body})["body"],
            gravity=np.array(EARTH if message.gravity is None else message.gravity),
            robot=robot,
            joints=_joints(message.joints),
        )
        return found, rocks


def _joints(
    message: dict[str, list[float] | Literal["solve"]] | Literal["solve"] | None,
) -> dict[str, Array | Literal["solve"]] | Literal["solve"] | None:
    if not isinstance(message, dict):
        return message
    return {
        limb: angles if isinstance(angles, str) else np.array(angles)
        for limb, angles in message.items()
    }


def _draws(messages: Sequence[requests.Draw]) -> tuple[Draw, ...] | None:
    """Return a caller's own draws; None for the bundled ones."""
    found = []
    for i, message in enumerate(messages):
        with within(f"draws[{i}]"):
            found.append(own_draw({"hand": message.hand, "surfaces": message.surfaces}))
    return tuple(found) or None


def _hands(
    messages: Sequence[requests.Hand], numbers: ParameterTable, rocks: Rocks, path: str
) -> list[HandOnHold]:
    """Return hands on their holds; those with a place stand at their rock's pose, until placed."""
    paths = [f"{path}[{i}]" for i in range(len(messages))]
    surfaces = [_surface(hand.surface, at) for at, hand in zip(paths, messages, strict=True)]
    holds = placed_holds(messages, numbers, rocks, path)
    poses = poses_of({f"{at}.pose": hand.pose for at, hand in zip(paths, messages, strict=True)})
    found = []
    for at, message, surface, placed in zip(paths, messages, surfaces, holds, strict=True):
        pose, hold_pose, seat = poses.get(f"{at}.pose"), placed.pose, None
        try:
            if message.place is not None:
                if pose is not None or placed.in_hand is not None:
                    which = "pose" if pose is not None else "hold.pose_in_hand"
                    raise InvalidInputError("give a place or a pose, not both", field=which)
                pose, hold_pose = placed.pose or Pose.identity(), None
                seat = _frame(message.place, pose)
                placed.hold.check_place(seat)
            if pose is None:
                raise InvalidInputError("missing", field="pose")
            found.append(
                HandOnHold(
                    limb=message.limb,
                    pose=pose,
                    hold=placed.hold,
                    surface=surface,
                    hold_pose=hold_pose,
                    hold_in_hand=placed.in_hand,
                    at=seat,
                    grasp=message.grasp,
                    wrist=message.wrist,
                    tendon_preload=_array(message.tendon_preload),
                    wrench=message.wrench,
                    seat=message.seat,
                    seat_direction=_array(message.seat_direction),
                )
            )
        except InvalidInputError as error:
            raise error.within(at) from None
    return found


def _frame(place: requests.Place, rock_pose: Pose) -> Pose:
    """Return where on a rock a hand is seated, in the rock's frame."""
    up = place.up
    if abs(place.wrist_angle) > MOST_TURNED:
        raise InvalidInputError(
            f"must be within ±{MOST_TURNED:.4g} rad, two turns, got {place.wrist_angle:g}: is it "
            "in rad?",
            field="place.wrist_angle",
        )
    if place.frame == "world":
        from_world = rock_pose.inverse()
        axes, point, up = from_world.rotation, from_world.apply(place.point), up or VERTICAL
    else:
        axes, point, up = np.eye(3), np.array(place.point), up or UP
    with within("place"):
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


def _surface(message: str | requests.Surface, path: str) -> Surface:
    """Return the surface of the hand at a path."""
    try:
        if isinstance(message, str):
            return Surface.named(message)
        given = {
            "shear_limit": message.shear_limit,
            "pull_off_limit": message.pull_off_limit,
            "pull_off_angle": message.pull_off_angle,
            "lateral_limit": message.lateral_limit,
            "compression_gain": message.compression_gain,
            "half_planes": message.half_planes,
            "lateral_pull_off_ratio": message.lateral_pull_off_ratio,
            "shear_scatter": message.shear_scatter,
            "friction": message.friction,
        }
        return Surface.from_values({name: v for name, v in given.items() if v is not None})
    except InvalidInputError as error:
        raise error.within("surface").within(path) from None


def _array(values: Sequence[float] | None) -> Array | None:
    return None if values is None else np.array(values)


# Costs --------------------------------------------------------------------------------------------


def _check_costs(stance: requests.Stance) -> None:
    """Refuse hands that would cost too much together.

    Raises
    ------
    LimitError
        The field is relative to the stance.
    """
    planes = sum(map(_half_planes, stance.hands))
    if planes > MOST_HALF_PLANES:
        raise LimitError(
            f"half_planes of all hands are {planes} together, those of a floating hand counted "
            f"{FLOATING} times; at most {MOST_HALF_PLANES} are worked with",
            field="hands",
        )
    points = sum(_points(hand.hold, stance.rocks) for hand in stance.hands)
    if points > MOST_POINTS:
        raise LimitError(
            f"profiles of all hands have {points} points together; at most {MOST_POINTS} are "
            "worked with",
            field="hands",
        )


def _half_planes(hand: requests.Hand) -> int:
    given = hand.surface.half_planes if isinstance(hand.surface, requests.Surface) else None
    return (FLOATING if hand.wrist == "floating" else 1) * (given or 1)


def _points(hold: requests.Hold, rocks: dict[str, requests.Rock]) -> int:
    """Return how many points the outlines of a hold have, those of a shared rock as its own."""
    if isinstance(hold, requests.RockReference):
        return _points(rocks[hold.rock], {}) if hold.rock in rocks else 0
    if not isinstance(hold, requests.Profile):
        return 0
    strips = () if hold.profiles is None else msgspec.structs.astuple(hold.profiles)
    return sum(map(len, strips)) + len(hold.points or ())
