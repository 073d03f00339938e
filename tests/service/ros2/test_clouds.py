"""Rock of point clouds by ROS 2: what is refused, and what requests get."""

from __future__ import annotations

import json
import struct
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import zenoh

from hand_models.base import InvalidInputError, Pose
from service.ros2.clouds import ROCK_NAME, RosRock, cloud_points, make_rock
from service.ros2.definitions import package_folder
from service.ros2.messages import RosMessages
from service.ros2.settings import RosSettings
from tests.suite.helpers.patience import soon
from tests.suite.helpers.ros_peer import RosPeer

MESSAGES, PEER = RosMessages(), RosPeer(package_folder())
KIND = "sensor_msgs/msg/PointCloud2"
WALL = np.array(
    [(0.8, y, z) for y in np.arange(-0.2, 0.2, 0.01) for z in np.arange(-0.2, 0.2, 0.01)]
)


def cloud(points: np.ndarray, frame: str = "W", **other: Any) -> dict[str, Any]:
    """A cloud of float32 with an intensity between, in one row."""
    names = (("x", 0), ("y", 4), ("intensity", 8), ("z", 12))
    fields = [{"name": n, "offset": at, "datatype": 7, "count": 1} for n, at in names]
    data = b"".join(struct.pack("<ffff", x, y, 9.0, z) for x, y, z in points)
    stamp = {"sec": 0, "nanosec": 0}
    return {
        "header": {"stamp": stamp, "frame_id": frame},
        "height": 1,
        "width": len(points),
        "fields": fields,
        "is_bigendian": False,
        "point_step": 16,
        "row_step": 16 * len(points),
        "data": data,
        "is_dense": True,
    } | other


def decoded(message: dict[str, Any]) -> Any:
    return MESSAGES.types.decode(PEER.encode(KIND, message), KIND)


def sample(message: dict[str, Any]) -> Any:
    return SimpleNamespace(payload=zenoh.ZBytes(PEER.encode(KIND, message)))


def field(name: str, **other: int) -> dict[str, Any]:
    return {"name": name, "offset": 0, "datatype": 7, "count": 1} | other


def test_points_are_read_whatever_lies_between_them() -> None:
    points = np.array([[1.0, 2.0, 3.0], [4.0, np.nan, 6.0]])
    np.testing.assert_array_equal(cloud_points(decoded(cloud(points))), points)
    # two rows with filling, doubles, most significant byte first
    data = b"".join(struct.pack(">ddd", *row) + bytes(8) for row in points)
    places = [field(axis, offset=8 * i, datatype=8) for i, axis in enumerate("xyz")]
    rows = {"height": 2, "width": 1, "point_step": 24, "row_step": 32, "is_bigendian": True}
    other = cloud(points, fields=places, data=data, **rows)
    np.testing.assert_array_equal(cloud_points(decoded(other)), points)


@pytest.mark.parametrize(
    ("other", "words"),
    [
        ({"fields": [field("x"), field("y")]}, "fields: no z among x, y"),
        ({"fields": [field("x"), field("y"), field("z", datatype=2)]}, "z: 1 of datatype 2"),
        ({"fields": [field("x"), field("y", count=3), field("z")]}, "y: 3 of datatype 7"),
        ({"fields": [field("x", offset=13), field("y"), field("z")]}, "x: at 13"),
        ({"fields": []}, "fields: no x, y, z among none"),
        ({"width": 2}, "data: 16 bytes; 1 rows of 2 points"),
        ({"data": b"\x00" * 15}, "data: 15 bytes"),
        ({"height": 2}, "data: 16 bytes; 2 rows"),
    ],
)
def test_fields_and_sizes_that_do_not_fit_are_refused(other: dict[str, Any], words: str) -> None:
    with pytest.raises(InvalidInputError) as caught:
        cloud_points(decoded(cloud(WALL[:1], **other)))
    assert str(caught.value).startswith(words)


def test_a_refused_cloud_is_in_the_diagnostics_and_in_the_log(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    rock = RosRock("robot", MESSAGES)
    assert (rock.state().level, rock.state().message) == (0, "no cloud came yet")
    rock.take(sample(cloud(WALL, "lidar")))
    assert rock.state().level == 2
    assert "frame_id: 'lidar'; valid: W, or none, and B" in rock.state().message
    assert "frame_id: 'lidar'" in caplog.text
    monkeypatch.setattr("service.ros2.clouds.ROS_SETTINGS", RosSettings(cloud_bytes=1000))
    rock.take(sample(cloud(WALL)))
    assert "the maximum is 1000" in rock.state().message
    assert rock.placed_in(b'{"rock": "scan"}') == b'{"rock": "scan"}'
    rock.close()


def test_rock_stands_in_requests_where_it_was_seen() -> None:
    rock = RosRock("robot", MESSAGES)
    stance = {"body": {"position": [1, 2, 3], "rpy": [0.1, 0.2, 0.3]}, "hands": [{"hold": "scan"}]}
    asked = json.dumps({"v": 1, "stance": stance}).encode()

    def made(frame: str) -> bool:
        rock.take(sample(cloud(WALL, frame)))
        return soon(lambda: rock.state().values.get("frame") == frame)

    assert made("W")
    assert rock.state().level == 0
    assert rock.state().message.startswith(f"{ROCK_NAME}: 1,600 points, ")
    placed = json.loads(rock.placed_in(asked))
    assert placed["stance"]["hands"] == stance["hands"]
    mesh = placed["stance"]["rocks"]["scan"]
    frame = Pose.from_quaternion(mesh["pose"]["position"], mesh["pose"]["orientation"])
    corners = np.array([frame.apply(vertex) for vertex in mesh["vertices"]])
    np.testing.assert_allclose(corners[:, 0], 0.8, atol=1e-5)
    # z of the rock's frame goes into it, away from W's origin
    np.testing.assert_allclose(frame.rotation[:, 2], [1.0, 0.0, 0.0], atol=1e-5)
    climb = json.loads(rock.placed_in(b'{"v": 1, "rock": "scan"}'))
    assert climb["rock"] == mesh
    # what names its own, or none, stays as it is
    stance["rocks"] = {"scan": {"shape": "plane"}}
    own = json.loads(rock.placed_in(json.dumps({"stance": stance}).encode()))
    assert own["stance"]["rocks"] == stance["rocks"]
    for other in (b'{"v": 1}', b'{"scan', b'["scan"]', b'{"rock": "scan", "stance'):
        assert rock.placed_in(other) == other

    # seen from the body: it stands before wherever a request has the body
    del stance["rocks"]
    assert made("B")
    mesh = json.loads(rock.placed_in(asked))["stance"]["rocks"]["scan"]
    there = Pose.from_quaternion(mesh["pose"]["position"], mesh["pose"]["orientation"])
    turned = there.rotation @ frame.rotation.T
    np.testing.assert_allclose(there.position, [1, 2, 3] + turned @ frame.position, atol=1e-4)
    assert json.loads(rock.placed_in(b'{"v": 1, "rock": "scan"}')) == {"v": 1, "rock": "scan"}

    # the rock that is known stays when a cloud is none
    rock.take(sample(cloud(np.full((5, 3), np.nan))))
    assert soon(lambda: rock.state().level == 2)
    assert "points: 0 finite" in rock.state().message
    assert json.loads(rock.placed_in(asked))["stance"]["rocks"]["scan"] == mesh
    rock.close()


@pytest.mark.parametrize(
    ("most", "words"), [(400, " 5 mm apart"), (50, "rock of 0.01 m²; the max")]
)
def test_rock_of_many_points_is_thinned_and_too_much_refused(
    most: int, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("service.ros2.clouds.ROS_SETTINGS", RosSettings(rock_vertices=most))
    across = np.arange(-0.05, 0.05, 0.002)
    sent: list[Any] = []
    points = np.array([(0.8, y, z) for y in across for z in across])
    make_rock(SimpleNamespace(send=sent.append), points, "W")
    (made,) = sent
    if most == 50:
        assert made.startswith("rock of 0.0096 m²; the maximum is 0.005 m²: cut the cloud")
        return
    assert 0.5 * most < len(json.loads(made.vertices)) < 1.5 * most
