"""Commented starts run as they are, and requests in TOML are those in JSON."""

from __future__ import annotations

import io
import json
import sys
import tomllib
from pathlib import Path

import msgspec
import numpy as np
import pytest

from service.bulk import read_trajectory
from service.commands.cli import run_command_line
from service.commands.stances import limbs_of, read_request, read_route
from tests.suite.helpers.commands import BAD_INPUT, DONE, complaint, result


@pytest.fixture
def start(tmp_path: Path, capfd: pytest.CaptureFixture[str]):
    def written(kind: str) -> Path:
        file = tmp_path / f"{kind}.toml"
        assert run_command_line(["new", kind, "-o", str(file)]) == DONE
        out, err = capfd.readouterr()
        assert (out, err) == ("", f"crux: wrote {file}\n")
        return file

    return written


def planned(capfd: pytest.CaptureFixture[str], *arguments: str) -> dict:
    assert run_command_line(["plan", *arguments, "--json"]) == DONE
    return result(capfd)


def test_a_new_stance_is_planned_as_the_bundled_wall(start, capfd):
    file = start("stance")
    found, bundled = (planned(capfd, each) for each in (str(file), "wall-300"))
    assert found["utilisation"] == pytest.approx(bundled["utilisation"], rel=1e-6)
    for one, two in zip(found["hands"], bundled["hands"], strict=True):
        np.testing.assert_allclose(one["wrench"], two["wrench"], atol=1e-3)
    # a reply has quaternions
    assert all(len(hand["seating"]["pose"]["orientation"]) == 4 for hand in found["hands"])


def test_a_new_stance_says_how_wrists_give(start, capfd):
    file = start("stance")
    text = file.read_text(encoding="utf-8").replace('# wrist = "compliant"', 'wrist = "compliant"')
    before, after = text.split("# [stance.limb_stiffness]")
    lines = [line.removeprefix("# ") for line in after.splitlines()]
    file.write_text("\n".join([before, "[stance.limb_stiffness]", *lines]), encoding="utf-8")
    wrists = [hand["wrist"] for hand in planned(capfd, str(file))["hands"]]
    assert [wrist["mode"] for wrist in wrists] == ["compliant", "fixed", "fixed", "fixed"]
    assert len(wrists[0]["pose_target"]) == 6


@pytest.mark.usefixtures("blank_pictures")
def test_a_new_route_starts_as_a_bundled_one_and_runs_from_end_to_end(start, tmp_path):
    file, out = start("route"), tmp_path / "out"
    assert run_command_line(["route", str(file), "-o", str(out), "--json"]) == DONE
    found, bundled = read_route(str(file)), read_route("six-moves")
    for one, two in zip(found.stance.hands, bundled.stance.hands, strict=True):
        assert (one.limb, one.hold, one.pose.position) == (two.limb, two.hold, two.pose.position)
    knots = read_trajectory(out)
    assert [knot.move for knot in knots if knot.phase == "load" and knot.stage] == [1, 2]


@pytest.mark.parametrize(("kind", "option"), [("robot", "--robot"), ("hand", "--hand")])
def test_a_new_robot_and_a_new_hand_are_the_bundled_ones(kind, option, start, capfd):
    file = start(kind)
    found = planned(capfd, "wall-300-joints", option, str(file))
    bundled = planned(capfd, "wall-300-joints")
    assert found["utilisation"] == pytest.approx(bundled["utilisation"], rel=1e-6)
    for limb, torque in bundled["joint_torque"].items():
        np.testing.assert_allclose(found["joint_torque"][limb], torque, atol=1e-3)


@pytest.mark.parametrize("kind", ["stance", "route", "robot", "hand"])
def test_a_start_says_what_its_entries_are(kind, start):
    text = start(kind).read_text(encoding="utf-8")
    assert text.startswith("# A ")
    assert "crux " in text
    assert sum(line.lstrip().startswith("#") for line in text.splitlines()) >= 4


def test_a_start_is_printed_and_read_from_standard_input(monkeypatch, capfd):
    assert run_command_line(["new", "stance"]) == DONE
    text = capfd.readouterr().out
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
    assert planned(capfd, "-")["status"] == "optimal"


def test_nothing_is_overwritten(start, tmp_path, capfd):
    file = start("hand")
    assert run_command_line(["new", "stance", "-o", str(file)]) == BAD_INPUT
    assert complaint(capfd) == f"crux: -o: {file} exists; name another file\n"
    assert run_command_line(["new", "robot", "-o", str(file)]) == BAD_INPUT
    assert "hand.toml exists" in complaint(capfd)
    assert not file.with_suffix(".urdf").exists()
    assert run_command_line(["new", "robot"]) == BAD_INPUT
    assert "a robot requires -o FILE" in complaint(capfd)
    assert run_command_line(["new", "stance", "-o", str(tmp_path / "a.json")]) == BAD_INPUT
    assert "must end in .toml" in complaint(capfd)


def test_a_request_in_toml_is_that_in_json(start, tmp_path):
    file = start("stance")
    same = tmp_path / "same.json"
    same.write_text(json.dumps(tomllib.loads(file.read_text(encoding="utf-8"))))
    assert msgspec.to_builtins(read_request(str(file))) == msgspec.to_builtins(
        read_request(str(same))
    )
    assert limbs_of(str(file)) == ("front_right", "rear_right", "rear_left", "front_left")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("v = 1", "v =", "not valid TOML: Invalid value (at line"),
        ("-0.45, 0.6]", "nan, 0.6]", "must be a finite number"),
        ('surface = "rock"', "surface = 2026-01-01", "unknown surface '2026-01-01'"),
        ('surface = "rock"', 'surfaces = "rock"', "stance.hands[0].surfaces: unknown field"),
        ("diameter = 0.3", "diameter = -0.3", "stance.hands[0].hold.diameter: expected a number"),
        ("diameter = 0.3", f"diameter = 1{'0' * 30}", "hold.diameter: expected a number <="),
        ("v = 1", "v = 1\nv = 1", "not valid TOML: Cannot overwrite a value"),
    ],
)
def test_what_is_wrong_with_a_request_in_toml(old, new, message, start, capfd):
    file = start("stance")
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    assert run_command_line(["plan", str(file)]) == BAD_INPUT
    assert message in complaint(capfd)


def test_advice_for_a_request_in_toml_is_written_as_json(start, tmp_path, capfd):
    file = start("stance")
    with file.open("a", encoding="utf-8") as text:
        text.write("\n[load]\nmass = 135.0\n")
    folder = tmp_path / "advice"
    run_command_line(["plan", str(file), "--advice", str(folder), "--json"])
    capfd.readouterr()
    written = sorted(folder.glob("*.json"))
    assert written
    read_request(str(written[0]))
