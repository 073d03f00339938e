"""How much plans change where rock is a little elsewhere than was thought."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hand_models.base import InvalidInputError, Pose
from hand_models.hand import Grasp
from planner.prepare import settle_hand
from planner.question import Load, Question, Stance
from planner.solving import plan
from tests.suite.helpers.rocks import random_mesh
from tests.suite.helpers.stances import ask, on_wall, random_stance

TIMES = 3
"""That the rock of each stance is moved."""


def fixed(stance: Stance) -> Stance:
    """The same hands, each with its rock where it was seated on it."""
    hands = [
        replace(hand, hold_in_hand=settle_hand(hand, stance).seating.pose) for hand in stance.hands
    ]
    return replace(stance, hands=tuple(hands))


def moved(stance: Stance, rng: np.random.Generator, far: float, turn: float) -> Stance:
    """The same hands, each with its rock so far aside [m] and turned so far [rad]."""
    hands = []
    for hand in stance.hands:
        step, axis = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
        turned = Rotation.from_rotvec(turn * axis).as_matrix() @ hand.hold_in_hand.rotation
        there = Pose(hand.hold_in_hand.position + far * step, turned)
        hands.append(replace(hand, hold_in_hand=there))
    return replace(stance, hands=tuple(hands))


def rough_stance(rng: np.random.Generator) -> Stance:
    """Four hands on boulders with bumps."""
    stance = on_wall()
    hands = [
        replace(hand, hold=random_mesh(rng), grasp=Grasp(float(rng.choice([0.0, math.pi]))))
        for hand in stance.hands
    ]
    return replace(stance, hands=tuple(hands))


def contacts(stance: Stance):
    """What touches, and which joints stand at limits."""
    hands = [settle_hand(hand, stance) for hand in stance.hands]
    return [(hand.postures.kinds.tolist(), hand.postures.stops.tolist()) for hand in hands]


def optimal_questions(draw, seeds) -> Iterator[tuple[int, Question, float]]:
    """Random stances that hold, and how much of their hands they need."""
    for seed in seeds:
        rng = np.random.default_rng(seed)
        try:
            stance = fixed(draw(rng))
        except InvalidInputError:
            continue
        question = ask(stance, load=Load(mass=float(rng.uniform(5.0, 60.0)), com=(0.0, 0.0, 0.0)))
        answer = plan(question)
        if answer.status == "optimal":
            yield seed, question, answer.utilisation


def changes(question: Question, before: float, seed: int, far: float, turn: float):
    """By what part the utilisation changes, each time; what changes much is listed."""
    for k in range(TIMES):
        there = moved(question.stance, np.random.default_rng([seed, k]), far, turn)
        try:
            answer = plan(replace(question, stance=there))
        except InvalidInputError as error:
            # the rock is a little deeper in a finger, or one comes to no rest on it
            print(seed, k, error)
            yield math.inf, True
            continue
        assert answer.verified
        change = abs(answer.utilisation / before - 1.0)
        lost = change > 0.1 and contacts(question.stance) != contacts(there)
        if change > 0.1:
            holds = [type(hand.hold).__name__ for hand in there.hands]
            print(seed, k, f"{before:.3f} {answer.utilisation:.3f}", holds, lost)
        yield change, lost


@pytest.mark.slow
def test_plans_change_little_where_rock_is_a_little_elsewhere():
    """Beyond 10 % in some 2 % of moves; most have a hand on a plane or an edge.

    There small angles move pressures far. None of them loses or finds a contact.
    """
    found = [
        each
        for seed, question, before in optimal_questions(random_stance, range(400, 700))
        for each in changes(question, before, seed, 5e-5, 3e-4)
    ]
    assert len(found) >= 25 * TIMES
    change, lost = np.array(found).T
    assert np.median(change) < 0.015
    assert (change > 0.1).mean() < 0.05
    assert not lost.any()


@pytest.mark.slow
def test_plans_on_rough_rock_are_much_the_same_a_little_elsewhere():
    """By 2 % in the median, 19 % at the 95th percentile."""
    found = [
        each
        for seed, question, before in optimal_questions(rough_stance, range(40))
        for each in changes(question, before, seed, 2e-4, 2e-3)
    ]
    assert len(found) >= 15 * TIMES
    change, _ = np.array(found).T
    assert np.median(change) < 0.05
    assert np.percentile(change, 95) < 0.25
