"""The prepared check of a stance's loads: agrees with the check of plans, and finds each fault."""

import itertools
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from hand_models.base import BoundedStore, wrench_transport
from planner.prepare import prepare_stance, settle_hand
from planner.question import Stance
from planner.result import LoadRecovery, Plan
from planner.solving import plan
from planner.streaming.stream_stance import StreamStance
from planner.verification import Check, check as checks, hands as hand_limits, tiles as tile_limits
from planner.verification.tiles import LimitCurves
from tests.suite.helpers.fingernails import STRONG, hung, one_hand
from tests.suite.helpers.hands import changed_hand
from tests.suite.helpers.random_questions import KINDS
from tests.suite.helpers.robots import with_hand
from tests.suite.helpers.stances import ask, on_wall
from tests.suite.helpers.streams import streamable

WALL = ask(on_wall())

SWAPPED = [1, 0, *range(2, 10)]
"""A hand's loads, two tensions the one for the other."""


@cache
def stance() -> StreamStance:
    return StreamStance(WALL)


def fault(known: StreamStance, loads, wrench, **told) -> str | None:
    """What is wrong with loads, and what the stance's sets say of them."""
    read = known.read(loads)
    used = max(read.utilisation, known.check.idle)
    told = {"wrenches": read.wrenches, "utilisation": used} | told
    return known.check.fault(loads, body_wrench=wrench, **told)


def given_by(stance: Stance, known: StreamStance, loads) -> np.ndarray:
    """The body wrench that loads give."""
    body = stance.body.inverse()
    wrenches = known.read(loads).wrenches
    return -sum(
        wrench_transport(body @ hand.pose) @ wrench
        for hand, wrench in zip(stance.hands, wrenches, strict=True)
    )


CASES = [
    *(("plain", seed) for seed in (0, 1, 2, 8, 14)),
    *(("with joints", seed) for seed in (0, 1, 3, 7)),
    *(("request", seed) for seed in (6, 9, 25, 28, 55)),
]


@pytest.mark.parametrize(("kind", "seed"), CASES)
def test_plans_that_are_verified_pass(kind, seed):
    question = streamable(KINDS[kind](seed))
    answer, known = plan(question), StreamStance(question)
    loads = known.loads_of(answer)
    assert not known.check.wrong
    assert fault(known, loads, known.first) is None
    read = known.read(loads)
    assert max(read.utilisation, known.check.idle) == pytest.approx(answer.utilisation, rel=1e-9)
    wrenches = np.array([hand.wrench for hand in answer.hands])
    np.testing.assert_allclose(read.wrenches, wrenches, rtol=1e-9, atol=1e-7)


@pytest.mark.parametrize("pull", [1000.0, 2200.0])
def test_plans_that_hang_on_nails_pass(pull):
    question = hung(one_hand(STRONG), pull)
    answer, known = plan(question), StreamStance(question)
    loads = known.loads_of(answer)
    assert fault(known, loads, known.first) is None
    # more along a nail than rock and finger bear, with the balance that this gives
    loads[0, known.columns[0].index("inner_left/nail")] += 1e4
    assert (
        fault(known, loads, given_by(question.stance, known, loads)) == "a load of the wrong sign"
    )


def test_loads_are_refused_where_the_check_of_plans_refuses_them():
    """Loads a little or much beside those of a plan, with the body wrench that they give."""
    rng, refused = np.random.default_rng(5), []
    for kind, seed in (("plain", 0), ("with joints", 1), ("request", 25)):
        question = streamable(KINDS[kind](seed))
        known, prepared = StreamStance(question), prepare_stance(question)
        check = Check(prepared.question, prepared.batch, prepared.where)
        reader = LoadRecovery(prepared.batch, prepared.at_rest.spaces)
        start = known.loads_of(plan(question))
        for scale in (0.0, 1e-7, 1e-2, 1.0, 10.0, 40.0):
            loads = start + scale * rng.normal(size=start.shape) * (start != 0.0)
            rows = [y[: len(names)] for y, names in zip(loads, known.columns, strict=True)]
            arrays = reader.read(rows)[0]
            wrench = given_by(question.stance, known, loads)
            used = max(float(arrays.utilisations.max()), known.check.idle)
            # the reader takes for zero what is below it
            whole = (
                check.problems(arrays, used, wrench) == [] and (loads > reader.least - 1e-6).all()
            )
            assert (fault(known, loads, wrench) is None) == whole, (kind, seed, scale)
            refused.append(not whole)
    assert {*refused} == {True, False}


@cache
def honest() -> tuple[np.ndarray, Plan]:
    answer = plan(WALL)
    return stance().loads_of(answer), answer


def test_no_load_can_be_another():
    for row, column in itertools.product(range(4), range(10)):
        loads = honest()[0].copy()
        loads[row, column] += 0.05
        assert fault(stance(), loads, stance().first).startswith("balance is off"), (row, column)


def test_numbers_that_are_told_are_those_of_the_loads():
    loads, _ = honest()
    read = stance().read(loads)
    wrenches = read.wrenches.copy()
    wrenches[1, 4] += 1e-3
    wrong = fault(stance(), loads, stance().first, wrenches=wrenches)
    assert wrong == "a hand's wrench"
    wrong = fault(stance(), loads, stance().first, utilisation=read.utilisation - 1e-5)
    assert wrong == "the utilisation"


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_found(number):
    loads = honest()[0].copy()
    loads[2, 3] = number
    with np.errstate(invalid="ignore"):
        assert fault(stance(), loads, stance().first) is not None


SIGNED = {
    "a tension": "inner_left/tension",
    "the palm's shear": "palm_shear",
    "the palm's pressing": "palm_pressing",
}


@pytest.mark.parametrize("name", SIGNED.values(), ids=SIGNED.keys())
def test_no_load_has_the_wrong_sign(name):
    loads = honest()[0].copy()
    loads[1, stance().columns[1].index(name)] = -1.0
    assert (
        fault(stance(), loads, given_by(WALL.stance, stance(), loads)) == "a load of the wrong sign"
    )


def test_a_tendon_with_friction_must_not_be_slackened():
    hand = changed_hand("tendon", "friction", 0.1)
    robot = with_hand(WALL.stance.robot, hand)
    question = replace(WALL, stance=replace(WALL.stance, robot=robot))
    known = StreamStance(question)
    loads = known.solve(known.first).loads
    closing = settle_hand(question.stance.hands[0], question.stance).closing_tension
    for slack, expected in ((0.0, None), (0.01, "a load of the wrong sign")):
        loads[0, 0] = closing - slack
        assert fault(known, loads, given_by(WALL.stance, known, loads)) == expected


def test_tiles_keep_to_their_limit_curve_as_well_as_to_their_half_planes(monkeypatch):
    def weak(surfaces, *tiles):
        weaker = [
            replace(each, shear_limit=20.0, pull_off_limit=2.0, lateral_limit=40.0)
            for each in surfaces
        ]
        return LimitCurves(weaker, *tiles)

    loads, _ = honest()
    monkeypatch.setattr(tile_limits, "LimitCurves", weak)
    monkeypatch.setattr(checks, "SETTLED_LIMITS", BoundedStore("of this test", 1))
    known = StreamStance(WALL)
    assert fault(known, loads, known.first).endswith("is beyond its limit curve")


def test_a_hand_holds_no_more_than_its_rows_say(monkeypatch):
    loads, _ = honest()
    monkeypatch.setattr(hand_limits, "HELD_DIRECTIONS", 0.9 * hand_limits.HELD_DIRECTIONS)
    known = StreamStance(WALL)
    used = honest()[1].utilisation
    assert fault(known, loads, known.first, utilisation=used).endswith("more than its rows say")


def test_sets_that_do_not_balance_the_joints_are_found(monkeypatch):
    loads, _ = honest()
    honestly = LoadRecovery.read

    def wrongly(reader, y):
        arrays, *others = honestly(reader, y)
        return arrays._replace(loads=1.001 * arrays.loads), *others

    monkeypatch.setattr(LoadRecovery, "read", wrongly)
    known = StreamStance(WALL)
    assert fault(known, loads, known.first) == "what loads do to the hands"


def test_loads_have_the_names_of_what_they_are(monkeypatch):
    """Two tendons, the one for the other."""
    loads, _ = honest()
    honestly = LoadRecovery.read
    monkeypatch.setattr(
        LoadRecovery, "read", lambda reader, y: honestly(reader, [own[SWAPPED] for own in y])
    )
    known = StreamStance(WALL)
    assert fault(known, loads[:, SWAPPED], known.first) == "what loads do to the hands"


def test_a_wrench_that_is_given_is_kept():
    given = tuple(
        replace(hand, wrench=(None, None, 25.0, None, None, None) if i == 0 else None)
        for i, hand in enumerate(WALL.stance.hands)
    )
    known = StreamStance(replace(WALL, stance=replace(WALL.stance, hands=given)))
    solved = known.solve(known.first)
    assert known.read(solved.loads).wrenches[0, 2] == pytest.approx(25.0, abs=1e-6)
    assert fault(known, solved.loads, known.first) is None
    assert fault(known, honest()[0], known.first) == "a load or a wrench that is given"
