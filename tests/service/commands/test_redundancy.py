"""``crux redundancy``, and ``"want": ["redundancy"]`` of a plan."""

from pathlib import Path

import msgspec
import pytest

from planner import Redundancy
from service.answering import planned
from service.commands.cli import run_command_line
from service.commands.stances import read_request
from service.replies import PlanReply
from service.wire import Format
from tests.suite.helpers.commands import BAD_INPUT, DONE, OVERLOADED, complaint, result


def test_the_table_names_the_worst(capfd: pytest.CaptureFixture[str], tmp_path: Path):
    picture = tmp_path / "losses.png"
    assert run_command_line(["redundancy", "wall-300", "--plot", str(picture)]) == OVERLOADED
    said = capfd.readouterr().out
    assert said.startswith("with all parts: utilisation 0.956\n")
    assert max(map(len, said.splitlines())) <= 80
    assert "holds without 48 of 56 tiles; worst" in said
    assert "holds without 0 of 4 hands" in said
    assert picture.exists()


def test_an_overloaded_stance_is_said_to_be(capfd: pytest.CaptureFixture[str]):
    assert run_command_line(["redundancy", "wall-700"]) == OVERLOADED
    first, *rest = capfd.readouterr().out.splitlines()
    assert first == "with all parts: utilisation 1.747, beyond the cap already"
    assert rest[-3].endswith("front_right: inner_left distal, 2.013")


def test_a_stance_that_can_lose_any_tile_is_done(capfd: pytest.CaptureFixture[str]):
    assert run_command_line(["redundancy", "slab", "--json"]) == DONE
    found = result(capfd)
    assert found["held"]["tile"] == [54, 54]


def test_moving_wrists_are_refused_by_name(capfd: pytest.CaptureFixture[str]):
    assert run_command_line(["redundancy", "wall-300-floating"]) == BAD_INPUT
    assert "stance.hands" in complaint(capfd)


def test_a_plan_that_wants_it_has_it():
    request = msgspec.structs.replace(read_request("wall-300"), want=["redundancy"])
    reply = planned(request).reply
    assert isinstance(reply.redundancy, Redundancy)
    again = Format.MSGPACK.decode(Format.MSGPACK.encode(reply), PlanReply)
    assert again.redundancy == reply.redundancy
    plain = planned(msgspec.structs.replace(request, want=[])).reply
    assert plain.redundancy is msgspec.UNSET
    short = planned(msgspec.structs.replace(request, detail="set_points"))
    assert not hasattr(short.reply, "redundancy")
