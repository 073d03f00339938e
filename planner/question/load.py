"""Load of a robot: its mass, payloads and acceleration, and the body wrench that they need.

A load is a msgspec struct, so that it can be sent; numerical libraries are imported when needed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, NamedTuple

from msgspec import Meta

from hand_models.base import (
    Acceleration,
    AccelerationEntry,
    InvalidInputError,
    Mass,
    Position,
    Strict,
    check_positive,
    errors_under,
)
from planner.robots import Payload

if TYPE_CHECKING:
    from hand_models.base import Array
    from planner.question.stance import Stance

__all__ = ["Load", "Weights"]


class Weights(NamedTuple):
    """Weight of a robot whose joint angles are known.

    Attributes
    ----------
    body_wrench : ndarray, shape (6,)
        Wrench that the rock must exert for the weight and acceleration of the robot's links,
        without payloads, in the body frame B [N, N·m].
    com : ndarray, shape (3,)
        Centre of mass of the links, in B [m].
    payloads : ndarray, shape (p, 3)
        Positions of the load's payloads, in B [m].
    """

    body_wrench: Array
    com: Array
    payloads: Array


class Load(Strict, frozen=True):
    """Mass, payloads and acceleration of the body; by default the robot's weight, at rest.

    Attributes
    ----------
    mass : float, optional
        Mass of the robot with its hands [kg]; by default that of the robot's file. If joints are
        known, the difference from the robot's file acts at the centre of mass of the posture.
    com : tuple of float, optional
        Centre of mass in the body frame B [m]; by default that of the posture if joints are known,
        else that of the robot's file.
    acceleration, angular_acceleration : tuple of float
        Accelerations of the body in the world frame W [m/s², rad/s²]; its angular velocity is
        zero. An angular acceleration requires joints, which give the inertia, and no ``com``.
    payloads : tuple of Payload
        Masses on links or in hands, in addition to ``mass``.
    """

    mass: Annotated[
        Mass | None,
        Meta(
            description="of the robot with its hands [kg]; its file's by default. A mass alone is "
            "weighed at the posture's centre of mass where joints are known"
        ),
    ] = None
    com: Annotated[
        Position | None,
        Meta(
            description="centre of mass in B; by default the posture's where joints are known, "
            "else that of the robot's file"
        ),
    ] = None
    acceleration: Acceleration = (0.0, 0.0, 0.0)
    angular_acceleration: Annotated[
        tuple[AccelerationEntry, AccelerationEntry, AccelerationEntry],
        Meta(description="in W [rad/s²]; requires stance.joints, and a load without com"),
    ] = (0.0, 0.0, 0.0)
    payloads: Annotated[
        tuple[Payload, ...],
        Meta(
            max_length=64,
            description="masses on links or in hands, beside mass; they count in the body wrench "
            "and in the joints' torques",
        ),
    ] = ()

    @property
    def own(self) -> bool:
        """True if neither mass nor centre of mass is given, so that those of the robot count."""
        return self.mass is None and self.com is None

    def body_wrench(self, stance: Stance, weights: Weights | None = None) -> Array:
        """Return the body wrench: what the rock must exert on the robot, in B, shape (6,) [N, N·m].

        The force is ``m (a − g)`` at the centre of mass: mass m, acceleration a, gravity g. Each
        payload adds the same at its position.

        Parameters
        ----------
        stance : Stance
            Poses of the body and of the hands on their holds.
        weights : Weights, optional
            Weight of the robot, if joints are known.

        Raises
        ------
        InvalidInputError
            If a value is invalid, or needs joints that are not known; the field is relative to the
            load.
        """
        from hand_models.base import finite_vector
        from planner.question.stance import checked_body_wrench
        from planner.robots import held_up

        own = stance.robot.mass
        mass = own if self.mass is None else self.mass
        check_positive(mass, "kg", "mass")
        given = None if self.com is None else finite_vector(self.com, 3, "com")
        linear, angular = self.motion(stance)
        if angular.any() and (weights is None or given is not None):
            lacks = "give joints" if weights is None else "remove com"
            raise InvalidInputError(
                f"requires stance.joints, and a load without com: {lacks}",
                field="angular_acceleration",
            )
        if given is not None or weights is None:
            found = held_up(mass, stance.robot.com if given is None else given, linear, angular)
        else:
            found = weights.body_wrench + held_up(mass - own, weights.com, linear, angular)
        places = self.payload_places(stance) if weights is None else weights.payloads
        for payload, place in zip(self.payloads, places, strict=True):
            found = found + held_up(payload.mass, place, linear, angular)
        return checked_body_wrench(found, None)

    def motion(self, stance: Stance) -> tuple[Array, Array]:
        """Return the body's linear acceleration minus gravity, and its angular acceleration.

        Returns
        -------
        linear, angular : ndarray, shape (3,)
            Accelerations of the origin of body frame B, in B [m/s², rad/s²].
        """
        from hand_models.base import finite_vector

        into_body = stance.body.rotation.T
        acceleration = finite_vector(self.acceleration, 3, "acceleration")
        angular = finite_vector(self.angular_acceleration, 3, "angular_acceleration")
        return into_body @ (acceleration - stance.gravity), into_body @ angular

    def payload_places(self, stance: Stance) -> Array:
        """Return the positions of payloads if joints are not known, in B, shape (p, 3) [m].

        Raises
        ------
        InvalidInputError
            If a payload is neither on the body nor in a hand of the stance; the field is relative
            to the load.
        """
        import numpy as np

        from planner.robots import check_carrier

        hands = {hand.limb: hand.pose for hand in stance.hands}
        body, places = stance.body.inverse(), []
        for i, payload in enumerate(self.payloads):
            with errors_under(f"payloads[{i}]"):
                check_carrier(stance.robot, payload)
                if payload.link == stance.robot.description.body:
                    places.append(np.array(payload.com))
                elif payload.limb in hands:
                    places.append((body @ hands[payload.limb]).apply(np.array(payload.com)))
                else:
                    raise InvalidInputError(
                        "the payload's position depends on joint angles: add stance.joints, or "
                        f"attach the payload to {stance.robot.description.body!r} or a hand of the "
                        "stance",
                        field="link" if payload.limb is None else "limb",
                    )
        return np.array(places).reshape(-1, 3)
