"""Poses of a request in every form of orientation: the same plan; replies have quaternions."""

from __future__ import annotations

import copy
from typing import Any

import msgspec
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from planner.result import Advice
from service.answering import advised, questions, rewritten
from service.requests import PlanRequest, PoseMessage, RouteRequest
from service.wire import decode_request
from tests.suite.helpers.replies import reply_to
from tests.suite.helpers.requests import JSON, MSGPACK, wall_request

pytestmark = pytest.mark.filterwarnings("ignore:Gimbal lock")


def turned(message: Any, form: str) -> Any:
    """A message with all of its quaternions in another form."""
    if isinstance(message, list):
        return [turned(each, form) for each in message]
    if not isinstance(message, dict):
        return message
    rest = {name: turned(part, form) for name, part in message.items() if name != "orientation"}
    if "orientation" in message:
        rotation = Rotation.from_quat(message["orientation"])
        matrix = rotation.as_matrix()
        if form == "rpy":
            rest["rpy"] = rotation.as_euler("xyz").tolist()
        else:
            rest |= {"x_axis": (3.0 * matrix[:, 0]).tolist(), "z_axis": matrix[:, 2].tolist()}
    return rest


def with_placed_hold() -> dict[str, Any]:
    """The wall, with the hold of a hand at a pose in H."""
    request = wall_request()
    request["stance"]["hands"][0]["hold"]["pose_in_hand"] = {
        "position": [0.0, 0.0, 0.002],
        "orientation": [0.0, 0.0, 0.01, 0.99995],
    }
    return request


@pytest.mark.parametrize("form", ["rpy", "axes"])
@pytest.mark.parametrize("encoding", [JSON, MSGPACK])
def test_every_form_gives_the_same_plan(form, encoding):
    request = with_placed_hold()
    plain, other = (
        reply_to(message, encoding) for message in (request, turned(copy.deepcopy(request), form))
    )
    assert other.status == plain.status == "optimal"
    np.testing.assert_allclose(other.utilisation, plain.utilisation, rtol=1e-6)
    for one, two in zip(plain.hands, other.hands, strict=True):
        np.testing.assert_allclose(two.wrench, one.wrench, atol=1e-3)
        np.testing.assert_allclose(
            two.seating.pose.orientation, one.seating.pose.orientation, atol=1e-9
        )


def test_a_route_takes_other_forms_too():
    moves = [{**wall_request()["stance"]["hands"][0], "body": wall_request()["stance"]["body"]}]
    route = {"v": 1, "stance": wall_request()["stance"], "moves": moves}
    plain, other = (
        questions.route_of(decode_request(msgspec.json.encode(each), RouteRequest)).moves[0]
        for each in (route, turned(copy.deepcopy(route), "axes"))
    )
    np.testing.assert_allclose(other.hand.pose.rotation, plain.hand.pose.rotation, atol=1e-9)
    np.testing.assert_allclose(other.body.rotation, plain.body.rotation, atol=1e-9)


def test_advice_replaces_a_pose_whatever_its_form():
    text = msgspec.json.encode(turned(wall_request(), "axes"))
    request = decode_request(text, PlanRequest)
    pose = {"position": [0.1, 0.0, 0.0], "orientation": [0.0, 0.0, 0.0, 1.0]}
    changed = advised(
        request, Advice("body", [], "", {"stance.body": pose}, 1.0, "optimal", 0.5, None, True)
    )
    assert changed.stance.body == msgspec.convert(pose, PoseMessage)
    assert decode_request(rewritten(text, request, changed), PlanRequest) == changed
