"""A request for a climb that is wrong is refused, by its field, before anything is searched."""

from __future__ import annotations

import copy
from typing import Any

import msgspec
import pytest

from service.requests import CancelRequest, ClimbRequest
from service.wire import decode_request
from tests.suite.helpers.replies import departures, refusal

CLIMB = "crux/robosimian/climb"

POSE = {"position": [0.0, 0.0, 1.0], "orientation": [0.0, 0.0, 0.0, 1.0]}
LIMBS = ("front_right", "rear_right", "rear_left", "front_left")
STANCE = {"body": POSE, "hands": [{"limb": limb, "pose": POSE} for limb in LIMBS]}


def climb_request(**more: Any) -> dict[str, Any]:
    asked = {"v": 1, "rock": "leaning-wall:3", "start": {"height": 0.8}, "goal": {"height": 2.5}}
    return copy.deepcopy(asked | more)


def test_a_request_is_of_its_schema() -> None:
    triangle = {
        "shape": "mesh",
        "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
        "faces": [[0, 1, 2]],
    }
    for asked in (
        climb_request(),
        climb_request(start=STANCE, goal={"near": [0, 0, 2], "radius": 0.5}, parts=True),
        climb_request(rock=triangle | {"pose": POSE}, want=["trajectory", "certificate"]),
        climb_request(places={"spacing": 0.2}, bodies={"tilts": [0.0, 0.2]}, at_least=1.0),
    ):
        assert departures("ClimbRequest", asked) == []
        assert decode_request(msgspec.json.encode(asked), ClimbRequest).v == 1
    assert departures("CancelRequest", {"v": 1, "id": "mine"}) == []
    assert decode_request(b'{"v": 1, "id": "mine"}', CancelRequest).id == "mine"


@pytest.mark.parametrize(
    ("more", "field", "words"),
    [
        ({"start": {}}, "start.near", "give one of near, height, or body and hands; got none"),
        ({"goal": {"near": [0, 0, 1], "height": 2}}, "goal.height", "got near and height"),
        ({"start": STANCE | {"height": 1.0}}, "start.body", "got height and body"),
        ({"start": {"body": POSE}}, "start.hands", "missing; a stance has a body and a hand"),
        ({"start": {"hands": STANCE["hands"]}}, "start.body", "missing"),
        ({"start": STANCE | {"hands": STANCE["hands"][:3]}}, "start.hands", "one hand of each of"),
        ({"start": {"hight": 1.0}}, "start.hight", "unknown field; known are near, radius, height"),
        ({"goal": {"height": "up"}}, "goal.height", "expected"),
        ({"goal": {"near": [0, 0, 1], "radius": 0}}, "goal.radius", "expected a number > 0"),
        ({"rock": "no-wall"}, "rock", "unknown wall 'no-wall'; known are "),
        ({"rock": "leaning-wall:x"}, "rock", "matching regex"),
        ({"rock": "/etc/passwd"}, "rock", "matching regex"),
        ({"rock": {"shape": "mesh", "file": "rock.stl"}}, "rock.file", "only the command line"),
        ({"rock": {"shape": "mesh"}}, "rock.vertices", "missing; give vertices and faces"),
        (
            {"rock": {"shape": "mesh", "pose_in_hand": POSE}},
            "rock.pose_in_hand",
            "give the rock's pose in W",
        ),
        ({"surface": "ice"}, "surface", "unknown"),
        ({"robot": "spot"}, "robot", "unknown robot 'spot'; known are robosimian"),
        ({"best_within": -0.1}, "best_within", "expected a number >= 0"),
        ({"at_least": 0.0}, "at_least", "expected a number > 0"),
        ({"time": 601}, "time", "expected a number <= 600"),
        ({"want": ["film"]}, "want[0]", "valid: certificate, trajectory"),
        ({"places": {"spacing": 0.0}}, "places.spacing", "expected a number >= 0.005"),
        ({"bodies": {"stand_offs": []}}, "bodies.stand_offs", "expected"),
        ({"stance": {}}, "stance", "unknown field; known are"),
    ],
)
def test_what_is_wrong_is_told_by_its_field(more: dict, field: str, words: str) -> None:
    kind, at, message = refusal(climb_request(**more), CLIMB)
    assert (kind, at) == ("invalid", field), message
    assert words in message


def test_a_climb_without_rock_or_ends_is_refused() -> None:
    for name in ("rock", "start", "goal"):
        asked = climb_request()
        del asked[name]
        kind, field, message = refusal(asked, CLIMB)
        assert (kind, field) == ("invalid", name)
        assert message.startswith("missing")
