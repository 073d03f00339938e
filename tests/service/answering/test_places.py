"""Hands of requests that are given by a place on the rock."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hand_models.base import InvalidInputError
from service.answering import answer_plan, answer_wrench_space, questions
from service.requests import WrenchSpaceRequest
from service.tables import console, print_plan
from service.wire import decode_request
from tests.suite.helpers.requests import plan_request, put, wall_request
from tests.suite.helpers.rocks import random_mesh

WALL = {"position": [0.3, -0.4, 0.7], "orientation": [0.5, 0.5, 0.5, 0.5]}
TURN = Rotation.from_quat(WALL["orientation"]).as_matrix()

NEAR = {"point": [0.002, -0.003, 0.0], "approach": [0.05, 0.0, 1.0], "wrist_angle": 0.2}
"""In the rock's frame."""


def placed(**place: Any) -> dict[str, Any]:
    """A request whose first hand has a place, on a mesh that stands in the world."""
    request: dict[str, Any] = wall_request()
    hand = request["stance"]["hands"][0]
    rock = random_mesh(np.random.default_rng(4)).triangles
    vertices, faces = rock.vertices.tolist(), rock.faces.tolist()
    hand["hold"] = {"shape": "mesh", "vertices": vertices, "faces": faces, "pose": WALL}
    hand["grasp"] = {"outer_rotation": 0.0}
    del hand["pose"]
    hand["place"] = {**NEAR, "frame": "rock", **place}
    return request


def in_world(up: list[float] | None = None) -> dict[str, Any]:
    point = TURN @ NEAR["point"] + WALL["position"]
    above = [0.0, 0.0, 1.0] if up is None else up
    return {
        "point": point.tolist(),
        "approach": (TURN @ NEAR["approach"]).tolist(),
        "frame": "world",
        **({} if up is None else {"up": above}),
    }


def test_the_reply_tells_the_pose_and_a_hand_given_by_it_is_the_same() -> None:
    request = placed()
    reply = answer_plan(plan_request(request))
    limb = request["stance"]["hands"][0]["limb"]
    assert set(reply.poses) == {limb}
    pose, seat = reply.poses[limb], reply.hands[0].seating
    # the rock stands where it was: H in W times the rock in H is the rock in W
    hand = Rotation.from_quat(pose.orientation)
    there = hand.apply(seat.pose.position) + pose.position
    np.testing.assert_allclose(there, WALL["position"], atol=1e-12)
    whole = hand * Rotation.from_quat(seat.pose.orientation)
    np.testing.assert_allclose(whole.as_matrix(), TURN, atol=1e-12)
    hand_request = request["stance"]["hands"][0]
    del hand_request["place"]
    hand_request["pose"] = {"position": pose.position, "orientation": pose.orientation}
    again = answer_plan(plan_request(request))
    assert again.utilisation == pytest.approx(reply.utilisation, rel=1e-6)
    np.testing.assert_allclose(again.hands[0].wrench, reply.hands[0].wrench, atol=1e-4)


def test_a_place_in_the_world_is_that_in_the_rock() -> None:
    up = (TURN @ [1.0, 0.0, 0.0]).tolist()
    here, there = (
        questions.question(plan_request(placed(**place))).stance.hands[0]
        for place in ({}, in_world(up))
    )
    np.testing.assert_allclose(here.pose.position, there.pose.position, atol=1e-9)
    np.testing.assert_allclose(here.pose.rotation, there.pose.rotation, atol=1e-9)


def test_in_the_world_the_hand_points_up_unless_told_otherwise() -> None:
    place = in_world() | {"wrist_angle": 0.0}
    hand = questions.question(plan_request(placed(**place))).stance.hands[0]
    x, y, z = hand.pose.rotation.T
    assert z @ place["approach"] == pytest.approx(np.linalg.norm(place["approach"]))
    assert y[2] == pytest.approx(0.0, abs=1e-12)
    assert x[2] > 0.0


@pytest.mark.slow
def test_a_wrench_space_and_a_best_seat_at_a_place() -> None:
    request = placed()
    hand = request["stance"]["hands"][0]
    hand["seat"] = "best"
    asked = {"v": 1, "stance": request["stance"], "limb": hand["limb"]}
    reply = answer_wrench_space(decode_request(msgspec.json.encode(asked), WrenchSpaceRequest))
    assert reply.seating.rule == "best"
    assert set(reply.poses) == {hand["limb"]}


def test_a_place_that_cannot_be_is_refused_by_name() -> None:
    for path, value, field in [
        (("place", "approach"), [0, 0, 0], "place.approach"),
        (("place", "approach"), [1, 0, 0], "place.approach"),
        (("place", "up"), [0.05, 0, 1], "place.approach"),
        (("pose",), WALL, "pose"),
        (("hold", "pose_in_hand"), WALL, "hold"),
    ]:
        request = put(placed(), ("stance", "hands", 0, *path), value)
        if path[0] == "hold":
            del request["stance"]["hands"][0]["hold"]["pose"]
            field = "hold.pose_in_hand"
        with pytest.raises(InvalidInputError) as caught:
            questions.question(plan_request(request))
        assert caught.value.field == f"stance.hands[0].{field}"


def test_a_plan_for_a_person_tells_where_hands_are(capsys: pytest.CaptureFixture[str]) -> None:
    reply = answer_plan(plan_request(placed()))
    print_plan(reply, console())
    x, *_ = reply.poses[reply.hands[0].limb].position
    assert f"front_right is at ({x:.4f}, " in capsys.readouterr().out


def test_an_angle_of_the_wrist_in_degrees_is_refused() -> None:
    for angle in [15.0, 30.0, 45.0, 57.3, 90.0, 180.0, 270.0, 360.0, -90.0, -45.0]:
        with pytest.raises(InvalidInputError) as caught:
            answer_plan(plan_request(placed(wrist_angle=angle)))
        assert caught.value.field == "stance.hands[0].place.wrist_angle"
        assert f"got {angle:g} rad: is it in degrees?" in caught.value.message


def test_more_than_a_turn_is_the_same_as_the_rest_of_it() -> None:
    poses = []
    for angle in (0.2, 0.2 + 2.0 * np.pi, 0.2 - 4.0 * np.pi + 2.0 * np.pi):
        reply = answer_plan(plan_request(placed(wrist_angle=angle)))
        poses.append(next(iter(reply.poses.values())))
    for pose in poses[1:]:
        np.testing.assert_allclose(pose.position, poses[0].position, atol=1e-9)
