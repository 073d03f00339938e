"""Climbs that are found and planned whole, on small walls of knobs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hand_models.base import CruxError, InvalidInputError, Pose
from planner import DeadlineError, Load, Question, Stance, evaluate, find_climb, plan, plan_climb
from planner.certification import check_bound
from planner.climbs import ClimbStep, MoveChecks, RouteMaker, detours, refuse_limits
from planner.climbs.finding import _Finder
from planner.question import ForceCap, Limits
from planner.search import Found, State, climb_certificate, search
from tests.suite.helpers.climbs import climbed
from tests.suite.helpers.knob_walls import best_climb, ends, factor, knob_wall, neighbours

START, GOAL = (0, 2, 4, 6), (0, 2, 4, 7)


def maker():
    return RouteMaker(knob_wall(), "a climb", Limits(), "max_margin")


def states():
    """Two moves with a shift before the second, and one at the end."""
    return [
        State(1, (0, 2, 4, 6)),
        State(1, (0, 2, 4, -1)),
        State(1, (0, 2, 4, 7)),
        State(4, (0, 2, 4, 7)),
        State(4, (-1, 2, 4, 7)),
        State(4, (1, 2, 4, 7)),
        State(7, (1, 2, 4, 7)),
    ]


def test_states_make_moves_with_shifts_before_lifts_and_one_at_the_end():
    wall, climb = knob_wall(), states()
    first, second, last = ClimbStep.each(climb)
    assert first == (tuple(climb[:1]), climb[1], climb[2])
    assert second == (tuple(climb[2:4]), climb[4], climb[5])
    assert last == (tuple(climb[5:]), None, None)
    route = maker().route([first, second, last])
    assert [move.hand.limb for move in route.moves] == ["front_left", "front_right"]
    assert route.moves[0].body is None
    assert route.moves[1].body is wall.bodies[4]
    assert route.end is wall.bodies[7]
    assert [hand.pose for hand in route.start.hands] == [wall.places[p].pose for p in climb[0][1]]


def test_what_fails_is_left_out_by_the_states_about_it():
    _, second, last = ClimbStep.each(states())
    climb = states()
    assert second.refused("shift") == {(climb[2], climb[3])}
    assert second.refused("open") == {(climb[3], climb[4])}
    assert second.refused("swing") == {(climb[3], climb[5])}
    assert second.refused("load") == {(climb[4], climb[5])}
    assert second.refused("start") == {(climb[2], climb[2])}
    assert last.refused("shift") == {(climb[5], climb[6])}


def test_stages_planned_at_the_tables_postures_have_the_load_factors_of_the_search():
    wall = knob_wall()
    limbs = wall.robot.limbs
    for state in (State(1, START), State(1, (0, 2, 4, -1)), State(4, (1, 2, 4, 7))):
        on = [(i, p) for i, p in enumerate(state.members) if p >= 0]
        joints = {limbs[i]: wall.reach.branches(p, state.body, i)[0] for i, p in on}
        hands = tuple(replace(wall.places[p], limb=limbs[i]) for i, p in on)
        stance = Stance(hands, wall.bodies[state.body], robot=wall.robot)
        com = tuple(wall.robot.com_at(joints))
        asked = Question(stance, load=Load(com=com), want=frozenset({"load_factor"}))
        assert plan(asked).load_factor == pytest.approx(factor(wall, state), rel=1e-6)


def test_a_move_needs_the_others_to_hold_what_its_closed_hand_does():
    wall = knob_wall()
    whole, lift = State(1, START), State(1, (0, 2, 4, -1))
    assert MoveChecks(wall).passes(whole, lift)
    assert MoveChecks(wall).passes(lift, whole)
    # within a small part of all limits the others do not hold it
    assert not MoveChecks(wall, Limits(utilisation=0.2)).passes(whole, lift)
    # the body is shifted on all hands, which has no such check
    assert MoveChecks(wall, Limits(utilisation=0.2)).passes(whole, State(4, START))


def test_detours_are_states_of_the_wall_one_after_the_other():
    wall, climb = knob_wall(), states()
    step = ClimbStep.each(climb)[1]
    found = [*detours(wall, MoveChecks(wall), climb, step)]
    assert found
    least = []
    for other in found:
        k = next(k for k, state in enumerate(other) if -1 in state.members and k > 1)
        assert other[k].body != climb[4].body
        assert other[0] == climb[0]
        assert other[-1] == climb[-1]
        assert other[k + 1] in neighbours(wall, other[k])
        assert other[k] in neighbours(wall, other[k - 1])
        least.append(min(factor(wall, state) for state in other[k - 1 : k + 2]))
    assert least == sorted(least, reverse=True)


def test_limbs_that_reach_nothing_at_an_end_are_named():
    wall = knob_wall()
    limb, entry = wall.robot.limbs[2], wall.reach.entry.copy()
    entry[:, 7, 2] = -1
    short = replace(wall, reach=replace(wall.reach, entry=entry))
    start, goal = ends(short, [1], START), ends(short, [7])
    found = find_climb(short, start, goal)
    assert found.status == "none"
    assert found.about.endswith(f"at the goal no placement that counts is within reach of {limb}")
    entry[4, 1, 2] = -1
    found = replace(found, ends=(start, ends(short, [1])))
    assert found.about.count(f"within reach of {limb}") == 1
    assert "at the start no placement" in found.about


@pytest.mark.slow
def test_a_climb_is_found_and_every_knot_of_it_is_verified():
    wall = knob_wall()
    told = []
    found = find_climb(
        wall, ends(wall, [1], START), ends(wall, [1], GOAL), within=1.0, progress=told.append
    )
    assert found.status == "found"
    assert found.climb.failure is None
    assert all(knot.verified for knot in found.climb.knots)
    assert found.result.feasible
    factors = [p.load_factor for p in found.result.plans]
    assert found.least == min(factors) == factors[found.deciding.stage]
    _, best = best_climb(wall, ends(wall, [1], START), ends(wall, [1], GOAL))
    assert found.bound >= best * (1.0 - 1e-9)
    assert found.gap == pytest.approx(found.bound / found.least - 1.0)
    assert all(each.load_factor > found.least for each in found.raises)
    assert {each.kind for each in found.raises} >= {"mass", "strength"}
    assert {each.phase for each in told} >= {"search", "moves", "stages", "changes"}
    # the route repeats the climb
    again = plan_climb(found.route)
    assert len(again.knots) == len(found.climb.knots)
    for knot, other in zip(found.climb.knots, again.knots, strict=True):
        assert knot.utilisation == pytest.approx(other.utilisation, abs=1e-6)


@pytest.mark.slow
def test_where_joints_decide_a_better_climb_is_looked_for(monkeypatch):
    wall = knob_wall()
    low, high = ends(wall, [0, 1, 2]), ends(wall, [6, 7, 8])
    torque = {
        limb: (0.5 * chain.torque_limits).tolist() for limb, chain in wall.robot.chains.items()
    }

    def found(seconds):
        limits = Limits(joint_torque=torque)
        return find_climb(wall, low, high, limits=limits, within=0.02, seconds=seconds)

    better = found(600.0)
    with monkeypatch.context() as patch:
        patch.setattr(_Finder, "_climb_higher", lambda _, first, *__: first)
        first = found(600.0)
    # by their statics, both are the best
    assert first.least < 0.9 * first.bound
    assert better.least > 1.1 * first.least
    assert better.bound == pytest.approx(first.bound, rel=1e-6)
    assert all(knot.verified for knot in better.climb.knots)
    assert better.least == pytest.approx(evaluate(better.route, workers=1).load_factor, rel=1e-6)


@pytest.mark.parametrize("finished", [True, False])
def test_a_climb_grows_step_by_step_unless_it_is_proven_that_there_is_none(finished, monkeypatch):
    wall, taken = knob_wall(), []
    nothing = replace(Found.nothing(), finished=finished)
    monkeypatch.setattr("planner.climbs.finding.search", lambda *_, **__: nothing)
    monkeypatch.setattr(_Finder, "_step", lambda _, ends, least: taken.append(least))
    low, high = ends(wall, [0, 1, 2]), ends(wall, [6, 7, 8])
    found = find_climb(wall, low, high, at_least=1.3, seconds=60.0)
    assert taken == ([] if finished else [1.3])
    assert found.status == ("blocked" if finished else "unknown")


@pytest.mark.parametrize("seconds", [None, 600.0])
def test_after_a_first_climb_the_best_by_statics_is_looked_for_or_in_time_better(
    seconds, monkeypatch
):
    wall, asked = knob_wall(), []
    low, high = ends(wall, [0, 1, 2]), ends(wall, [6, 7, 8])

    def searched(*given, **named):
        asked.append(named["passes"] is not None)
        return search(*given, **named)

    def higher(_, found, *__):
        asked.append("higher")
        return found

    monkeypatch.setattr("planner.climbs.finding.search", searched)
    monkeypatch.setattr(_Finder, "_climb_higher", higher)
    found = find_climb(wall, low, high, within=0.0, seconds=seconds)
    assert found.climb is not None
    # the first without moves
    assert asked == ([False, True] if seconds is None else [False, "higher"])


def test_a_deadline_in_the_search_for_changes_leaves_the_climb(monkeypatch):
    def late(*_):
        raise DeadlineError(1.0, "a plan was found")

    monkeypatch.setattr("planner.climbs.finding.raises", late)
    wall = knob_wall()
    found = find_climb(wall, ends(wall, [1], START), ends(wall, [1], START), within=0.1)
    assert (found.status, found.raises) == ("found", ())


@pytest.mark.parametrize(
    ("limits", "field"),
    [
        (Limits(margins="if_possible"), "limits.margins"),
        (Limits(palm_margin=2.0), "limits.palm_margin"),
        (Limits(tension_change=1e-6), "limits.tension_change"),
        (Limits(joint_torque={"front_left": [1.0]}), "limits.joint_torque.front_left"),
        (Limits(per_hand={"none": ForceCap(400.0)}), "limits.per_hand.none"),
    ],
)
def test_what_no_climb_can_have_is_refused_before_there_is_a_wall(limits, field):
    with pytest.raises(CruxError) as caught:
        refuse_limits(knob_wall().robot, limits, "max_margin")
    assert caught.value.field == field


def test_limits_of_hands_and_changes_of_tension_are_those_of_a_climb():
    caps = {"front_left": ForceCap(400.0)}
    refuse_limits(knob_wall().robot, Limits(per_hand=caps, tension_change=5.0), "min_effort")
    MoveChecks(knob_wall(), Limits(per_hand=caps, tension_change=5.0))


def test_it_is_proven_that_no_climb_has_a_load_factor_that_hands_do_not_hold():
    wall = knob_wall()
    found = find_climb(wall, ends(wall, [1], START), ends(wall, [1], GOAL), at_least=3.0)
    assert (found.status, found.climb, found.least) == ("none", None, None)
    assert found.bound <= 3.0


def test_the_certificate_is_one_of_the_bound_that_is_stated(monkeypatch):
    wall, bounds = knob_wall(), []
    low, high = ends(wall, [1], START), ends(wall, [1], GOAL)

    def forgetful(*given, **named):
        """Search; the last of several searches knows no bound, as if time were over."""
        known = search(*given, **named)
        bounds.append(known.bound)
        return known if len(bounds) == 1 else replace(known, bound=np.inf, proof=None)

    monkeypatch.setattr("planner.climbs.finding.search", forgetful)
    found = find_climb(wall, low, high, within=1.0)
    assert len(bounds) == 2
    assert found.bound == found.found.bound == bounds[0]
    certificate = climb_certificate(wall, low, high, found.found)
    assert certificate.multiple == found.bound
    assert check_bound(certificate).proven


def test_a_start_that_is_a_goal_is_a_climb_without_moves():
    wall = knob_wall()
    found = find_climb(wall, ends(wall, [1], START), ends(wall, [1], START), within=0.1)
    assert (found.status, found.climb.route.moves) == ("found", ())
    assert [knot.verified for knot in found.climb.knots] == [True]
    assert evaluate(found.route, workers=1).load_factor == pytest.approx(found.least, rel=1e-6)
    assert found.least <= found.bound
    assert found.deciding.stage == 0


def test_without_time_nothing_is_said_of_a_climb():
    wall = knob_wall()
    found = find_climb(wall, ends(wall, [1], START), ends(wall, [1], GOAL), seconds=1e-6)
    assert found.status == "unknown"
    assert found.climb is None


@pytest.mark.parametrize(
    ("field", "changes"),
    [
        ("within", {"within": np.nan}),
        ("within", {"within": -0.1}),
        ("at_least", {"at_least": 0.0}),
        ("seconds", {"seconds": 0.0}),
        ("seconds", {"seconds": np.inf}),
        ("goal", {"bodies": []}),
    ],
)
def test_impossible_numbers_are_refused(field, changes):
    wall = knob_wall()
    goal = ends(wall, changes.pop("bodies", [1]), GOAL)
    with pytest.raises(InvalidInputError) as caught:
        find_climb(wall, ends(wall, [1], START), goal, **changes)
    assert caught.value.field == field


def test_a_climb_branches_off_another_and_ends_with_a_shift():
    whole = climbed()
    route = whole.climb.route
    last = route.moves[-1].body
    end = Pose(last.position - 0.01 * last.rotation[:, 0], last.rotation)
    other = replace(route, moves=(route.moves[0],), end=end)
    climb = plan_climb(other, after=whole.climb)
    first = [knot for knot in whole.climb.knots if knot.move <= 1]
    assert list(climb.knots[: len(first)]) == first
    assert climb.failure is None
    assert (climb.knots[-1].phase, climb.knots[-1].move, climb.knots[-1].limb) == ("shift", 2, None)
    np.testing.assert_allclose(climb.knots[-1].body.position, end.position, atol=1e-12)
    result = evaluate(other, climb=climb)
    assert [(stage.phase, stage.move) for stage in result.stages][-1] == ("shift", 2)
    assert result.feasible
    assert climb.knots[-1].stage == len(result.stages) - 1
