"""Deadlines at every stage: what is verified leaves, and what is missing is told."""

from __future__ import annotations

import itertools
import json
import math
import pickle
import re
import threading
import time
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest
from msgspec import structs

import planner
from hand_models.base import InvalidInputError
from hand_models.rock import Plane
from planner import deadline, programs
from planner.deadline import Budget, DeadlineError
from planner.explanation import certificate
from planner.explanation.infeasibility import FarkasProgram
from planner.floating import continuation
from planner.prepare import prepared_stance
from planner.programs import WRENCH_UNIT
from planner.question import Limits, Question
from planner.result import Plan
from planner.robots import pose_search
from planner.solving import (
    plan,
    solve,
    unique_plan,
)
from service.answering import dispatch, questions
from service.commands.cli import run_command_line
from service.commands.stances import read_request
from service.serving import CruxClient
from service.wire import ServiceError
from tests.suite.helpers import peer
from tests.suite.helpers.named_rows import most_given, named_rows
from tests.suite.helpers.patience import PATIENCE, soon
from tests.suite.helpers.requests import HEAVY, MSGPACK, plan_request, wall_request
from tests.suite.helpers.served import Served, client_config, free_endpoint
from tests.suite.helpers.stances import CALIBRATION_LOAD, ask, on_wall

LONG = 600.0
"""A deadline that no test comes near to [s]."""

WANTED = ("load_factor", "prices")

QUESTION = ask(on_wall(), *WANTED, load=structs.replace(CALIBRATION_LOAD, com=(0.0, 0.05, 0.0)))
PRESENT = {hand.limb: np.full(4, 60.0) for hand in QUESTION.stance.hands}
IMPOSSIBLE = ask(on_wall(Plane(), outer_rotation=0.0), *WANTED)
TOO_HEAVY = ask(on_wall(), *WANTED, load=structs.replace(CALIBRATION_LOAD, mass=400.0))


class Clock:
    """Time that only goes on as the test says: by a jump, or by a tick each time it is asked."""

    def __init__(self, tick: float = 0.0) -> None:
        self.now = time.perf_counter()
        self.tick = tick

    def perf_counter(self) -> float:
        self.now += self.tick
        return self.now


@pytest.fixture
def clock(monkeypatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr("planner.deadline.clock.time", clock)
    monkeypatch.setattr(solve, "time", clock)
    return clock


def late_at(monkeypatch, clock: Clock, module: object, name: str, call: int = 1) -> None:
    """Let the time be over when something is called for the so manieth time."""
    original, calls = getattr(module, name), itertools.count(1)

    def late(*args, **kwargs):
        if next(calls) == call:
            clock.now += 2.0 * LONG
        return original(*args, **kwargs)

    monkeypatch.setattr(module, name, late)


def late(question: Question) -> Plan:
    return plan(replace(question, deadline=LONG))


def told(answer: Plan) -> str:
    """The one warning of the deadline."""
    (warning,) = (text for text in answer.warnings if "deadline" in text)
    return warning


@cache
def in_time(name: str) -> Plan:
    return plan({"plain": QUESTION, "impossible": IMPOSSIBLE, "heavy": TOO_HEAVY}[name])


# The clock ----------------------------------------------------------------------------------------


def test_another_thread_ends_the_time():
    stop = threading.Event()
    with deadline.within(LONG, stop=stop):
        assert deadline.left() > 0.0
        # an earlier end of an inner block leaves the outer one as it is
        with deadline.within(2.0 * LONG):
            threading.Thread(target=stop.set).start()
            assert soon(deadline.expired)
        assert deadline.left() == 0.0
        with pytest.raises(DeadlineError):
            deadline.check("all was tried")
    assert deadline.left() is None


def test_an_earlier_end_outside_stays_and_a_later_one_gives_way(clock):
    with deadline.within(10.0):
        with deadline.within(20.0):
            assert deadline.left() == pytest.approx(10.0)
            assert deadline.seconds() == 10.0
        with deadline.within(4.0):
            assert deadline.left() == pytest.approx(4.0)
        with deadline.within(None):
            assert deadline.left() == pytest.approx(10.0)
        clock.now += 10.0
        assert deadline.expired()
        assert deadline.left() == 0.0
    assert deadline.left() is None
    assert not deadline.expired()


def test_the_clock_may_have_started_before(clock):
    with deadline.within(5.0, started=clock.now - 4.0):
        assert deadline.left() == pytest.approx(1.0)


def test_a_time_of_one_thread_is_none_of_another(clock):
    seen = []
    with deadline.within(1.0):
        thread = threading.Thread(target=lambda: seen.append(deadline.left()))
        thread.start()
        thread.join()
    assert seen == [None]


def test_the_end_of_the_time_is_the_end_of_every_budget(clock):
    with deadline.within(1.0):
        budget = Budget(5)
        assert not budget.ended
        clock.now += 1.0
        assert budget.ended
        assert budget.part(3).ended
    assert not budget.ended


def test_no_linear_program_begins_after_the_end(clock):
    program = FarkasProgram(np.ones((1, 1)), np.ones(1), np.ones((1, 1)), np.ones(1))
    asked = np.ones(1, dtype=bool), np.ones(1, dtype=bool)
    assert program.least_violation(*asked) is not None
    with deadline.within(1.0):
        assert program.least_violation(*asked) is not None
        clock.now += 1.0
        assert program.least_violation(*asked) is None


def test_the_error_says_how_long_and_what_was_missing_also_after_a_journey():
    error = pickle.loads(pickle.dumps(DeadlineError(0.005, "a plan was found")))
    assert (error.seconds, error.missing, error.field) == (0.005, "a plan was found", "deadline")
    assert str(error) == "deadline: 0.005 s expired before a plan was found; give a longer deadline"


def test_a_deadline_that_cannot_be_is_bad_input():
    for seconds in [0.0, -1.0, math.nan, math.inf]:
        with pytest.raises(InvalidInputError, match="above 0 s") as caught:
            replace(QUESTION, deadline=seconds)
        assert caught.value.field == "deadline"


# One stage after the other ------------------------------------------------------------------------


def test_time_enough_changes_nothing(clock):
    answer = late(QUESTION)
    assert answer.unfinished == ()
    assert not any("deadline" in text for text in answer.warnings)
    assert answer.utilisation == pytest.approx(in_time("plain").utilisation, rel=1e-9)
    assert answer.load_factor == pytest.approx(in_time("plain").load_factor, rel=1e-9)


@pytest.mark.parametrize(
    ("module", "name", "missing"),
    [
        (prepared_stance, "assemble", "a plan was looked for"),
        (programs, "unique", "a plan was found"),
    ],
)
def test_without_a_plan_there_is_an_error(monkeypatch, clock, module, name, missing):
    late_at(monkeypatch, clock, module, name)
    with pytest.raises(DeadlineError) as caught:
        late(QUESTION)
    assert caught.value.seconds == LONG
    assert caught.value.missing.startswith(missing)


def test_joint_angles_that_are_not_found_in_time_are_not_called_out_of_reach(monkeypatch, clock):
    question = questions.question(read_request("wall-300-joints"))
    late_at(monkeypatch, clock, pose_search, "damped_step", 2)
    with pytest.raises(DeadlineError, match="joint angles"):
        late(question)


def test_the_load_factor_is_left_out(monkeypatch, clock):
    late_at(monkeypatch, clock, programs, "load_factor")
    answer = late(QUESTION)
    assert answer.unfinished == ("load_factor",)
    assert answer.load_factor is None
    assert answer.load_factor_status == "not_finished"
    assert not answer.load_factor_unbounded
    assert answer.status == "optimal"
    assert answer.verified
    assert answer.utilisation == pytest.approx(in_time("plain").utilisation, rel=1e-9)
    assert answer.prices == in_time("plain").prices
    assert told(answer) == f"the deadline of {LONG:g} s expired before the load factor was found"


@pytest.mark.parametrize(
    ("extra", "before"),
    [
        ("robust", "the load factor was found at all places of the hands"),
        ("spread", "a plan was found in all draws of the numbers"),
    ],
)
def test_an_extra_is_left_out_and_nothing_else(monkeypatch, clock, few_places, extra, before):
    late_at(monkeypatch, clock, programs, "load_factor", 3)
    answer = late(ask(on_wall(), "load_factor", extra))
    assert answer.unfinished == (extra,)
    assert getattr(answer, extra) is None
    assert answer.load_factor is not None
    assert answer.status == "optimal"
    assert told(answer).endswith(f"before {before}")


def test_a_plan_that_is_not_proven_the_least_is_told_as_such(monkeypatch, clock):
    monkeypatch.setattr(unique_plan, "active_set_optimum", lambda *_: None)
    monkeypatch.setattr(programs, "unique_bound", lambda *_: -np.inf)
    late_at(monkeypatch, clock, programs, "margin")
    answer = late(QUESTION)
    assert answer.unfinished == ("least_utilisation", "load_factor")
    assert answer.verified
    assert answer.status == "optimal"
    assert answer.utilisation == pytest.approx(in_time("plain").utilisation, rel=1e-5)
    assert "it was proven that no plan uses less" in told(answer)


def test_a_tie_that_is_not_broken_leaves_the_plan_of_least_utilisation(monkeypatch, clock):
    monkeypatch.setattr(unique_plan, "active_set_optimum", lambda *_: None)
    monkeypatch.setattr(programs, "unique_bound", lambda *_: -np.inf)
    late_at(monkeypatch, clock, programs, "less_tension")
    answer = late(QUESTION)
    assert answer.unfinished == ("tie_break", "load_factor")
    assert answer.verified
    assert answer.utilisation == pytest.approx(in_time("plain").utilisation, rel=1e-5)


def test_instead_of_the_plan_of_least_effort_that_of_least_utilisation_leaves(monkeypatch, clock):
    late_at(monkeypatch, clock, programs, "effort")
    answer = late(replace(QUESTION, objective="min_effort"))
    assert answer.unfinished == ("least_effort", "load_factor")
    assert answer.verified
    assert answer.utilisation == pytest.approx(in_time("plain").utilisation, rel=1e-9)
    assert answer.effort_prices is None
    assert "more effort" in told(answer)
    assert answer.effort > plan(replace(QUESTION, objective="min_effort")).effort


@pytest.mark.parametrize(("module", "name"), [(programs, "reach"), (programs, "margin")])
def test_the_way_from_the_present_tensions_is_left_out(monkeypatch, clock, module, name):
    late_at(monkeypatch, clock, module, name)
    answer = late(replace(QUESTION, present=PRESENT))
    assert answer.unfinished == ("path",)
    assert answer.path is None
    assert answer.load_factor is not None
    assert sum("present tensions" in text for text in answer.warnings) == 1


def assert_proven(question: Question, answer: Plan, cap: float | None) -> None:
    """No loads that keep to the rows give what is needed, says HiGHS on its own data."""
    proof = answer.certificate
    assert proof.utilisation == cap
    most = most_given(named_rows(question, cap), proof.direction, proof.held)
    assert most is None or most <= proof.supremum + 1e-6 * max(1.0, abs(most))
    assert proof.supremum < proof.needed
    assert proof.blocking
    assert proof.shortfall is None or len(proof.shortfall) == 6


def test_that_there_is_no_plan_is_proven_by_the_first_solve_already(monkeypatch, clock):
    late_at(monkeypatch, clock, programs, "nearest")
    answer = late(IMPOSSIBLE)
    assert answer.status == "infeasible"
    assert answer.verified
    assert answer.unfinished == ("explanation", "load_factor")
    proof = answer.certificate
    assert_proven(IMPOSSIBLE, answer, None)
    assert np.linalg.norm(proof.direction * WRENCH_UNIT) == pytest.approx(1.0)
    assert proof.needed == pytest.approx(proof.direction @ IMPOSSIBLE.needed_wrench())
    assert peer.farthest(IMPOSSIBLE, proof.direction) <= proof.supremum + 1e-9
    assert (proof.shortfall, proof.nearest, proof.irreducible, proof.sufficient) == (None,) * 4
    assert answer.reason.startswith("no loads balance the body at any utilisation; ")


def test_a_proof_without_its_explanation(monkeypatch, clock):
    late_at(monkeypatch, clock, certificate, "irreducible_set")
    answer = late(IMPOSSIBLE)
    assert answer.status == "infeasible"
    assert answer.unfinished == ("explanation", "load_factor")
    assert_proven(IMPOSSIBLE, answer, None)
    whole = in_time("impossible").certificate
    np.testing.assert_allclose(answer.certificate.shortfall, whole.shortfall)
    assert answer.certificate.irreducible is None


def test_neither_a_plan_nor_a_proof_of_none_is_an_error(monkeypatch, clock):
    found = programs.unique
    monkeypatch.setattr(
        programs, "unique", lambda *asked: replace(found(*asked), balance_dual=None, loads=())
    )
    late_at(monkeypatch, clock, programs, "margin")
    with pytest.raises(DeadlineError, match="a plan was found"):
        late(IMPOSSIBLE)


def test_what_is_in_the_way_of_a_plan_within_the_limits_is_left_out_or_proven(monkeypatch, clock):
    assert in_time("heavy").status == "overloaded"
    late_at(monkeypatch, clock, programs, "nearest_body")
    answer = late(TOO_HEAVY)
    assert answer.status == "overloaded"
    assert answer.utilisation == pytest.approx(in_time("heavy").utilisation, rel=1e-9)
    assert answer.unfinished == ("explanation",)
    assert_proven(TOO_HEAVY, answer, 1.0)
    assert answer.certificate.shortfall is None
    assert "; no loads keep within all limits: " in answer.reason


# Whenever it comes --------------------------------------------------------------------------------


def held(question: Question, ticks: int, monkeypatch) -> tuple[Plan | None, int]:
    """The answer where the time is over after so many looks at the clock, and how many it took."""
    clock = Clock(tick=1.0)
    with monkeypatch.context() as patch:
        patch.setattr("planner.deadline.clock.time", clock)
        patch.setattr(solve, "time", SimpleNamespace(perf_counter=lambda: clock.now))
        begun = clock.now
        try:
            return plan(replace(question, deadline=float(ticks))), round(clock.now - begun)
        except DeadlineError:
            return None, round(clock.now - begun)


@pytest.mark.parametrize(
    "question",
    [
        replace(QUESTION, present=PRESENT, objective="min_effort"),
        IMPOSSIBLE,
        TOO_HEAVY,
        replace(QUESTION, limits=Limits(utilisation=0.3)),
    ],
    ids=["effort", "impossible", "heavy", "capped"],
)
def test_whenever_the_time_is_over_what_leaves_is_verified_and_says_what_is_missing(
    question, monkeypatch
):
    whole, last = held(question, 10**6, monkeypatch)
    assert whole.unfinished == ()
    seen = set()
    for ticks in sorted({*range(1, 40, 4), *range(40, last + 1, max(1, last // 12)), last + 1}):
        answer, _ = held(question, ticks, monkeypatch)
        if answer is None:
            assert "plan" not in seen
            seen.add("error")
            continue
        seen.add("plan" if answer.unfinished else "whole")
        assert answer.verified
        assert answer.status == whole.status
        assert (answer.hands is None) == (whole.hands is None)
        if answer.unfinished:
            assert told(answer)
        if "load_factor" not in answer.unfinished and whole.load_factor is not None:
            assert answer.load_factor == pytest.approx(whole.load_factor, rel=1e-9)
        if answer.utilisation is not None:
            cap = max(1.0, whole.utilisation)
            assert answer.utilisation <= cap + 1e-5
        if whole.certificate is not None and answer.certificate is not None:
            assert answer.certificate.supremum < answer.certificate.needed
        if answer.certificate is None and whole.certificate is not None:
            assert "certificate" in answer.unfinished
    assert seen == {"error", "plan", "whole"}


@pytest.mark.slow
def test_a_search_for_floating_wrists_gives_the_best_plan_it_has_come_to(monkeypatch):
    question = questions.question(read_request("wall-300-floating"))
    # light enough to be held
    load, wanted = structs.replace(question.load, mass=100.0), frozenset(["load_factor"])
    question = replace(question, load=load, objective="min_effort", want=wanted)
    whole, last = held(question, 10**6, monkeypatch)
    seen, used, efforts = set(), [], []
    for ticks in range(1, last + 2, max(1, last // 160)):
        answer, _ = held(question, ticks, monkeypatch)
        if answer is None:
            # a search may come by a point that a longer one passes by; not once it has settled
            assert ticks < 0.75 * last
            seen.add("error")
            continue
        assert answer.status == "optimal"
        assert answer.verified
        # least utilisation is sought first, and from there least effort
        if "wrists" in answer.unfinished:
            assert not efforts
            used.append(answer.utilisation)
        else:
            efforts.append(answer.effort)
        seen.update(answer.unfinished)
        if answer.unfinished:
            assert told(answer)
        # for want of time alone: the whole search is sure
        seen.add(answer.load_factor_status)
        assert ("load_factor" in answer.unfinished) == (answer.load_factor_status != "found")
    assert whole.load_factor_status == "found"
    assert {"error", "wrists", "least_effort", "load_factor", "at_least", "not_finished"} <= seen
    assert min(efforts) >= whole.effort * (1.0 - 1e-4)
    for values in (used, efforts):
        assert np.all(np.diff(values) <= 1e-6 * np.array(values[:-1]))


@pytest.mark.slow
def test_a_search_that_is_cut_short_after_its_first_plan_gives_that_plan(monkeypatch, clock):
    question = questions.question(read_request("wall-300-floating"))
    whole = plan(question)
    found = []
    original = continuation.first_plan

    def first_plan(*args):
        found.append(original(*args))
        clock.now += 2.0 * LONG
        return found[-1]

    monkeypatch.setattr(continuation, "first_plan", first_plan)
    answer = late(question)
    assert "wrists" in answer.unfinished
    assert answer.verified
    assert len(found) == 1
    assert answer.utilisation >= whole.utilisation * (1.0 - 1e-4)


# Over the wire ------------------------------------------------------------------------------------


def handled(request: dict, **kwargs) -> dict:
    answer = dispatch.handle("crux/robosimian/plan", msgspec.json.encode(request), **kwargs)
    return json.loads(answer.payload) | {"good": answer.good}


def test_the_clock_of_a_query_starts_where_it_is_taken():
    asked = wall_request() | {"deadline": 500.0}
    assert handled(asked)["unfinished"] == []
    reply = handled(asked, started=time.perf_counter() - 500.0)
    assert not reply["good"]
    assert reply["error"]["kind"] == "deadline"
    assert reply["error"]["field"] == "deadline"
    assert reply["error"]["message"].startswith("500 s expired before ")


def test_a_deadline_that_cannot_be_is_refused_by_name():
    for value in [0, -1.5, "soon", [1]]:
        reply = handled(wall_request() | {"deadline": value})
        assert reply["error"]["kind"] == "invalid"
        assert reply["error"]["field"] == "deadline"


def test_a_deadline_that_is_no_number_is_refused_by_name():
    for value in [math.nan, math.inf]:
        payload = msgspec.msgpack.encode(wall_request() | {"deadline": value})
        answer = dispatch.handle("crux/robosimian/plan", payload, MSGPACK)
        error = msgspec.msgpack.decode(answer.payload)["error"]
        assert (error["kind"], error["field"]) == ("invalid", "deadline")


def test_on_the_command_line_a_deadline_that_is_too_short_is_a_failure(tmp_path, capfd):
    path = tmp_path / "stance.json"
    path.write_text(json.dumps(wall_request() | {"deadline": 1e-6}))
    assert run_command_line(["plan", str(path), "--json"]) == 1
    out, err = capfd.readouterr()
    assert out == ""
    # where the hands are kept from before, they are closed in time
    assert re.match(r"crux: deadline: 1e-06 s expired before (the hands were|a plan was) ", err)
    assert err.endswith("; give a longer deadline\n")
    assert err.count("\n") == 1


def test_on_the_command_line_the_plan_without_palms_may_come_too_late(tmp_path, capfd, monkeypatch):
    original = planner.plan_without_palms

    def plan_late(question):
        with deadline.within(1e-9):
            return original(question)

    monkeypatch.setattr(planner, "plan_without_palms", plan_late)
    path = tmp_path / "stance.json"
    path.write_text(json.dumps(wall_request() | {"deadline": LONG}))
    assert run_command_line(["plan", str(path), "--json"]) == 0
    reply = json.loads(capfd.readouterr().out)
    assert reply["load_factor_without_palm"] is None
    assert reply["load_factor"] > 1.0
    assert run_command_line(["plan", str(path)]) == 0
    assert "load factor without the palms'" not in capfd.readouterr().out


@pytest.mark.slow
def test_a_service_keeps_deadlines():
    server = Served(free_endpoint())
    try:
        with CruxClient(client_config(server.endpoint), timeout=PATIENCE) as client:
            known = client.plan(plan_request())
            asked = plan_request(wall_request() | {"deadline": 1e-4})
            with pytest.raises(ServiceError, match=r"expired before .*; give") as caught:
                client.plan(asked)
            assert (caught.value.kind, caught.value.field) == ("deadline", "deadline")
            reply = client.plan(plan_request(wall_request(HEAVY) | {"deadline": LONG}))
            assert (reply.status, reply.unfinished) == ("overloaded", [])
            reply = client.plan(plan_request(wall_request() | {"deadline": LONG}))
            assert reply.unfinished == []
            assert reply.utilisation == pytest.approx(known.utilisation, rel=1e-9)
    finally:
        server.process.kill()
        server.process.communicate()
