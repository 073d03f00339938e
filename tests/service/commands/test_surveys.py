"""`crux wrench-space --search`: what a floating hand really holds."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from hand_models.fixed_wrist import named_row
from hand_models.wrench_spaces import Row
from service.commands.cli import crux, run_command_line
from service.commands.stances import read_request
from service.tables import console
from service.tables.hands import print_failures
from service.wire import Format

STANCE = "wall-300-floating"


def searched(*arguments):
    result = CliRunner().invoke(crux, ["wrench-space", STANCE, *arguments], standalone_mode=False)
    assert result.exception is None, result.exception
    return result.stdout


@pytest.mark.slow
def test_the_search_tells_wrenches_poses_and_what_lets_go():
    per_axis = 5
    reply = json.loads(searched("--hand", "rear_left", "--search", str(per_axis), "--json"))
    found = reply["search"]
    assert found["tried"] == per_axis**6
    wrenches = np.array(found["wrenches"])
    assert wrenches.shape == (len(found["limiting"]), 6) == np.array(found["twists"]).shape
    for k, (name, end) in enumerate(found["ends"].items()):
        if end is None:
            continue
        sign = 1.0 if name[0] == "+" else -1.0
        farthest = (sign * wrenches[:, k // 2]).max()
        assert end["reach"] == pytest.approx(sign * end["wrench"][k // 2])
        assert end["reach"] >= farthest - 1e-6 * max(1.0, abs(farthest))
    assert len(found["ends"]) == 12
    named = {limit["limit"] for limit in found["limiting"] if limit}
    assert named & {"shear", "pull_off"}


@pytest.mark.slow
def test_the_search_prints_a_table():
    shown = searched("--hand", "rear_left", "--search", "3")
    assert f"of {3**6} poses" in shown
    assert "what lets go first" in shown
    # one line a finger, and its counts add up
    rows = {line.split()[0]: line.split()[1:] for line in shown.splitlines() if line.split()}
    table = shown.partition("what lets go first")[2]
    total = int(table.split("of ")[1].split()[0])
    counted = [line.split()[-1] for line in table.splitlines()[1:] if line.strip()]
    assert sum(int(count) for count in counted if count.isdigit()) == total
    assert {"outer_left", "inner_left", "inner_right", "outer_right"} <= rows.keys()


def test_counts_are_by_finger_and_tile(capsys):
    rows = [
        named_row("inner_left", "distal", "pull_off", "limit"),
        named_row("inner_left", "distal", "shear", "limit"),
        named_row("inner_left", None, "finger_shear", "limit"),
        named_row("outer_right", "base", "shear", "limit"),
        Row(None, None, "palm_shear", "limit", "palm_shear"),
        None,
    ]
    print_failures(rows, console())
    title, head, _, *lines = filter(None, map(str.strip, capsys.readouterr().out.splitlines()))
    assert title == f"what lets go first, at how many of {len(rows)}"
    assert head.split() == ["finger", "base", "distal", "all"]
    assert [line.split() for line in lines] == [
        ["outer_left", "-", "-", "-", "0"],
        ["inner_left", "1", "-", "2", "3"],
        ["inner_right", "-", "-", "-", "0"],
        ["outer_right", "-", "1", "-", "1"],
        ["palm", "shear", "1"],
        ["a", "tile", "dragged", "backwards", "1"],
    ]


@pytest.mark.slow
def test_a_floating_set_without_zero_shows_least_and_most(capsys, tmp_path):
    request = json.loads(Format.JSON.encode(read_request(STANCE)))
    for hand in request["stance"]["hands"]:
        if hand.get("wrist") == "floating":
            hand["tendon_preload"] = [20.0] * 4
    file = tmp_path / "tense.json"
    file.write_text(json.dumps(request))
    arguments = ["wrench-space", str(file), "--hand", "rear_left"]
    assert run_command_line([*arguments, "--json"]) == 0
    reply = json.loads(capsys.readouterr().out)
    assert run_command_line(arguments) == 0
    shown = capsys.readouterr().out
    forces = np.array(reply["vertices"])[:, 0]
    line = next(line.split() for line in shown.splitlines() if line.strip().startswith("fx N"))
    np.testing.assert_allclose(
        [float(cell) for cell in line[2:]], [forces.min(), forces.max()], atol=0.01
    )
    assert "zero is not in this set" in shown
    assert "--search N finds what the hand really holds" in " ".join(shown.split())


def test_a_set_with_zero_in_it_shows_what_is_carried_alone(capsys):
    assert run_command_line(["wrench-space", "wall-300", "--hand", "front_left"]) == 0
    shown = capsys.readouterr().out
    line = next(line.split() for line in shown.splitlines() if line.strip().startswith("fz N"))
    least, most, pure_least, pure_most = (float(cell) for cell in line[2:])
    assert least <= pure_least < 0.0 < pure_most <= most
    assert "zero is not" not in shown


def test_a_fixed_hand_has_nothing_to_search(capsys):
    status = run_command_line(["wrench-space", STANCE, "--hand", "front_left", "--search", "5"])
    assert status == 2
    assert "must be floating" in capsys.readouterr().err
