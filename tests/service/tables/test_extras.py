"""The printed answers of a spread over few samples."""

import re
from pathlib import Path

import pytest

from service.commands.cli import run_command_line
from tests.suite.helpers.commands import DONE

WEAK, STRONG = (
    f'[[draws]]\nsurfaces.rock.shear_limit = {{ value = {f}, unit = "N", source = "measured" }}\n'
    for f in (52, 71)
)
RADII = """
hand.finger.pulley_radii = { value = [0.0055, 0.0028, 0.0022], unit = "m", source = "measured" }
"""
RATIO = 'surfaces.defaults.pull_off_ratio = { value = 0.25, unit = "1", source = "measured" }\n'


def lines(file: Path, samples: str, capfd: pytest.CaptureFixture[str]) -> list[str]:
    file.write_text(samples)
    assert run_command_line(["plan", "wall-300", "--draws", str(file)]) == DONE
    return capfd.readouterr().out.splitlines()


def answers(said: list[str]) -> list[str]:
    """Utilisations of the three answers, as printed."""
    row = re.compile(r"(?:planned anew|tensions kept|balanced by feedback)(?: +\d+){3} +(.*)")
    return [found[1].strip() for line in said if (found := row.match(line.strip()))]


def test_one_sample_is_one_number_in_the_singular(tmp_path, capfd):
    said = lines(tmp_path / "one.toml", WEAK, capfd)
    assert "feasible in 0 of 1 sample" in said
    assert any(line.startswith(" 1 sample  ") for line in said)
    assert answers(said) == ["1.253"] * 3


def test_intervals_of_a_table_have_the_same_decimals(tmp_path, capfd):
    said = lines(tmp_path / "two.toml", WEAK + RADII + STRONG + RATIO, capfd)
    assert answers(said) == ["1.0 to 1.3", "1.0", "1.0 to 1.3"]
