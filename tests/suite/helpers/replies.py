"""What is answered to requests: replies, errors, and whether a document is of its schema."""

from __future__ import annotations

from functools import cache

import msgspec
from jsonschema import Draft202012Validator

from service.answering import dispatch
from service.replies import ErrorReply, PlanReply
from service.wire import Answer, Format, schema
from tests.suite.helpers.requests import JSON

PLAN = "crux/robosimian/plan"

ERROR_KINDS = {"malformed", "invalid", "unsupported", "unreachable"}
"""Of errors that are the caller's."""


def refusal(request: object, key: str = PLAN, form: str = JSON) -> tuple[str, str | None, str]:
    """Kind, field and message of the error that a request gets."""
    encode = msgspec.msgpack.encode if "msgpack" in form else msgspec.json.encode
    answer = dispatch.handle(key, encode(request), form)
    assert not answer.good
    error = Format.named(answer.encoding).decode(answer.payload, ErrorReply).error
    assert "\n" not in error.message
    return error.kind, error.field, error.message


def reply_to(request: object, form: str = JSON) -> PlanReply:
    """The plan that a request gets."""
    encode = msgspec.msgpack.encode if "msgpack" in form else msgspec.json.encode
    answer = dispatch.handle(PLAN, encode(request), form)
    assert answer.good, answer.payload
    return Format.named(answer.encoding).decode(answer.payload, PlanReply)


@cache
def validator(name: str) -> Draft202012Validator:
    """The check that a document is a message of that name."""
    return Draft202012Validator({"$ref": f"#/$defs/{name}", "$defs": schema()["$defs"]})


def departures(name: str, document: object) -> list[tuple]:
    """Where a document departs from the schema of that message."""
    return [tuple(error.absolute_path) for error in validator(name).iter_errors(document)]


def check_answer(answer: Answer, what: object) -> str:
    """An answer is a plan that says what it is, or an error that is the request's."""
    form = Format.named(answer.encoding)
    if answer.good:
        reply = form.decode(answer.payload, PlanReply)
        assert reply.status in {"optimal", "overloaded", "infeasible", "failed"}, what
        assert reply.verified == (reply.status != "failed"), what
        return reply.status
    error = form.decode(answer.payload, ErrorReply).error
    assert error.kind in ERROR_KINDS, (error, what)
    return error.kind
