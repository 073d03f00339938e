"""Find the way back of a hand that slipped while it took its hold, and forward again."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import NamedTuple

from msgspec.structs import replace

from hand_models.base import CruxError
from service.replies import ClimbSetPoints, KnotReply

__all__ = ["Retry", "SlipError", "retry"]


class SlipError(CruxError):
    """Error: tiles have slipped while a climb was played, and it does not go on."""

    kind = "slipped"


class Retry(NamedTuple):
    """Knots by which a hand lets go of its hold and takes it again, and the climb goes on.

    Attributes
    ----------
    knots : list of KnotReply
        Knots in the order in which they are played. The first is where the climb stopped.
    turn : float
        Time at which the hand is off its hold and goes forward again [s].
    """

    knots: list[KnotReply]
    turn: float


def retry(knots: Sequence[KnotReply], at: ClimbSetPoints, limbs: Collection[str]) -> Retry | None:
    """Return how to go on after tiles of some hands have slipped; None if there is no such way.

    A hand that takes its hold can let go again along the knots of its closing, in reverse: at their
    beginning the other hands hold the robot without it. Each part of the way takes as long as
    forward.

    Parameters
    ----------
    knots : sequence of KnotReply
        Knots of the climb in climbing order, from that with index 0.
    at : ClimbSetPoints
        The last set-points that were sent.
    limbs : collection of str
        Limbs of the hands of which tiles have slipped.
    """
    now = knots[at.knot]
    if {*limbs} != {now.limb} or now.phase not in ("close", "load"):
        return None
    first = at.knot - 1
    while first > 0 and knots[first].move == now.move and knots[first].phase in ("close", "load"):
        first -= 1
    if knots[first].move != now.move:
        return None
    hands = [replace(hand, tensions=at.tensions[hand.limb]) for hand in now.hands]
    found = [replace(now, time=at.time, body=at.body, joints=at.joints, hands=hands)]
    time = at.time
    for number in range(at.knot - 1, first - 1, -1):
        time += knots[number + 1].time - knots[number].time
        found.append(replace(knots[number], time=time))
    later = time - knots[first].time
    found += [replace(knot, time=knot.time + later) for knot in knots[first + 1 :]]
    return Retry(found, time)
