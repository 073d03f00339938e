"""From a request to the planner's own terms."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final, overload

import msgspec
import numpy as np

from hand_models import holds
from hand_models.errors import InvalidInputError
from hand_models.frames import Pose
from hand_models.hand import Grasp
from hand_models.mesh import Mesh
from hand_models.parameters import ParameterTable
from hand_models.parameters.own import own_hand
from hand_models.profile import Profile
from hand_models.spines import Surface
from planner.robosimian import Robot, robosimian
from planner.route import Move, Route
from planner.stance import EARTH, HandOnHold, Limits, Load, Question, Stance
from service import requests

__all__ = ["ROBOTS", "question", "route", "stance"]

ROBOTS: Final[dict[str, Callable[[ParameterTable | None], Robot]]] = {"robosimian": robosimian}
"""By name, what builds a robot from all numbers of its hands."""


@contextmanager
def _within(path: str) -> Iterator[None]:
    """Put a path before the field of an error."""
    try:
        yield
    except InvalidInputError as error:
        raise error.within(path) from None


def question(request: requests.PlanRequest) -> Question:
    """Return what a plan request asks.

    Raises
    ------
    InvalidInputError
        If a part of it is impossible; the field is relative to the request.
    """
    if request.body_wrench is not None and request.load is not None:
        raise InvalidInputError("give body_wrench or load, not both", field="body_wrench")
    return Question(
        stance=stance(request.stance),
        body_wrench=None if request.body_wrench is None else np.array(request.body_wrench),
        load=_load(request.load),
        limits=_limits(request.limits),
        want=frozenset(request.want),
    )


def route(request: requests.RouteRequest) -> Route:
    """Return the climb of a route file.

    Raises
    ------
    InvalidInputError
        If a part of it is impossible; the field is relative to the file.
    """
    start = stance(request.stance)
    numbers = start.robot.hand.table
    return Route(
        name=request.name,
        start=start,
        moves=tuple(
            Move(_hand(move, numbers, f"moves[{i}]"), _pose(move.body, f"moves[{i}].body"))
            for i, move in enumerate(request.moves)
        ),
        load=_load(request.load),
        limits=_limits(request.limits),
    )


def stance(message: requests.Stance) -> Stance:
    """Return the stance of a request.

    Raises
    ------
    InvalidInputError
        If a part of it is impossible; the field begins with ``stance``.
    """
    with _within("stance"):
        if message.robot not in ROBOTS:
            raise InvalidInputError(
                f"unknown robot {message.robot!r}; known are {', '.join(ROBOTS)}", field="robot"
            )
        with _within("hand"):
            own = None if message.hand is None else own_hand(ParameterTable.of(message.hand))
            robot = ROBOTS[message.robot](own)
        numbers = robot.hand.table
        return Stance(
            hands=tuple(
                _hand(hand, numbers, f"hands[{i}]") for i, hand in enumerate(message.hands)
            ),
            body=_pose(message.body, "body"),
            gravity=np.array(EARTH if message.gravity is None else message.gravity),
            robot=robot,
        )


def _load(message: requests.Load | None) -> Load:
    message = message or requests.Load()
    return Load(message.mass, message.com, message.acceleration)


def _limits(message: requests.Limits) -> Limits:
    with _within("limits"):
        return Limits(message.utilisation, message.tendon_tension)


def _hand(message: requests.Hand, numbers: ParameterTable, path: str) -> HandOnHold:
    with _within(path):
        with _within("grasp"):
            grasp = Grasp(**msgspec.structs.asdict(message.grasp))
        with _within("surface"):
            surface = _surface(message.surface)
        with _within("hold"):
            hold = _hold(message.hold, numbers)
            hold_pose = _pose(message.hold.pose, "pose")
            hold_in_hand = _pose(message.hold.pose_in_hand, "pose_in_hand")
        return HandOnHold(
            limb=message.limb,
            pose=_pose(message.pose, "pose"),
            hold=hold,
            surface=surface,
            hold_pose=hold_pose,
            hold_in_hand=hold_in_hand,
            grasp=grasp,
            wrist=message.wrist,
            tendon_preload=None
            if message.tendon_preload is None
            else np.array(message.tendon_preload),
        )


@overload
def _pose(message: requests.Pose, field: str) -> Pose: ...
@overload
def _pose(message: requests.Pose | None, field: str) -> Pose | None: ...
def _pose(message: requests.Pose | None, field: str) -> Pose | None:
    if message is None:
        return None
    with _within(field):
        return Pose.from_quaternion(message.position, message.orientation)


def _surface(message: str | requests.Surface) -> Surface:
    if isinstance(message, str):
        return Surface.named(message)
    given = msgspec.structs.asdict(message)
    return Surface.from_values({name: v for name, v in given.items() if v is not None})


def _hold(message: requests.Hold, numbers: ParameterTable) -> holds.Hold:
    match message:
        case requests.Plane():
            return holds.Plane()
        case requests.Cylinder():
            return holds.Cylinder(message.diameter)
        case requests.Sphere():
            return holds.Sphere(message.diameter)
        case requests.Ellipsoid():
            return holds.Ellipsoid(message.semi_axes)
        case requests.Edge():
            return holds.Edge(message.fillet_radius, message.angle)
        case requests.Profile():
            return _profile(message, numbers)
        case requests.Mesh():
            return _mesh(message, numbers)


def _profile(message: requests.Profile, numbers: ParameterTable) -> Profile:
    if message.points is not None and message.profiles is None:
        return Profile(message.points, numbers)
    if message.profiles is not None and message.points is None:
        return Profile(msgspec.structs.asdict(message.profiles), numbers)
    raise InvalidInputError("give points or profiles, one of them", field="points")


def _mesh(message: requests.Mesh, numbers: ParameterTable) -> Mesh:
    if message.file is not None:
        raise InvalidInputError(
            "only the command line reads files; send vertices and faces", field="file"
        )
    if message.vertices is None or message.faces is None:
        missing = "vertices" if message.vertices is None else "faces"
        raise InvalidInputError("missing", field=missing)
    return Mesh(message.vertices, message.faces, numbers)
