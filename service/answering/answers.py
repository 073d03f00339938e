"""From the planner's plan to a reply, whole or brief."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from msgspec import UNSET

from planner import Plan, Question
from service import replies
from service.answering.hand_answers import (
    hand_reply,
    placed_poses,
    plain,
    told,
    wrench_set_reply,
)
from service.requests import Detail

__all__ = ["BRIEF", "Planned", "brief_plan_reply", "cut_reason", "plan_reply"]

LONGEST: Final = 120
"""Bytes of a reason beside set-points, which have to be small whatever the reason."""

BRIEF: Final = 3
"""So many fields of a hand's set-points are told in little room: limb, tensions and winches."""

WHOLE: Final = (
    "body_wrench",
    "load_factor",
    "load_factor_unbounded",
    "load_factor_status",
    "joints",
    "warnings",
    "findings",
    "time",
)
"""Fields of a brief reply that are left out beside set-points."""


class Planned(NamedTuple):
    """A plan request as the planner understands it, its plan, and what goes back."""

    question: Question
    plan: Plan
    reply: replies.PlanReply | replies.BriefPlanReply

    @classmethod
    def of(
        cls,
        question: Question,
        answer: Plan,
        identifier: str | None,
        detail: Detail,
        *,
        model: bool,
    ) -> Planned:
        """Return a plan with a reply that tells so much of it; ``model`` as for `plan_reply`."""
        reply: replies.PlanReply | replies.BriefPlanReply
        if detail == "full":
            reply = plan_reply(answer, identifier, model=model)
        else:
            reply = brief_plan_reply(answer, identifier, hands=detail == "hands")
        if detail != "set_points":
            reply.poses = placed_poses(question.stance)
        return cls(question, answer, reply)

    def in_detail(self, detail: Detail, *, model: bool = False) -> Planned:
        """Return the plan with a reply that tells so much of it."""
        return Planned.of(self.question, self.plan, self.reply.id, detail, model=model)


def plan_reply(answer: Plan, identifier: str | None, *, model: bool) -> replies.PlanReply:
    """Return a plan as a reply.

    Parameters
    ----------
    answer : Plan
    identifier : str or None
        The request's, echoed.
    model : bool
        Whether tiles carry their load laws and hands their wrench spaces.
    """
    proof, certificate = answer.certificate, None
    if proof is not None:
        sets: Any = UNSET
        if model and answer.hands is None:
            sets = {limb: wrench_set_reply(space) for limb, space in proof.spaces.items()}
        certificate = told(replies.Certificate, proof, wrench_spaces=sets)
    return told(
        replies.PlanReply,
        answer,
        id=identifier,
        hands=None if answer.hands is None else [hand_reply(h, model) for h in answer.hands],
        certificate=certificate,
        robust=answer.robust or UNSET,
        spread=answer.spread or UNSET,
        clearance=answer.clearance or UNSET,
        advice=UNSET if answer.advice is None else list(answer.advice),
    )


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
    points = [
        (h.limb, h.tensions, h.drives[2], h.drives[0], h.drives[1], h.wrench, h.utilisation)
        for h in answer.hands or ()
    ]
    most = None if hands else BRIEF
    return told(
        replies.BriefPlanReply,
        answer,
        id=identifier,
        reason=answer.reason if hands else cut_reason(answer.reason),
        hands=None
        if answer.hands is None
        else [replies.HandSetPoints(*plain(own[:most])) for own in points],
        **({} if hands else dict.fromkeys(WHOLE, UNSET)),
    )


def cut_reason(reason: str) -> str:
    """Return a sentence, or its beginning where it is long."""
    short = reason.encode()[:LONGEST].decode(errors="ignore")
    return reason if short == reason else f"{short[:-3]}…"
