"""What a plan says of palms that carry without the travel of their wrists."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import msgspec
import numpy as np
import pytest
from msgspec import UNSET, structs

from hand_models.base import Pose
from hand_models.compliance import CompliantHand, FloatingWrist
from hand_models.parameters import own_draw, own_hand
from hand_models.tendon import share_load
from planner.prepare import settle_hand
from planner.question import Question
from planner.result import Finding, Plan
from planner.robots import robosimian
from planner.solving import KnownStance, plan
from service.answering.answers import plan_reply
from service.answering.questions import question
from service.commands.stances import read_request
from service.requests import PlanRequest
from tests.suite.helpers.stances import ask, on_wall
from tests.suite.problems import problem


def palms_in(answer: Plan) -> list[Finding]:
    return [each for each in answer.findings if each.kind == "palm_without_travel"]


def stretched_in(answer: Plan) -> list[Finding]:
    return [each for each in answer.findings if each.kind == "tile_stretched_far"]


@cache
def moving(name: str, most: float | None = None) -> Question:
    """A bundled stance with compliant wrists, of hands whose tiles may be stretched so far [m]."""
    asked = question(read_request(name))
    hands = tuple(replace(hand, wrist="compliant") for hand in asked.stance.hands)
    stance = replace(asked.stance, hands=hands)
    if most is not None:
        entry = {"value": most, "unit": "m", "source": "assumed"}
        own = own_draw({"hand": {"tile": {"largest_tile_stretch": entry}}})
        stance = replace(stance, robot=robosimian(own_hand(own.hand)))
    return replace(asked, stance=stance)


def lacks(hand, settled) -> float:
    """Travel that a palm lacks, from what the plan says and the hand's own numbers [m]."""
    body, engaged = settled.hand, list(settled.palm.engaged)
    assert all(share == 1.0 for share in settled.palm.engagement) or len(settled.palm.layers) > 1
    springs = sum(
        share
        * share_load(
            tuple(body.palm_contact[i] for i in tiles),
            body.palm_spring,
            body.palm_friction,
            body.palm_own_friction,
        ).tile_stiffness.sum()
        for share, tiles in settled.palm.layers
    )
    gap = settled.palm.gaps[engaged].min() if hand.palm.force[2] > 1.0 else 0.0
    return max(-hand.palm.force[0] / springs, gap)


@pytest.mark.parametrize("name", ["wall-300", "overhang"])
def test_the_hand_that_lacks_most_travel_is_named_with_the_millimetres(name):
    asked = question(read_request(name))
    answer = plan(asked)
    (found,) = palms_in(answer)
    each = [
        lacks(hand, settle_hand(place, asked.stance))
        for hand, place in zip(answer.hands, asked.stance.hands, strict=True)
    ]
    assert found.value == pytest.approx(max(each), rel=1e-9)
    worst = int(found.field.removeprefix("stance.hands[").removesuffix("].wrist"))
    assert each[worst] == pytest.approx(max(each), abs=1e-6)
    assert found.message.startswith(f"{asked.stance.hands[worst].limb}: ")
    assert found.message in answer.warnings
    assert found.unit == "m"
    assert "(3 other palms would have to move, too, not farther)" in found.message
    # what is said of others is true of each: none lacks more, and all lack some
    assert min(each) > 1e-3
    assert "'wrist': 'compliant'" in found.message


def test_of_wall_300_it_is_what_the_facts_say():
    (found,) = palms_in(plan(question(read_request("wall-300"))))
    assert found.value == pytest.approx(6.5e-3, abs=5e-5)
    assert "103 N of shear, which needs 6.5 mm of travel" in found.message
    assert "228 N of pressing across a gap of 2.6 mm" in found.message


def test_without_palms_or_with_wrists_that_move_there_is_none():
    assert not palms_in(plan(ask(on_wall(palm=False))))
    assert not palms_in(plan(moving("wall-300")))


def test_less_than_a_millimetre_is_not_worth_a_word():
    asked = question(read_request("wall-300"))
    light = structs.replace(asked.load, mass=1.0)
    answer = plan(replace(asked, load=light))
    each = [
        lacks(hand, settle_hand(place, asked.stance))
        for hand, place in zip(answer.hands, asked.stance.hands, strict=True)
    ]
    assert max(each) < 1e-3
    assert not palms_in(answer)


def test_hands_on_their_nails_are_not_sent_to_compliant_wrists():
    request = msgspec.convert(problem("nails/nails-on-plane").request, PlanRequest)
    asked = question(request)
    (found,) = palms_in(plan(asked))
    worst = next(h for h in asked.stance.hands if found.message.startswith(h.limb))
    assert worst.grasp.fingernail
    assert "compliant" not in found.message


def test_a_known_stance_says_it_of_each_wrench():
    asked = question(read_request("wall-300"))
    answer = plan(asked)
    known = KnownStance(asked)
    assert known.plan(answer.body_wrench).findings == answer.findings
    (less,) = palms_in(known.plan(0.9 * np.asarray(answer.body_wrench)))
    assert less.value != palms_in(answer)[0].value


def stretches_of(answer: Plan, asked: Question) -> dict[tuple[str, str, str], float]:
    """Shear over contact stiffness of whole tiles on rock, from the reply's numbers [m]."""
    found = {}
    for hand, place in zip(answer.hands, asked.stance.hands, strict=True):
        settled = settle_hand(place, asked.stance)
        first, *others = settled.hand.table.vector("tile", "contact_stiffness")
        stiffness = dict(
            zip(("base", "proximal", "middle", "distal"), (first, first, *others), strict=True)
        )
        for tile, share, shear in zip(hand.tiles, hand.engagement, hand.loads[:, 0], strict=True):
            if share == 1.0:
                found[hand.limb, tile.finger, tile.phalanx] = abs(shear) / stiffness[tile.phalanx]
    return found


def test_the_tile_that_is_stretched_most_is_named_where_that_is_too_far():
    asked = moving("wall-300", 4.6e-3)
    answer = plan(asked)
    assert answer.verified
    (found,) = stretched_in(answer)
    stretches = stretches_of(answer, asked)
    limb, finger, phalanx = max(stretches, key=stretches.get)
    assert found.value == pytest.approx(stretches[limb, finger, phalanx], rel=1e-7)
    assert f"{phalanx} tile of " in found.message
    assert stretches[found.message.split(":")[0], finger, phalanx] == pytest.approx(
        found.value, abs=1e-6
    )
    assert f"{1e3 * found.value:.1f} mm" in found.message
    assert "largest_tile_stretch of 4.6 mm" in found.message
    beyond = sum(each > 4.6e-3 for each in stretches.values())
    partly = sum(
        int((hand.wrist.stretches[hand.engagement < 1.0] > 4.6e-3).sum()) for hand in answer.hands
    )
    assert f"({beyond + partly - 1} other tiles beyond it, too)" in found.message
    assert found.message in answer.warnings


def test_the_usual_limit_leaves_bundled_plans_without_a_word():
    asked = moving("wall-300")
    answer = plan(asked)
    assert not stretched_in(answer)
    largest = max(hand.wrist.stretches.max() for hand in answer.hands)
    assert (
        4.6e-3
        < largest
        < settle_hand(asked.stance.hands[0], asked.stance).hand.table.scalar(
            "tile", "largest_tile_stretch"
        )
    )
    # another limit changes no plan
    assert plan(moving("wall-300", 4.6e-3)).utilisation == answer.utilisation


def test_a_tile_with_half_its_spines_is_stretched_by_the_springs_that_it_has_left():
    settled = settle_hand(*_one_hand())
    wrist = FloatingWrist(CompliantHand(settled))
    some = (settled.engagement > 0.0) & (settled.engagement < 1.0)
    assert some.any()
    shears = np.ones(len(settled.tiles))
    table = settled.hand.table
    k = np.array([table.vector("tile", "contact_stiffness")[0]])
    springs = table.scalar("tile", "spring_stiffness")
    stretches = wrist.stretches(shears)
    for tile in np.flatnonzero(some & [each.phalanx == "base" for each in settled.tiles]):
        # in series with the tile's own spring they are φ times as stiff as a whole tile's
        whole = 1.0 / (1.0 / k + 1.0 / springs)
        series = 1.0 / (stretches[tile] + 1.0 / springs)
        assert series == pytest.approx(settled.engagement[tile] * whole)
    assert (stretches[settled.engagement == 0.0] == 0.0).all()


def _one_hand():
    stance = question(read_request("wall")).stance
    return stance.hands[0], stance


def test_fixed_hands_have_no_stretch_and_floating_ones_do():
    answer = plan(question(read_request("wall-300-floating")))
    for hand in answer.hands:
        assert hand.wrist is None or hand.wrist.stretches.max() > 0.0
    reply = plan_reply(answer, None, model=False)
    for hand, sent in zip(answer.hands, reply.hands, strict=True):
        expected = UNSET if hand.wrist is None else hand.wrist.stretches.max()
        assert sent.wrist.largest_stretch == expected


@pytest.mark.parametrize("seated", [{"seat": "best"}, {"at": Pose.identity()}])
def test_hands_that_are_seated_are_compared_with_those_where_their_wrists_go(seated):
    """Here on the crests of their holds: the plan and what it says are as without a seat."""
    plain = moving("wall-300")
    hands = tuple(replace(hand, **seated) for hand in plain.stance.hands)
    one, two = plan(plain), plan(replace(plain, stance=replace(plain.stance, hands=hands)))
    assert two.verified
    assert two.utilisation == pytest.approx(one.utilisation, rel=1e-5)
    assert two.warnings == one.warnings
    assert all(hand.wrist.driven for hand in two.hands)
