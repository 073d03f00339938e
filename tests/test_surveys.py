"""`crux wrench-space --search`: what a floating hand really holds."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from service.command import crux, run

STANCE = "wall-300-floating"


def searched(*arguments):
    result = CliRunner().invoke(crux, ["wrench-space", STANCE, *arguments], standalone_mode=False)
    assert result.exception is None, result.exception
    return result.stdout


def test_the_search_tells_wrenches_poses_and_what_lets_go():
    reply = json.loads(searched("--hand", "rear_left", "--search", "5", "--json"))
    found = reply["search"]
    assert found["tried"] == 5**6
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


def test_the_search_prints_a_table():
    shown = searched("--hand", "rear_left", "--search", "5")
    assert f"of {5**6} poses" in shown
    assert "what lets go first" in shown


def test_a_fixed_hand_has_nothing_to_search(capsys):
    status = run(["wrench-space", STANCE, "--hand", "front_left", "--search", "5"])
    assert status == 2
    assert "floating is needed" in capsys.readouterr().err
