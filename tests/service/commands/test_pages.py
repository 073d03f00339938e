"""``--html`` of commands: what is written, and what is refused before any work is done."""

from pathlib import Path

import msgspec
import pytest

from service.commands import options
from service.commands.cli import run_command_line
from tests.suite.helpers.climbs import blocked
from tests.suite.helpers.commands import BAD_INPUT, DONE, OVERLOADED, complaint, result
from tests.suite.helpers.requests import HEAVY, wall_request


def test_a_plan_is_written_as_a_page_beside_its_reply(
    capfd: pytest.CaptureFixture[str], tmp_path: Path
):
    page = tmp_path / "plan.html"
    assert run_command_line(["plan", "wall-300", "--html", str(page), "--json"]) == DONE
    assert result(capfd)["reason"] in page.read_text("utf-8")


def test_advice_that_was_asked_for_is_on_the_page(
    stance_file, capfd: pytest.CaptureFixture[str], tmp_path: Path
):
    page, folder = tmp_path / "plan.html", tmp_path / "advice"
    asked = ["plan", stance_file(wall_request(HEAVY)), "--json"]
    more = ["--html", str(page), "--advice", str(folder)]
    assert run_command_line([*asked, *more]) == OVERLOADED
    text = page.read_text("utf-8")
    advice = result(capfd)["advice"]
    assert len(advice) > 3
    assert all(each["sentence"] in text for each in advice)


def test_a_page_of_a_route_needs_no_folder(capfd: pytest.CaptureFixture[str], tmp_path: Path):
    page, route = tmp_path / "route.html", tmp_path / "route.json"
    route.write_bytes(msgspec.json.encode(blocked()))
    assert run_command_line(["route", str(route), "--html", str(page), "--json"]) == DONE
    found = result(capfd)
    assert found["files"] == {"page": str(page)}
    assert page.read_text("utf-8").count('"sentence":') == found["stages"]


def test_pages_are_of_one_route_or_rock(capfd: pytest.CaptureFixture[str], tmp_path: Path):
    page = str(tmp_path / "route.html")
    for more in ([], ["--resume"], ["-o", str(tmp_path / "routes.csv")]):
        assert run_command_line(["route", "knobs", "knobs", "--html", page, *more]) == BAD_INPUT
        assert complaint(capfd).startswith("crux: --html: ")
    ends = ["--from", "height:0.8", "--to", "height:0.8"]
    asked = ["climb", "small-wall", *ends, "-o", str(tmp_path / "a.csv"), "--html", page]
    assert run_command_line(asked) == BAD_INPUT
    assert complaint(capfd).startswith("crux: --html: ")
    assert not Path(page).exists()


def test_without_the_library_the_command_says_what_to_install_before_it_plans(
    capfd: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(options, "installed_version", lambda name: None)
    asked = ["plan", "no such stance", "--html", str(tmp_path / "plan.html")]
    assert run_command_line(asked) == BAD_INPUT
    said = complaint(capfd)
    assert said.startswith("crux: --html: needs plotly, which is not installed")
    assert "[view]" in said
