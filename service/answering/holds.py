"""Build the holds of requests, and bound what those of a stance may cost."""

from __future__ import annotations

from collections.abc import Hashable
from hashlib import blake2b
from typing import Final

import msgspec

from hand_models import rock
from hand_models.base import BoundedStore, InvalidInputError, LimitError
from hand_models.parameters import ParameterTable
from hand_models.rock import Mesh, Profile
from hand_models.tile import Surface
from service import requests

__all__ = ["check_costs", "hold_of", "surface_of"]

MESHES_OF_REQUESTS: Final[BoundedStore[Hashable, Mesh]] = BoundedStore("meshes of requests", 8)
"""LRU cache of eight meshes by vertices, faces and parameters, with the hands settled on each."""


def hold_of(message: requests.Rock, numbers: ParameterTable, anywhere: bool) -> rock.Hold:
    """Return the hold of a message.

    Parameters
    ----------
    message : requests.Rock
    numbers : ParameterTable
        Parameters of the robot's hands.
    anywhere : bool
        True if the hold's frame may begin off the rock.

    Raises
    ------
    InvalidInputError
        If the rock is impossible; ``field`` is relative to the hold.
    """
    match message:
        case requests.PlaneMessage():
            return rock.Plane()
        case requests.CylinderMessage():
            return rock.Cylinder(message.diameter)
        case requests.SphereMessage():
            return rock.Sphere(message.diameter)
        case requests.EllipsoidMessage():
            return rock.Ellipsoid(message.semi_axes)
        case requests.EdgeMessage():
            return rock.Edge(message.fillet_radius, message.angle)
        case requests.ProfileMessage():
            return _profile(message, numbers)
        case requests.MeshMessage():
            return _mesh(message, numbers, anywhere)


def _profile(message: requests.ProfileMessage, numbers: ParameterTable) -> Profile:
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
    got = "neither" if message.points is None else "both"
    raise InvalidInputError(f"give points or profiles, got {got}", field="points")


def _mesh(message: requests.MeshMessage, numbers: ParameterTable, anywhere: bool) -> Mesh:
    if message.file is not None:
        raise InvalidInputError(
            "only the command line reads files; send vertices and faces", field="file"
        )
    if message.vertices is None or message.faces is None:
        missing = "vertices" if message.vertices is None else "faces"
        raise InvalidInputError("missing; give vertices and faces", field=missing)
    vertices, faces = message.vertices, message.faces
    key = blake2b(msgspec.msgpack.encode((vertices, faces))).digest(), numbers, anywhere
    return MESHES_OF_REQUESTS.get(key, lambda: Mesh(vertices, faces, numbers, anywhere=anywhere))


def surface_of(message: str | requests.SurfaceMessage) -> Surface:
    """Return the surface of a preset's name or of a caller's own numbers.

    Raises
    ------
    InvalidInputError
        If a number is impossible, or no preset has the name; ``field`` begins with ``surface``.
    """
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
            "pull_off_exponent": message.pull_off_exponent,
        }
        return Surface.from_values({name: v for name, v in given.items() if v is not None})
    except InvalidInputError as error:
        raise error.within("surface") from None


def check_costs(stance: requests.StanceMessage) -> None:
    """Refuse a stance whose hands have too many half-planes or outline points in all.

    Parameters
    ----------
    stance : requests.StanceMessage
        Stance of the request.

    Raises
    ------
    LimitError
        If the half-planes, or the points of outlines, are more than a request may have; the field
        is relative to the stance.
    """
    # a plan of wrists that move is found in several rounds
    rounds = 4
    # four hands with 64 half-planes have some 7500 rows in a program
    most_planes = 256
    planes = sum(
        (1 if hand.wrist == "fixed" else rounds) * _half_planes(hand) for hand in stance.hands
    )
    if planes > most_planes:
        raise LimitError(
            f"half_planes of all hands are {planes} together, those of a compliant or floating "
            f"hand counted {rounds} times; the maximum is {most_planes}: use fewer half_planes",
            field="hands",
        )
    points = sum(_points(hand.hold, stance.rocks) for hand in stance.hands)
    # some 0.1 ms for each point of an outline
    most_points = 40_000
    if points > most_points:
        raise LimitError(
            f"profiles of all hands have {points} points together, those of a shared rock counted "
            f"for each hand on it; the maximum is {most_points}: use fewer points",
            field="hands",
        )


def _half_planes(hand: requests.Hand) -> int:
    given = hand.surface.half_planes if isinstance(hand.surface, requests.SurfaceMessage) else None
    return given or 1


def _points(hold: requests.Hold, rocks: dict[str, requests.Rock]) -> int:
    """Return how many points the outlines of a hold have, those of a shared rock as its own."""
    if isinstance(hold, requests.RockReference):
        return _points(rocks[hold.rock], {}) if hold.rock in rocks else 0
    if not isinstance(hold, requests.ProfileMessage):
        return 0
    strips = () if hold.profiles is None else msgspec.structs.astuple(hold.profiles)
    return sum(map(len, strips)) + len(hold.points or ())
