"""Hands placed by contact in requests: replies have their poses, which may be given instead."""

from __future__ import annotations

import json
from typing import Any

import msgspec
import numpy as np
import pytest

from hand_models.base import Pose, turns_about
from planner import plan
from service.answering import advised, handle, question
from service.commands.stances import read_request
from service.requests import PlanRequest
from tests.suite.helpers.requests import pose_of

TURNED = Pose(np.array([0.3, -0.2, 0.5]), turns_about([0.2, -0.4, 1.1]))
"""Another world frame, in W."""

OFFSET = [0.0005, 0.0, -0.0007, 0.0, 0.004, 0.0]


def request_of(name: str = "wall-300", limbs: int = 4, **fields: Any) -> dict[str, Any]:
    """A bundled stance whose first hands are placed by contact."""
    request: dict[str, Any] = json.loads(msgspec.json.encode(read_request(name)))
    for hand in request["stance"]["hands"][:limbs]:
        hand |= {"placing": "contact"}
    return request | {"want": ["load_factor"]} | fields


def reply_to(request: dict[str, Any], key: str = "plan") -> dict[str, Any]:
    found: dict[str, Any] = json.loads(
        handle(f"crux/robosimian/{key}", json.dumps(request).encode()).payload
    )
    return found


def message(pose: Pose) -> dict[str, list[float]]:
    return {"position": pose.position.tolist(), "orientation": pose.quaternion().tolist()}


def space_of(request: dict[str, Any], **fields: Any) -> dict[str, Any]:
    asked = {"v": 1, "stance": request["stance"], "limb": "front_right"}
    return reply_to(asked | fields, "wrench_space")


@pytest.mark.parametrize("offset", [None, OFFSET], ids=["at rest", "off it"])
def test_the_poses_of_the_reply_may_be_given_in_its_place(offset: list[float] | None) -> None:
    request = request_of()
    for hand in request["stance"]["hands"]:
        hand |= {"contact_offset": offset}
    decoded = msgspec.convert(request, PlanRequest)
    assert msgspec.json.decode(msgspec.json.encode(decoded), type=PlanRequest) == decoded
    reply = reply_to(request)
    seat = space_of(request)["seating"]
    assert seat["rule"] == "contact"
    start = space_of(request_of(limbs=0))["seating"]["pose"]
    for hand in request["stance"]["hands"]:
        # the rock stays where it is under the given pose
        rock = pose_of(hand["pose"]) @ pose_of(start)
        del hand["placing"], hand["contact_offset"]
        hand["pose"] = reply["poses"][hand["limb"]]
        hand["hold"] |= {"pose": message(rock)}
        seen = pose_of(hand["pose"]).inverse() @ rock
        np.testing.assert_allclose(seen.position, seat["pose"]["position"], atol=1e-9)
    again = reply_to(request)
    assert "poses" not in again
    assert again["status"] == reply["status"]
    assert again["utilisation"] == pytest.approx(reply["utilisation"], rel=1e-6)
    assert again["load_factor"] == pytest.approx(reply["load_factor"], rel=1e-6)


def test_a_hand_rests_deeper_and_a_fixed_wrist_has_less_there() -> None:
    """0.72 mm on 300 mm, where a fixed hand is a poor stand: the seat is an offset from it."""
    request = request_of(limbs=4)
    reply, seated = reply_to(request), reply_to(request_of(limbs=0))
    for hand in request["stance"]["hands"]:
        moved = pose_of(hand["pose"]).inverse() @ pose_of(reply["poses"][hand["limb"]])
        assert moved.position == pytest.approx([0.0, 0.0, 0.72e-3], abs=1e-5)
        hand["contact_offset"] = [0.0, 0.0, -0.72e-3, 0.0, 0.0, 0.0]
    assert reply["load_factor"] < 0.6 < seated["load_factor"]
    assert reply_to(request)["load_factor"] == pytest.approx(seated["load_factor"], abs=0.01)


def test_in_another_world_the_hands_rest_on_the_same_places() -> None:
    request = request_of(limbs=2)
    reply = reply_to(request)
    request["stance"]["gravity"] = (TURNED.rotation @ [0.0, 0.0, -9.81]).tolist()
    request["stance"]["body"] = message(TURNED @ pose_of(request["stance"]["body"]))
    for hand in request["stance"]["hands"]:
        hand["pose"] = message(TURNED @ pose_of(hand["pose"]))
    moved = reply_to(request)
    assert list(moved["poses"]) == list(reply["poses"]) == ["front_right", "rear_right"]
    for limb, pose in reply["poses"].items():
        expected = TURNED @ pose_of(pose)
        there = pose_of(moved["poses"][limb])
        np.testing.assert_allclose(there.position, expected.position, atol=1e-6)
        np.testing.assert_allclose(there.rotation, expected.rotation, atol=1e-5)
    assert moved["load_factor"] == pytest.approx(reply["load_factor"], rel=1e-3)


def test_a_place_on_a_rock_is_where_contact_begins() -> None:
    request = request_of(limbs=0)
    first = request["stance"]["hands"][0]
    posed = {"shape": "cylinder", "diameter": 0.3, "pose": first["pose"]}
    del first["pose"]
    place = {"point": [0.0, -0.45, 0.6], "approach": [1.0, 0.0, 0.0]}
    first |= {"hold": posed, "place": place}
    seated = pose_of(reply_to(request)["poses"]["front_right"])
    first["placing"] = "contact"
    rest = pose_of(reply_to(request)["poses"]["front_right"])
    moved = seated.inverse() @ rest
    assert moved.position == pytest.approx([0.0, 0.0, 0.72e-3], abs=3e-5)


@pytest.mark.parametrize(
    ("hand", "field", "why"),
    [
        ({"placing": "given", "contact_offset": OFFSET}, "contact_offset", "placed by contact"),
        ({"hold": {"shape": "plane"}, "grasp": {}}, "placing", "comes to rest nowhere"),
        ({"hold": {"shape": "plane"}, "grasp": {"fingernail": True}}, "placing", "fingernail"),
        ({"contact_offset": [0.0, 0.0, 0.04, 0.0, 0.0, 0.0]}, "contact_offset", "inside"),
    ],
)
def test_what_cannot_be_placed_by_contact_is_refused_by_name(
    hand: dict[str, Any], field: str, why: str
) -> None:
    request = request_of(limbs=2)
    request["stance"]["hands"][1] |= hand
    error = reply_to(request)["error"]
    assert error["kind"] == "invalid"
    assert error["field"].startswith(f"stance.hands[1].{field}")
    assert why in error["message"]


@pytest.mark.slow
@pytest.mark.usefixtures("few_places")
def test_robust_says_what_contact_leaves_and_that_each_number_is_planned_anew() -> None:
    request = request_of(want=["load_factor", "robust"])
    for hand in request["stance"]["hands"]:
        hand["contact_offset"] = [0.0, 0.0, -0.72e-3, 0.0, 0.0, 0.0]
    contact = reply_to(request)["robust"]
    given = reply_to(request_of(limbs=0, want=["load_factor", "robust"]))["robust"]
    for each in (contact, given):
        assert (each["position"], each["angle"]) == (0.002, 0.02)
        names = ("tenth", "tenth_interval", "hundredth", "hundredth_interval")
        assert each["replanned"] == {name: each[name] for name in names}
    assert (contact["contact_position"], contact["contact_angle"]) == (0.00025, 0.003)
    assert given["contact_position"] is given["contact_angle"] is None
    assert contact["replanned"]["hundredth"] > given["replanned"]["tenth"]
    alone = space_of(request, want=["robust"])["robust"]
    assert (alone["contact_position"], alone["contact_angle"]) == (0.00025, 0.003)


@pytest.mark.slow
def test_advice_on_hands_placed_by_contact_keeps_its_word() -> None:
    request = msgspec.convert(request_of(want=["advice"]), PlanRequest)
    answer = plan(question(request))
    assert answer.advice
    for each in answer.advice:
        again = plan(question(advised(request, each)))
        assert again.utilisation == pytest.approx(each.utilisation, rel=1e-4)
