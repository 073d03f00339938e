"""Advice taken as a request: hands that are new, let go, or copies of another."""

from __future__ import annotations

import msgspec
import pytest

from planner.result import Advice
from service.answering import advised, rewritten
from service.commands.stances import read_request
from service.requests import PlanRequest
from service.wire import decode_request


def advice(**changes) -> Advice:
    return Advice("pair", [], "", changes["of"], 1.0, "optimal", 0.5, None, True)


@pytest.fixture
def request_():
    return read_request("wall-300")


def test_hands_are_counted_as_in_the_question(request_):
    limbs = [hand.limb for hand in request_.stance.hands]
    pose = msgspec.to_builtins(request_.stance.hands[0].pose)
    found = advised(
        request_,
        advice(
            of={
                "stance.hands[1]": None,
                "stance.hands[3].limb": limbs[3],
                "stance.hands[3]": "stance.hands[1]",
                "stance.hands[3].pose": pose,
            }
        ),
    )
    assert [hand.limb for hand in found.stance.hands] == [limbs[0], limbs[2], limbs[3]]
    assert found.stance.hands[2].hold == request_.stance.hands[1].hold
    assert msgspec.to_builtins(found.stance.hands[2].pose) == pose
    # the request itself is as it was
    assert [hand.limb for hand in request_.stance.hands] == limbs


def test_null_takes_a_field_away_and_a_part_that_is_missing_is_made(request_):
    bare = msgspec.structs.replace(request_, load=None, want=["advice", "prices"])
    found = advised(bare, advice(of={"load.mass": 90.0, "stance.hands[0].hold.pose": None}))
    assert found.load.mass == 90.0
    assert found.stance.hands[0].hold.pose is None
    assert found.want == ["prices"]


WRITTEN = b"""{"stance": {"hands": [
 {"hold": {"diameter": 0.30, "shape": "cylinder"}, "limb": "a", "surface": "rock",
  "pose": {"orientation": [0.70711, 0, 0.70711, 0], "position": [0, -0.450, 6e-1]},
  "grasp": {"lateral": true, "outer_rotation": 3.14159}},
 {"limb": "b", "pose": {"position": [0, 0.10, -0.6], "orientation": [1, 0, 0, 0]},
  "hold": {"shape": "plane"}, "surface": "rock"},
 {"limb": "c", "pose": {"position": [0, 1, 1.50], "orientation": [1, 0, 0, 0]},
  "hold": {"shape": "plane"}, "surface": {"shear_limit": 100, "friction": 0.40}}],
 "body": {"orientation": [0, -0.70711, 0, 0.70711], "position": [-0.450, 0, 0]}},
 "load": {"com": [0.1, 0, 0], "mass": 125}, "want": ["prices", "advice"], "id": "\xc3\xa4",
 "limits": {"utilisation": 1, "joint_torque": {"a": [80, 8e1]}}, "v": 1}"""


def test_a_request_is_written_anew_as_it_was_but_for_what_changes() -> None:
    for changes, edits in [
        ({}, []),
        ({"load.mass": 107.4}, [(b'"mass": 125', b'"mass": 107.4')]),
        ({"load.mass": 125.0}, []),
        ({"stance.hands[1].hold.shape": "plane"}, []),
        ({"stance.hands[0].grasp.outer_rotation": 0.5}, [(b"3.14159", b"0.5")]),
        ({"stance.hands[0].grasp.outer_rotation": 0.0}, [(b"3.14159", b"0.0")]),
        (
            {"stance.hands[1].grasp.outer_rotation": 0.5},
            [
                (
                    b'"plane"}, "surface": "rock"}',
                    b'"plane"}, "surface": "rock", "grasp": {"outer_rotation": 0.5}}',
                ),
            ],
        ),
        ({"stance.body.position": [-0.44, 0.0, 1e-17]}, [(b"[-0.450, 0, 0]", b"[-0.44, 0, 0]")]),
        (
            {"stance.body.orientation": [0.0, -(0.5**0.5), 0.0, 0.5**0.5]},
            [],
        ),
        (
            {"stance.body.orientation": [0.0, 0.5**0.5, 0.0, -(0.5**0.5)]},
            [],
        ),
        (
            {"stance.body.orientation": [0.0, 0.6, 0.0, 0.8]},
            [(b"[0, -0.70711, 0, 0.70711]", b"[0, 0.6, 0, 0.8]")],
        ),
        ({"stance.hands[2].surface.shear_limit": 110.0}, [(b"100,", b"110.0,")]),
        ({"limits.utilisation": 0.9}, [(b'"utilisation": 1', b'"utilisation": 0.9')]),
        ({"limits.joint_torque": {"a": [80.0, 90.0]}}, [(b"8e1", b"90.0")]),
        ({"stance.hands[1].pose.position": [0.0, 0.12, -0.6]}, [(b"0.10,", b"0.12,")]),
    ]:
        before = decode_request(WRITTEN, PlanRequest)
        after = advised(before, advice(of=changes))
        text = rewritten(WRITTEN, before, after)
        meant = WRITTEN.replace(b', "advice"]', b"]")
        for old, new in edits:
            assert meant.count(old) == 1
            meant = meant.replace(old, new)
        assert msgspec.json.format(text) == msgspec.json.format(meant)


def test_hands_that_stay_are_written_as_they_were() -> None:
    for changes, limbs in [
        ({"stance.hands[0]": None}, ["b", "c"]),
        ({"stance.hands[1]": None}, ["a", "c"]),
        ({"stance.hands[2]": None}, ["a", "b"]),
        (
            {"stance.hands[3]": "stance.hands[0]", "stance.hands[3].limb": "d"},
            ["a", "b", "c", "d"],
        ),
        (
            {
                "stance.hands[1]": None,
                "stance.hands[3]": "stance.hands[2]",
                "stance.hands[3].limb": "b",
                "stance.hands[3].pose.position": [0.0, 1.0, 2.0],
            },
            ["a", "c", "b"],
        ),
    ]:
        before = decode_request(WRITTEN, PlanRequest)
        after = advised(before, advice(of=changes))
        text = rewritten(WRITTEN, before, after)
        assert decode_request(text, PlanRequest) == msgspec.structs.replace(after, want=["prices"])
        stance = msgspec.json.decode(WRITTEN, type=dict[str, msgspec.Raw])["stance"]
        hands = msgspec.json.decode(stance, type=dict[str, msgspec.Raw])["hands"]
        given = msgspec.json.decode(hands, type=list[msgspec.Raw])
        was = {msgspec.json.decode(hand)["limb"]: bytes(hand) for hand in given}
        told = msgspec.json.decode(text)["stance"]["hands"]
        assert [hand["limb"] for hand in told] == limbs
        for limb in {*limbs} & {*was}:
            new = "stance.hands[3].limb" in changes and changes["stance.hands[3].limb"] == limb
            assert (was[limb] in text) == (not new)
