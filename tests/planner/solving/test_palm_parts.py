"""Load factors of stances whose palms lack their shear, or their pressing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs
from scipy.optimize import linprog

from hand_models.base import wrench_transport
from planner import PalmLoadFactors, load_factors_without_palm_loads
from planner.prepare import prepare_stance
from planner.question import Question
from planner.solving import plan
from service.answering.questions import question
from service.commands.stances import read_request
from tests.suite.helpers.stances import ask, on_wall


def most_with_zero(asked: Question, idle: tuple[str, ...]) -> float | None:
    """Largest multiple of the body wrench by a linear program in which some loads are zero."""
    prepared = prepare_stance(asked)
    spaces, body = prepared.hands.spaces, asked.stance.body.inverse()
    carries = [wrench_transport(body @ hand.pose) for hand in asked.stance.hands]
    names = [name for space in spaces for name in space.columns]
    balance = np.hstack(
        [carry @ space.generators for carry, space in zip(carries, spaces, strict=True)]
    )
    at_zero = sum(carry @ space.origin for carry, space in zip(carries, spaces, strict=True))
    rows = np.zeros((sum(len(space.b) for space in spaces), len(names)))
    row = column = 0
    for space in spaces:
        rows[row : row + len(space.b), column : column + len(space.columns)] = space.A
        row, column = row + len(space.b), column + len(space.columns)
    bounds = [(0.0, 0.0) if name in idle else (None, None) for name in names]
    result = linprog(
        np.append(np.zeros(len(names)), -1.0),
        A_ub=np.column_stack([rows, np.zeros(len(rows))]),
        b_ub=np.concatenate([space.b for space in spaces]),
        A_eq=np.column_stack([balance, prepared.wrench]),
        b_eq=-at_zero,
        bounds=[*bounds, (0.0, None)],
    )
    return None if result.status == 2 else -result.fun


@pytest.mark.parametrize("name", ["wall-300", "overhang", "slab"])
def test_they_are_those_of_a_linear_program_whose_palm_loads_are_zero(name):
    asked = question(read_request(name))
    found = load_factors_without_palm_loads(asked)
    for factor, idle in zip(found, ("palm_shear", "palm_pressing"), strict=True):
        expected = most_with_zero(asked, (idle,))
        assert factor == (None if expected is None else pytest.approx(expected, rel=1e-5))


def test_of_wall_300_the_pressing_counts_and_the_shear_hardly():
    found = load_factors_without_palm_loads(question(read_request("wall-300")))
    assert found.without_shear == pytest.approx(0.821, abs=5e-4)
    assert found.without_pressing == pytest.approx(0.047, abs=5e-4)


def test_each_is_between_a_stance_with_palms_and_one_without():
    asked = ask(on_wall(), "load_factor")
    found = load_factors_without_palm_loads(asked)
    bare = plan(ask(on_wall(palm=False), "load_factor")).load_factor
    for factor in found:
        assert bare - 1e-6 <= factor <= plan(asked).load_factor + 1e-6


def test_without_palms_or_with_wrists_that_move_there_are_none():
    assert load_factors_without_palm_loads(ask(on_wall(palm=False))) is None
    floating = question(read_request("wall-300-floating"))
    assert load_factors_without_palm_loads(floating) is None
    assert load_factors_without_palm_loads(ask(on_wall(), body_wrench=np.zeros(6))) is None


@pytest.mark.parametrize(("torque", "some"), [(1.0, False), (500.0, True)])
def test_a_limb_in_the_air_that_cannot_bear_itself_leaves_none(torque, some):
    asked = question(read_request("wall-300-joints"))
    lifted, *held = asked.stance.hands
    joints = {hand.limb: "solve" for hand in held} | {lifted.limb: np.zeros(7)}
    stance = replace(asked.stance, hands=tuple(held), joints=joints)
    limits = structs.replace(asked.limits, joint_torque={lifted.limb: [torque] * 7})
    found = load_factors_without_palm_loads(replace(asked, stance=stance, limits=limits))
    assert found is not None
    assert (found != PalmLoadFactors(None, None)) == some
