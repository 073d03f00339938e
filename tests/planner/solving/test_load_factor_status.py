"""Whether a load factor is there, and why not: the same words wherever it may be null."""

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from hand_models.rock import Cylinder, Plane
from planner.advice import advising
from planner.question import Load
from planner.result import LoadFactor
from planner.route import RouteResult
from planner.solving import plan
from service.answering.answers import brief_plan_reply, plan_reply
from tests.suite.helpers.stances import ask, on_wall

FLAT = on_wall(Plane(), outer_rotation=0.0)


@pytest.mark.parametrize(
    ("question", "status"),
    [
        (ask(on_wall(), "load_factor"), "found"),
        (ask(on_wall(Cylinder(0.7)), "load_factor"), "found"),
        (ask(on_wall(), "load_factor", load=Load(400.0)), "found"),
        (ask(on_wall()), "not_asked"),
        (ask(FLAT), "not_asked"),
        (ask(on_wall(), "prices"), "not_asked"),
        (ask(FLAT, "load_factor"), "none"),
        (ask(on_wall(), "load_factor", body_wrench=np.zeros(6)), "unbounded"),
        (ask(on_wall(), "load_factor", body_wrench=np.full(6, 1e-9)), "unbounded"),
        (ask(FLAT, "load_factor", body_wrench=np.zeros(6)), "none"),
    ],
)
def test_plans_say_why_there_is_no_load_factor(question, status):
    answer = plan(question)
    assert answer.load_factor_status == status
    assert (answer.load_factor is not None) == (status in ("found", "at_least"))
    assert answer.load_factor_unbounded == (status == "unbounded")
    whole = plan_reply(answer, None, model=False)
    hands = brief_plan_reply(answer, None, hands=True)
    assert whole.load_factor_status == hands.load_factor_status == status


@pytest.mark.parametrize(
    ("found", "status"),
    [
        (LoadFactor(1.2), "found"),
        (LoadFactor(0.0), "found"),
        (LoadFactor(1.2, least=True), "at_least"),
        (LoadFactor(), "none"),
        (LoadFactor(unbounded=True), "unbounded"),
        (LoadFactor(unfinished=True), "not_finished"),
    ],
)
def test_what_was_found_has_a_status(found, status):
    assert found.status == status


def test_advice_says_that_time_was_too_short_for_its_load_factor(monkeypatch):
    class Late:
        utilisation = 0.9

        def load_factor(self):
            return LoadFactor(unfinished=True)

    class Trials:
        def holds(self, utilisation):
            return True

    class Change:
        kind, limbs, words, changes, size = "body", (), "shift it", {}, 1.0

    advice = advising._advice(Trials(), Change(), Late())
    assert (advice.load_factor, advice.load_factor_status) == (None, "not_finished")


@pytest.mark.parametrize(
    ("statuses", "whole"),
    [
        (("found", "found"), "found"),
        (("found", "unbounded"), "found"),
        (("unbounded", "unbounded"), "unbounded"),
        (("found", "at_least", "unbounded"), "at_least"),
        (("found", "none"), "none"),
        (("found", "not_finished"), "not_finished"),
        (("not_finished", "none", "found"), "none"),
    ],
)
def test_of_stages_that_of_the_least_is_told(statuses, whole):
    base = plan(ask(on_wall()))
    for order in permutations(statuses):
        plans = tuple(replace(base, load_factor_status=status) for status in order)
        assert RouteResult(None, (), plans).load_factor_status == whole
