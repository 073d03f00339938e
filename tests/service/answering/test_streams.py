"""Set-points by message, whatever found them."""

from __future__ import annotations

import json

import numpy as np

from service.answering import handle
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
