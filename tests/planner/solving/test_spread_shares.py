"""What a spread is told to hang on: shares of quantities, the threshold of rock, few numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs
from scipy.stats import spearmanr

from hand_models.parameters import bundled_draws, draw_table
from hand_models.rock import Plane
from hand_models.tile import Surface
from planner.question import Limits, drawn_hands, drawn_quantities
from planner.result import DrawnPlan, Quantiles, Spread
from planner.solving import plan, spread
from planner.verification import Check
from tests.suite.helpers.spreads import FEW, STRENGTHS, asked_of, drawn, entry
from tests.suite.helpers.stances import TILE_60N, ask, on_wall


def test_shares_are_squared_rank_correlations():
    found = plan(asked_of("wall-300")).spread
    draws = bundled_draws()
    values = {
        "rock.shear_limit": [draw.surfaces.scalar("rock", "shear_limit") for draw in draws],
    }
    for section, name in (("finger", "pulley_radii"), ("tile", "contact_stiffness")):
        lists = [draw.hand.vector(section, name) for draw in draws]
        for i, each in enumerate(np.transpose(lists)):
            if np.ptp(each) > 0.0:
                values[f"{section}.{name}[{i}]"] = each
    shares = {
        name: spearmanr(each, found.load_factors).statistic ** 2 for name, each in values.items()
    }
    assert found.sensitive_to[0].quantity == max(shares, key=shares.get) == "rock.shear_limit"
    told = {each.quantity: each.share for each in found.sensitive_to}
    assert len(told) == 3
    for name in told.keys() & shares.keys():
        assert told[name] == pytest.approx(shares[name])


@pytest.mark.usefixtures("few_draws")
@pytest.mark.parametrize(
    ("name", "cap"), [("wall-300", 1.0), ("wall-300", 0.8), pytest.param("ledge", 1.0)]
)
def test_the_threshold_is_the_least_rock_that_holds(name, cap):
    asked = replace(asked_of(name), limits=Limits(utilisation=cap))
    limit = plan(asked).spread.threshold
    for factor, status in ((1.02, "optimal"), (0.98, "overloaded")):
        rock = Surface.from_values({"shear_limit": factor * limit.shear_limit})
        hands = tuple(replace(hand, surface=rock) for hand in asked.stance.hands)
        there = replace(asked, stance=replace(asked.stance, hands=hands), want=frozenset())
        assert plan(there).status == status
    sandpaper = Surface.named("sandpaper-36").shear_limit
    assert limit.ratio == pytest.approx(limit.shear_limit / sandpaper)
    assert limit.range == [2.0, 5.0]
    assert limit.share == pytest.approx((5.0 - limit.ratio) / 3.0)


@pytest.mark.usefixtures("few_draws")
@pytest.mark.parametrize(("mass", "share"), [(20.0, 1.0), (300.0, 0.0)])
def test_a_light_robot_holds_on_all_rock_of_the_range_and_a_heavy_one_on_none(mass, share):
    asked = asked_of("wall-300")
    limit = plan(replace(asked, load=structs.replace(asked.load, mass=mass))).spread.threshold
    assert limit.share == share
    assert limit.ratio == (2.0 if share else None)


@pytest.mark.usefixtures("few_draws")
def test_rock_that_is_known_has_no_threshold():
    assert plan(ask(on_wall(surface=TILE_60N), "spread")).spread.threshold is None
    assert plan(ask(on_wall(), "spread", draws=FEW)).spread.threshold is None
    assert (
        plan(ask(on_wall(surface=Surface.named("concrete-fine")), "spread")).spread.threshold
        is None
    )


def test_shares_with_the_rock_apart_are_of_the_variance_that_it_leaves():
    rng = np.random.default_rng(3)
    rock, a, b, c = rng.random((4, 40))
    a += 0.5 * rock
    factors = 2.0 * rock - 0.5 * rock**2 + 0.1 * a - 0.05 * b + 0.01 * rng.random(40)
    values = {
        "finger.a": a,
        "rock.shear_limit": rock,
        "tile.b": b,
        "tile.c": c,
        "tile.again": 2 * b,
    }
    found = Spread.of(
        [DrawnPlan(load_factor=factor) for factor in factors],
        1.0,
        {},
        values,
        sources={"finger.a": "assumed", "tile.b": "calibrated"},
    )

    def rest(each):
        return each - np.polyval(np.polyfit(rock, each, 2), rock)

    left = rest(factors)
    assert found.rock_share == pytest.approx(1.0 - left.var() / factors.var())
    shares = {
        name: np.corrcoef(rest(values[name]), left)[0, 1] ** 2 for name in ("finger.a", "tile.b")
    }
    told = {each.quantity: each.share for each in found.rock_apart}
    assert told == pytest.approx(shares)
    assert [each.source for each in found.rock_apart] == ["assumed", "calibrated"]
    # of a few samples none is left to explain anything
    few = Spread.of(
        [DrawnPlan(load_factor=f) for f in factors[:4]], 1.0, {}, {"rock.shear_limit": rock[:4]}
    )
    assert few.rock_share is None


@pytest.mark.usefixtures("few_draws")
def test_what_was_fitted_is_told_from_what_was_assumed():
    hands = drawn_hands(on_wall().robot.hand, limbs=("front_left",))
    named = drawn_quantities(hands, frozenset(["rock"]))
    sources = {name: spread._source(hands[0], name) for name in named}
    for name in ("finger.pulley_radii[1]", "tile.contact_stiffness[0]", "defaults.friction"):
        assert sources[name] == "calibrated"
    for name in ("finger.seated_contact", "rock.shear_limit", "tile.engagement_exponent"):
        assert sources[name] == "assumed"
    assert sources["tile.half_planes"] == sources["palm.contact_stiffness[0]"] == "assumed"
    ranges = draw_table().sections["ranges"]
    assert sources["discrepancy.common"] == ranges["discrepancy"].source
    assert sources["discrepancy.front_left"] == ranges["discrepancy"].source
    found = plan(asked_of("ledge")).spread
    for each in (*found.rock_apart, *found.sensitive_to):
        if not each.quantity.startswith("discrepancy"):
            assert each.source == sources[each.quantity]
    assert 0.2 < found.rock_share < 1.0


def test_of_few_numbers_all_are_told_and_of_many_their_quantiles():
    values = np.random.default_rng(0).permutation(21).tolist()
    assert Quantiles.of(values) == Quantiles(1.0, 10.0, 19.0)
    assert Quantiles.of([None, *range(19)]) == Quantiles(0.0, 9.0, 18.0)
    assert Quantiles.of([None]) is None


def test_ties_and_missing_load_factors_are_minded():
    factors = [1.0, 2.0, 2.0, None, 3.0, 4.0]
    drawn_values = {"a": np.array([1.0, 3.0, 3.0, 9.0, 2.0, 5.0]), "same": np.ones(6)}
    found = Spread.of([DrawnPlan(load_factor=factor) for factor in factors], 1.0, {}, drawn_values)
    there = [0, 1, 2, 4, 5]
    told = spearmanr(drawn_values["a"][there], [factors[k] for k in there]).statistic ** 2
    assert [each.quantity for each in found.sensitive_to] == ["a"]
    assert found.sensitive_to[0].share == pytest.approx(told)
    assert found.utilisation is None
    few = Spread.of([DrawnPlan(load_factor=factor) for factor in (1.0, 2.0)], 1.0, {}, {})
    assert few.sensitive_to == []


def test_what_is_overloaded_without_a_load_factor_counts_as_0():
    plans = [DrawnPlan(1.5), DrawnPlan(), DrawnPlan(0.5, 2.0, True), DrawnPlan(0.8, 1.2, True)]
    assert Spread.of(plans, 1.0, {}, {}).load_factor == Quantiles(0.0, 0.6, 2.0)
    # without a load every multiple of it is held
    unloaded = [DrawnPlan(0.3, None, True), DrawnPlan(0.4, None, True)]
    assert Spread.of(unloaded, 1.0, {}, {}).load_factor is None


def test_draws_without_an_answer_do_not_hold_and_are_told():
    weak = drawn(tendon={"maximum_tension": entry(50.0, "N")})
    stance = on_wall(closing_tension=60.0)
    found = plan(ask(stance, "spread", draws=(STRENGTHS[2], weak))).spread
    assert (found.draws, found.holds, found.without) == (2, 1, 1)
    assert found.refused == dict.fromkeys((hand.limb for hand in on_wall().hands), 1)
    assert found.load_factors[1] is found.utilisations[1] is None
    assert found.load_factor.low == 0.0
    assert found.load_factor.median == 0.5 * found.load_factors[0]
    assert found.load_factor.high == found.load_factors[0]


def test_where_no_draw_balances_none_holds():
    answer = plan(ask(on_wall(Plane(), outer_rotation=0.0), "spread", draws=STRENGTHS))
    assert answer.status == "infeasible"
    found = answer.spread
    assert (found.draws, found.holds, found.without, found.refused) == (4, 0, 4, {})
    assert found.utilisation is found.load_factor is None


def test_a_plan_that_fails_its_check_is_no_answer(monkeypatch):
    asked = ask(on_wall(), "spread", draws=STRENGTHS[:3])
    whole = plan(asked)
    checked, count = Check.problems, 0

    def problems(self, *args):
        nonlocal count
        hands = self.known.hands
        bad = hands[0].surface.shear_limit == 65.0
        count += bad
        return ["off"] if bad else checked(self, *args)

    monkeypatch.setattr(Check, "problems", problems)
    found = plan(asked)
    assert found.verified
    assert count
    assert found.spread.utilisations == [
        whole.spread.utilisations[0],
        None,
        whole.spread.utilisations[2],
    ]
    assert found.spread.without == 1
