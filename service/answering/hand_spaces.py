"""Answer wrench-space requests: which wrenches one hand of a stance can exert on its hold."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, TypeVar

import numpy as np

from hand_models.base import Array, EmptySetError, InvalidInputError, LimitError
from hand_models.finger import PHALANGES
from hand_models.fixed_wrist import (
    Robustness,
    force_directions,
    impossible_forces,
    robustness,
    tension_limits,
)
from hand_models.hand import FINGERS, SettledHand, SettledTile, closing_sequence, nearby_closures
from hand_models.opening import HandPath, clear_retreat, opening_path
from hand_models.wrench_spaces import WrenchSpace
from planner import WristPlan, deadline, resting_hand
from service import replies
from service.answering.answers import (
    finite,
    placed_poses,
    seating_reply,
    wrench_set_reply,
    wrist_reply,
)
from service.answering.own_models import BUNDLED_ROBOTS, Robots
from service.answering.stances import stance
from service.replies import WRENCH_AXES, WrenchSpaceReply
from service.requests import SpaceWant, WrenchSpaceRequest

__all__ = ["answer_wrench_space"]

View = TypeVar("View")

PURE_WAYS: Final = tuple(f"{sign}{axis}" for sign in "+-" for axis in WRENCH_AXES[:3])
"""Signs and axes of forces."""


def answer_wrench_space(
    request: WrenchSpaceRequest, robots: Robots = BUNDLED_ROBOTS
) -> WrenchSpaceReply:
    """Compute the wrench space of one hand of a stance.

    Parameters
    ----------
    request : WrenchSpaceRequest
        Stance, the limb of the hand, and which views of the set are wanted.
    robots : Robots, optional
        Robots that a request may name, with the functions that build them; bundled robots by
        default.

    Returns
    -------
    WrenchSpaceReply
        Contacts and closures of the hand, generators and rows of the set, and as wanted its
        vertices, half-spaces (convex hull), capability, and capability at uncertain places.

    Raises
    ------
    InvalidInputError
        If the request is impossible. The error's ``field`` is a path in the request.
    UnsupportedError
        If the hand's wrist is compliant: the set is then no polyhedron.
    LimitError
        If a wanted view would take too long.
    SolverError
        If a view could not be computed.
    """
    asked = stance(request.stance, robots)
    step = "the hand's wrench space was known"
    deadline.check(step)
    hand = resting_hand(asked, request.limb)
    settled = hand.settled
    deadline.check(step)
    wrist = None if hand.palm is None else WristPlan(np.zeros(6), 1, hand.error, hand.palm)
    named = wrench_set_reply(hand.space)
    reply = WrenchSpaceReply(
        id=request.id,
        poses=placed_poses(asked),
        robot=asked.robot.name,
        limb=request.limb,
        wrist=wrist_reply(wrist),
        seating=seating_reply(settled.seating),
        contacts=_contacts(settled),
        closing=[],
        tension_limits=[
            replies.TensionLimitReply(
                finger=each.finger, tension=finite(each.tension), phalanx=each.phalanx
            )
            for each in tension_limits(settled)
        ],
        origin=named.origin,
        generators=named.generators,
        rows=named.rows,
        vertices=None,
        half_spaces=None,
        dimension=None,
        capability=None,
    )
    _add_views(reply, hand.space, request.want)
    for name in ("robust", "opening"):
        if name in (request.want or ()) and hand.palm is not None:
            raise InvalidInputError(
                f"{name!r} requires fixed wrists on all hands; that of {request.limb} is not "
                f"fixed: give it wrist 'fixed', or remove {name!r}",
                field="want",
            )
    if "opening" in (request.want or ()):
        deadline.check("it was known how the hand lets go")
        reply.opening = _opening(opening_path(settled), clear_retreat(settled))
    if "robust" in (request.want or ()):
        both_ways = np.vstack([np.eye(len(WRENCH_AXES)), -np.eye(len(WRENCH_AXES))])
        pure = force_directions(PURE_WAYS)
        reply.robust = _robust(robustness(asked.robot.hand, settled, both_ways, pure=pure))
    reply.closing = _closings(settled)
    return reply


def _contacts(settled: SettledHand) -> list[replies.ContactReply]:
    """Return the contact of each tile with the rock."""
    frames = settled.hand.frames(settled.grasp.outer_rotation)
    places = zip(
        settled.tiles,
        [frames[finger] for finger in settled.finger_of.tolist()],
        settled.positions,
        settled.engagement.tolist(),
        settled.axes.tolist(),
        strict=True,
    )
    return [
        replies.ContactReply(
            finger=tile.finger,
            phalanx=tile.phalanx,
            contact=tile.contact,
            stop=_stop(settled, tile),
            position=position.tolist(),
            engagement=share,
            # a picometre is rounding
            across=round(float((position - frame.joint) @ frame.across), 12) + 0.0,
            shear_axis=shear,
            normal_axis=normal,
            lateral_axis=lateral,
        )
        for tile, frame, position, share, (shear, normal, lateral) in places
    ]


def _stop(settled: SettledHand, tile: SettledTile) -> str | None:
    if tile.phalanx not in PHALANGES:
        return None
    finger = settled.fingers[FINGERS.index(tile.finger)]
    return finger.contacts[PHALANGES.index(tile.phalanx)].stop


def _closings(settled: SettledHand) -> list[replies.ClosingSequenceReply]:
    """Return the closure of each finger, and those for rock a little elsewhere."""
    return [
        replies.ClosingSequenceReply(
            finger=closing.finger,
            stages=[
                replies.ClosingStageReply(part=each.part, starts=each.starts, ends=each.ends)
                for each in closing.stages
            ],
            in_order=bool(closing.in_order),
            closure=closing.closure,
            nearby=list(there.closures),
            nearby_turn=float(there.turn),
        )
        for closing, there in zip(closing_sequence(settled), nearby_closures(settled), strict=True)
    ]


def _robust(found: Robustness) -> replies.RobustCapability:
    return replies.RobustCapability(
        draws=found.draws,
        without=found.without,
        position=found.position,
        angle=found.angle,
        contact_position=found.contact[0] if found.contact else None,
        contact_angle=found.contact[1] if found.contact else None,
        seed=found.seed,
        worst=_by_side(found.worst),
        tenth=_by_side(found.tenth),
        hundredth=_by_side(found.hundredth),
        pure_tenth=dict(zip(PURE_WAYS, found.pure_tenth.tolist(), strict=True)),
        share=dict(zip(PURE_WAYS, found.share.tolist(), strict=True)),
        force=found.force,
    )


def _opening(path: HandPath, retreat: float | None) -> replies.OpeningReply:
    straight = np.vstack([np.zeros(len(WRENCH_AXES)), path.deviation])
    columns = path.tensions, path.wrenches, path.joints, path.engagement, straight
    return replies.OpeningReply(
        knots=[
            replies.OpeningKnot(
                tensions=tensions, wrench=wrench, joints=joints, engagement=shares, deviation=off
            )
            for tensions, wrench, joints, shares, off in zip(
                *(each.tolist() for each in columns), strict=True
            )
        ],
        events=[
            replies.TileEventReply(finger=each.finger, phalanx=each.phalanx, tension=each.tension)
            for each in path.events
        ],
        jammed=[
            replies.JamReply(finger=each.finger, friction=each.friction, reason=each.reason)
            for each in path.jammed
        ],
        resting=list(path.resting),
        friction=path.friction,
        retreat=retreat,
    )


def _by_side(reaches: Array) -> dict[str, float | None]:
    sides = (f"{sign}{axis}" for sign in "+-" for axis in WRENCH_AXES)
    return dict(zip(sides, map(finite, reaches), strict=True))


def _add_views(
    reply: WrenchSpaceReply, space: WrenchSpace, want: Sequence[SpaceWant] | None
) -> None:
    """Add vertices, half-spaces and capability of a set at utilisation 1, unless it is empty.

    Parameters
    ----------
    reply : WrenchSpaceReply
    space : WrenchSpace
    want : sequence of SpaceWant, optional
        Vertices and half-spaces that are not among them are left out. By default both are
        included if they do not cost too much.

    Raises
    ------
    InvalidInputError
        If something is wanted twice.
    LimitError
        If a wanted view would cost too much.
    SolverError
        If a view could not be computed.
    """
    for i, name in enumerate(want or ()):
        if name in (want or ())[:i]:
            raise InvalidInputError(f"{name} is given twice; give it once", field=f"want[{i}]")
    less = 'use fewer half_planes, or "lateral": false in the grasp'
    # candidates for one view: less than a second's work, and some megabytes of reply
    most = 30_000
    # the hand is closed anew at each sampled place; 16 half-planes have 535 rows
    most_rows = 600
    if "robust" in (want or ()) and len(space.rows) > most_rows:
        raise LimitError(
            f"robust: {len(space.rows)} rows at each place are too many (at most {most_rows}); "
            f"{less}, or leave 'robust' out",
            field="want",
        )

    def view(
        name: SpaceWant, candidates: Callable[[], int], found: Callable[[], View]
    ) -> View | None:
        """Return a view if it is wanted; one that costs too much is refused, or left out."""
        if want is not None and name not in want:
            return None
        try:
            if (size := candidates()) > most:
                raise LimitError(
                    f"{size} candidates for {name} are too many (at most {most}): {less}"
                )
            return found()
        except LimitError as error:
            why = error.message
        if want is not None:
            raise LimitError(f"{name}: {why}, or leave {name} out", field="want")
        reply.warnings = [*reply.warnings, f"{name} left out: {why}"]
        return None

    try:
        reply.vertices = view(
            "vertices", lambda: space.sizes().vertices, lambda: space.vertices().tolist()
        )
        reply.half_spaces = view(
            "half_spaces", lambda: space.sizes().half_spaces, lambda: _half_spaces(space)
        )
        reply.dimension = space.dimension if space.listed else None
        reply.capability = _capability(space)
        reply.cannot = impossible_forces(
            {way: end.pure for way, end in reply.capability.items()},
            {way: end.extent for way, end in reply.capability.items()},
        )
    except EmptySetError:
        reply.vertices = [] if want is None or "vertices" in want else None
        reply.half_spaces = reply.dimension = reply.capability = None
        reply.warnings = []


def _half_spaces(space: WrenchSpace) -> replies.HalfSpacesReply:
    deadline.check("it was known how far the hand's set reaches")
    faces = space.half_spaces()
    return replies.HalfSpacesReply(
        normals=faces.normals.tolist(),
        offsets=faces.offsets.tolist(),
        equations=replies.HalfSpaceEquations(
            normals=faces.equation_normals.tolist(), offsets=faces.equation_offsets.tolist()
        ),
    )


def _capability(space: WrenchSpace) -> dict[str, replies.AxisCapability]:
    reaches = {}
    for axis, direction in zip(WRENCH_AXES, np.eye(len(WRENCH_AXES)), strict=True):
        deadline.check("it was known how far the hand's set reaches")
        ends = space.capability(direction)
        low, high = (None, None) if ends is None else (-float(ends[0]), float(ends[1]))
        for sign, pure, way in (("+", high, direction), ("-", low, -direction)):
            reaches[f"{sign}{axis}"] = replies.AxisCapability(
                pure=pure, extent=float(space.support(way))
            )
    return reaches
