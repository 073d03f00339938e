"""The check that every plan passes finds each number that is wrong."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hands import changed_hand
from stances import CALIBRATION_LOAD, ask, on_wall, random_question

from hand_models.holds import Cylinder, Plane
from planner import verify
from planner.plan import Plan
from planner.settling import settle
from planner.solve import plan
from planner.verify import equilibrium, problems

QUESTION = ask(on_wall(), load=replace(CALIBRATION_LOAD, com=(0.0, 0.05, 0.0)))
HAND, FINGER = 2, 1
"""rear_left, inner_left."""

TILES = ("fingers", FINGER, "tiles")
BASE = ("fingers", 0, "tiles", 0)
PALM = ("palm",)


@cache
def honest() -> Plan:
    return plan(QUESTION)


def spoilt(thing, path, change):
    """A copy of nested tuples and dataclasses with ``change`` made at the end of ``path``."""
    head, *rest = path
    part = thing[head] if isinstance(head, int) else getattr(thing, head)
    part = spoilt(part, rest, change) if rest else change(part)
    if isinstance(head, int):
        return (*thing[:head], part, *thing[head + 1 :])
    return replace(thing, **{head: part})


def complaints(answer: Plan, question=QUESTION, wrench=None) -> list[str]:
    return problems(
        question,
        [settle(hand, question.stance) for hand in question.stance.hands],
        answer.hands,
        answer.utilisation,
        answer.body_wrench if wrench is None else wrench,
    )


def axis(index: int, by: float):
    def change(vector):
        vector = vector.copy()
        vector[index] += by
        return vector

    return change


def more(by: float):
    return lambda value: value + by


TAMPERED = {
    "tension": (("fingers", FINGER, "tendon_tension"), more(0.01), "not what the plan says"),
    "slack tendon": (("fingers", FINGER, "tendon_tension"), lambda f: -1.0, "tension of"),
    "no tension": (("fingers", FINGER, "tendon_tension"), lambda f: float("nan"), "tension of"),
    "infinite tension": (
        ("fingers", FINGER, "tendon_tension"),
        lambda f: float("inf"),
        "tension of",
    ),
    "shear": ((*TILES, 1, "shear"), more(0.01), "not what the plan says"),
    "shear of the base tile": ((*BASE, "shear"), more(0.01), "not what the plan says"),
    "normal": ((*TILES, 2, "normal"), more(-0.01), "not what the plan says"),
    "normal of the base tile": ((*BASE, "normal"), more(0.01), "not what the plan says"),
    "lateral": ((*TILES, 1, "lateral"), more(0.01), "force and loads disagree"),
    "no load": ((*TILES, 1, "shear"), lambda t: float("nan"), "not what the plan says"),
    "shear axis": ((*TILES, 1, "shear_axis"), lambda a: -a, "force and loads disagree"),
    "normal axis": ((*TILES, 1, "normal_axis"), axis(1, 0.01), "force and loads disagree"),
    "force x": ((*TILES, 1, "force"), axis(0, 0.01), "force and loads disagree"),
    "force y": ((*TILES, 1, "force"), axis(1, 0.01), "force and loads disagree"),
    "force z": ((*TILES, 1, "force"), axis(2, 0.01), "force and loads disagree"),
    "no force": ((*TILES, 1, "force"), axis(2, float("nan")), "force and loads disagree"),
    "position": ((*TILES, 1, "position"), axis(1, 0.001), "not the sum"),
    "contact": ((*TILES, 1, "contact"), lambda c: "none", "touches nothing"),
    "utilisation of a tile": ((*TILES, 1, "utilisation"), more(-1e-4), "utilisation"),
    "motor torque": (("fingers", FINGER, "motor_torque"), more(1e-6), "motor torque"),
    "motor current": (("fingers", FINGER, "motor_current"), more(1e-6), "motor current"),
    "no motor current": (
        ("fingers", FINGER, "motor_current"),
        lambda i: float("nan"),
        "motor current",
    ),
    "winch angle": (("fingers", FINGER, "winch_angle"), more(1e-6), "winch angle"),
    "palm pulls": ((*PALM, "force"), lambda f: f * [1.0, 1.0, -1.0], "cannot exert"),
    "palm pushes along x": ((*PALM, "force"), lambda f: f * [-1.0, 1.0, 1.0], "cannot exert"),
    "palm sideways": ((*PALM, "force"), axis(1, 0.01), "cannot exert"),
    "palm presses": ((*PALM, "force"), axis(2, 0.01), "not the sum"),
    "palm position": ((*PALM, "position"), axis(1, 0.001), "not the sum"),
    "palm moment": ((*PALM, "moment"), axis(0, 0.01), "not the sum"),
    "palm utilisation": ((*PALM, "utilisation"), more(1e-4), "palm: utilisation"),
    "palm without rock": ((*PALM, "engaged"), lambda e: (), "touches nothing"),
    "wrench force": (("wrench",), axis(2, 0.01), "not the sum"),
    "wrench moment": (("wrench",), axis(4, 0.01), "not the sum"),
    "no wrench": (("wrench",), axis(0, float("nan")), "not the sum"),
    "utilisation of a hand": (("utilisation",), more(-1e-4), "rear_left: utilisation"),
    "no utilisation of a hand": (
        ("utilisation",),
        lambda u: float("nan"),
        "rear_left: utilisation",
    ),
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
    for tile in hand.fingers[FINGER].tiles:
        assert min(abs(tile.shear), abs(tile.normal)) > 1e-2


@pytest.mark.parametrize(("path", "change", "words"), TAMPERED.values(), ids=TAMPERED.keys())
def test_a_number_that_is_tampered_with_is_found(path, change, words):
    found = complaints(spoilt(honest(), ("hands", HAND, *path), change))
    assert any(words in each for each in found), found


def test_half_planes_that_promise_more_than_the_limit_curve_are_found():
    question = ask(on_wall(Cylinder(0.7)))
    answer = plan(question)
    hand = [hand.limb for hand in answer.hands].index(answer.limiting.limb)
    fingers = answer.hands[hand].fingers
    finger = [finger.name for finger in fingers].index(answer.limiting.finger)
    tile = [t.phalanx for t in fingers[finger].tiles].index(answer.limiting.phalanx)
    assert complaints(answer, question) == []
    generous = spoilt(
        answer,
        ("hands", hand, "fingers", finger, "tiles", tile, "half_planes"),
        lambda planes: tuple(replace(plane, capacity=10.0 * plane.capacity) for plane in planes),
    )
    assert any("limit curve" in each for each in complaints(generous, question))


def test_rows_that_promise_more_than_a_hand_holds_are_found(monkeypatch):
    monkeypatch.setattr(verify, "HELD", 0.5 * verify.HELD)
    assert any("more than its rows say" in each for each in complaints(honest()))


@pytest.mark.parametrize(
    ("section", "name", "weaker"),
    [
        ("structure", "finger_shear", 40.0),
        ("structure", "fingertip_force", 0.1),
        ("structure", "held_mass", 10.0),
        ("motor", "maximum_torque", 1e-3),
        ("motor", "maximum_current", 0.05),
    ],
)
def test_a_limit_that_the_planner_does_not_know_of_is_found(section, name, weaker):
    """The same plan, checked for a hand that bears less."""
    weak = changed_hand(section, name, weaker)
    settled = [replace(settle(hand, QUESTION.stance), hand=weak) for hand in QUESTION.stance.hands]
    answer = honest()
    found = problems(QUESTION, settled, answer.hands, answer.utilisation, answer.body_wrench)
    assert any("plan: utilisation is" in each for each in found)


def test_a_wrong_utilisation_of_the_plan_is_found():
    for wrong in (0.999 * honest().utilisation, 1.001 * honest().utilisation, float("nan"), 0.0):
        assert complaints(replace(honest(), utilisation=wrong))


@pytest.mark.parametrize("component", range(6))
def test_balance_for_another_wrench_is_found(component):
    size = np.linalg.norm(honest().body_wrench)
    wrench = honest().body_wrench + 2e-6 * size * np.eye(6)[component]
    assert any("balance" in each for each in complaints(honest(), wrench=wrench))


def test_hands_that_changed_places_are_found():
    hands = list(honest().hands)
    hands[0], hands[1] = (replace(hands[b], limb=hands[a].limb) for a, b in ((0, 1), (1, 0)))
    assert complaints(replace(honest(), hands=tuple(hands)))


def test_equilibrium_is_the_affine_map_of_tension():
    """Eq. 6 solved in full against Eq. 14, on several holds and tensions."""
    for stance in (on_wall(), on_wall(Cylinder(0.7), closing_tension=50.0), on_wall(Plane())):
        settled = settle(stance.hands[0], stance)
        for i, finger in enumerate(settled.fingers):
            tiles = np.flatnonzero(settled.finger_of == i)[-3:]
            for tension in (0.0, 37.0, 90.0, 700.0):
                outer = i in (0, 3)
                shear, normal, _ = equilibrium(finger, tension, settled.closing_tension, outer)
                loads = settled.loads[tiles, :, 0] + tension * settled.loads[tiles, :, 1]
                np.testing.assert_allclose(shear, loads[:, 0], rtol=1e-9, atol=1e-9)
                np.testing.assert_allclose(normal, loads[:, 1], rtol=1e-9, atol=1e-9)
