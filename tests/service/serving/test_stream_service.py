"""Streams from outside: over zenoh in real sessions, as messages, and on the command line."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Callable, Iterator
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest
import zenoh

from planner import LostTile
from planner.result import SetPoints
from planner.streaming import WrenchStream
from service import CruxClient, PlanRequest, SetPointsRequest, StreamRequest
from service.answering import Streams, dispatch, streams
from service.commands.cli import run_command_line
from service.replies import SetPointsReply, StreamReply
from service.serving import PlanService, open_session, zenoh_config
from service.wire import Format, ServiceError, ServiceName, decode_request, service_key
from tests.suite.helpers.commands import (
    BAD_INPUT,
    DONE,
    FAILED,
    OVERLOADED,
    complaint,
    process,
    result,
)
from tests.suite.helpers.patience import PATIENCE
from tests.suite.helpers.replies import departures
from tests.suite.helpers.requests import (
    HEAVY,
    JSON,
    LIGHT,
    MSGPACK,
    compliant_request,
    put,
    stream_request,
    wall_request,
)
from tests.suite.helpers.served import free_endpoint

WRENCH = [1050.0, 10.0, -5.0, 2.0, 1.0, 0.0]


def declaration(request: dict | None = None, **more: object) -> StreamRequest:
    return decode_request(msgspec.json.encode(stream_request(request, **more)), StreamRequest)


def answered(key: str, request: dict, known: Streams) -> dict:
    answer = dispatch.handle(key, msgspec.json.encode(request), streams=known)
    return json.loads(answer.payload) | {"good": answer.good}


@pytest.fixture
def known() -> Iterator[Streams]:
    opened = Streams()
    yield opened
    opened.close()


# Over zenoh ---------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def serving() -> Iterator[tuple[PlanService, str]]:
    """A service of this process, on TCP loopback."""
    endpoint = free_endpoint()
    config = zenoh_config(mode="peer", listen=[endpoint], multicast=False)
    with open_session(config) as session, PlanService(session, workers=1) as service:
        yield service, endpoint


@pytest.fixture
def client(serving) -> Iterator[CruxClient]:
    config = zenoh_config(mode="client", connect=[serving[1]], multicast=False)
    with CruxClient(config, timeout=PATIENCE) as opened:
        yield opened


def test_a_stance_is_declared_and_asked_for_set_points(client: CruxClient) -> None:
    declared = client.stream(declaration())
    assert (declared.status, declared.radius) == ("optimal", 30.0)
    assert declared.gap < 1e-9
    answer = client.plan(decode_request(msgspec.json.encode(wall_request()), PlanRequest))
    assert declared.body_wrench == pytest.approx(answer.body_wrench)
    assert declared.utilisation == pytest.approx(answer.utilisation, rel=1e-5)
    wrench = tuple(np.add(answer.body_wrench, [5.0, -4.0, 3.0, 0.5, 0.0, 0.2]).tolist())
    reply = client.set_points(SetPointsRequest(v=1, stream=declared.stream, body_wrench=wrench))
    assert (reply.status, reply.source, reply.verified) == ("optimal", "interpolated", True)
    assert (reply.stream, reply.v, reply.reason) == (declared.stream, 1, None)
    asked = wall_request() | {"body_wrench": list(wrench)}
    asked.pop("load", None)
    whole = client.plan(decode_request(msgspec.json.encode(asked), PlanRequest))
    assert -1e-6 <= reply.utilisation - whole.utilisation <= reply.gap + 1e-6
    for mine, hand, columns in zip(reply.hands, whole.hands, declared.hands, strict=True):
        assert mine.limb == hand.limb == columns.limb
        assert columns.columns[:4] == [f"{finger.name}/tension" for finger in hand.fingers]
        tensions = [finger.tendon_tension for finger in hand.fingers]
        assert mine.tensions == pytest.approx(tensions, rel=0.1, abs=3.0)
        per_newton = hand.fingers[0].motor_torque / tensions[0]
        assert mine.motor_torque == pytest.approx([per_newton * f for f in mine.tensions])


def test_a_stance_of_compliant_wrists_is_asked_for_set_points(client: CruxClient) -> None:
    request = compliant_request()
    declared = client.stream(declaration(request))
    assert (declared.status, declared.radius) == ("optimal", None)
    assert all(each.columns[4].startswith("wrist/") for each in declared.hands)
    wrench = tuple(np.add(declared.body_wrench, [5.0, -4.0, 3.0, 0.5, 0.0, 0.2]).tolist())
    reply = client.set_points(SetPointsRequest(v=1, stream=declared.stream, body_wrench=wrench))
    assert (reply.status, reply.source, reply.verified) == ("optimal", "solved", True)
    asked = request | {"body_wrench": list(wrench)}
    asked.pop("load", None)
    whole = client.plan(decode_request(msgspec.json.encode(asked), PlanRequest))
    assert reply.utilisation == pytest.approx(whole.utilisation, rel=0.01)
    stiffness = [5000.0] * 3 + [100.0] * 3
    for hand in reply.hands:
        pull = np.multiply(stiffness, np.subtract(hand.pose_target, hand.twist))
        assert pull == pytest.approx(hand.wrench, abs=1e-6)


@pytest.mark.parametrize("form", Format)
def test_messages_come_in_the_encoding_of_the_request(serving, form: Format) -> None:
    config = zenoh_config(mode="client", connect=[serving[1]], multicast=False)
    with zenoh.open(config) as session:

        def ask(name: str, request: object) -> zenoh.Sample:
            key = service_key("robosimian", name)
            payload = form.encode(request)
            (reply,) = session.get(key, payload=payload, encoding=form.value, timeout=PATIENCE)
            return reply.ok

        declared = ask(ServiceName.STREAM, declaration())
        assert str(declared.encoding) == f"{form.value};crux.StreamReply@1"
        identifier = form.decode(declared.payload.to_bytes(), StreamReply).stream
        request = {"v": 1, "stream": identifier, "body_wrench": WRENCH}
        told = ask(ServiceName.SET_POINTS, request)
        assert str(told.encoding) == f"{form.value};crux.SetPointsReply@1"
        assert form.decode(told.payload.to_bytes(), SetPointsReply).verified


def test_an_unknown_stream_is_an_error_that_names_the_field(client: CruxClient) -> None:
    request = SetPointsRequest(v=1, stream="nobody", body_wrench=tuple(WRENCH))
    with pytest.raises(ServiceError, match="no stream 'nobody'") as caught:
        client.set_points(request)
    assert (caught.value.kind, caught.value.field) == ("invalid", "stream")


# Messages -----------------------------------------------------------------------------------------


def test_only_so_many_streams_are_kept(known: Streams, monkeypatch) -> None:
    closed: list[int] = []
    count = iter(range(100))

    def opened(request: StreamRequest, robots: object) -> SimpleNamespace:
        number = next(count)
        return stand_in(lambda: closed.append(number))

    monkeypatch.setattr(streams, "opened", opened)
    names = [known.declare(declaration()).stream for _ in range(known.most)]
    assert len(set(names)) == known.most
    known.set_points(SetPointsRequest(v=1, stream=names[0], body_wrench=tuple(WRENCH)))
    names += [known.declare(declaration()).stream for _ in range(2)]
    # the first was asked for since
    assert closed == [1, 2]
    request = {"v": 1, "stream": names[1], "body_wrench": WRENCH}
    assert answered(ServiceName.SET_POINTS, request, known)["error"]["field"] == "stream"
    assert answered(ServiceName.SET_POINTS, request | {"stream": names[0]}, known)["good"]
    known.close()
    assert sorted(closed) == list(range(known.most + 2))


@pytest.mark.parametrize("counts", [(1, 40), (2, 40), (8, 40), (1, 1, 40), (3, 4, 4, 40)])
def test_who_declares_many_streams_puts_out_his_own(
    known: Streams, monkeypatch: pytest.MonkeyPatch, counts: tuple[int, ...]
) -> None:
    monkeypatch.setattr(streams, "opened", lambda *_: stand_in())
    owners = [known.of(str(i)) for i in range(len(counts))]
    names = [
        [owner.declare(declaration()).stream for _ in range(count)]
        for owner, count in zip(owners, counts, strict=True)
    ]
    assert len(known) == known.most
    *few, many = names
    for mine in few:
        # whoever asks
        assert all(kept(known, name) for name in mine)
    left = known.most - sum(counts[:-1])
    assert [kept(known, name) for name in many] == [False] * (counts[-1] - left) + [True] * left
    known.close()
    assert len(known) == 0


def test_a_client_with_more_than_its_share_gives_room_to_others(
    known: Streams, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(streams, "opened", lambda *_: stand_in())
    first, second = known.of("first"), known.of("second")
    names = [first.declare(declaration()).stream for _ in range(known.most)]
    for _ in range(known.most):
        second.declare(declaration())
    half = known.most // 2
    assert [kept(known, name) for name in names] == [False] * half + [True] * half


def test_streams_of_clients_that_have_gone_give_room_first(
    known: Streams, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(streams, "opened", lambda *_: stand_in())
    left = [known.of(f"gone {i}").declare(declaration()).stream for i in range(known.most - 1)]
    (nameless,) = [known.of("").declare(declaration()).stream]
    mine = [known.of("me", {"me"}).declare(declaration()).stream for _ in range(known.most - 1)]
    assert not any(kept(known, name) for name in left)
    assert all(kept(known, name) for name in [nameless, *mine])
    known.of("other", {"me", "other"}).declare(declaration())
    assert [kept(known, name) for name in mine] == [False] + [True] * (known.most - 2)


def stand_in(close: Callable[[], None] = lambda: None) -> SimpleNamespace:
    """A stream that has nothing to say."""
    wrench = np.array(WRENCH)
    return SimpleNamespace(
        first=wrench,
        limbs=(),
        columns=(),
        interpolates=None,
        findings=(),
        question=SimpleNamespace(stance=SimpleNamespace(hands=())),
        set_points=lambda *_: SetPoints("failed", wrench, verified=False, reason="none"),
        close=close,
    )


def kept(known: Streams, name: str) -> bool:
    """Whether a stream is still there."""
    request = {"v": 1, "stream": name, "body_wrench": WRENCH}
    return bool(answered(ServiceName.SET_POINTS, request, known)["good"])


def test_messages_are_of_the_schema(known: Streams) -> None:
    request = stream_request(radius=10.0)
    assert departures("StreamRequest", request) == []
    declared = answered(ServiceName.STREAM, request, known)
    assert declared.pop("good")
    assert departures("StreamReply", declared) == []
    asked = {"v": 1, "stream": declared["stream"], "body_wrench": WRENCH}
    assert departures("SetPointsRequest", asked) == []
    told = answered(ServiceName.SET_POINTS, asked, known)
    assert told.pop("good")
    assert departures("SetPointsReply", told) == []
    assert len(json.dumps(told)) < 3000


def test_numbers_that_are_not_there_are_null(known: Streams) -> None:
    request = stream_request()
    for hand in request["stance"]["hands"]:
        hand["grasp"] = hand.get("grasp", {}) | {"palm": False}
    request.pop("load", None)
    request["body_wrench"] = [0.0, 0.0, 2000.0, 0.0, 0.0, 0.0]
    declared = answered(ServiceName.STREAM, request, known)
    assert (declared["status"], declared["radius"]) == ("infeasible", None)
    assert declared["reason"]
    asked = {"v": 1, "stream": declared["stream"], "body_wrench": [0.0, 0.0, 2500.0, 0.0, 0.0, 0.0]}
    told = answered(ServiceName.SET_POINTS, asked, known)
    assert (told["status"], told["verified"]) == ("infeasible", True)
    assert told["utilisation"] is told["gap"] is told["hands"] is None


WRONG = [
    (("radius",), 0.0, "invalid", "radius"),
    (("radius",), 1e5, "invalid", "radius"),
    (("body_wrench",), [1.0] * 5, "invalid", "body_wrench"),
    (("objective",), "max_margin", "invalid", "objective"),
    (("limits",), {"tension_change": 5.0}, "unsupported", "limits.tension_change"),
    (("limits",), {"utilisation": 2.0}, "invalid", "limits.utilisation"),
    (("stance", "hands", 2, "wrist"), "floating", "unsupported", "stance.hands[2].wrist"),
    (("stance", "hands", 1, "hold", "diameter"), -0.1, "invalid", "stance.hands[1].hold.diameter"),
]


@pytest.mark.parametrize(("path", "value", "kind", "field"), WRONG)
def test_a_declaration_that_is_wrong_is_told_the_field(path, value, kind, field, known) -> None:
    request = put(stream_request(), path, value)
    told = answered(ServiceName.STREAM, request, known)
    assert not told["good"]
    assert (told["error"]["kind"], told["error"]["field"]) == (kind, field)


@pytest.mark.parametrize(
    ("request_", "field"),
    [
        ({"v": 1, "stream": "x"}, "body_wrench"),
        ({"v": 1, "body_wrench": WRENCH}, "stream"),
        ({"v": 1, "stream": "x", "body_wrench": [*WRENCH, 0.0]}, "body_wrench"),
        ({"v": 1, "stream": "x", "body_wrench": [None] * 6}, "body_wrench[0]"),
        ({"v": 1, "stream": "x", "body_wrench": WRENCH, "stance": {}}, "stance"),
        ({"v": 1, "stream": "x", "body_wrench": WRENCH}, "stream"),
    ],
)
def test_a_question_that_is_wrong_is_told_the_field(request_, field, known) -> None:
    told = answered(ServiceName.SET_POINTS, request_, known)
    assert not told["good"]
    assert told["error"]["field"] == field


def test_what_is_not_a_number_is_told_as_such(known) -> None:
    request = {"v": 1, "stream": "x", "body_wrench": [*WRENCH[:5], float("nan")]}
    answer = dispatch.handle(
        ServiceName.SET_POINTS, msgspec.msgpack.encode(request), MSGPACK, streams=known
    )
    error = msgspec.msgpack.decode(answer.payload)["error"]
    assert (error["field"], error["message"]) == (
        "body_wrench[5]",
        "must be a finite number, got nan",
    )


@pytest.mark.parametrize("form", [JSON, MSGPACK])
def test_the_hand_of_the_service_is_that_of_its_streams(form, known, tmp_path) -> None:
    from hand_models.parameters import ParameterTable, Quantity

    weak = ParameterTable(
        {"structure": {"held_mass": Quantity(20.0, "kg", "assumed", "of a test")}}
    )
    used = []
    for hand in (None, weak):
        payload = Format.named(form).encode(stream_request())
        answer = dispatch.handle(ServiceName.STREAM, payload, form, hand, streams=known)
        declared = Format.named(form).decode(answer.payload, StreamReply)
        used.append(declared.utilisation)
    assert used[1] > used[0]


# Command line -------------------------------------------------------------------------------------


def given(monkeypatch: pytest.MonkeyPatch, *lines: object) -> None:
    text = "".join(f"{line if isinstance(line, str) else json.dumps(line)}\n" for line in lines)
    monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=io.BytesIO(text.encode())))


HELD = [900.0, 0.0, 0.0, 0.0, -130.0, 0.0]
HEAVIER = [9.81 * HEAVY, 0.0, 0.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("wrenches", "statuses", "code"),
    [
        ([WRENCH, WRENCH], ["optimal"] * 2, DONE),
        ([HEAVIER, WRENCH], ["overloaded", "optimal"], OVERLOADED),
        ([], [], DONE),
    ],
)
def test_each_line_gives_a_line(wrenches, statuses, code, stance_file, monkeypatch, capfd) -> None:
    given(monkeypatch, *wrenches, "")
    path = stance_file(wall_request(LIGHT))
    assert run_command_line(["stream", path, "--json"]) == code
    out, err = capfd.readouterr()
    assert err == ""
    replies = [json.loads(line) for line in out.splitlines()]
    assert [reply["status"] for reply in replies] == statuses
    assert [reply["body_wrench"] for reply in replies] == wrenches
    assert [len(hand["tensions"]) for reply in replies for hand in reply["hands"]] == (
        [4] * 4 * len(wrenches)
    )
    given(monkeypatch, *wrenches)
    assert run_command_line(["stream", path]) == code
    out, err = capfd.readouterr()
    header, below, *lines = out.splitlines()
    assert err.count("\n") == 1
    assert "within 30 N, 3 N·m of the first centre [490.5, " in err
    assert "outer_left, inner_left, inner_right, outer_right" in err
    assert "front_right [N]" in header
    assert "front_left [N]" in below
    assert max(map(len, out.splitlines())) <= 80
    # a reason has the place of a status's column free, but not those of the numbers
    numbers = [line for line in lines if not re.match(" {11}\\S", line)]
    assert len(lines) > len(numbers) or "overloaded" not in statuses
    assert [line.split()[0] for line in numbers[::2]] == statuses
    for first, second, reply in zip(numbers[::2], numbers[1::2], replies, strict=True):
        line = f"{first:<68}{second[36:]}"
        cells = [line[start : start + 16] for start in range(36, len(line), 16)]
        told = [[int(part) for part in cell.split("/")] for cell in cells]
        assert told == [[round(part) for part in hand["tensions"]] for hand in reply["hands"]]


def test_after_slips_a_line_tells_what_to_save_and_what_is_released(monkeypatch, capfd) -> None:
    phalanges = ("proximal", "middle", "distal")
    lost = [{"limb": "front_left", "finger": "inner_left", "phalanx": name} for name in phalanges]
    lines = [
        {"body_wrench": HEAVIER, "lost": lost},
        {"body_wrench": HELD, "lost": lost[:1]},
        HELD,
    ]
    given(monkeypatch, *lines)
    assert run_command_line(["stream", "wall-300", "--json"]) == OVERLOADED
    first, second, third = map(json.loads, capfd.readouterr().out.splitlines())
    given(monkeypatch, *lines)
    assert run_command_line(["stream", "wall-300"]) == OVERLOADED
    out = capfd.readouterr().out
    assert max(map(len, out.splitlines())) <= 80
    parts = re.split(r"^(?=overloaded|optimal|status)", out, flags=re.MULTILINE)[2:]
    told, second_told, third_told = (" ".join(part.split()) for part in parts)
    said = f"save {first['save_first']} first; released: front_left inner_left; {first['reason']}"
    assert said in told
    assert second_told.endswith(second["reason"] or "released: none")
    assert third["reason"] is None
    assert "released" not in third_told


def test_a_wider_terminal_has_all_hands_in_a_line(monkeypatch, capfd) -> None:
    monkeypatch.setenv("COLUMNS", "120")
    given(monkeypatch, HELD)
    assert run_command_line(["stream", "wall-300"]) == DONE
    assert len(capfd.readouterr().out.splitlines()) == 2


def test_a_failure_is_worse_than_an_overload(stance_file, monkeypatch, capfd) -> None:
    given(monkeypatch, HEAVIER, WRENCH)
    answers = WrenchStream.set_points

    def failing(self: WrenchStream, wrench: object, lost: object) -> object:
        if list(wrench) == WRENCH:
            return SetPoints("failed", np.array(wrench), verified=False, reason="a reason")
        return answers(self, wrench, lost)

    monkeypatch.setattr(WrenchStream, "set_points", failing)
    assert run_command_line(["stream", stance_file(wall_request())]) == FAILED
    assert capfd.readouterr().out.splitlines()[-1].endswith("a reason")


@pytest.mark.parametrize("line", ["[1, 2]", "x", "[1,2,3,4,5,NaN]", "[1,2,3,4,5,1e7]"])
def test_a_line_that_is_no_wrench_is_told_by_its_number(
    line, stance_file, monkeypatch, capfd
) -> None:
    path = stance_file(wall_request())
    given(monkeypatch, "", line, WRENCH)
    assert run_command_line(["stream", path, "--json"]) == BAD_INPUT
    out, err = capfd.readouterr()
    error, reply = map(json.loads, out.splitlines())
    assert err == ""
    assert departures("ErrorReply", error) == []
    assert (error["error"]["kind"], error["error"]["field"]) == ("malformed", "line 2")
    assert error["error"]["message"].startswith("six finite numbers")
    assert reply["body_wrench"] == WRENCH
    given(monkeypatch, "", line, WRENCH)
    assert run_command_line(["stream", path]) == BAD_INPUT
    out, err = capfd.readouterr()
    assert len(out.splitlines()) == 4
    assert err.splitlines()[1].startswith("crux: line 2: six finite numbers")


@pytest.mark.parametrize(
    ("change", "field", "told"),
    [
        ({"lost": [["front_left"]]}, "lost[0]", "; an object with limb, finger, phalanx is wanted"),
        ({"lost": [{"limb": "rear_left", "finger": 3}]}, "lost[0].finger", "expected a string"),
        ({"v": 1}, "v", "unknown field; known are body_wrench, lost"),
        ({"body_wrench": [1, 2]}, "body_wrench", "got length 2"),
    ],
)
def test_a_lines_object_is_refused_by_its_field(
    change, field, told, stance_file, monkeypatch, capfd
) -> None:
    path, line = stance_file(wall_request()), json.dumps({"body_wrench": WRENCH} | change)
    given(monkeypatch, line)
    assert run_command_line(["stream", path, "--json"]) == BAD_INPUT
    error = result(capfd)["error"]
    assert error["field"] == f"line 1: {field}"
    assert told in error["message"]
    given(monkeypatch, line)
    assert run_command_line(["stream", path]) == BAD_INPUT
    assert f"crux: line 1: {field}: {error['message']}" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        (["-"], "STANCE"),
        (["wall", "--radius", "0"], "--radius"),
        (["wall-300-floating"], "stance.hands[1].wrist"),
        (["no-such-stance"], "STANCE"),
    ],
)
def test_what_cannot_be_streamed_is_bad_input(arguments, field, monkeypatch, capfd) -> None:
    given(monkeypatch, WRENCH)
    assert run_command_line(["stream", *arguments]) == BAD_INPUT
    assert field in complaint(capfd)


def test_another_objective_is_refused(stance_file, monkeypatch, capfd) -> None:
    given(monkeypatch, WRENCH)
    assert (
        run_command_line(["stream", stance_file(wall_request() | {"objective": "min_effort"})])
        == BAD_INPUT
    )
    assert "objective: min_effort is not available for streams" in complaint(capfd)


def test_a_line_is_answered_before_the_next_is_there() -> None:
    """As a control loop asks: through pipes, one at a time."""
    light = json.dumps([0.8 * part for part in WRENCH])
    asked = process("stream", "wall", "--json", given=(light + "\n").encode() * 3)
    assert (asked.returncode, asked.stderr) == (0, b"")
    assert len(asked.stdout.splitlines()) == 3


# After slips --------------------------------------------------------------------------------------


def test_a_client_says_what_has_slipped(client: CruxClient) -> None:
    declared = client.stream(declaration())
    wrench = tuple((0.5 * np.array(declared.body_wrench)).tolist())
    limb = declared.hands[0].limb
    finger = "inner_left"
    lost = [LostTile(limb, finger, phalanx) for phalanx in ("proximal", "middle", "distal")]
    asked = SetPointsRequest(v=1, stream=declared.stream, body_wrench=wrench, lost=lost)
    reply = client.set_points(asked)
    assert (reply.status, reply.source, reply.verified) == ("optimal", "solved", True)
    assert reply.lost == lost
    assert [(each.limb, each.finger) for each in reply.released] == [(limb, finger)]
    assert reply.hands[0].tensions[1] == 0.0
    assert reply.save_first is None
    whole = client.set_points(msgspec.structs.replace(asked, lost=[]))
    assert whole.lost is msgspec.UNSET
    assert whole.utilisation < reply.utilisation
    heavy = tuple((3.0 * np.array(declared.body_wrench)).tolist())
    reply = client.set_points(msgspec.structs.replace(asked, body_wrench=heavy))
    assert (reply.status, reply.verified) == ("overloaded", True)
    assert reply.save_first in [hand.limb for hand in declared.hands]
    assert reply.reason
    with pytest.raises(ServiceError) as refused:
        client.set_points(msgspec.structs.replace(asked, lost=[LostTile(limb, finger, "nail")]))
    assert (refused.value.kind, refused.value.field) == ("invalid", "lost[0]")


def test_a_line_says_what_has_slipped(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    lost = [{"limb": "rear_left", "finger": "inner_left", "phalanx": "middle"}]
    lines = [{"body_wrench": WRENCH, "lost": lost}, WRENCH, {"body_wrench": WRENCH, "tile": 1}]
    given = b"\n".join(map(msgspec.json.encode, lines))
    monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=io.BytesIO(given)))
    assert run_command_line(["stream", "wall-300", "--json"]) == BAD_INPUT
    one, two, three = map(json.loads, capfd.readouterr().out.splitlines())
    assert (one["verified"], one["lost"], "lost" in two) == (True, lost, False)
    assert three["error"]["field"] == "line 3: tile"
