"""The programs of ``examples`` do what they say."""

from __future__ import annotations

import csv
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.patience import PATIENCE

pytestmark = pytest.mark.slow


def run(name: str, folder: Path, *arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, str(ROOT / "examples" / f"{name}.py"), *arguments],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_plan_is_printed_and_drawn(tmp_path: Path):
    printed = run("plan_and_plot", tmp_path)
    assert printed.startswith("optimal: utilisation 0.96")
    assert len(re.findall(r"\d+ N", printed)) >= 16
    assert (tmp_path / "plan.png").read_bytes().startswith(b"\x89PNG")


def test_a_client_reads_set_points_of_a_wrench_that_drifts(endpoint: str, tmp_path: Path):
    lines = run("zenoh_client", tmp_path, endpoint).splitlines()
    assert lines[0] == "optimal: utilisation 0.96"
    points = [line.split() for line in lines[1:]]
    assert [int(words[0]) for words in points] == list(range(20))
    # the wrench that comes back has the set-points that it had
    assert points[0][2:] == points[10][2:]
    assert points[5][2:] != points[15][2:]


def test_a_robot_stays_on_the_wall_while_tiles_slip(endpoint: str, tmp_path: Path):
    lines = run("recover_from_slips", tmp_path, endpoint).splitlines()
    assert len({line.partition(":")[0] for line in lines}) == len(lines) == 8
    assert all(re.search(r": (holds, utilisation|overloaded, save \w+ first)", x) for x in lines)
    assert "holds" in lines[0]


def test_a_sweep_becomes_a_table(tmp_path: Path):
    printed = run("sweep_to_table", tmp_path).splitlines()
    with (tmp_path / "sweep.csv").open(encoding="utf-8") as file:
        assert len(list(csv.DictReader(file))) == 18
    heaviest = [float(re.findall(r"up to ([\d.]+) kg", line)[0]) for line in printed[1:]]
    assert heaviest == sorted(heaviest)
    assert 0.0 < heaviest[0] < heaviest[-1]


def test_an_own_robot_is_described_and_planned_for(tmp_path: Path):
    weight, _, *joints = run("own_robot", tmp_path).splitlines()
    # 15 kg, four links of 1.5 kg, two of them again at the wrists, two hands of 2.6 kg
    assert weight.startswith("29.2 kg, optimal")
    assert [line.split()[0] for line in joints] == ["upper", "lower"]
    torques = [float(t) for line in joints for t in re.findall(r"(-?[\d.]+) N·m", line)]
    assert len(torques) == 6
    assert 0.0 < max(map(abs, torques)) < 80.0


def test_points_become_rock_that_holds(tmp_path: Path):
    read, status, *hands = run("rock_from_points", tmp_path).splitlines()
    assert read.startswith("40000 points")
    assert status.startswith("optimal")
    assert len(hands) == 4
