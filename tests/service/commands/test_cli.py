"""The ``crux`` command: what it prints where, and its exit status."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from types import SimpleNamespace

import pytest
import trimesh
from msgspec.structs import replace
from rich.console import Console

from service import answering
from service.answering import dispatch
from service.commands.cli import COMMANDS_BY_NAME, run_command_line
from service.commands.stances import bundled, read_with_text
from service.requests import PlanRequest
from service.tables import print_plan
from service.wire import decode_request
from tests.suite.helpers.commands import (
    BAD_INPUT,
    DONE,
    FAILED,
    OVERLOADED,
    complaint,
    result,
)
from tests.suite.helpers.patience import PATIENCE
from tests.suite.helpers.requests import (
    HEAVY,
    LIGHT,
    compliant_request,
    flat_request,
    put,
    request_with_joints,
    wall_request,
)
from tests.suite.helpers.rocks import cylinder_mesh

# plan ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("request_", "status", "code"),
    [
        (wall_request(), "optimal", DONE),
        (wall_request(HEAVY), "overloaded", OVERLOADED),
        (
            put(flat_request(), ("stance", "hands", 0, "grasp", "palm"), False),
            "infeasible",
            OVERLOADED,
        ),
    ],
)
def test_the_exit_status_of_a_plan(request_, status, code, stance_file, capfd):
    assert run_command_line(["plan", stance_file(request_), "--json"]) == code
    assert result(capfd)["status"] == status
    brief = ["-q"] if status == "infeasible" else []
    assert run_command_line(["plan", stance_file(request_), *brief]) == code
    out, err = capfd.readouterr()
    assert err == ""
    assert out.startswith(status.upper())
    assert max(len(line) for line in out.splitlines()) <= 80


def test_a_failed_plan_is_a_failure(stance_file, capfd, monkeypatch):
    def fail(*asked: object) -> dispatch.Planned:
        answer = good(*asked)
        answer.reply.status = "failed"
        return answer

    good = answering.planned
    monkeypatch.setattr(answering, "planned", fail)
    assert run_command_line(["plan", stance_file(wall_request()), "--json"]) == FAILED
    assert result(capfd)["status"] == "failed"


def test_a_plan_says_how_much_hangs_on_the_palms(stance_file, capfd):
    path = stance_file(wall_request())
    run_command_line(["plan", path, "--json"])
    reply = result(capfd)
    assert 0.0 < reply["load_factor_without_palm"] < reply["load_factor"]
    assert reply["prices"]
    run_command_line(["plan", path])
    out = capfd.readouterr().out
    assert f"load factor {reply['load_factor']:.3f}" in out
    without = f"{reply['load_factor_without_palm']:.3f}"
    assert f"load factor without the palms' shear and pressing: {without}" in out
    shear, pressing = (reply[f"load_factor_without_palm_{load}"] for load in ("shear", "pressing"))
    assert 0.0 < pressing < shear < reply["load_factor"]
    assert (
        f"without their shear alone: {shear:.3f}; without their pressing alone: {pressing:.3f}"
        in out
    )
    assert reply["reason"] in out.replace("\n", " ")
    for hand in reply["hands"]:
        assert hand["limb"] in out


@pytest.mark.usefixtures("few_places")
def test_a_plan_says_what_is_left_where_the_hands_are_a_little_elsewhere(stance_file, capfd):
    path = stance_file(flat_request())
    run_command_line(["plan", path, "--robust", "--json"])
    robust = result(capfd)["robust"]
    run_command_line(["plan", path, "--robust"])
    out = capfd.readouterr().out
    assert max(len(line) for line in out.splitlines()) <= 80
    said = "load factor, planned anew with each hand up to 2 mm and 20 mrad off its place"
    assert said in " ".join(out.split())
    low, high = robust["tenth_interval"]
    told = f"10 % quantile {robust['tenth']:.3f} ({low:.3f} to {high:.3f})"
    assert told in out.replace("\n", " ")
    assert f"1 % quantile {robust['hundredth']:.3f}" in out.replace("\n", " ")
    run_command_line(["plan", path])
    assert "off its place" not in capfd.readouterr().out


def test_a_plan_says_how_it_fares_on_displaced_hands(stance_file, capfd):
    path = stance_file(compliant_request() | {"open_loop": {"samples": 3}, "want": ["open_loop"]})
    run_command_line(["plan", path, "--open-loop", "--json"])
    reply = result(capfd)
    found = reply["open_loop"]
    run_command_line(["plan", path, "--open-loop"])
    out = capfd.readouterr().out
    assert max(len(line) for line in out.splitlines()) <= 80
    assert "0.25 mm in z" in " ".join(out.split())
    assert f"everything holds in {found['holds']:.0%}" in out
    row = next(line.split() for line in out.splitlines() if f"{found['median']:.3f}" in line)
    assert row[:3] == [f"{found[part]:.3f}" for part in ("tenth", "median", "ninetieth")]
    assert row[-1] == found["worst_limb"]
    target = 1e3 * reply["hands"][0]["wrist"]["pose_target"][0]
    assert "where limbs are to aim" in out
    assert f"{target:.2f}" in out
    run_command_line(["plan", path, "--open-loop", "-q"])
    brief = capfd.readouterr().out
    assert "everything holds in" in brief
    line = f"util 10 % {row[0]}, 50 % {row[1]}, 90 % {row[2]}, dragged N {row[3]}"
    assert f"{line}, worst hand {row[-1]}" in " ".join(brief.split())
    assert "where limbs are to aim" not in brief


def test_displaced_hands_require_wrists_that_comply(stance_file, capfd):
    assert run_command_line(["plan", stance_file(wall_request()), "--open-loop"]) == BAD_INPUT
    assert "want: 'open_loop' requires wrist 'compliant' or 'floating'" in complaint(capfd)


DRAWS = """
[[draws]]
hand.finger.pulley_radii = { value = [0.0055, 0.0028, 0.0022], unit = "m", source = "assumed" }
surfaces.rock.shear_limit = { value = 50, unit = "N", source = "measured" }

[[draws]]
surfaces.rock.shear_limit = { value = 90, unit = "N", source = "measured" }
"""


@pytest.mark.parametrize(("pull", "digits"), [(5.0, 1), (30.0, 2)])
def test_a_plan_says_how_sure_it_is(pull, digits, stance_file, capfd):
    path = stance_file(flat_request() | {"body_wrench": [0.0, 0.0, pull, 0.0, 0.0, 0.0]})
    run_command_line(["plan", path, "--spread", "--json"])
    reply = result(capfd)
    spread, ends = reply["spread"], reply["spread"]["load_factor"]
    run_command_line(["plan", path, "--spread"])
    out = capfd.readouterr().out
    assert max(len(line) for line in out.splitlines()) <= 80
    # to the first decimal in which its ends differ; the number one decimal more
    assert 0.1**digits < ends["high"] - ends["low"] < 0.1 ** (digits - 1)
    interval = f"({ends['low']:.{digits}f} to {ends['high']:.{digits}f})"
    assert f"load factor {reply['load_factor']:.{digits + 1}f} {interval}" in out
    out = " ".join(out.split())
    assert spread["threshold"]["share"] == 0.0
    assert "feasible on none of the assumed range of rocks (2 to 5 times sandpaper)" in out
    most, rock = spread["rock_apart"][0], spread["rock_share"]
    assert f"variance of the load factor: {rock:.0%} by the rock's strength; of the rest" in out
    assert f"{round(most['share'], 1):.0%} by {most['quantity']} (" in out
    for name in ("kept", "feedback"):
        assert spread[name]["holds"] + spread[name]["without"] <= spread["draws"]
    assert f"tensions kept {spread['kept']['holds']}" in out
    run_command_line(["plan", path])
    assert "samples" not in capfd.readouterr().out


def test_a_spread_over_draws_of_the_callers_own(stance_file, tmp_path, capfd):
    path, file = stance_file(flat_request()), tmp_path / "draws.toml"
    file.write_text(DRAWS, encoding="utf-8")
    run_command_line(["plan", path, "--draws", str(file), "--json"])
    spread = result(capfd)["spread"]
    assert spread["draws"] == 2
    assert spread["load_factors"][0] < spread["load_factors"][1]


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("0.0028", "2.8", "draws[0].hand.finger.pulley_radii: must be from 0 to 1 m"),
        ("rock.shear_limit = { value = 90", "ice.a = { value = 90", "draws[1].surfaces.ice: unk"),
        ("[[draws]]", "[[sets]]", "draws: must be a list"),
        ("[[draws]]", "[[draws", "at line 2"),
        (DRAWS, "draws = [3]", "draws[0]: must be a table with hand or surfaces, got 3"),
        (DRAWS, "draws = [{hand = 3}]", "draws[0].hand: "),
    ],
)
def test_a_file_of_draws_that_cannot_be_is_refused_in_one_line(old, new, told, tmp_path, capfd):
    file = tmp_path / "draws.toml"
    file.write_text(DRAWS.replace(old, new), encoding="utf-8")
    assert run_command_line(["plan", "wall-300", "--draws", str(file)]) == BAD_INPUT
    said = complaint(capfd)
    assert str(file) in said
    assert told in said


def test_a_folder_that_is_named_as_a_table_is_refused(tmp_path, capfd):
    arguments = ["sweep", "wall-300", "--vary", "load.mass=50:60:2", "-o"]
    assert run_command_line([*arguments, str(tmp_path / "sweep.parquet")]) == BAD_INPUT
    assert "must be a folder for several files, not a ." in complaint(capfd)
    assert not list(tmp_path.iterdir())


def test_a_mark_that_editors_put_before_a_text_is_no_part_of_it(tmp_path, capfd):
    path = tmp_path / "stance.json"
    path.write_text(json.dumps(wall_request()), encoding="utf-8-sig")
    assert run_command_line(["plan", str(path), "--json"]) == DONE
    assert result(capfd)["status"] == "optimal"


def test_what_is_asked_for_is_added_to_what_the_file_wants(stance_file, capfd):
    run_command_line(
        ["plan", stance_file(wall_request() | {"want": ["model", "prices"]}), "--json"]
    )
    reply = result(capfd)
    assert reply["hands"][0]["wrench_space"]["rows"]
    assert reply["load_factor"] is not None


def test_a_stance_from_standard_input(capfd, monkeypatch):
    given = io.BytesIO(json.dumps(wall_request()).encode())
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=given))
    assert run_command_line(["plan", "-", "--json"]) == DONE
    assert result(capfd)["id"] == "wall"


@pytest.mark.parametrize(
    "name",
    ["wall-300", "wall-300-joints", "wall-700", "overhang", "slab", "boulders", "ledge"],
)
def test_bundled_stances(name, capfd):
    assert name in bundled()
    assert run_command_line(["plan", name, "--json"]) in (DONE, OVERLOADED)
    assert result(capfd)["verified"] is True


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("{", "crux: not valid JSON: Input data was truncated\n"),
        ("{}", "crux: v: missing; valid: 1\n"),
        (json.dumps(wall_request() | {"colour": 1}), "crux: colour: unknown field; known are "),
        (json.dumps(wall_request() | {"confidence": 0.9}), "crux: confidence: not supported in"),
        (json.dumps(wall_request() | {"deadline": 0}), "crux: deadline: "),
        (
            json.dumps(put(wall_request(), ("stance", "hands", 3, "limb"), "nose")),
            "crux: stance.hands[3].limb: unknown limb 'nose'; known are front_right",
        ),
    ],
)
def test_bad_input_is_one_line(text, line, stance_file, capfd):
    for flags in ([], ["--json"]):
        assert run_command_line(["plan", stance_file(text), *flags]) == BAD_INPUT
        assert complaint(capfd).startswith(line)


def test_a_stance_that_is_nowhere(capfd):
    assert run_command_line(["plan", "no/such.json"]) == BAD_INPUT
    line = complaint(capfd)
    assert line.startswith("crux: STANCE: no such file, and no bundled stance 'no/such.json'")
    assert "wall-300" in line


def test_a_person_reads_torques_effort_and_whose_joint_it_is(stance_file, capfd):
    path = stance_file(request_with_joints() | {"limits": {"joint_torque": 10.0}, "present": {}})
    assert run_command_line(["plan", path, "--json"]) == DONE
    reply = result(capfd)
    assert run_command_line(["plan", path]) == DONE
    out = capfd.readouterr().out
    assert max(len(line) for line in out.splitlines()) <= 80
    assert f"effort {reply['effort']:.3g}" in out
    table = out.partition("joint torques [N·m]")[2]
    for limb, torques in reply["joint_torque"].items():
        used = max(torques, key=abs)
        (row,) = [row for row in table.splitlines() if row.split()[:1] == [limb] and "*" in row]
        assert f"{used:.1f}*" in row
        assert row.split()[-2:] == ["10", f"{abs(used) / 10.0:.2f}"]
    assert reply["effort_prices"]
    prices, _, effort_prices = table.partition("decrease of the effort")
    assert reply["effort_prices"][0]["limb"] in effort_prices
    joints = [price["joint"] for price in reply["prices"][:8] if price["joint"]]
    assert joints
    assert all(joint in prices for joint in joints)


def test_numbers_however_long_are_told_whole(capsys):
    reply = dispatch.answer_plan(decode_request(json.dumps(wall_request()).encode(), PlanRequest))
    longest = "rear_right"
    hand = next(hand for hand in reply.hands if hand.limb == longest)
    hand.wrench = [-309073.0, -333.2, 126883.4, 10.26, -16361.4, 0.04]
    hand.utilisation = 901.51
    hand.palm = replace(hand.palm, force=[-97178.3, 0.0, 209575.1])
    print_plan(reply, Console(width=80, markup=False))
    out = capsys.readouterr().out
    assert "…" not in out
    table = out.partition("wrench on the rock")[2].splitlines()
    assert max(len(row) for row in table) <= 80
    told = "rear_right -309073 -333 126883 10.3 -16361 0.0 901.5 97178 209575"
    assert told.split() in [row.split() for row in table]


def test_names_however_long_leave_numbers_whole(capsys):
    reply = dispatch.answer_plan(decode_request(json.dumps(wall_request()).encode(), PlanRequest))
    for hand, side in zip(reply.hands, ("left", "right", "upper", "lower"), strict=True):
        hand.limb = f"{side}_middle_foreleg"
    first = reply.hands[0]
    first.wrench = [-234.7, -564.0, 123.4, -12.34, 23.45, 0.04]
    print_plan(reply, Console(width=80, markup=False))
    table = capsys.readouterr().out.partition("wrench on the rock")[2].splitlines()
    (row,) = (line.split() for line in table if line.split()[:1] == [first.limb] and "-564" in line)
    assert row[1:7] == ["-235", "-564", "123", "-12.3", "23.4", "0.0"]
    assert max(len(line) for line in table) <= 80


def test_on_a_narrow_terminal_nothing_is_left_out(monkeypatch, capfd):
    monkeypatch.setenv("COLUMNS", "80")
    run_command_line(["plan", "wall-300"])
    wide = capfd.readouterr().out.splitlines()[1:]
    monkeypatch.setenv("COLUMNS", "40")
    run_command_line(["plan", "wall-300"])
    assert capfd.readouterr().out.splitlines()[1:] == wide


def test_a_picture_that_cannot_be_written_is_refused_before_any_work(tmp_path, capfd):
    (tmp_path / "somewhere").mkdir()
    plan, space = ["plan", "wall-300"], ["wrench-space", "wall-300", "--hand", "front_left"]
    endings = "valid endings are .png, .pdf, .svg"
    for words, name, told in (
        (plan, "somewhere", endings),
        (plan, "plan.docx", endings),
        (space, "space.xyz", endings),
        (space, "no/folder/space.png", "no such folder"),
    ):
        assert run_command_line([*words, "--plot", str(tmp_path / name)]) == BAD_INPUT
        assert f"{tmp_path / name}: {told}" in complaint(capfd)
    assert not list(tmp_path.glob("*.png"))


def test_a_stance_may_come_through_a_pipe(tmp_path, capfd):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    text = json.dumps(wall_request())
    writer = subprocess.Popen(
        [sys.executable, "-c", "import sys; open(sys.argv[1], 'w').write(sys.argv[2])", pipe, text]
    )
    try:
        assert run_command_line(["plan", str(pipe), "--json"]) == DONE
    finally:
        writer.wait(PATIENCE)
    assert result(capfd)["status"] == "optimal"


def test_torques_of_many_joints_go_on_in_the_next_line(capsys):
    request = wall_request(LIGHT) | {"want": []}
    reply = dispatch.answer_plan(decode_request(json.dumps(request).encode(), PlanRequest))
    reply.joint_torque = {"arm": [-1234.5, *range(1, 15), -7.0], "tail": [0.25]}
    reply.joint_torque_limit = {"arm": [2469.0, *[300.0] * 15], "tail": [1.0]}
    print_plan(reply, Console(width=80, markup=False))
    table = capsys.readouterr().out.partition("joint torques")[2].splitlines()
    rows = [row.split() for row in table]
    assert ["arm", "-1234*", "1.0", "2.0", "3.0", "4.0", "5.0", "6.0", "2469", "0.50"] in rows
    assert ["from", "8", "7.0", "8.0", "9.0", "10.0", "11.0", "12.0", "13.0"] in rows
    assert ["from", "15", "14.0", "-7.0"] in rows
    assert ["tail", "0.2*", "1", "0.25"] in rows
    assert max(len(row) for row in table) <= 80


def test_hands_out_of_reach_are_bad_input_in_one_line(stance_file, capfd):
    request = put(wall_request(), ("stance", "joints"), "solve")
    for i in (0, 2):
        request["stance"]["hands"][i]["pose"]["position"][2] *= 3.0
    assert run_command_line(["plan", stance_file(request)]) == BAD_INPUT
    line = complaint(capfd)
    assert line.startswith("crux: stance.hands[0].pose: front_right is out of reach by ")
    assert "; rear_left is out of reach by " in line


# wrench-space -------------------------------------------------------------------------------------


def test_a_wrench_space(stance_file, capfd):
    path = stance_file(flat_request())
    assert run_command_line(["wrench-space", path, "--hand", "front_left", "--json"]) == DONE
    reply = result(capfd)
    assert run_command_line(["wrench-space", path, "--hand", "front_left"]) == DONE
    out, err = capfd.readouterr()
    assert err == ""
    assert max(len(line) for line in out.splitlines()) <= 80
    assert "seated by rule pinch" in out
    assert f"{len(reply['vertices'])} vertices, {len(reply['half_spaces']['offsets'])} half-" in out
    assert f"dimension {reply['dimension']}" in out
    for limit in reply["tension_limits"]:
        assert f"{limit['tension']:.1f}" in out


@pytest.mark.usefixtures("few_places")
def test_a_wrench_space_where_the_hand_is_a_little_elsewhere(stance_file, capfd):
    arguments = ["wrench-space", stance_file(flat_request()), "--hand", "front_left", "--robust"]
    assert run_command_line(arguments) == DONE
    out = capfd.readouterr().out
    assert max(len(line) for line in out.splitlines()) <= 80
    assert "at 8 places within 2 mm and 20 mrad" in out
    assert out.count("a row's least may be above its most") == 1
    assert run_command_line([*arguments, "--json"]) == DONE
    assert f"{-result(capfd)['robust']['hundredth']['-fx']:.2f}" in out


def test_a_wrench_space_of_a_hand_that_is_not_there(stance_file, capfd):
    assert (
        run_command_line(["wrench-space", stance_file(flat_request()), "--hand", "nose"])
        == BAD_INPUT
    )
    assert complaint(capfd).startswith("crux: limb: no hand 'nose' in this stance; it has front_")


def test_a_picture_of_a_wrench_space_also_of_a_hand_that_can_carry_nothing(stance_file, tmp_path):
    picture = tmp_path / "space.png"
    for surface, status in (({}, DONE), ({"surface": {"shear_limit": 0.01}}, OVERLOADED)):
        request = flat_request()
        # a tile of that surface is overloaded as soon as the finger closes
        request["stance"]["hands"][0] |= surface
        limb = request["stance"]["hands"][0]["limb"]
        words = ["wrench-space", stance_file(request), "--hand", limb]
        assert run_command_line([*words, "--plot", str(picture), "--json"]) == status
        assert picture.read_bytes().startswith(b"\x89PNG")
        picture.unlink()


@pytest.mark.slow
def test_a_wrench_space_of_too_many_vertices_is_drawn_all_the_same(stance_file, tmp_path, capfd):
    request = wall_request()
    for hand in request["stance"]["hands"]:
        hand["surface"] = {"shear_limit": 60.0, "half_planes": 8}
    picture = tmp_path / "space.png"
    path = stance_file(request)
    arguments = ["wrench-space", path, "--hand", "front_left", "--plot", str(picture)]
    assert run_command_line(arguments) == DONE
    out = capfd.readouterr().out
    assert "vertices left out: " in out
    assert "dimension 6" in out
    assert picture.read_bytes().startswith(b"\x89PNG")


# Holds in files -----------------------------------------------------------------------------------


def scanned(file: str) -> dict:
    request = wall_request()
    for hand in request["stance"]["hands"]:
        hand["hold"] = {"shape": "mesh", "file": file}
    return request


def test_a_scan_is_read_beside_the_stance_that_names_it(stance_file, tmp_path, capfd):
    trimesh.Trimesh(*cylinder_mesh(0.3), process=False).export(tmp_path / "log.stl")
    assert run_command_line(["plan", stance_file(wall_request()), "--json"]) == DONE
    want = result(capfd)
    assert run_command_line(["plan", stance_file(scanned("log.stl")), "--json"]) == DONE
    assert result(capfd)["load_factor"] == pytest.approx(want["load_factor"], rel=0.01)


@pytest.mark.parametrize(
    ("content", "words"), [(None, "no such file"), (b"solid\nendsolid\n", "no triangles")]
)
def test_a_scan_that_cannot_be_read(content, words, stance_file, tmp_path, capfd):
    if content is not None:
        (tmp_path / "rock.stl").write_bytes(content)
    assert run_command_line(["plan", stance_file(scanned("rock.stl"))]) == BAD_INPUT
    error = complaint(capfd)
    assert error.startswith("crux: stance.hands[0].hold.file: ")
    assert words in error
    assert "rock.stl" in error


def test_a_scan_is_in_a_file_or_in_the_message_not_in_both(stance_file, capfd):
    request = put(scanned("a.stl"), ("stance", "hands", 0, "hold", "vertices"), [])
    assert run_command_line(["plan", stance_file(request)]) == BAD_INPUT
    assert complaint(capfd).startswith("crux: stance.hands[0].hold.file: give a file, or ")


# The rest -----------------------------------------------------------------------------------------


def test_schema(capfd):
    assert run_command_line(["schema", "--json"]) == DONE
    assert "PlanRequest" in result(capfd)["$defs"]
    assert run_command_line(["schema"]) == DONE
    assert "PlanRequest" in json.loads(capfd.readouterr().out)["$defs"]


@pytest.mark.parametrize(
    ("arguments", "told", "asked"),
    [
        (["fly"], "No such command 'fly'", "crux"),
        (["plan"], "Missing argument 'STANCE'", "crux plan"),
        (["plan", "--fast"], "No such option '--fast'", "crux plan"),
        (["body-space", "wall", "--axes", "fx,up"], "got fx,up", "crux body-space"),
        (["body-space", "wall", "--pure", "--projection"], "not both", "crux body-space"),
        (["body-space", "wall", "--projection", "--pure"], "not both", "crux body-space"),
        (["wrench-space", "wall"], "Missing option '--hand'", "crux wrench-space"),
        (["query", "wall", "--timeout", "soon"], "'soon' is not a valid float", "crux query"),
    ],
)
def test_wrong_usage_leads_to_the_commands_own_help(arguments, told, asked, capfd):
    assert run_command_line(arguments) == BAD_INPUT
    line = complaint(capfd)
    assert told in line
    assert line.endswith(f"; see {asked} --help\n")


def test_help_lists_the_commands_and_bundled_stances(capfd):
    assert run_command_line(["--help"]) == DONE
    out = capfd.readouterr().out
    for name in COMMANDS_BY_NAME:
        assert f"  {name} " in out
    assert all(name in out for name in bundled())


def test_quiet_still_says_that_a_turn_is_nearly_half(tmp_path, capfd):
    request = json.loads(read_with_text("wall-300")[1].text)
    for hand in request["stance"]["hands"]:
        hand["grasp"] = {"outer_rotation": 3.14}
    path = tmp_path / "rounded.json"
    path.write_text(json.dumps(request))
    run_command_line(["plan", str(path), "-q"])
    assert "less than in a pinch: is it pi (3.142)?" in capfd.readouterr().err
