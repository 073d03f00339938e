"""``--html`` of commands: what is written, and what is refused before any work is done."""

import json
import re
from pathlib import Path

import msgspec
import pytest

from service.commands import options
from service.commands.cli import run_command_line
from tests.suite.helpers.climbs import blocked
from tests.suite.helpers.commands import BAD_INPUT, DONE, OVERLOADED, complaint, result
from tests.suite.helpers.requests import wall_request

OVER = 120.0
"""Mass [kg] that is a little too much for four pinches."""


def test_a_plan_is_written_as_a_page_beside_its_reply(
    capfd: pytest.CaptureFixture[str], tmp_path: Path
):
    page = tmp_path / "plan.html"
    assert run_command_line(["plan", "wall-300", "--html", str(page), "--json"]) == DONE
    assert result(capfd)["reason"] in page.read_text("utf-8")


@pytest.mark.slow
def test_a_page_says_how_sure_its_plan_is(capfd: pytest.CaptureFixture[str], tmp_path: Path):
    page = tmp_path / "plan.html"
    asked = ["plan", "wall-300", "--spread", "--html", str(page), "--json"]
    assert run_command_line(asked) == DONE
    reply = result(capfd)
    (text,) = re.findall(r'id="data">(.*?)</script>', page.read_text("utf-8"))
    (stage,) = json.loads(text)["stages"]
    spread = reply["spread"]
    for name in ("utilisation", "load_factor"):
        assert stage["spread"][name] == [spread[name]["low"], spread[name]["high"]]
    assert stage["sure"][0].startswith("feasible where a tile on this rock holds at least ")
    bare = f"{reply['load_factor_without_palm']:.3f}"
    assert f"load factor without the palms' shear and pressing: {bare}" in stage["sure"]
    table = stage["samples"]
    assert all(each["title"] != table["title"] for each in stage["tables"])
    assert [row[0] for row in table["rows"]] == [
        "planned anew",
        "tensions kept",
        "balanced by feedback",
    ]
    holds = [row[1] for row in table["rows"]]
    assert holds == [spread["holds"], spread["kept"]["holds"], spread["feedback"]["holds"]]
    assert all(sum(row[1:4]) == spread["draws"] for row in table["rows"])


@pytest.mark.usefixtures("few_changes")
def test_advice_that_was_asked_for_is_on_the_page(
    stance_file, capfd: pytest.CaptureFixture[str], tmp_path: Path
):
    page, folder = tmp_path / "plan.html", tmp_path / "advice"
    asked = ["plan", stance_file(wall_request(OVER)), "--json"]
    more = ["--html", str(page), "--advice", str(folder)]
    assert run_command_line([*asked, *more]) == OVERLOADED
    text = page.read_text("utf-8")
    advice = result(capfd)["advice"]
    assert len(advice) > 3
    assert all(each["sentence"] in text for each in advice)


@pytest.mark.slow
def test_a_page_of_a_route_needs_no_folder(capfd: pytest.CaptureFixture[str], tmp_path: Path):
    page, route = tmp_path / "route.html", tmp_path / "route.json"
    one_move = msgspec.structs.replace(blocked(), moves=blocked().moves[:1])
    route.write_bytes(msgspec.json.encode(one_move))
    assert run_command_line(["route", str(route), "--html", str(page), "--json"]) == DONE
    found = result(capfd)
    assert found["files"] == {"page": str(page)}
    assert page.read_text("utf-8").count('"sentence":') == found["stages"]


@pytest.mark.slow
def test_the_page_of_a_route_says_what_helps_at_its_crux_and_how_sure_it_is(
    capfd: pytest.CaptureFixture[str], tmp_path: Path
):
    page = tmp_path / "route.html"
    asked = ["route", "six-moves", "--spread", "--html", str(page), "--json"]
    assert run_command_line(asked) == OVERLOADED
    (text,) = re.findall(r'id="data">(.*?)</script>', page.read_text("utf-8"))
    shown = json.loads(text)
    stages, crux = shown["stages"], result(capfd)["crux"]["stage"]
    assert shown["crux"] == crux
    assert all(stage["sure"] and stage["spread"] for stage in stages)
    assert [n for n, stage in enumerate(stages) if stage["advice"]] == [crux]
    assert run_command_line(["route", "six-moves", "--stage", str(crux), "--json"]) == OVERLOADED
    assert stages[crux]["sentence"] == result(capfd)["reason"]
    # planned, each of them
    best = stages[crux]["advice"][0]
    assert best["holds"]
    assert best["utilisation"] <= 1.0 < stages[crux]["utilisation"]


def test_pages_are_of_one_route_or_rock(capfd: pytest.CaptureFixture[str], tmp_path: Path):
    page = str(tmp_path / "route.html")
    for more in ([], ["--resume"], ["-o", str(tmp_path / "routes.csv")]):
        assert run_command_line(["route", "knobs", "knobs", "--html", page, *more]) == BAD_INPUT
        assert complaint(capfd).startswith("crux: --html: ")
    ends = ["--from", "height:0.8", "--to", "height:0.8"]
    asked = ["climb", "small-wall", *ends, "-o", str(tmp_path / "a.csv")]
    for more in (["--html", page], ["--spread"]):
        assert run_command_line([*asked, *more]) == BAD_INPUT
        assert complaint(capfd).startswith(f"crux: {more[0]}: ")
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
