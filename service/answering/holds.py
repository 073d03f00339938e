"""Holds of requests: rock as its numbers say, or one of the stance's rocks, which hands share."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from hashlib import blake2b
from typing import Final, NamedTuple

import msgspec

from hand_models import rock
from hand_models.base import BoundedStore, InvalidInputError, Pose, within
from hand_models.parameters import ParameterTable
from hand_models.rock import Mesh, Profile
from service import requests

__all__ = ["Placed", "Rocks", "placed_holds", "poses_of", "rocks_of"]

KEPT: Final = 8
"""Meshes that are kept, those asked for last: on the same object hands are found settled."""

MESHES: Final[BoundedStore[Hashable, Mesh]] = BoundedStore("meshes of requests", KEPT)
"""By all that they are built of."""


Rocks = Mapping[str, tuple[rock.Hold, Pose | None]]
"""A stance's rocks by name, and each one's frame in W if that is given."""

Poses = Mapping[str, Pose]
"""Poses of a message by their paths."""


def poses_of(messages: Mapping[str, requests.Pose | None]) -> Poses:
    """Return the poses that are given, by their paths; raises as `Pose.from_quaternions`."""
    given = {path: pose for path, pose in messages.items() if pose is not None}
    found = Pose.from_quaternions([(at, p.position, p.orientation) for at, p in given.items()])
    return dict(zip(given, found, strict=True))


def rocks_of(message: requests.Stance, numbers: ParameterTable) -> Rocks:
    """Return the rocks of a stance by name, each built once.

    Raises
    ------
    InvalidInputError
        If one is impossible; the field begins with ``rocks``.
    """
    found = {}
    for name, each in message.rocks.items():
        if not name:
            raise InvalidInputError("a rock needs a name, got ''", field="rocks")
        with within(f"rocks.{name}"):
            if each.pose_in_hand is not None:
                raise InvalidInputError(
                    "hands share this rock; give its pose, or pose_in_hand where a hand refers to "
                    "it",
                    field="pose_in_hand",
                )
            hold = _hold(each, numbers, anywhere=True)
            found[name] = hold, poses_of({"pose": each.pose}).get("pose")
    return found


class Placed(NamedTuple):
    """A hold, and its frame in W and in H as far as these are given."""

    hold: rock.Hold
    pose: Pose | None
    in_hand: Pose | None


def placed_holds(
    hands: Sequence[requests.Hand], numbers: ParameterTable, rocks: Rocks, path: str
) -> list[Placed]:
    """Return the holds of hands.

    Parameters
    ----------
    hands : sequence of Hand
    numbers : ParameterTable
        Of the robot's hands.
    rocks : Rocks
    path : str
        Where the hands are in the message.

    Raises
    ------
    InvalidInputError
        If one is impossible, or refers to no rock.
    """
    places = [f"{path}[{i}].hold" for i in range(len(hands))]
    given: dict[str, requests.Pose | None] = {}
    for at, hand in zip(places, hands, strict=True):
        given |= {f"{at}.pose": hand.hold.pose, f"{at}.pose_in_hand": hand.hold.pose_in_hand}
    poses = poses_of(given)
    found: list[Placed] = []
    for at, hand in zip(places, hands, strict=True):
        message, anywhere = hand.hold, hand.place is not None
        pose, in_hand = poses.get(f"{at}.pose"), poses.get(f"{at}.pose_in_hand")
        try:
            if isinstance(message, requests.RockReference):
                hold, known = _shared(message, rocks)
                if pose is None and in_hand is None:
                    pose = known
                    if pose is None and not anywhere:
                        _check_seat(hold)
            else:
                hold = _hold(message, numbers, anywhere)
        except InvalidInputError as error:
            raise error.within(at) from None
        found.append(Placed(hold, pose, in_hand))
    return found


def _shared(message: requests.RockReference, rocks: Rocks) -> tuple[rock.Hold, Pose | None]:
    """Return the rock that a hand refers to, and its frame in W if that is given."""
    if message.rock not in rocks:
        known = f"known are {', '.join(rocks)}" if rocks else "stance.rocks names none"
        raise InvalidInputError(f"unknown rock {message.rock!r}; {known}", field="rock")
    return rocks[message.rock]


def _check_seat(shared: rock.Hold) -> None:
    """Refuse to seat a hand at a frame that does not begin on the rock."""
    try:
        shared.check_place()
    except InvalidInputError as error:
        raise InvalidInputError(
            f"without a pose the hand is seated at its origin: {error.message}", field="rock"
        ) from None


def _hold(message: requests.Rock, numbers: ParameterTable, anywhere: bool = False) -> rock.Hold:
    match message:
        case requests.Plane():
            return rock.Plane()
        case requests.Cylinder():
            return rock.Cylinder(message.diameter)
        case requests.Sphere():
            return rock.Sphere(message.diameter)
        case requests.Ellipsoid():
            return rock.Ellipsoid(message.semi_axes)
        case requests.Edge():
            return rock.Edge(message.fillet_radius, message.angle)
        case requests.Profile():
            return _profile(message, numbers)
        case requests.Mesh():
            return _mesh(message, numbers, anywhere)


def _profile(message: requests.Profile, numbers: ParameterTable) -> Profile:
    if message.points is not None and message.profiles is None:
        return Profile(message.points, numbers)
    if message.profiles is not None and message.points is None:
        strips = message.profiles
        outlines = {
            "outer_left": strips.outer_left,
            "inner_left": strips.inner_left,
            "inner_right": strips.inner_right,
            "outer_right": strips.outer_right,
        }
        return Profile(outlines, numbers)
    raise InvalidInputError("give points or profiles, one of them", field="points")


def _mesh(message: requests.Mesh, numbers: ParameterTable, anywhere: bool) -> Mesh:
    if message.file is not None:
        raise InvalidInputError(
            "only the command line reads files; send vertices and faces", field="file"
        )
    if message.vertices is None or message.faces is None:
        missing = "vertices" if message.vertices is None else "faces"
        raise InvalidInputError("missing", field=missing)
    vertices, faces = message.vertices, message.faces
    key = blake2b(msgspec.msgpack.encode((vertices, faces))).digest(), numbers, anywhere
    return MESHES.get(key, lambda: Mesh(vertices, faces, numbers, anywhere=anywhere))
