"""Requests that want no explanation, through the service and the command line."""

from __future__ import annotations

import json

import msgspec

from planner.route.climb import stages
from service.answering import dispatch, questions
from service.commands.cli import run_command_line
from service.requests import RouteRequest
from service.wire import decode_request
from tests.suite.helpers.commands import OVERLOADED, result
from tests.suite.helpers.replies import PLAN, departures
from tests.suite.helpers.requests import HEAVY, wall_request

SAME = ("status", "utilisation", "limiting", "hands", "prices", "load_factor", "unfinished")


def answered(request: dict) -> dict:
    return json.loads(dispatch.handle(PLAN, msgspec.json.encode(request)).payload)


def test_a_reply_without_explanation_is_the_same_but_for_its_certificate():
    request = wall_request(HEAVY)
    whole, alone = answered(request), answered(request | {"explain": False})
    assert departures("PlanReply", alone) == []
    assert alone["status"] == "overloaded"
    assert whole["certificate"] is not None
    assert alone["certificate"] is None
    for field in SAME:
        assert alone[field] == whole[field], field
    assert whole["reason"].startswith(alone["reason"])
    assert answered(request | {"explain": True})["certificate"] == whole["certificate"]


def test_explain_is_true_or_false():
    for value in [0, None, "no"]:
        error = answered(wall_request() | {"explain": value})["error"]
        assert (error["kind"], error["field"]) == ("invalid", "explain")


def test_the_command_line_leaves_it_out_of_a_plan(tmp_path, capfd):
    path = tmp_path / "stance.json"
    path.write_text(json.dumps(wall_request(HEAVY)))
    assert run_command_line(["plan", str(path), "--json", "--no-explain"]) == OVERLOADED
    assert result(capfd)["certificate"] is None
    assert run_command_line(["plan", str(path), "--json"]) == OVERLOADED
    assert result(capfd)["certificate"] is not None
    assert run_command_line(["plan", str(path), "--no-explain", "-q"]) == OVERLOADED
    assert "leave no balance" not in capfd.readouterr().out


def test_the_command_line_leaves_it_out_of_all_lines(tmp_path, capfd):
    heavy = wall_request(HEAVY)
    lines = [heavy | {"id": "a"}, heavy | {"id": "b", "explain": True}, {"v": 1, "id": "c"}]
    path = tmp_path / "requests.jsonl"
    path.write_text("\n".join(map(json.dumps, lines)) + "\n{")
    run_command_line(["batch", str(path), "--workers", "1", "--json"])
    told = list(map(json.loads, capfd.readouterr().out.splitlines()))
    run_command_line(["batch", str(path), "--workers", "1", "--json", "--no-explain"])
    alone = list(map(json.loads, capfd.readouterr().out.splitlines()))
    assert [each["id"] for each in alone] == ["a", "b", "c", None]
    for whole, mine in zip(told[:2], alone[:2], strict=True):
        assert whole["certificate"] is not None
        assert mine["certificate"] is None
        assert mine["status"] == whole["status"] == "overloaded"
    # what is no request is told as ever
    assert alone[2:] == told[2:]


def test_every_stance_of_a_route_is_asked_alike():
    stance = wall_request()["stance"]
    move = stance["hands"][0]
    request = {"v": 1, "stance": stance, "moves": [move]}
    for explain in (True, False):
        asked = decode_request(msgspec.json.encode(request | {"explain": explain}), RouteRequest)
        asked_of = [each.question for each in stages(questions.route_of(asked))]
        assert [each.explain for each in asked_of] == [explain] * 3
