"""Survival in replies: what is filled, what is refused, and what a deadline leaves out."""

import json

import msgspec
import pytest

from planner import Survival, deadline
from planner.deadline import DeadlineError
from planner.simulation import Cascade
from service.answering import answer_plan
from service.replies import PlanReply
from service.requests import PlanRequest
from tests.suite.helpers.replies import refusal
from tests.suite.helpers.requests import compliant_request, wall_request

DRAWS = {"draws": 50, "replanned": 2, "seed": 1, "strength": 2.0}


def asked(request: dict | None = None, **more: object) -> PlanRequest:
    whole = (request or wall_request()) | {"want": ["survival"], "survival": DRAWS} | more
    return msgspec.convert(whole, PlanRequest)


def test_a_reply_has_both_probabilities_and_fills_the_reserved_field():
    reply = answer_plan(asked())
    assert isinstance(reply, PlanReply)
    found = reply.survival
    assert isinstance(found, Survival)
    assert reply.survival_probability == found.no_slip
    assert found.holds is not None
    assert found.replanned is not None
    assert (found.holds.draws, found.replanned.draws) == (50, 2)
    assert (found.strength, found.seed) == (2.0, 1)
    told = json.loads(msgspec.json.encode(reply))["survival"]
    assert told["holds"].keys() == {"probability", "low", "high", "draws"}
    assert found.tail is None or found.tail in reply.warnings


def test_without_being_asked_there_is_none():
    plain = answer_plan(msgspec.convert(wall_request(), PlanRequest))
    assert isinstance(plain, PlanReply)
    assert plain.survival is msgspec.UNSET
    assert plain.survival_probability is None
    brief = answer_plan(asked(detail="set_points"))
    assert not hasattr(brief, "survival")


def test_a_tail_is_a_warning():
    reply = answer_plan(asked(survival=DRAWS | {"strength": 30.0}))
    assert isinstance(reply, PlanReply)
    assert any("nobody has measured" in warning for warning in reply.warnings)


def test_an_infeasible_stance_has_no_survival():
    request = wall_request(limbs=("front_right",))
    request["stance"]["hands"][0]["grasp"] |= {"palm": False, "lateral": False}
    reply = answer_plan(asked(request))
    assert isinstance(reply, PlanReply)
    assert reply.status == "infeasible"
    assert reply.survival is msgspec.UNSET
    assert reply.survival_probability is None


def test_moving_wrists_say_why_nothing_is_simulated():
    reply = answer_plan(asked(compliant_request()))
    assert isinstance(reply, PlanReply)
    assert isinstance(reply.survival, Survival)
    assert "wrists" in (reply.survival.reason or "")
    assert reply.survival_probability is not None


@pytest.mark.parametrize(
    ("more", "field"),
    [
        ({"want": []}, "survival"),
        ({"survival": DRAWS | {"draws": 0}}, "survival.draws"),
        ({"survival": DRAWS | {"drawn": 1}}, "survival.drawn"),
        ({"survival": {"draws": 5, "replanned": 6}}, "survival.replanned"),
        ({"confidence": 0.99}, "confidence"),
    ],
)
def test_what_makes_no_sense_is_refused_by_its_field(more, field):
    kind, named, _ = refusal(wall_request() | {"want": ["survival"], "survival": DRAWS} | more)
    assert named == field
    assert kind == ("unsupported" if field == "confidence" else "invalid")


def test_a_deadline_leaves_the_formula(monkeypatch):
    whole = answer_plan(asked())

    def late(*_: object) -> None:
        raise DeadlineError(60.0, "all draws of strengths were simulated")

    monkeypatch.setattr(Cascade, "run", late)
    with deadline.within(60.0):
        reply = answer_plan(asked())
    assert isinstance(reply, PlanReply)
    assert isinstance(whole, PlanReply)
    assert reply.unfinished == ["survival"]
    assert isinstance(reply.survival, Survival)
    assert reply.survival_probability == whole.survival_probability
    assert reply.survival.holds is reply.survival.replanned is None
    assert any("0 of 50 at fixed tensions" in warning for warning in reply.warnings)


@pytest.mark.slow
def test_a_deadline_keeps_the_draws_made_so_far(monkeypatch):
    several = DRAWS | {"draws": 500, "replanned": 12}
    looks = 0
    whole = answer_plan(asked(survival=several))
    run = Cascade.run

    def slower(*given: object, **more: object) -> object:
        nonlocal looks
        looks += 1
        if looks > 2:
            raise DeadlineError(60.0, "all draws of strengths were simulated")
        return run(*given, **more)

    monkeypatch.setattr(Cascade, "run", slower)
    with deadline.within(60.0):
        reply = answer_plan(asked(survival=several))
    assert isinstance(reply, PlanReply)
    assert isinstance(whole, PlanReply)
    assert reply.unfinished == ["survival"]
    assert isinstance(reply.survival, Survival)
    assert reply.survival.holds is not None
    assert reply.survival.holds.draws == 400
    assert any("400 of 500 at fixed tensions, 0 of 12" in each for each in reply.warnings)
    monkeypatch.undo()
    fewer = answer_plan(asked(survival=several | {"draws": 400}))
    assert isinstance(fewer, PlanReply)
    assert isinstance(fewer.survival, Survival)
    assert fewer.survival.holds == reply.survival.holds
    assert "survival" not in whole.unfinished
