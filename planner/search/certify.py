"""Certificate of a search: the wall, the bound's proof and the best climb as plain arrays."""

from __future__ import annotations

import numpy as np

from hand_models.base import Array, Indices, InvalidInputError, Pose
from planner.certification import ClimbCertificate
from planner.programs import WRENCH_UNIT
from planner.search.found import Found
from planner.search.wall import Ends, Wall

__all__ = ["climb_certificate"]


def climb_certificate(wall: Wall, start: Ends, goal: Ends, found: Found) -> ClimbCertificate:
    """Return the certificate of a search's bound, with the best climb that it found.

    Parameters
    ----------
    wall : Wall
    start, goal : Ends
        Those of the search.
    found : Found
        Its answer.

    Raises
    ------
    InvalidInputError
        If the search has ruled nothing out, so that there is no bound to certify.
    """
    proof = found.proof
    if proof is None:
        raise InvalidInputError(
            "the search has no proof of a bound; give it more time", field="found.proof"
        )
    hands, limbs = wall.screening.hands, wall.robot.limbs
    places, bodies, width = wall.reach.entry.shape
    moments = wall.screening.moments
    states = found.states
    return ClimbCertificate(
        limbs=tuple(limbs),
        multiple=float(proof.multiple),
        backward=bool(proof.backward),
        points=hands.points,
        rows=hands.rows,
        parts=hands.parts,
        hands=hands.hands,
        base=hands.base,
        room=hands.room,
        wrenches=wall.screening.wrenches,
        moments=moments if len(moments) else np.zeros((bodies, width, places, 3)),
        reached=wall.reach.reached,
        apart=wall.apart,
        shifts=np.asarray(wall.shifts, dtype=np.intp).reshape(-1, 2),
        start_bodies=start.bodies,
        start_members=_members(start, width),
        goal_bodies=goal.bodies,
        goal_members=_members(goal, width),
        directions=proof.directions,
        own_members=proof.members.reshape(-1, width),
        own_directions=proof.own.reshape(-1, 6),
        route_bodies=np.array([state.body for state in states], dtype=np.intp),
        route_members=np.array([state.members for state in states], dtype=np.intp).reshape(
            -1, width
        ),
        route_factors=np.asarray(found.factors, dtype=float),
        place_poses=_poses([each.pose for each in wall.places]),
        body_poses=_poses(list(wall.bodies)),
        about=hands.about,
        unit=np.asarray(WRENCH_UNIT, dtype=float),
    )


def _members(end: Ends, limbs: int) -> Indices:
    return np.full(limbs, -1) if end.members is None else np.array(end.members, dtype=np.intp)


def _poses(poses: list[Pose]) -> Array:
    """Return positions and quaternions (x, y, z, w), shape (n, 7)."""
    return np.array([np.append(each.position, each.quaternion()) for each in poses]).reshape(-1, 7)
