"""What reading and checking needs of the hands alone, made by several threads at once."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from hand_models.rock import Cylinder, Plane
from planner.prepare import prepare_stance
from planner.result import PlanArrays
from planner.solving import plan
from planner.solving.verified import prepare_checks
from tests.suite.helpers.stances import ask, on_wall

HOLDS = [*(Cylinder(0.28 + 0.011 * k) for k in range(5)), Plane()]


def prepared(question):
    return prepare_checks(prepare_stance(question))


def test_what_threads_prepare_for_new_hands_checks_their_plans_and_no_others():
    questions = [ask(on_wall(hold)) for hold in HOLDS]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(prepared, questions))
    plans = [plan(question) for question in questions]
    for i, ready in enumerate(found):
        for j, answer in enumerate(plans):
            if answer.hands is not None:
                numbers = PlanArrays.of(answer.hands), answer.utilisation, answer.body_wrench
                wrong = ready.check.problems(*numbers, answer.effort)
                assert (wrong == []) == (i == j)


def test_what_is_odd_about_a_stance_is_known_before_there_is_a_plan():
    stance = on_wall()
    far = replace(stance.body, position=stance.body.position + np.array([0.0, 0.0, 2.0]))
    question = ask(replace(stance, body=far))
    oddities = prepared(question).oddities
    assert len(oddities) == len(stance.hands)
    assert all("out of reach" in each for each in oddities)
    assert plan(question).warnings[: len(oddities)] == oddities
