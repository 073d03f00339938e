"""Survival: the formula against samples, known figures, new set-points, what is not simulated."""

import itertools
import math
from dataclasses import replace
from functools import cache

import msgspec
import numpy as np
import pytest
from scipy import stats

from hand_models.tile import TileStrengths
from planner import Plan, Question, SurvivalSettings, SurvivalShare, find_survival, plan
from planner.prepare import prepare_stance
from planner.result import Survival
from planner.simulation import Cascade, draw_slips, plan_loads, survival as simulated
from service.answering import question
from service.commands.stances import read_request
from service.requests import PlanRequest
from tests.suite.helpers.random_requests import random_request

PLAIN = {"hold_scatter": 0.0, "rock_scatter": 0.0}


@cache
def planned(name: str) -> tuple[Question, Plan]:
    asked = question(read_request(name))
    return asked, plan(asked)


def survival(name: str, **settings: object) -> Survival:
    asked, answer = planned(name)
    assert answer.hands is not None
    return find_survival(asked, answer.hands, SurvivalSettings(**settings))


def test_known_figures_of_wall_300():
    """4.6 and 10.2 times the strength, of tiles whose mean is not that of weakest ones."""
    found = survival("wall-300", draws=1, replanned=0, **PLAIN)
    (rock,) = found.surfaces
    assert rock.modulus == pytest.approx(2.995, abs=1e-3)
    assert rock.source == "assumed"
    assert rock.mean == pytest.approx(6.0 ** (1.0 / rock.modulus))
    assert found.strength_90 * rock.mean == pytest.approx(4.66, abs=0.02)
    assert found.strength_99 * rock.mean == pytest.approx(10.22, abs=0.03)


def test_no_slip_is_worked_by_hand_from_the_plan():
    found = survival("slab", draws=1, replanned=0, strength=1.3, **PLAIN)
    _, answer = planned("slab")
    assert answer.hands is not None
    hazard, by_name = 0.0, {each.surface: each for each in found.surfaces}
    asked, _ = planned("slab")
    for hand, on_hold in zip(answer.hands, asked.stance.hands, strict=True):
        law = by_name[on_hold.surface.name]
        on = [tile.contact in ("face", "edge") for tile in hand.tiles]
        # a shear of the whole palm counts as that of one tile
        used = [*hand.tile_utilisations[on], -hand.palm.force[0] / shear_limit(asked, hand.limb)]
        unit = math.gamma(1.0 + 1.0 / law.modulus) / law.mean / 1.3
        hazard += sum((max(u, 0.0) * unit) ** law.modulus for u in used)
    assert found.no_slip == pytest.approx(math.exp(-hazard), rel=1e-9)


def shear_limit(asked: Question, limb: str) -> float:
    from planner import hand_space

    settled, _ = hand_space(asked.stance, limb)
    return settled.palm.shear_limit


@pytest.mark.parametrize("name", ["wall-300", "slab", "boulders"])
def test_simulated_slips_are_those_of_the_formula(name):
    found = survival(name, draws=4000, replanned=0, seed=3, strength=1.6)
    assert found.slipped is not None
    expected = 1.0 - found.no_slip
    deviation = math.sqrt(expected * (1.0 - expected) / 4000)
    assert abs(found.slipped.probability - expected) < 4.0 * deviation
    assert found.holds is not None
    assert found.holds.probability >= found.no_slip - 4.0 * deviation
    assert sum(found.first.values()) <= found.slipped.probability + 1e-12


def test_new_set_points_save_what_fixed_tensions_lose():
    found = survival("wall-300", draws=20, replanned=20, strength=1.5, **PLAIN)
    assert found.holds is not None
    assert found.replanned is not None
    assert found.holds.draws == found.replanned.draws
    assert found.replanned.probability > found.holds.probability
    assert found.replanned.probability >= 0.95
    # so late that everything has slipped that will
    late = survival("wall-300", draws=20, replanned=20, strength=1.5, delay=10.0, **PLAIN)
    assert late.replanned is not None
    assert late.replanned.probability == late.holds.probability == found.holds.probability


@pytest.mark.slow
@pytest.mark.parametrize("name", ["wall-300", "slab", "boulders"])
def test_what_is_given_up_is_lost_in_the_end(name, monkeypatch):
    given_up = survival(name, draws=40, replanned=40, seed=7)
    to_the_end = replace(simulated.DRAW_SETTINGS, hopeless=math.inf)
    monkeypatch.setattr(simulated, "DRAW_SETTINGS", to_the_end)
    assert survival(name, draws=40, replanned=40, seed=7).replanned == given_up.replanned


def test_a_cascade_is_a_way_from_slip_to_slip():
    found = survival("wall", draws=200, replanned=0, strength=1.5)
    assert len(found.cascade) > 1
    assert all(slip.load > 1.0 for slip in found.cascade)
    for before, after in itertools.pairwise(found.cascade):
        assert before.most == after.load
    last = found.cascade[-1].most
    assert found.cascade_holds == (last is not None and last <= 1.0)
    names = [(slip.limb, slip.finger, slip.phalanx) for slip in found.cascade]
    assert len(set(names)) == len(names)


def test_the_seed_makes_the_draws():
    one, same = (survival("wall", draws=300, replanned=0, seed=5) for _ in range(2))
    other = survival("wall", draws=300, replanned=0, seed=6)
    assert one == same
    assert other.no_slip == one.no_slip
    assert other.first != one.first


def test_the_tail_is_named_where_survival_rests_on_it():
    safe = survival("slab", draws=10, replanned=0, strength=20.0)
    assert safe.no_slip > 0.95
    assert safe.tail is not None
    assert "m = 3" in safe.tail
    assert "assumed" in safe.tail
    assert survival("wall-300", draws=50, replanned=0, strength=0.5).tail is None


@pytest.mark.parametrize(
    ("name", "why"), [("wall-300-floating", "wrist"), ("ledge", "fingernails")]
)
def test_what_is_not_simulated_says_why_and_has_the_formula_all_the_same(name, why):
    found = survival(name)
    assert why in (found.reason or "")
    assert found.holds is found.replanned is found.slipped is None
    assert 0.0 < found.no_slip < 1.0
    assert found.strength_99 > found.strength_90 > 0.0


@pytest.mark.parametrize(
    ("floating", "told"),
    [
        (("rear_left",), "the wrist of rear_left moves: where it goes "),
        (("rear_right", "rear_left"), "the wrists of rear_right, rear_left move: where they go "),
    ],
)
def test_one_wrist_and_several_have_words_of_their_own(floating, told):
    request = read_request("wall-300")
    hands = [
        msgspec.structs.replace(hand, wrist="floating" if hand.limb in floating else "fixed")
        for hand in request.stance.hands
    ]
    stance = msgspec.structs.replace(request.stance, hands=hands)
    asked = question(msgspec.structs.replace(request, stance=stance))
    found = find_survival(asked, plan(asked).hands, SurvivalSettings(draws=1, replanned=0))
    assert told in found.reason


@pytest.mark.parametrize(("count", "draws"), [(0, 10), (3, 17), (400, 400), (973, 1000)])
def test_the_interval_is_wilsons(count, draws):
    share = SurvivalShare.of(count, draws)
    low, high = stats.binomtest(count, draws).proportion_ci(method="wilson")
    assert (share.low, share.high) == (pytest.approx(low), pytest.approx(high))


@pytest.mark.slow
def test_processes_make_the_same_draws():
    asked, answer = planned("slab")
    assert answer.hands is not None
    settings = SurvivalSettings(draws=230, replanned=7, seed=1, strength=0.9)
    done: list[tuple[int, int]] = []
    alone = find_survival(asked, answer.hands, settings)
    shared = find_survival(
        asked, answer.hands, settings, workers=2, progress=lambda *each: done.append(each)
    )
    assert alone == shared
    assert alone.replanned is not None
    assert alone.replanned.draws == 7
    assert done == [(i, 4) for i in range(1, 5)]


def test_more_draws_begin_with_the_same_ones():
    asked, answer = planned("wall")
    assert answer.hands is not None
    prepared = prepare_stance(asked)
    few, many = (
        draw_slips(prepared, answer.hands, SurvivalSettings(draws=n, replanned=0)).held
        for n in (70, 130)
    )
    assert few.tolist() == many[:70].tolist()
    assert 0 < few.sum() < 70


@pytest.mark.parametrize(
    ("settings", "field"),
    [
        ({"draws": 0}, "draws"),
        ({"strength": math.nan}, "strength"),
        ({"delay": -1.0}, "delay"),
        ({"draws": 10, "replanned": 11}, "replanned"),
        ({"hold_scatter": 3.0}, "hold_scatter"),
    ],
)
def test_settings_out_of_range_are_refused(settings, field):
    from hand_models import InvalidInputError

    with pytest.raises((InvalidInputError, ValueError), match=field):
        SurvivalSettings(**settings)


def test_no_more_draws_are_planned_anew_than_there_are():
    assert SurvivalSettings(draws=5).replanned == 5
    assert SurvivalSettings(draws=5, replanned=2).replanned == 2
    assert SurvivalSettings().replanned == 100


@pytest.mark.slow
def test_the_formula_is_in_the_simulators_interval_on_random_stances():
    """Of 200 stances, 10,000 draws each; 190 are due, and 180 are asked for."""
    inside = count = seed = 0
    while count < 200:
        seed += 1
        document = random_request(seed)
        document.pop("limits", None)
        asked = question(msgspec.convert(document, PlanRequest))
        answer = plan(asked)
        if answer.hands is None:
            continue
        prepared = prepare_stance(asked)
        cascade = Cascade(prepared, plan_loads(prepared, answer.hands))
        hand = np.concatenate([prepared.batch.places.hand, np.arange(len(answer.hands))])
        law = TileStrengths.of([each.surface for each in prepared.batch.hands], hand)
        due = np.random.default_rng(seed).uniform(0.05, 0.95)
        strength = law.factor_for(cascade.used, due)
        if strength == 0.0:
            continue
        outcome = cascade.run(law.sample(10_000, seed, strength), most=1)
        share = SurvivalShare.of(int((outcome.slips == 0).sum()), 10_000)
        count += 1
        inside += share.low <= law.no_slip(cascade.used, strength) <= share.high
    print(f"{inside} of {count} stances inside")
    assert inside >= 180
