"""Diagnosis over the wire: the tile that is named, and what is refused."""

from __future__ import annotations

import msgspec
import pytest

import planner
from service.answering import dispatch, question
from service.replies import DiagnosisReply
from service.wire import Format
from tests.suite.helpers.replies import departures, refusal
from tests.suite.helpers.requests import JSON, MSGPACK, plan_request, wall_request

DIAGNOSIS = "crux/robosimian/diagnosis"


def slipped_request() -> tuple[dict, planner.SlipDiagnosis]:
    """The wall's stance, of which the most used tile has slipped, with winches that stood still."""
    asked = question(plan_request())
    answer = planner.plan(asked)
    diagnosis = planner.SlipDiagnosis(planner.prepare_stance(asked), answer.hands)
    lost = max(diagnosis.signatures, key=lambda each: each.use)
    tensions = {hand.limb: hand.tensions.tolist() for hand in answer.hands}
    tensions[lost.tile.limb][lost.finger] = lost.tensions[0]
    known = {name: wall_request()[name] for name in ("v", "id", "stance", "load")}
    return known | {"tensions": tensions}, diagnosis


@pytest.mark.parametrize("form", [JSON, MSGPACK])
def test_the_tile_that_has_slipped_is_named(form: str) -> None:
    request, diagnosis = slipped_request()
    encode = msgspec.msgpack.encode if form == MSGPACK else msgspec.json.encode
    answer = dispatch.handle(DIAGNOSIS, encode(request), form)
    assert answer.good, answer.payload
    reply = Format.named(answer.encoding).decode(answer.payload, DiagnosisReply)
    found = diagnosis.diagnose(tensions=request["tensions"])
    assert (reply.id, reply.seen) == ("wall", True)
    assert tuple(reply.suspects) == found.suspects
    lost = max(diagnosis.signatures, key=lambda each: each.use).tile
    assert reply.suspects[0] == lost
    first, (tile, *numbers) = reply.tiles[0], found.tiles[0]
    assert (first.limb, first.finger, first.phalanx) == (tile.limb, tile.finger, tile.phalanx)
    assert [first.probability, first.expected] == pytest.approx(numbers)
    assert len(reply.tiles) == len(diagnosis.signatures)
    assert [tuple(pair) for pair in reply.ambiguous] == list(diagnosis.ambiguous(held=True))
    assert departures("DiagnosisRequest", request) == []
    assert departures("DiagnosisReply", msgspec.to_builtins(reply)) == []


def test_the_suspects_are_what_set_points_take_as_lost() -> None:
    request, diagnosis = slipped_request()
    suspects = diagnosis.diagnose(tensions=request["tensions"]).suspects
    with planner.WrenchStream(question(plan_request())) as stream:
        points = stream.set_points(stream.first, suspects[:1])
    assert points.verified
    assert tuple(points.lost) == suspects[:1]


def test_what_cannot_be_diagnosed_is_refused() -> None:
    request, _ = slipped_request()
    kind, field, message = refusal(request | {"tensions": {}}, DIAGNOSIS)
    assert (kind, field) == ("invalid", "tensions")
    assert "one of tensions, currents, turns is needed" in message
    both = request | {"turns": {"front_left": [0.0] * 4}}
    assert refusal(both, DIAGNOSIS)[:2] == ("invalid", "tensions")
    assert refusal(request | {"tensions": {"nose": [1.0] * 4}}, DIAGNOSIS)[1] == "tensions.nose"
    few = request | {"tensions": {"front_left": [1.0] * 3}}
    assert refusal(few, DIAGNOSIS)[1] == "tensions.front_left"
    stance = request["stance"]
    moving = [hand | {"wrist": "compliant"} for hand in stance["hands"]]
    floats = request | {"stance": stance | {"hands": moving}}
    assert refusal(floats, DIAGNOSIS)[:2] == ("unsupported", "stance")
