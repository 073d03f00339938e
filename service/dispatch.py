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
from planner import solve
from planner.plan import WristPlan
from service.answers import plan_reply, wrench_space_reply
from service.codec import Format, decode_request, encode_error
from service.errors import REQUEST_KINDS
from service.keys import PLAN, WRENCH_SPACE
from service.own_hand import over_default
from service.questions import question, stance
from service.replies import PlanReply, WrenchSpaceReply
from service.requests import PlanRequest, WrenchSpaceRequest

__all__ = ["SERVICES", "Answer", "handle", "plan", "wrench_space"]

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


def plan(request: PlanRequest) -> PlanReply:
    """Answer a plan request.

    Raises
    ------
    InvalidInputError
        If the request is impossible; the field is relative to it.
    """
    answer = solve.plan(question(request))
    return plan_reply(answer, request.id, model="model" in request.want)


def wrench_space(request: WrenchSpaceRequest) -> WrenchSpaceReply:
    """Answer a wrench-space request.

    Raises
    ------
    InvalidInputError
        If the request is impossible.
    """
    hand = solve.resting_hand(stance(request.stance), request.limb)
    wrist = None if hand.palm is None else WristPlan(np.zeros(6), hand.palm, 1, hand.error)
    return wrench_space_reply(
        request.stance.robot,
        request.limb,
        hand.settled,
        hand.space,
        tension_limits(hand.settled),
        wrist,
    )


class _Service(NamedTuple):
    request: type[PlanRequest] | type[WrenchSpaceRequest]
    answer: Callable[..., msgspec.Struct]


SERVICES: Final[dict[str, _Service]] = {
    PLAN: _Service(PlanRequest, plan),
    WRENCH_SPACE: _Service(WrenchSpaceRequest, wrench_space),
}
"""By the last part of the key: what is asked, and who answers."""


def handle(
    key: str, payload: bytes, encoding: str = "", hand: ParameterTable | None = None
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
        reply = service.answer(request)
        return Answer(form.encode(reply), form.label(reply), True)
    except InvalidInputError as error:
        kind = error.kind if error.kind in REQUEST_KINDS else InvalidInputError.kind
        return Answer(*encode_error(kind, error, form), False)
    except Exception as error:
        log.exception("the request at %s failed", key)
        excuse = CruxError(f"the service failed ({type(error).__name__}); its log says where")
        return Answer(*encode_error("internal", excuse, form), False)
