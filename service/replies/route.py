"""The reply about a climb."""

from __future__ import annotations

from msgspec import Struct

from planner import LimitName, LoadFactorStatus
from service.replies.reply import Reply

__all__ = ["RouteReply", "RouteStage"]


class RouteStage(Struct, kw_only=True):
    """A stance of a climb. ``move``: from one, zero for the start; ``phase``: of the move.

    ``limb``: the one that moves. ``reason``: what limits the plan, or why there is none.
    """

    move: int
    phase: str
    limb: str | None
    status: str
    utilisation: float | None
    load_factor: float | None
    load_factor_unbounded: bool
    load_factor_status: LoadFactorStatus
    joint_utilisation: float | None
    limiting: LimitName | None
    reason: str


class RouteReply(Reply, kw_only=True):
    """A climb, planned stage by stage.

    ``status``: of the stage that is worst off. ``crux``: the index of the hardest stage, whose
    ``utilisation`` and ``limiting`` these are. ``load_factor``: the least of all stages;
    ``load_factor_status``, here and there: as of a plan.
    """

    name: str
    status: str
    crux: int
    utilisation: float | None
    load_factor: float | None
    load_factor_unbounded: bool
    load_factor_status: LoadFactorStatus
    limiting: LimitName | None
    stages: list[RouteStage]
    warnings: list[str]
