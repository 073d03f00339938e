"""Replies take no more bytes than their requests allow; what would fit is told, and does."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest
import zenoh
from hypothesis import given, strategies as st

from hand_models.base import CruxError, InvalidInputError, LimitError
from service.answering import Streams, handle
from service.answering.reply_sizes import fitted
from service.bulk import answer_all
from service.commands.options import with_extras
from service.commands.stances import read_request
from service.replies import ClimbReply, ErrorReply
from service.requests import LEAST_REPLY_BYTES, ClimbRequest, PlanRequest
from service.serving.question import received_question
from service.wire import LARGEST_ERROR, Answer, BusyError, Format, decode_request, encode_error
from tests.suite.helpers.replies import PLAN
from tests.suite.helpers.requests import HEAVY, stream_request, wall_request
from tests.suite.problems import problem

DETAILS = ("full", "hands", "set_points")
SIZE = re.compile(r"(\d+) (with(?:out)? [\w ]+?)(?=[,;]|$)")
CLOCK = 60
"""Bytes by which replies differ whose times have more or fewer digits."""

REQUESTS: dict[str, Any] = {
    "optimal": wall_request,
    "overloaded": lambda: wall_request(4.0 * HEAVY),
    "joints": lambda: problem("joints/given-0").request,
    "infeasible": lambda: problem("infeasible/infeasible-4").request,
}


def answered(request: dict[str, Any], form: Format = Format.JSON, key: str = PLAN) -> Answer:
    return handle(key, form.encode(request), form.value)


def error_of(answer: Answer, form: Format = Format.JSON) -> tuple[str, str | None, dict[str, int]]:
    """Kind and field of an error, and the sizes that it tells, by what is to be done."""
    assert not answer.good
    error = form.decode(answer.payload, ErrorReply).error
    return error.kind, error.field, {what: int(size) for size, what in SIZE.findall(error.message)}


@pytest.mark.parametrize("form", Format)
@pytest.mark.parametrize("name", REQUESTS)
def test_as_much_is_told_as_fits(name: str, form: Format) -> None:
    request = {name: value for name, value in REQUESTS[name]().items() if name != "detail"}
    told = {detail: answered(request | {"detail": detail}, form) for detail in DETAILS}
    sizes = {detail: len(answer.payload) for detail, answer in told.items()}
    assert sizes["full"] > sizes["hands"] > sizes["set_points"]
    for most in (LEAST_REPLY_BYTES, 1300, 1800, 2500, 3300, 4000, 10_000, 40_000, 1_000_000):
        if any(abs(most - size) < CLOCK for size in sizes.values()):
            continue
        answer = answered(request | {"max_reply_bytes": most}, form)
        assert len(answer.payload) <= most
        fits = [detail for detail in DETAILS if sizes[detail] <= most]
        assert answer.good == bool(fits)
        if not fits:
            kind, field, others = error_of(answer, form)
            assert (kind, field) == ("limit", "max_reply_bytes")
            assert others["with detail set_points"] == pytest.approx(sizes["set_points"], abs=CLOCK)
            continue
        ours, theirs = (form.decode(each.payload, dict) for each in (answer, told[fits[0]]))
        for reply in (ours, theirs):
            reply.pop("time", None)
        assert answer.encoding == told[fits[0]].encoding
        assert ours == theirs


def test_a_detail_that_was_asked_for_is_kept_to() -> None:
    for detail in DETAILS:
        for form in Format:
            request = wall_request() | {"detail": detail, "max_reply_bytes": LEAST_REPLY_BYTES}
            answer = answered(request, form)
            if answer.good:  # set-points in MessagePack
                assert (detail, form) == ("set_points", Format.MSGPACK)
                continue
            kind, field, others = error_of(answer, form)
            assert (kind, field) == ("limit", "max_reply_bytes")
            below = DETAILS[DETAILS.index(detail) + 1 :]
            assert [words for words in others if "detail" in words] == [
                f"with detail {d}" for d in below
            ]
            for smaller in below:
                size = len(answered(wall_request() | {"detail": smaller}, form).payload)
                assert others[f"with detail {smaller}"] == pytest.approx(size, abs=CLOCK)


def test_what_a_detail_does_not_tell_is_not_named() -> None:
    request = wall_request() | {"detail": "hands", "want": ["model", "robust", "prices"]}
    _, _, others = error_of(answered(request | {"max_reply_bytes": 1500}))
    assert [*others] == ["with detail set_points"]


@pytest.mark.parametrize("form", Format)
@pytest.mark.parametrize(
    "want",
    [
        ["model"],
        ["clearance", "prices"],
        ["model", "prices"],
        pytest.param(["prices", "robust", "clearance"], marks=pytest.mark.slow),
    ],
)
@pytest.mark.usefixtures("few_places")
def test_what_was_asked_for_in_addition_is_named_with_its_size(
    want: list[str], form: Format
) -> None:
    request = wall_request() | {"detail": "full", "want": want}
    _, _, others = error_of(answered(request | {"max_reply_bytes": 1500}, form), form)
    named = {words: size for words, size in others.items() if words.startswith("without ")}
    without = {f"without {name} in want": [w for w in want if w != name] for name in want}
    if len(want) > 1:
        without["without all of these"] = []
    assert named.keys() == without.keys()
    for words, rest in without.items():
        size = len(answered(request | {"want": rest}, form).payload)
        assert named[words] == pytest.approx(size, abs=CLOCK), words


@pytest.mark.parametrize(
    ("want", "form"),
    [
        (None, Format.MSGPACK),
        (["vertices", "half_spaces"], Format.JSON),
        (["half_spaces", "robust"], Format.JSON),
        ([], Format.JSON),
    ],
)
@pytest.mark.usefixtures("few_places")
def test_of_a_wrench_space_views_may_be_left_out(want: list[str] | None, form: Format) -> None:
    stance = wall_request()["stance"]
    request = {"v": 1, "stance": stance, "limb": stance["hands"][0]["limb"]}
    request |= {} if want is None else {"want": want}
    whole = len(answered(request, form, "wrench_space").payload)
    few = request | {"max_reply_bytes": 4000}
    kind, field, others = error_of(answered(few, form, "wrench_space"), form)
    assert (kind, field) == ("limit", "max_reply_bytes")
    views = ["vertices", "half_spaces"] if want is None else want
    assert others.keys() == {f"without {view} in want" for view in views} | (
        {"without all of these"} if views else set()
    )
    for view in views:
        rest = request | {"want": [each for each in views if each != view]}
        size = len(answered(rest, form, "wrench_space").payload)
        assert others[f"without {view} in want"] == size
    least = min([whole, *others.values()])
    fitting = request | {"want": [], "max_reply_bytes": least}
    answer = answered(fitting, form, "wrench_space")
    assert answer.good
    assert len(answer.payload) == least


def test_how_a_hand_lets_go_may_be_left_out_of_a_wrench_space() -> None:
    stance = wall_request()["stance"]
    request = {"v": 1, "stance": stance, "limb": stance["hands"][0]["limb"], "want": ["opening"]}
    _, _, others = error_of(
        answered(request | {"max_reply_bytes": 4000}, Format.JSON, "wrench_space")
    )
    size = len(answered(request | {"want": []}, Format.JSON, "wrench_space").payload)
    assert others == {"without opening in want": size}


def searched(**more: Any) -> ClimbReply:
    nothing = dict.fromkeys(("least", "bound", "gap", "deciding", "route", "knots"))
    whole: dict[str, Any] = {
        **{"name": "c", "robot": "r", "status": "none", "about": "a"},
        **{"placements": 0, "bodies": 0, "programs": 0, "seconds": {}},
        **{"raises": [], "refused": [], "stages": []},
    }
    return ClimbReply(**nothing, **(whole | more))


def refusal_of(reply: ClimbReply) -> str:
    """What is said of a reply to a search that has too many bytes."""
    ends = {"start": {"height": 0.8}, "goal": {"height": 2.5}}
    asked = {"v": 1, "rock": "small-wall", "max_reply_bytes": LEAST_REPLY_BYTES, **ends}
    with pytest.raises(LimitError) as refused:
        fitted(msgspec.convert(asked, ClimbRequest), reply, Format.JSON)
    return refused.value.message


def test_the_proof_of_a_climb_may_be_left_out() -> None:
    size = len(Format.JSON.encode(searched()))
    assert f"{size} without certificate in want" in refusal_of(searched(certificate=b"x" * 9000))


def test_what_is_to_be_allowed_also_takes_times_of_more_digits() -> None:
    short = {"index": 0.1, "search": 0.5, "moves": 2.0}
    long = {"index": 0.10000000000000009, "search": 0.5000000000000009, "moves": 2.0000000000000004}
    for letters in range(100):
        name = "c" * (1000 + letters)
        told = refusal_of(searched(id=name, seconds=short))
        allowed = int(re.findall(r"allow (\d+)", told)[0])
        assert len(Format.JSON.encode(searched(id=name, seconds=long))) <= allowed


def test_of_a_body_space_directions_may_be_left_out() -> None:
    stance = wall_request()["stance"]
    request = {"v": 1, "stance": stance, "directions": [[1, 0, 0], [0, 0, 1]]}
    _, _, others = error_of(
        answered(request | {"max_reply_bytes": 4000}, Format.JSON, "body_space")
    )
    size = len(answered(request | {"directions": []}, Format.JSON, "body_space").payload)
    assert others == {"without directions": pytest.approx(size, abs=CLOCK)}


def test_what_is_not_there_is_not_said_to_be_left_out() -> None:
    request = {"v": 1, "stance": wall_request()["stance"], "max_reply_bytes": 1000}
    _, _, others = error_of(answered(request, Format.JSON, "body_space"))
    assert others == {}


@pytest.mark.parametrize("form", Format)
def test_a_stream_that_nobody_would_hear_of_is_not_kept(form: Format) -> None:
    streams = Streams()
    request = stream_request() | {"max_reply_bytes": LEAST_REPLY_BYTES, "id": "x" * 256}
    refused = handle("stream", form.encode(request), form.value, streams=streams)
    kind, field, _ = error_of(refused, form)
    assert (kind, field) == ("limit", "max_reply_bytes")
    assert len(refused.payload) <= LEAST_REPLY_BYTES
    assert len(streams) == 0
    allowed = int(re.findall(rb"allow (\d+)", refused.payload)[0])
    kept = handle(
        "stream", form.encode(request | {"max_reply_bytes": allowed}), form.value, streams=streams
    )
    assert kept.good
    assert len(streams) == 1
    stream = form.decode(kept.payload, dict)
    question = {"v": 1, "stream": stream["stream"], "body_wrench": stream["body_wrench"]}
    sizes = {}
    for detail in ("full", "set_points"):
        asked = question | {"detail": detail}
        answer = handle("set_points", form.encode(asked), form.value, streams=streams)
        sizes[detail] = len(answer.payload)
    most = max(LEAST_REPLY_BYTES, sizes["set_points"] + CLOCK)
    assert most < sizes["full"]
    asked = question | {"max_reply_bytes": most}
    answer = handle("set_points", form.encode(asked), form.value, streams=streams)
    assert answer.good
    assert len(answer.payload) <= most
    assert set(form.decode(answer.payload, dict)["hands"][0]) == {
        *("limb", "tensions", "winch_angle")
    }
    refused = handle(
        "set_points", form.encode(asked | {"detail": "full"}), form.value, streams=streams
    )
    assert "with detail set_points" in error_of(refused, form)[2]
    streams.close()


@pytest.mark.parametrize("form", Format)
@given(
    name=st.none() | st.text(max_size=256),
    field=st.none() | st.text(max_size=3000),
    message=st.text(max_size=3000),
    most=st.integers(LEAST_REPLY_BYTES, LARGEST_ERROR),
    again=st.none() | st.floats(0.0, 1e9),
)
def test_errors_fit_whatever_they_say(
    form: Format, name: str | None, field: str | None, message: str, most: int, again: float | None
) -> None:
    error = CruxError(message, field=field) if again is None else BusyError(message, again)
    error.field = field
    answer = encode_error(error, form, name, "unsupported", most)
    assert len(answer.payload) <= most
    assert form.decode(answer.payload, ErrorReply).error.kind == "unsupported"


def test_errors_of_requests_fit_too() -> None:
    for form in Format:
        request = wall_request() | {"id": "\u0001" * 256, "max_reply_bytes": LEAST_REPLY_BYTES}
        request["stance"]["hands"][0]["surface"] = "\u0001" * 64
        answer = answered(request, form)
        assert not answer.good
        assert len(answer.payload) <= LEAST_REPLY_BYTES


def test_what_is_no_number_of_bytes_is_refused() -> None:
    for most in [999, 0, -4000, 2**31 + 1, 1.5, "4000", [4000], {}]:
        request = wall_request() | {"id": "mine", "max_reply_bytes": most}
        with pytest.raises(InvalidInputError) as caught:
            decode_request(msgspec.json.encode(request), PlanRequest)
        assert caught.value.field == "max_reply_bytes"
        reply = Format.JSON.decode(answered(request).payload, ErrorReply)
        assert (reply.id, reply.error.kind) == ("mine", "invalid")


def test_a_service_that_is_busy_keeps_to_it() -> None:
    for form in Format:
        request = wall_request() | {"id": "\u0001" * 256, "max_reply_bytes": LEAST_REPLY_BYTES}
        query = SimpleNamespace(
            payload=zenoh.ZBytes(form.encode(request)),
            attachment=None,
            source_info=None,
            encoding=form.value,
        )
        question = received_question(query, PLAN, 0.0, 10.0)
        assert len(question.refusal(BusyError("x" * 500, 1.0)).payload) <= LEAST_REPLY_BYTES


def test_a_person_reads_all_of_it() -> None:
    request = msgspec.structs.replace(read_request("wall-300"), max_reply_bytes=4000)
    assert with_extras(request).max_reply_bytes is None
    assert with_extras(request, whole=False).max_reply_bytes == 4000


def test_rows_of_a_table_are_told_whatever_their_replies_would_take() -> None:
    request = wall_request() | {"max_reply_bytes": LEAST_REPLY_BYTES}
    (brief,) = answer_all([msgspec.json.encode(request)], brief=True)
    (reply,) = answer_all([msgspec.json.encode(request)])
    assert brief.status == "optimal"
    assert not reply.good
    assert error_of(reply)[0] == "limit"
