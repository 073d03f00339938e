"""Prices: what one more unit of a limit takes off the utilisation, against HiGHS."""

import itertools
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from hand_models.rock import Cylinder, Plane
from hand_models.wrench_spaces import WrenchSpace
from planner.question import Limits, Load
from planner.result import LimitName
from planner.solving import plan
from tests.suite.helpers import peer
from tests.suite.helpers.hands import changed_hand
from tests.suite.helpers.robots import with_hand
from tests.suite.helpers.stances import SANDPAPER, ask, on_wall, random_question

QUESTIONS = {
    "pinches": ask(on_wall(), "prices"),
    "sandpaper, own weight": ask(on_wall(surface=SANDPAPER), "prices", load=Load()),
    "large cylinders": ask(on_wall(Cylinder(0.7)), "prices"),
    "overhang": ask(on_wall(overhang=0.4), "prices"),
    "slab": ask(on_wall(Plane(), overhang=-0.7, outer_rotation=0.0), "prices"),
    "three hands": ask(on_wall(limbs=("front_left", "rear_left", "rear_right")), "prices"),
}
RANDOM_SEEDS = (0, 7, 17, 22, 26, 30)


@cache
def named_sets(question) -> list[tuple[list[LimitName], WrenchSpace]]:
    """Each hand's set, and the name of each of its limit rows."""
    return [
        (
            [
                LimitName(hand.limb, row.finger, row.phalanx, row.limit)
                for row in space.rows[: len(space.s)]
            ],
            space,
        )
        for hand, space in zip(question.stance.hands, peer.spaces(question), strict=True)
    ]


def capacities(question) -> dict[LimitName, float]:
    return {
        name: s
        for names, space in named_sets(question)
        for name, s in zip(names, space.s, strict=True)
    }


def utilisation_with(question, change) -> float:
    """Least utilisation where ``change(name, capacity)`` is each limit's capacity."""
    sets = [
        replace(space, s=np.array([change(n, s) for n, s in zip(names, space.s, strict=True)]))
        for names, space in named_sets(question)
    ]
    result = peer.least_utilisation(question, sets)
    assert result.status == 0, result.message
    return result.fun


def test_price_lies_between_the_one_sided_differences():
    for question in QUESTIONS.values():
        answer = plan(question)
        assert answer.prices
        for price in answer.prices[:4]:
            more, less = slopes(question, price.name)
            slack = 2e-3 * max(more, less) + 1e-7
            assert more - slack <= price.price <= less + slack


def slopes(question, name) -> tuple[float, float]:
    """What a unit more and a unit less of a limit change, from steps of 1e-5 of its capacity."""
    step = 1e-5 * capacities(question)[name]
    here = utilisation_with(question, lambda _, s: s)

    def changed(by):
        return utilisation_with(question, lambda n, s: s + by if n == name else s)

    return (here - changed(step)) / step, (changed(-step) - here) / step


@pytest.mark.slow
def test_price_is_the_derivative_where_the_optimum_is_not_degenerate():
    smooth = 0
    for seed in RANDOM_SEEDS:
        question = random_question(seed, "prices")
        for price in plan(question).prices or ():
            more, less = slopes(question, price.name)
            if less - more <= 5e-3 * less:
                smooth += 1
                assert price.price == pytest.approx(more, rel=1e-2, abs=1e-6)
    assert smooth >= 10


def test_prices_of_motors_and_of_the_structure_are_in_units_of_their_own():
    for section, number, weak, limit, unit in [
        ("structure", "held_mass", 20.0, "hand_load", "N"),
        ("structure", "finger_shear", 60.0, "finger_shear", "N"),
        ("motor", "maximum_torque", 1e-3, "motor_torque", "N·m"),
        ("motor", "maximum_current", 0.06, "motor_current", "A"),
    ]:
        stance = on_wall()
        robot = with_hand(stance.robot, changed_hand(section, number, weak))
        question = ask(replace(stance, robot=robot), "prices")
        price = next(p for p in plan(question).prices if p.name.limit == limit)
        assert price.unit == unit
        more, less = slopes(question, price.name)
        slack = 2e-3 * max(more, less) + 1e-7
        assert more - slack <= price.price <= less + slack


@pytest.mark.parametrize("question", QUESTIONS.values(), ids=QUESTIONS.keys())
def test_limits_without_a_price_could_be_ten_times_as_much_and_nothing_would_change(question):
    answer = plan(question)
    priced = {price.name for price in answer.prices}
    relaxed = utilisation_with(question, lambda n, s: s if n in priced else 10.0 * s)
    assert relaxed == pytest.approx(peer.least_utilisation(question).fun, rel=1e-5)


def test_prices_times_capacities_add_up_to_the_least_utilisation():
    """With every capacity one per cent up, the utilisation is one per cent down."""
    for question in QUESTIONS.values():
        answer = plan(question)
        total = sum(price.price * capacities(question)[price.name] for price in answer.prices)
        assert total == pytest.approx(peer.least_utilisation(question).fun, rel=1e-4)


def test_prices_come_in_order_of_what_one_per_cent_more_would_do_each_limit_once():
    for question in QUESTIONS.values():
        prices = plan(question).prices
        assert len({price.name for price in prices}) == len(prices)
        values = [price.price * capacities(question)[price.name] for price in prices]
        for first, second in itertools.pairwise(values):
            assert first >= second - 1e-5
        assert min(values) > 0.0


def test_a_tension_cap_that_binds_has_a_price():
    question = ask(on_wall(), "prices", limits=Limits(tendon_tension=60.0))
    answer = plan(question)
    assert answer.limiting.limit == "tendon_tension"
    assert {price.name.limit for price in answer.prices} >= {"tendon_tension"}


def test_prices_are_given_only_where_they_are_wanted_and_there_is_a_plan():
    assert plan(ask(on_wall())).prices is None
    assert plan(ask(on_wall(Plane(), outer_rotation=0.0), "prices")).prices is None
