"""Plans of less detail: the same numbers as the whole one's, in the room that was promised."""

from __future__ import annotations

import json
import random
from dataclasses import replace

import pytest

from planner import plan
from planner.deadline.clock import UNFINISHED_RESULTS
from planner.result import LimitName, Plan
from service import Planners
from service.answering import dispatch
from service.answering.answers import brief_plan_reply
from service.answering.questions import question
from service.commands.cli import run_command_line
from service.commands.stances import bundled, read_request
from service.replies import BriefPlanReply, PlanReply, SetPointsReply
from service.wire import Format
from tests.suite.helpers.replies import PLAN, departures
from tests.suite.helpers.requests import (
    HEAVY,
    compliant_request,
    plan_request,
    stream_request,
    wall_request,
)
from tests.suite.problems import problem, problems

MOST = {Format.JSON: 2000, Format.MSGPACK: 1000}
"""Bytes of the set-points of four hands, beside an id."""

DETAILS = ("set_points", "hands", "full")


def answered(request: dict, detail: str, form: Format = Format.JSON, key: str = PLAN) -> bytes:
    answer = dispatch.handle(key, form.encode(request | {"detail": detail}), form.value)
    assert answer.good, answer.payload
    return answer.payload


STATUSES = {"optimal": wall_request, "overloaded": lambda: wall_request(4.0 * HEAVY)}


@pytest.mark.parametrize("name", [*STATUSES, "joints", "infeasible"])
def test_less_detail_is_part_of_the_whole(name: str) -> None:
    others = {"joints": "joints/given-0", "infeasible": "infeasible/infeasible-4"}
    request = STATUSES[name]() if name in STATUSES else problem(others[name]).request
    request = request | {"want": ["load_factor"]}
    points, hands, full = (json.loads(answered(request, detail)) for detail in DETAILS)
    assert full["status"] == (name if name != "joints" else full["status"])
    assert {type(part) for part in (points, hands, full)} == {dict}
    assert departures("BriefPlanReply", points) == departures("BriefPlanReply", hands) == []
    same = ("v", "id", "status", "utilisation", "limiting", "verified", "unfinished")
    assert {*same, "reason", "hands"} == set(points)
    for brief in (points, hands):
        assert all(brief[field] == full[field] for field in same)
    for field in ("body_wrench", "load_factor", "joints", "warnings"):
        assert hands[field] == full[field]
    assert not {"certificate", "prices", "solver"} & set(hands)
    assert (points["hands"] is None) == (hands["hands"] is None) == (full["hands"] is None)
    for few, more, whole in zip(*(r["hands"] or () for r in (points, hands, full)), strict=True):
        assert set(few) == {"limb", "tensions", "winch_angle"}
        assert few.items() <= more.items()
        assert more["wrench"] == whole["wrench"]
        assert more["utilisation"] == whole["utilisation"]
        for ours, theirs in (
            ("tensions", "tendon_tension"),
            ("winch_angle", "winch_angle"),
            ("motor_torque", "motor_torque"),
            ("motor_current", "motor_current"),
        ):
            assert more[ours] == [finger[theirs] for finger in whole["fingers"]]


def largest(answer: Plan) -> Plan:
    """A plan with everything in it that can be long, as long as it can be."""
    chance = random.Random(3)
    whole = answer.hands
    if whole is not None:
        whole = tuple(
            replace(
                hand,
                tensions=hand.tensions * 0.0 - 10.0 ** chance.uniform(-300, -200),
                drives=hand.drives * 0.0 - 10.0 ** chance.uniform(-300, -200),
            )
            for hand in whole
        )
    names = [f"front_right outer_left proximal pull_off number {i}" for i in range(13)]
    return replace(
        answer,
        hands=whole,
        utilisation=1.2345678901234567e-101,
        limiting=LimitName(
            "front_right", "outer_right", "proximal", "palm_pressing_reversed", "limb1_joint7"
        ),
        reason="the rock is “too” smooth: " + ", ".join(names),
        warnings=tuple(names * 10),
        unfinished=tuple(UNFINISHED_RESULTS),
    )


def test_set_points_are_small_whatever_the_status() -> None:
    for status in ["optimal", "overloaded", "infeasible", "failed"]:
        answer = largest(replace(plan(question(plan_request())), status=status))
        for each in (answer, replace(answer, hands=None)):
            for name in (None, "8f14e45f-ceea-467f-a0e6-1d2b3c4d5e6f"):
                reply = brief_plan_reply(each, name, hands=False)
                assert reply.reason.endswith("…")
                for form, most in MOST.items():
                    assert len(form.encode(reply)) < most, (form, reply)


def check_small(requests: list[dict]) -> None:
    for request in requests:
        assert_small(answered(request, "set_points"))


def assert_small(payload: bytes) -> None:
    """In either form."""
    reply = Format.JSON.decode(payload, BriefPlanReply)
    for form, most in MOST.items():
        assert len(form.encode(reply)) < most


def test_set_points_of_bundled_stances_are_small() -> None:
    slow = ("wall-300-floating", "boulders")
    check_small([_bundled(name) for name in bundled() if name not in slow])


def _bundled(name: str) -> dict:
    return json.loads(Format.JSON.encode(read_request(name)))


@pytest.mark.slow
def test_set_points_of_the_suites_plans_are_small() -> None:
    asked = [each.request for each in problems() if "plan" in each.ask and not each.slow]
    answers = [
        dispatch.handle(PLAN, Format.JSON.encode(request | {"detail": "set_points"}))
        for request in asked
        if len(request["stance"]["hands"]) <= 4
    ]
    good = [answer.payload for answer in answers if answer.good]
    assert len(good) > 200
    for payload in good:
        assert_small(payload)
    check_small([_bundled("wall-300-floating"), _bundled("boulders")])


@pytest.mark.parametrize("form", Format)
def test_streams_tell_as_much_as_is_asked_for(form: Format) -> None:
    declared = form.decode(
        dispatch.handle(
            "crux/robosimian/stream", form.encode(stream_request(id="s")), form.value
        ).payload,
        dict,
    )
    assert declared["id"] == "s"
    asked = {"v": 1, "id": "p", "stream": declared["stream"]}
    asked |= {"body_wrench": declared["body_wrench"]}
    key = "crux/robosimian/set_points"
    payloads = {detail: answered(asked, detail, form, key) for detail in DETAILS}
    few, hands, full = (form.decode(payloads[detail], dict) for detail in DETAILS)
    assert [set(h) for h in few["hands"]] == [{"limb", "tensions", "winch_angle"}] * 4
    assert len(payloads["set_points"]) < MOST[form]
    assert form.decode(payloads["set_points"], SetPointsReply).id == "p"
    assert hands["hands"] == full["hands"]
    for less, more in zip(few["hands"], full["hands"], strict=True):
        assert less.items() <= more.items()


@pytest.mark.parametrize("form", Format)
@pytest.mark.parametrize("known", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_a_stream_of_compliant_wrists_says_where_limbs_aim(form: Format, known: bool) -> None:
    request = compliant_request()
    if not known:
        del request["stance"]["limb_stiffness"]
    payload = form.encode(stream_request(request))
    answer = dispatch.handle("crux/robosimian/stream", payload, form.value)
    declared = form.decode(answer.payload, dict)
    assert declared["radius"] is None
    asked = {"v": 1, "stream": declared["stream"], "body_wrench": declared["body_wrench"]}
    key, aims = "crux/robosimian/set_points", "pose_target" if known else "twist"
    payloads = {detail: answered(asked, detail, form, key) for detail in DETAILS}
    few, _, full = (form.decode(payloads[detail], dict) for detail in DETAILS)
    assert len(payloads["set_points"]) < MOST[form]
    assert [set(h) for h in few["hands"]] == [{"limb", "tensions", "winch_angle", aims}] * 4
    for less, more in zip(few["hands"], full["hands"], strict=True):
        assert less.items() <= more.items()
        assert ("pose_target" in more) == known
    plan = form.decode(answered({"v": 1} | stream_request(request), "hands", form), dict)
    for ours, theirs in zip(full["hands"], plan["hands"], strict=True):
        for name in ("tensions", "winch_angle", "twist", *(["pose_target"] if known else [])):
            assert ours[name] == pytest.approx(theirs[name], rel=1e-6, abs=1e-9)


def test_a_streams_winches_stand_where_a_plans_do() -> None:
    for name in ["wall-300", "wall-300-joints", "ledge"]:
        request = _bundled(name)
        plan = json.loads(answered({"v": 1} | stream_request(request), "hands"))
        payload = Format.JSON.encode(stream_request(request))
        declared = json.loads(dispatch.handle("crux/robosimian/stream", payload).payload)
        asked = {"v": 1, "stream": declared["stream"], "body_wrench": plan["body_wrench"]}
        points = json.loads(answered(asked, "full", key="crux/robosimian/set_points"))
        for ours, theirs in zip(points["hands"], plan["hands"], strict=True):
            assert ours["tensions"] == pytest.approx(theirs["tensions"], rel=1e-4)
            assert ours["winch_angle"] == pytest.approx(theirs["winch_angle"], rel=1e-5)


@pytest.mark.parametrize("detail", DETAILS)
def test_the_command_line_prints_what_is_asked_for_and_a_person_gets_all(
    detail: str, tmp_path, capfd
) -> None:
    path = tmp_path / "stance.json"
    path.write_text(json.dumps(wall_request() | {"detail": detail}))
    assert run_command_line(["plan", str(path), "--json"]) == 0
    reply = json.loads(capfd.readouterr().out)
    assert ("solver" in reply) == ("load_factor_without_palm" in reply) == (detail == "full")
    assert ("wrench" in reply["hands"][0]) == (detail != "set_points")
    assert run_command_line(["plan", str(path)]) == 0
    assert "tendons and their motors" in capfd.readouterr().out
    lines = tmp_path / "lines.jsonl"
    lines.write_text(json.dumps(wall_request() | {"detail": detail}) + "\n")
    assert run_command_line(["batch", str(lines), "--json"]) == 0
    reply = json.loads(capfd.readouterr().out)
    assert ("solver" in reply) == (detail == "full")


def test_planners_read_each() -> None:
    asked = [plan_request(wall_request() | {"detail": detail}) for detail in DETAILS]
    kinds = [BriefPlanReply, BriefPlanReply, PlanReply]
    with Planners(1) as planners:
        assert [type(reply) for reply in planners.plan_many(asked)] == kinds
