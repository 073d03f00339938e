"""The check that every plan passes finds each number that is wrong."""

from dataclasses import replace
from functools import cache

import msgspec
import numpy as np
import pytest
from msgspec import structs

from hand_models.rock import Cylinder
from planner.prepare import HandBatch, settle_hand
from planner.result import Plan, PlanArrays
from planner.solving import plan
from planner.verification import Check, hands as hand_limits
from planner.verification.tiles import LimitCurves
from tests.suite.helpers.checks import problems
from tests.suite.helpers.hands import changed_hand
from tests.suite.helpers.stances import (
    CALIBRATION_LOAD,
    ask,
    on_wall,
    random_question,
    random_surface,
)

QUESTION = ask(on_wall(), load=structs.replace(CALIBRATION_LOAD, com=(0.0, 0.05, 0.0)))
HAND, FINGER = 2, 1
"""rear_left, inner_left."""

TILE, TIP, BASE = 5, 6, 0
"""Rows of its middle and distal tile, and of the base tile of outer_left."""

TORQUE, CURRENT, WINCH = 0, 1, 2
"""Rows of the drives."""

PALM = ("palm",)


@cache
def honest() -> Plan:
    return plan(QUESTION)


def spoilt(thing, path, change):
    """A copy of nested tuples, dataclasses and structs with ``change`` at the end of ``path``."""
    head, *rest = path
    part = thing[head] if isinstance(head, int) else getattr(thing, head)
    part = spoilt(part, rest, change) if rest else change(part)
    if isinstance(head, int):
        return (*thing[:head], part, *thing[head + 1 :])
    copied = msgspec.structs.replace if isinstance(thing, msgspec.Struct) else replace
    return copied(thing, **{head: part})


def complaints(answer: Plan, question=QUESTION, wrench=None) -> list[str]:
    return problems(question, answer if wrench is None else replace(answer, body_wrench=wrench))


def at(index, change):
    """A change of one element of an array."""

    def changed(array):
        array = array.copy()
        array[index] = change(array[index])
        return array

    return changed


def more(by: float):
    return lambda value: value + by


def none(value):
    return float("nan")


TAMPERED = {
    "tension": (("tensions",), at(FINGER, more(0.01)), "not what the plan says"),
    "slack tendon": (("tensions",), at(FINGER, lambda f: -1.0), "tension of"),
    "no tension": (("tensions",), at(FINGER, none), "tension of"),
    "infinite tension": (("tensions",), at(FINGER, lambda f: float("inf")), "tension of"),
    "shear": (("loads",), at((TILE, 0), more(0.01)), "not what the plan says"),
    "shear of the base tile": (("loads",), at((BASE, 0), more(0.01)), "not what the plan says"),
    "normal": (("loads",), at((TIP, 1), more(-0.01)), "not what the plan says"),
    "normal of the base tile": (("loads",), at((BASE, 1), more(0.01)), "not what the plan says"),
    "lateral": (("loads",), at((TILE, 2), more(0.01)), "force and loads disagree"),
    "no load": (("loads",), at((TILE, 0), none), "not what the plan says"),
    "infinite load": (
        ("loads",),
        at((TILE, 1), lambda n: float("inf")),
        "force and loads disagree",
    ),
    "shear axis": (("axes",), at((TILE, 0), lambda a: -a), "force and loads disagree"),
    "normal axis": (("axes",), at((TILE, 1, 1), more(0.01)), "force and loads disagree"),
    "force x": (("forces",), at((TILE, 0), more(0.01)), "force and loads disagree"),
    "force y": (("forces",), at((TILE, 1), more(0.01)), "force and loads disagree"),
    "force z": (("forces",), at((TILE, 2), more(0.01)), "force and loads disagree"),
    "no force": (("forces",), at((TILE, 2), none), "force and loads disagree"),
    "position": (("positions",), at((TILE, 1), more(0.001)), "not the sum"),
    "contact": (("tiles", TILE), lambda t: t._replace(contact="none"), "touches nothing"),
    "name of a tile": (("tiles", TILE), lambda t: t._replace(phalanx="distal"), "middle tile"),
    "utilisation of a tile": (("tile_utilisations",), at(TILE, more(-1e-4)), "utilisation"),
    "spines of a tile": (("engagement",), at(BASE, lambda share: 1.0), "of its spines hold, not 1"),
    "motor torque": (("drives",), at((TORQUE, FINGER), more(1e-6)), "motor torque"),
    "motor current": (("drives",), at((CURRENT, FINGER), more(1e-6)), "motor current"),
    "no motor current": (("drives",), at((CURRENT, FINGER), none), "motor current"),
    "winch angle": (("drives",), at((WINCH, FINGER), more(1e-6)), "winch angle"),
    "palm pulls": ((*PALM, "force"), lambda f: f * [1.0, 1.0, -1.0], "cannot exert"),
    "palm pushes along x": ((*PALM, "force"), lambda f: f * [-1.0, 1.0, 1.0], "cannot exert"),
    "palm sideways": ((*PALM, "force"), at(1, more(0.01)), "cannot exert"),
    "palm presses": ((*PALM, "force"), at(2, more(0.01)), "not the sum"),
    "palm position": ((*PALM, "position"), at(1, more(0.001)), "not the sum"),
    "palm moment": ((*PALM, "moment"), at(0, more(0.01)), "not the sum"),
    "palm utilisation": ((*PALM, "utilisation"), more(1e-4), "palm: utilisation"),
    "palm without rock": ((*PALM, "engaged"), lambda e: (), "touches nothing"),
    "fewer tiles of a palm": ((*PALM, "engaged"), lambda e: e[1:], "palm touches with"),
    "wrench force": (("wrench",), at(2, more(0.01)), "not the sum"),
    "wrench moment": (("wrench",), at(4, more(0.01)), "not the sum"),
    "no wrench": (("wrench",), at(0, none), "not the sum"),
    "utilisation of a hand": (("utilisation",), more(-1e-4), "rear_left: utilisation"),
    "no utilisation of a hand": (("utilisation",), none, "rear_left: utilisation"),
}


@pytest.mark.parametrize(
    "seeds", [range(4), pytest.param(range(4, 12), marks=pytest.mark.slow)], ids=["few", "more"]
)
def test_honest_plans_pass(seeds):
    assert complaints(honest()) == []
    for seed in seeds:
        question = random_question(seed)
        answer = plan(question)
        if answer.hands is not None:
            assert complaints(answer, question) == []


def test_the_plan_that_is_tampered_with_loads_everything():
    hand = honest().hands[HAND]
    assert np.abs(hand.palm.force[[0, 2]]).min() > 1.0
    for i, tile in enumerate(hand.fingers[FINGER].tiles):
        assert min(abs(tile.shear), abs(tile.normal)) > 1e-2
        assert hand.tile("inner_left", tile.phalanx) == TILE - 1 + i
    assert hand.tiles[BASE][:2] == ("outer_left", "base")


def test_a_number_that_is_tampered_with_is_found():
    for path, change, words in TAMPERED.values():
        found = complaints(spoilt(honest(), ("hands", HAND, *path), change))
        assert any(words in each for each in found), found


def test_half_planes_that_promise_more_than_the_limit_curve_are_found():
    question = ask(on_wall(Cylinder(0.7)))
    answer = plan(question)
    hand = [hand.limb for hand in answer.hands].index(answer.limiting.limb)
    name = f"{answer.limiting.phalanx} tile of {answer.limiting.finger} is beyond its limit curve"
    assert complaints(answer, question) == []
    generous = spoilt(
        answer,
        ("hands", hand, "half_planes"),
        lambda planes: tuple(plane._replace(capacity=10.0 * plane.capacity) for plane in planes),
    )
    assert any(each.endswith(name) for each in complaints(generous, question))


def test_rows_that_promise_more_than_a_hand_holds_are_found(monkeypatch):
    monkeypatch.setattr(hand_limits, "HELD_DIRECTIONS", 0.5 * hand_limits.HELD_DIRECTIONS)
    assert any("more than its rows say" in each for each in complaints(honest()))


def test_a_limit_that_the_planner_does_not_know_of_is_found():
    """The same plan, checked for a hand that bears less."""
    for section, name, weaker in [
        ("structure", "finger_shear", 40.0),
        ("structure", "fingertip_force", 0.1),
        ("structure", "held_mass", 10.0),
        ("motor", "maximum_torque", 1e-3),
        ("motor", "maximum_current", 0.05),
    ]:
        weak = changed_hand(section, name, weaker)
        settled = [
            replace(settle_hand(hand, QUESTION.stance), hand=weak) for hand in QUESTION.stance.hands
        ]
        answer = honest()
        found = problems(QUESTION, answer, settled=settled)
        assert any("plan: utilisation is" in each for each in found)


def test_a_wrong_utilisation_of_the_plan_is_found():
    for wrong in (0.999 * honest().utilisation, 1.001 * honest().utilisation, float("nan"), 0.0):
        assert complaints(replace(honest(), utilisation=wrong))


def test_balance_for_another_wrench_is_found():
    for component in range(6):
        size = np.linalg.norm(honest().body_wrench)
        wrench = honest().body_wrench + 2e-6 * size * np.eye(6)[component]
        assert any("balance" in each for each in complaints(honest(), wrench=wrench))


def test_hands_that_changed_places_are_found():
    hands = list(honest().hands)
    hands[0], hands[1] = (replace(hands[b], limb=hands[a].limb) for a, b in ((0, 1), (1, 0)))
    assert complaints(replace(honest(), hands=tuple(hands)))


def test_the_check_of_known_hands_is_made_once():
    """Another body wrench on the same settled hands: one `Check` finds what a new one does."""
    settled = tuple(settle_hand(hand, QUESTION.stance) for hand in QUESTION.stance.hands)
    check = Check(QUESTION, HandBatch.of(settled))
    for lateral in (0.0, 0.1, -0.1):
        answer = plan(
            ask(on_wall(), load=structs.replace(CALIBRATION_LOAD, com=(0.0, lateral, 0.0)))
        )
        numbers = PlanArrays.of(answer.hands), answer.utilisation, answer.body_wrench
        assert check.problems(*numbers, answer.effort) == []
        assert check.problems(*numbers, 1.01 * answer.effort) != []
        assert check.problems(*numbers[:2], 1.01 * answer.body_wrench) != []


def test_limit_curves_are_those_of_the_surfaces():
    """Loads just inside and just outside of Eq. 21 on several rocks at once."""
    rng = np.random.default_rng(3)
    surfaces = [replace(random_surface(rng), compression_gain=0.1 * k) for k in range(5)]
    of_tile = rng.integers(5, size=400)
    curves = LimitCurves(surfaces, of_tile, np.ones(len(of_tile)))
    angle = rng.uniform(-0.5 * np.pi, 0.5 * np.pi, len(of_tile))
    angle[:3] = 0.0, 0.5 * np.pi, -0.5 * np.pi
    azimuth = rng.uniform(0.0, 0.5 * np.pi, len(of_tile))
    strength = np.array(
        [surfaces[k].strength(a, b) for k, a, b in zip(of_tile, angle, azimuth, strict=True)]
    )
    bounded = strength < 1e6
    assert 0 < bounded.sum() < len(bounded)
    strength[~bounded] = 1e3
    direction = [np.cos(angle) * np.cos(azimuth), -np.sin(angle), np.cos(angle) * np.sin(azimuth)]
    for size, beyond in ((0.999, False), (1.001, True)):
        shear, normal, lateral = size * strength * direction
        for side in (1.0, -1.0):
            excess = curves.excess(shear, normal, side * lateral, 0.0)
            np.testing.assert_array_equal(excess > 0.0, bounded & beyond)
    assert (curves.excess(*np.zeros((3, 400)), 0.0) < 0.0).all()
