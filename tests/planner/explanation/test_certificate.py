"""Certificates of infeasibility, against HiGHS."""

import math
import time
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.optimize import linprog

from hand_models.base import Pose
from hand_models.rock import Edge, Plane
from planner.prepare import prepare_stance
from planner.programs import WRENCH_UNIT
from planner.solving import KnownStance, answer_on, plan, try_stance
from tests.suite.helpers import peer
from tests.suite.helpers.stances import ask, on_wall, random_answer, random_question

SEEDS = (
    3, 5, 12, 58, 64, 86, 98, 110, 117, 142, 143, 148, 150, 160, 166, 175, 187, 191, 199,
)  # fmt: skip
"""Every seed below 200 whose question has no answer."""


def nothing_within_reach():
    away = Pose(np.array([0.0, 0.0, 1.0]), np.eye(3))
    stance = on_wall()
    return replace(stance, hands=tuple(replace(hand, hold_in_hand=away) for hand in stance.hands))


@cache
def infeasible():
    questions = [
        ask(on_wall(Plane(), outer_rotation=0.0)),
        ask(on_wall(Edge(0.01, math.pi - 1e-3))),
        ask(on_wall(palm=False)),
        ask(on_wall(limbs=("front_left",), palm=False)),
        ask(nothing_within_reach()),
    ]
    answers = [(question, plan(question)) for question in questions]
    answers += [random_answer(seed) for seed in SEEDS]
    return [(q, a.certificate) for q, a in answers if a.status == "infeasible"]


def test_these_stances_are_infeasible():
    assert len(infeasible()) == 5 + len(SEEDS)


def test_no_loads_reach_the_needed_wrench_in_the_certificates_direction():
    for question, certificate in infeasible():
        direction = certificate.direction
        assert np.linalg.norm(certificate.direction * WRENCH_UNIT) == pytest.approx(1.0)
        best = peer.farthest(question, direction)
        needed = direction @ question.needed_wrench()
        assert certificate.needed == pytest.approx(needed, rel=1e-9)
        assert best <= certificate.supremum + 1e-6 * max(1.0, abs(best))
        assert certificate.supremum < certificate.needed


def test_shortfall_is_from_a_wrench_that_can_be_had_to_the_one_that_was_asked_for():
    for question, certificate in infeasible():
        np.testing.assert_allclose(
            certificate.nearest + certificate.shortfall, question.needed_wrench(), atol=1e-6
        )
        r = peer.rows(question)
        m = r.B.shape[1]
        # least t with |B y + b − nearest| ≤ t and the hard rows
        ones = np.ones((6, 1))
        A = np.vstack(
            [
                np.hstack([r.B, -ones]),
                np.hstack([-r.B, -ones]),
                np.hstack([r.H, np.zeros((len(r.h), 1))]),
            ]
        )
        target = certificate.nearest - r.b
        result = linprog(
            np.append(np.zeros(m), 1.0),
            A_ub=A,
            b_ub=np.concatenate([target, -target, r.h]),
            bounds=(None, None),
            method="highs",
        )
        assert result.status == 0
        assert result.fun <= 1e-5 * max(1.0, np.abs(question.needed_wrench()).max())


def test_the_blocking_rows_alone_prove_it():
    """Without every other hard row, still no loads reach the needed wrench."""
    blocked = 0
    for question, certificate in infeasible():
        blocking = {(n.limb, n.finger, n.phalanx, n.limit) for n in certificate.blocking}
        blocked += bool(blocking)
        sets = []
        for hand, space in zip(question.stance.hands, peer.spaces(question), strict=True):
            hard = space.rows[len(space.s) :]
            keep = np.array(
                [(hand.limb, row.finger, row.phalanx, row.limit) in blocking for row in hard]
            )
            kept = tuple(row for row, k in zip(hard, keep, strict=True) if k)
            sets.append(
                replace(
                    space,
                    rows=space.rows[: len(space.s)] + kept,
                    H=space.H[keep],
                    h=space.h[keep],
                )
            )
        direction = certificate.direction
        assert peer.farthest(question, direction, sets) < certificate.needed
    assert blocked > 10


def test_hands_without_rock_cannot_hold_anything_and_nothing_blocks_them():
    answer = plan(ask(nothing_within_reach()))
    assert answer.status == "infeasible"
    assert answer.certificate.blocking == ()
    np.testing.assert_allclose(answer.certificate.shortfall, answer.body_wrench, atol=1e-6)
    assert answer.certificate.supremum == pytest.approx(0.0, abs=1e-9)


def test_the_reason_says_what_is_missing():
    answer = plan(ask(on_wall(Plane(), outer_rotation=0.0)))
    worst = int(np.argmax(np.abs(answer.certificate.shortfall / WRENCH_UNIT)))
    assert ("fx", "fy", "fz", "mx", "my", "mz")[worst] in answer.reason
    assert "missing" in answer.reason


def test_what_is_next_to_what_can_be_had_has_its_proof_too():
    """The way to the nearest loads is short then: what proves has a unit of its own."""
    for seed, times, status in [
        (5117, 0.9, "infeasible"),
        (5029, 1.0001, "overloaded"),
        (5013, 1.0001, "overloaded"),
        (5020, 1.00001, "overloaded"),
        (5054, 1.00001, "infeasible"),
    ]:
        asked = random_question(seed, "load_factor")
        needed = times * plan(asked).load_factor * asked.needed_wrench()
        answer = plan(replace(asked, body_wrench=needed))
        assert answer.status == status
        assert answer.verified
        assert answer.certificate is not None
        assert answer.certificate.supremum < answer.certificate.needed


def test_a_plan_that_the_checks_refuse_by_a_hair_is_sought_next_to_what_is_needed():
    """Solvers call a few μN off balance solved; of next to no wrench that is too much."""
    for seed in (6117, 6249):
        asked = random_question(seed, "load_factor")
        needed = (1.0 + 3e-6) * plan(asked).load_factor * asked.needed_wrench()
        answer = plan(replace(asked, body_wrench=needed))
        assert answer.status == "optimal"
        assert np.linalg.norm(answer.residual) <= 1e-6


def test_loads_beyond_all_strength_are_none():
    """Fingers all but parallel could squeeze with 80 MN sideways: no more than if they were."""
    for turned in (math.pi, 3.14159):
        answer = plan(ask(on_wall(Edge(0.02, math.pi / 2), off=0.45, outer_rotation=turned)))
        assert answer.status == "infeasible"
        assert answer.certificate.utilisation is None
        assert answer.certificate.supremum < answer.certificate.needed
        assert answer.certificate.irreducible


def test_a_balance_beyond_all_strength_is_none_whichever_way_it_is_asked_for():
    """HiGHS balances the body, but not with loads that count; nor does any plan."""
    asked = replace(random_question(175), want=frozenset())
    assert np.abs(peer.least_utilisation(asked).x[:-1]).max() > peer.largest_load(asked)
    bounded = peer.least_utilisation(asked, largest=peer.largest_load(asked))
    assert bounded.status == peer.INFEASIBLE
    assert plan(asked).status == "infeasible"
    assert plan(replace(asked, explain=False)).status == "infeasible"
    assert KnownStance(asked).plan(asked.needed_wrench()).status == "infeasible"
    prepared = prepare_stance(asked)
    for prove in (True, False):
        found = answer_on(prepared, time.perf_counter(), prove=prove)
        assert found.answer.utilisation == math.inf
    assert try_stance(prepared).utilisation == math.inf


@pytest.mark.parametrize("seed", [27, 29])
def test_what_is_beyond_all_strength_grows_with_what_the_body_needs(seed):
    """That a body is heavy is no proof: without a verified plan the answer is `failed`."""
    asked = random_question(seed)
    for times in (1.0, 1e4, 1e8):
        more = replace(asked, body_wrench=times * asked.needed_wrench())
        other = peer.least_utilisation(more)
        assert np.abs(other.x[:-1]).max() < peer.largest_load(more)
        assert plan(more).status != "infeasible"
