"""Set-points of a stream after tiles have slipped."""

from dataclasses import replace

import numpy as np
import pytest

from hand_models.base import InvalidInputError, UnsupportedError
from planner import deadline
from planner.question import LostTile
from planner.recovery import Recovery
from planner.streaming import WrenchStream
from service.answering.questions import question
from service.commands.stances import read_request

TILE = LostTile("front_left", "inner_left", "middle")


@pytest.fixture(scope="module")
def stream():
    with WrenchStream(question(read_request("wall-300"))) as opened:
        yield opened


def test_set_points_without_a_tile_are_the_plan_without_it(stream: WrenchStream):
    wrench = stream.first * 0.9
    points = stream.set_points(wrench, [TILE])
    prepared = stream._source._stance.known.prepared
    found = Recovery(prepared).plan([TILE], wrench)
    assert (points.status, points.source, points.verified) == ("optimal", "solved", True)
    assert points.utilisation == pytest.approx(found.utilisation, abs=1e-6)
    assert points.tensions.ravel() == pytest.approx(found.verified.arrays.tensions, abs=1e-2)
    assert points.lost == (TILE,)
    assert points.gap >= 0.0
    whole = stream.set_points(wrench)
    assert whole.lost == ()
    assert whole.utilisation <= points.utilisation + 1e-9


def test_tiles_lost_at_the_declaration_stay_lost():
    asked = question(read_request("wall-300"))
    other = LostTile("rear_left", "outer_left", "distal")
    with WrenchStream(asked, lost=[TILE]) as one, WrenchStream(asked) as two:
        mine, theirs = one.set_points(one.first, [other]), two.set_points(one.first, [TILE, other])
        assert mine.lost == theirs.lost == (TILE, other)
        assert mine.utilisation == pytest.approx(theirs.utilisation, abs=1e-5)
        assert one.set_points(one.first).lost == (TILE,)


def test_many_random_slips_all_have_a_verified_answer(stream: WrenchStream):
    chance = np.random.default_rng(4)
    tiles = stream._slips.tiles
    for _ in range(25):
        some = chance.choice(len(tiles), chance.integers(1, 4), replace=False)
        points = stream.set_points(
            stream.first * chance.uniform(0.9, 1.1), [tiles[i] for i in some]
        )
        assert points.verified
        assert points.status in ("optimal", "overloaded")
        assert (points.save_first is None) == (points.status == "optimal")
        assert (points.reason is None) == (points.status == "optimal")


def test_a_whole_finger_that_slips_is_slack(stream: WrenchStream):
    lost = [
        LostTile("rear_left", "outer_left", p) for p in ("base", "proximal", "middle", "distal")
    ]
    points = stream.set_points(stream.first * 0.5, lost)
    assert points.status == "optimal"
    assert points.released == (("rear_left", "outer_left"),)
    assert points.tensions[stream.limbs.index("rear_left"), 0] == 0.0


def test_what_cannot_slip_is_refused(stream: WrenchStream):
    with pytest.raises(InvalidInputError) as refused:
        stream.set_points(stream.first, [LostTile("rear_left", "thumb", "distal")])
    assert refused.value.field == "lost[0]"
    asked = question(read_request("wall-300"))
    hands = tuple(replace(hand, wrist="compliant") for hand in asked.stance.hands)
    compliant = replace(asked, stance=replace(asked.stance, hands=hands))
    with WrenchStream(compliant) as other, pytest.raises(UnsupportedError) as refused:
        other.set_points(other.first, [TILE])
    assert refused.value.field == "lost"


def test_a_deadline_does_not_say_that_hands_were_closed(stream: WrenchStream):
    words = r"before a plan was looked for; .* of which knowing the limits took [0-9.e-]+ s"
    with deadline.within(1e-9), pytest.raises(deadline.DeadlineError, match=words):
        stream.set_points(stream.first, [TILE])
