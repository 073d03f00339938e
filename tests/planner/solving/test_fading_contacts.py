"""Plans of hands of which some tiles have only some of their spines on the rock."""

import math
from dataclasses import replace

import numpy as np
import pytest

from hand_models.base import Pose
from hand_models.hand import FINGERS, SettledHand
from hand_models.rock import Cylinder
from planner.prepare import prepared_stance, settle_hand
from planner.question import Question, Stance
from planner.result import Plan
from planner.solving import plan
from planner.streaming.stream_stance import StreamStance
from service.answering import questions
from service.commands.stances import read_request
from tests.suite.helpers.checks import problems
from tests.suite.helpers.hands import partly
from tests.suite.helpers.stances import CALIBRATION_LOAD, PLACES, ask, on_wall

BASE, DISTAL = 0, 6
"""Tiles: the base tile of outer_left, the distal one of inner_left."""


def lifted(stance: Stance, off: float) -> Stance:
    """The same hands, each with its rock so much farther off along z than where it is seated."""
    hands = []
    for hand in stance.hands:
        seated = settle_hand(hand, stance).seating.pose
        up = np.array([0.0, 0.0, off])
        hands.append(replace(hand, hold_in_hand=Pose(seated.position + up, seated.rotation)))
    return replace(stance, hands=tuple(hands))


def edge(stance: Stance, engagement, near: float, far: float) -> tuple[float, float]:
    """How far off, within 0.1 nm, hands may just be for a share of spines above zero, and not."""
    while far - near > 1e-10:
        middle = (near + far) / 2.0
        hand = settle_hand(lifted(stance, middle).hands[0], stance)
        near, far = (middle, far) if engagement(hand) > 0.0 else (near, middle)
    return near, far


FADING = {
    "base tiles": (on_wall(outer_rotation=0.0), lambda hand: hand.engagement[BASE], 5e-3),
    "base tiles of pinches": (on_wall(), lambda hand: hand.engagement[BASE], 5e-3),
    "two rows of the palm": (on_wall(), lambda hand: sum(hand.palm.engagement[2:]), 2.65e-3),
}
"""Stances, and a share of spines that is none at last as the rock goes so far off [m]."""

CASES = [
    *((name, "fixed", CALIBRATION_LOAD) for name in FADING),
    *((name, "floating", CALIBRATION_LOAD) for name in FADING),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "wrist", "load"), CASES)
def test_plans_do_not_jump_where_tiles_lose_the_rock(name, wrist, load):
    stance, engagement, most = FADING[name]
    answers = []
    for off in edge(stance, engagement, 0.0, most):
        there = lifted(stance, off)
        hands = [
            replace(hand, wrist=wrist if i < 2 else "fixed") for i, hand in enumerate(there.hands)
        ]
        answers.append(plan(ask(replace(there, hands=tuple(hands)), load=load)))
    assert all(answer.verified for answer in answers)
    near, far = (answer.utilisation for answer in answers)
    assert near == pytest.approx(far, rel=1e-4)


@pytest.mark.slow
def test_palms_that_lose_the_rock_leave_nothing_that_holds():
    """Less and less of them is used more and more; a millionth of their spines is none."""
    stance, share = on_wall(), lambda hand: sum(hand.palm.engagement)
    near, far = edge(stance, share, 2e-3, 5e-3)
    used = [plan(ask(lifted(stance, near - off))).utilisation for off in (1e-4, 1e-5, 1e-6)]
    np.testing.assert_allclose(np.diff(np.log10(used)), 1.0, atol=0.1)
    assert plan(ask(lifted(stance, far))).status == "infeasible"
    assert plan(ask(lifted(stance, near))).status == "overloaded"


@pytest.mark.parametrize("limbs", [("rear_right",), ("front_left",), tuple(PLACES)])
def test_the_bundled_pinches_do_not_jump_where_palms_lose_the_rock(limbs):
    """Straight before its log, a hand's last palm tiles have 5 mm of a gap between the two."""
    question = questions.question(read_request("wall-300"))
    answers, engaged = [], []
    for off in (4.41364e-3, 4.41370e-3):
        there = Pose(np.array([0.0, 0.0, off]), np.eye(3))
        hands = tuple(
            replace(hand, hold_in_hand=there) if hand.limb in limbs else hand
            for hand in question.stance.hands
        )
        stance = replace(question.stance, hands=hands)
        answers.append(plan(replace(question, stance=stance, want=frozenset(["load_factor"]))))
        engaged.append(
            [len(settle_hand(hand, stance).palm.engaged) for hand in hands if hand.limb in limbs]
        )
    assert engaged == [[2] * len(limbs), [0] * len(limbs)]
    near, far = answers
    assert near.load_factor == pytest.approx(far.load_factor, rel=1e-3)
    if len(limbs) == 1:
        assert near.utilisation == pytest.approx(far.utilisation, rel=1e-4)
        assert near.verified
        assert far.verified


@pytest.fixture
def half(monkeypatch):
    """Makes all hands that are planned for have half the spines of two of their tiles."""
    share = np.ones(14)
    share[[BASE, DISTAL]] = 0.5
    settle = prepared_stance.settle_stance

    def settle_half(stance: Stance) -> list[SettledHand]:
        return [partly(hand, share) for hand in settle(stance)]

    monkeypatch.setattr(prepared_stance, "settle_stance", settle_half)
    return settle_half


QUESTION = ask(on_wall(outer_rotation=2.0))


def complaints(question: Question, hands: list[SettledHand], answer: Plan) -> list[str]:
    return problems(question, answer, settled=hands)


def test_a_plan_with_half_a_tiles_spines_is_that_of_its_loads(half):
    hands, answer = half(QUESTION.stance), plan(QUESTION)
    assert answer.verified
    assert complaints(QUESTION, hands, answer) == []
    for settled, hand in zip(hands, answer.hands, strict=True):
        assert settled.engagement[DISTAL] == 0.5
        lateral = [hand.space.columns.index(f"{finger}/lateral") for finger in FINGERS]
        assert len(lateral) == 4
        f = hand.tensions
        for i, finger in enumerate(hand.fingers):
            own = np.flatnonzero(settled.finger_of == i)
            shares = settled.engagement[own]
            sideways = np.array([tile.lateral for tile in finger.tiles])
            np.testing.assert_allclose(sideways, sideways.sum() * shares / shares.sum(), rtol=1e-9)
            for t, share, tile in zip(own, shares, finger.tiles, strict=True):
                at_zero, slope = settled.loads[t, 0]
                assert tile.shear == pytest.approx(at_zero + slope * f[i], rel=1e-9)
                if not share:
                    continue
                # each spine, as of a whole tile; few ones bear no less than a least share
                limit = hand.limit_shares[t]
                assert limit == share or (limit > share and share < 0.1)
                load = np.array([tile.shear, tile.normal, abs(tile.lateral)]) / limit
                used = max(
                    float(load @ (p.a_shear, p.a_normal, p.a_lateral)) / p.capacity
                    for p in hand.half_planes
                )
                assert tile.utilisation == pytest.approx(max(used, 0.0), rel=1e-9)
                assert [p.capacity for p in hand.limits_of(int(t))] == pytest.approx(
                    [limit * p.capacity for p in hand.half_planes]
                )


def test_the_set_says_of_a_plan_what_its_tiles_say(half):
    hands, answer = half(QUESTION.stance), plan(QUESTION)
    for settled, hand in zip(hands, answer.hands, strict=True):
        value = {f"{name}/tension": f for name, f in zip(FINGERS, hand.tensions, strict=True)}
        for finger in hand.fingers:
            value[f"{finger.name}/lateral"] = sum(tile.lateral for tile in finger.tiles)
        value |= {"palm_shear": -hand.palm.force[0], "palm_pressing": hand.palm.force[2]}
        used = hand.space.utilisations(np.array([value[name] for name in hand.space.columns]))
        assert used.max() == pytest.approx(hand.utilisation, abs=1e-9)
        for t, tile in enumerate(settled.tiles):
            rows = [
                used[i]
                for i, row in enumerate(hand.space.rows[: len(used)])
                if (row.finger, row.phalanx) == tile[:2] and row.limit in ("shear", "pull_off")
            ]
            if rows:
                told = hand.tile_utilisations[t]
                assert told == pytest.approx(max(0.0, *rows), abs=1e-9)


def test_a_plan_that_takes_half_a_tile_for_a_whole_one_is_found(half):
    """Its strength, in what is told of it; or all of it, shear and strength, in the planning."""
    hands, answer = half(QUESTION.stance), plan(QUESTION)
    told = list(answer.hands)
    used = told[1].tile_utilisations.copy()
    used[DISTAL] *= 0.5
    told[1] = replace(told[1], tile_utilisations=used)
    found = complaints(QUESTION, hands, replace(answer, hands=tuple(told)))
    assert any("distal tile of inner_left: utilisation" in each for each in found), found
    whole = [settle_hand(hand, QUESTION.stance) for hand in QUESTION.stance.hands]
    found = complaints(QUESTION, whole, answer)
    assert any("of its spines hold, not 0.5" in each for each in found), found
    assert any("not what the plan says" in each for each in found), found


def test_half_a_tile_is_held_against_half_its_limit_curve(half):
    """Half-planes that promise more than there is do not help it."""
    question = ask(on_wall(Cylinder(0.7), outer_rotation=math.pi))
    hands, answer = half(question.stance), plan(question)
    assert complaints(question, hands, answer) == []
    h = max(range(4), key=lambda i: answer.hands[i].tile_utilisations[DISTAL])
    hand = answer.hands[h]
    load = hand.loads[DISTAL] / 0.5
    assert np.hypot(*load[:2]) > float(hands[h].surface.strength(math.atan2(-load[1], load[0])))
    generous = replace(
        hand,
        half_planes=tuple(p._replace(capacity=10.0 * p.capacity) for p in hand.half_planes),
    )
    told = tuple(generous if i == h else each for i, each in enumerate(answer.hands))
    found = complaints(question, hands, replace(answer, hands=told))
    assert any("distal tile of inner_left is beyond its limit curve" in each for each in found)


def test_a_stream_of_plans_is_checked_with_half_a_tile_as_such(half):
    known = StreamStance(QUESTION)
    answer = plan(QUESTION)
    loads = known.loads_of(answer)
    read = known.read(loads)
    told = {"wrenches": read.wrenches, "body_wrench": known.first}
    assert known.check.fault(loads, utilisation=read.utilisation, **told) is None
    # what they would use of whole tiles
    whole = known.check.fault(loads, utilisation=0.9 * read.utilisation, **told)
    assert whole == "the utilisation"
