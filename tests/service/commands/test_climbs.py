"""What comes out of a route: a trajectory, stances of its stages, pictures, and what fails."""

from __future__ import annotations

import dataclasses
import json
from itertools import pairwise
from pathlib import Path

import msgspec
import numpy as np
import pytest

import planner
from service.bulk import read_climb, read_climb_summary, read_trajectory
from service.commands.cli import run_command_line
from service.replies import ClimbFailureReply, KnotReply
from service.requests import RouteRequest
from tests.suite.helpers.climbs import blocked, climbed, failed, two_moves
from tests.suite.helpers.commands import BAD_INPUT, DONE, OVERLOADED, complaint, result

EXACT = {"rtol": 0.0, "atol": 1e-9}


def file_of(route: RouteRequest, folder: Path) -> str:
    path = folder / "route.json"
    path.write_bytes(msgspec.json.encode(route))
    return str(path)


@pytest.fixture(scope="module")
def written(tmp_path_factory, blank_pictures_of_all) -> Path:
    folder = tmp_path_factory.mktemp("climb")
    assert run_command_line(["route", file_of(two_moves(), folder), "-o", str(folder)]) == DONE
    return folder


def test_a_folder_has_all_of_a_climb(written):
    names = {path.name for path in written.iterdir()} - {"route.json"}
    pictures = {"margin.png", "climb.png", "support.png"}
    assert names - {"trajectory.parquet"} == pictures | {
        "stages.csv",
        "summary.json",
        "trajectory.jsonl",
        "stages",
    }
    assert sorted(path.name for path in (written / "stages").iterdir()) == [
        "00-start.json",
        "01-lift-front_left.json",
        "02-place-front_left.json",
        "03-shift-front_left.json",
        "04-lift-front_left.json",
        "05-place-front_left.json",
    ]
    assert read_trajectory(written) == [KnotReply.of(knot) for knot in climbed().climb.knots]
    knots, about = read_climb(written)
    assert len(knots) == about.climb.knots
    assert about.climb.rates == msgspec.structs.asdict(planner.ClimbSettings().complete())
    assert (about.route, about.robot, about.climb.failure) == ("two moves", "robosimian", None)


def test_the_summary_has_the_largest_utilisation_and_bound_of_every_move(written):
    moves = json.loads((written / "summary.json").read_text())["climb"]["moves"]
    knots = read_trajectory(written)
    assert [move["move"] for move in moves] == [0, 1, 2]
    assert np.isclose(sum(move["time"] for move in moves), knots[-1].time, **EXACT)
    for move in moves:
        own = [knot for knot in knots if knot.move == move["move"]]
        most = max(own, key=lambda knot: knot.utilisation)
        assert move["utilisation"] == most.utilisation
        assert move["limiting"] == msgspec.structs.asdict(most.limiting)
        assert move["bound"] == max((k.bound for k in own if k.bound is not None), default=None)
        assert move["knots"] == len(own)
        assert move["complete"]


@pytest.mark.parametrize("index", [1, 3])
def test_crux_plan_answers_a_stage_as_the_route_does(index, written, capfd):
    (file,) = (written / "stages").glob(f"{index:02d}-*.json")
    assert run_command_line(["plan", str(file), "--json", "-q"]) == DONE
    reply = result(capfd)
    plan = climbed().result.plans[index]
    assert np.isclose(reply["utilisation"], plan.utilisation, **EXACT)
    for told, hand in zip(reply["hands"], plan.hands, strict=True):
        tensions = [finger["tendon_tension"] for finger in told["fingers"]]
        assert np.allclose(tensions, hand.tensions, **EXACT)
        assert np.allclose(told["wrench"], hand.wrench, **EXACT)


def test_one_stage_is_shown_as_crux_plan_shows_it_and_written(written, tmp_path, capfd):
    route, file = str(written / "route.json"), tmp_path / "one.json"
    assert run_command_line(["route", route, "--stage", "1", "-o", str(file)]) == DONE
    shown = capfd.readouterr().out
    used = climbed().result.plans[1].utilisation
    assert f"OPTIMAL   utilisation {used:.3g}" in shown
    (whole,) = (written / "stages").glob("01-*.json")
    assert json.loads(file.read_bytes()) == json.loads(whole.read_bytes())
    assert run_command_line(["route", route, "--stage", "6"]) == BAD_INPUT
    assert "--stage: must be below 6, the number of stages, got 6" in complaint(capfd)
    assert run_command_line(["route", route, "--stage", "1", "-o", str(tmp_path)]) == BAD_INPUT
    assert "must end in .json with --stage" in complaint(capfd)
    assert run_command_line(["route", route, route, "--stage", "1"]) == BAD_INPUT
    assert "is for one route" in complaint(capfd)
    assert run_command_line(["route", route]) == BAD_INPUT
    assert "give -o DIR, --html FILE, or --stage K" in complaint(capfd)


@pytest.mark.usefixtures("blank_pictures")
def test_the_largest_change_of_a_tension_counts_between_knots(tmp_path, capfd):
    limits = planner.Limits(tension_change=8.0)
    route = msgspec.structs.replace(two_moves(), limits=limits, moves=two_moves().moves[:1])
    flags = ["-o", str(tmp_path), "--json"]
    assert run_command_line(["route", file_of(route, tmp_path), *flags]) == DONE
    knots = read_trajectory(tmp_path)
    steps = [
        np.abs(np.subtract(now.tensions, before.tensions)).max()
        for one, two in pairwise(knots)
        for before, now in zip(one.hands, two.hands, strict=True)
    ]
    assert 7.0 < max(steps) <= 8.0 + 1e-9
    (file,) = (tmp_path / "stages").glob("01-*.json")
    assert json.loads(file.read_bytes())["limits"].get("tension_change") is None


@pytest.mark.usefixtures("blank_pictures")
def test_a_climb_that_fails_says_where_and_why(tmp_path, capfd):
    out = tmp_path / "out"
    route = file_of(blocked(), tmp_path)
    # the route has no joints, so that its stages decide
    assert run_command_line(["route", route, "-o", str(out)]) == 0
    printed = capfd.readouterr().out
    assert max(map(len, printed.replace(str(tmp_path), "").splitlines())) <= 80
    words = " ".join(printed.split())
    assert "stages are planned without" in words
    failure = failed().climb.failure
    assert f"move 2 fails (shift): {failure.reason}" in words
    assert read_climb_summary(out).climb.failure == ClimbFailureReply.of(failure)
    # as far as it comes, and every stage is there as a stance
    assert read_trajectory(out)[-1].stage == 2
    assert len([*(out / "stages").iterdir()]) == len(failed().result.stages)
    moves = json.loads((out / "summary.json").read_text())["climb"]["moves"]
    assert [move["complete"] for move in moves] == [True, True]


def test_a_climb_that_fails_counts_if_the_route_has_joints():
    climb = failed().climb
    assert not climb.fails
    assert not climb.stage_joints
    start = dataclasses.replace(climb.route.start, joints="solve")
    climb = dataclasses.replace(climb, route=dataclasses.replace(climb.route, start=start))
    assert climb.fails
    assert [*climb.stage_joints] == [0, 1, 2]


def test_nothing_is_said_of_links_in_stages_that_a_climb_does_not_reach():
    """Their joints were solved for, for hands alone: no climb has this posture."""
    climb = failed().climb
    solved = dataclasses.replace(climb.route.start, joints="solve")
    route = dataclasses.replace(climb.route, start=solved, moves=climb.route.moves[:1])
    failure = planner.Failure(1, "unload", "front_left", "a finger jams")
    ended = dataclasses.replace(climb, route=route, knots=climb.knots[:1], failure=failure)

    def said(climb):
        plans = planner.evaluate(route, climb=climb).plans
        return [{each.kind for each in plan.findings} for plan in plans]

    assert said(None) == [
        {"link_in_rock"},
        {"link_in_rock", "palm_without_travel"},
        {"link_in_rock"},
    ]
    # the start is planned with the climb's joints, which are clear
    assert said(ended) == [set(), {"palm_without_travel"}, set()]


def test_what_is_wrong_is_said_once(tmp_path, capfd):
    """A route whose joints are wrong is no climb either, but that is not what has to be mended."""
    route = two_moves()
    start = msgspec.structs.replace(route.stance, joints={})
    given = [msgspec.structs.replace(route.moves[0], joints={"rear_left": [0.0] * 7})]
    path = file_of(msgspec.structs.replace(route, stance=start, moves=given), tmp_path)
    assert run_command_line(["route", path, "-o", str(tmp_path / "out")]) == BAD_INPUT
    words = complaint(capfd)
    assert words.count("crux: ") == 1
    assert "stance.joints: missing for" in words


@pytest.mark.slow
def test_the_bundled_climb_that_fails_is_no_success(tmp_path):
    assert run_command_line(["route", "knobs-blocked", "-o", str(tmp_path), "-q"]) == OVERLOADED


@pytest.mark.slow
def test_a_route_whose_moves_cannot_be_planned_is_evaluated_all_the_same(tmp_path, capfd):
    route = two_moves()
    hands = [msgspec.structs.replace(hand, wrist="compliant") for hand in route.stance.hands]
    stance = msgspec.structs.replace(route.stance, hands=hands, joints=None)
    moves = [msgspec.structs.replace(route.moves[0], wrist="compliant")]
    path = file_of(msgspec.structs.replace(route, stance=stance, moves=moves), tmp_path)
    out = tmp_path / "out"
    assert run_command_line(["route", path, "-o", str(out)]) in (DONE, OVERLOADED)
    said = capfd.readouterr()
    assert "no trajectory: stance.hands[0].wrist" in said.err
    assert not (out / "trajectory.jsonl").exists()
    assert len([*(out / "stages").iterdir()]) == 3
    assert "climb" not in json.loads((out / "summary.json").read_text())


@pytest.mark.slow
def test_old_stages_and_trajectories_do_not_stay(written, tmp_path, capfd):
    stages = tmp_path / "stages"
    stages.mkdir()
    (stages / "99-lift-front_left.json").write_text("{}")
    (stages / "own.json").write_text("{}")
    route = msgspec.structs.replace(two_moves(), moves=[])
    assert run_command_line(["route", file_of(route, tmp_path), "-o", str(tmp_path)]) == DONE
    assert sorted(path.name for path in stages.iterdir()) == ["00-start.json", "own.json"]
    assert len(read_trajectory(tmp_path)) == 1
