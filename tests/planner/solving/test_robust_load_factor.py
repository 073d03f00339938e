"""The load factor over a scatter of the hands' places: what stances put there have, and no less."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hand_models.base import InvalidInputError, Pose
from hand_models.fixed_wrist import scattered_places
from hand_models.parameters import ParameterTable, own_hand
from hand_models.rock import Plane
from planner.deadline import DeadlineError
from planner.prepare import settle_hand
from planner.question import Limits, Question, Stance
from planner.robots import robosimian
from planner.solving import KnownStance, plan, robust
from service.answering.questions import question
from service.commands.stances import read_request
from service.tables.extras import robust_sentence
from tests.suite.helpers.stances import ask, on_wall

POSITION, ANGLE = 0.002, 0.02
"""The bundled hand's scatter [m], [rad]."""

FIRST = (-0.3038674947, -0.0971783176, -0.0417198502, -0.0294203945, -0.7074309662, -0.8679381330)
"""A hand's first place."""


def factors_one_by_one(asked: Question) -> list[float]:
    """Load factors of stances whose rock is moved, planned one by one; 0 where there is none."""
    stance = asked.stance
    seats = [settle_hand(hand, stance).seating.pose for hand in stance.hands]
    limbs = [hand.limb for hand in stance.hands]
    places = [scattered_places(limb, robust.SCATTER_SETTINGS.places, 0) for limb in limbs]
    counts = robust.SCATTER_SETTINGS.places, robust.SETTINGS.rounds
    taken = [robust._taken(limb, *counts) for limb in limbs]
    factors = []
    for sample in zip(*taken, strict=True):
        hands = tuple(
            replace(
                hand,
                hold_pose=None,
                hold_in_hand=Pose(
                    POSITION * by[:3], Rotation.from_rotvec(ANGLE * by[3:]).as_matrix()
                ).inverse()
                @ seat,
                seat="rest",
            )
            for hand, seat, by in zip(
                stance.hands,
                seats,
                [p[k] for p, k in zip(places, sample, strict=True)],
                strict=True,
            )
        )
        there = replace(asked, stance=replace(stance, hands=hands), want=frozenset(["load_factor"]))
        try:
            factors.append(plan(there).load_factor or 0.0)
        except InvalidInputError:
            factors.append(0.0)
    return factors


def few(monkeypatch, places: int, rounds: int) -> None:
    """Let there be fewer samples."""
    settings = replace(robust.SCATTER_SETTINGS, places=places)
    monkeypatch.setattr(robust, "SCATTER_SETTINGS", settings)
    monkeypatch.setattr(robust, "SETTINGS", replace(robust.SETTINGS, rounds=rounds))


@pytest.mark.parametrize("name", ["wall-300", "ledge"])
def test_the_order_of_hands_does_not_matter(monkeypatch, name):
    few(monkeypatch, 8, 2)
    asked = asked_of(name)
    hands = asked.stance.hands
    one = plan(asked).robust
    order = (*hands[2:], *hands[:2])
    other = plan(replace(asked, stance=replace(asked.stance, hands=order))).robust
    assert other.tenth == pytest.approx(one.tenth, rel=1e-6, abs=1e-9)
    assert other.hundredth == pytest.approx(one.hundredth, rel=1e-6, abs=1e-9)
    assert other.tenth_interval == pytest.approx(one.tenth_interval, rel=1e-6, abs=1e-9)
    assert (other.without, other.refused) == (one.without, one.refused)


def test_the_places_of_a_hand_do_not_hang_on_other_hands():
    """Every hand has its own, evenly spread along each axis, and all of a name are the same."""
    own = scattered_places("front_left", 128, 0)
    np.testing.assert_array_equal(own, scattered_places("front_left", 128, 0))
    assert not np.array_equal(own, scattered_places("front_right", 128, 0))
    assert not np.array_equal(own, scattered_places("front_left", 128, 1))
    for axis in own.T:
        counts, _ = np.histogram(axis, bins=16, range=(-1.0, 1.0))
        np.testing.assert_array_equal(counts, 8)


def test_the_places_are_the_same_on_every_machine():
    """Worked out once, with SciPy 1.17 and NumPy 2."""
    np.testing.assert_allclose(scattered_places("front_left", 2, 0)[0], FIRST, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["wall-300", "ledge"])
def test_the_tenth_is_steady_under_another_scramble_and_within_its_interval(monkeypatch, name):
    """Within a tenth of itself, or of the hundredth of a load factor where it is about none."""
    found = []
    for seed in range(4):
        monkeypatch.setattr(robust, "SETTINGS", replace(robust.SETTINGS, seed=seed))
        found.append(plan(asked_of(name)).robust)
    middle = float(np.mean([each.tenth for each in found]))
    for each in found:
        assert each.tenth == pytest.approx(middle, rel=0.1, abs=0.02)
        low, high = each.tenth_interval
        assert low <= each.tenth <= high
        assert low - 1e-9 <= middle <= high + 1e-9


def asked_of(name: str, **kwargs) -> Question:
    return replace(question(read_request(name)), want=frozenset(["robust"]), **kwargs)


@pytest.mark.parametrize(
    ("asked", "places", "rounds"),
    [
        (ask(on_wall(), "robust", limits=Limits(tendon_tension=150.0)), 4, 2),
        (asked_of("wall-300-joints"), 4, 2),
        (asked_of("ledge"), 4, 2),
        pytest.param(asked_of("wall-300"), 32, 2, marks=pytest.mark.slow),
        pytest.param(asked_of("boulders"), 16, 2, marks=pytest.mark.slow),
    ],
    ids=["capped", "joints", "refused", "wall-300", "boulders"],
)
def test_it_is_the_load_factor_of_stances_whose_rock_is_elsewhere(
    monkeypatch, asked, places, rounds
):
    few(monkeypatch, places, rounds)
    found = plan(asked).robust
    assert (found.draws, found.places) == (places * rounds, places)
    assert (found.position, found.angle, found.seed) == (POSITION, ANGLE, 0)
    factors = factors_one_by_one(asked)
    assert found.without == sum(factor == 0.0 for factor in factors)
    assert found.tenth == pytest.approx(np.percentile(factors, 10.0), rel=1e-6, abs=1e-6)
    assert found.hundredth == pytest.approx(np.percentile(factors, 1.0), rel=1e-6, abs=1e-6)
    assert found.worst == found.hundredth
    assert plan(asked).robust == found


def test_samples_without_a_load_factor_count_as_zero(monkeypatch):
    """On a ledge three of four have none: what is held in nine of ten is nothing."""
    few(monkeypatch, 16, 2)
    found = plan(asked_of("ledge")).robust
    assert found.without > 0.5 * found.draws
    assert (found.tenth, found.hundredth, found.worst) == (0.0, 0.0, 0.0)
    assert found.tenth_interval[0] == 0.0


@pytest.mark.parametrize("hands", range(1, 5))
def test_the_interval_is_that_of_a_binomial_where_places_say_nothing_and_wider_where_all(hands):
    rng = np.random.default_rng(hands)
    taken = np.array(
        [
            np.concatenate(
                [
                    rng.permutation(robust.SCATTER_SETTINGS.places)
                    for _ in range(robust.SETTINGS.rounds)
                ]
            )
            for _ in range(hands)
        ]
    )
    samples = taken.shape[1]
    apart = rng.uniform(size=samples)
    off = 1.96 * math.sqrt(0.09 / samples)
    low, high = robust._interval(apart, taken, 10.0, robust.SCATTER_SETTINGS.places)
    assert low == pytest.approx(np.quantile(apart, 0.1 - off), abs=0.01)
    assert high == pytest.approx(np.quantile(apart, 0.1 + off), abs=0.01)
    # the first hand's place alone says how much is held: as many samples as places count
    by_place = np.sort(rng.uniform(size=robust.SCATTER_SETTINGS.places))[taken[0]]
    off = 1.96 * math.sqrt(0.09 / robust.SCATTER_SETTINGS.places)
    low, high = robust._interval(by_place, taken, 10.0, robust.SCATTER_SETTINGS.places)
    assert low == pytest.approx(np.quantile(by_place, 0.1 - off), abs=0.02)
    assert high == pytest.approx(np.quantile(by_place, 0.1 + off), abs=0.02)


def test_it_is_less_than_where_the_hands_were_put(monkeypatch):
    few(monkeypatch, 8, 2)
    answer = plan(ask(on_wall(), "robust", "load_factor"))
    assert 0.0 <= answer.robust.hundredth <= answer.robust.tenth < answer.load_factor
    assert plan(ask(on_wall(), "load_factor")).robust is None


def steady(stance: Stance) -> Stance:
    """The same with hands that are where they were put."""
    none = {"value": 0.0, "source": "assumed", "note": "exact"}
    seat = {"scatter_position": none | {"unit": "m"}, "scatter_angle": none | {"unit": "rad"}}
    return replace(stance, robot=robosimian(own_hand(ParameterTable.of({"seat": seat}))))


def test_without_scatter_it_is_the_load_factor(monkeypatch):
    few(monkeypatch, 2, 2)
    answer = plan(ask(steady(on_wall()), "robust", "load_factor"))
    assert answer.robust.without == 0
    assert answer.robust.hundredth == pytest.approx(answer.load_factor, rel=1e-6)
    assert answer.robust.tenth == pytest.approx(answer.load_factor, rel=1e-6)


@pytest.mark.slow
def test_hands_that_cannot_be_there_are_named():
    """On a plane with its palm on it, half of the places are in the rock."""
    first, *others = on_wall(limbs=("front_left", "front_right")).hands
    flat = replace(first, hold=Plane(), hold_in_hand=Pose.identity())
    asked = ask(replace(on_wall(), hands=(flat, *others)), "robust")
    found = plan(asked).robust
    assert set(found.refused) == {"front_left"}
    assert 0 < found.refused["front_left"] <= found.without
    (reason,) = found.reasons.values()
    assert "inside" in reason
    assert f"front_left in {found.refused['front_left']} ({reason})" in robust_sentence(found)


def test_where_no_draw_is_held_there_is_none(monkeypatch):
    few(monkeypatch, 2, 2)
    answer = plan(ask(on_wall(Plane(), outer_rotation=0.0), "robust"))
    assert answer.status == "infeasible"
    assert (answer.robust.without, answer.robust.worst, answer.robust.tenth) == (4, 0.0, 0.0)


def test_of_no_body_wrench_there_is_none():
    assert plan(ask(on_wall(), "robust", body_wrench=np.zeros(6))).robust is None


def test_a_known_stance_tells_it_for_each_wrench(monkeypatch):
    few(monkeypatch, 4, 2)
    asked = ask(on_wall(), "robust")
    wrench = 0.5 * asked.needed_wrench()
    once = plan(asked).robust
    again = KnownStance(asked).plan(wrench).robust
    assert once.tenth > 0.0
    assert again.tenth == pytest.approx(2.0 * once.tenth, rel=1e-6)


def test_floating_hands_are_refused():
    first, *others = on_wall().hands
    stance = replace(on_wall(), hands=(replace(first, wrist="floating"), *others))
    with pytest.raises(InvalidInputError, match="requires fixed or compliant wrists") as caught:
        ask(stance, "robust")
    assert caught.value.field == "want"


def compliant(name: str = "wall-300") -> Question:
    asked = asked_of(name)
    hands = tuple([replace(hand, wrist="compliant") for hand in asked.stance.hands])
    return replace(asked, stance=replace(asked.stance, hands=hands))


@pytest.mark.slow
def test_compliant_hands_are_planned_anew_at_each_place(monkeypatch):
    monkeypatch.setattr(robust, "SETTINGS", replace(robust.SETTINGS, searches=4, rounds=1))
    monkeypatch.setattr(robust, "SCATTER_SETTINGS", replace(robust.SCATTER_SETTINGS, places=4))
    asked = compliant()
    found = plan(asked).robust
    assert (found.draws, found.places, found.without) == (4, 4, 0)
    factors = factors_one_by_one(asked)
    # a search that begins at another plan may end some per cent elsewhere
    assert found.tenth == pytest.approx(np.percentile(factors, 10.0), rel=0.05)
    low, high = found.replanned.tenth_interval
    assert low <= found.tenth <= high


def test_a_deadline_leaves_the_samples_that_are_planned():
    hand = settle_hand(on_wall().hands[0], on_wall())
    taken, planned = np.zeros((1, 20), dtype=int), []

    def factor(there) -> float:
        if len(planned) == 18:
            raise DeadlineError(1.0, "all samples were planned")
        planned.append(there)
        return 1.0

    assert len(robust._factors([[hand]], taken, factor, 16)) == 18
    planned = planned[:18]
    with pytest.raises(DeadlineError):
        robust._factors([[hand]], taken, factor, math.inf)
