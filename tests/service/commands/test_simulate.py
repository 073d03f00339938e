"""The command ``crux simulate``."""

import json
from importlib import resources

import pytest
from PIL import Image

import planner
from service.commands.cli import run_command_line
from service.commands.stances import read_stance_or_route
from service.requests import PlanRequest, RouteRequest
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
    assert "m = 2.99 on rock (assumed)" in " ".join(said.split())
    assert "no tile and no palm slips" in said
    assert "new set-points at once after each slip" in said
    assert "all hold, tensions fixed" in said


@pytest.mark.slow
def test_a_picture_is_drawn(capfd, tmp_path):
    path = tmp_path / "slips.png"
    few = ("--draws", "30", "--replanned", "0", "--workers", "1")
    assert run_command_line(["simulate", "slab", *few, "--plot", str(path)]) == 0
    with Image.open(path) as picture:
        assert picture.width > 1000


@pytest.mark.slow
def test_a_picture_has_the_printed_numbers(capfd, tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(planner, "plot_survival", lambda *given: drawn.append(given))
    many = ("--draws", "30", "--replanned", "0", "--workers", "1", "--json")
    path = str(tmp_path / "slips.png")
    assert run_command_line(["simulate", "slab", *many, "--plot", path]) == 0
    said = result(capfd)
    ((found, curve, _, title),) = drawn
    assert title == "slab"
    assert dict(curve)[1.0] == found
    assert found.holds.probability == said["holds"]["probability"]
    assert [load for load, _ in curve] == sorted(load for load, _ in curve)


def test_a_stance_that_is_not_simulated_says_why(capfd):
    assert run_command_line(["simulate", "ledge", *FEW]) == 0
    assert "fingernails" in " ".join(capfd.readouterr().out.split())


@pytest.mark.parametrize(("option", "value"), [("--draws", "0"), ("--delay", "-1")])
def test_bad_options_are_refused(option, value, capfd):
    assert run_command_line(["simulate", "slab", option, value]) == 2
    assert option in complaint(capfd)


def short_route(tmp_path):
    """The bundled route's first move: three stages."""
    whole = json.loads((resources.files("service") / "examples/routes/six-moves.json").read_text())
    path = tmp_path / "climb.json"
    path.write_text(json.dumps(whole | {"moves": whole["moves"][:1]}))
    return str(path)


def test_a_file_with_moves_is_a_climb(capfd, tmp_path):
    picture = tmp_path / "climb.png"
    arguments = ["simulate", short_route(tmp_path), *FEW, "--plot", str(picture)]
    assert run_command_line([*arguments, "--json"]) == 0
    found = result(capfd)
    assert [stage["phase"] for stage in found["stages"]] == ["start", "lift", "place"]
    assert found["stages"][found["worst"]]["phase"] == "lift"
    for name, draws in (("holds", 60), ("replanned", 2)):
        assert found[name]["all_stages"]["draws"] == draws
        assert found[name]["all_stages"]["probability"] <= found[name]["least"]
        assert all(stage["survival"][name]["draws"] == draws for stage in found["stages"])
    with Image.open(picture) as drawn:
        assert drawn.width > 500


@pytest.mark.slow
def test_a_person_reads_one_row_a_stage_and_the_worst(capfd, tmp_path):
    few = ("--draws", "30", "--replanned", "0", "--workers", "1")
    assert run_command_line(["simulate", short_route(tmp_path), *few]) == 0
    said = capfd.readouterr().out
    assert "worst: 1 lift front_left" in said
    rows = [line.split()[:3] for line in said.splitlines()]
    assert ["1", "place", "front_left"] in rows
    assert "if each stage drew anew" in " ".join(said.split())


def test_a_climb_is_read_from_toml_and_by_its_name(tmp_path, capfd):
    path = tmp_path / "climb.toml"
    assert run_command_line(["new", "route", "-o", str(path)]) == 0
    assert isinstance(read_stance_or_route(str(path)), RouteRequest)
    assert isinstance(read_stance_or_route("six-moves"), RouteRequest)
    assert isinstance(read_stance_or_route("slab"), PlanRequest)
    capfd.readouterr()
    assert run_command_line(["simulate", "no-such"]) == 2
    said = complaint(capfd)
    assert "six-moves" in said
    assert "wall-300" in said
    path.write_text("moves = [")
    assert run_command_line(["simulate", str(path)]) == 2
    assert "TOML" in complaint(capfd)


def test_the_help_says_that_the_exit_status_is_the_plans(capfd):
    assert run_command_line(["simulate", "--help"]) == 0
    assert "that of the plan, however likely slips are" in " ".join(capfd.readouterr().out.split())


def test_a_plan_of_least_hazard_says_what_its_probability_counts(capfd, tmp_path):
    asked = json.loads((resources.files("service") / "examples/wall.json").read_text())
    path = tmp_path / "wall.json"
    path.write_text(json.dumps(asked | {"objective": "max_reliability"}))
    assert run_command_line(["plan", str(path)]) in {0, 3}
    said = " ".join(capfd.readouterr().out.split())
    assert "no tile slips (tiles alone, no common scatter) 0.25" in said


@pytest.mark.slow
def test_few_draws_are_replanned_no_more_often(capfd):
    run_command_line(["simulate", "slab", "--draws", "20", "--strength", "4", "--json"])
    survival = json.loads(capfd.readouterr().out)
    assert survival["replanned"]["draws"] == survival["holds"]["draws"] == 20
