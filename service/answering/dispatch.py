"""Answer a query: bytes in, bytes out, also for bytes that are no valid request."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any, Final, NamedTuple

from msgspec.structs import replace

import planner
from hand_models.base import CruxError, InvalidInputError, LimitError
from hand_models.parameters import ParameterTable
from planner import DeadlineError, deadline
from service.answering.answers import Planned, plan_reply
from service.answering.mesh_files import MeshFiles
from service.answering.own_models import BUNDLED_ROBOTS, Robots, over_default
from service.answering.questions import climb, question
from service.answering.reply_sizes import fitted
from service.answering.streams import LOCAL_STREAMS, Streams
from service.replies import BriefPlanReply, PlanReply, Reply, StreamReply
from service.requests import (
    BodySpaceRequest,
    PlanRequest,
    Query,
    Request,
    RouteRequest,
    SetPointsRequest,
    StreamRequest,
    WrenchSpaceRequest,
)
from service.wire import (
    REQUEST_KINDS,
    Answer,
    Format,
    ServiceName,
    decode_request,
    encode_error,
    identifier,
    most_error_bytes,
)

__all__ = [
    "SERVICES_BY_NAME",
    "answer_plan",
    "answer_with_advice",
    "handle",
    "planned",
]

log = logging.getLogger(__name__)


def answer_plan(
    request: PlanRequest, robots: Robots = BUNDLED_ROBOTS
) -> PlanReply | BriefPlanReply:
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


def planned(request: PlanRequest, robots: Robots = BUNDLED_ROBOTS) -> Planned:
    """Answer a plan request as `answer_plan` does, and keep the question and the plan."""
    detail = request.detail or "full"
    if detail != "full":
        # compute only what the reply contains
        included = ["load_factor"] if detail == "hands" else []
        wanted = [want for want in request.want if want in included]
        request = replace(request, want=wanted, draws=[])
    asked = question(request, robots)
    answer = planner.plan(asked)
    return Planned.of(asked, answer, request.id, detail, model="model" in request.want)


def answer_with_advice(answer: Planned) -> Planned:
    """Return an answer with advice, if its reply is whole and has none yet."""
    if not isinstance(answer.reply, PlanReply) or answer.plan.advice is not None:
        return answer
    found = planner.with_advice(answer.question, answer.plan)
    advised = plan_reply(found, answer.reply.id, model=False)
    reply = replace(
        answer.reply,
        advice=advised.advice,
        warnings=advised.warnings,
        unfinished=advised.unfinished,
        time=advised.time,
    )
    return Planned(answer.question, found, reply)


def _wrench_space(asked: WrenchSpaceRequest, robots: Robots, _: Streams) -> Reply:
    from service.answering.hand_spaces import answer_wrench_space

    return answer_wrench_space(asked, robots)


def _body_space(asked: BodySpaceRequest, robots: Robots, _: Streams) -> Reply:
    from service.answering.body_space import explore

    return explore(asked, robots).reply


def _climb(asked: RouteRequest, robots: Robots, _: Streams) -> Reply:
    return climb(asked, robots)


class _Service(NamedTuple):
    """Kind of request, and the function of request, robots and streams that answers it."""

    request: type[Request]
    answer: Callable[[Any, Robots, Streams], Reply | Planned]


SERVICES_BY_NAME: Final[dict[str, _Service]] = {
    ServiceName.PLAN: _Service(PlanRequest, lambda asked, robots, _: planned(asked, robots)),
    ServiceName.WRENCH_SPACE: _Service(WrenchSpaceRequest, _wrench_space),
    ServiceName.BODY_SPACE: _Service(BodySpaceRequest, _body_space),
    ServiceName.STREAM: _Service(
        StreamRequest, lambda asked, robots, streams: streams.declare(asked, robots)
    ),
    ServiceName.SET_POINTS: _Service(
        SetPointsRequest, lambda asked, _, streams: streams.set_points(asked)
    ),
}
"""Services over zenoh, by the last part of the key."""


def handle(
    key: str,
    payload: bytes,
    encoding: str = "",
    hand: ParameterTable | None = None,
    robots: Robots = BUNDLED_ROBOTS,
    *,
    started: float | None = None,
    streams: Streams = LOCAL_STREAMS,
    files: MeshFiles | None = None,
    revised: Callable[[Any], Any] | None = None,
) -> Answer:
    """Answer a query.

    Parameters
    ----------
    key : str
        Key that ends in the name of one of `SERVICES_BY_NAME`, or in ``route``.
    payload : bytes
    encoding : str, optional
        Zenoh's name of it; the answer's is of the same format.
    hand : ParameterTable, optional
        Entries of the hand in which the service's is not the bundled one; a request's own entries
        go on top.
    robots : Robots, optional
        Those that may be asked about.
    started : float, optional
        When a request's deadline began, on the clock of `time.perf_counter`; now by default.
    streams : Streams, optional
        Those that may be asked; by default those of this process that belong to no service.
    files : MeshFiles, optional
        Those that a plan request may name; none by default.
    revised : callable, optional
        Returns the request to answer in place of a request that has been decoded.

    Returns
    -------
    Answer
        A reply, or a structured error; nothing is raised but a lack of memory.
    """
    form, kind = Format.JSON, None

    def failed(error: CruxError, named: str | None = None) -> Answer:
        name, most = identifier(payload, form, kind), most_error_bytes(payload, form, kind)
        return encode_error(error, form, name, named, most)

    try:
        form = Format.named(encoding)
        name = key.rpartition("/")[2]
        # only bulk work has routes
        service = (
            _Service(RouteRequest, _climb) if name == ServiceName.ROUTE else SERVICES_BY_NAME[name]
        )
        kind = service.request
        request: Any = decode_request(payload, kind, form)
        if files is not None:
            request = files.whole(request)
        if revised is not None:
            request = revised(request)
        if not isinstance(request, SetPointsRequest):
            request = over_default(request, hand)
        within = request.deadline if isinstance(request, Query) else None
        with deadline.within(within, started=started):
            deadline.check("the answer was started")
            found = service.answer(request, robots, streams)
        try:
            reply, data = fitted(request, found, form)
        except LimitError:
            if isinstance(found, StreamReply):
                # the client does not get its identifier
                streams.release(found.stream)
            raise
        status: str = getattr(reply, "status", "done")
        return Answer(data, form.label(reply), True, status)
    except InvalidInputError as error:
        named = error.kind if error.kind in REQUEST_KINDS else InvalidInputError.kind
        return failed(error, named)
    except DeadlineError as error:
        return failed(error)
    except MemoryError:
        # memory is a problem of the process, not of the question: its owner has to know
        raise
    except Exception as error:
        log.exception("the request at %s failed", key)
        excuse = CruxError(f"internal error of the service ({type(error).__name__}); see its log")
        return failed(excuse, "internal")
