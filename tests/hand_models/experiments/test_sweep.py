"""Sweeps over two of the gripper's numbers: entries, cells, the command."""

import json

import numpy as np
import pytest

from hand_models import InvalidInputError
from hand_models.compliance import gripper_table
from hand_models.experiments import (
    Axis,
    Conditions,
    GripperSweep,
    HullPoints,
    radius_axes,
    rest_state,
    sharpened,
    sweep_cell,
    sweep_map,
)
from hand_models.experiments.pictures import entry_name
from hand_models.parameters import ParameterTable, Quantity, hand_table
from service.commands.cli import run_command_line

CONDITIONS = Conditions(0.3, 46.0)
FINE = "concrete-fine"


def quiet(done, total):
    pass


@pytest.fixture(scope="module")
def table():
    return gripper_table()


def test_an_entry_of_a_list_and_a_single_one_are_read(table):
    axis = Axis.parse("finger.pulley_radii[1]=0.002:0.004:5", table, FINE)
    assert axis.entry == "finger.pulley_radii[1]"
    assert axis.values == pytest.approx((0.002, 0.0025, 0.003, 0.0035, 0.004))
    before = table.vector("finger", "pulley_radii")
    after = axis.set(table, 0.003).vector("finger", "pulley_radii")
    assert after == (before[0], 0.003, before[2])
    assert table.vector("finger", "pulley_radii") == before
    assert axis.current(table) == before[1]
    single = Axis.parse("gripper.added_radius=0:0.02:2", table, FINE)
    assert single.current(table) == table.scalar("gripper", "added_radius")
    assert single.set(table, 0.02).scalar("gripper", "added_radius") == 0.02


def test_both_entries_may_be_of_one_list(table):
    middle, distal = radius_axes(table, 4)
    both = distal.set(middle.set(table, 0.004), 0.001)
    first = table.vector("finger", "pulley_radii")[0]
    assert both.vector("finger", "pulley_radii") == (first, 0.004, 0.001)


def test_the_surfaces_strength_is_an_entry_where_the_gripper_reads_it(table):
    text = "gripper.shear_limit=10:30:3"
    assert Axis.parse(text, table, "sandpaper-36").unit == "N"
    with pytest.raises(InvalidInputError, match="has no parameter"):
        Axis.parse(text, table, FINE)


def test_every_entry_that_is_offered_does_something_or_is_read_with_reason(table):
    """What stands in the gripper's place of a hand's number is not offered."""
    with pytest.raises(InvalidInputError) as caught:
        Axis.parse("nothing.at_all=1:2:3", table, FINE)
    message = str(caught.value)
    assert "\n" not in message
    listed = message.partition("known are ")[2].split(", ")
    assert listed == sorted(listed)
    for name in ("finger.pulley_radii[2]", "tile.contact_stiffness[0]", "tile.spring_stiffness"):
        assert name in message
    for name in ("tile.base_engagement", "palm.length", "gripper.pulley_radii"):
        assert name not in message


def test_a_cell_is_what_the_gripper_holds(table):
    grasp = CONDITIONS.gripper(table)
    cell = sweep_cell(table, CONDITIONS, ["shear", "normal"])
    assert cell["state"] == rest_state(grasp)
    points, shear = sharpened(grasp, HullPoints.explored(grasp, 300), "shear", 4, 2)
    _, normal = sharpened(grasp, points, "normal", 4, 2)
    assert cell["limits"] == {"shear": shear.value, "normal": normal.value}


def test_the_rows_of_a_grid_are_those_of_y(table):
    x = Axis.parse("gripper.pull_off_slope=1:4:2", table, FINE)
    y = Axis.parse("finger.pulley_radii[2]=0.002:0.0055:2", table, FINE)
    told = []
    found = sweep_map(table, x, y, CONDITIONS, ["normal"], lambda *step: told.append(step))
    assert [done for done, _ in told] == [0, 1, 2, 3, 4]
    # a distal pulley as large as the proximal one ejects the gripper, whatever it holds
    assert found["state"][0].tolist() == ["holds", "holds"]
    assert "holds" not in found["state"][1]
    assert found["failing"] == 0.5
    # a steeper loss under pull-off leaves less
    limits = found["limits"]["normal"]
    assert limits[0, 0] > limits[0, 1]
    assert np.isnan(limits[1]).all()


def test_a_grasp_that_cannot_be_is_a_cell_of_its_own(table):
    bases = Axis.parse("gripper.base_half_spacing=0.03:0.5:2", table, FINE)
    slope = Axis.parse("gripper.pull_off_slope=3:4:2", table, FINE)
    found = sweep_map(table, bases, slope, CONDITIONS, ["normal"], quiet)
    assert found["state"].tolist() == [["holds", "no grasp"]] * 2
    with pytest.raises(InvalidInputError, match=r"must be below .* got 0.4 m"):
        GripperSweep("gripper.base_half_spacing=0.4:0.5:2", "gripper.pull_off_slope=3:4:2").run(
            quiet, hand_table()
        )


@pytest.mark.slow
def test_a_hand_of_ones_own_is_where_the_sweep_begins():
    radii = hand_table().quantity("finger", "pulley_radii")
    own = Quantity([0.0055, 0.0040, 0.0020], radii.unit, "assumed")
    hand = hand_table().replaced(ParameterTable({"finger": {"pulley_radii": own}}))
    sweep = GripperSweep(
        "finger.pulley_radii[1]=0.003:0.004:2",
        "finger.pulley_radii[2]=0.001:0.002:2",
        CONDITIONS,
        ("normal",),
    )
    data = sweep.run(quiet, hand).data
    assert (data["x"]["current"], data["y"]["current"]) == (0.004, 0.002)
    # the last cell is the hand itself
    assert data["limits"]["normal"][1][1] == pytest.approx(data["current"]["limits"]["normal"])


@pytest.mark.slow
def test_the_command_draws_a_map_and_leaves_its_numbers(tmp_path, capsys):
    arguments = ["study", "sweep", "-o", str(tmp_path), "--json", "--diameter", "0.3"]
    arguments += ["--tension", "37", "--surface", "sandpaper-36"]
    arguments += [
        "--x",
        "gripper.shear_limit=20:30:2",
        "--y",
        "gripper.base_half_spacing=0.03:0.04:2",
    ]
    assert run_command_line([*arguments, "--measure", "moment", "--measure", "volume"]) == 0
    reply = json.loads(capsys.readouterr().out)
    written = json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))
    assert reply["data"] == written["data"]
    assert (tmp_path / "sweep.png").read_bytes().startswith(b"\x89PNG")
    data = written["data"]
    assert data["conditions"] == {"diameter": 0.3, "tension": 37.0, "surface": "sandpaper-36"}
    assert data["x"]["values"] == [20.0, 30.0]
    assert set(data["limits"]) == {"moment", "volume"}
    moment = np.array(data["limits"]["moment"])
    assert moment.shape == (2, 2)
    # stronger tiles and wider bases hold a larger moment
    assert (np.diff(moment, axis=0) > 0.0).all()
    assert (np.diff(moment, axis=1) > 0.0).all()


@pytest.mark.slow
def test_the_command_tells_where_it_is_best(tmp_path, capsys):
    arguments = ["study", "sweep", "-o", str(tmp_path), "--measure", "normal"]
    arguments += ["--x", "gripper.pull_off_slope=2:4:2", "--y", "gripper.entry_friction=0.2:0.3:2"]
    assert run_command_line(arguments) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "most normal:" in out
    assert "gripper.pull_off_slope = 2 1" in out
    assert "claims" not in out


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (["--x", "finger.pulley_radii[3]=0.001:0.005:3"], "--x: the gripper has no parameter"),
        (["--y", "palm.length=0.1:0.2:3"], "--y: the gripper has no parameter"),
        (["--x", "finger.pulley_radii[1]"], "--x: must be SECTION.NAME"),
        (["--x", "finger.pulley_radii[1]=0.001:0.005:2.5"], "--x: must be SECTION.NAME"),
        (["--x", "finger.pulley_radii[1]=0.001:0.002:0.003:3"], "--x: must be SECTION.NAME"),
        (
            ["--x", "finger.pulley_radii[1]=0.005:0.001:3"],
            "LOW and HIGH must be finite, and LOW below HIGH",
        ),
        (
            ["--x", "finger.pulley_radii[1]=nan:0.001:3"],
            "LOW and HIGH must be finite, and LOW below HIGH",
        ),
        (
            ["--x", "finger.pulley_radii[1]=0:inf:3"],
            "LOW and HIGH must be finite, and LOW below HIGH",
        ),
        (["--x", "gripper.added_radius=-0.01:0.01:3"], "LOW must not be negative"),
        (["--x", "gripper.added_radius=0:10:3"], "HIGH must not exceed 1 m"),
        (["--x", "finger.pulley_radii[1]=1:5:3"], "HIGH must not exceed 1 m"),
        (["--x", "finger.pulley_radii[1]=0.001:0.005:1"], "N must be from 2"),
        (["--x", "finger.pulley_radii[2]=0.001:0.005:3"], "--y: must differ from --x"),
        (
            ["--measure", "weight"],
            "--measure: unknown measure 'weight'; known are shear, normal, moment, volume",
        ),
        (["--surface", "moon"], "surface: unknown surface 'moon'; known are"),
        (["--diameter", "-0.3"], "--diameter: must be from 0.02 to 10 m, got -0.3"),
        (["--diameter", "300"], "--diameter: must be from 0.02 to 10 m, got 300"),
        (["--diameter", "nan"], "--diameter: must be from 0.02 to 10 m, got nan"),
        (
            ["--tension", "0"],
            "--tension: must be above 0 and at most tendon.maximum_tension, 700 N",
        ),
        (
            ["--tension", "701"],
            "--tension: must be above 0 and at most tendon.maximum_tension, 700 N",
        ),
    ],
)
def test_what_cannot_be_swept_is_refused_in_one_line(options, expected, tmp_path, capsys):
    assert run_command_line(["study", "sweep", "-o", str(tmp_path), *options]) == 2
    line = capsys.readouterr().err
    assert line.count("\n") == 1
    assert expected in line
    assert not (tmp_path / "result.json").exists()


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--x", "finger.pulley_radii[1]=0.001:0.005:3"),
        ("--y", "finger.pulley_radii[1]=0.001:0.005:3"),
        ("--diameter", "0.3"),
        ("--tension", "40"),
        ("--surface", FINE),
        ("--measure", "shear"),
    ],
)
def test_other_studies_refuse_the_options_of_a_sweep(option, value, tmp_path, capsys):
    assert run_command_line(["study", "fig06", "-o", str(tmp_path / "new"), option, value]) == 2
    assert (
        capsys.readouterr().err
        == f"crux: {option}: only the study sweep takes this option, not fig06\n"
    )
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("finger.pulley_radii[1]", "middle pulley radius"),
        ("tile.engagement[2]", "distal engagement"),
        ("gripper.base_half_spacing", "base half spacing"),
        ("tendon.friction", "tendon friction"),
    ],
)
def test_an_entry_has_a_name_in_words(entry, words):
    assert entry_name(entry) == words
