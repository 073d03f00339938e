"""The reply to who carries what, for callers that have no use, or no room, for all of it."""

from __future__ import annotations

from msgspec import UNSET, UnsetType

from planner.result import LimitName, Time
from service.replies.reply import StanceReply, Vector
from service.replies.stream import HandSetPoints

__all__ = ["BriefPlanReply"]


class BriefPlanReply(StanceReply, kw_only=True):
    """A plan with ``"detail"`` ``set_points`` or ``hands``: fields as of a plan's whole reply.

    Those from ``body_wrench`` on, and ``poses``, are left out with ``set_points``; the ``reason``
    is cut then. Of four hands that is less than 2,000 bytes of JSON, and less than 1,000 of
    MessagePack, whatever the status, beside the request's ``id``.
    """

    status: str
    reason: str
    utilisation: float | None = None
    limiting: LimitName | None = None
    hands: list[HandSetPoints] | None = None
    verified: bool
    unfinished: list[str] = []
    body_wrench: Vector | UnsetType = UNSET
    load_factor: float | UnsetType | None = UNSET
    load_factor_unbounded: bool | UnsetType = UNSET
    joints: dict[str, Vector] | UnsetType | None = UNSET
    warnings: list[str] | UnsetType = UNSET
    time: Time | UnsetType = UNSET
