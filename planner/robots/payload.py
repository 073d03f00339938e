"""Payloads: masses that a robot carries on its links or in its hands.

`Payload` is part of requests, so importing this module does not load the kinematics libraries.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated

from msgspec import Meta

from hand_models.base import (
    InvalidFieldError,
    InvalidInputError,
    Mass,
    Name,
    Position,
    Strict,
    check_positive,
    errors_under,
)

if TYPE_CHECKING:
    from hand_models.base import Array, Pose
    from planner.robots.robot import Robot

__all__ = ["Payload", "carriers", "check_carrier", "held_up"]


class Payload(Strict, frozen=True):
    """A mass that is fixed to a link, or to a limb's hand, in addition to the robot's mass.

    Attributes
    ----------
    mass : float
        Mass of the payload [kg].
    link : str, optional
        Name of the link in the robot's URDF. Either ``link`` or ``limb`` is given.
    limb : str, optional
        Name of the limb whose hand carries the payload.
    com : tuple of float
        Centre of mass of the payload [m], in the link's frame, or in H of the limb's hand.

    Raises
    ------
    InvalidInputError
        If neither or both of ``link`` and ``limb`` are given, or a number is not valid.
    """

    mass: Mass
    link: Annotated[Name | None, Meta(description="of the robot's URDF; give this or limb")] = None
    limb: Annotated[Name | None, Meta(description="whose hand carries it")] = None
    com: Annotated[
        Position, Meta(description="centre of mass, in the link's frame or in H of the hand [m]")
    ] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        check_positive(self.mass, "kg", "mass")
        if len(self.com) != 3 or not all(map(math.isfinite, self.com)):
            raise InvalidFieldError(f"3 finite numbers are needed, got {self.com}", field="com")
        if (self.link is None) == (self.limb is None):
            raise InvalidFieldError(
                "a payload is on a link or on a limb's hand: give link or limb"
                + ("; neither is given" if self.link is None else ", and not both"),
                field="link",
            )


def held_up(mass: float, place: Array, linear: Array, angular: Array) -> Array:
    """Return the wrench in B that a point mass needs to move with the body, shape (6,) [N, N·m].

    The force ``f = m (a + α × p)`` acts at p; the angular velocity is zero.

    Parameters
    ----------
    mass : float
        Mass m [kg].
    place : ndarray, shape (3,)
        Position p of the mass, in B [m].
    linear : ndarray, shape (3,)
        Acceleration a of B's origin minus that of gravity, in B [m/s²].
    angular : ndarray, shape (3,)
        Angular acceleration α of B, in B [rad/s²].
    """
    import numpy as np

    # by numbers: NumPy's cross product takes twenty times as long, and warns of infinite ones
    (x, y, z), (a, b, c), (p, q, r) = place.tolist(), linear.tolist(), angular.tolist()
    f = mass * (a + q * z - r * y)
    g = mass * (b + r * x - p * z)
    h = mass * (c + p * y - q * x)
    return np.array([f, g, h, y * h - z * g, z * f - x * h, x * g - y * f])


def check_carrier(robot: Robot, payload: Payload) -> None:
    """Reject a payload on a limb or a link that the robot does not have.

    Raises
    ------
    InvalidInputError
        If limb or link is unknown; the error's field is relative to the payload.
    """
    import pinocchio as pin

    if payload.limb is not None:
        if payload.limb not in robot.chains:
            known = ", ".join(robot.limbs)
            raise InvalidInputError(
                f"unknown limb {payload.limb!r}; known are {known}", field="limb"
            )
    elif payload.link is None or not robot.model.existFrame(payload.link, pin.FrameType.BODY):
        links = [each.name for each in robot.model.frames if each.type == pin.FrameType.BODY]
        raise InvalidInputError(
            f"unknown link {payload.link!r}; known are {', '.join(links)}", field="link"
        )


def carriers(
    robot: Robot, angles: Mapping[str, Array], payloads: Sequence[Payload]
) -> list[tuple[Pose, dict[str, Array]]]:
    """Return the frame that carries each payload, in B, and its Jacobians by limb.

    Parameters
    ----------
    robot : Robot
        Robot that carries the payloads.
    angles : mapping of str to ndarray, shape (n,)
        Joint angles, by limb [rad, or m].
    payloads : sequence of Payload
        Payloads on links or in hands.

    Returns
    -------
    list of tuple of Pose and dict of str to ndarray, shape (6, n)
        For each payload: pose in B of its link, or of H of its hand; and the Jacobian of that frame
        in its own axes for each limb's joints, zero for limbs that do not move it [m/rad, 1].

    Raises
    ------
    InvalidInputError
        If a payload's limb or link is unknown; the error's field is relative to the load.
    """
    if not payloads:
        return []
    import pinocchio as pin

    from planner.robots.build import pose_of

    model, data, found, from_root = robot.model, robot.data, [], robot.root.inverse()
    pin.computeJointJacobians(model, data, robot.configuration(angles))
    for i, payload in enumerate(payloads):
        with errors_under(f"payloads[{i}]"):
            check_carrier(robot, payload)
        if payload.limb is not None:
            frame = robot.chains[payload.limb].frame
        else:
            frame = model.getFrameId(payload.link, pin.FrameType.BODY)
        pose = from_root @ pose_of(pin.updateFramePlacement(model, data, frame))
        jacobian = pin.getFrameJacobian(model, data, frame, pin.ReferenceFrame.LOCAL)
        moved = {
            limb: jacobian[:, chain.columns] @ chain.coupling
            for limb, chain in robot.chains.items()
        }
        found.append((pose, moved))
    return found
