"""Define the knots of a climb, as replies and files have them, and the set-points that are played.

Knots, `Climb` of the planner in plain lists, are the same in a reply, in ``trajectory.jsonl`` and
as the columns of ``trajectory.parquet``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, Self

from msgspec import UNSET, Struct, UnsetType

from planner import LimitName
from service.replies.reply import PlacedFrame, Reply, Vector

if TYPE_CHECKING:
    from hand_models.base import Array
    from planner import Failure, HandKnot, Knot

__all__ = [
    "CancelReply",
    "ClimbFailureReply",
    "ClimbSetPoints",
    "HandKnotReply",
    "KnotReply",
    "PartReply",
    "SearchProgress",
]


class HandKnotReply(Struct, kw_only=True):
    """A hand at a knot of a climb.

    - ``limb``: name of the limb that carries the hand.
    - ``pose``: pose of H in W.
    - ``on_rock``: whether the hand touches its hold.
    - ``tensions``: tensions of the four tendons [N].
    - ``winch_angles``: angles of the four winches, from the open finger [rad].
    - ``wrench``: wrench of the hand on the rock, in H [N, N·m]; zero in the air.
    - ``wrench_in_world``: wrench of the rock on the hand, in W about its origin [N, N·m].
    """

    limb: str
    pose: PlacedFrame
    on_rock: bool
    tensions: Vector
    winch_angles: Vector
    wrench: Vector
    wrench_in_world: Vector

    @classmethod
    def of(cls, hand: HandKnot) -> Self:
        """Convert a hand of the planner's knot from arrays to lists."""
        return cls(
            limb=hand.limb,
            pose=PlacedFrame.of(hand.pose),
            on_rock=hand.on_rock,
            tensions=_list(hand.tensions),
            winch_angles=_list(hand.winch_angles),
            wrench=_list(hand.wrench),
            wrench_in_world=_list(hand.wrench_in_world),
        )


class KnotReply(Struct, kw_only=True):
    """One time of a climb: poses, joint angles, and verified loads of all hands.

    Between two knots a controller interpolates linearly in time: joint angles, tensions, and the
    position of the body; its orientation along the shortest turn.

    - ``index``: number of the knot from zero, in climbing order.
    - ``move``: number of the move, from one; zero for the start.
    - ``phase``: part of the move that this knot ends, or is in: ``start``, ``shift``, ``unload``,
      ``open``, ``swing``, ``close`` or ``load``.
    - ``limb``: name of the limb that moves; null for the start.
    - ``stage``: index of the route's stage that this knot is the plan of; null between stages.
    - ``time``: time since the start, at the rates of the controller [s].
    - ``body``: pose of B in W.
    - ``joints``: joint angles by limb, from the body outward [rad].
    - ``joint_torque``: torques of these joints [N·m].
    - ``hands``: hands in the order of the start stance.
    - ``utilisation``: load over capacity of the limit that is used most.
    - ``bound``: largest utilisation from the knot before to this one, while a controller
      interpolates; null for the start.
    - ``limiting``: the limit that is used most.
    - ``verified``: whether the independent check passed.
    """

    index: int
    move: int
    phase: str
    limb: str | None
    stage: int | None
    time: float
    body: PlacedFrame
    joints: dict[str, Vector]
    joint_torque: dict[str, Vector]
    hands: list[HandKnotReply]
    utilisation: float
    bound: float | None
    limiting: LimitName | None
    verified: bool

    @classmethod
    def of(cls, knot: Knot) -> Self:
        """Convert a knot of the planner from arrays to lists."""
        return cls(
            index=knot.index,
            move=knot.move,
            phase=knot.phase,
            limb=knot.limb,
            stage=knot.stage,
            time=float(knot.time),
            body=PlacedFrame.of(knot.body),
            joints={limb: _list(angles) for limb, angles in knot.joints.items()},
            joint_torque={limb: _list(torque) for limb, torque in knot.joint_torque.items()},
            hands=[HandKnotReply.of(hand) for hand in knot.hands],
            utilisation=float(knot.utilisation),
            bound=None if knot.bound is None else float(knot.bound),
            limiting=knot.limiting,
            verified=knot.verified,
        )


class ClimbFailureReply(Struct, kw_only=True):
    """Why a climb ends in the middle of a move.

    - ``move``: number of the move, from one; zero if the start has no plan.
    - ``phase``: the part of the move that fails, as of a knot.
    - ``limb``: name of the limb that moves; null for the start.
    - ``reason``: one sentence that says what is missing, or which link meets what.
    """

    move: int
    phase: str
    limb: str | None
    reason: str

    @classmethod
    def of(cls, failure: Failure | None) -> Self | None:
        """Convert the planner's failure; None stays None."""
        if failure is None:
            return None
        return cls(move=failure.move, phase=failure.phase, limb=failure.limb, reason=failure.reason)


class SearchProgress(Struct, kw_only=True):
    """Progress of the search for a climb.

    - ``phase``: what is being done: ``placements``, ``reach``, ``sets``, ``search``, ``steps``,
      ``moves``, ``stages``, ``changes`` or ``compliant``.
    - ``best``: least load factor of the best route so far; null before there is one.
    - ``bound``: no route has a larger least load factor; null before there is a bound.
    - ``gap``: how much larger than ``best`` the bound is, as a part of ``best``; null without one
      of the two.
    - ``done``, ``total``: steps of this phase that are done, and all of them; zero where they are
      not known.
    - ``seconds``: time since the search began [s].
    """

    phase: str
    best: float | None
    bound: float | None
    gap: float | None
    done: int
    total: int
    seconds: float


class CancelReply(Reply, kw_only=True):
    """Reply to a client that cancels questions.

    - ``cancelled``: number of its questions that have ended by this; they get an error of kind
      ``cancelled``.
    """

    cancelled: int


class PartReply(Reply, kw_only=True):
    """Part of an answer, before the last reply to the same query: one of the two is there.

    - ``progress``: how far a search is.
    - ``knots``: further knots of a climb, in order; those of one move come together, or as many as
      fit into ``max_reply_bytes``.
    """

    progress: SearchProgress | UnsetType = UNSET
    knots: list[KnotReply] | UnsetType = UNSET


class ClimbSetPoints(Struct, kw_only=True):
    """Set-points that a controller is to follow at one time of a climb: published, not asked for.

    - ``v``: version of the messages, 1.
    - ``number``: number of the set-points from zero; each one is one more than the one before.
    - ``time``: time since the start of the climb [s].
    - ``knot``: index of the knot to which the set-points lead.
    - ``move``, ``phase``, ``limb``: move of that knot, part of the move, and limb that moves.
    - ``body``: pose of B in W.
    - ``joints``: joint angles by limb, from the body outward [rad].
    - ``tensions``: tensions of the four tendons by limb [N].
    - ``state``: ``playing``; at the end the last set-points come once more, with ``done``, or with
      ``stopped`` if playing was broken off: the controller then stays at them.
    """

    v: int = 1
    number: int
    time: float
    knot: int
    move: int
    phase: str
    limb: str | None
    body: PlacedFrame
    joints: dict[str, Vector]
    tensions: dict[str, Vector]
    state: Literal["playing", "done", "stopped"] = "playing"


def _list(values: Array) -> Vector:
    found: Vector = values.tolist()
    return found
