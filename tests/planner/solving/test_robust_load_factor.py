"""The load factor over a scatter of the hands' places: what stances put there have, and no less."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hand_models.base import InvalidInputError, Pose
from hand_models.parameters import ParameterTable, own_hand
from hand_models.rock import Plane
from planner.prepare import settle_hand
from planner.question import Limits, Question, Stance
from planner.robots import robosimian
from planner.solving import KnownStance, load_factor, plan
from service.answering.questions import question
from service.commands.stances import read_request
from tests.suite.helpers.stances import ask, on_wall

POSITION, ANGLE = 0.002, 0.02
"""The bundled hand's scatter [m], [rad]."""


def drawn_factors(asked: Question, draws: int) -> list[float | None]:
    """Load factors of stances whose rock is moved, planned one by one; None where there is none."""
    stance = asked.stance
    seats = [settle_hand(hand, stance).seating.pose for hand in stance.hands]
    factors = []
    by_name = np.argsort(np.argsort([hand.limb for hand in stance.hands]))
    for each in np.random.default_rng(0).uniform(-1.0, 1.0, (draws, len(seats), 6)):
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
            for hand, seat, by in zip(stance.hands, seats, each[by_name], strict=True)
        )
        there = replace(asked, stance=replace(stance, hands=hands), want=frozenset(["load_factor"]))
        try:
            factors.append(plan(there).load_factor)
        except InvalidInputError:
            factors.append(None)
    return factors


def test_the_order_of_hands_does_not_matter(monkeypatch):
    monkeypatch.setattr(load_factor, "DRAWS", 4)
    asked = asked_of("wall-300")
    turned = replace(asked, stance=replace(asked.stance, hands=asked.stance.hands[::-1]))
    one, other = plan(asked).robust, plan(turned).robust
    assert other.worst == pytest.approx(one.worst, rel=1e-6)
    assert other.tenth == pytest.approx(one.tenth, rel=1e-6)


def asked_of(name: str, **kwargs) -> Question:
    return replace(question(read_request(name)), want=frozenset(["robust"]), **kwargs)


@pytest.mark.parametrize(
    ("asked", "draws"),
    [
        (ask(on_wall(), "robust", limits=Limits(tendon_tension=150.0)), 8),
        (asked_of("wall-300-joints"), 6),
        (asked_of("ledge"), 6),
        pytest.param(asked_of("boulders"), 2, marks=pytest.mark.slow),
        pytest.param(asked_of("wall-300"), 50, marks=pytest.mark.slow),
        pytest.param(asked_of("boulders"), 50, marks=pytest.mark.slow),
    ],
    ids=["capped", "joints", "refused", "mesh", "wall-300", "boulders"],
)
def test_it_is_the_load_factor_of_stances_whose_rock_is_elsewhere(monkeypatch, asked, draws):
    monkeypatch.setattr(load_factor, "DRAWS", draws)
    robust = plan(asked).robust
    assert (robust.draws, robust.position, robust.angle, robust.seed) == (draws, POSITION, ANGLE, 0)
    factors = [factor for factor in drawn_factors(asked, draws) if factor is not None]
    assert robust.without == draws - len(factors)
    assert robust.worst == pytest.approx(min(factors), rel=1e-6, abs=1e-6)
    assert robust.tenth == pytest.approx(np.percentile(factors, 10.0), rel=1e-6, abs=1e-6)
    assert plan(asked).robust == robust


def test_it_is_less_than_where_the_hands_were_put(monkeypatch):
    monkeypatch.setattr(load_factor, "DRAWS", 10)
    answer = plan(ask(on_wall(), "robust", "load_factor"))
    assert 0.0 < answer.robust.worst <= answer.robust.tenth < answer.load_factor
    assert plan(ask(on_wall(), "load_factor")).robust is None


def steady(stance: Stance) -> Stance:
    """The same with hands that are where they were put."""
    none = {"value": 0.0, "source": "assumed", "note": "exact"}
    seat = {"scatter_position": none | {"unit": "m"}, "scatter_angle": none | {"unit": "rad"}}
    return replace(stance, robot=robosimian(own_hand(ParameterTable.of({"seat": seat}))))


def test_without_scatter_it_is_the_load_factor(monkeypatch):
    monkeypatch.setattr(load_factor, "DRAWS", 2)
    answer = plan(ask(steady(on_wall()), "robust", "load_factor"))
    assert answer.robust.without == 0
    assert answer.robust.worst == pytest.approx(answer.load_factor, rel=1e-6)
    assert answer.robust.tenth == pytest.approx(answer.load_factor, rel=1e-6)


@pytest.mark.slow
def test_hands_that_cannot_be_there_are_named():
    """On a plane with its palm on it, half of the places are in the rock."""
    first, *others = on_wall(limbs=("front_left", "front_right")).hands
    flat = replace(first, hold=Plane(), hold_in_hand=Pose.identity())
    asked = ask(replace(on_wall(), hands=(flat, *others)), "robust")
    robust = plan(asked).robust
    assert set(robust.refused) == {"front_left"}
    assert 0 < robust.refused["front_left"] <= robust.without


def test_where_no_draw_is_held_there_is_none(monkeypatch):
    monkeypatch.setattr(load_factor, "DRAWS", 2)
    answer = plan(ask(on_wall(Plane(), outer_rotation=0.0), "robust"))
    assert answer.status == "infeasible"
    assert (answer.robust.without, answer.robust.worst, answer.robust.tenth) == (2, None, None)


def test_of_no_body_wrench_there_is_none():
    assert plan(ask(on_wall(), "robust", body_wrench=np.zeros(6))).robust is None


def test_a_known_stance_tells_it_for_each_wrench(monkeypatch):
    monkeypatch.setattr(load_factor, "DRAWS", 3)
    asked = ask(on_wall(), "robust")
    wrench = 0.5 * asked.needed_wrench()
    once = plan(asked).robust
    again = KnownStance(asked).plan(wrench).robust
    assert again.worst == pytest.approx(2.0 * once.worst, rel=1e-6)


def test_floating_hands_are_refused():
    first, *others = on_wall().hands
    stance = replace(on_wall(), hands=(replace(first, wrist="floating"), *others))
    with pytest.raises(InvalidInputError, match="fixed wrists only") as caught:
        ask(stance, "robust")
    assert caught.value.field == "want"
