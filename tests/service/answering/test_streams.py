"""Set-points by message, whatever found them."""

from __future__ import annotations

import json

import msgspec
import numpy as np

from service.answering import handle
from service.commands.stances import read_request
from tests.suite.problems import problem


def answered(key: str, request: dict) -> dict:
    return json.loads(
        handle(f"crux/robosimian/{key}", json.dumps({"v": 1, **request}).encode()).payload
    )


def test_set_points_of_a_stance_with_joints_are_told_with_their_gap():
    asked = problem("joints/given-0").request
    stream = {name: asked[name] for name in ("stance", "body_wrench", "load") if name in asked}
    declared = answered("stream", stream)
    assert "error" not in declared, declared
    wrench = np.array(declared["body_wrench"])
    for share in (1.0, 0.5, 1.4):
        asked = {"stream": declared["stream"], "body_wrench": (share * wrench).tolist()}
        reply = answered("set_points", asked)
        assert "error" not in reply, reply
        assert reply["gap"] >= 0.0


def kinds(reply: dict) -> list[str]:
    return [each["kind"] for each in reply.get("findings", [])]


def test_streams_doubt_the_wrenches_that_plans_doubt():
    request = msgspec.to_builtins(read_request("wall-300"))
    stance = {"stance": request["stance"]}
    for wrench, odd in (
        ([1.09, 0, 0, 0, -0.144, 0], ["unit"]),
        ([1082, 0, 0, 0, -144000, 0], ["unit"]),
        ([0, 0, 1082, 0, -144, 0], ["wrench_not_up"]),
        ([-1082, 0, 0, 0, 144, 0], ["wrench_not_up"]),
        ([1090, 0, 0, 0, -144, 0], []),
    ):
        asked = {**stance, "body_wrench": wrench}
        declared = answered("stream", asked)
        assert kinds(declared) == odd
        told = [each for each in answered("plan", asked)["findings"] if each["kind"] in odd]
        assert declared["findings"] == told
        query = {"stream": declared["stream"], "body_wrench": wrench}
        for detail in ("full", "set_points"):
            reply = answered("set_points", {**query, "detail": detail})
            assert reply.get("findings", []) == told
            assert ("findings" in reply) == bool(odd)
        assert len(json.dumps(reply)) < 2000
        # one odd wrench says nothing of the next
        assert "findings" not in answered(
            "set_points", {**query, "body_wrench": [1085, 0, 0, 0, -144, 0]}
        )


def test_a_declared_stance_is_told_what_is_odd_about_it_and_its_load():
    request = msgspec.to_builtins(read_request("wall-300"))
    reply = answered("stream", {"stance": request["stance"], "load": {"mass": 0.11}})
    assert [each["field"] for each in reply["findings"]] == ["load.mass"]
