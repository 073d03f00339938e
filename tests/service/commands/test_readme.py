"""What the README shows is what happens."""

from __future__ import annotations

import json
import queue
import re
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import matplotlib as mpl
import pytest
import zenoh

from hand_models import Surface
from service.commands.cli import run
from service.commands.stances import bundled
from service.serving import open_session, zenoh_config
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.patience import PATIENCE
from tests.suite.helpers.served import Served, free_endpoint

README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def test_the_example_stance_is_answered(tmp_path: Path, capfd: pytest.CaptureFixture[str]):
    (text,) = blocks("json")
    file = tmp_path / "stance.json"
    file.write_text(text, encoding="utf-8")
    assert run(["plan", str(file), "--json"]) == 0
    reply = json.loads(capfd.readouterr().out)
    assert reply["verified"] is True
    assert reply["status"] == "optimal"


def test_the_first_python_example_prints_a_plan_that_holds(capsys: pytest.CaptureFixture[str]):
    (example,) = (block for block in blocks("python") if "up_the_wall =" in block)
    exec(compile(example, "README.md", "exec"), {})
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("optimal 0.95")
    assert " N of " in lines[1]
    assert len(json.loads(lines[2])) == 4


def test_the_examples_of_draws_tell_how_sure_a_plan_is(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
):
    text = next(text for text in blocks("toml") if "[[draws]]" in text)
    file = tmp_path / "draws.toml"
    file.write_text(text, encoding="utf-8")
    assert run(["plan", "wall-300", "--draws", str(file), "--json"]) == 0
    spread = json.loads(capfd.readouterr().out)["spread"]
    assert spread["draws"] == 2
    assert spread["load_factors"][0] < spread["load_factors"][1]
    scope: dict[str, Any] = {}
    for word in ("up_the_wall =", "own_draw"):
        (example,) = (block for block in blocks("python") if word in block)
        exec(compile(example, "README.md", "exec"), scope)
    holds, draws, median, quantity = capfd.readouterr().out.splitlines()[-1].split()
    assert (holds, draws, quantity) == ("1", "3", "rock.shear_limit")
    # of rock of 60 N; tiles have next to nothing else to carry but the body's load
    answer, rock = scope["answer"], Surface.named("rock")
    assert float(median) == pytest.approx(answer.load_factor * 60.0 / rock.shear_limit, rel=0.02)


def test_what_is_printed_of_how_sure_a_plan_is_looks_as_it_is_told(
    capfd: pytest.CaptureFixture[str],
):
    (told,) = re.findall(r"^OPTIMAL .*\nholds in .*$", README, re.MULTILINE)
    assert run(["plan", "wall-300", "--spread"]) == 0
    printed = capfd.readouterr().out.splitlines()[:2]
    for line, shown in zip(printed, told.splitlines(), strict=True):
        assert re.sub(r"[0-9.]+", "0", line) == re.sub(r"[0-9.]+", "0", shown)


def test_the_examples_of_a_stance_that_stays_go_on_from_the_first(
    capsys: pytest.CaptureFixture[str],
):
    scope: dict[str, object] = {}
    for word in ("up_the_wall", "KnownStance", "WrenchStream"):
        (example,) = (
            block for block in blocks("python") if f"import {word}" in block or f"{word} =" in block
        )
        exec(compile(example, "README.md", "exec"), scope)
    known, stream, *_ = capsys.readouterr().out.splitlines()[3:]
    assert 0.5 < float(known) < 1.0
    status, source, used, gap = stream.split()
    assert (status, source) == ("optimal", "interpolated")
    assert 0.0 <= float(gap) < 0.01 < float(used) < 1.0


def test_the_example_of_a_floating_hand_prints_stiffness_pose_and_limit(
    capsys: pytest.CaptureFixture[str],
):
    (example,) = (block for block in blocks("python") if "CompliantHand" in block)
    exec(compile(example, "README.md", "exec"), {})
    reach, label = capsys.readouterr().out.splitlines()[-1].split()
    assert float(reach) > 50.0
    assert label.split("/")[1] in ("proximal", "distal")


def test_the_example_of_an_own_hand_changes_the_plan(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
):
    text = blocks("toml")[-1]
    file = tmp_path / "mine.toml"
    file.write_text(text, encoding="utf-8")
    assert run(["plan", "wall-300", "--hand", str(file), "--json"]) == 0
    assert json.loads(capfd.readouterr().out)["load_factor"] == pytest.approx(1.02, abs=0.005)


def test_the_example_of_a_scan_makes_a_wall_of_terrain(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    (options,) = re.findall(r"^crux rock \$terrain (.*)$", README, re.MULTILINE)
    terrain = Path(mpl.get_data_path()) / "sample_data" / "jacksboro_fault_dem.npz"
    monkeypatch.chdir(tmp_path)
    assert run(["rock", str(terrain), *options.split(), "--spacing", "0.01"]) == 0
    assert capfd.readouterr().out.endswith("rock.ply\n")
    assert (tmp_path / "rock.png").is_file()


@pytest.mark.slow
def test_the_example_of_holds_on_a_scan_makes_a_stance_that_stands(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    (options,) = re.findall(r"^crux rock \$terrain (.*)$", README, re.MULTILINE)
    (tried,) = re.findall(r"^crux holds (.*) --plot holds.png$", README, re.MULTILINE)
    (example,) = (block for block in blocks("python") if "holds.json" in block)
    terrain = Path(mpl.get_data_path()) / "sample_data" / "jacksboro_fault_dem.npz"
    monkeypatch.chdir(tmp_path)
    assert run(["rock", str(terrain), *options.split()]) == 0
    assert run(["holds", *tried.split()]) == 0
    exec(compile(example, "README.md", "exec"), {})
    capfd.readouterr()
    assert run(["plan", "on-rock.json", "--json"]) == 0
    reply = json.loads(capfd.readouterr().out)
    assert reply["utilisation"] < 0.6
    assert len(reply["poses"]) == 4


def test_the_example_of_a_clients_name_is_a_query_that_a_service_can_tell_from_others():
    (example,) = (block for block in blocks("python") if "zenoh.SourceInfo" in block)
    names = queue.SimpleQueue()
    config = zenoh_config(settings=["listen/endpoints:[]"], multicast=False)
    with open_session(config) as session:

        def told(query: zenoh.Query) -> None:
            with query:
                names.put((query.source_info.source_id.zid, query.source_info.source_sn))

        class Here:
            """The session of the example is one that is open already."""

            Config, SourceInfo = zenoh.Config, zenoh.SourceInfo

            @staticmethod
            def open(_: zenoh.Config) -> nullcontext:
                return nullcontext(session)

        session.declare_queryable("crux/robosimian/plan", told)
        exec(compile(example.replace("import zenoh", ""), "README.md", "exec"), {"zenoh": Here})
        assert names.get(timeout=PATIENCE) == (session.zid(), 1)


@pytest.mark.slow
def test_the_examples_of_a_client_read_whole_plans_and_set_points(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    (stance,) = blocks("json")
    (tmp_path / "stance.json").write_text(stance, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    server, scope = Served(free_endpoint()), dict[str, object]()
    try:
        for example in (block for block in blocks("python") if "CruxClient(" in block):
            text = example.replace("tcp/127.0.0.1:7447", server.endpoint)
            exec(compile(text, "README.md", "exec"), scope)
    finally:
        server.process.kill()
        server.process.communicate()
    whole, points = capsys.readouterr().out.splitlines()
    assert whole.startswith("optimal 0.7")
    status, tensions = points.split(maxsplit=1)
    assert status == "optimal"
    assert [len(hand) for hand in json.loads(tensions)] == [4, 4]


def test_every_command_line_uses_a_bundled_name_that_exists():
    lines = [line for block in blocks("") for line in block.splitlines()]
    named = {m[1] for line in lines if (m := re.match(r"crux (?:plan|query) (\S+)", line))}
    assert named
    assert named <= set(bundled())


def test_the_two_commands_are_each_on_one_line():
    lines = [block.strip() for block in blocks("") if block.startswith("python3 -m venv")]
    assert [line.split()[-1] for line in lines] == ["demo", "pytest"]
    assert all("\n" not in line for line in lines)
