"""How large messages may be: requests by what they are for, errors whatever they are about."""

from __future__ import annotations

import msgspec
import pytest
from hypothesis import given, strategies as st

from hand_models.base import CruxError, LimitError
from service.answering import dispatch
from service.replies import ErrorReply
from service.requests import (
    BodySpaceRequest,
    PlanRequest,
    RouteRequest,
    SetPointsRequest,
    StreamRequest,
    WrenchSpaceRequest,
)
from service.wire import (
    LARGEST_ERROR,
    BusyError,
    Format,
    ServiceName,
    decode_request,
    encode_error,
    identifier,
    most_bytes,
)
from tests.suite.helpers.replies import PLAN
from tests.suite.helpers.requests import full_request, put, wall_request

ANY_TEXT = st.text(st.characters(codec=None), max_size=5000) | st.builds(
    lambda part, often: part * often, st.text(min_size=1, max_size=5), st.integers(0, 3000)
)
"""Also halves of pairs of UTF-16, which cannot be written."""


@pytest.mark.parametrize("form", Format)
@given(
    name=st.none() | st.text(max_size=256),
    field=st.none() | ANY_TEXT,
    message=ANY_TEXT,
    again=st.none() | st.floats(0.0, 1e9),
)
def test_errors_are_small_and_say_whose_they_are(
    form: Format, name: str | None, field: str | None, message: str, again: float | None
) -> None:
    error = CruxError(message, field=field) if again is None else BusyError(message, again)
    error.field = field
    payload, encoding, *_ = encode_error(error, form, name, "unsupported")
    assert len(payload) <= LARGEST_ERROR
    reply = Format.named(encoding).decode(payload, ErrorReply)
    assert reply.id == name
    for said, meant in ((reply.error.message, message), (reply.error.field, field)):
        assert (said is None) == (meant is None)
        if meant is not None:
            plain = meant.encode(errors="replace").decode()
            assert said == plain or plain.startswith(said.removesuffix("…"))
            assert said == plain or len(form.encode(said)) > 500
            assert said == plain or len(form.encode(plain)) > 600


@pytest.mark.parametrize("form", Format)
@pytest.mark.parametrize("long", ["x" * 100_000, "\u0001" * 256, "🧗" * 256, '"' * 70_000])
def test_errors_are_small_whatever_a_request_held(form: Format, long: str) -> None:
    name, short = long[:256], long[:64]
    spoilt = [
        {long: 1},
        full_request() | {"id": long * 2},
        full_request() | {"id": name, long: {long: long}},
        full_request() | {"id": name, "objective": long},
        put(full_request(), ("stance", "hand"), {short: {long: {long: long}}}),
        put(full_request(), ("stance", "hands", 1, "limb"), short) | {"id": name},
        put(full_request(), ("stance", "hands", 1, "surface"), short) | {"id": name},
        put(full_request(), ("stance", "robot"), short) | {"id": name},
        put(full_request(), ("limits",), {"per_hand": {short: {long: 1}}}) | {"id": name},
    ]
    for request in spoilt:
        answer = dispatch.handle(PLAN, form.encode(request), form.value)
        assert not answer.good
        assert len(answer.payload) <= LARGEST_ERROR
        error = form.decode(answer.payload, ErrorReply)
        assert error.error.kind == "invalid"
        assert error.id in (None, name, "wall")


def test_requests_are_bounded_by_what_they_are_for() -> None:
    rocky = (PlanRequest, WrenchSpaceRequest, BodySpaceRequest, RouteRequest)
    assert [most_bytes(kind) for kind in rocky] == [2**26] * 4
    assert most_bytes(StreamRequest) == 2**24
    assert most_bytes(SetPointsRequest) == 4096
    name, wrench = "\u0001" * 256, [-1.2345678901234567e-300] * 6
    largest = {"v": 1, "id": name, "stream": "\u0001" * 64, "body_wrench": wrench}
    largest |= {"deadline": 1.2345678901234567e-300, "detail": "set_points"}
    payload = msgspec.json.encode(largest)
    assert len(payload) <= 4096
    assert decode_request(payload, SetPointsRequest).id == name


@pytest.mark.parametrize("form", Format)
def test_of_what_is_too_large_nothing_is_decoded(
    form: Format, monkeypatch: pytest.MonkeyPatch
) -> None:
    payload = form.encode({"v": 1, "id": "mine", "stream": "x" * 4096, "body_wrench": [0.0] * 6})
    monkeypatch.setattr(Format, "decode", None)
    answer = dispatch.handle(f"crux/robosimian/{ServiceName.SET_POINTS}", payload, form.value)
    monkeypatch.undo()
    reply = form.decode(answer.payload, ErrorReply)
    assert (reply.id, reply.error.kind, reply.error.field) == (None, "limit", None)
    assert reply.error.message.startswith(f"{len(payload)} bytes; a SetPointsRequest may have 4096")
    assert identifier(payload, form, SetPointsRequest) is None
    assert identifier(payload, form, PlanRequest) == "mine"


def test_too_large_a_scan_is_refused_with_how_to_send_less() -> None:
    for kind, most in [(PlanRequest, 2**26), (StreamRequest, 2**24)]:
        payload = msgspec.json.encode(wall_request()).ljust(most + 1)
        with pytest.raises(
            LimitError, match=rf"{most} at most: let hands share a scan under stance"
        ):
            decode_request(payload, kind)
