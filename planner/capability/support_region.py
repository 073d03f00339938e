"""Support region: where the centre of mass may be while the hands stay where they are.

A mass m whose centre of mass is at c needs the body wrench (F, c × F), with F = m (a − g) for the
body's acceleration a and gravity g. It is affine in c, and does not change where c moves along F.
So the feasible c are a convex prism along F, whose section across F is a plane section of the body
space: `polygon` encloses it. At rest, F is against gravity, and the prism is upright.

Under several accelerations, which tilt the prisms, the centre of mass must be in all of them: in a
solid that is bounded in three dimensions. Where c is feasible under each, it is under every
acceleration in their convex hull.

Hands, joint angles and payloads stay, and with them the torques of the limbs' own weight: the
region says where the body's mass may be, not where the body can go.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from msgspec import structs

from hand_models.base import Array, EmptySetError, InvalidInputError, finite_vector, skew
from hand_models.wrench_spaces import largest_ball
from planner.capability.body_space import BodySpace
from planner.capability.polygon import Polygon, SupportPoint, enclose
from planner.prepare import posture_at
from planner.programs import WRENCH_UNIT
from planner.question import Question

__all__ = ["ComRegion", "ComSolid", "com_region", "com_solid"]

LEAST_ROOM: Final = 1e-4
"""Radius of the ball that a solid has room for at least [m]: that of a polygon's gap."""


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


@dataclass(frozen=True, eq=False)
class ComSolid:
    """Centres of mass that are feasible under several accelerations: a solid in three dimensions.

    Attributes
    ----------
    accelerations : ndarray, shape (k, 3)
        Accelerations of the body in W, that of the question's load first [m/s²].
    inner : ndarray, shape (n, 3)
        Vertices of a polytope in W within which every centre of mass is feasible under all
        accelerations in their convex hull [m].
    outer : ndarray, shape (m, 3)
        Vertices of a polytope outside which none is [m].
    gap : float
        Largest distance of a point of the outer polytope from the inner one [m].
    margin : float
        Distance of the centre of mass asked for from the inner polytope's surface [m], negative
        outside.
    """

    accelerations: Array
    inner: Array
    outer: Array
    gap: float
    margin: float

    def section(self, region: ComRegion) -> Array | None:
        """Return where the inner polytope is cut at the height of the centre of mass asked for.

        Parameters
        ----------
        region : ComRegion
            Region of the same stance: its axes, its direction up, and its centre of mass.

        Returns
        -------
        ndarray, shape (n, 2), or None
            Corners along the region's axes [m], counterclockwise; None where the polytope
            has no room above it, or none below it.
        """
        from scipy.spatial import ConvexHull

        heights = (self.inner - region.com) @ region.up
        above, below = np.flatnonzero(heights > 0.0), np.flatnonzero(heights <= 0.0)
        if heights.max() < LEAST_ROOM or heights.min() > -LEAST_ROOM:
            return None
        i, j = (part.ravel() for part in np.meshgrid(above, below))
        share = (heights[i] / (heights[i] - heights[j]))[:, None]
        # each corner of the section is on an edge, which joins a vertex above with one below
        crossings = ((1.0 - share) * self.inner[i] + share * self.inner[j]) @ region.axes.T
        return np.asarray(crossings[ConvexHull(crossings).vertices])


def com_solid(
    question: Question, com_accelerations: Sequence[Sequence[float] | Array]
) -> ComSolid | None:
    """Return where the centre of mass may be while the body takes each of several accelerations.

    Parameters
    ----------
    question : Question
        As for `com_region`; the acceleration of its load counts, too.
    com_accelerations : sequence of array_like, shape (3,)
        Accelerations of the body in W [m/s²].

    Returns
    -------
    ComSolid or None
        None if no centre of mass with room around it is feasible under all accelerations.

    Raises
    ------
    InvalidInputError
        If all accelerations are along gravity, so that the solid has no end there; or as for
        `com_region`.
    SolverError
        If a program is not solved.
    """
    given = [
        finite_vector(a, 3, f"com_accelerations[{i}]") for i, a in enumerate(com_accelerations)
    ]
    whole = np.vstack([np.array(question.load.acceleration), *given])
    regions = []
    for x, y, z in whole.tolist():
        load = structs.replace(question.load, acceleration=(x, y, z))
        regions.append(com_region(BodySpace(replace(question, load=load, explain=False))))
    ups = np.stack([region.up for region in regions])
    least_tilt = 1e-3  # [rad] between loads that are not parallel: a prism of a kilometre
    if np.linalg.norm(np.cross(ups[0], ups), axis=1).max() < least_tilt:
        raise InvalidInputError(
            "are all along gravity, so that the solid has no end in height; give others, too",
            field="com_accelerations",
        )
    com = regions[0].com
    try:
        A, b = _half_spaces(regions, "inner", com)
        inner, outer = _vertices(A, b), _vertices(*_half_spaces(regions, "outer", com))
    except EmptySetError:
        return None
    gap = max(_distance(A, b, point) for point in outer)
    within = float(b.min())
    margin = within if within >= 0.0 else -_distance(A, b, np.zeros(3))
    return ComSolid(whole, com + inner, com + outer, gap, margin)


def _half_spaces(
    regions: Sequence[ComRegion], which: Literal["inner", "outer"], origin: Array
) -> tuple[Array, Array]:
    """Return A, b of the points p with A (p − origin) ≤ b that are in the polygons of all regions.

    Raises
    ------
    EmptySetError
        If a polygon is empty, a point or a segment.
    """
    normals, offsets = [], []
    for region in regions:
        corners = np.zeros((0, 2)) if region.polygon is None else getattr(region.polygon, which)
        if len(corners) < 3:
            raise EmptySetError("a region of the centre of mass has no area")
        edges = np.roll(corners, -1, axis=0) - corners
        outward = np.column_stack([edges[:, 1], -edges[:, 0]])
        outward /= np.linalg.norm(outward, axis=1)[:, None]
        normals.append(outward @ region.axes)
        offsets.append(np.sum(outward * corners, axis=1) - normals[-1] @ origin)
    return np.vstack(normals), np.concatenate(offsets)


def _vertices(A: Array, b: Array) -> Array:
    """Return the vertices (n, 3) of { p : A p ≤ b }, bounded; rows of unit length.

    Raises
    ------
    EmptySetError
        If no ball of `LEAST_ROOM` is inside.
    """
    from scipy.spatial import HalfspaceIntersection

    ball = largest_ball(A, b, "the region of the centre of mass")
    if ball is None or ball[-1] < LEAST_ROOM:
        raise EmptySetError("the regions of the centre of mass have no room in common")
    found = HalfspaceIntersection(np.column_stack([A, -b]), ball[:3]).intersections
    return found[np.unique(found.round(9), axis=0, return_index=True)[1]]


def _distance(A: Array, b: Array, point: Array) -> float:
    """Return the distance of a point from { p : A p ≤ b } (least distance programming)."""
    from scipy.optimize import nnls

    # Lawson and Hanson, Solving Least Squares Problems, chapter 23
    E, f = np.vstack([-A.T, A @ point - b]), np.array([0.0, 0.0, 0.0, 1.0])
    rest = E @ nnls(E, f)[0] - f
    return float(np.linalg.norm(rest[:3] / rest[3]))


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
