"""Stances that would cost too much are refused before anything of them is worked out."""

from __future__ import annotations

import json
from typing import Any

import pytest

from hand_models.base import LimitError
from service import answering
from service.answering import dispatch
from service.requests import PlanRequest
from service.wire import decode_request
from tests.suite.helpers.requests import wall_request

KEYS = ("plan", "wrench_space", "body_space", "stream")


def of_half_planes(*counts: int, wrist: str = "fixed") -> dict[str, Any]:
    request: dict[str, Any] = wall_request()
    hands = request["stance"]["hands"]
    for hand, count in zip(hands, counts, strict=True):
        hand |= {"surface": {"shear_limit": 60.0, "half_planes": count}, "wrist": wrist}
    return request


def stance_of(request: dict[str, Any]) -> Any:
    return answering.stance(decode_request(json.dumps(request).encode(), PlanRequest).stance)


def test_half_planes_of_all_hands_are_bounded_together() -> None:
    limbs = len(wall_request()["stance"]["hands"])
    assert limbs == 4
    assert len(stance_of(of_half_planes(64, 64, 64, 64)).hands) == 4
    assert len(stance_of(of_half_planes(16, 16, 16, 16, wrist="floating")).hands) == 4
    with pytest.raises(LimitError, match="are 260 together") as caught:
        stance_of(of_half_planes(17, 16, 16, 16, wrist="floating"))
    assert caught.value.field == "stance.hands"


def test_a_service_says_which_limit_it_was() -> None:
    for key in KEYS:
        whole = of_half_planes(64, 64, 64, 64, wrist="floating")
        request = {"v": 1, "stance": whole["stance"]}
        if key == "wrench_space":
            request |= {"limb": request["stance"]["hands"][0]["limb"]}
        answer = dispatch.handle(f"crux/robosimian/{key}", json.dumps(request).encode())
        error = json.loads(answer.payload)["error"]
        assert (error["kind"], error["field"]) == ("limit", "stance.hands")
        assert "1024 together" in error["message"]
        assert "256" in error["message"]


def outline(points: int) -> list[list[float]]:
    return [[-0.5 + k / (points - 1), 0.0] for k in range(points)]


def test_points_of_all_profiles_are_bounded_together() -> None:
    request: dict[str, Any] = wall_request()
    first, *others = request["stance"]["hands"]
    names = ("outer_left", "inner_left", "inner_right", "outer_right")
    rock = {"shape": "profile", "profiles": dict.fromkeys(names, outline(3333))}
    for hand in (first, *others):
        hand["hold"] = {"shape": "rock", "rock": "ledge"}
    request["stance"]["rocks"] = {"ledge": rock}
    first["hold"] = {"shape": "profile", "points": outline(5)}
    request["stance"]["hands"] = [first, *others]
    assert 5 + 3 * 4 * 3333 == 40_001
    with pytest.raises(LimitError, match="40001 points together"):
        stance_of(request)
    first["hold"]["points"] = outline(4)
    assert len(stance_of(request).hands) == 4


def test_a_stance_has_sixteen_hands_at_most() -> None:
    request: dict[str, Any] = wall_request()
    request["stance"]["hands"] *= 5
    answer = dispatch.handle("crux/robosimian/plan", json.dumps(request).encode())
    assert not answer.good
    assert json.loads(answer.payload)["error"]["field"] == "stance.hands"
