"""Set-points for a wrench that changes: plans, continuous, with a gap that is true."""

import logging
import threading
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from msgspec import structs

from hand_models.base import InvalidInputError, UnsupportedError
from hand_models.rock import Cylinder
from planner import programs
from planner.programs import used_effort
from planner.question import Limits, Load, Question
from planner.result import LoadRecovery, SetPoints
from planner.solving import KnownStance, plan
from planner.streaming import WrenchStream
from planner.streaming.interpolation import PER_RADIUS, Interpolation
from planner.streaming.stream_stance import StreamStance
from planner.verification import Check, LoadsCheck
from tests.suite.helpers import peer
from tests.suite.helpers.patience import PATIENCE
from tests.suite.helpers.random_questions import KINDS
from tests.suite.helpers.stances import ask, on_wall
from tests.suite.helpers.streams import streamable

WALL = ask(on_wall(), load=Load(mass=95.0, com=(0.0, 0.0, 0.0)))
"""Light enough that an interpolation's corners stay well under the cap."""

RADIUS = 30.0  # [N] by default
WEIGHT = WALL.needed_wrench()

BARE = ask(on_wall(palm=False), body_wrench=np.array([0.0, 0.0, -100.0, 0.0, 0.0, 0.0]))
"""Hands without palms: they cannot be pushed up the wall."""

OFF, UP = BARE.body_wrench, np.array([100.0, 0.0, 0.0, 0.0, 0.0, 0.0])


@pytest.fixture
def stream():
    with WrenchStream(WALL) as opened:
        yield opened


def within(rng: np.random.Generator, centre: np.ndarray, part: float) -> np.ndarray:
    """A random wrench with Σ |t| of that about a centre."""
    t = rng.normal(size=6)
    return centre + part * RADIUS * PER_RADIUS * t / np.abs(t).sum()


def size(wrench: np.ndarray) -> float:
    """Σ |t| of a change, in newtons."""
    return float(np.abs(wrench / PER_RADIUS).sum())


@cache
def checked_by(question: Question):
    """The check that plans pass, and what reads loads for it."""
    known = StreamStance(question)
    prepared = KnownStance(replace(question, body_wrench=known.first)).prepared
    spaces, data = prepared.hands.sets(prepared.hands.at_rest())
    check = Check(prepared.question, prepared.batch, prepared.where)
    return known, data, LoadRecovery(prepared.batch, spaces), check


def complaints(question: Question, points: SetPoints) -> list[str]:
    """What the check of plans says of set-points."""
    known, data, reader, check = checked_by(question)
    loads = [row[: len(names)] for row, names in zip(points.loads, known.columns, strict=True)]
    told = reader.read(loads)[0]
    np.testing.assert_allclose(points.wrenches, told.wrenches, rtol=1e-9, atol=1e-7)
    np.testing.assert_allclose(points.tensions.ravel(), told.tensions, atol=1e-9)
    np.testing.assert_allclose(points.motor_torque.ravel(), told.drives[0], rtol=1e-9)
    np.testing.assert_allclose(points.motor_current.ravel(), told.drives[1], rtol=1e-9)
    effort = used_effort(data, loads)
    return check.problems(told, points.utilisation, points.body_wrench, effort)


# Plans --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_set_points_within_the_radius_are_plans_with_a_true_gap(seed, stream):
    rng = np.random.default_rng(seed)
    wrench = within(rng, WEIGHT, rng.uniform(0.0, 0.79))
    points = stream.set_points(wrench)
    assert (points.status, points.verified, points.source) == ("optimal", True, "interpolated")
    assert complaints(WALL, points) == []
    least = peer.least_utilisation(replace(WALL, body_wrench=wrench)).fun
    assert -1e-7 <= points.utilisation - least <= points.gap + 1e-7
    assert points.gap < 1e-3


CASES = [
    *(("plain", seed) for seed in (0, 8)),
    *(("with joints", seed) for seed in (1, 7)),
    *(("request", seed) for seed in (6, 28, 82)),
]


LOADED = [
    pytest.param(*case, load, marks=() if i % 2 == k and i < 5 else pytest.mark.slow)
    for i, case in enumerate(CASES)
    for k, load in enumerate((0.5, 1.0))
]


@pytest.mark.parametrize(("kind", "seed", "load"), LOADED)
def test_set_points_say_what_plans_say(kind, seed, load):
    question = streamable(KINDS[kind](seed))
    question = replace(question, body_wrench=load * question.body_wrench)
    rng = np.random.default_rng(seed)
    with WrenchStream(question) as stream:
        for part in (0.0, 0.5, 0.9, 3.0):
            wrench = within(rng, question.body_wrench, part)
            points = stream.set_points(wrench)
            answer = plan(replace(question, body_wrench=wrench))
            assert (points.status, points.verified) == (answer.status, answer.verified)
            if answer.hands is None:
                assert points.utilisation is points.tensions is points.loads is None
                assert points.reason
            else:
                above = points.utilisation - answer.utilisation
                scale = 1e-6 * max(1.0, answer.utilisation)
                assert -scale <= above <= points.gap + scale
                assert complaints(question, points) == []


def test_at_the_centre_the_set_points_are_those_of_the_plan(stream):
    points, answer = stream.set_points(WEIGHT), plan(WALL)
    tensions = [hand.tensions for hand in answer.hands]
    np.testing.assert_allclose(points.tensions, tensions, atol=1e-5)
    assert points.gap < 1e-9
    assert stream.limbs == tuple(hand.limb for hand in answer.hands)


def test_plans_near_another_are_those_from_the_beginning_and_mostly_take_no_solver(monkeypatch):
    stance, rng, solved = StreamStance(WALL), np.random.default_rng(3), []
    unique = programs.unique
    monkeypatch.setattr(programs, "unique", lambda *each: solved.append(each) or unique(*each))
    near = stance.solve(WEIGHT)
    assert len(solved) == 1
    for _ in range(20):
        wrench = within(rng, WEIGHT, 1.0)
        found, taken = stance.solve(wrench, near), len(solved)
        alone = stance.solve(wrench)
        assert len(solved) == taken + 1
        solved.pop()
        assert found.outcome.value == pytest.approx(alone.outcome.value, abs=1e-6)
        np.testing.assert_allclose(found.loads, alone.loads, atol=1e-5)
        assert found.bound <= found.outcome.value + 1e-6
        near = found
    assert len(solved) - 1 <= 4


def test_the_cap_decides_the_status():
    used = plan(WALL).utilisation
    for cap in (used + 2e-3, used - 2e-3):
        question = replace(WALL, limits=Limits(utilisation=cap))
        rng = np.random.default_rng(3)
        with WrenchStream(question) as stream:
            found = set()
            for _ in range(8):
                wrench = within(rng, WEIGHT, rng.uniform(0.0, 0.5))
                points = stream.set_points(wrench)
                status = plan(replace(question, body_wrench=wrench)).status
                assert points.status == status
                found.add(status)
            assert found == {"optimal", "overloaded"}


def test_overloaded_wrenches_are_solved_one_by_one():
    question = replace(ask(on_wall(Cylinder(0.7))), explain=False)
    with WrenchStream(question) as stream:
        points = stream.set_points(stream.first + 0.1)
    assert (points.status, points.source) == ("overloaded", "solved")
    assert points.reason == plan(replace(question, body_wrench=points.body_wrench)).reason
    assert points.utilisation > 1.0
    assert points.verified


def test_a_proof_serves_all_the_wrenches_that_it_is_for(monkeypatch):
    with WrenchStream(BARE) as stream:
        first = stream.set_points(UP)
        assert (first.status, first.verified) == ("infeasible", True)
        monkeypatch.setattr(KnownStance, "plan", None)
        second = stream.set_points(2.0 * UP)
        assert (second.status, second.verified, second.tensions) == ("infeasible", True, None)
        assert stream.set_points(OFF).status == "optimal"


# Continuity ---------------------------------------------------------------------------------------

SLOPE = 40.0
"""Newtons of all loads together per newton of change that no stance here needs to exceed."""


def changes(stream: WrenchStream, way: np.ndarray) -> tuple[np.ndarray, list[SetPoints]]:
    """Change of all loads over that of the wrench, step by step."""
    points = [stream.set_points(wrench) for wrench in way]
    return np.array(
        [
            np.abs(after.loads - before.loads).sum() / size(after.body_wrench - before.body_wrench)
            for before, after in pairwise(points)
        ]
    ), points


@pytest.mark.parametrize("step", [0.02, 2.0])
def test_set_points_are_continuous_where_interpolations_follow(step, stream):
    """A straight way over several interpolations, in small steps."""
    rng = np.random.default_rng(1)
    towards = within(rng, np.zeros(6), 1.0)
    towards *= step / size(towards)
    found, sources, used, last = [], [], [], WEIGHT
    # so that steps are small where one interpolation takes over from another
    stride = 1.5 if step < 1.0 else step
    while size(last - WEIGHT) < 3.0 * RADIUS:
        way = [last + k * towards for k in range(60 if step < 1.0 else 2)]
        ratios, points = changes(stream, np.array(way))
        found.append(ratios.max())
        sources += [each.source for each in points]
        last = way[-1] + (stride / step) * towards
        assert stream.wait(PATIENCE)
        used.append(stream.newest)
    assert len(set(map(id, used))) >= 4
    assert set(sources) == {"interpolated"}
    assert max(found) < SLOPE


def test_set_points_are_continuous_where_interpolations_lag(stream, monkeypatch):
    """The way out of an interpolation while no other comes, and into one that does."""
    hold = threading.Event()
    about = Interpolation.about

    def late(stance, centre, radius):
        assert hold.wait(PATIENCE)
        return about(stance, centre, radius)

    monkeypatch.setattr(Interpolation, "about", late)
    step = np.array([0.25, 0.0, 0.0, 0.0, 0.05, 0.0])
    ratios, points = changes(stream, WEIGHT + np.arange(60)[:, None] * step)
    sources = [each.source for each in points]
    assert sources == sorted(sources, key=["interpolated", "blended", "solved"].index)
    assert {"interpolated", "blended", "solved"} == set(sources)
    assert ratios.max() < SLOPE
    hold.set()
    assert stream.wait(PATIENCE)
    back, points = changes(stream, points[-1].body_wrench - np.arange(60)[:, None] * step / 4.0)
    assert points[0].source == "solved"
    assert points[-1].source == "interpolated"
    assert back.max() < SLOPE


def test_set_points_are_continuous_where_plans_come_near_the_cap():
    used = plan(WALL).utilisation
    question = replace(WALL, limits=Limits(utilisation=used + 5e-3))
    step = np.array([0.2, 0.0, 0.0, 0.0, 0.0, 0.0])
    with WrenchStream(question) as stream:
        ratios, points = changes(stream, WEIGHT + np.arange(-60, 60)[:, None] * step)
    assert {"blended", "solved"} <= {each.source for each in points}
    assert ratios.max() < SLOPE


def test_a_jump_is_solved_and_the_next_interpolation_is_about_it(stream):
    there = WEIGHT + np.array([-200.0, 30.0, 10.0, 0.0, 5.0, 0.0])
    points = stream.set_points(there)
    assert points.source == "solved"
    assert stream.wait(PATIENCE)
    after = stream.set_points(there + 1e-6)
    assert np.abs(after.loads - points.loads).max() < 1e-3
    assert stream.set_points(there + 1e-3).source == "interpolated"
    assert complaints(WALL, stream.set_points(there - 0.5)) == []


def test_a_wrench_that_comes_again_finds_the_interpolations_of_before(stream, monkeypatch):
    """A gait repeats: nothing is solved again, and set-points are as continuous."""
    way = WEIGHT + np.outer(np.linspace(0.0, 3.0 * RADIUS, 121), np.eye(6)[0])

    def followed(wrenches) -> list[Interpolation]:
        used = []
        for wrench in wrenches:
            assert stream.set_points(wrench).verified
            assert stream.wait(PATIENCE)
            used.append(stream.newest)
        return used

    out = followed(way)
    assert len(set(map(id, out))) >= 4
    asked, about = [], Interpolation.about
    monkeypatch.setattr(Interpolation, "about", lambda *at: asked.append(at) or about(*at))
    back = followed(way[::-1])
    again = followed(way)
    assert not asked
    assert set(map(id, [*back, *again])) <= set(map(id, out))
    ratios, points = changes(stream, way[::-1])
    assert ratios.max() < SLOPE
    assert {each.source for each in points} == {"interpolated"}


def test_the_same_wrench_has_the_same_set_points(stream):
    first = stream.set_points(WEIGHT + 1.0)
    assert stream.set_points(list(WEIGHT + 1.0)) is first


def test_a_caller_may_fill_the_same_array_again(stream):
    wrench = WEIGHT.copy()
    for part in (0.0, 0.3, 0.6, 3.0, 3.2):
        wrench[:] = WEIGHT + part * RADIUS * np.eye(6)[1]
        points = stream.set_points(wrench)
        expected = points.body_wrench.copy()
        assert complaints(WALL, points) == []
        assert stream.wait(PATIENCE)
        wrench[:] = 0.0
        np.testing.assert_array_equal(points.body_wrench, expected)


# Interpolations -----------------------------------------------------------------------------------


def test_an_interpolation_whose_corners_have_no_plan_is_smaller():
    radius = 240.0
    corner = OFF + radius * np.eye(6)[2]
    assert plan(replace(BARE, body_wrench=corner)).status == "infeasible"
    with WrenchStream(BARE, radius=radius) as stream:
        assert radius / 16.0 <= stream.interpolates < radius
        points = stream.set_points(OFF + 0.1)
        least = plan(replace(BARE, body_wrench=OFF + 0.1)).utilisation
    assert (points.source, points.verified) == ("interpolated", True)
    assert -1e-7 <= points.utilisation - least <= points.gap + 1e-7


def test_an_interpolation_keeps_to_the_cap_where_its_centre_does():
    light = replace(WALL, load=structs.replace(WALL.load, mass=90.0))
    used = plan(light).utilisation
    for cap, radius in ((used + 0.1, 100.0), (used + 0.03, 25.0), (used - 0.1, 100.0)):
        with WrenchStream(replace(light, limits=Limits(utilisation=cap)), radius=100.0) as stream:
            found = stream.newest
        assert found.radius == stream.interpolates == radius
        assert (found.most <= cap) == (found.utilisation <= cap)


def test_where_there_is_no_plan_there_is_no_interpolation():
    with WrenchStream(replace(BARE, body_wrench=UP)) as stream:
        assert stream.interpolates is None
        assert stream.set_points(UP).status == "infeasible"
        # back where plans are
        assert stream.set_points(OFF).source == "solved"
        assert stream.wait(PATIENCE)
        assert stream.set_points(OFF + 1e-3).source == "interpolated"


def test_an_error_in_the_thread_is_logged_and_the_stream_goes_on(stream, monkeypatch, caplog):
    about = Interpolation.about

    def broken(*_):
        raise ZeroDivisionError("broken on purpose")

    monkeypatch.setattr(Interpolation, "about", broken)
    there = WEIGHT + np.array([-90.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    with caplog.at_level(logging.ERROR):
        assert stream.set_points(there).source == "solved"
        assert stream.wait(PATIENCE)
    assert "broken on purpose" in caplog.text
    points = stream.set_points(there + 0.01)
    assert (points.source, points.verified) == ("solved", True)
    monkeypatch.setattr(Interpolation, "about", about)
    stream.set_points(there + 3.0)
    assert stream.wait(PATIENCE)
    stream.set_points(there + 3.0 + 1e-3)
    assert stream.set_points(there + 3.0 + 0.1).source == "interpolated"


def test_a_plan_that_is_not_verified_never_leaves(stream, monkeypatch):
    monkeypatch.setattr(LoadsCheck, "fault", lambda *_: "a fault on purpose")
    points = stream.set_points(WEIGHT)
    assert (points.status, points.verified, points.loads) == ("failed", False, None)
    monkeypatch.undo()
    assert stream.set_points(WEIGHT).verified


# Threads ------------------------------------------------------------------------------------------


def test_several_threads_may_ask(stream):
    wrong: list[str] = []

    def walk(seed: int) -> None:
        rng = np.random.default_rng(seed)
        for _ in range(40):
            wrench = within(rng, WEIGHT, rng.uniform(0.0, 2.0))
            points = stream.set_points(wrench)
            if not (points.verified and (points.body_wrench == wrench).all()):
                wrong.append(str(points))

    threads = [threading.Thread(target=walk, args=(seed,)) for seed in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


def test_closing_ends_the_thread_and_the_stream():
    def running() -> int:
        return sum("crux-stream" in thread.name for thread in threading.enumerate())

    before = running()
    with WrenchStream(WALL) as stream:
        stream.set_points(WEIGHT + 20.0 * PER_RADIUS)
        assert running() == before + 1
    assert running() == before
    stream.close()
    with pytest.raises(InvalidInputError, match="closed") as caught:
        stream.set_points(WEIGHT)
    assert caught.value.field == "stream"


# What is refused ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changed", "kind", "field"),
    [
        ({"objective": "min_effort"}, UnsupportedError, "objective"),
        (
            {
                "limits": Limits(tension_change=10.0),
                "present": {"front_left": np.full(4, 40.0)},
            },
            UnsupportedError,
            "limits.tension_change",
        ),
        (
            {
                "stance": replace(
                    WALL.stance,
                    hands=(
                        *WALL.stance.hands[:2],
                        replace(WALL.stance.hands[2], wrist="floating"),
                        WALL.stance.hands[3],
                    ),
                )
            },
            UnsupportedError,
            "stance.hands[2].wrist",
        ),
    ],
)
def test_what_streams_do_not_do_is_refused(changed, kind, field):
    with pytest.raises(kind) as caught:
        WrenchStream(replace(WALL, **changed))
    assert caught.value.field == field
    assert caught.value.kind == "unsupported"


@pytest.mark.parametrize("radius", [0.0, -1.0, np.nan, np.inf, 1e5])
def test_a_radius_is_above_zero_and_moderate(radius):
    with pytest.raises(InvalidInputError, match="radius"):
        WrenchStream(WALL, radius=radius)


@pytest.mark.parametrize("wrench", [[1.0] * 5, [np.nan] * 6, [np.inf] + [0.0] * 5, [1e13] * 6, "x"])
def test_a_wrench_is_six_moderate_numbers(wrench, stream):
    with pytest.raises(InvalidInputError, match="body_wrench"):
        stream.set_points(wrench)
    assert stream.set_points(WEIGHT).verified
