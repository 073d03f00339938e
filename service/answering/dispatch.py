"""Dispatch requests to their handlers: bytes in, bytes out, also for bytes that are no request."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final, NamedTuple

from msgspec.structs import replace

import planner
from hand_models.base import CruxError, InvalidInputError, LimitError
from hand_models.parameters import ParameterTable
from planner import deadline
from service.answering.answers import Planned, plan_reply
from service.answering.body_space import find_com_region
from service.answering.mesh_files import MeshFiles
from service.answering.own_models import BUNDLED_ROBOTS, Robots, over_default
from service.answering.questions import climb, question
from service.answering.reply_sizes import fitted, fitted_part
from service.answering.slips import add_survival, answer_diagnosis, check_survival
from service.answering.streams import LOCAL_STREAMS, Streams
from service.replies import BriefPlanReply, PartReply, PlanReply, Reply, StreamReply
from service.requests import (
    BodySpaceRequest,
    ClimbRequest,
    DiagnosisRequest,
    PlanRequest,
    Query,
    Request,
    RouteRequest,
    SetPointsRequest,
    StreamRequest,
    WrenchRequest,
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
    "ADVICE_TIME",
    "SERVICES_BY_NAME",
    "answer_plan",
    "answer_with_advice",
    "handle",
    "planned",
]

log = logging.getLogger(__name__)

ADVICE_TIME: Final = 30.0
"""Timeout of a search for advice that a command adds by itself [s]."""


def answer_plan(
    request: PlanRequest, robots: Robots = BUNDLED_ROBOTS
) -> PlanReply | BriefPlanReply:
    """Answer a plan request: build the planner's question, solve it, and return the reply.

    Parameters
    ----------
    request : PlanRequest
        Stance, load, limits, and the extras that are wanted.
    robots : Robots, optional
        Robots that a request may name, with the functions that build them; bundled robots by
        default.

    Returns
    -------
    PlanReply or BriefPlanReply
        A `PlanReply` if the request's ``detail`` is ``full`` or not given; a `BriefPlanReply`
        otherwise.

    Raises
    ------
    InvalidInputError
        If the request is impossible. The error's ``field`` is a path in the request.
    """
    return planned(request, robots).reply


def planned(request: PlanRequest, robots: Robots = BUNDLED_ROBOTS) -> Planned:
    """Answer a plan request as `answer_plan` does, and return question and plan with the reply.

    Parameters
    ----------
    request : PlanRequest
        Stance, load, limits, and the extras that are wanted.
    robots : Robots, optional
        Robots that a request may name, with the functions that build them; bundled robots by
        default.

    Returns
    -------
    Planned
        The planner's question, its plan, and the reply.

    Raises
    ------
    InvalidInputError
        If the request is impossible. The error's ``field`` is a path in the request.
    """
    detail = request.detail or "full"
    if detail != "full":
        # compute only what the reply contains
        included = ["load_factor"] if detail == "hands" else []
        wanted = [want for want in request.want if want in included]
        request = replace(request, want=wanted, draws=[], open_loop=None, survival=None)
    check_survival(request)
    asked = question(request, robots)
    start = time.perf_counter()
    answer = planner.plan(asked)
    found = Planned.of(asked, answer, request.id, detail, model="model" in request.want)
    reply = found.reply
    if not isinstance(reply, PlanReply):
        return found
    with deadline.within(asked.deadline, started=start):
        if "redundancy" in request.want:
            with _extra(reply, "redundancy"):
                reply.redundancy = planner.find_redundancy(asked)
        if "survival" in request.want:
            settings = request.survival or planner.SurvivalSettings()
            with _extra(reply, "survival"):
                add_survival(reply, asked, answer, settings)
    if "com_region" in request.want:
        with _extra(reply, "com_region"):
            reply.com_region = find_com_region(asked)
    return found


@contextmanager
def _extra(reply: PlanReply, name: deadline.Unfinished) -> Iterator[None]:
    """Let a block add an extra to a reply; if the deadline ends it, say so in the reply."""
    try:
        yield
    except planner.DeadlineError as error:
        reply.unfinished.append(name)
        reply.warnings.append(deadline.late_sentence(error.seconds, (name,)))


def answer_with_advice(answer: Planned) -> Planned:
    """Add advice to an answer: search for changes of the question that lower its utilisation.

    Parameters
    ----------
    answer : Planned
        Answer to a plan request.

    Returns
    -------
    Planned
        Plan and reply with advice. The given answer itself if its reply is brief, or if its plan
        has advice already.
    """
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


Report = Callable[[PartReply], None]


def _wrench_space(asked: WrenchSpaceRequest, robots: Robots, *_: object) -> Reply:
    from service.answering.hand_spaces import answer_wrench_space

    return answer_wrench_space(asked, robots)


def _body_space(asked: BodySpaceRequest, robots: Robots, *_: object) -> Reply:
    from service.answering.body_space import explore

    return explore(asked, robots).reply


def _diagnosis(asked: DiagnosisRequest, robots: Robots, *_: object) -> Reply:
    return answer_diagnosis(asked, robots)


def _climb(asked: ClimbRequest, robots: Robots, _: Streams, report: Report | None = None) -> Reply:
    from service.answering.climbs import answer_climb

    return answer_climb(asked, robots, report)


class _Service(NamedTuple):
    """Kind of request, and the function that answers it.

    The function takes request, robots, streams, and what sends parts of the answer.
    """

    request: type[Request]
    answer: Callable[[Any, Robots, Streams, Report | None], Reply | Planned]


SERVICES_BY_NAME: Final[dict[str, _Service]] = {
    ServiceName.PLAN: _Service(PlanRequest, lambda asked, robots, *_: planned(asked, robots)),
    ServiceName.WRENCH_SPACE: _Service(WrenchSpaceRequest, _wrench_space),
    ServiceName.BODY_SPACE: _Service(BodySpaceRequest, _body_space),
    ServiceName.DIAGNOSIS: _Service(DiagnosisRequest, _diagnosis),
    ServiceName.ROUTE: _Service(
        RouteRequest, lambda asked, robots, _, report: climb(asked, robots, report)
    ),
    ServiceName.CLIMB: _Service(ClimbRequest, _climb),
    ServiceName.STREAM: _Service(
        StreamRequest, lambda asked, robots, streams, _: streams.declare(asked, robots)
    ),
    ServiceName.SET_POINTS: _Service(
        SetPointsRequest, lambda asked, _, streams, __: streams.set_points(asked)
    ),
}
"""Request type and handler of each service over zenoh, by the last part of the service's key."""


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
    stream: str | None = None,
    send: Callable[[Answer], None] | None = None,
) -> Answer:
    """Answer one query: decode the request, dispatch it to its handler, and encode the reply.

    Parameters
    ----------
    key : str
        Zenoh key. Its last part names one of `SERVICES_BY_NAME`.
    payload : bytes
        Encoded request.
    encoding : str, optional
        Zenoh encoding of the payload, such as ``application/json``. The answer has the same
        format.
    hand : ParameterTable, optional
        Parameter values of the service's hand that differ from the bundled hand. Values that a
        request gives replace these.
    robots : Robots, optional
        Robots that a request may name, with the functions that build them; bundled robots by
        default.
    started : float, optional
        Time from which the request's deadline counts, on the clock of `time.perf_counter` [s]; now
        by default.
    streams : Streams, optional
        Wrench streams that requests for set-points may use; by default the streams of this process
        that belong to no service.
    files : MeshFiles, optional
        Reader of the mesh files that a plan request may name. By default such a request is refused.
    revised : callable, optional
        Maps the decoded request to the request that is answered in its place.
    stream : str, optional
        Stream on which the payload was published; it is then a `WrenchRequest`.
    send : callable, optional
        Takes parts of the answer, each an encoded reply that is not the last. By default the answer
        is whole, also where the request asks for parts.

    Returns
    -------
    Answer
        An encoded reply, or an encoded error reply.

    Raises
    ------
    MemoryError
        If memory runs out. All other errors become error replies.
    """
    form, kind = Format.JSON, None

    def failed(error: CruxError, named: str | None = None) -> Answer:
        name, most = identifier(payload, form, kind), most_error_bytes(payload, form, kind)
        return encode_error(error, form, name, named, most)

    def report(part: PartReply) -> None:
        assert send is not None
        for payload in fitted_part(request, part, form):
            send(Answer(payload, form.label(part), last=False))

    try:
        form = Format.named(encoding)
        name = key.rpartition("/")[2]
        service = SERVICES_BY_NAME[name]
        kind = service.request if stream is None else WrenchRequest
        request: Any = decode_request(payload, kind, form)
        if stream is not None:
            request = request.asked(stream)
        if files is not None:
            request = files.whole(request)
        if revised is not None:
            request = revised(request)
        if not isinstance(request, SetPointsRequest):
            request = over_default(request, hand)
        within = request.deadline if isinstance(request, Query) else None
        with deadline.within(within, started=started):
            deadline.check("the answer was started")
            found = service.answer(request, robots, streams, None if send is None else report)
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
    except planner.DeadlineError as error:
        return failed(error)
    except MemoryError:
        # memory is a problem of the process, not of the question: its owner has to know
        raise
    except Exception as error:
        log.exception("the request at %s failed", key)
        excuse = CruxError(f"internal error of the service ({type(error).__name__}); see its log")
        return failed(excuse, "internal")
