"""Knots of a climb in files: Parquet has what the lines have, and lines are read as written."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import msgspec
import numpy as np
import pytest

from hand_models.base import InvalidInputError
from service.bulk import read_trajectory, write_trajectory
from service.replies import KnotReply
from tests.suite.helpers.climbs import climbed


@pytest.fixture(scope="module")
def knots() -> list[KnotReply]:
    return [KnotReply.of(knot) for knot in climbed().climb.knots]


@pytest.fixture(scope="module")
def written(knots, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("climb")
    write_trajectory(knots, folder)
    return folder


def test_lines_are_read_as_they_were_written(knots, written):
    assert read_trajectory(written) == knots
    assert len((written / "trajectory.jsonl").read_bytes().splitlines()) == len(knots)


def test_the_table_has_every_number_of_the_lines(written):
    parquet = pytest.importorskip("pyarrow.parquet")
    rows = parquet.read_table(written / "trajectory.parquet").to_pylist()
    lines = [json.loads(line) for line in (written / "trajectory.jsonl").open()]
    assert len(rows) == len(lines)
    for row, line in zip(rows, lines, strict=True):
        for name in ("index", "move", "phase", "limb", "stage", "utilisation", "bound", "verified"):
            assert row.pop(name) == line[name]
        assert row.pop("time_s") == line["time"]
        for part, value in line["limiting"].items():
            assert row.pop(f"limiting_{part}") == value
        numbers = sorted(v for v in row.values() if not isinstance(v, bool))
        # 7 of the body, 28 angles and torques, and of each hand 7 of its pose, 4, 4, 6, 6
        assert len(numbers) == 7 + 56 + 4 * 27
        assert numbers == sorted(_numbers({**line, "limiting": None}))
        hand = next(each for each in line["hands"] if each["limb"] == "rear_left")
        assert row["rear_left_inner_right_tension_N"] == hand["tensions"][2]
        assert row["rear_left_fz_N"] == hand["wrench"][2]
        assert row["rear_left_world_mx_Nm"] == hand["wrench_in_world"][3]
        assert row["rear_left_joint_3_torque_Nm"] == line["joint_torque"]["rear_left"][2]
        assert row["body_qw"] == line["body"]["orientation"][3]


def _numbers(line: dict) -> list[float]:
    """Return all numbers of the body, of joints and of hands."""
    found: list[float] = []
    stack = [line[part] for part in ("body", "joints", "joint_torque", "hands")]
    while stack:
        part = stack.pop()
        if isinstance(part, dict):
            stack += part.values()
        elif isinstance(part, list):
            stack += part
        elif isinstance(part, int | float) and not isinstance(part, bool):
            found.append(part)
    return found


def test_the_wrenches_of_the_rock_in_w_hold_the_weight_at_every_stage(knots):
    mass = climbed().climb.route.start.robot.mass
    for knot in knots:
        total = np.sum([hand.wrench_in_world for hand in knot.hands], axis=0)
        assert np.allclose(total[:3], [0.0, 0.0, 9.81 * mass], rtol=0.0, atol=1e-6)


def test_without_pyarrow_there_are_the_lines_alone(knots, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    (tmp_path / "trajectory.parquet").write_text("of an earlier climb")
    assert set(write_trajectory(knots, tmp_path)) == {"trajectory"}
    assert [path.name for path in tmp_path.iterdir()] == ["trajectory.jsonl"]


def test_a_bad_trajectory_names_its_file_and_its_line(knots, tmp_path):
    for writer, command in (
        ("", "write it with: crux route ROUTE -o .*, or crux climb ROCK .* -o "),
        ("stages.csv", "write it with: crux route ROUTE -o [^,]*$"),
        ("wall.npz", "write it with: crux climb ROCK --from … --to … -o "),
    ):
        if writer:
            (tmp_path / writer).touch()
        with pytest.raises(InvalidInputError, match=command):
            read_trajectory(tmp_path)
    file = tmp_path / "trajectory.jsonl"
    lines = msgspec.json.Encoder().encode_lines(knots).splitlines(keepends=True)
    file.write_bytes(lines[0] + b'{"index": 1}\n')
    with pytest.raises(InvalidInputError, match=r"trajectory\.jsonl, line 2"):
        read_trajectory(tmp_path)
    file.write_bytes(lines[2] + lines[0])
    with pytest.raises(InvalidInputError, match="line 2: time must not decrease"):
        read_trajectory(tmp_path)
    file.write_bytes(lines[0].replace(b'"time":0.0', b'"time":null'))
    with pytest.raises(InvalidInputError, match="line 1"):
        read_trajectory(tmp_path)
    file.write_bytes(b"")
    with pytest.raises(InvalidInputError, match="no knots"):
        read_trajectory(tmp_path)


def edited(line: bytes, edit) -> bytes:
    knot = json.loads(line)
    edit(knot)
    return json.dumps(knot).encode() + b"\n"


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (lambda knot: knot.update(index=7), "index must be 2, got 7: knots are missing"),
        (lambda knot: knot["joints"].pop("front_left"), "joints must be of the same limbs"),
        (lambda knot: knot["joints"]["front_left"].pop(), "joints must be of the same limbs"),
        (lambda knot: knot["hands"].pop(), "hands must be of the same limbs"),
        (lambda knot: knot["hands"].reverse(), "hands must be of the same limbs"),
        (lambda knot: knot["hands"][0]["tensions"].pop(), "must be 4, none below zero"),
        (lambda knot: knot["hands"][0].update(tensions=[1, 1, -1, 1]), "must be 4, none below"),
        (lambda knot: knot["body"].update(position=[0, 0]), "body must have three"),
        (lambda knot: knot["body"].update(orientation=[0, 0, 1]), "a unit quaternion"),
        (lambda knot: knot["body"].update(orientation=[0, 0, 0, 0]), "a unit quaternion"),
        (lambda knot: knot.update(time=1e308), "time must be at most"),
    ],
)
def test_an_edited_knot_is_refused_before_anything_moves(edit, words, knots, tmp_path):
    lines = msgspec.json.Encoder().encode_lines(knots).splitlines(keepends=True)
    (tmp_path / "trajectory.jsonl").write_bytes(lines[0] + lines[1] + edited(lines[2], edit))
    with pytest.raises(InvalidInputError, match="line 3: ") as raised:
        read_trajectory(tmp_path)
    assert words in str(raised.value)
