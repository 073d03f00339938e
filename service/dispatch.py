"""From the bytes of a query to the bytes of its answer, whatever the bytes are."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Final, NamedTuple

import msgspec
import numpy as np

from hand_models.errors import CruxError, InvalidInputError
from hand_models.fixed_wrist import tension_limits
from hand_models.parameters import ParameterTable
from planner import settling, solve
from planner.plan import Plan, WristPlan
from planner.question import Question
from service.answers import plan_reply, wrench_space_reply
from service.body_space import explore
from service.codec import Format, decode_request, encode_error
from service.errors import REQUEST_KINDS
from service.keys import BODY_SPACE, PLAN, WRENCH_SPACE
from service.own_hand import over_default
from service.own_robot import ROBOTS, Robots
from service.questions import question, stance
from service.replies import BodySpaceReply, PlanReply, WrenchSpaceReply
from service.requests import BodySpaceRequest, PlanRequest, WrenchSpaceRequest

__all__ = [
    "SERVICES",
    "Answer",
    "Planned",
    "body_space",
    "handle",
    "plan",
    "planned",
    "wrench_space",
]

log = logging.getLogger(__name__)


class Answer(NamedTuple):
    """What goes back to the caller.

    Attributes
    ----------
    payload : bytes
    encoding : str
        Of the payload, with its schema.
    good : bool
        Whether it is a reply, and not an error.
    """

    payload: bytes
    encoding: str
    good: bool


def plan(request: PlanRequest, robots: Robots = ROBOTS) -> PlanReply:
    """Answer a plan request.

    Parameters
    ----------
    request : PlanRequest
    robots : Robots, optional
        Those that may be asked about.

    Raises
    ------
    InvalidInputError
        If the request is impossible; the field is relative to it.
    """
    return planned(request, robots).reply


class Planned(NamedTuple):
    """A plan request as the planner understands it, its plan, and what goes back."""

    question: Question
    plan: Plan
    reply: PlanReply


def planned(request: PlanRequest, robots: Robots = ROBOTS) -> Planned:
    """Answer a plan request, and keep what the reply leaves out; as `plan`."""
    asked = question(request, robots)
    answer = solve.plan(asked)
    reply = plan_reply(answer, request.id, model="model" in request.want)
    return Planned(asked, answer, reply)


def wrench_space(request: WrenchSpaceRequest, robots: Robots = ROBOTS) -> WrenchSpaceReply:
    """Answer a wrench-space request; parameters as for `plan`.

    Raises
    ------
    InvalidInputError
        If the request is impossible.
    """
    asked = stance(request.stance, robots)
    hand = settling.resting_hand(asked, request.limb)
    wrist = None if hand.palm is None else WristPlan(np.zeros(6), hand.palm, 1, hand.error)
    return wrench_space_reply(
        asked.robot.name,
        request.limb,
        hand.settled,
        hand.space,
        tension_limits(hand.settled),
        wrist,
    )


def body_space(request: BodySpaceRequest, robots: Robots = ROBOTS) -> BodySpaceReply:
    """Answer a body-space request; parameters as for `plan`.

    Raises
    ------
    InvalidInputError
        If the request is impossible; the field is relative to it.
    """
    return explore(request, robots).reply


class _Service(NamedTuple):
    request: type[PlanRequest] | type[WrenchSpaceRequest] | type[BodySpaceRequest]
    answer: Callable[..., msgspec.Struct]


SERVICES: Final[dict[str, _Service]] = {
    PLAN: _Service(PlanRequest, plan),
    WRENCH_SPACE: _Service(WrenchSpaceRequest, wrench_space),
    BODY_SPACE: _Service(BodySpaceRequest, body_space),
}
"""By the last part of the key: what is asked, and who answers."""


def handle(
    key: str,
    payload: bytes,
    encoding: str = "",
    hand: ParameterTable | None = None,
    robots: Robots = ROBOTS,
) -> Answer:
    """Answer a query.

    Parameters
    ----------
    key : str
        Ends in the name of one of `SERVICES`.
    payload : bytes
    encoding : str, optional
        Zenoh's name of it; the answer's is of the same format.
    hand : ParameterTable, optional
        Entries of the hand in which the service's is not the bundled one; a request's own entries
        go on top.
    robots : Robots, optional
        Those that may be asked about.

    Returns
    -------
    Answer
        A reply, or a structured error; nothing is raised.
    """
    form = Format.JSON
    try:
        form = Format.named(encoding)
        service = SERVICES[key.rpartition("/")[2]]
        request = over_default(decode_request(payload, service.request, form), hand)
        reply = service.answer(request, robots)
        return Answer(form.encode(reply), form.label(reply), True)
    except InvalidInputError as error:
        kind = error.kind if error.kind in REQUEST_KINDS else InvalidInputError.kind
        return Answer(*encode_error(kind, error, form), False)
    except Exception as error:
        log.exception("the request at %s failed", key)
        excuse = CruxError(f"the service failed ({type(error).__name__}); its log says where")
        return Answer(*encode_error("internal", excuse, form), False)
