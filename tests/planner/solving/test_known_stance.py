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
        assert answer.utilisation == new.utilisation
        assert answer.load_factor == new.load_factor
        np.testing.assert_array_equal(answer.body_wrench, wrench)
        np.testing.assert_array_equal(tensions(answer), tensions(new))


@pytest.mark.parametrize(
    ("wrench", "words"),
    [
        ([1.0, 2.0], "6 numbers"),
        ([np.nan] * 6, "finite"),
        ([1e16, 0.0, 0.0, 0.0, 0.0, 0.0], "more than"),
        ("down", "6 numbers"),
    ],
)
def test_a_wrench_that_is_none_is_refused_and_costs_nothing(wrench, words):
    known = KnownStance(QUESTIONS["held"])
    with pytest.raises(InvalidInputError, match=words) as caught:
        known.plan(wrench)
    assert caught.value.field == "body_wrench"
    assert known.plan(known.prepared.wrench).status == "optimal"
