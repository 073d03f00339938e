"""A plan as it travels to callers that want its set-points, or its hands, alone."""

from __future__ import annotations

from typing import Final

from planner.result import HandPlan, Plan
from service import replies
from service.answering.answers import limbs_reply, limit_reply, number
from service.answering.hand_answers import vector

__all__ = ["brief_plan_reply", "cut_reason"]

LONGEST: Final = 120
"""Bytes of a reason beside set-points, which have to be small whatever the reason."""


def brief_plan_reply(
    answer: Plan, identifier: str | None, *, hands: bool
) -> replies.BriefPlanReply:
    """Return a plan as a reply.

    Parameters
    ----------
    answer : Plan
    identifier : str or None
        The request's, echoed.
    hands : bool
        Whether it tells what the hands carry, too.
    """
    reply = replies.BriefPlanReply(
        id=identifier,
        status=answer.status,
        reason=answer.reason if hands else cut_reason(answer.reason),
        utilisation=number(answer.utilisation),
        limiting=None if answer.limiting is None else limit_reply(answer.limiting),
        hands=None if answer.hands is None else [_hand(part, hands) for part in answer.hands],
        verified=answer.verified,
        unfinished=list(answer.unfinished),
    )
    if hands:
        reply.body_wrench = vector(answer.body_wrench)
        reply.load_factor = number(answer.load_factor)
        reply.load_factor_unbounded = answer.load_factor_unbounded
        reply.joints = limbs_reply(answer.joints)
        reply.warnings = list(answer.warnings)
        reply.time = replies.Time(answer.time.model, answer.time.solve, answer.time.total)
    return reply


def cut_reason(reason: str) -> str:
    """Return a sentence, or its beginning where it is long."""
    short = reason.encode()[:LONGEST].decode(errors="ignore")
    return reason if short == reason else f"{short[:-3]}…"


def _hand(part: HandPlan, whole: bool) -> replies.HandSetPoints:
    torque, current, angle = part.drives.tolist()
    points = replies.HandSetPoints(
        limb=part.limb, tensions=vector(part.tensions), winch_angle=angle
    )
    if whole:
        points.motor_torque, points.motor_current = torque, current
        points.wrench, points.utilisation = vector(part.wrench), float(part.utilisation)
    return points
