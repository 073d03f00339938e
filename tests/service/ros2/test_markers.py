"""Markers of plans: where palms, tiles and forces are drawn, and what is deleted."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np
import pytest

from service.answering import answer_plan
from service.replies import PlanReply
from service.ros2.definitions import package_folder
from service.ros2.markers import PlanMarkers
from service.ros2.messages import RosMessages
from service.ros2.settings import ROS_SETTINGS
from tests.suite.helpers.requests import HEAVY, plan_request, pose_of, wall_request
from tests.suite.helpers.ros_peer import RosPeer

MESSAGES, PEER = RosMessages(), RosPeer(package_folder())
KIND = "visualization_msgs/msg/MarkerArray"
ADD, DELETE = 0, 2


def drawn(markers: PlanMarkers, request: dict, reply: Any) -> dict[tuple[str, int], dict]:
    array = markers.draw(msgspec.json.encode(request), reply)
    read = PEER.decode(KIND, MESSAGES.types.encode(array))["markers"]
    assert {mark["header"]["frame_id"] for mark in read} == {"W"}
    found = {(mark["ns"], mark["id"]): mark for mark in read}
    assert len(found) == len(read)
    return found


def at(point: dict[str, float]) -> np.ndarray:
    return np.array([point[axis] for axis in "xyz"])


@pytest.fixture(scope="module")
def reply() -> PlanReply:
    found = answer_plan(plan_request())
    assert isinstance(found, PlanReply)
    return found


def test_every_tile_and_force_is_where_the_plan_has_it(reply: PlanReply) -> None:
    request = wall_request()
    marks = drawn(PlanMarkers(MESSAGES), request, reply)
    assert all(mark["action"] == ADD for mark in marks.values())
    assert marks["plan", 0]["text"].startswith(f"optimal, utilisation {reply.utilisation:.3f}\n")
    poses = {hand["limb"]: pose_of(hand["pose"]) for hand in request["stance"]["hands"]}
    count = 1
    for hand in reply.hands:
        pose = poses[hand.limb]
        palm = marks[f"{hand.limb}/palm", 0]["pose"]["position"]
        np.testing.assert_allclose(at(palm), pose.position)
        start, end = map(at, marks[f"{hand.limb}/hand_force", 0]["points"])
        pushed = pose.rotation @ -np.array(hand.wrench[:3])
        np.testing.assert_allclose(end - start, ROS_SETTINGS.force_scale * pushed, atol=1e-9)
        tiles = [tile for finger in hand.fingers for tile in finger.tiles]
        names = {key for key in marks if key[0] == f"{hand.limb}/tiles"}
        assert len(names) == len(tiles)
        for key, tile in zip(sorted(names), sorted(tiles, key=_order(hand)), strict=True):
            mark = marks[key]
            np.testing.assert_allclose(at(mark["pose"]["position"]), pose.apply(tile.position))
            # the redder, the more of its limit is used
            expected = min(1.0, 2.0 * tile.utilisation)
            assert mark["color"]["r"] == pytest.approx(expected, abs=1e-6)
            arrow = marks.get((f"{hand.limb}/forces", key[1]))
            assert (arrow is not None) == any(tile.force)
            if arrow is not None:
                start, end = map(at, arrow["points"])
                np.testing.assert_allclose(start, pose.apply(tile.position))
                force = ROS_SETTINGS.force_scale * pose.rotation @ np.array(tile.force)
                np.testing.assert_allclose(end - start, -force, atol=1e-9)
        count += len(tiles)
    assert len(marks) > count


def _order(hand: Any) -> Any:
    every = [id(tile) for finger in hand.fingers for tile in finger.tiles]
    return lambda tile: every.index(id(tile))


def test_what_a_plan_has_not_is_deleted_and_the_rest_keeps_its_name(reply: PlanReply) -> None:
    markers = PlanMarkers(MESSAGES)
    whole = drawn(markers, wall_request(), reply)
    again = drawn(markers, wall_request(), reply)
    assert whole.keys() == again.keys()
    brief = answer_plan(plan_request(wall_request(HEAVY) | {"detail": "hands", "explain": False}))
    assert brief.status == "overloaded"
    less = drawn(markers, wall_request(), brief)
    gone = {key for key, mark in less.items() if mark["action"] == DELETE}
    assert gone == {
        key for key in whole if key[0].rpartition("/")[2] in ("tiles", "forces", "palm_force")
    }
    assert less.keys() == whole.keys()
    # beyond a limit
    colors = [mark["color"] for key, mark in less.items() if key[0].endswith("/palm")]
    assert {"r": 1.0, "g": 0.0, "b": 1.0, "a": 1.0} in colors
    # deleted once
    assert drawn(markers, wall_request(), brief).keys() == whole.keys() - gone


def test_hands_without_a_pose_in_the_world_are_left_out(reply: PlanReply) -> None:
    request = wall_request()
    del request["stance"]["hands"][0]["pose"]
    limb = request["stance"]["hands"][0]["limb"]
    marks = drawn(PlanMarkers(MESSAGES), request, reply)
    limbs = {ns.partition("/")[0] for ns, _ in marks} - {"plan"}
    assert limbs == {hand.limb for hand in reply.hands} - {limb}
