"""Plans, checks and refusals follow the law that a tile's strength is declared to have."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from planner.prepare import HandBatch, settle_hand
from planner.question import Question
from planner.result import Plan, PlanArrays
from planner.solving import plan
from planner.verification import Check
from planner.verification.tiles import LimitCurves
from service.answering import questions
from service.commands.stances import read_request
from tests.suite.helpers.stances import ask, on_wall

LAWS = {"straight line": 1.0, "square root": 0.5, "square": 2.0}
"""Exponents with which strength falls from pure shear to φ_max."""

BUNDLED = ("wall-300", "overhang", "wall-700", "wall-300-joints")


def under(question: Question, exponent: float, planes: int = 1) -> Question:
    """The question on the same rock with another law."""
    hands = tuple(
        replace(
            hand,
            surface=replace(hand.surface, pull_off_exponent=exponent, half_planes=planes),
        )
        for hand in question.stance.hands
    )
    return replace(question, stance=replace(question.stance, hands=hands))


def strength(surface, angle: float) -> float:
    """f_s(φ), written out anew [N]."""
    most, least = surface.shear_limit, surface.pull_off_limit
    part = min(max(angle, 0.0) / surface.pull_off_angle, 1.0)
    return (
        most
        - (most - least)
        * {1.0: part, 0.5: math.sqrt(part), 2.0: part * part}[surface.pull_off_exponent]
    )


def outside(question: Question, answer: Plan) -> float:
    """How far the farthest tile is outside the curve, for loads in the finger plane [N]."""
    worst = -math.inf
    for place, hand in zip(question.stance.hands, answer.hands, strict=True):
        for (shear, normal, _), share, tile in zip(
            hand.loads, hand.limit_shares, hand.tiles, strict=True
        ):
            if tile.contact in ("face", "edge") and normal < 0.0:
                load = math.hypot(shear, normal) / share
                worst = max(worst, load - strength(place.surface, math.atan2(-normal, shear)))
    return worst


def complaints(question: Question, answer: Plan) -> list[str]:
    """What the check finds of a plan, if the question is this."""
    stance = question.stance
    known = HandBatch.of([settle_hand(hand, stance) for hand in stance.hands])
    numbers = PlanArrays.of(answer.hands), answer.utilisation, answer.body_wrench
    return list(Check(question, known).problems(*numbers, answer.effort))


@pytest.mark.parametrize(
    "name", [*BUNDLED, pytest.param("wall-300-floating", marks=pytest.mark.slow)]
)
def test_bundled_plans_follow_the_law_and_stay_inside_its_curve(name):
    question = questions.question(read_request(name))
    used = {}
    for law, exponent in LAWS.items():
        asked = under(question, exponent)
        answer = plan(asked)
        assert answer.verified, law
        if answer.utilisation <= 1.0:
            assert outside(asked, answer) <= 1e-6
        used[law] = answer.utilisation
    # a tile that loses strength sooner holds less, with one straight line from end to end
    assert used["square root"] > 1.001 * used["straight line"]
    assert used["square"] == pytest.approx(used["straight line"], rel=1e-6)


def test_with_more_half_planes_a_square_holds_more_and_a_root_less():
    question = ask(on_wall())
    used = [plan(under(question, p, planes=8)).utilisation for p in (0.5, 1.0, 2.0)]
    assert used[0] > used[1] > used[2]


def test_a_plan_under_one_law_is_found_beyond_another():
    """Planned for a square's curve with many half-planes, up to its limit, checked by a root's."""
    question = under(ask(on_wall()), 2.0, planes=16)
    factor = plan(replace(question, want=frozenset(["load_factor"]))).load_factor
    assert factor is not None
    heavy = replace(question, body_wrench=0.999 * factor * question.needed_wrench())
    answer = plan(heavy)
    assert answer.verified
    assert answer.utilisation > 0.9
    assert complaints(heavy, answer) == []
    for exponent in (1.0, 0.5):
        found = complaints(under(heavy, exponent, planes=16), answer)
        assert any("is beyond its limit curve" in each for each in found), exponent


@pytest.mark.parametrize("exponent", LAWS.values())
def test_the_check_draws_the_line_where_the_declared_curve_is(exponent):
    """Just inside nothing is found, just outside it is, of the check's own computation."""
    surface = replace(on_wall().hands[0].surface, pull_off_exponent=exponent)
    angles = np.linspace(0.01, math.pi / 2, 60)
    radii = np.array([strength(surface, angle) for angle in angles])
    curves = LimitCurves([surface], np.zeros(60, dtype=np.intp), np.ones(60))
    for size, beyond in ((0.9999, False), (1.0001, True)):
        shear, normal = size * radii * np.cos(angles), -size * radii * np.sin(angles)
        found = curves.excess(shear, normal, np.zeros(60), 0.0)
        assert ((found > 0.0) == beyond).all()
        assert ((surface.excess(shear, normal) > 0.0) == beyond).all()
