"""Margins that are kept as far as they can be: how much of them, at what cost, and what is said."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from hand_models.base import InvalidInputError
from planner import Limits, Plan, Question, plan
from planner.prepare import prepare_stance
from planner.question import LimbStiffness
from planner.result import Finding
from planner.streaming import WrenchStream
from tests.suite.helpers.stances import limited, random_question

COST = 0.1
"""Part of the least utilisation that margins may cost."""


def if_possible(question: Question, **limits: float) -> Question:
    return replace(question, limits=Limits(margins="if_possible", **limits))


def found(answer: Plan) -> list[Finding]:
    return [each for each in answer.findings if each.kind == "margin_reduced"]


def tensions(answer: Plan) -> np.ndarray:
    return np.concatenate([hand.tensions for hand in answer.hands or ()])


@pytest.mark.parametrize("name", ["wall-300", "overhang", "ledge"])
def test_margins_that_cost_little_are_kept_as_if_required(name: str) -> None:
    answer = plan(limited(name, margins="if_possible"))
    required = plan(limited(name, hold_margin=2.0))
    assert (answer.margin_share, required.margin_share) == (1.0, None)
    assert answer.utilisation == pytest.approx(required.utilisation, abs=1e-9)
    assert tensions(answer) == pytest.approx(tensions(required), abs=1e-6)
    assert not found(answer)


def test_required_margins_are_zero_unless_they_are_given() -> None:
    assert not Limits().asked_margins
    assert Limits(margins="if_possible").asked_margins == {"hold_margin": 2.0}
    assert not Limits(margins="if_possible", hold_margin=0.0).asked_margins
    halved = Limits(margins="if_possible", hold_margin=3.0, least_tension=8.0).with_share(0.5)
    assert halved.asked_margins == {"hold_margin": 1.5, "least_tension": 4.0}


def test_a_share_is_what_the_cap_leaves_and_the_same_margins_required_take_all_of_it() -> None:
    answer = plan(limited("wall-300", margins="if_possible", hold_margin=5.0))
    assert answer.status == "optimal"
    assert answer.utilisation == pytest.approx(1.0, abs=2e-6)
    share = answer.margin_share
    assert share is not None
    assert 0.0 < share < 1.0
    kept = plan(limited("wall-300", hold_margin=5.0 * share))
    assert kept.utilisation == pytest.approx(answer.utilisation, abs=1e-7)
    more = plan(limited("wall-300", hold_margin=5.0 * (share + 1e-3)))
    assert more.status == "overloaded"
    (finding,) = found(answer)
    assert (finding.field, finding.value) == ("limits.margins", share)
    assert finding.message in answer.warnings
    assert f"of a hold_margin of 5 N the plan keeps only {100 * share:.0f} %" in finding.message


def test_of_twice_the_margin_half_the_share_is_kept() -> None:
    once = plan(limited("wall-300", margins="if_possible", hold_margin=5.0)).margin_share
    twice = plan(limited("wall-300", margins="if_possible", hold_margin=10.0)).margin_share
    assert once is not None
    assert twice == pytest.approx(0.5 * once, abs=2e-6)


def test_a_small_share_of_a_large_margin_is_said() -> None:
    answer = plan(limited("wall-300", margins="if_possible", hold_margin=1000.0))
    (finding,) = found(answer)
    assert 1e-3 < finding.value < 5e-3
    assert f"the plan keeps only {100 * finding.value:.2g} %: more would" in finding.message


@pytest.mark.parametrize("seed", [1, 9, 18, 28, 34, 66])
def test_a_share_costs_a_tenth_at_most_and_no_status(seed: int) -> None:
    bare = random_question(seed)
    least, answer = plan(bare), plan(if_possible(bare))
    assert answer.status == least.status == "optimal"
    share = answer.margin_share
    assert share is not None
    # a plan without margins may use a thousandth more than the least, for less tension
    most = min(1.0, (1.0 + COST) * least.utilisation)
    assert answer.utilisation <= most * 1.001 + 2e-6
    again = plan(replace(bare, limits=Limits(hold_margin=2.0 * share)))
    assert again.utilisation == pytest.approx(answer.utilisation, abs=1e-6)
    if share < 1.0:
        more = plan(replace(bare, limits=Limits(hold_margin=2.0 * share + 0.02)))
        assert more.utilisation is None or more.utilisation > most * 0.999


@pytest.mark.parametrize("name", ["wall-300", "ledge", "slab"])
def test_shares_and_tensions_change_as_little_as_the_load(name: str) -> None:
    bare = limited(name, margins="if_possible", hold_margin=5.0)
    wrench = bare.needed_wrench()
    # through the loads at which the least utilisation reaches the cap, and beyond
    least = plan(replace(bare, limits=Limits())).utilisation
    assert least is not None
    for middle in (0.93 / least, 0.97 / least, 1.0 / least, 1.02 / least):
        shares = []
        for factor in middle + np.linspace(-1e-4, 1e-4, 5):
            answer = plan(replace(bare, body_wrench=factor * wrench))
            assert answer.margin_share is not None
            shares.append(answer.margin_share)
        assert np.abs(np.diff(shares)).max() < 0.02


def test_what_overloads_without_margins_keeps_those_that_cost_nothing() -> None:
    bare, answer = plan(limited("boulders")), plan(limited("boulders", margins="if_possible"))
    assert answer.status == bare.status == "overloaded"
    assert answer.utilisation == pytest.approx(bare.utilisation, abs=2e-6)
    assert answer.margin_share == pytest.approx(0.0, abs=0.01)
    (finding,) = found(answer)
    assert finding.message.endswith("keeps nothing: any of it would add to the overload")
    heavy = limited("ledge", margins="if_possible")
    heavy = replace(heavy, body_wrench=1.2 * heavy.needed_wrench())
    free = plan(heavy)
    assert (free.status, free.margin_share) == ("overloaded", 1.0)


def test_a_margin_of_palms_that_no_hand_takes_is_warned_of() -> None:
    for name, warned in (("wall-300", False), ("ledge", True)):
        asked = limited(name, palm_margin=5.0)
        if warned:
            bare = msgspec.structs.replace(asked.stance.hands[0].grasp, palm=False)
            hands = [replace(hand, grasp=bare) for hand in asked.stance.hands]
            asked = replace(asked, stance=replace(asked.stance, hands=tuple(hands)))
        assert any("no palm has to press" in each for each in plan(asked).warnings) == warned


def test_a_stiffness_of_limbs_that_no_wrist_needs_is_warned_of() -> None:
    limbs = LimbStiffness(position=5e3, angle=100.0)
    asked = limited("wall-300")
    asked = replace(asked, stance=replace(asked.stance, limb_stiffness=limbs))
    assert any("all wrists are fixed" in each for each in plan(asked).warnings)


def test_without_a_plan_there_is_no_share() -> None:
    answer = plan(if_possible(random_question(3)))
    assert answer.status == "infeasible"
    assert answer.margin_share is None


def test_what_other_loads_hands_and_rock_do_is_told_without_margins() -> None:
    extras = frozenset({"load_factor", "spread"})
    bare = plan(replace(limited("overhang"), want=extras))
    kept = plan(replace(limited("overhang", margins="if_possible"), want=extras))
    assert kept.load_factor == bare.load_factor
    assert kept.spread is not None
    assert bare.spread is not None
    assert kept.spread.utilisations == pytest.approx(bare.spread.utilisations, abs=1e-9)
    assert kept.spread.threshold == bare.spread.threshold
    # what is sent has its margins, and far more samples are in balance
    assert kept.spread.kept is not None
    assert bare.spread.kept is not None
    assert kept.spread.kept.without <= 0.5 * bare.spread.kept.without


@pytest.mark.parametrize("name", ["wall-300", "slab"])
@pytest.mark.parametrize("objective", ["min_effort", "max_reliability"])
def test_what_is_kept_does_not_depend_on_the_objective(name: str, objective: str) -> None:
    bare = limited(name, margins="if_possible", hold_margin=5.0)
    answer = plan(replace(bare, objective=objective))
    assert answer.status == "optimal"
    assert answer.margin_share == pytest.approx(plan(bare).margin_share, abs=1e-6)


def test_compliant_wrists_keep_a_share_to_a_hundredth() -> None:
    answer = plan(limited("wall-300", "compliant", margins="if_possible", hold_margin=8.0))
    share = answer.margin_share
    assert answer.status == "optimal"
    assert share is not None
    assert 0.0 < share < 1.0
    again = plan(limited("wall-300", "compliant", hold_margin=8.0 * share))
    assert again.utilisation == pytest.approx(answer.utilisation, abs=5e-3)


def test_a_prepared_stance_has_no_margins_until_they_are_added() -> None:
    prepared = prepare_stance(limited("wall-300", margins="if_possible", palm_margin=4.0))
    assert not prepared.question.limits.asked_margins
    plain = prepare_stance(limited("wall-300", hold_margin=2.0, palm_margin=4.0))
    for own, other in zip(
        prepared.with_margins(plain.question.limits).hands.spaces, plain.hands.spaces, strict=True
    ):
        assert np.array_equal(own.h, other.h)
        assert np.array_equal(own.H, other.H)


def test_streams_and_other_words_are_refused() -> None:
    with pytest.raises(InvalidInputError) as caught:
        WrenchStream(limited("wall-300", margins="if_possible"))
    assert caught.value.field == "limits.margins"
    assert "valid is required" in caught.value.message
    with pytest.raises(InvalidInputError) as caught:
        Limits(margins="perhaps")
    assert caught.value.field == "margins"
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert({"margins": "perhaps"}, Limits)
