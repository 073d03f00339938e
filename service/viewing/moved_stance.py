"""A stance whose body and hands are moved by a person; the rock stays where it is."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from msgspec import structs
from scipy.spatial.transform import Rotation

import planner
from hand_models.base import (
    Array,
    Coordinate,
    InvalidInputError,
    Name,
    Pose,
    Strict,
)
from hand_models.rock import Hold
from service import answering, requests
from service.viewing.settings import VIEWING_SETTINGS

__all__ = ["MovableStance", "StanceMoves"]


BodyMove = tuple[Coordinate, Coordinate, Coordinate, Coordinate, Coordinate, Coordinate]
HandMove = tuple[Coordinate, Coordinate, Coordinate]


class StanceMoves(Strict, frozen=True):
    """Moves of body and hands from where the stance has them.

    - ``body``: shift of the body in W [m], then the rotation vector of its turn about its origin,
      in W [rad].
    - ``hands``: shift of each hand that is moved along x and y of its seat in the stance, which is
      H for a hand that is seated on its crest [m], and its turn about its approach [rad].
    """

    body: BodyMove = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    hands: dict[Name, HandMove] = {}  # noqa: RUF012 - msgspec copies it


class _Seat(NamedTuple):
    """Place of a hand of the stance on its rock.

    Attributes
    ----------
    hold : Hold
    rock : Pose
        Of the hold's frame in W.
    frame : Pose
        Point on the rock at which the hand is seated, z into the rock, in the hold's frame.
    """

    hold: Hold
    rock: Pose
    frame: Pose


class MovableStance:
    """Stance of a plan request, with which body and hands can be moved.

    A moved hand is seated again where its line into the rock meets the rock, and turns with it.

    Parameters
    ----------
    request : PlanRequest
        With the vertices and faces of its meshes.
    robots : Robots
        Robots that the request may name.

    Attributes
    ----------
    request, robots
        The parameters of the same names.

    Raises
    ------
    InvalidInputError
        If the request is impossible. The error's ``field`` is a path in the request.
    """

    def __init__(self, request: requests.PlanRequest, robots: answering.Robots) -> None:
        self.request, self.robots = request, robots
        stance = answering.question(request, robots).stance
        settled = planner.settle_each(stance.robot.hand, stance.hands)
        self._body, self._seats = stance.body, {}
        for hand, each in zip(stance.hands, settled, strict=True):
            if isinstance(each, InvalidInputError):
                raise each.within(f"stance.hands.{hand.limb}")
            rock = each.seating.pose
            frame = hand.at or Pose.identity()
            if hand.placed_hold() is not None:
                in_rock = rock.inverse()
                depth = hand.hold.entry(in_rock.position, in_rock.rotation[:, 2])
                onto = in_rock.rotation[:, 2] * (depth if math.isfinite(depth) else 0.0)
                frame = Pose(in_rock.position + onto, in_rock.rotation)
            self._seats[hand.limb] = _Seat(hand.hold, hand.pose @ rock, frame)

    def moved(self, moves: StanceMoves) -> requests.PlanRequest:
        """Return the request with body and hands moved; without moves, as it was given.

        Joint angles that were given are solved for again.

        Raises
        ------
        InvalidInputError
            If a limb has no hand, or there is no rock where a hand is moved to.
        """
        replace, stance = structs.replace, self.request.stance
        hands = {hand.limb: hand for hand in stance.hands}
        for limb, move in moves.hands.items():
            if limb not in self._seats:
                known = ", ".join(self._seats)
                raise InvalidInputError(f"unknown limb {limb!r}; known are {known}", field="hands")
            if any(move):
                hands[limb] = self._placed(hands[limb], *move)
        if self.request.stance.hands == [*hands.values()] and not any(moves.body):
            return self.request
        turn = Rotation.from_rotvec(moves.body[3:]).as_matrix() @ self._body.rotation
        there = Pose(self._body.position + moves.body[:3], turn)
        body = answering.pose_of_request(there)
        if not any(moves.body[3:]):  # as it was written
            body = replace(stance.body, position=body.position)
        return replace(
            self.request,
            stance=replace(
                stance,
                body=body,
                hands=[*hands.values()],
                joints=None if stance.joints is None else "solve",
            ),
        )

    def handles(self, stance: planner.Stance) -> dict[str, dict[str, Any]]:
        """Return what a person can drag, by limb, and as ``body``.

        Parameters
        ----------
        stance : Stance
            Moved or not.

        Returns
        -------
        dict of str to dict
            ``place``: its origin in W [m]; ``axes``: unit vectors in W along which it moves;
            ``turns``: those about which it turns, by name.
        """
        hands = {
            hand.limb: {
                "place": hand.pose.position.tolist(),
                "axes": (seat.rock.rotation @ seat.frame.rotation)[:, :2].T.tolist(),
                "turns": {"yaw": hand.pose.rotation[:, 2].tolist()},
            }
            for hand in stance.hands
            if (seat := self._seats.get(hand.limb))
        }
        turns = zip(("roll", "pitch", "yaw"), stance.body.rotation.T.tolist(), strict=True)
        body = {"place": stance.body.position.tolist(), "axes": np.eye(3).tolist()}
        return hands | {"body": body | {"turns": dict(turns)}}

    def _placed(self, hand: requests.Hand, x: float, y: float, turn: float) -> requests.Hand:
        """Return a hand of the request elsewhere on its rock, which gets its pose in W."""
        hold, rock, frame = self._seats[hand.limb]
        point, axes = frame.position + frame.rotation[:, :2] @ [x, y], frame.rotation
        depth = hold.entry(point, axes[:, 2])
        if not math.isfinite(depth):
            raise InvalidInputError(
                f"there is no rock {1e3 * x:.0f} mm along x and {1e3 * y:.0f} mm along"
                " y of where the stance has it; move it back",
                field=f"hands.{hand.limb}",
            )
        there = Pose(point + depth * axes[:, 2], axes)
        before, after = _inward(hold, frame), _inward(hold, there)
        if before is not None and after is not None:
            # by the least turn
            axes = Rotation.align_vectors(after, before)[0].as_matrix() @ axes
        axes = axes @ Rotation.from_rotvec([0.0, 0.0, turn]).as_matrix()
        up, _, approach = (rock.rotation @ axes).T.tolist()
        fields: dict[str, Any] = {"pose": None, "contact_offset": None}
        if hand.place is None:
            pose = answering.pose_of_request(rock)
            fields["hold"] = structs.replace(hand.hold, pose=pose, pose_in_hand=None)
        fields["place"] = requests.Place(
            point=tuple(rock.apply(there.position).tolist()),
            approach=tuple(approach),
            up=tuple(up),
        )
        return structs.replace(hand, **fields)


def _inward(hold: Hold, frame: Pose) -> Array | None:
    """Return the unit normal into the rock under a palm; None where the palm hangs over a border.

    It is that of the plane through the rock at the middles of the palm's sides.
    """
    half = VIEWING_SETTINGS.palm_half
    aside = half * np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    depths = np.array(hold.entries(frame.apply(aside), frame.rotation[:, 2]))
    if not np.isfinite(depths).all():
        return None
    slope = (depths[[0, 2]] - depths[[1, 3]]) / (2.0 * half)
    inward = frame.rotation @ [*-slope, 1.0]
    return np.asarray(inward / np.linalg.norm(inward))
