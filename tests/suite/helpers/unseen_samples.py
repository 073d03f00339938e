"""Samples that no plan has seen, and what a plan's tensions do in them.

``python -m tests.suite.helpers.unseen_samples slab 0 60`` prints what the plans of least
utilisation and of least mean utilisation do on a bundled stance, in 60 samples of seed 0.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import NamedTuple
from unittest.mock import patch

import numpy as np
from msgspec import structs

from hand_models.parameters import ParameterSample, ParameterTable, draw_table, draws_of
from planner.execution import sent_plans
from planner.prepare import prepare_stance, settled_as_drawn, with_drawn_hands
from planner.question import Question, drawn_hands
from planner.result import Plan
from planner.solving import plan
from service.answering.questions import question
from service.commands.stances import read_request


class Sent(NamedTuple):
    """Shares of samples in which tensions that are sent hold, and have no balance."""

    kept: float
    kept_without: float
    feedback: float
    feedback_without: float


def unseen_samples(asked: Question, seed: int, count: int) -> tuple[ParameterSample, ...]:
    """Draw samples: fitted entries of one or the other of two bundled sets, the rest anew."""
    rng = np.random.default_rng(seed)
    sets = draw_table()
    pairs = rng.integers(len(sets.vector("fit", "misfit")), size=(count, 2))
    found: dict[str, dict[str, object]] = {}
    for section, name, quantity in sets:
        if section != "ranges":
            picked = pairs[np.arange(count), rng.integers(2, size=count)]
            value = np.array(sets.vector(section, name))[picked].tolist()
            quantity = structs.replace(quantity, value=value)
        found.setdefault(section, {})[name] = quantity
    anew = patch(
        "hand_models.parameters.draws.even_quantiles",
        lambda rows, ranges: rng.uniform(1e-6, 1.0 - 1e-6, (rows, ranges)),
    )
    with anew:
        return draws_of(ParameterTable(found), asked.stance.robot.hand.table)


def sent(asked: Question, answers: list[Plan], samples: tuple[ParameterSample, ...]) -> list[Sent]:
    """Judge the tensions of plans in samples. A hand that cannot be there has no balance."""
    prepared = prepare_stance(asked)
    limbs = tuple(sorted(hand.limb for hand in asked.stance.hands))
    holds = np.zeros((len(answers), 2))
    without = np.zeros((len(answers), 2))
    for drawn in drawn_hands(asked.stance.robot.hand, samples, limbs=limbs):
        there = with_drawn_hands(prepared, settled_as_drawn(prepared, drawn))
        if there is None:
            without += 1
            continue
        for i, answer in enumerate(answers):
            pair = sent_plans(there, [hand.tensions for hand in answer.hands], 0.0)
            used = [np.inf if each.utilisation is None else each.utilisation for each in pair]
            holds[i] += np.array(used) <= asked.limits.utilisation + 1e-6
            without[i] += np.isinf(used)
    shares = np.stack([holds, without], axis=-1).reshape(len(answers), 4) / len(samples)
    return [Sent(*row) for row in shares.tolist()]


def both_plans(asked: Question) -> list[Plan]:
    """Plan for the least utilisation, and for the least mean utilisation over bundled samples."""
    bare = replace(asked, want=frozenset(), deadline=None)
    return [plan(replace(bare, objective=each)) for each in ("max_margin", "max_robust")]


if __name__ == "__main__":
    stance, seed, count = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    asked = replace(question(read_request(stance)), want=frozenset())
    answers = both_plans(asked)
    for answer, shares in zip(
        answers, sent(asked, answers, unseen_samples(asked, seed, count)), strict=True
    ):
        print(f"{stance} {answer.status} {answer.utilisation:.4f} {shares}")
