"""What one hand of a stance can carry, on its way from a request to a reply."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from hand_models.base import EmptySetError, InvalidInputError, LimitError
from hand_models.finger import PHALANGES
from hand_models.fixed_wrist import Robustness, robustness, tension_limits
from hand_models.hand import FINGERS, SettledHand, Tile, closing_sequence, nearby_closures
from hand_models.wrench_spaces import WrenchSpace
from planner import WristPlan, deadline, resting_hand
from service import replies
from service.answering.hand_answers import (
    placed_poses,
    plain,
    seating_reply,
    told,
    wrench_set_reply,
    wrist_reply,
)
from service.answering.own_models import ROBOTS, Robots
from service.answering.questions import stance
from service.replies import AXES, WrenchSpaceReply
from service.requests import SpaceWant, WrenchSpaceRequest

__all__ = ["wrench_space"]

KNOWN: Final = "the hand's wrench space was known"
REACH: Final = "it was known how far the hand's set reaches"
"""What a deadline may come before."""

MOST: Final = 30_000
"""Of vertices and of half-spaces, how many candidates are gone through for one set: less than a
second's work, and some megabytes of reply."""

LESS: Final = 'take fewer half_planes of its surface, or "lateral": false in its grasp'

MOST_ROWS: Final = 600
"""Rows of a hand that is closed anew at the places of its scatter: 16 half-planes have 535."""

SIDES: Final = tuple(f"{sign}{axis}" for sign in "+-" for axis in AXES)
"""Names of both directions along each axis, in the order of `BOTH_WAYS`."""

BOTH_WAYS: Final = np.vstack([np.eye(len(AXES)), -np.eye(len(AXES))])


def wrench_space(request: WrenchSpaceRequest, robots: Robots = ROBOTS) -> WrenchSpaceReply:
    """Answer a wrench-space request; parameters as for `plan`.

    Raises
    ------
    InvalidInputError
        If the request is impossible, or would cost too much.
    """
    asked = stance(request.stance, robots)
    deadline.check(KNOWN)
    hand = resting_hand(asked, request.limb)
    settled = hand.settled
    deadline.check(KNOWN)
    views = _views(hand.space, request.want)
    more = {}
    if "robust" in (request.want or ()):
        if hand.palm is not None:
            raise InvalidInputError("robust is told of hands with fixed wrists only", field="want")
        more["robust"] = _robust(robustness(asked.robot.hand, settled, BOTH_WAYS))
    wrist = None if hand.palm is None else WristPlan(np.zeros(6), hand.palm, 1, hand.error)
    places = zip(settled.tiles, settled.positions, settled.axes, strict=True)
    return told(
        WrenchSpaceReply,
        wrench_set_reply(hand.space),
        id=request.id,
        poses=placed_poses(asked),
        robot=asked.robot.name,
        limb=request.limb,
        wrist=wrist_reply(wrist),
        seating=seating_reply(settled.seating),
        contacts=[
            replies.Contact(*tile, _stop(settled, tile), *plain((position, *axes)))
            for tile, position, axes in places
        ],
        closing=_closings(settled),
        tension_limits=[replies.TensionLimit(*plain(each)) for each in tension_limits(settled)],
        **views,
        **more,
    )


def _closings(settled: SettledHand) -> list[replies.ClosingSequence]:
    """Return how each finger has closed, and how else it would."""
    return [
        told(
            replies.ClosingSequence,
            closing,
            stages=[replies.ClosingStage(*stage) for stage in closing.stages],
            nearby=list(there.closures),
            nearby_turn=there.turn,
        )
        for closing, there in zip(closing_sequence(settled), nearby_closures(settled), strict=True)
    ]


def _robust(found: Robustness) -> replies.RobustCapability:
    names = "worst", "tenth", "hundredth"
    reaches = {
        name: dict(zip(SIDES, map(plain, getattr(found, name).tolist()), strict=True))
        for name in names
    }
    return told(replies.RobustCapability, found, **reaches)


def _stop(settled: SettledHand, tile: Tile) -> str | None:
    if tile.phalanx not in PHALANGES:
        return None
    finger = settled.fingers[FINGERS.index(tile.finger)]
    return finger.contacts[PHALANGES.index(tile.phalanx)].stop


def _views(space: WrenchSpace, want: Sequence[SpaceWant] | None) -> dict[str, Any]:
    """Return what a reply says of a set at utilisation 1; None where nothing is left.

    Parameters
    ----------
    space : WrenchSpace
    want : sequence of SpaceWant, optional
        Vertices and half-spaces that are not among them are left out. By default both are told
        where `MOST` allows.

    Raises
    ------
    InvalidInputError
        If something is wanted twice.
    LimitError
        If what is wanted would take more than `MOST`.
    SolverError
        If a view could not be computed.
    """
    for i, name in enumerate(want or ()):
        if name in (want or ())[:i]:
            raise InvalidInputError(f"{name} is given twice", field=f"want[{i}]")
    if "robust" in (want or ()) and len(space.rows) > MOST_ROWS:
        raise LimitError(
            f"robust: {len(space.rows)} rows at each place are too many (at most {MOST_ROWS}); "
            f"{LESS}, or leave it out",
            field="want",
        )
    views: dict[str, Any] = dict.fromkeys((*VIEWS, "dimension", "capability"))
    warnings = []
    try:
        for view, told_of in VIEWS.items():
            if want is not None and view not in want:
                continue
            try:
                size = getattr(space.sizes(), view)
                if size > MOST:
                    much = f"{size} candidates to go through are too many (at most {MOST})"
                    raise LimitError(much)
                views[view] = told_of(space)
            except LimitError as error:
                why = f"{error.message}; {LESS}"
                if want is not None:
                    raise LimitError(f"{view}: {why}, or leave it out", field="want") from None
                warnings.append(f"{view} left out: {why}")
        views["dimension"] = space.dimension if space.listed else None
        return views | {"capability": _capability(space), "warnings": warnings}
    except EmptySetError:
        listed = want is None or "vertices" in want
        return dict.fromkeys(views) | {"vertices": [] if listed else None}


def _half_spaces(space: WrenchSpace) -> replies.HalfSpaces:
    deadline.check(REACH)
    faces = space.half_spaces()
    equations = replies.HalfSpaceEquations(
        plain(faces.equation_normals), plain(faces.equation_offsets)
    )
    return told(replies.HalfSpaces, faces, equations=equations)


VIEWS: Final = {"vertices": lambda space: plain(space.vertices()), "half_spaces": _half_spaces}
"""What may be left out of a set, and how it is told."""


def _capability(space: WrenchSpace) -> dict[str, replies.AxisCapability]:
    reaches = {}
    for axis, direction in zip(AXES, np.eye(len(AXES)), strict=True):
        deadline.check(REACH)
        ends = space.capability(direction)
        low, high = (None, None) if ends is None else (-float(ends[0]), float(ends[1]))
        for sign, pure, way in (("+", high, direction), ("-", low, -direction)):
            reaches[f"{sign}{axis}"] = replies.AxisCapability(pure, float(space.support(way)))
    return reaches
