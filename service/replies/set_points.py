"""Define the replies of streams: their declaration, and set-points."""

from __future__ import annotations

from msgspec import UNSET, Struct, UnsetType

from planner import Finding, LostTile
from service.replies.plan import HandSetPoints
from service.replies.reply import ErrorDetail, Reply, StanceReply, Vector

__all__ = ["HandColumns", "PublishedReply", "ReleasedFinger", "SetPointsReply", "StreamReply"]


class HandColumns(Struct, kw_only=True):
    """One hand of a stream, with the names of its loads.

    - ``limb``: name of the limb that carries the hand.
    - ``columns``: names of the loads of the hand's wrench space, in order.
    """

    limb: str
    columns: list[str]


class StreamReply(StanceReply, kw_only=True):
    """Confirmation that a stance is declared as a stream, with the identifier to ask it by.

    The service keeps a stream until many others are declared, or until the service ends.

    - ``stream``: identifier of the stream, for requests of set-points, and in the keys at which
      wrenches are published.
    - ``radius``: distance from ``body_wrench`` within which set-points are interpolated between
      plans [N], along a moment a tenth of it per metre [N·m]; null where each set-point is solved
      for.
    - ``status``: status of the plan at ``body_wrench``.
    - ``reason``: why there is no plan at ``body_wrench``, or what overloads it; null where it is
      within its limits.
    - ``body_wrench``: centre of the first interpolation, in B [N, N·m].
    - ``utilisation``: utilisation of the plan at ``body_wrench``; null without a plan.
    - ``gap``: proven bound: no plan has a utilisation lower than this one by more than ``gap``; of
      compliant wrists, no plan nearby. Null without a plan.
    - ``hands``: the hands in order, with the names of their loads.
    - ``findings``: what is odd about the stance, its load and ``body_wrench``, each with its
      ``field`` in the request.
    - ``took``: time that the declaration took [s].
    """

    stream: str
    radius: float | None
    status: str
    reason: str | None
    body_wrench: Vector
    utilisation: float | None
    gap: float | None
    hands: list[HandColumns]
    took: float
    findings: list[Finding] = []


class ReleasedFinger(Struct, kw_only=True):
    """A finger that is taken off the rock.

    - ``limb``: limb of its hand.
    - ``finger``: name of the finger.
    """

    limb: str
    finger: str


class SetPointsReply(Reply, kw_only=True):
    """Set-points of all hands for one body wrench.

    - ``stream``: identifier of the stream that was asked.
    - ``status``: ``optimal``, ``overloaded``, ``infeasible`` or ``failed``.
    - ``reason``: why there is no plan, or what overloads it; null where it is within its limits.
    - ``body_wrench``: wrench that the rock must exert on the robot, in B [N, N·m].
    - ``utilisation``: load over capacity of the limit that is used most; null without a plan.
    - ``gap``: proven bound: no plan has a utilisation lower than this one by more than ``gap``; of
      compliant wrists, no plan nearby, by the sets linearised there. Null without a plan.
    - ``hands``: set-points of each hand; null without a plan.
    - ``verified``: true where the independent check of the set-points, or of the proof that there
      is no plan, passed.
    - ``source``: ``interpolated`` between plans known before, ``solved`` for this wrench, or
      ``blended`` from both.
    - ``took``: time that the answer took [s].
    - ``lost``: tiles that have slipped, without which the set-points do; left out where none has.
    - ``released``: fingers that the set-points take off the rock, as tiles of them have slipped:
      slacken their tendons. Left out where no tile has slipped.
    - ``save_first``: where the set-points after slips are beyond the cap, limb of the hand on whose
      limits that depends most; left out or null otherwise.
    - ``findings``: what is odd about ``body_wrench``: its unit, or its direction; left out where
      nothing is.
    """

    stream: str
    status: str
    reason: str | None
    body_wrench: Vector
    utilisation: float | None
    gap: float | None
    hands: list[HandSetPoints] | None
    verified: bool
    source: str
    took: float
    lost: list[LostTile] | UnsetType = UNSET
    released: list[ReleasedFinger] | UnsetType = UNSET
    save_first: str | UnsetType | None = UNSET
    findings: list[Finding] | UnsetType = UNSET


class PublishedReply(Struct, kw_only=True):
    """Set-points for a wrench that a client has published, or why there are none: published, too.

    - ``v``: version of the messages, 1.
    - ``stream``: identifier of the stream.
    - ``number``, ``time``: as of the wrench; null where they could not be read.
    - ``age``: time from the arrival of the wrench until its set-points were sent [s].
    - ``skipped``: number of wrenches of the stream that came after the one answered before, and
      that have no answer, because this one was newer.
    - ``set_points``: the set-points, with their ``gap``; null where there is an error.
    - ``error``: why there are no set-points; null where there are. If its ``field`` is ``stream``,
      no such stream is kept: declare it again.
    - ``server``: identifier of the service that has published this; of several, only the one that
      keeps a stream knows it.
    """

    v: int = 1
    stream: str
    number: int | None
    time: float | None
    age: float
    skipped: int
    set_points: SetPointsReply | None = None
    error: ErrorDetail | None = None
    server: str | UnsetType = UNSET
