"""What travels is read as it was meant; what is no message is the caller's error."""

from __future__ import annotations

import itertools
import json
import random
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest
from hypothesis import given, strategies as st

from hand_models.base import InvalidInputError
from service.answering import dispatch
from service.replies import ErrorReply, PlanReply
from service.requests import PlanRequest, WrenchSpaceRequest
from service.wire import Format, MalformedError, decode_request
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.replies import PLAN, check_answer
from tests.suite.helpers.requests import (
    JSON,
    MSGPACK,
    flat_request,
    full_request,
    plan_request,
    request_with_joints,
    spoil,
    wall_request,
)


def test_a_request_survives_the_journey() -> None:
    for asked in [full_request, request_with_joints]:
        for form in Format:
            request = plan_request(asked())
            assert decode_request(form.encode(request), PlanRequest, form) == request


def test_defaults_do_not_travel() -> None:
    sent = json.loads(msgspec.json.encode(plan_request(wall_request())))
    assert set(sent) == {"v", "id", "stance", "load"}
    assert set(sent["stance"]["hands"][0]) == {"limb", "pose", "hold", "surface", "grasp"}


def test_null_means_left_out() -> None:
    request = wall_request()
    spelled = request | {"body_wrench": None, "confidence": None, "deadline": None}
    assert plan_request(spelled) == plan_request(request)


def test_names_of_encodings() -> None:
    for encoding, form in [
        ("", Format.JSON),
        ("zenoh/bytes", Format.JSON),
        ("text/json", Format.JSON),
        ("application/json;crux.PlanRequest@1", Format.JSON),
        ("Application/MsgPack; crux.PlanReply@1", Format.MSGPACK),
    ]:
        assert Format.named(encoding) is form


def test_replies_may_gain_fields() -> None:
    answer = dispatch.handle(PLAN, msgspec.json.encode(wall_request()))
    grown = json.loads(answer.payload) | {"news": {"of": ["a later version"]}}
    Format.JSON.decode(json.dumps(grown).encode(), PlanReply)


# No messages -------------------------------------------------------------------------------------


def test_json_has_no_infinite_numbers_either() -> None:
    for token in ["NaN", "Infinity", "1e999", "-1e999"]:
        text = json.dumps(wall_request(mass=12345.0)).replace("12345.0", token)
        answer = dispatch.handle(PLAN, text.encode())
        assert not answer.good


def test_bytes_that_are_no_message() -> None:
    for payload, encoding in [
        (b"", JSON),
        (b"{", JSON),
        (b"\xff\xfe", JSON),
        (b'{"v": 1, "id": "\xff"}', JSON),
        (b'{"v": 1, "id": "\\ud800"}', JSON),
        (b"\xc1", MSGPACK),
        (b"\x81\xa1v", MSGPACK),
        (b"{}", "image/png"),
        (b"{}", "application/jsonp"),
        (b'{"v":1,"confidence":' + b"[" * 400_000, JSON),
        (b"\x82\xa1v\x01\xaaconfidence" + b"\x91" * 400_000, MSGPACK),
    ]:
        answer = dispatch.handle(PLAN, payload, encoding)
        error = Format.named(answer.encoding).decode(answer.payload, ErrorReply).error
        assert not answer.good
        assert error.kind == "malformed"
        assert len(answer.payload) < 1000


def test_bytes_of_the_other_encoding_are_recognised() -> None:
    request = plan_request()
    names = {Format.JSON: "JSON", Format.MSGPACK: "MessagePack"}
    for said, sent in [(Format.JSON, Format.MSGPACK), (Format.MSGPACK, Format.JSON)]:
        told = f"the encoding says {names[said]}; the bytes look like {names[sent]}: .*{sent.value}"
        with pytest.raises(MalformedError, match=told):
            decode_request(sent.encode(request), PlanRequest, said)
    # what is of its encoding has the errors that it had
    for form in Format:
        with pytest.raises(InvalidInputError) as wrong:
            decode_request(form.encode({"v": "one"}), PlanRequest, form)
        assert wrong.value.kind == "invalid"


def test_errors_do_not_grow_with_the_request() -> None:
    for key, value in itertools.product(("x" * 500_000, "id"), ("y" * 500_000,)):
        answer = dispatch.handle(PLAN, msgspec.json.encode({key: value}))
        assert len(answer.payload) < 2000


def test_malformed_errors_are_the_callers() -> None:
    with pytest.raises(MalformedError, match="not valid JSON"):
        decode_request(b"{", PlanRequest)
    for form in Format:
        with pytest.raises(MalformedError, match="nothing was sent, a PlanRequest is needed"):
            decode_request(b"", PlanRequest, form)
    with pytest.raises(InvalidInputError, match=r"limb: missing"):
        decode_request(
            msgspec.json.encode({"v": 1, "stance": flat_request()["stance"]}), WrenchSpaceRequest
        )


# Fuzz ---------------------------------------------------------------------------------------------


def check_spoilt(count: int) -> None:
    chance = random.Random(20260)
    seen: dict[str, int] = {}
    for i in range(count):
        request = (full_request, flat_request, request_with_joints, flat_request)[i % 4]()
        payload, encoding = spoil(request, chance)
        outcome = check_answer(dispatch.handle(PLAN, payload, encoding), (i, payload[:2000]))
        seen[outcome] = seen.get(outcome, 0) + 1
    assert seen["invalid"] > count / 4
    assert seen["malformed"] > count / 40
    assert seen["unsupported"] > count / 200
    planned = sum(seen.get(status, 0) for status in ("optimal", "overloaded", "infeasible"))
    assert planned > count / 20


def test_spoilt_requests_get_a_plan_or_an_error() -> None:
    check_spoilt(120)


@pytest.mark.slow
def test_two_thousand_spoilt_requests_get_a_plan_or_an_error() -> None:
    check_spoilt(2000)


@given(payload=st.binary(max_size=300), form=st.sampled_from([JSON, MSGPACK]))
def test_random_bytes_are_never_more_than_an_error(payload: bytes, form: str) -> None:
    answer = dispatch.handle(PLAN, payload, form)
    assert not answer.good


def test_threads_may_be_the_first_to_decode_a_kind(tmp_path: Path) -> None:
    """In msgspec alone, threads that are the first to decode a type crash the process."""
    answer = dispatch.handle(PLAN, msgspec.msgpack.encode(wall_request()), MSGPACK)
    file = tmp_path / "reply"
    file.write_bytes(answer.payload)
    code = f"""
import sys, threading
from service.replies import PlanReply
from service.wire import Format
sys.setswitchinterval(1e-6)
data, begin, read = open({str(file)!r}, "rb").read(), threading.Barrier(8), []
def decode():
    begin.wait()
    read.append(Format.MSGPACK.decode(data, PlanReply).status)
threads = [threading.Thread(target=decode) for _ in range(8)]
[thread.start() for thread in threads]
[thread.join() for thread in threads]
print(*read)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout.split()) == (0, ["optimal"] * 8)
