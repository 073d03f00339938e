"""Play a climb: publish its set-points in time, interpolated between knots, one after another."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import Any
from uuid import uuid4

import numpy as np
import zenoh
from msgspec.structs import replace

from hand_models.base import Array, UnsupportedError
from service.processes import Interrupted
from service.replies import ClimbSetPoints, KnotReply, PlacedFrame, Vector
from service.serving.settings import SERVING_SETTINGS
from service.wire import Format, NoServiceError, ServiceName, service_key

__all__ = ["climb_set_points", "play"]


def climb_set_points(knots: Sequence[KnotReply], step: float) -> Iterator[ClimbSetPoints]:
    """Yield the set-points of a climb in order: every knot, and evenly spaced ones between knots.

    Joint angles, tensions and the body's position are linear in time between two knots; its
    orientation goes along the shortest turn.

    Parameters
    ----------
    knots : sequence of KnotReply
        Knots in climbing order; at least one.
    step : float
        Largest time between two set-points [s].

    Yields
    ------
    ClimbSetPoints
        All with the state ``playing``.
    """
    first = knots[0]
    # loads SciPy, for which no set-point after the first one may wait
    (turn,) = _turns(first, first, np.ones(1))
    yield _set_points(first, first, 1.0, PlacedFrame(first.body.position, turn), 0)
    number = 0
    for before, knot in pairwise(knots):
        # a step that fits but for rounding counts
        count = max(1, math.ceil((knot.time - before.time) / step - 1e-9))
        # in pieces: a slow climb has millions of set-points between two knots
        for first_of_piece in range(1, count + 1, 1000):
            shares = np.arange(first_of_piece, min(first_of_piece + 1000, count + 1)) / count
            for share, turn in zip(shares.tolist(), _turns(before, knot, shares), strict=True):
                number += 1
                position = _mixed(before.body.position, knot.body.position, share)
                yield _set_points(before, knot, share, PlacedFrame(position, turn), number)


def _set_points(
    before: KnotReply, knot: KnotReply, share: float, body: PlacedFrame, number: int
) -> ClimbSetPoints:
    """Return the set-points at a share of the time from one knot to the next."""
    return ClimbSetPoints(
        number=number,
        time=_mixed([before.time], [knot.time], share)[0],
        knot=knot.index,
        move=knot.move,
        phase=knot.phase,
        limb=knot.limb,
        body=body,
        joints={
            limb: _mixed(before.joints[limb], angles, share) for limb, angles in knot.joints.items()
        },
        tensions={
            hand.limb: _mixed(old.tensions, hand.tensions, share)
            for old, hand in zip(before.hands, knot.hands, strict=True)
        },
    )


def _mixed(before: Vector, after: Vector, share: float) -> Vector:
    """Return what is linear in time at a share of the time from one knot to the next."""
    if share == 1.0:
        return after
    return [a + share * (b - a) for a, b in zip(before, after, strict=True)]


def _turns(before: KnotReply, knot: KnotReply, shares: Array) -> list[Vector]:
    """Return quaternions of the body along the shortest turn from one knot to the next."""
    from scipy.spatial.transform import Rotation, Slerp

    ends = Rotation.from_quat([before.body.orientation, knot.body.orientation])
    found: list[Vector] = Slerp([0.0, 1.0], ends)(shares).as_quat().tolist()
    return [*found[:-1], knot.body.orientation]


def play(
    session: zenoh.Session,
    robot: str,
    knots: Sequence[KnotReply],
    *,
    rate: float,
    speed: float = 1.0,
    wait: float | None = None,
    late: Callable[[float], None] | None = None,
    sent: Callable[[ClimbSetPoints], None] | None = None,
) -> int:
    """Publish the set-points of a climb at the key ``crux/<robot>/play``, each at its time.

    Set-points that are late delay all that follow: none is left out, and no two come sooner after
    each other than they should.

    Parameters
    ----------
    session : zenoh.Session
        Open session.
    robot : str
        Name of the robot, for the key.
    knots : sequence of KnotReply
        Knots in climbing order; at least one.
    rate : float
        Least number of set-points in a second [1/s].
    speed : float, optional
        Time of the climb over time that passes; above 1, rates of the controller are exceeded.
    wait : float, optional
        How long to wait for a subscriber [s]; 1 s by default.
    late : callable, optional
        Called before set-points that are late, with the delay [s].
    sent : callable, optional
        Called with all set-points but the last repetition, once they are sent; what it raises ends
        the playing.

    Returns
    -------
    int
        Number of set-points, without the last one's repetition.

    Raises
    ------
    NoServiceError
        If nobody subscribes to the key.
    UnsupportedError
        If another player is playing to the robot, as far as the session reaches.
    BaseException
        What interrupts this function, after the last set-points have been published again, with
        the state ``stopped``.
    """
    key = service_key(robot, ServiceName.PLAY)
    publisher = session.declare_publisher(
        key,
        # every one counts, in its order
        congestion_control=zenoh.CongestionControl.BLOCK,
        reliability=zenoh.Reliability.RELIABLE,
        priority=zenoh.Priority.REAL_TIME,
        express=True,
    )

    def send(points: ClimbSetPoints) -> None:
        form = Format.JSON
        publisher.put(form.encode(points), encoding=form.label(points))

    last: ClimbSetPoints | None = None
    token = session.liveliness().declare_token(f"{key}/{session.info.zid()}/{uuid4().hex}")
    try:
        _await_subscriber(publisher, wait)
        _refuse_rivals(session, key)
        start = time.monotonic() - knots[0].time / speed
        try:
            for points in climb_set_points(knots, speed / rate):
                early = start + points.time / speed - time.monotonic()
                if early > 0.0:
                    time.sleep(early)
                else:
                    start -= early
                    if late is not None and last is not None:
                        late(-early)
                send(points)
                last = points
                if sent is not None:
                    sent(points)
        except BaseException as error:
            if last is not None:
                send(replace(last, number=last.number + 1, state="stopped"))
                if isinstance(error, Interrupted):
                    at = f"stopped at {last.time:.2f} s of {knots[-1].time:.2f} s"
                    raise Interrupted(at) from None
            raise
        assert last is not None  # of at least one knot
        send(replace(last, number=last.number + 1, state="done"))
        return last.number + 1
    finally:
        token.undeclare()
        publisher.undeclare()


def _refuse_rivals(session: zenoh.Session, key: str) -> None:
    """Refuse to play beside another player; of two that begin together, none plays."""
    tokens = session.liveliness().get(f"{key}/**", timeout=SERVING_SETTINGS.search_timeout)
    if len({str(reply.ok.key_expr) for reply in tokens if reply.ok is not None}) > 1:
        raise UnsupportedError(
            f"another player sends set-points to {key}; a robot cannot follow two: wait until that "
            "one has ended, or stop it",
            field="DIR",
        )


def _await_subscriber(publisher: zenoh.Publisher, wait: float | None) -> None:
    seconds = SERVING_SETTINGS.search_timeout if wait is None else wait
    end = time.monotonic() + seconds
    while not _matches(publisher):
        if time.monotonic() >= end:
            raise NoServiceError(
                f"nobody subscribes to {publisher.key_expr} within {seconds:g} s; start the "
                "robot's controller where this session reaches it, or wait for it (wait, --wait)"
            )
        time.sleep(0.01)


def _matches(publisher: zenoh.Publisher) -> bool:
    status: Any = publisher.matching_status
    # zenoh's type stubs say that it is a bool
    return bool(status.matching)
