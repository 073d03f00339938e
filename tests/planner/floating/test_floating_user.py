"""Floating hands as a user asks for them: hard loads, bad preloads, far wrists, what is told."""

import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache

import msgspec
import numpy as np
import pytest
from msgspec import structs
from rich.console import Console

from hand_models.compliance import CompliantHand, FloatingWrist
from planner.deadline import Budget
from planner.explanation import far_wrists
from planner.floating import SETTINGS
from planner.prepare import settle_hand
from planner.programs import solvers, stance_program
from planner.question import Load, Question
from planner.result import Plan
from planner.solving import plan
from service.answering.questions import question
from service.commands.cli import run_command_line
from service.commands.stances import read_request
from service.requests import PlanRequest
from service.tables import terminal
from tests.suite.helpers.commands import DONE, OVERLOADED

pytestmark = pytest.mark.slow

REAR = ("rear_right", "rear_left")
ALL = ("front_right", *REAR, "front_left")


def request(limbs=REAR, preload=50.0, closing=None, **changes) -> PlanRequest:
    """The bundled stance, these hands floating with one preload for all fingers [N]."""
    bundled = read_request("wall-300-floating")
    hands = []
    for hand in bundled.stance.hands:
        if hand.limb in limbs:
            grasp = msgspec.structs.replace(hand.grasp, closing_tension=closing)
            hand = msgspec.structs.replace(
                hand, wrist="floating", tendon_preload=[preload] * 4, grasp=grasp
            )
        hands.append(hand)
    stance = msgspec.structs.replace(bundled.stance, hands=hands)
    return msgspec.structs.replace(bundled, stance=stance, **changes)


@contextmanager
def counted() -> Iterator[list[int]]:
    """Count the programs that are solved."""
    run, solved = stance_program.StanceProgram.run, []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            stance_program.StanceProgram, "run", lambda *given: solved.append(1) or run(*given)
        )
        yield solved


@cache
def planned(limbs: tuple[str, ...]) -> tuple[Question, Plan, int]:
    """These hands float, with a hard preload; last is how many programs the plan took."""
    asked = question(request(limbs, preload=70.0, want=["load_factor"]))
    with counted() as solved:
        answer = plan(asked)
    return asked, answer, len(solved)


def test_load_factor_is_no_less_than_a_smaller_load_proves():
    asked, whole, _ = planned(ALL)
    wrench = 0.6 * whole.body_wrench
    part = plan(replace(asked, body_wrench=wrench, load=type(asked.load)()))
    assert part.load_factor > 1.0
    assert whole.load_factor >= 0.6 * part.load_factor * (1.0 - 3e-3)


@pytest.mark.parametrize(
    ("limbs", "preload"),
    [
        (REAR, 37.0),
        (REAR, 70.0),
        (REAR, 80.0),
        (ALL, 70.0),
    ],
)
def test_utilisation_and_load_factor_agree(limbs, preload):
    if preload == 70.0:
        _, answer, _ = planned(limbs)
    else:
        answer = plan(question(request(limbs, preload, want=["load_factor"])))
    assert answer.load_factor is not None
    assert (answer.load_factor >= 1.0) == (answer.utilisation <= 1.0 + solvers.CAP_SLACK)


def test_budget_ends_a_search(monkeypatch):
    """With next to no programs left an answer comes at once, and is honest."""
    asked, whole, count = planned(REAR)
    assert count <= 1.2 * SETTINGS.programs
    monkeypatch.setattr("planner.solving.solve.SETTINGS", replace(SETTINGS, programs=30))
    with counted() as solved:
        answer = plan(asked)
    assert len(solved) <= 90 < count
    assert answer.status in ("overloaded", "failed", "infeasible")
    if answer.utilisation is not None:
        assert answer.utilisation >= whole.utilisation * (1.0 - 1e-6)


def test_parts_of_a_budget_spend_the_whole():
    whole = Budget(10)
    part = whole.part(4)
    part.spend(4)
    assert part.ended
    assert not whole.ended
    other = whole.part(20)
    other.spend(6)
    assert other.ended
    assert whole.ended


def test_tension_that_a_slack_hand_needs_holds_its_tiles():
    asked = question(request(preload=8.0))
    answer = plan(asked)
    assert answer.status != "optimal"
    told = [text for text in answer.warnings if "tendon_preload of 8 N" in text]
    assert [text.split(":")[0] for text in told] == list(REAR)
    if answer.status == "failed":
        assert told[0] in answer.reason
    need = float(told[0].split("it needs about ")[1].split(" N")[0])
    place = asked.stance.hands[1]
    hand = settle_hand(place, asked.stance)
    for tension, holds in ((need + 1.0, True), (need - 1.0, False)):
        loads = CompliantHand(hand, np.full(4, tension)).loads(np.zeros((1, 6)))
        assert bool((loads.shears[0][hand.touching] >= -1e-6).all()) == holds


def test_preload_that_alone_overloads_is_named():
    asked = question(request(("rear_right", "rear_left"), preload=95.0, want=["load_factor"]))
    answer = plan(asked)
    told = [text for text in answer.warnings if "tendon_preload alone" in text]
    place = asked.stance.hands[1]
    wrist = FloatingWrist(CompliantHand(settle_hand(place, asked.stance), place.tendon_preload))
    used = wrist.evaluate(np.zeros((1, 6))).utilisation[0]
    assert used > 1.0
    assert f"utilisation {used:.3g} at rest" in told[0]
    limits = structs.replace(asked.limits, tendon_tension=60.0)
    capped = plan(replace(asked, limits=limits, want=frozenset()))
    assert any("tendon_preload of 95 N is above the limit of 60 N" in t for t in capped.warnings)


def test_no_raw_warning_leaves(stance_file, capfd):
    light = Load(mass=20.0)
    path = stance_file(msgspec.to_builtins(request(preload=20.0, closing=20.0, load=light)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert run_command_line(["plan", path]) in (DONE, OVERLOADED)
    out, err = capfd.readouterr()
    assert "load factor without the palms' shear and pressing: " in out
    assert err == ""


@pytest.mark.parametrize(
    ("twist", "told"),
    [
        ([4e-3, 0, 0, 0, 0, 0], False),
        ([0, 0, 10e-3, 0, 0, 0], True),
        ([0, 0, 0, 0, 60e-3, 0], True),
    ],
)
def test_far_wrist_is_told(twist, told):
    _, answer, _ = planned(REAR)
    hand = next(each for each in answer.hands if each.wrist is not None)
    hand = replace(hand, wrist=replace(hand.wrist, twist=np.array(twist, dtype=float)))
    assert bool(list(far_wrists([hand]))) == told


@pytest.mark.parametrize("shown", [True, False])
def test_wait_is_shown_on_terminals_alone(monkeypatch, capsys, shown):
    monkeypatch.setattr(
        terminal,
        "console",
        lambda stderr=False: Console(file=sys.stderr, force_terminal=shown, width=80),
    )
    with terminal.waiting("planning this", request()):
        pass
    captured = capsys.readouterr()
    assert ("planning this" in captured.err) == shown
    assert captured.out == ""
