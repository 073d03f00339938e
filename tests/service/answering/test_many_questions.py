"""Hundreds of random questions: every answer proves itself, or is saved.

Where a check fails, the request is written to a file that ``crux plan`` takes.
"""

from __future__ import annotations

import json
from collections import Counter
from functools import cache
from pathlib import Path

import msgspec
import numpy as np
import pytest

from hand_models.base import InvalidInputError
from hand_models.wrench_spaces import WrenchSpace
from planner.prepare import assemble, posture
from planner.question import Question
from planner.result import Plan
from planner.solving import plan
from service.answering import questions
from service.requests import PlanRequest
from tests.suite.helpers import peer
from tests.suite.helpers.random_requests import random_request

COUNT = 300
FEW = 20
CLOSE = 2e-5


def asked(request: dict) -> Question | None:
    """The question; without joints where they cannot reach, None where a hand stands in rock."""
    for stance in (request["stance"], {**request["stance"], "joints": None}):
        limits = dict(request.get("limits", {}))
        if stance.get("joints") is None:
            limits.pop("joint_torque", None)
        whole = {**request, "stance": stance, "limits": limits}
        question = questions.question(msgspec.convert(whole, PlanRequest))
        try:
            gathered(question)
        except InvalidInputError:
            continue
        return question
    return None


def gathered(question: Question) -> tuple[list[WrenchSpace], np.ndarray]:
    """Each hand's set with all its rows, and the body wrench that is needed."""
    where = posture(question)
    wrench = question.needed_wrench(None if where is None else where.weights)
    _, hands = assemble(question, where, wrench)
    return list(hands.spaces), wrench


def given_rows(question: Question, r: peer.Rows, sets: list[WrenchSpace]) -> tuple:
    """Rows and right-hand sides of the components of hands' wrenches that are given."""
    columns = np.cumsum([0, *(len(each.columns) for each in sets)])
    rows, values = [], []
    for i, (hand, space) in enumerate(zip(question.stance.hands, sets, strict=True)):
        for j, value in enumerate(hand.wrench or ()):
            if value is not None:
                row = np.zeros(r.L.shape[1])
                row[columns[i] : columns[i + 1]] = space.generators[j]
                rows.append(row)
                values.append(value - space.origin[j])
    return np.array(rows).reshape(-1, r.L.shape[1]), np.array(values)


def least(question: Question):
    """The least utilisation by HiGHS, from SI data."""
    sets, wrench = gathered(question)
    r = peer.rows(question, sets)
    given, values = given_rows(question, r, sets)
    n = r.L.shape[1]
    A = np.vstack([np.column_stack([r.L, -r.s]), np.column_stack([r.H, np.zeros(len(r.h))])])
    E = np.vstack([r.B, given])
    return peer.solve(
        np.append(np.zeros(n), 1.0),
        A,
        np.concatenate([-r.l0, r.h]),
        np.column_stack([E, np.zeros(len(E))]),
        np.concatenate([wrench - r.b, values]),
    )


def may_use(lowest: float, cap: float) -> float:
    """What a plan may use: a thousandth more than the least, but no more than the cap for it."""
    return max(lowest, min(1.001 * lowest, cap))


def wrong_with(question: Question, answer: Plan) -> str | None:
    """What is wrong with an answer, by other means than its own."""
    if answer.status == "failed" or not answer.verified:
        return f"{answer.status}: {answer.reason}"
    if answer.status == "infeasible":
        other = least(question)
        if other.status != peer.INFEASIBLE:
            return f"infeasible, but HiGHS says {other.message}"
        return wrong_certificate(question, answer)
    balance = np.zeros(6)
    for i, hand in enumerate(answer.hands):
        balance += peer.reaction(question, i, hand.wrench)
    size = max(1.0, float(np.linalg.norm(answer.body_wrench)))
    if not np.abs(balance - answer.body_wrench).max() <= 1e-6 * size:
        return "out of balance"
    other = least(question)
    if other.status != 0:
        return f"HiGHS: {other.message}"
    idle = idle_use(question)
    lowest = max(other.fun, idle)
    cap = question.limits.utilisation
    slack = CLOSE * max(1.0, lowest)
    if question.objective == "min_effort" and lowest <= cap:
        if not lowest - slack <= answer.utilisation <= max(cap, lowest) + slack:
            return f"uses {answer.utilisation}, between {lowest} and {cap} is right"
    elif not lowest - slack <= answer.utilisation <= may_use(lowest, cap) + slack:
        return f"uses {answer.utilisation}, HiGHS {lowest}"
    if (answer.status == "optimal") != (answer.utilisation <= cap + 1e-6):
        return f"{answer.status} at {answer.utilisation} of {cap}"
    return None


def idle_use(question: Question) -> float:
    """What limbs without a hand use of their joints."""
    where = posture(question)
    held = {hand.limb for hand in question.stance.hands}
    joints = {} if where is None else where.joints
    return max(
        (
            float(np.abs(load.gravity / load.limits).max())
            for limb, load in joints.items()
            if limb not in held
        ),
        default=0.0,
    )


def wrong_certificate(question: Question, answer: Plan) -> str | None:
    """Check that no loads give the needed wrench, in the certificate's direction."""
    proof = answer.certificate
    if proof is None:
        return "no certificate"
    if any(hand.wrench is not None for hand in question.stance.hands):
        # the direction has a part for each wrench that is given: HiGHS has confirmed it above
        return None
    sets, wrench = gathered(question)
    if not proof.direction.any():
        # no loads keep to the hard rows, whatever the body needs
        hard = peer.rows(question, sets)
        found = peer.solve(np.zeros(hard.H.shape[1]), hard.H, hard.h)
        return None if found.status == 2 else f"HiGHS has loads: {found.message}"
    best = peer.farthest(question, proof.direction, sets)
    if not best <= proof.supremum + 1e-6 * max(1.0, abs(best)):
        return f"loads reach {best}, more than {proof.supremum}"
    if not proof.supremum < proof.direction @ wrench:
        return "proves nothing"
    return None


@cache
def outcome(seed: int) -> tuple[str, str | None]:
    """The status of a seed's answer, and what is wrong with it."""
    question = asked(random_request(seed))
    if question is None:
        return "refused", None
    answer = plan(question)
    return answer.status, wrong_with(question, answer)


def check(seeds: range, folder: Path) -> Counter[str]:
    found: Counter[str] = Counter()
    wrong = []
    for seed in seeds:
        status, complaint = outcome(seed)
        found[status] += 1
        if complaint is not None:
            path = folder / f"random-{seed}.json"
            path.write_text(json.dumps(random_request(seed), indent=1), encoding="utf-8")
            wrong.append(f"{path}: {complaint}")
    assert not wrong, "\n".join(wrong)
    return found


def test_a_few_random_questions_are_answered_right(tmp_path):
    found = check(range(FEW), tmp_path)
    assert set(found) >= {"optimal", "overloaded", "infeasible"}


@pytest.mark.slow
@pytest.mark.timeout(1500)
def test_three_hundred_random_questions_are_answered_right(tmp_path):
    found = check(range(COUNT), tmp_path)
    print(found)
    assert found["failed"] == 0
    assert found["optimal"] > COUNT / 10
    assert found["infeasible"] > COUNT / 20
