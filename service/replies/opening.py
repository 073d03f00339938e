"""Define the reply about how a hand lets go of its hold."""

from __future__ import annotations

from msgspec import Struct

from service.replies.reply import Vector

__all__ = ["JamReply", "OpeningKnot", "OpeningReply", "TileEventReply"]


class OpeningKnot(Struct, kw_only=True):
    """A hand at one point of its opening path.

    - ``tensions``: of each tendon [N].
    - ``wrench``: of the hand on the rock, in H [N, N·m].
    - ``joints``: three joint angles of each finger, proximal first [rad].
    - ``engagement``: share of each tile's spines that hold, in the order of ``contacts``.
    - ``deviation``: largest distance of the wrench from the straight line to this knot from the
      one before it; zero for the first.
    """

    tensions: Vector
    wrench: Vector
    joints: list[Vector]
    engagement: Vector
    deviation: Vector


class TileEventReply(Struct, kw_only=True):
    """A tile that lets go of the rock.

    - ``finger``, ``phalanx``: its name.
    - ``tension``: of the finger's tendon [N].
    """

    finger: str
    phalanx: str
    tension: float


class JamReply(Struct, kw_only=True):
    """A finger that does not let go.

    - ``finger``: its name.
    - ``friction``: of the surface, above which the first of its spines would let go at zero
      tension; null where no balance was found on the way.
    - ``reason``: a sentence.
    """

    finger: str
    friction: float | None
    reason: str


class OpeningReply(Struct, kw_only=True):
    """Opening of a closed hand: all tendons are lowered from the closing tension to zero.

    - ``knots``: between neighbours all numbers are linear in the tension, to ``deviation``; two
      knots at one tension are before and after a finger snaps.
    - ``events``: tiles in the order in which they let go.
    - ``jammed``: fingers that do not let go.
    - ``resting``: fingers that their springs press on the rock at zero tension.
    - ``friction``: of the surface, on which it depends whether spines let go.
    - ``retreat``: least distance along -z of H at which all straight fingers are clear of the rock
      [m]; null where a finger's length is not enough.
    """

    knots: list[OpeningKnot]
    events: list[TileEventReply]
    jammed: list[JamReply]
    resting: list[str]
    friction: float
    retreat: float | None
