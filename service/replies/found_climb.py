"""Define the reply to a search for a climb: the best one, and a bound of every other."""

from __future__ import annotations

from msgspec import UNSET, UnsetType

from planner import DecidingStage, Raise, RefusedMoves
from service.replies.climb import KnotReply
from service.replies.plan import RouteStageReply
from service.replies.reply import Reply
from service.requests import RouteRequest

__all__ = ["ClimbReply"]


class ClimbReply(Reply, kw_only=True):
    """The best climb that a search has found, and how much better any other could be.

    - ``name``: name of the climb.
    - ``robot``: name of the robot.
    - ``status``: ``found``: a climb, and no other is better by more than was allowed, or it has the
      load factor that was asked for; ``not_proven``: a climb, but another may be better by more;
      ``none``: it is proven that there is none, or none with the load factor that was asked for;
      ``blocked``: hands could hold a climb, but the moves of all that were found have no plan;
      ``unknown``: none was found in time.
    - ``least``: least load factor of the climb's stages, each a verified plan; null without a
      climb.
    - ``bound``: no other climb has a larger least load factor; null if there is no bound.
    - ``gap``: how much larger the bound is than ``least``, as a part of ``least``; null without one
      of the two.
    - ``deciding``: the stage with the least load factor; null without a climb.
    - ``raises``: changes that raise the load factor of that stage, the best first.
    - ``refused``: moves of climbs that hands could hold and that have no plan, by kind.
    - ``about``: what the bound is about, in a sentence.
    - ``route``: the climb, as a request at ``crux/<robot>/route``, but without the rock: hands name
      it ``rock``, and it belongs into ``stance.rocks``; null without a climb.
    - ``stages``: all stances of the climb, as in the reply to a route.
    - ``least_compliant``: least load factor of the same stages with compliant wrists, a lower bound
      where its status is ``at_least``; null unless they were asked for and all have one.
    - ``stages_compliant``: these stages; null unless they were asked for, there is a climb, and all
      were planned before the deadline.
    - ``knots``: number of the climb's knots; null without a climb.
    - ``placements``, ``bodies``: number of placements of hands, and of poses of the body, of which
      climbs were made.
    - ``programs``: number of linear programs that were solved.
    - ``seconds``: duration of each part of the work, by its name [s].
    - ``trajectory``: knots of the climb in order; left out unless wanted.
    - ``certificate``: bytes of the file that proves the bound (in JSON as base64); left out unless
      wanted, and where nothing is proven.
    """

    name: str
    robot: str
    status: str
    least: float | None
    bound: float | None
    gap: float | None
    deciding: DecidingStage | None
    raises: list[Raise]
    refused: list[RefusedMoves]
    about: str
    route: RouteRequest | None
    stages: list[RouteStageReply]
    least_compliant: float | None = None
    stages_compliant: list[RouteStageReply] | None = None
    knots: int | None
    placements: int
    bodies: int
    programs: int
    seconds: dict[str, float]
    trajectory: list[KnotReply] | UnsetType = UNSET
    certificate: bytes | UnsetType = UNSET
