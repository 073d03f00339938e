"""Replays: equal answers where nothing has changed, and what has moved where something has."""

from __future__ import annotations

import msgspec
import pytest

from hand_models.base import InvalidInputError
from service.answering import Streams, handle, read_hand
from service.operating import print_replay, replay_json
from service.recording import Exchange, Recorder, Recording, Replay
from service.recording.differences import differences, same_within_gaps
from service.replies import ErrorReply, PublishedReply
from service.requests import LONGEST_DEADLINE
from service.tables import console
from service.wire import Answer, Format, encode_error
from service.wire.errors import BusyError
from tests.suite.helpers.requests import stream_request, wall_request

PLAN, STREAM, POINTS, BODY = (
    f"crux/robosimian/{name}" for name in ("plan", "stream", "set_points", "body_space")
)
WRENCH = [480.0, 0.0, 0.0, 0.0, 0.0, 0.0]


class Asked:
    """What asks a service's own function, and records it."""

    def __init__(self, path, hand=None) -> None:
        self.path, self.hand, self.streams = path, hand, Streams()
        self.recorder = Recorder(path, "robosimian", hand)

    def __call__(self, key: str, request: object, form: Format = Format.JSON) -> dict:
        payload = request if isinstance(request, bytes) else form.encode(request)
        answer = handle(key, payload, form.value, self.hand, streams=self.streams)
        self.add(key, payload, form, answer)
        return form.decode(answer.payload, dict)

    def add(self, key: str, payload: bytes, form: Format, answer: Answer) -> None:
        self.recorder.add(Exchange(key, 0.0, form.value, payload, answer))

    def replayed(self, **more: object) -> Replay:
        self.recorder.close()
        self.streams.close()
        recording = Recording(self.path)
        replay = Replay(recording, **more)
        for _ in replay.run(recording.questions()):
            pass
        return replay


def test_answers_of_all_kinds_are_equal_to_the_digit(tmp_path):
    ask = Asked(tmp_path / "a.mcap")
    ask(PLAN, wall_request() | {"id": "a", "want": ["load_factor", "prices"]})
    # a deadline that no replay could keep
    ask(PLAN, wall_request() | {"detail": "hands", "deadline": LONGEST_DEADLINE}, Format.MSGPACK)
    assert ask(PLAN, wall_request() | {"colour": "red"})["error"]["field"] == "colour"
    assert ask(PLAN, b"{no JSON")["error"]["kind"] == "malformed"
    stream = ask(STREAM, stream_request())["stream"]
    for step in range(5):
        wrench = [WRENCH[0] + step, *WRENCH[1:]]
        points = ask(POINTS, {"v": 1, "stream": stream, "body_wrench": wrench}, Format.MSGPACK)
        assert points["verified"]
    # its error is a number: how far the space is off
    assert ask(BODY, wall_request())["error"] == 0.0
    replay = ask.replayed()
    assert (replay.equal, replay.near, replay.moved, replay.left_out) == (11, 0, 0, 0)
    assert replay.asked == {"plan": 4, "stream": 1, "set_points": 5, "body_space": 1}
    assert replay.fields == {}


def test_what_depends_on_more_than_the_question_is_left_out(tmp_path):
    ask = Asked(tmp_path / "a.mcap")
    payload = msgspec.json.encode(wall_request())
    ask.add(PLAN, payload, Format.JSON, encode_error(BusyError("much to do", 1.0), Format.JSON))
    ask(POINTS, {"v": 1, "stream": "of another recording", "body_wrench": WRENCH})
    late = msgspec.json.encode({"v": 1, "status": "optimal", "unfinished": ["spread"]})
    ask.add(PLAN, payload, Format.JSON, Answer(late, "application/json;crux.PlanReply@1"))
    replay = ask.replayed()
    assert (replay.equal, replay.moved, replay.left_out) == (0, 0, 3)


def test_wrenches_that_were_skipped_are_counted_apart(tmp_path, capsys):
    ask = Asked(tmp_path / "a.mcap")
    stream = ask(STREAM, stream_request())["stream"]
    wrench = msgspec.json.encode({"v": 1, "number": 0, "time": 0.0, "body_wrench": WRENCH})
    for _ in range(3):
        key = f"{STREAM}/{stream}/wrench"
        ask.recorder.add(Exchange(key, 0.0, Format.JSON.value, wrench, None))
    replay = ask.replayed()
    assert (replay.equal, replay.left_out, replay.skipped) == (1, 0, 3)
    assert replay_json(replay)["skipped"] == 3
    print_replay(replay, console())
    assert "3 skipped by the service for newer wrenches" in capsys.readouterr().out


def test_errors_of_published_wrenches_are_equal(tmp_path):
    ask = Asked(tmp_path / "a.mcap")
    stream = ask(STREAM, stream_request())["stream"]
    wrench = msgspec.json.encode({"v": 1, "number": 0, "time": 0.0, "body_wrench": [None] * 6})
    key = f"{STREAM}/{stream}/set_points"
    error = handle(key, wrench, Format.JSON.value, streams=ask.streams, stream=stream)
    reply = PublishedReply(
        stream=stream,
        number=0,
        time=0.0,
        age=0.0,
        skipped=0,
        error=msgspec.json.decode(error.payload, type=ErrorReply).error,
    )
    ask.add(key, wrench, Format.JSON, Answer(msgspec.json.encode(reply), Format.JSON.label(reply)))
    replay = ask.replayed()
    assert (replay.equal, replay.moved, replay.left_out) == (2, 0, 0)


def test_what_has_moved_is_told_with_its_old_and_its_new_value(tmp_path):
    ask = Asked(tmp_path / "a.mcap")
    reply = ask(PLAN, wall_request())
    other = msgspec.json.encode(reply | {"utilisation": 2.0 * reply["utilisation"]})
    payload, label = msgspec.json.encode(wall_request()), "application/json;crux.PlanReply@1"
    ask.add(PLAN, payload, Format.JSON, Answer(other, label))
    ask.add(PLAN, b"{no JSON", Format.JSON, Answer(other, label))
    replay = ask.replayed()
    assert (replay.equal, replay.moved) == (1, 2)
    moved = replay.fields["PlanReply", "utilisation"]
    assert (moved.answers, moved.number) == (1, 2)
    assert moved.most.old == 2.0 * moved.most.new == 2.0 * reply["utilisation"]
    kind = replay.fields["PlanReply", "(answer)"]
    assert (kind.most.old, kind.most.new) == ("PlanReply: optimal", "error: malformed")


def test_the_hand_of_the_service_answers_again(tmp_path):
    file = tmp_path / "hand.toml"
    file.write_text("[motor]\nmaximum_torque = 0.012\n")
    hand = read_hand(file)
    ask = Asked(tmp_path / "a.mcap", hand)
    ask(PLAN, wall_request())
    assert ask.replayed().equal == 1
    recording = Recording(ask.path)
    bundled = Replay(recording, hand=type(hand)({}))
    assert [bool(moved) for _, moved in bundled.run(recording.questions())] == [True]


def test_a_recording_of_another_robot_needs_its_file(tmp_path):
    Recorder(tmp_path / "a.mcap", "spider").close()
    with pytest.raises(InvalidInputError, match="'spider'; give its file with --robot"):
        Replay(Recording(tmp_path / "a.mcap"))


def test_names_and_times_on_a_clock_are_no_differences():
    old = {"id": "a", "time": {"total": 1.0}, "took": 1.0, "knots": [{"time": 0.5, "x": [1, 2]}]}
    new = {"id": "b", "time": {"total": 2.0}, "took": 2.0, "knots": [{"time": 0.5, "x": [1, 2]}]}
    assert list(differences(old, new)) == []
    new["knots"][0] |= {"time": 0.6, "x": [1, 2, 3], "more": None}
    found = {each.path: (each.old, each.new) for each in differences(old, new)}
    assert found == {
        "knots[0].time": (0.5, 0.6),
        "knots[0].x": ("2 entries", "3 entries"),
        "knots[0].more": ("(none)", None),
    }


def test_set_points_are_as_good_as_each_other_within_their_gaps():
    one = {"source": "solved", "status": "optimal", "verified": True, "body_wrench": WRENCH}
    one |= {"utilisation": 0.5, "gap": 0.0}
    other = one | {"source": "interpolated", "utilisation": 0.51, "gap": 0.02}
    assert same_within_gaps(one, other)
    assert same_within_gaps({"set_points": one}, other)
    for change in (
        *({"utilisation": 0.53}, {"status": "overloaded"}, {"verified": False}, {"gap": None}),
    ):
        assert not same_within_gaps(one, other | change)
    assert not same_within_gaps(one, {"error": {}})
