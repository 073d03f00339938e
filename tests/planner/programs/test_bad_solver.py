"""A solver that lies or gives up never leaves as ``optimal``, ``overloaded`` or ``infeasible``."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from msgspec import structs

from hand_models.rock import Cylinder, Plane
from planner import programs
from planner.prepare import hand_space
from planner.programs import Outcome
from planner.question import Question
from planner.solving import plan
from tests.suite.helpers import peer
from tests.suite.helpers.stances import CALIBRATION_LOAD, ask, on_wall, program_data

QUESTION = ask(on_wall(), load=structs.replace(CALIBRATION_LOAD, com=(0.0, 0.05, 0.0)))


@cache
def honest_outcome() -> Outcome:
    found = {}

    def keep(data, share=1.0):
        found["outcome"] = original(data, share)
        return found["outcome"]

    original, programs.unique = programs.unique, keep
    try:
        plan(QUESTION)
    finally:
        programs.unique = original
    return found["outcome"]


LIES = {
    "no loads at all": lambda o: replace(o, value=0.0, loads=tuple(0.0 * y for y in o.loads)),
    "loads off by a part in ten thousand": lambda o: replace(
        o, value=0.5 * o.value, loads=tuple(1.0001 * y for y in o.loads)
    ),
    "not a number": lambda o: replace(
        o, value=0.5 * o.value, loads=tuple(y + float("nan") for y in o.loads)
    ),
    "enormous": lambda o: replace(o, value=0.5 * o.value, loads=tuple(1e9 * y for y in o.loads)),
    "negative": lambda o: replace(o, value=0.5 * o.value, loads=tuple(-y for y in o.loads)),
}


def all_say(monkeypatch, outcome: Outcome) -> None:
    """Let every program of a plan end so."""
    for name in ("unique", "margin", "vertex"):
        monkeypatch.setattr(programs, name, lambda *_: outcome)


@pytest.mark.parametrize("lie", LIES.values(), ids=LIES.keys())
def test_a_solver_that_lies_about_its_solution_gets_failed(monkeypatch, lie):
    outcome = lie(honest_outcome())
    all_say(monkeypatch, outcome)
    answer = plan(replace(QUESTION, want=frozenset({"prices", "load_factor"})))
    assert answer.status == "failed"
    assert not answer.verified
    for name in ("utilisation", "hands", "limiting", "prices", "certificate", "residual"):
        assert getattr(answer, name) is None
    assert "check" in answer.reason


def gently(tension: float, hold, closing_tension: float) -> tuple[Question, tuple[np.ndarray, ...]]:
    """A question and the loads that balance it: every tendon at one tension, and nothing else."""
    stance = on_wall(hold, closing_tension=closing_tension, palm=False)
    loads, total = [], np.zeros(6)
    for i, hand in enumerate(stance.hands):
        _, space = hand_space(stance, hand.limb)
        y = np.where([name.endswith("/tension") for name in space.columns], tension, 0.0)
        loads.append(y)
        total += peer.reaction(ask(stance), i, space.wrench(y))
    return ask(stance, body_wrench=total), tuple(loads)


@pytest.mark.parametrize(
    ("tension", "hold", "closing_tension", "words"),
    [
        (24.0, Cylinder(0.3), 37.0, "dragged backwards"),
        (28.0, Cylinder(0.3), 37.0, "is pulled off"),
        (33.0, Cylinder(0.08), 37.0, "leave its stop"),
    ],
)
def test_a_solver_that_ignores_a_hard_row_gets_failed(
    monkeypatch, tension, hold, closing_tension, words
):
    question, loads = gently(tension, hold, closing_tension)
    hands = program_data(question).hands
    lie = replace(
        honest_outcome(),
        value=-1.0,
        loads=loads,
        limit_duals=tuple(np.zeros(len(hand.l0)) for hand in hands),
        hard_duals=tuple(np.zeros(len(hand.h)) for hand in hands),
    )
    all_say(monkeypatch, lie)
    # the second look finds the truth, with a proof; without it, the lie is all there is
    truth = plan(question)
    assert truth.status == "infeasible"
    assert truth.certificate.supremum < truth.certificate.needed
    gave_up = Outcome(False, "solver_error", 0, float("nan"))
    monkeypatch.setattr(programs, "nearest", lambda data: gave_up)
    answer = plan(question)
    assert answer.status == "failed"
    assert words in answer.reason


@pytest.mark.parametrize("word", ["infeasible", "user_limit", "solver_error"])
def test_a_solver_that_gives_up_gets_failed_and_never_infeasible(monkeypatch, word):
    nothing = Outcome(False, word, 0, float("nan"))
    all_say(monkeypatch, nothing)
    answer = plan(QUESTION)
    assert answer.status == "failed"
    assert answer.certificate is None
    assert not answer.verified
    assert word in answer.reason
    assert answer.solver.status == word


def test_an_infeasible_stance_whose_distance_is_not_found_is_proven_by_multipliers(monkeypatch):
    nothing = Outcome(False, "solver_error", 0, float("nan"))
    monkeypatch.setattr(programs, "nearest", lambda *_: nothing)
    answer = plan(ask(on_wall(Plane(), outer_rotation=0.0)))
    assert answer.status == "infeasible"
    assert answer.certificate.supremum < answer.certificate.needed
    # without these there is no proof, and none is made up
    all_say(monkeypatch, nothing)
    answer = plan(ask(on_wall(Plane(), outer_rotation=0.0)))
    assert answer.status == "failed"
    assert answer.certificate is None


def test_a_distance_that_is_made_up_gets_no_certificate(monkeypatch):
    """Both programs lie that a stance that can be balanced is infeasible."""
    loads = tuple(0.0 * y for y in honest_outcome().loads)
    far = Outcome(True, "optimal", 1, 3.0, loads=loads)
    for name in ("unique", "margin", "vertex"):
        monkeypatch.setattr(programs, name, lambda d: Outcome(False, "infeasible", 0, float("nan")))
    monkeypatch.setattr(programs, "nearest", lambda data: far)
    answer = plan(QUESTION)
    assert answer.status == "failed"
    assert answer.certificate is None


def test_a_tie_break_that_fails_or_lies_leaves_the_plan_of_least_utilisation(monkeypatch):
    honest_utilisation = plan(QUESTION).utilisation
    lies = (
        Outcome(False, "solver_error", 0, float("nan")),
        replace(honest_outcome(), loads=tuple(1.01 * y for y in honest_outcome().loads)),
    )
    for lie in lies:
        monkeypatch.setattr(programs, "effort", lambda data, cap, lie=lie: lie)
        answer = plan(QUESTION)
        assert answer.status == "optimal"
        assert answer.verified
        assert answer.utilisation == pytest.approx(honest_utilisation, abs=1e-5)


@pytest.mark.parametrize("value", [0.0, 5.0, float("nan")])
def test_a_load_factor_that_its_loads_do_not_give_is_left_out(monkeypatch, value):
    lie = replace(honest_outcome(), value=value)
    monkeypatch.setattr(programs, "load_factor", lambda *_: lie)
    answer = plan(replace(QUESTION, want=frozenset({"load_factor"})))
    assert answer.load_factor is None
    assert not answer.load_factor_unbounded
    assert answer.status == "optimal"
