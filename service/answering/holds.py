"""Holds of requests: rock as its numbers say, or one of the stance's rocks, which hands share."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from hashlib import blake2b
from typing import Final, overload

import msgspec

from hand_models import rock
from hand_models.base import BoundedStore, InvalidInputError, Pose, within
from hand_models.parameters import ParameterTable
from hand_models.rock import Mesh, Profile
from service import requests

__all__ = ["Rocks", "placed", "pose_of", "rocks_of", "within"]

KEPT: Final = 8
"""Meshes that are kept, those asked for last: on the same object hands are found settled."""

MESHES: Final[BoundedStore[Hashable, Mesh]] = BoundedStore("meshes of requests", KEPT)
"""By all that they are built of."""


Rocks = Mapping[str, tuple[rock.Hold, Pose | None]]
"""A stance's rocks by name, and each one's frame in W if that is given."""


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
            found[name] = hold, pose_of(each.pose, "pose")
    return found


def placed(
    message: requests.Hold, numbers: ParameterTable, rocks: Rocks, *, anywhere: bool = False
) -> tuple[rock.Hold, Pose | None, Pose | None]:
    """Return a hold, and its frame in W and in H as far as these are given.

    ``anywhere``: the hand is not seated at its origin.

    Raises
    ------
    InvalidInputError
        If it is impossible, or refers to no rock; the field begins with ``hold``.
    """
    with within("hold"):
        pose = pose_of(message.pose, "pose")
        in_hand = pose_of(message.pose_in_hand, "pose_in_hand")
        if not isinstance(message, requests.RockReference):
            return _hold(message, numbers, anywhere), pose, in_hand
        if message.rock not in rocks:
            known = f"known are {', '.join(rocks)}" if rocks else "stance.rocks names none"
            raise InvalidInputError(f"unknown rock {message.rock!r}; {known}", field="rock")
        hold, place = rocks[message.rock]
        if pose is None and in_hand is None:
            pose = place
            if pose is None and not anywhere:
                _check_seat(hold)
        return hold, pose, in_hand


def _check_seat(shared: rock.Hold) -> None:
    """Refuse to seat a hand at a frame that does not begin on the rock."""
    try:
        shared.check_place()
    except InvalidInputError as error:
        raise InvalidInputError(
            f"without a pose the hand is seated at its origin: {error.message}", field="rock"
        ) from None


@overload
def pose_of(message: requests.Pose, field: str) -> Pose: ...
@overload
def pose_of(message: requests.Pose | None, field: str) -> Pose | None: ...
def pose_of(message: requests.Pose | None, field: str) -> Pose | None:
    """Return a pose, if there is one; raises what `Pose.from_quaternion` raises."""
    if message is None:
        return None
    with within(field):
        return Pose.from_quaternion(message.position, message.orientation)


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
        return Profile(msgspec.structs.asdict(message.profiles), numbers)
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
