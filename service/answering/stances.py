"""Convert the stance of a request into the planner's stance: hands closed on their holds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from hand_models import rock
from hand_models.base import (
    Array,
    InvalidInputError,
    Pose,
    errors_under,
    oriented_pose,
    turns_about,
)
from hand_models.fixed_wrist import ALONG_FINGERS, approach_frame
from hand_models.hand import SpinyHand
from hand_models.parameters import ParameterTable, own_hand
from planner import EARTH_GRAVITY, HandOnHold, Stance, come_to_rest, settle_each
from service import requests
from service.answering.holds import check_costs, hold_of, surface_of
from service.answering.own_models import BUNDLED_ROBOTS, Robots, builder_of

__all__ = ["Rocks", "array_of", "hands_on_rocks", "joints_of", "poses_of", "stance", "with_rocks"]

Rocks = Mapping[str, tuple[rock.Hold, Pose | None]]
"""Rocks of a stance by name: each rock's shape, and its pose in W, or None where none is given."""


def stance(message: requests.StanceMessage, robots: Robots = BUNDLED_ROBOTS) -> Stance:
    """Convert the stance of a request into the planner's stance.

    Parameters
    ----------
    message : requests.StanceMessage
        Body pose, hands on holds, and optionally robot, hand parameters, rocks and joints.
    robots : Robots, optional
        Robots that a stance may name, with their builders; bundled robots by default.

    Returns
    -------
    Stance
        Hands on holds, body, gravity, robot and joints.

    Raises
    ------
    InvalidInputError
        If the stance is impossible, or too large (`LimitError`); ``field`` begins with ``stance``.
    """
    return with_rocks(message, robots)[0]


def with_rocks(
    message: requests.StanceMessage, robots: Robots = BUNDLED_ROBOTS
) -> tuple[Stance, Rocks]:
    """Convert the stance of a request, and return it with its rocks; parameters as for `stance`.

    Returns
    -------
    stance : Stance
        The planner's stance.
    rocks : Rocks
        Shape and pose of each rock by name, for further hands that refer to them.

    Raises
    ------
    InvalidInputError
        As `stance` raises.
    """
    with errors_under("stance"):
        check_costs(message)
        build = builder_of(message.robot, robots)
        if message.hand is None:
            robot = build(None)
        else:
            with errors_under("hand"):
                robot = build(own_hand(ParameterTable.of(message.hand)))
        rocks = _rocks(message, robot.hand.table)
        found = Stance(
            hands=tuple(hands_on_rocks(message.hands, robot.hand, rocks, "hands")),
            body=poses_of({"body": message.body})["body"],
            gravity=np.array(EARTH_GRAVITY if message.gravity is None else message.gravity),
            robot=robot,
            joints=joints_of(message.joints),
            limb_stiffness=message.limb_stiffness,
        )
        return found, rocks


def hands_on_rocks(
    messages: Sequence[requests.Hand], kind: SpinyHand, rocks: Rocks, path: str
) -> list[HandOnHold]:
    """Convert the hands of a request; compute poses of those on a rock, and placed by contact.

    Parameters
    ----------
    messages : sequence of requests.Hand
        Hands, each with a pose or with a place on a rock.
    kind : SpinyHand
        Model of the robot's hands.
    rocks : Rocks
        Rocks that the hands may refer to by name.
    path : str
        Path of the hands in the request, such as ``hands``.

    Returns
    -------
    list of HandOnHold
        One for each message, with the pose of the hand in W.

    Raises
    ------
    InvalidInputError
        If a hand is impossible, or its rock is unknown; ``field`` begins with the path.
    """
    paths = [f"{path}[{i}]" for i in range(len(messages))]
    given: dict[str, requests.PoseMessage | None] = {}
    for at, each in zip(paths, messages, strict=True):
        given |= {f"{at}.hold.pose": each.hold.pose, f"{at}.pose": each.pose}
        given[f"{at}.hold.pose_in_hand"] = each.hold.pose_in_hand
    poses, hands = poses_of(given), list[HandOnHold]()
    for at, message in zip(paths, messages, strict=True):
        try:
            hands.append(_hand(message, at, poses, kind.table, rocks))
        except InvalidInputError as error:
            raise error.within(at) from None
    placed = [i for i, hand in enumerate(hands) if hand.at is not None]
    for i, outcome in zip(placed, settle_each(kind, [hands[i] for i in placed]), strict=True):
        if isinstance(outcome, InvalidInputError):
            raise outcome.within(paths[i])
        hands[i] = replace(hands[i], pose=hands[i].pose @ outcome.seating.pose.inverse())
    by_contact = [i for i, each in enumerate(messages) if each.placing == "contact"]
    offsets = [_offset(messages[i]) for i in by_contact]
    rests = come_to_rest(kind, [hands[i] for i in by_contact], offsets)
    for i, rest in zip(by_contact, rests, strict=True):
        if isinstance(rest, InvalidInputError):
            raise rest.within(paths[i])
        hands[i] = rest
    return hands


def _offset(message: requests.Hand) -> Pose:
    """Return H in the frame where a hand that is placed by contact rests."""
    twist = np.array(message.contact_offset or (0.0,) * 6)
    return Pose(twist[:3], turns_about(twist[3:]))


def _hand(
    message: requests.Hand,
    at: str,
    poses: Mapping[str, Pose],
    numbers: ParameterTable,
    rocks: Rocks,
) -> HandOnHold:
    """Return a hand on its hold; one with a place gets its rock's pose until it is placed.

    ``at``: path of the hand in the request; ``poses``: given poses by path; ``numbers``:
    parameters of the robot's hands.
    """
    surface = surface_of(message.surface)
    pose, in_hand = poses.get(f"{at}.pose"), poses.get(f"{at}.hold.pose_in_hand")
    try:
        hold, hold_pose = _placed_hold(message, poses.get(f"{at}.hold.pose"), numbers, rocks)
    except InvalidInputError as error:
        raise error.within("hold") from None
    seat = None
    if message.place is not None:
        if pose is not None or in_hand is not None:
            which = "pose" if pose is not None else "hold.pose_in_hand"
            raise InvalidInputError(
                "must not be given with place, which seats the hand on the rock; remove one",
                field=which,
            )
        pose, hold_pose = hold_pose or Pose.identity(), None
        seat = _frame(message.place, pose)
        hold.check_place(seat)
    if pose is None:
        raise InvalidInputError("missing; give a pose, or a place on the rock", field="pose")
    if message.contact_offset is not None and message.placing != "contact":
        raise InvalidInputError(
            f"requires a hand that is placed by contact, got placing {message.placing!r}; remove "
            "contact_offset, or give placing 'contact'",
            field="contact_offset",
        )
    return HandOnHold(
        limb=message.limb,
        pose=pose,
        hold=hold,
        surface=surface,
        hold_pose=hold_pose,
        hold_in_hand=in_hand,
        at=seat,
        grasp=message.grasp,
        wrist=message.wrist,
        wrist_travel=message.wrist_travel,
        tendon_preload=array_of(message.tendon_preload),
        wrench=message.wrench,
        seat=message.seat,
        seat_direction=array_of(message.seat_direction),
    )


def _placed_hold(
    message: requests.Hand, pose: Pose | None, numbers: ParameterTable, rocks: Rocks
) -> tuple[rock.Hold, Pose | None]:
    """Return the hold of a hand, and its frame in W: the given pose, or that of its rock."""
    hold, anywhere = message.hold, message.place is not None
    if not isinstance(hold, requests.RockReference):
        return hold_of(hold, numbers, anywhere), pose
    if hold.rock not in rocks:
        known = f"known are {', '.join(rocks)}" if rocks else "stance.rocks names none"
        raise InvalidInputError(f"unknown rock {hold.rock!r}; {known}", field="rock")
    shared, own = rocks[hold.rock]
    if pose is not None or hold.pose_in_hand is not None:
        return shared, pose
    if own is None and not anywhere:
        try:
            shared.check_place()
        except InvalidInputError as error:
            raise InvalidInputError(
                f"without a pose the hand is seated at the rock's origin: {error.message}; give "
                "the rock a pose, or the hand a place",
                field="rock",
            ) from None
    return shared, own


def poses_of(messages: Mapping[str, requests.PoseMessage | None]) -> dict[str, Pose]:
    """Return the poses that are given, by their paths in the request; leave out missing ones.

    Raises
    ------
    InvalidInputError
        If a pose is impossible, such as a quaternion of zeros; ``field`` begins with its path.
    """
    found = {}
    for path, pose in messages.items():
        if pose is None:
            continue
        try:
            found[path] = oriented_pose(
                pose.position, pose.orientation, pose.rpy, pose.x_axis, pose.z_axis
            )
        except InvalidInputError as error:
            raise error.within(path) from None
    return found


def joints_of(
    message: dict[str, list[float] | Literal["solve"]] | Literal["solve"] | None,
) -> dict[str, Array | Literal["solve"]] | Literal["solve"] | None:
    """Convert the joint angles of a request's limbs from lists to arrays.

    Parameters
    ----------
    message : dict, 'solve' or None
        Angles by limb [rad], of sliding joints [m]; or ``solve``, for a limb or for all limbs,
        where the planner finds the angles by inverse kinematics.
    """
    if not isinstance(message, dict):
        return message
    return {
        limb: angles if isinstance(angles, str) else np.array(angles)
        for limb, angles in message.items()
    }


def array_of(values: Sequence[float] | None) -> Array | None:
    """Convert a list of numbers into an array; None stays None."""
    return None if values is None else np.array(values)


def _frame(place: requests.Place, rock_pose: Pose) -> Pose:
    """Return the pose on a rock at which a hand is seated, in the rock's frame."""
    up = place.up
    # [rad] beyond two turns, an angle is likely to be in degrees
    largest = 4.0 * math.pi
    if abs(place.wrist_angle) > largest:
        raise InvalidInputError(
            f"must be within ±{largest:.4g} rad (two turns), got {place.wrist_angle:g} rad: "
            "is it in degrees?",
            field="place.wrist_angle",
        )
    if place.frame == "world":
        from_world = rock_pose.inverse()
        axes, point, up = from_world.rotation, from_world.apply(place.point), up or (0.0, 0.0, 1.0)
    else:
        axes, point, up = np.eye(3), np.array(place.point), up or ALONG_FINGERS
    with errors_under("place"):
        return approach_frame(point, axes @ place.approach, place.wrist_angle, axes @ up)


# Holds --------------------------------------------------------------------------------------------


def _rocks(message: requests.StanceMessage, numbers: ParameterTable) -> Rocks:
    """Return the rocks of a stance by name, each built once."""
    found = {}
    for name, each in message.rocks.items():
        if not name:
            raise InvalidInputError("a rock needs a name, got ''", field="rocks")
        with errors_under(f"rocks.{name}"):
            if each.pose_in_hand is not None:
                raise InvalidInputError(
                    "hands share this rock; give its pose, or pose_in_hand where a hand refers to "
                    "it",
                    field="pose_in_hand",
                )
            hold = hold_of(each, numbers, anywhere=True)
            found[name] = hold, poses_of({"pose": each.pose}).get("pose")
    return found
