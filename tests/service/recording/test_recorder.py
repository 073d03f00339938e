"""The recorder: what it writes, what it drops, and what a disk that is full does to it."""

from __future__ import annotations

import shutil
import subprocess
import sys

import msgspec
import numpy as np
import pytest
from mcap.reader import make_reader

from hand_models.base import InvalidInputError
from hand_models.parameters import ParameterTable
from service.recording import Exchange, Recorder, Recording, RosSample, recorder as module
from service.replies import CancelReply
from service.wire import Answer, Format
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.patience import PATIENCE, soon

KEY = "crux/robosimian/cancel"


def exchange(number: int = 0, form: Format = Format.JSON, request: bytes | None = None) -> Exchange:
    reply = CancelReply(id=str(number), cancelled=number)
    answer = Answer(form.encode(reply), form.label(reply), status="done", seconds=0.25)
    asked = form.encode({"v": 1, "id": str(number)}) if request is None else request
    return Exchange(KEY, 0.5, form.value, asked, answer, "me", 0.125)


def flushed_each_time(path, monkeypatch, count: int) -> Recorder:
    """A recorder that has so many exchanges, each in a chunk of its own on the disk."""
    monkeypatch.setattr(module, "RECORDER_SETTINGS", module.RECORDER_SETTINGS._replace(flush=0.0))
    recorder = Recorder(path, "robosimian")
    for number in range(1, count + 1):
        recorder.add(exchange(number))
        assert soon(lambda: recorder.health().recorded == number)  # noqa: B023
    return recorder


def recorded(path) -> list:
    return list(Recording(path).questions())


def test_questions_come_back_as_they_were(tmp_path):
    path = tmp_path / "a.mcap"
    recorder = Recorder(path, "robosimian")
    lost = msgspec.msgpack.encode({"v": 1, "id": float("nan")})
    for each in (
        exchange(1),
        exchange(2, Format.MSGPACK),
        exchange(3, request=b"{no JSON"),
        exchange(4, Format.MSGPACK, lost),
        exchange(5)._replace(answer=None, key="crux/robosimian/stream/s/set_points"),
    ):
        recorder.add(each)
    recorder.close()
    assert (recorder.health().recorded, recorder.health().dropped) == (5, 0)
    found = recorded(path)
    asked = [
        *(b'{"v":1,"id":"1"}', msgspec.msgpack.encode({"v": 1, "id": "2"})),
        *(b"{no JSON", lost, b'{"v":1,"id":"5"}'),
    ]
    assert [each.request for each in found] == asked
    assert [each.about.number for each in found] == [1, 2, 3, 4, 5]
    assert [each.about.status for each in found] == ["done"] * 4 + ["skipped"]
    assert [each.answer and each.answer["cancelled"] for each in found] == [1, 2, 3, 4, None]
    assert (found[0].about.waited, found[0].about.worked, found[0].about.client) == (
        0.125,
        0.25,
        "me",
    )


def test_others_read_a_recording_with_its_schemas(tmp_path):
    path = tmp_path / "a.mcap"
    recorder = Recorder(path, "robosimian")
    recorder.add(exchange(7))
    recorder.add(RosSample("/tendons", "pkg/msg/Kind", "float64 x\n", bytes(12)))
    recorder.close()
    with path.open("rb") as stream:
        found = {c.topic: (s, c, m) for s, c, m in make_reader(stream).iter_messages()}
    assert set(found) == {
        *("/crux/robosimian/cancel/CancelRequest", "/crux/robosimian/cancel/CancelReply"),
        *("/crux/robosimian/questions/QuestionRecord", "/tendons"),
    }
    schema, channel, message = found["/crux/robosimian/cancel/CancelReply"]
    assert (schema.name, schema.encoding, channel.message_encoding) == (
        *("crux.CancelReply", "jsonschema", "json"),
    )
    assert msgspec.json.decode(message.data)["cancelled"] == 7
    asked = found["/crux/robosimian/cancel/CancelRequest"][2]
    assert asked.sequence == message.sequence == 1
    assert message.log_time - asked.log_time == 500_000_000
    schema, channel, message = found["/tendons"]
    assert (schema.encoding, channel.message_encoding, schema.data) == (
        *("ros2msg", "cdr", b"float64 x\n"),
    )


def test_nothing_is_written_over(tmp_path):
    path = tmp_path / "a.mcap"
    for _ in range(3):
        Recorder(path, "robosimian").close()
    assert sorted(each.name for each in tmp_path.iterdir()) == ["a-2.mcap", "a-3.mcap", "a.mcap"]


def test_the_oldest_files_go_where_there_is_a_limit(tmp_path, monkeypatch):
    monkeypatch.setattr(
        module, "RECORDER_SETTINGS", module.RECORDER_SETTINGS._replace(flush=0.0, chunk=1000)
    )
    path, limit = tmp_path / "a.mcap", 50_000
    recorder = Recorder(path, "robosimian", limit=limit)
    made = 0
    while not (tmp_path / "a-12.mcap").exists():
        made += 1
        # nothing that can be compressed
        digits = f"{hash((made, 'noise')) * 3**200:x}" * 10
        recorder.add(exchange(made, request=msgspec.json.encode({"v": 1, "id": digits})))
        assert soon(lambda: recorder.health().recorded == made)  # noqa: B023
    recorder.close()
    files = sorted(tmp_path.iterdir(), key=lambda each: int(each.stem.partition("-")[2] or 1))
    assert sum(each.stat().st_size for each in files) <= limit
    assert not path.exists()
    # the newest may have been begun only
    assert all(map(recorded, files[:-1]))


def test_what_waits_has_a_bound_and_the_rest_is_counted(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "RECORDER_SETTINGS", module.RECORDER_SETTINGS._replace(held=5000))
    recorder = Recorder(tmp_path / "a.mcap", "robosimian")
    recorder.add(exchange(1, request=bytes(10_000)))
    assert recorder.health().dropped == 1
    recorder.add(exchange(2))
    recorder.close()
    assert (recorder.health().recorded, recorder.health().dropped) == (1, 1)


FULL = """
import resource, sys, pathlib
from service.recording import Recorder, Recording, recorder
from tests.service.recording.test_recorder import exchange
from tests.suite.helpers.patience import soon
recorder.RECORDER_SETTINGS = recorder.RECORDER_SETTINGS._replace(flush=0.0, rest=0.5)
path = pathlib.Path(sys.argv[1])
# as a disk that is full: no file grows beyond this
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, resource.RLIM_INFINITY))
one = Recorder(path, "robosimian")
for number in range(1, 1000):
    one.add(exchange(number))
    assert soon(lambda: one.health().recorded + one.health().dropped == number)
    if one.health().dropped:
        break
assert soon(lambda: one.health().file is None)
print(one.health().recorded, one.health().problem)
resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY,) * 2)
assert soon(lambda: (one.add(exchange(0)), one.health().file)[1])
one.close()
print(one.health().problem, one.health().file)
"""


def test_a_full_disk_ends_the_file_where_it_is_whole_and_another_is_begun(tmp_path):
    path = tmp_path / "a.mcap"
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    kept = recorded(path)
    assert done.stdout.splitlines() == [
        *(f"{len(kept)} File too large", f"None {tmp_path / 'a-2.mcap'}"),
    ], done.stderr
    assert [each.about.number for each in kept] == list(range(1, len(kept) + 1))
    assert len(kept) > 5
    assert recorded(tmp_path / "a-2.mcap")


@pytest.mark.parametrize("keep", [0.3, 0.6, 0.9])
def test_a_file_that_is_cut_off_is_read_up_to_its_last_chunk(tmp_path, monkeypatch, keep):
    path = tmp_path / "a.mcap"
    recorder = flushed_each_time(path, monkeypatch, 40)
    data = path.read_bytes()
    recorder.close()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: int(keep * len(data))])
    recording = Recording(cut)
    numbers = [each.about.number for each in recording.questions()]
    assert recording.whole is False
    assert numbers == list(range(1, len(numbers) + 1))
    assert keep * 40 - 8 <= len(numbers) <= 40


@pytest.mark.parametrize("closed", [True, False])
def test_a_damaged_bit_is_never_read_as_what_was_recorded(tmp_path, monkeypatch, closed):
    """Whatever bit it is: questions are those that were recorded, or lost with a word."""
    path = tmp_path / "a.mcap"
    recorder = flushed_each_time(path, monkeypatch, 8)
    if closed:
        recorder.close()
    data = path.read_bytes()
    recorder.close()
    before, rng = recorded(path), np.random.default_rng(0)
    whole = Recording(path)
    list(whole.questions())
    chunks, lost = whole.chunks, 0
    for place in rng.integers(len(data), size=150).tolist():
        damaged = bytearray(data)
        damaged[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        try:
            recording = Recording(path)
            found = list(recording.questions())
        except InvalidInputError:
            continue
        assert [each for each in before if each in found] == found
        if len(found) < len(before):
            lost += 1
            # of a file that is not closed, nothing says how many chunks there should be
            assert recording.damaged or recording.whole is False
            if closed and recording.whole:
                assert recording.damaged < recording.chunks == chunks
    assert lost > 30


def test_a_recording_whose_folder_is_gone_is_said_and_begun_again(tmp_path, monkeypatch):
    settings = module.RECORDER_SETTINGS._replace(flush=0.0, rest=0.01)
    monkeypatch.setattr(module, "RECORDER_SETTINGS", settings)
    folder = tmp_path / "gone"
    folder.mkdir()
    recorder = Recorder(folder / "a.mcap", "robosimian")
    recorder.add(exchange(1))
    assert soon(lambda: recorder.health().recorded == 1)
    shutil.rmtree(folder)
    recorder.add(exchange(2))
    assert soon(lambda: recorder.health().problem is not None)
    folder.mkdir()

    def records_again() -> bool:
        recorder.add(exchange(3))
        return recorder.health().problem is None

    assert soon(records_again)
    recorder.close()
    assert {each.answer["cancelled"] for each in recorded(folder / "a.mcap")} == {3}


def test_the_hand_of_a_service_is_recorded(tmp_path):
    hand = ParameterTable.of({"motor": {"x": {"value": 1.0, "unit": "N", "source": "assumed"}}})
    Recorder(tmp_path / "a.mcap", "robosimian", hand).close()
    about = Recording(tmp_path / "a.mcap").about
    assert ParameterTable.of(msgspec.json.decode(about["hand"])) == hand


@pytest.mark.parametrize("content", [b"", b"no MCAP", bytes(100)])
def test_what_is_no_recording_is_refused(tmp_path, content):
    path = tmp_path / "a.mcap"
    path.write_bytes(content)
    with pytest.raises(InvalidInputError) as refused:
        Recording(path)
    assert refused.value.field == "FILE"
    assert "a.mcap" in str(refused.value)


def test_where_nothing_can_be_written_is_said_at_once(tmp_path):
    with pytest.raises(InvalidInputError, match="No such file"):
        Recorder(tmp_path / "no" / "a.mcap", "robosimian")
