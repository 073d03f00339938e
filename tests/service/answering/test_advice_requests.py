"""Advice taken as a request: hands that are new, let go, or copies of another."""

from __future__ import annotations

import msgspec
import pytest

from planner.result import Advice
from service.answering import advised
from service.commands.stances import read_request


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
