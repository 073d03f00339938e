"""What would make a stance hold: that it is true, and what one sees by hand is found."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hand_models.base import InvalidInputError, Pose
from hand_models.rock import Plane
from planner import advice
from planner.advice import changed
from planner.advice.body import BodySearch, slope
from planner.advice.changes import SETTINGS
from planner.advice.new_holds import NewHold, every_hold
from planner.advice.trials import StanceTrial, Trials
from planner.deadline import DeadlineError
from planner.explanation import scene_findings
from planner.prepare import prepare_stance
from planner.question import BodyRange, Load, Question
from planner.result import Advice, Plan
from planner.scene import clearance, scene_of
from planner.solving import plan, try_stance
from service import answering
from service.answering import advised, question
from service.commands.stances import read_request
from service.requests import PlanRequest
from tests.suite.helpers.random_questions import BEYOND_HELP, OUT_OF_PLANS, requested
from tests.suite.helpers.stances import SANDPAPER, ask, moved, on_wall, random_question

SEED = 32  # four hands under their own weight, no limits of their own


def advise(asked: Question, plans: int = SETTINGS.plans) -> tuple[tuple[Advice, ...], bool]:
    """What is advised of a question."""
    return advice.advise(asked, try_stance, plans)


def planned(asked: Question) -> Plan:
    """The plan of a question without advice."""
    return plan(replace(asked, want=asked.want - {"advice"}))


def heavier(name: str, mass: float, *want: str) -> PlanRequest:
    """A bundled stance that has to hold another mass."""
    request = msgspec.to_builtins(read_request(name))
    request["load"] = {"mass": mass}
    return msgspec.convert(request | {"want": [*want]}, PlanRequest)


@pytest.fixture(scope="module")
def asked() -> PlanRequest:
    return heavier("wall", 125.0, "advice", "load_factor")


@pytest.fixture(scope="module")
def reply(asked):
    return answering.answer_plan(asked)


def of_kind(told, kind: str) -> list[Advice]:
    return [each for each in told if each.kind == kind]


def test_each_advice_gives_what_it_promised_when_its_request_is_planned(asked, reply):
    assert reply.status == "overloaded"
    assert reply.advice
    for sent in reply.advice:
        told = msgspec.json.decode(msgspec.json.encode(sent), type=Advice)
        written = msgspec.json.encode(advised(asked, told))
        answer = answering.answer_plan(msgspec.json.decode(written, type=PlanRequest))
        assert answer.verified
        assert answer.status == told.status
        assert answer.utilisation == pytest.approx(told.utilisation, abs=1e-6)
        assert answer.load_factor == pytest.approx(told.load_factor, abs=1e-6)
        assert told.holds == (answer.utilisation <= 1.0 + 1e-6)
        # in Python the same, without the message
        there = planned(changed(question(asked), told.changes))
        assert there.utilisation == pytest.approx(told.utilisation, abs=1e-6)


def test_what_holds_comes_first_by_its_size_and_everything_told_helps(reply):
    holding = [each.size for each in reply.advice if each.holds]
    assert holding == sorted(holding)
    assert [each.holds for each in reply.advice] == sorted(
        (each.holds for each in reply.advice), reverse=True
    )
    assert len(reply.advice) <= 10
    assert all(each.utilisation < reply.utilisation for each in reply.advice)


def test_the_largest_mass_is_the_load_factors(reply):
    (told,) = of_kind(reply.advice, "mass")
    assert told.changes["load.mass"] == pytest.approx(125.0 * reply.load_factor, rel=1e-3)
    assert told.utilisation == pytest.approx(1.0, abs=1e-3)


def test_no_weaker_a_hold_would_do_than_is_told(asked, reply):
    every = [each for each in of_kind(reply.advice, "strength") if len(each.limbs) == 4]
    (told,) = every
    strength = {each["shear_limit"] for each in told.changes.values()}
    (factor,) = {each / question(asked).stance.hands[0].surface.shear_limit for each in strength}
    weaker = {
        path: surface
        | {n: surface[n] * 0.97 for n in ("shear_limit", "pull_off_limit", "lateral_limit")}
        for path, surface in told.changes.items()
    }
    assert factor > 1.0
    assert planned(changed(question(asked), weaker)).utilisation > 1.0


def test_a_hand_that_is_made_to_overload_itself_had_better_let_go():
    stance = on_wall(surface=SANDPAPER)
    hands = list(stance.hands)
    hands[1] = replace(hands[1], wrench=(None, None, -400.0, None, None, None))
    asked = ask(replace(stance, hands=tuple(hands)), load=Load(mass=15.0, com=(0.0, 0.0, 0.0)))
    assert planned(asked).status == "overloaded"
    told, whole = advise(asked)
    assert whole
    (letting,) = of_kind(told, "let_go")
    assert letting.limbs == ["rear_right"]
    assert letting.holds
    three = replace(stance, hands=(hands[0], *hands[2:]))
    assert planned(replace(asked, stance=three)).utilisation == pytest.approx(letting.utilisation)


# The body's shift ---------------------------------------------------------------------------------


def shifted(asked: Question, shift) -> float:
    """The least utilisation with the body elsewhere, along its own axes."""
    body = asked.stance.body
    there = replace(asked.stance, body=body @ Pose(np.asarray(shift, dtype=float), np.eye(3)))
    return try_stance(prepare_stance(replace(asked, stance=there))).utilisation


def test_the_slope_is_that_of_the_least_utilisation():
    asked, step = random_question(SEED), 1e-5
    found = slope(try_stance(prepare_stance(asked)))
    for axis, value in zip(np.eye(3), found, strict=True):
        rise = shifted(asked, step * axis) - shifted(asked, -step * axis)
        assert rise / (2.0 * step) == pytest.approx(value, rel=1e-3, abs=1e-3)


def test_the_least_utilisation_is_convex_in_the_shift_and_above_every_slope():
    asked, rng = random_question(SEED), np.random.default_rng(0)
    grows, base = slope(try_stance(prepare_stance(asked))), shifted(asked, np.zeros(3))
    for a, b in rng.uniform(-0.15, 0.15, (6, 2, 3)):
        there = shifted(asked, a)
        assert shifted(asked, 0.5 * (a + b)) <= 0.5 * (there + shifted(asked, b)) + 1e-5
        assert there >= base + grows @ a - 1e-4


def test_no_place_of_a_grid_is_better_than_the_best_shift():
    asked = random_question(SEED)
    trials = Trials(asked.bare(), try_stance)
    search = BodySearch(trials)
    search.run()
    best = min(each.utilisation for each in trials.of(search.changes()))
    stance = asked.stance
    limbs, poses = [h.limb for h in stance.hands], [h.pose for h in stance.hands]
    for shift in itertools.product((-0.15, -0.075, 0.0, 0.075, 0.15), repeat=3):
        body = stance.body @ Pose(np.array(shift), np.eye(3))
        off = [h.pose.rotation[:, 2] @ (h.pose.position - body.position) for h in stance.hands]
        if min(off) < 0.15 or max(stance.robot.stretches(body, limbs, poses)) > 1.0:
            continue
        if clear_of_rock(replace(asked, stance=replace(stance, body=body))) < 0.0:
            continue
        assert shifted(asked, shift) >= best * (1.0 - 5e-3)


def clear_of_rock(asked) -> float:
    prepared = prepare_stance(asked)
    return clearance(scene_of(asked.stance, prepared.batch.hands), None).body_rock.distance


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1005, 1030, 1040, 1058, 1097])
def test_no_advice_takes_the_body_into_rock_or_deeper_than_it_is(seed):
    asked = requested(seed)
    now = clear_of_rock(asked)
    told, _ = advise(asked)
    assert told
    for each in told:
        assert clear_of_rock(changed(asked, each.changes)) >= min(now, 0.0) - 1.1e-3


@pytest.mark.slow
def test_a_shift_that_is_told_is_one():
    told, _ = advise(requested(1058), 30)
    assert told
    assert not any("[0.000, 0.000, 0.000]" in each.sentence for each in told)


@pytest.mark.slow
def test_the_body_stays_in_the_range_that_is_given():
    asked = replace(random_question(SEED), body_range=BodyRange(shift=0.03, tilt=0.0))
    # the body is among the first changes that are tried
    told, _ = advise(asked, 16)
    body, moved = asked.stance.body, of_kind(told, "body")
    assert moved
    for each in moved:
        there = changed(asked, each.changes).stance.body
        shift = body.rotation.T @ (there.position - body.position)
        assert np.abs(shift).max() <= 0.03 + 1e-9
        assert there.rotation == pytest.approx(body.rotation, abs=1e-12)


@pytest.mark.slow
def test_a_body_wrench_that_is_given_says_nothing_of_where_the_body_is():
    asked = random_question(76)
    assert asked.body_wrench is not None
    told, _ = advise(asked, 20)
    assert told
    assert not any("stance.body" in each.changes for each in told)


# Everything ---------------------------------------------------------------------------------------


def figures(told) -> list[tuple]:
    return [(each.kind, frozenset(each.limbs), each.holds) for each in told]


@pytest.mark.slow
def test_advice_is_the_same_elsewhere_and_in_another_order():
    asked = random_question(SEED)
    told, _ = advise(asked)
    by = Pose(np.array([1.0, -2.0, 0.5]), Rotation.from_rotvec([0.4, -0.7, 1.1]).as_matrix())
    elsewhere, _ = advise(replace(asked, stance=moved(asked.stance, by)))
    hands = replace(asked.stance, hands=asked.stance.hands[::-1])
    turned, _ = advise(replace(asked, stance=hands))
    for other in (elsewhere, turned):
        assert figures(other) == figures(told)
        assert [each.utilisation for each in other] == pytest.approx(
            [each.utilisation for each in told], rel=1e-3
        )


def counted_plans(monkeypatch) -> list[StanceTrial]:
    """All plans that are made from now on."""
    plans: list[StanceTrial] = []
    tried = Trials._try

    def counted(self, prepared):
        plans.append(tried(self, prepared))
        return plans[-1]

    monkeypatch.setattr(Trials, "_try", counted)
    return plans


@pytest.mark.slow
def test_no_more_plans_are_made_than_are_allowed(monkeypatch):
    plans = counted_plans(monkeypatch)
    advise(random_question(46), 15)
    assert 0 < len(plans) <= 15
    assert SETTINGS.plans == 100


def test_where_time_is_over_what_was_found_is_told_and_that_it_is_not_all(monkeypatch):
    tried, count = Trials._try, 0

    def late(self, prepared):
        nonlocal count
        count += 1
        if count > 30:
            raise DeadlineError(100.0, "all changes were tried")
        return tried(self, prepared)

    monkeypatch.setattr(Trials, "_try", late)
    answer = plan(replace(ask(on_wall(), "advice"), deadline=100.0))
    assert answer.verified
    assert answer.unfinished == ("advice",)
    assert answer.advice
    assert "before all changes were tried" in answer.warnings[-1]


@pytest.mark.slow
def test_what_is_told_of_least_effort_is_of_a_plan_of_least_effort():
    asked = replace(random_question(84), objective="min_effort")
    told, whole = advise(asked)
    assert whole
    assert told
    for each in told:
        there = planned(changed(asked, each.changes))
        assert there.verified
        assert there.utilisation == pytest.approx(each.utilisation, abs=1e-6)


@pytest.mark.parametrize("seed", [28, 75])
@pytest.mark.slow
def test_no_advice_is_told_that_would_be_warned_of_with_joints_too(seed):
    asked = requested(seed)
    told, whole = advise(asked)
    assert whole
    assert told
    known = {each.kind for each in scene_findings(prepare_stance(asked))}
    for each in told:
        there = scene_findings(prepare_stance(changed(asked, each.changes)))
        assert {found.kind for found in there} <= known


def test_where_no_change_leaves_a_plan_nothing_is_told():
    stance = on_wall(Plane(), outer_rotation=0.0, palm=False, lateral=False, limbs=("rear_left",))
    asked = ask(stance, body_wrench=np.array([0.0, 0.0, -1e5, 0.0, 0.0, 0.0]))
    assert planned(asked).status == "infeasible"
    assert advise(asked)[0] == ()


def test_nothing_is_told_that_nobody_asked_for():
    assert plan(ask(on_wall())).advice is None
    with pytest.raises(InvalidInputError):
        changed(ask(on_wall()), {"limits.utilisation": 2.0})


@pytest.mark.slow
def test_random_overloaded_stances_are_helped_by_what_was_promised(monkeypatch):
    plans = counted_plans(monkeypatch)
    left, seen = set(), 0
    for seed in itertools.count(1):
        if seen == 7:
            break
        asked = random_question(seed)
        if len(asked.stance.hands) < 3 or planned(asked).status != "overloaded":
            continue
        seen += 1
        plans.clear()
        told, whole = advise(asked)
        assert whole
        used_up = len(plans) >= SETTINGS.plans
        counted = [each for each in told if each.kind not in SETTINGS.kinds_of_other_task]
        if not any(each.holds for each in counted):
            left.add(seed)
            assert used_up == (seed in OUT_OF_PLANS)
        for each in counted:
            assert not any(p.endswith("surface") or p.startswith("load") for p in each.changes)
        for each in told[:2]:
            there = planned(changed(asked, each.changes))
            assert there.utilisation == pytest.approx(each.utilisation, abs=1e-6)
            assert math.isfinite(there.utilisation)
    # that no combination helps the former is proved in the tests of combinations
    assert left <= {*BEYOND_HELP, *OUT_OF_PLANS}


def test_no_hold_is_like_one_on_a_rock_that_hands_share():
    """What is elsewhere on it is known: a copy of it under another hand would stand in W twice."""
    request = msgspec.to_builtins(heavier("wall", 125.0))
    stance = request["stance"]
    held = stance["hands"][0]["pose"]
    for shared in (False, True):
        if shared:
            stance["rocks"] = {"wall": {"shape": "plane", "pose": held}}
        for hand in stance["hands"]:
            hand["hold"] = {"shape": "rock", "rock": "wall"} if shared else {"shape": "plane"}
        asked = question(msgspec.convert(request, PlanRequest))
        limbs = asked.stance.robot.limbs
        trials = Trials(asked.bare(), try_stance)
        assert all(bool(NewHold(trials, limb).likes) != shared for limb in limbs)
        assert shared or any(every_hold(trials, limbs[0]))


def test_nothing_is_advised_that_is_far_from_holding_or_while_a_unit_is_in_doubt():
    asked = ask(on_wall(Plane(), outer_rotation=0.0), "advice")
    answer = plan(asked)
    assert answer.status == "infeasible"
    assert all(each.utilisation < 5.0 for each in answer.advice)
    in_millimetres = replace(asked, load=Load(com=(0.33, -0.82, -132.9)))
    answer = plan(in_millimetres)
    assert answer.advice == ()
    assert answer.warnings[-1] == "no search for advice while a number is in doubt: load.com"
