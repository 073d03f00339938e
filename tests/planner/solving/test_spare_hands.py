"""Hands that add nothing: found as HiGHS finds them, left at closing, and told."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from hand_models.base import Pose
from hand_models.rock import Sphere
from planner import programs
from planner.programs import tension_trade
from planner.question import Limits, Load, Question, Stance
from planner.result import Plan
from planner.solving import KnownStance, plan
from planner.solving.spare_hands import spare_hands
from planner.streaming import WrenchStream
from tests.suite.helpers import peer
from tests.suite.helpers.random_questions import requested
from tests.suite.helpers.stances import CALIBRATION_LOAD, PLACES, ask, on_wall, program_data

LIMBS = tuple(PLACES)
AIR = Pose(np.array([0.0, 0.0, 0.5]), np.eye(3))


def with_one_in_the_air(limb: str, closing: float | None = None) -> Stance:
    """Four hands on a wall, of which one is half a metre from its rock."""
    stance = on_wall()
    hands = [
        hand
        if hand.limb != limb
        else replace(
            hand,
            hold=Sphere(0.1),
            hold_in_hand=AIR,
            grasp=structs.replace(hand.grasp, closing_tension=closing),
        )
        for hand in stance.hands
    ]
    return replace(stance, hands=tuple(hands))


def tensions(answer: Plan, limb: str) -> list[float]:
    hand = next(hand for hand in answer.hands if hand.limb == limb)
    return [finger.tendon_tension for finger in hand.fingers]


def named(answer: Plan) -> set[str]:
    return {
        LIMBS[int(each.field.removeprefix("stance.hands[").removesuffix("]"))]
        for each in answer.findings
        if each.kind == "hand_adds_nothing"
    }


@pytest.mark.parametrize("closing", [None, 30.0, 45.0])
@pytest.mark.parametrize("limb", LIMBS)
def test_a_hand_in_the_air_stays_as_it_was_closed_and_is_named(limb, closing):
    stance = with_one_in_the_air(limb, closing)
    answer = plan(ask(stance, load=Load(50.0)))
    assert answer.verified
    assert named(answer) == {limb}
    np.testing.assert_allclose(tensions(answer, limb), closing or 37.0, atol=0.05)
    (message,) = (text for text in answer.warnings if text.startswith(f"{limb} adds nothing"))
    assert f"closing tension of {closing or 37.0:g} N" in message
    # and the others pull as they would without it
    alone = plan(ask(replace(stance, hands=others(stance, limb)), load=Load(50.0)))
    assert answer.utilisation == pytest.approx(alone.utilisation, rel=2e-3)
    for hand in alone.hands:
        np.testing.assert_allclose(
            tensions(answer, hand.limb), [f.tendon_tension for f in hand.fingers], atol=0.2
        )


def others(stance: Stance, limb: str):
    return tuple(hand for hand in stance.hands if hand.limb != limb)


@pytest.mark.parametrize("mass", [30.0, 60.0, 90.0])
@pytest.mark.parametrize("com", [0.0, 0.1])
@pytest.mark.parametrize("hold", [Sphere(0.25), Sphere(0.6)])
def test_just_those_are_named_without_which_a_plan_is_as_good(mass, com, hold):
    question = ask(on_wall(hold), load=Load(mass, (0.0, com, 0.0)))
    answer = plan(question)
    least = peer.least_utilisation(question)
    if answer.status != "optimal":
        assert named(answer) == set()
        return
    most = min(1.001 * least.fun, 1.0)
    useless = set()
    for limb in LIMBS:
        stance = replace(question.stance, hands=others(question.stance, limb))
        found = peer.least_utilisation(replace(question, stance=stance))
        if found.status == 0 and found.fun < most - 1e-7:
            useless.add(limb)
    assert named(answer) == useless


def test_no_hand_of_the_wall_is_named():
    assert named(plan(ask(on_wall()))) == set()
    assert named(plan(ask(on_wall(limbs=LIMBS[:1]), load=Load(1.0)))) == set()


def test_a_known_stance_and_a_stream_leave_it_alike():
    question = ask(with_one_in_the_air("rear_left"), load=Load(50.0))
    answer, known = plan(question), KnownStance(question)
    wrench = known.prepared.wrench
    known.plan(1.02 * wrench)
    np.testing.assert_allclose(
        tensions(known.plan(wrench), "rear_left"), tensions(answer, "rear_left"), atol=1e-3
    )
    with WrenchStream(question) as stream:
        points = stream.set_points(wrench)
        mine = points.tensions[stream.limbs.index("rear_left")]
        np.testing.assert_allclose(mine, tensions(answer, "rear_left"), atol=0.05)


@pytest.mark.parametrize(
    "seeds",
    [(0, 3, 7, 19, 24, 41), pytest.param(range(120), marks=pytest.mark.slow)],
    ids=["few", "all"],
)
def test_neither_order_nor_rounding_names_hands_or_moves_tensions(seeds):
    """Where one hand alone sets the utilisation, its multipliers add up to one but for rounding."""
    named_ones = 0
    for seed in seeds:
        asked = replace(requested(seed), explain=False, want=frozenset())
        answer = plan(asked)
        if answer.status != "optimal":
            continue
        hands = asked.stance.hands
        heavier = replace(asked.stance, gravity=asked.stance.gravity * (1.0 + 1e-9))
        turned = replace(asked, stance=replace(asked.stance, hands=hands[::-1]))
        for other in (plan(turned), plan(replace(asked, stance=heavier))):
            assert limbs_named(other) == limbs_named(answer)
            for hand in answer.hands:
                np.testing.assert_allclose(
                    tensions(other, hand.limb), tensions(answer, hand.limb), atol=0.01
                )
        named_ones += bool(limbs_named(answer))
    assert named_ones >= 2


def limbs_named(answer: Plan) -> set[str]:
    return {text.split(" adds nothing")[0] for text in answer.warnings if "adds nothing" in text}


def test_tensions_follow_the_cap_to_where_nothing_is_given_away():
    """Steps of an eighth are about an eighth as long: a jump would stay as it is."""
    question = ask(
        with_one_in_the_air("rear_left"), load=structs.replace(CALIBRATION_LOAD, mass=50.0)
    )
    least = peer.least_utilisation(question).fun

    def steps(count: int) -> float:
        found = [
            tensions(plan(capped(question, (1.0 + above) * least)), "rear_left")
            for above in np.linspace(1e-6, 1.2e-3, count)
        ]
        return float(np.abs(np.diff(found, axis=0)).max())

    coarse, fine = steps(6), steps(61)
    assert fine < 0.3 * coarse


def capped(question: Question, cap: float) -> Question:
    return replace(question, limits=Limits(utilisation=cap))


def test_without_multipliers_no_hand_is_named():
    """Where Clarabel fails, another solver may give loads alone."""
    data = program_data(ask(with_one_in_the_air("rear_left"), load=Load(50.0)))
    least = programs.margin(data)
    trade = tension_trade(least.value, 1.0)
    assert [each.place for each in spare_hands(data, least, trade)] == [LIMBS.index("rear_left")]
    bare = replace(least, balance_dual=None, limit_duals=(), hard_duals=())
    assert spare_hands(data, bare, trade) == ()
