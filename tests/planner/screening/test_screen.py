"""Lists of questions that are screened: against plans of all of them."""

from dataclasses import replace

import numpy as np
import pytest

import planner
from hand_models.base import InvalidInputError, Pose
from service.answering import questions
from service.commands import stances


def moved(name, count, seed):
    """A bundled stance with its body moved at random."""
    asked, rng = questions.question(stances.read_request(name)), np.random.default_rng(seed)
    body = asked.stance.body
    return [
        replace(
            asked,
            stance=replace(
                asked.stance, body=Pose(body.position + rng.uniform(-0.1, 0.1, 3), body.rotation)
            ),
        )
        for _ in range(count)
    ]


def planned(asked):
    found = planner.plan(replace(asked, want=frozenset(["load_factor"]), explain=False))
    return -np.inf if found.load_factor is None else found.load_factor


def test_finds_the_best_of_all():
    asked = moved("wall-300", 8, 1) + moved("slab", 8, 2) + moved("overhang", 4, 3)
    factors = np.array([planned(each) for each in asked])
    found = planner.screen(asked, best=3)
    expected = np.sort(factors)[::-1][:3]
    np.testing.assert_allclose(found.load_factors[found.best[:3]], expected, rtol=1e-6)
    assert (found.bounds >= factors - 1e-6).all()
    assert found.proven
    assert found.gap <= 1e-6
    assert found.programs < len(asked)
    # the same, in another order
    order = np.random.default_rng(0).permutation(len(asked))
    again = planner.screen([asked[i] for i in order], best=3)
    np.testing.assert_allclose(again.load_factors[again.best[:3]], expected, rtol=1e-6)


def test_plans_all_that_may_be_within_a_part_of_the_best():
    asked = moved("slab", 12, 4)
    factors = np.array([planned(each) for each in asked])
    found = planner.screen(asked, within=0.03)
    close = np.flatnonzero(factors >= 0.97 * factors.max())
    assert 1 < len(close) < len(asked)
    assert set(found.best.tolist()) == set(close.tolist())
    np.testing.assert_allclose(found.load_factors[close], factors[close], rtol=1e-6)


def test_with_joints_bounds_count_their_torques():
    (plain,) = moved("wall-300-joints", 1, 5)
    weak = replace(plain, limits=planner.Limits(joint_torque=60.0))
    found = planner.screen([weak, plain], best=2)
    assert found.best[0] == 1
    assert found.bounds[0] >= planned(weak) - 1e-6
    assert found.load_factors[0] == pytest.approx(planned(weak), rel=1e-6)
    assert found.load_factors[0] < 0.98 * found.load_factors[1]


def test_says_why_a_candidate_cannot_be_planned():
    (plain,), (floating, *_) = moved("wall-300", 1, 6), moved("wall-300-floating", 1, 6)
    far = replace(
        questions.question(stances.read_request("wall-300-joints")),
    )
    away = Pose(far.stance.body.position - np.array([5.0, 0.0, 0.0]), far.stance.body.rotation)
    far = replace(far, stance=replace(far.stance, body=away))
    found = planner.screen([floating, far, plain], best=3)
    assert found.order[0] == 2
    assert list(found.best) == [2]
    assert "fixed" in found.faults[0]
    assert "reach" in found.faults[1]
    assert np.isneginf(found.bounds[:2]).all()


def test_refuses_impossible_numbers():
    asked = moved("wall-300", 1, 7)
    for more, field in (({"best": 0}, "best"), ({"within": 1.0}, "within")):
        with pytest.raises(InvalidInputError) as caught:
            planner.screen(asked, **more)
        assert caught.value.field == field
    with pytest.raises(InvalidInputError, match="at least one"):
        planner.screen([])
