"""Answer body-space requests: which body wrenches the hands of a stance together can exert."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, InvalidInputError
from planner import (
    WRENCH_COMPONENTS,
    BodySection,
    BodySpace,
    ComRegion,
    ComSolid,
    End,
    Polygon,
    Question,
    Time,
    com_region,
    com_solid,
)
from service import replies
from service.answering.answers import finite, placed_poses
from service.answering.own_models import BUNDLED_ROBOTS, Robots
from service.answering.questions import question
from service.replies import BodySpaceReply
from service.requests import BodySpaceRequest, PlanRequest

__all__ = ["Explored", "explore", "find_com_region"]


class Explored(NamedTuple):
    """A body space, the section that the request wants, and the reply to the client.

    Attributes
    ----------
    space : BodySpace
        The planner's set of body wrenches.
    section : BodySection
        Polygon of the body space in the plane of the request's two axes.
    reply : BodySpaceReply
        Capability, section and accelerations as plain lists and numbers.
    region : ComRegion or None
        Where the centre of mass may be, if the request wants it.
    solid : ComSolid or None
        Where it may be under the request's ``com_accelerations``, too, if there is such a place.
    """

    space: BodySpace
    section: BodySection
    reply: BodySpaceReply
    region: ComRegion | None = None
    solid: ComSolid | None = None


def explore(request: BodySpaceRequest, robots: Robots = BUNDLED_ROBOTS) -> Explored:
    """Compute the body space of a stance: extents, one section, and largest accelerations.

    Parameters
    ----------
    request : BodySpaceRequest
        Stance, body wrench or load, limits, the section's axes, and directions of acceleration.
    robots : Robots, optional
        Robots that a request may name, with the functions that build them; bundled robots by
        default.

    Returns
    -------
    Explored
        Body space, section, and the reply.

    Raises
    ------
    InvalidInputError
        If the request is impossible. The error's ``field`` is a path in the request.
    SolverError
        If the solution of an optimisation problem does not pass its checks.
    """
    start = time.perf_counter()
    directions = [_unit(given, f"directions[{i}]") for i, given in enumerate(request.directions)]
    planned = PlanRequest(
        v=1,
        stance=request.stance,
        body_wrench=request.body_wrench,
        load=request.load,
        limits=request.limits,
        present=request.present,
    )
    asked = question(planned, robots)
    space = BodySpace(asked)
    modelled = time.perf_counter()
    section = space.section(request.axes, request.others)
    ways = _ways(WRENCH_COMPONENTS, np.eye(6))
    extents = {name: space.support(way) for name, way in ways.items()}
    error = space.linearisation_error([end for end in extents.values() if end is not None])
    capability = {
        name: _capability(space.more(way), space.pure(way), extents[name])
        for name, way in ways.items()
    }
    linear = _accelerations(space, _ways("xyz", np.eye(3)))
    about_axes = np.eye(6)[3:]
    turning = _accelerations(space, _ways("xyz", about_axes)) if space.turns else None
    along = [_acceleration(space, direction) for direction in directions]
    region = com_region(space) if "com_region" in request.want else None
    solid = _solid(asked, request)
    ended = time.perf_counter()
    found = space.plan
    reply = BodySpaceReply(
        id=request.id,
        poses=placed_poses(asked.stance),
        robot=asked.stance.robot.name,
        status=found.status,
        reason=found.reason,
        body_wrench=space.needed.tolist(),
        utilisation=finite(found.utilisation),
        exact=space.exact,
        linearisation_error=error,
        error=error,
        capability=capability,
        section=_section(section),
        acceleration=linear,
        angular_acceleration=turning,
        along=None if linear is None else [one for one in along if one is not None],
        time=Time(modelled - start, ended - modelled, ended - start),
        warnings=[*found.warnings, *_warnings(space, linear is not None, error)],
        findings=list(found.findings),
    )
    if region is not None:
        reply.com_region = _region(region, space.exact)
        reply.com_region.solid = None if solid is None else _solid_reply(solid)
    return Explored(space, section, reply, region, solid)


def find_com_region(asked: Question) -> replies.ComRegionReply:
    """Return where the centre of mass of a question's stance may be.

    Raises
    ------
    InvalidInputError
        If the question gives a body wrench, or an angular acceleration, or the load has no weight.
    SolverError
        If the solution of an optimisation problem does not pass its checks.
    DeadlineError
        If the deadline leaves no time for it.
    """
    space = BodySpace(asked)
    return _region(com_region(space), space.exact)


def _region(region: ComRegion, exact: bool) -> replies.ComRegionReply:
    reply = replies.ComRegionReply(
        axes=region.axes.tolist(),
        up=region.up.tolist(),
        com=region.com.tolist(),
        inner=[],
        outer=[],
        gap=None,
        limiting=[],
        margin=region.margin,
        exact=exact,
    )
    _fill(reply, region.polygon)
    return reply


def _solid(asked: Question, request: BodySpaceRequest) -> ComSolid | None:
    given = request.com_accelerations
    if not given:
        return None
    if "com_region" not in request.want:
        raise InvalidInputError("requires com_region in want; add it", field="com_accelerations")
    return com_solid(asked, given)


def _solid_reply(found: ComSolid) -> replies.ComSolidReply:
    parts = (found.accelerations, found.inner, found.outer)
    accelerations, inner, outer = (part.tolist() for part in parts)
    return replies.ComSolidReply(
        accelerations=accelerations,
        inner=inner,
        outer=outer,
        gap=found.gap,
        margin=found.margin,
    )


def _fill(
    reply: replies.ComRegionReply | replies.BodySectionReply, polygon: Polygon | None
) -> None:
    """Write a polygon into a reply that has none."""
    if polygon is not None:
        reply.inner, reply.outer = polygon.inner.tolist(), polygon.outer.tolist()
        reply.gap, reply.limiting = finite(polygon.gap), list(polygon.limiting)


def _unit(given: Sequence[float], field: str) -> Array:
    direction = np.array(given)
    length = float(np.linalg.norm(direction))
    if not length > 0.0:
        raise InvalidInputError("a direction that is not zero is needed", field=field)
    return np.asarray(direction / length)


def _ways(names: Iterable[str], units: Array) -> dict[str, Array]:
    """Return unit vectors and their opposites, by sign and name."""
    pairs = list(zip(names, units, strict=True))
    return {f"{s}{name}": f * way for name, way in pairs for s, f in (("+", 1.0), ("-", -1.0))}


def _capability(more: End | None, pure: End | None, extent: End | None) -> replies.BodyCapability:
    end = more or extent
    return replies.BodyCapability(
        more=None if more is None else max(more.reach, 0.0),
        pure=None if pure is None else pure.reach,
        extent=None if extent is None else extent.reach,
        limiting=None if end is None else end.limiting,
    )


def _section(section: BodySection) -> replies.BodySectionReply:
    reply = replies.BodySectionReply(
        axes=list(section.axes), others=section.others, inner=[], outer=[], gap=None, limiting=[]
    )
    _fill(reply, section.polygon)
    return reply


def _accelerations(
    space: BodySpace, ways: dict[str, Array]
) -> dict[str, replies.Acceleration] | None:
    """Return the largest acceleration along each way; None where there are none."""
    found = {}
    for name, way in ways.items():
        one = _acceleration(space, way)
        if one is None:
            return None
        found[name] = one
    return found


def _acceleration(space: BodySpace, way: Array) -> replies.Acceleration | None:
    end = space.acceleration(way) if space.accelerates else None
    if end is None:
        return None
    # a way has three components, or six of which the last three turn
    return replies.Acceleration(
        direction=way[-3:].tolist(),
        acceleration=max(end.reach, 0.0),
        limiting=end.limiting,
    )


def _warnings(space: BodySpace, moves: bool, error: float) -> Iterator[str]:
    if not space.exact:
        yield (
            "wrists that move: what their hands hold is linearised where the plan puts them; at "
            f"the extents the exact model differs by up to {error:.1f} N (moments over 0.1 m)"
        )
    if not moves and space.accelerates:
        yield "no accelerations: the body cannot be held at rest"
    elif not moves:
        yield "no accelerations: a body wrench does not determine the mass; give a load instead"
