"""Support region: where the centre of mass may be while the hands stay where they are.

A mass m whose centre of mass is at c needs the body wrench (F, c × F), with F = m (a − g) for the
body's acceleration a and gravity g. It is affine in c, and does not change where c moves along F.
So the feasible c are a convex prism along F, whose section across F is a plane section of the body
space: `polygon` encloses it. At rest, F is against gravity, and the prism is upright.

Hands, joint angles and payloads stay, and with them the torques of the limbs' own weight: the
region says where the body's mass may be, not where the body can go.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hand_models.base import Array, InvalidInputError, skew
from planner.capability.body_space import BodySpace
from planner.capability.polygon import Polygon, SupportPoint, enclose
from planner.prepare import posture_at
from planner.programs import WRENCH_UNIT

__all__ = ["ComRegion", "com_region"]


@dataclass(frozen=True, eq=False)
class ComRegion:
    """Feasible centres of mass of a stance: a prism, given by its section across the load.

    A point p of world frame W is in the region if ``axes @ p`` is in the polygon, at any height.

    Attributes
    ----------
    axes : ndarray, shape (2, 3)
        Unit vectors in W that span the plane across the load: at rest on the Earth, x and y of W.
    up : ndarray, shape (3,)
        Unit vector in W along the edges of the prism: against gravity, at rest. With the axes it is
        a right-handed frame.
    com : ndarray, shape (3,)
        Centre of mass that the question asks for, in W [m].
    polygon : Polygon or None
        Section of the prism: coordinates along ``axes``, from the origin of W, and gap [m]. None if
        no centre of mass is feasible.
    """

    axes: Array
    up: Array
    com: Array
    polygon: Polygon | None

    @property
    def margin(self) -> float | None:
        """Distance of the centre of mass from the border of the inner polygon [m].

        Negative if the centre of mass is outside the inner polygon; None if there is no polygon.
        """
        if self.polygon is None:
            return None
        ends = self.polygon.inner
        starts, point = np.roll(ends, 1, axis=0), self.axes @ self.com
        edges = ends - starts
        squares = np.maximum(np.sum(edges**2, axis=1), np.finfo(float).tiny)
        parts = np.clip(np.sum((point - starts) * edges, axis=1) / squares, 0.0, 1.0)
        nearest = float(np.linalg.norm(starts + parts[:, None] * edges - point, axis=1).min())
        away = point - starts
        left = edges[:, 0] * away[:, 1] - edges[:, 1] * away[:, 0]
        return nearest if len(ends) > 2 and bool(np.all(left >= 0.0)) else -nearest


def com_region(space: BodySpace) -> ComRegion:
    """Return where the centre of mass of a stance may be: inner and outer polygons, and their gap.

    Parameters
    ----------
    space : BodySpace
        Body space of the stance. Limits, joints, force caps and prescribed hand wrenches of its
        question count; the centre of mass is that of the load's ``mass``, without payloads.

    Raises
    ------
    InvalidInputError
        If the question gives a body wrench, or an angular acceleration, or the load has no weight.
    SolverError
        If a program is not solved.
    """
    question = space.question
    stance, load = question.stance, question.load
    if question.body_wrench is not None:
        raise InvalidInputError(
            "gives no mass, and com_region requires one; give load instead of body_wrench",
            field="body_wrench",
        )
    linear, angular = load.motion(stance)
    if angular.any():
        raise InvalidInputError(
            "must be zero for com_region: with it, the inertia would change with the centre of "
            "mass; leave it out",
            field="load.angular_acceleration",
        )
    force = (stance.robot.mass if load.mass is None else load.mass) * linear
    size = float(np.linalg.norm(force))
    if not size > 0.0:
        raise InvalidInputError(
            "leaves no weight, so that every centre of mass is alike; give gravity, or another "
            "acceleration",
            field="load.acceleration",
        )
    turn = stance.body.rotation
    up = turn @ force / size
    axes = _across(up)
    com = stance.body.apply(_com_in_body(space))
    at = axes @ com

    # a shift of the centre of mass along each axis [m] changes the moment
    columns = np.vstack([np.zeros((3, 2)), -skew(force) @ turn.T @ axes.T]) / WRENCH_UNIT[:, None]

    def touching(normal: Array) -> SupportPoint | None:
        found = space.reached(normal, columns, space.needed, space.cap_at_needed)
        if found is None:
            return None
        return SupportPoint(normal, at + found.t, space.limiting(found.outcome))

    return ComRegion(axes, up, com, enclose(touching))


def _com_in_body(space: BodySpace) -> Array:
    """Return the centre of mass of the load's own mass, in B, shape (3,) [m]."""
    question, angles = space.question, space.plan.joints
    if question.load.com is not None:
        return np.array(question.load.com)
    robot = question.stance.robot
    return robot.com if angles is None else posture_at(question, angles).weights.com


def _across(up: Array) -> Array:
    """Return unit vectors of W across a direction, shape (2, 3); with it a right-handed frame."""
    # the first is along x of W as far as possible, or along y where the direction is along x
    steep = 0.9
    along = np.eye(3)[0 if abs(up[0]) < steep else 1]
    first = along - float(along @ up) * up
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(up, first)])
