"""Convert the planner's plans, which have arrays, into replies of plain lists and numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple, TypeVar

import msgspec
import numpy as np
from msgspec import UNSET, Struct, UnsetType
from msgspec.structs import replace

from hand_models.base import Array
from hand_models.hand import Seating
from hand_models.wrench_spaces import WrenchSpace
from planner import Certificate, HandPlan, Palm, Plan, Question, Stance, WristPlan
from service import replies
from service.requests import Detail

__all__ = [
    "Planned",
    "brief_plan_reply",
    "cut_reason",
    "finite",
    "placed_poses",
    "plan_reply",
    "seating_reply",
    "wrench_set_reply",
    "wrist_reply",
]

PartT = TypeVar("PartT")


class Planned(NamedTuple):
    """A plan request's question and plan, as the planner has them, and the reply to the client.

    Attributes
    ----------
    question : Question
        The planner's question that was built from the request.
    plan : Plan
        The planner's answer to the question, with arrays.
    reply : PlanReply or BriefPlanReply
        The plan as plain lists and numbers, in the detail that the request wants.
    """

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
        """Build the reply of a plan, and return it together with the question and the plan.

        Parameters
        ----------
        question : Question
            The planner's question.
        answer : Plan
            Plan of the question.
        identifier : str or None
            The request's ``id``, which the reply repeats.
        detail : {'set_points', 'hands', 'full'}
            How much of the plan the reply contains: set-points alone; the loads of the hands, too;
            or the whole plan.
        model : bool
            True if a full reply has the load laws of tiles and the wrench spaces of hands.

        Returns
        -------
        Planned
            Question, plan and the new reply.
        """
        reply: replies.PlanReply | replies.BriefPlanReply
        if detail == "full":
            reply = plan_reply(answer, identifier, model=model)
        else:
            reply = brief_plan_reply(answer, identifier, hands=detail == "hands")
        if detail != "set_points":
            reply.poses = placed_poses(question.stance)
        return cls(question, answer, reply)

    def in_detail(self, detail: Detail) -> Planned:
        """Return the same question and plan with a reply in another detail.

        Parameters
        ----------
        detail : {'set_points', 'hands', 'full'}
            How much of the plan the new reply contains; see `of`.

        Returns
        -------
        Planned
            Question, plan and the new reply.
        """
        return Planned.of(self.question, self.plan, self.reply.id, detail, model=False)


def plan_reply(answer: Plan, identifier: str | None, *, model: bool) -> replies.PlanReply:
    """Convert a plan into a whole reply.

    Parameters
    ----------
    answer : Plan
        The planner's plan.
    identifier : str or None
        The request's ``id``, which the reply repeats.
    model : bool
        True if the reply has the load laws of tiles and the wrench spaces of hands.

    Returns
    -------
    PlanReply
        All of the plan as plain lists and numbers; infinite numbers are None.
    """
    hands, proof = answer.hands, answer.certificate
    return replies.PlanReply(
        id=identifier,
        status=answer.status,
        reason=answer.reason,
        body_wrench=answer.body_wrench.tolist(),
        utilisation=finite(answer.utilisation),
        effort=finite(answer.effort),
        load_factor=finite(answer.load_factor),
        load_factor_unbounded=answer.load_factor_unbounded,
        load_factor_status=answer.load_factor_status,
        limiting=answer.limiting,
        hands=None if hands is None else [_hand_reply(hand, model) for hand in hands],
        joints=_listed_by_limb(answer.joints),
        joint_torque=_listed_by_limb(answer.joint_torque),
        joint_torque_limit=_listed_by_limb(answer.joint_torque_limit),
        prices=None if answer.prices is None else list(answer.prices),
        effort_prices=None if answer.effort_prices is None else list(answer.effort_prices),
        certificate=None if proof is None else _certificate(proof, model and hands is None),
        residual=_listed(answer.residual),
        path=answer.path,
        verified=bool(answer.verified),
        solver=answer.solver,
        time=answer.time,
        warnings=list(answer.warnings),
        findings=list(answer.findings),
        unfinished=list(answer.unfinished),
        robust=answer.robust or UNSET,
        open_loop=answer.open_loop or UNSET,
        spread=answer.spread or UNSET,
        clearance=answer.clearance or UNSET,
        reliability=answer.reliability or UNSET,
        margin_share=UNSET if answer.margin_share is None else answer.margin_share,
        advice=UNSET if answer.advice is None else list(answer.advice),
    )


def _certificate(proof: Certificate, model: bool) -> replies.CertificateReply:
    """Return why there is no plan, with the hands' wrench spaces if ``model``."""
    spaces = proof.spaces.items()
    found = as_lists(replace(proof, wrench_spaces=UNSET), replies.CertificateReply)
    if not model:
        return found
    return replace(found, wrench_spaces={limb: wrench_set_reply(each) for limb, each in spaces})


def as_lists(part: Struct, kind: type[PartT]) -> PartT:
    """Convert a struct that contains NumPy arrays into a struct type with lists in the same fields.

    Parameters
    ----------
    part : msgspec.Struct
        Struct with arrays.
    kind : type
        Struct type to return.
    """
    return msgspec.convert(msgspec.to_builtins(part, enc_hook=_listed_number), kind)


def _listed_number(value: Any) -> Any:
    """Return an array as a list, and a number of NumPy's as a plain one."""
    return value.tolist()


def brief_plan_reply(
    answer: Plan, identifier: str | None, *, hands: bool
) -> replies.BriefPlanReply:
    """Convert a plan into a brief reply: status, utilisation, and the set-points of each hand.

    Parameters
    ----------
    answer : Plan
        The planner's plan.
    identifier : str or None
        The request's ``id``, which the reply repeats.
    hands : bool
        True if the reply also has wrenches, motor torques and currents of the hands, the load
        factor, the joint angles, warnings, findings and times. Otherwise the reason is cut to 120
        bytes.

    Returns
    -------
    BriefPlanReply
        The brief reply; infinite numbers are None in it.
    """
    points = None if answer.hands is None else [_set_points(h, hands) for h in answer.hands]
    reply = replies.BriefPlanReply(
        id=identifier,
        status=answer.status,
        reason=answer.reason if hands else cut_reason(answer.reason),
        utilisation=finite(answer.utilisation),
        limiting=answer.limiting,
        hands=points,
        verified=bool(answer.verified),
        unfinished=list(answer.unfinished),
        margin_share=UNSET if answer.margin_share is None else answer.margin_share,
    )
    if hands:
        reply.body_wrench = answer.body_wrench.tolist()
        reply.load_factor = finite(answer.load_factor)
        reply.load_factor_unbounded = answer.load_factor_unbounded
        reply.load_factor_status = answer.load_factor_status
        reply.joints = _listed_by_limb(answer.joints)
        reply.warnings = list(answer.warnings)
        reply.findings = list(answer.findings)
        reply.time = answer.time
    return reply


def _set_points(hand: HandPlan, whole: bool) -> replies.HandSetPoints:
    """Return the set-points of a hand, with its loads if ``whole``."""
    torque, current, angle = hand.drives.tolist()
    points = replies.HandSetPoints(
        limb=hand.limb, tensions=hand.tensions.tolist(), winch_angle=angle
    )
    if hand.wrist is not None:
        target = hand.wrist.pose_target
        if target is not None:
            points.pose_target = target.tolist()
        if whole or target is None:
            points.twist = hand.wrist.twist.tolist()
    if whole:
        points.motor_torque, points.motor_current = torque, current
        points.wrench = hand.wrench.tolist()
        points.utilisation = float(hand.utilisation)
    return points


def cut_reason(reason: str) -> str:
    """Shorten a reply's reason to at most 120 bytes; a cut text ends in an ellipsis."""
    # at most 120 bytes: replies with set-points have to be small
    short = reason.encode()[:120].decode(errors="ignore")
    return reason if short == reason else f"{short[:-3]}…"


def finite(value: float | None) -> float | None:
    """Return a number as a float for a reply; None for None, for infinity and for NaN."""
    return float(value) if value is not None and math.isfinite(value) else None


def _listed(array: Array | None) -> replies.Vector | None:
    """Return an array as a list, if there is one."""
    return None if array is None else array.tolist()


def _listed_by_limb(arrays: Mapping[str, Array] | None) -> dict[str, replies.Vector] | None:
    """Return arrays by limb as lists, if there are any."""
    return None if arrays is None else {limb: array.tolist() for limb, array in arrays.items()}


def _hand_reply(part: HandPlan, model: bool) -> replies.HandReply:
    """Return the reply's hand of a plan's hand, with its wrench space if ``model``."""
    return replies.HandReply(
        limb=part.limb,
        wrench=part.wrench.tolist(),
        fingers=part.finger_by_finger(model=model),
        palm=as_lists(part.palm, Palm[replies.Vector]),
        utilisation=float(part.utilisation),
        seating=seating_reply(part.seating),
        wrist=wrist_reply(part.wrist),
        wrench_space=wrench_set_reply(part.space) if model else UNSET,
    )


def wrist_reply(wrist: WristPlan | None) -> replies.Wrist:
    """Convert the state of a wrist in a plan into the reply's `Wrist`.

    Parameters
    ----------
    wrist : WristPlan or None
        Twist and palm mode of a floating or compliant wrist; None for a fixed wrist.

    Returns
    -------
    Wrist
        Its ``mode`` is ``fixed``, ``floating`` or ``compliant``; the twist is of H [m, rad].
    """
    if wrist is None:
        return replies.Wrist(mode="fixed")
    return replies.Wrist(
        mode="compliant" if wrist.driven else "floating",
        twist=wrist.twist.tolist(),
        palm=wrist.palm,
        rounds=wrist.rounds,
        error=finite(wrist.error),
        pose_target=UNSET if wrist.pose_target is None else wrist.pose_target.tolist(),
        least_stiffness=UNSET if wrist.least_stiffness is None else wrist.least_stiffness,
        largest_stretch=UNSET if wrist.stretches is None else float(wrist.stretches.max()),
    )


def placed_poses(stance: Stance) -> dict[str, replies.PlacedFrame] | UnsetType:
    """Return the poses of the hands that the request places by a point on the rock, or by contact.

    Parameters
    ----------
    stance : Stance
        The planner's stance, in which every hand has a pose.

    Returns
    -------
    dict of str to PlacedFrame, or UNSET
        Pose of H in W by limb: position [m] and unit quaternion (x, y, z, w). `msgspec.UNSET` if
        the request gives all hands by poses.
    """
    poses = {
        hand.limb: replies.PlacedFrame.of(hand.pose)
        for hand in stance.hands
        if hand.at is not None or hand.contact_offset is not None
    }
    return poses or UNSET


def seating_reply(seating: Seating) -> replies.SeatingReply:
    """Convert the pose of a hold in the hand frame H, and the rule that chose it, into a reply."""
    return replies.SeatingReply(
        rule=seating.rule,
        pose=replies.PlacedFrame.of(seating.pose),
        backed_off=float(seating.backed_off),
    )


def wrench_set_reply(space: WrenchSpace) -> replies.WrenchSet:
    """Convert a wrench space into its reply: origin, generators, and one named row for each limit.

    Parameters
    ----------
    space : WrenchSpace
        Wrenches w = o + V y on the rock, in H, over the hand's loads y [N], shape (m,).

    Returns
    -------
    WrenchSet
        Limit rows come first, then hard rows. A row has ``coefficients``, shape (m,), a
        ``constant`` and a ``capacity``: at utilisation ω, coefficients · y + constant is at most
        ω times the capacity for a limit, and at most the capacity for a hard row.
    """
    numbers = (
        np.vstack([space.L, space.H]),
        np.concatenate([space.l0, np.zeros(len(space.h))]),
        np.concatenate([space.s, space.h]),
    )
    return replies.WrenchSet(
        origin=space.origin.tolist(),
        generators=[
            replies.Generator(name=name, wrench=column)
            for name, column in zip(space.columns, space.generators.T.tolist(), strict=True)
        ],
        rows=[
            replies.RowReply(
                name=row.label,
                kind=row.kind,
                finger=row.finger,
                phalanx=row.phalanx,
                limit=row.limit,
                joint=row.joint,
                coefficients=coefficients,
                constant=constant,
                capacity=capacity,
            )
            for row, coefficients, constant, capacity in zip(
                space.rows, *(array.tolist() for array in numbers), strict=True
            )
        ],
    )
