"""Set-points of compliant wrists: plans, verified, and close to each other where wrenches are."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from hand_models.base import InvalidInputError, wrench_transport
from hand_models.compliance import CompliantHand
from planner.prepare import settle_hand
from planner.programs import WRENCH_UNIT
from planner.question import LimbStiffness, Question
from planner.result import SetPoints
from planner.solving import floating_wrists, plan
from planner.streaming import WrenchStream
from service.answering import questions
from service.commands.stances import read_request
from tests.suite.helpers.stances import complying

AS_GOOD = 0.01
"""Relative difference of the utilisation of set-points and plans, at most."""

TENSION_JUMP = 0.5
"""Change of a tension beyond that of plans [N], where the wrench changes by 1 N."""

TWIST_JUMP = np.array([2e-5] * 3 + [2e-4] * 3)
"""The same of a wrist's twist [m, rad]."""

STIFFNESS = LimbStiffness(position=5000.0, angle=100.0)


@cache
def asked(name: str = "wall-300") -> Question:
    question = complying(questions.question(read_request(name)))
    return replace(question, stance=replace(question.stance, limb_stiffness=STIFFNESS))


@pytest.fixture(scope="module")
def stream():
    with WrenchStream(asked()) as opened:
        yield opened


def along(seed: int) -> np.ndarray:
    """A direction in which the wrench changes by 1 N, with moments over 0.1 m."""
    way = np.random.default_rng(seed).normal(size=6)
    return way / np.linalg.norm(way) * WRENCH_UNIT / WRENCH_UNIT[0]


def exerted(question: Question, points: SetPoints) -> np.ndarray:
    """The wrench of the rock on the robot, in B, that the hands' model has at set-points."""
    total, body = np.zeros(6), question.stance.body.inverse()
    places = zip(question.stance.hands, points.wrists, points.tensions, strict=True)
    for place, wrist, tensions in places:
        model = CompliantHand(settle_hand(place, question.stance), scheme="tension")
        wrench = model.loads(wrist.twist[None], tensions[None]).wrenches[0]
        total -= wrench_transport(body @ place.pose) @ wrench
    return total


def twists(points: SetPoints) -> np.ndarray:
    return np.array([wrist.twist for wrist in points.wrists])


@pytest.mark.parametrize("name", ["wall-300", pytest.param("overhang", marks=pytest.mark.slow)])
def test_a_slow_ramp_moves_tensions_and_wrists_no_more_than_plans_do(name):
    question = asked(name)
    with WrenchStream(question) as source:
        wrenches = [source.first + i * along(0) for i in range(6)]
        points = [source.set_points(wrench) for wrench in wrenches]
    plans = [plan(replace(question, body_wrench=wrench)) for wrench in wrenches]
    tensions = [np.array([hand.tensions for hand in answer.hands]) for answer in plans]
    poses = [np.array([hand.wrist.twist for hand in answer.hands]) for answer in plans]
    for i, (one, other) in enumerate(pairwise(points)):
        assert (other.status, other.verified, other.source) == ("optimal", True, "solved")
        assert other.utilisation == pytest.approx(plans[i + 1].utilisation, rel=AS_GOOD)
        most = np.abs(tensions[i + 1] - tensions[i]).max() + TENSION_JUMP
        assert np.abs(other.tensions - one.tensions).max() <= most
        most = np.abs(poses[i + 1] - poses[i]).max(axis=0) + TWIST_JUMP
        assert (np.abs(twists(other) - twists(one)) <= most).all()


@pytest.mark.parametrize(
    ("name", "count"), [("wall-300", 3), pytest.param("overhang", 12, marks=pytest.mark.slow)]
)
def test_a_sweep_is_as_plans_are(name, count):
    question, rng = asked(name), np.random.default_rng(4)
    with WrenchStream(question) as source:
        for _ in range(count):
            wrench = source.first * (1.0 + rng.uniform(-0.1, 0.1, 6))
            points, answer = source.set_points(wrench), plan(replace(question, body_wrench=wrench))
            assert (points.status, points.verified) == (answer.status, True)
            assert points.utilisation == pytest.approx(answer.utilisation, rel=AS_GOOD)
            assert 0.0 <= points.gap <= AS_GOOD
            np.testing.assert_allclose(exerted(question, points), wrench, atol=1e-4)


def test_the_first_set_points_are_those_of_the_plan(stream):
    points, answer = stream.set_points(stream.first), plan(asked())
    for h, hand in enumerate(answer.hands):
        assert points.wrists[h].driven
        np.testing.assert_allclose(points.tensions[h], hand.tensions, atol=1e-6)
        np.testing.assert_allclose(points.winch_angle[h], hand.drives[2], atol=1e-9)
        np.testing.assert_allclose(points.motor_torque[h], hand.drives[0], atol=1e-9)
        np.testing.assert_allclose(points.motor_current[h], hand.drives[1], atol=1e-9)
        np.testing.assert_allclose(points.wrists[h].twist, hand.wrist.twist, atol=1e-9)
        assert stream.columns[h] == hand.space.columns
        loads = np.concatenate([hand.tensions, hand.wrist.twist])
        np.testing.assert_allclose(points.loads[h], loads, atol=1e-6)
    assert stream.limbs == tuple(hand.limb for hand in answer.hands)
    assert stream.interpolates is None
    assert stream.wait()


def test_a_limb_that_aims_at_its_target_exerts_the_wrench(stream):
    points = stream.set_points(stream.first + 20.0 * along(1))
    for wrist, wrench in zip(points.wrists, points.wrenches, strict=True):
        pull = np.array(STIFFNESS.each) * (wrist.pose_target - wrist.twist)
        np.testing.assert_allclose(pull, wrench, atol=1e-6)


def test_fixed_wrists_may_be_among_them():
    question = complying(asked(), ("front_left", "rear_right"))
    with WrenchStream(question) as source:
        source.set_points(source.first)
        wrench = source.first + 15.0 * along(2)
        points, answer = source.set_points(wrench), plan(replace(question, body_wrench=wrench))
    assert (points.status, points.verified) == (answer.status, True)
    assert points.utilisation == pytest.approx(answer.utilisation, rel=AS_GOOD)
    modes = {
        limb: wrist is not None for limb, wrist in zip(source.limbs, points.wrists, strict=True)
    }
    assert {limb for limb, moves in modes.items() if moves} == {"front_left", "rear_right"}


def test_the_order_of_hands_does_not_matter():
    question = asked()
    turned = replace(question, stance=replace(question.stance, hands=question.stance.hands[::-1]))
    found = []
    for each in (question, turned):
        with WrenchStream(each) as source:
            source.set_points(source.first)
            points = source.set_points(source.first + 10.0 * along(3))
            found.append(
                (points.utilisation, dict(zip(source.limbs, points.tensions, strict=True)))
            )
    assert found[0][0] == pytest.approx(found[1][0], rel=1e-3)
    for limb, tensions in found[0][1].items():
        np.testing.assert_allclose(tensions, found[1][1][limb], atol=2.0)


def test_beyond_the_cap_the_whole_search_says_so():
    with WrenchStream(asked()) as source:
        source.set_points(source.first)
        heavy = 1.3 * source.first
        points, answer = source.set_points(heavy), plan(replace(asked(), body_wrench=heavy))
        assert (points.status, answer.status) == ("overloaded", "overloaded")
        assert points.reason
        told, proof = answer.reason.split("; ")
        assert told == points.reason
        # what is proven is proven of the wrists there
        assert answer.certificate is not None
        assert proof.endswith("with the wrists where this plan puts them")
        assert points.utilisation == pytest.approx(answer.utilisation, rel=AS_GOOD)
        assert points.verified
        back = source.set_points(source.first)
    assert (back.status, back.verified) == ("optimal", True)


def test_what_is_no_plan_is_never_given(stream, monkeypatch):
    """A wrong step is found by the check, and a search answers."""
    stream.set_points(stream.first)
    step, taken = floating_wrists.next_plan, []

    def wrong(hands, near, budget):
        found = step(hands, near, budget)
        loads = (found.point.loads[0] + 1e-5, *found.point.loads[1:])
        taken.append(found)
        return replace(found, point=replace(found.point, loads=loads))

    monkeypatch.setattr(floating_wrists, "next_plan", wrong)
    points = stream.set_points(stream.first + 8.0 * along(4))
    assert len(taken) == 1
    assert (points.status, points.verified) == ("optimal", True)
    np.testing.assert_allclose(exerted(asked(), points), points.body_wrench, atol=1e-4)


def test_a_wrench_that_nothing_balances_is_as_in_a_plan():
    hand, stance = asked().stance.hands[0], asked().stance
    question = replace(
        asked(),
        stance=replace(stance, hands=(hand,)),
        body_wrench=np.array([0.0, 0.0, -1e5, 0.0, 0.0, 0.0]),
    )
    with WrenchStream(question) as source:
        points = source.set_points(source.first)
    answer = plan(question)
    assert (points.status, points.verified) == (answer.status, answer.verified)
    assert points.status == "infeasible"
    assert points.reason


def test_the_same_wrench_has_the_same_set_points_until_the_stream_closes():
    with WrenchStream(asked()) as source:
        points = source.set_points(source.first)
        assert source.set_points(source.first) is points
    with pytest.raises(InvalidInputError, match="closed"):
        source.set_points(source.first)


def test_set_points_that_are_kept_cannot_be_written(stream):
    points = stream.set_points(stream.first)
    for array in (points.tensions, points.wrists[0].twist):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0
