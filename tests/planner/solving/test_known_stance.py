"""A stance that is known answers as a new one does."""

from dataclasses import replace

import numpy as np
import pytest

from hand_models.base import InvalidInputError
from hand_models.rock import Cylinder
from planner.question import Limits
from planner.solving import KnownStance, plan
from tests.suite.helpers.stances import ask, on_wall

QUESTIONS = {
    "held": ask(on_wall(), "load_factor", "prices"),
    "least effort": ask(on_wall(), objective="min_effort"),
    "capped": ask(on_wall(Cylinder(0.7)), limits=Limits(utilisation=0.8, tendon_tension=60.0)),
    "no palms": ask(on_wall(palm=False)),
}


def tensions(answer):
    return np.array([[f.tendon_tension for f in hand.fingers] for hand in answer.hands or ()])


def near(used, other, relative):
    """Check that utilisations are the same, or that there is none of either."""
    assert (used is None) == (other is None)
    if used is not None:
        assert used == pytest.approx(other, rel=relative)


@pytest.mark.parametrize("question", QUESTIONS.values(), ids=QUESTIONS.keys())
def test_a_known_stance_answers_as_a_new_one(question):
    known = KnownStance(question)
    first = plan(question).body_wrench
    pull = np.array([60.0, -40.0, -150.0, 8.0, 20.0, -5.0])
    for wrench in (first, first + pull, 1.5 * first, first - 0.5 * pull, first):
        new = plan(replace(question, body_wrench=wrench))
        answer = known.plan(wrench)
        assert answer.status == new.status
        assert answer.reason == new.reason
        assert answer.verified
        near(answer.utilisation, new.utilisation, 1e-9)
        assert answer.load_factor == new.load_factor
        np.testing.assert_array_equal(answer.body_wrench, wrench)
        np.testing.assert_allclose(tensions(answer), tensions(new), rtol=1e-7, atol=1e-6)


def test_where_wrenches_drift_no_solver_is_asked_and_the_way_does_not_matter():
    question = QUESTIONS["held"]
    there, back = KnownStance(question), KnownStance(question)
    first = there.prepared.wrench
    pull = np.array([60.0, -40.0, -50.0, 8.0, 20.0, -5.0])
    wrenches = [first - share * pull for share in np.linspace(0.0, 0.3, 31)]
    answers = [there.plan(wrench) for wrench in wrenches]
    others = [back.plan(wrench) for wrench in reversed(wrenches)][::-1]
    for answer, other in zip(answers, others, strict=True):
        assert answer.status == other.status
        assert answer.utilisation == pytest.approx(other.utilisation, rel=1e-9)
        np.testing.assert_allclose(tensions(answer), tensions(other), rtol=1e-7, atol=1e-6)
        prices = {price.name: price.price for price in other.prices}
        assert {price.name for price in answer.prices} == set(prices)
        for price in answer.prices:
            assert price.price == pytest.approx(prices[price.name], rel=1e-5, abs=1e-8)
    steps = [answer.solver.iterations for answer in answers]
    assert steps[0] > 0
    assert steps.count(0) >= 20


@pytest.mark.parametrize("name", ["held", "least effort", "capped"])
def test_wrenches_that_jump_about_are_answered_as_new_ones(name):
    known, rng = KnownStance(QUESTIONS[name]), np.random.default_rng(2)
    scale = np.array([60.0, 60.0, 60.0, 6.0, 6.0, 6.0])
    statuses = set()
    for _ in range(12):
        wrench = 0.8 * known.prepared.wrench + scale * rng.normal(size=6)
        answer = known.plan(wrench)
        new = plan(replace(QUESTIONS[name], body_wrench=wrench))
        statuses.add(new.status)
        assert answer.status == new.status
        near(answer.utilisation, new.utilisation, 1e-7)
        np.testing.assert_allclose(tensions(answer), tensions(new), rtol=1e-5, atol=1e-3)
    assert statuses <= {"optimal", "overloaded"}


@pytest.mark.parametrize(
    ("wrench", "words"),
    [
        ([1.0, 2.0], "6 numbers"),
        ([np.nan] * 6, "finite"),
        ([1e16, 0.0, 0.0, 0.0, 0.0, 0.0], "must be within ±1e\\+12 N"),
        ("down", "6 numbers"),
    ],
)
def test_a_wrench_that_is_none_is_refused_and_costs_nothing(wrench, words):
    known = KnownStance(QUESTIONS["held"])
    with pytest.raises(InvalidInputError, match=words) as caught:
        known.plan(wrench)
    assert caught.value.field == "body_wrench"
    assert known.plan(known.prepared.wrench).status == "optimal"
