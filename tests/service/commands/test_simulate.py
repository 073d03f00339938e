"""The command ``crux simulate``."""

import pytest
from PIL import Image

from service.commands.cli import run_command_line
from tests.suite.helpers.commands import complaint, result

FEW = ("--draws", "60", "--replanned", "2", "--workers", "1", "--strength", "2")


def test_it_tells_how_often_all_hands_hold(capfd):
    assert run_command_line(["simulate", "slab", *FEW, "--json"]) == 0
    found = result(capfd)
    assert found["status"] == "optimal"
    assert found["holds"]["draws"] == 60
    assert found["replanned"]["draws"] == 2
    assert found["holds"]["low"] <= found["holds"]["probability"] <= found["holds"]["high"]


def test_a_person_reads_the_modulus_and_its_source(capfd):
    assert run_command_line(["simulate", "slab", *FEW]) == 0
    said = capfd.readouterr().out
    assert "m = 2.99 (assumed)" in said
    assert "no tile slips with a probability of" in said
    assert "all hold, tensions fixed" in said


def test_a_picture_is_drawn(capfd, tmp_path):
    path = tmp_path / "slips.png"
    few = ("--draws", "30", "--replanned", "0", "--workers", "1")
    assert run_command_line(["simulate", "slab", *few, "--plot", str(path)]) == 0
    with Image.open(path) as picture:
        assert picture.width > 1000


def test_a_stance_that_is_not_simulated_says_why(capfd):
    assert run_command_line(["simulate", "ledge", *FEW]) == 0
    assert "fingernails" in " ".join(capfd.readouterr().out.split())


@pytest.mark.parametrize(("option", "value"), [("--draws", "0"), ("--delay", "-1")])
def test_bad_options_are_refused(option, value, capfd):
    assert run_command_line(["simulate", "slab", option, value]) == 2
    assert option in complaint(capfd)
