"""Survival in replies: what is filled, what is refused, and what a deadline leaves out."""

import json

import msgspec
import pytest

from planner import Survival, deadline
from planner.deadline import DeadlineError
from service import answering
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


def test_a_deadline_leaves_it_out(monkeypatch):
    def late(*_: object) -> None:
        raise DeadlineError(1.0, "all draws of strengths were simulated")

    monkeypatch.setattr(answering.survival.planner, "find_survival", late)
    with deadline.within(60.0):
        reply = answer_plan(asked())
    assert isinstance(reply, PlanReply)
    assert reply.unfinished == ["survival"]
    assert reply.survival is msgspec.UNSET
    assert any("strengths" in warning for warning in reply.warnings)
