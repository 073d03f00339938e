"""Climbs planned as one: every knot by an independent recomputation, and between the knots."""

import re
from dataclasses import replace

import numpy as np
import pytest
import scipy
from scipy.spatial.transform import Rotation

from hand_models.base import InvalidInputError, Pose, UnsupportedError, wrench_transport
from hand_models.hand import FINGERS
from planner import (
    ClimbSettings,
    ForceCap,
    Limits,
    Load,
    Move,
    Question,
    Route,
    Stance,
    deadline,
    plan_climb,
    robosimian,
    settle_each,
)
from planner.motion import CollisionScene, rocks_of
from planner.prepare import posture, prepare_stance
from planner.route.com_travel import mass_travel
from service.answering import questions
from service.commands.stances import read_route
from tests.suite.helpers.mujoco_statics import MujocoStatics

PHASES = ["start", "shift", "unload", "open", "swing", "close", "load"]


@pytest.fixture(scope="module")
def route() -> Route:
    """One move of the bundled route, after a small shift of the body."""
    bundled = questions.route_of(read_route("six-moves"))
    first, body = bundled.moves[0], bundled.start.body
    shifted = Pose(body.position + np.array([0.0, -0.02, 0.02]), body.rotation)
    return replace(bundled, moves=(replace(first, body=shifted),))


@pytest.fixture(scope="module")
def climb(route):
    found = plan_climb(route)
    assert found.failure is None
    return found


def check_knots(climb):
    """Balance and torques by MuJoCo, from the numbers of the knots alone."""
    start = climb.route.start
    statics = MujocoStatics(start.robot)
    for knot in climb.knots:
        torques, left = statics.rest(knot, start.gravity)
        assert np.abs(left).max() < 1e-5 * start.robot.mass
        for limb, own in torques.items():
            assert own == pytest.approx(knot.joint_torque[limb], abs=1e-6)
            most = start.robot.chains[limb].torque_limits
            assert np.abs(own / most).max() <= knot.utilisation + 1e-9
        assert knot.verified
        assert knot.utilisation <= 1.0 + 1e-6
        there = start.robot.hand_poses(knot.joints)
        for hand in knot.hands:
            at = knot.body @ there[hand.limb]
            assert at.position == pytest.approx(hand.pose.position, abs=1e-6)
            assert (hand.tensions >= 0.0).all()


def check_rates(climb, rates):
    """No set-point changes faster than the controller's rates; some take all their time."""
    full = 0
    for before, after in zip(climb.knots[:-1], climb.knots[1:], strict=True):
        time = after.time - before.time
        assert time > 0.0
        pairs = zip(before.hands, after.hands, strict=True)
        changes = [
            max(np.abs(a.tensions - b.tensions).max() for a, b in pairs) / rates.tension_rate,
            max(np.abs(after.joints[limb] - at).max() for limb, at in before.joints.items())
            / rates.joint_speed,
            np.linalg.norm(after.body.position - before.body.position) / rates.body_speed,
        ]
        assert max(changes) <= time * (1.0 + 1e-9)
        full += max(changes) > 0.999 * time
    assert full >= 0.5 * (len(climb.knots) - 1)


def test_the_knots_hold_by_mujoco(climb):
    check_knots(climb)


def test_the_phases_come_in_their_order(climb):
    phases = [knot.phase for knot in climb.knots]
    assert [*dict.fromkeys(phases)] == PHASES
    assert phases == sorted(phases, key=PHASES.index)
    assert [knot.index for knot in climb.knots] == list(range(len(phases)))
    stages = [knot.stage for knot in climb.knots if knot.stage is not None]
    assert stages == [0, 1, 2, 3]


def test_no_set_point_is_faster_than_its_rate(route, climb):
    check_rates(climb, ClimbSettings().complete())
    half = ClimbSettings(tension_rate=25.0)
    slower = plan_climb(route, half)
    check_rates(slower, half.complete())
    assert slower.knots[-1].time > climb.knots[-1].time


def test_the_leaving_hand_opens_and_the_other_hands_stay(climb):
    for before, after in zip(climb.knots[:-1], climb.knots[1:], strict=True):
        for one, two in zip(before.hands, after.hands, strict=True):
            if one.limb == after.limb and after.phase in ("open", "swing", "close"):
                continue
            if one.limb != after.limb:
                assert two.on_rock
            assert one.pose.position == pytest.approx(two.pose.position, abs=1e-9)
    swing = [knot for knot in climb.knots if knot.phase == "swing"]
    leaving = next(hand for hand in swing[-2].hands if hand.limb == "front_left")
    assert not leaving.on_rock
    assert not leaving.tensions.any()
    assert not leaving.wrench.any()


def least_utilisation(route, hands, moving, body, joints, tensions, wrench):
    """Least utilisation over all passive reactions at given tensions, by HiGHS."""
    start = route.start
    stance = Stance(tuple(hands), body, start.gravity, start.robot, joints)
    question = Question(stance, load=route.load, limits=route.limits)
    needed = question.needed_wrench(posture(question).weights)
    if moving is not None:
        at = start.robot.hand_poses(joints)[moving]
        needed = needed + wrench_transport(at) @ wrench
    prepared = prepare_stance(replace(question, body_wrench=needed))
    rows, most, balance, given = [], [], [], -needed
    spaces = prepared.hands.spaces
    count = sum(len(space.columns) for space in spaces)
    before, bounds = 0, []
    into_body = body.inverse()
    for space, hand in zip(spaces, hands, strict=True):
        own = slice(before, before + len(space.columns))
        limit, hard = np.zeros((len(space.s), count + 1)), np.zeros((len(space.h), count + 1))
        limit[:, own], limit[:, -1], hard[:, own] = space.L / space.s[:, None], -1.0, space.H
        rows += [limit, hard]
        most += [-space.l0 / space.s, space.h + 1e-7]
        carried = wrench_transport(into_body @ hand.pose)
        balance.append(carried @ space.generators)
        given = given - carried @ space.origin
        names = [f"{finger}/tension" for finger in FINGERS]
        fixed = dict(zip(names, tensions[hand.limb], strict=True))
        bounds += [(fixed.get(name), fixed.get(name)) for name in space.columns]
        before += len(space.columns)
    found = scipy.optimize.linprog(
        np.eye(count + 1)[-1],
        A_ub=np.concatenate(rows),
        b_ub=np.concatenate(most),
        A_eq=np.hstack([*balance, np.zeros((6, 1))]),
        b_eq=given,
        bounds=[*bounds, (None, None)],
    )
    assert found.status == 0, found.message
    where = prepared.where
    idle = [
        np.abs(own.torques(wrench if limb == moving else np.zeros(6)) / own.limits).max()
        for limb, own in where.idle(stance).items()
    ]
    return max(found.fun, *idle, 0.0)


def between(before, after, t):
    """Set-points as a controller interpolates them."""
    turn = Rotation.from_matrix(before.body.rotation.T @ after.body.rotation).as_rotvec()
    place = before.body.position + t * (after.body.position - before.body.position)
    body = Pose(place, before.body.rotation @ Rotation.from_rotvec(t * turn).as_matrix())
    joints = {limb: at + t * (after.joints[limb] - at) for limb, at in before.joints.items()}
    pairs = zip(before.hands, after.hands, strict=True)
    tensions = {a.limb: a.tensions + t * (b.tensions - a.tensions) for a, b in pairs}
    pairs = zip(before.hands, after.hands, strict=True)
    wrenches = {a.limb: a.wrench + t * (b.wrench - a.wrench) for a, b in pairs}
    return body, joints, tensions, wrenches


def check_between(climb, times):
    """The utilisation at set-points between knots is never above the bound, and sometimes near."""
    route, nearest = climb.route, np.inf
    holds = {hand.limb: hand for hand in route.start.hands}
    for before, after in zip(climb.knots[:-1], climb.knots[1:], strict=True):
        limb = after.limb
        if after.phase == "load" and before.phase != "load":
            holds[limb] = route.moves[after.move - 1].hand
        moving = limb if after.phase in ("open", "swing", "close") else None
        hands = [hand for each, hand in holds.items() if each != moving]
        for t in times:
            body, joints, tensions, wrenches = between(before, after, t)
            wrench = wrenches.get(moving)
            used = least_utilisation(route, hands, moving, body, joints, tensions, wrench)
            assert used <= after.bound + 1e-6, (after.index, after.phase, t)
            nearest = min(nearest, after.bound - used)
    assert nearest < 1e-3 or len(climb.knots) < 10


def test_set_points_between_knots_stay_below_the_bound(climb):
    check_between(climb, [0.1, 0.5, 0.8])


def test_bounds_are_close_to_the_knots(climb):
    for before, after in zip(climb.knots[:-1], climb.knots[1:], strict=True):
        top = max(before.utilisation, after.utilisation)
        assert top - 1e-9 <= after.bound <= 1.02 * top + 0.005 + 1e-9


def test_mass_leaves_the_straight_line_by_no_more_than_its_bound():
    robot, rng = robosimian(), np.random.default_rng(3)
    for size in (0.02, 0.1, 0.4):
        first = {
            limb: rng.uniform(np.maximum(chain.lower, -2.0), np.minimum(chain.upper, 2.0))
            for limb, chain in robot.chains.items()
        }
        last = {
            limb: np.clip(at + size * rng.normal(size=7), chain.lower, chain.upper)
            for (limb, at), chain in zip(first.items(), robot.chains.values(), strict=True)
        }
        turn, times = 0.3 * size * rng.normal(size=3), np.linspace(0.0, 1.0, 41)
        moment = robot.mass * np.array(
            [
                Rotation.from_rotvec(t * turn).apply(
                    robot.com_at({limb: at + t * (last[limb] - at) for limb, at in first.items()})
                )
                for t in times
            ]
        )
        line = moment[0] + times[:, None] * (moment[-1] - moment[0])
        off = np.linalg.norm(moment - line, axis=1)[1:-1] / (4.0 * times * (1.0 - times))[1:-1]
        most = mass_travel(robot, Load(), turn, first, last)
        assert off.max() <= most
        assert most <= (1.0 + 20.0 * size) * off.max() + 1e-9


def test_tensions_change_by_no_more_than_the_limit(route, climb):
    whole = [
        max(np.abs(a.tensions - b.tensions).max() for a, b in zip(x.hands, y.hands, strict=True))
        for x, y in zip(climb.knots[:-1], climb.knots[1:], strict=True)
    ]
    assert max(whole) > 20.0
    small = plan_climb(replace(route, limits=Limits(tension_change=8.0)))
    assert small.failure is None
    for before, after in zip(small.knots[:-1], small.knots[1:], strict=True):
        for one, two in zip(before.hands, after.hands, strict=True):
            assert np.abs(one.tensions - two.tensions).max() <= 8.0 + 1e-6
    assert len(small.knots) > len(climb.knots)
    check_knots(small)
    # what is put in between changes neither the other knots nor the time
    assert small.knots[-1].time == pytest.approx(climb.knots[-1].time, rel=1e-6)
    assert small.knots[-1].utilisation == pytest.approx(climb.knots[-1].utilisation, abs=1e-9)


def test_a_least_change_of_tensions_keeps_the_number_of_knots_small(route):
    with pytest.raises(InvalidInputError, match=r"at least 0\.1 N in a climb") as raised:
        plan_climb(replace(route, limits=Limits(tension_change=0.001)))
    assert raised.value.field == "limits.tension_change"


def test_a_cap_on_the_force_counts_while_a_hand_opens(route):
    """The closed hand pulls at the rock; while it opens it presses, with 4.4 N."""

    def capped(most):
        cap = ForceCap(largest_force=(None, None, (-1e4, most)))
        return plan_climb(replace(route, limits=Limits(per_hand={"front_left": cap})))

    pressed = []
    for knot in capped(6.0).knots:
        (hand,) = (hand for hand in knot.hands if hand.limb == "front_left")
        assert hand.wrench[2] <= 6.0 * knot.utilisation + 1e-9
        if knot.phase == "open":
            pressed.append(hand.wrench[2])
    assert max(pressed) > 4.0
    for most, words in ((2.0, r"would need [12]\."), (0.0, "$")):
        failure = capped(most).failure
        assert (failure.phase, failure.limb) == ("open", "front_left")
        assert re.search(
            f"front_left: the hand may exert no more that way.*{words}", failure.reason
        )


def test_plans_of_least_effort_leave_room_between_them(route):
    """They use all of the cap, from which spines that let go would take the hands beyond it."""
    found = plan_climb(replace(route, objective="min_effort"))
    assert found.failure is None
    stages = [knot.utilisation for knot in found.knots if knot.stage is not None]
    assert stages == pytest.approx([1.0] * 4, abs=1e-5)
    check_knots(found)
    check_between(found, [0.5])


@pytest.mark.slow
def test_plans_that_serve_samples_best_may_be_beyond_a_row_by_rounding():
    """Their programs leave 1e-5 N beyond a hard row, which the check allows."""
    knobs = questions.route_of(read_route("knobs"))
    found = plan_climb(replace(knobs, objective="max_robust"))
    assert found.failure is None
    check_knots(found)
    check_between(found, [0.5])


def test_a_move_of_the_whole_scene_changes_no_utilisation(route, climb):
    turn = Rotation.from_rotvec([0.3, -0.5, 1.1]).as_matrix()
    by = Pose(np.array([1.0, -2.0, 0.7]), turn)
    hands = tuple(replace(hand, pose=by @ hand.pose) for hand in route.start.hands)
    start = replace(
        route.start, hands=hands, body=by @ route.start.body, gravity=turn @ route.start.gravity
    )
    (move,) = route.moves
    moved = replace(move, hand=replace(move.hand, pose=by @ move.hand.pose), body=by @ move.body)
    found = plan_climb(replace(route, start=start, moves=(moved,)))
    assert [knot.phase for knot in found.knots] == [knot.phase for knot in climb.knots]
    for here, there in zip(climb.knots, found.knots, strict=True):
        assert there.utilisation == pytest.approx(here.utilisation, abs=1e-5)
        assert there.time == pytest.approx(here.time, rel=1e-3)


def test_a_climb_ends_at_the_move_that_has_no_plan(route, climb):
    weak = plan_climb(replace(route, load=Load(mass=165.0)))
    assert weak.failure.move == 1
    assert weak.failure.phase in ("unload", "open")
    assert weak.failure.limb == "front_left"
    assert "would" in weak.failure.reason
    assert weak.knots[-1].stage == 1
    heavy = plan_climb(replace(route, load=Load(mass=400.0)))
    assert (heavy.failure.move, heavy.failure.phase, heavy.knots) == (0, "start", ())


def test_a_hold_out_of_reach_ends_the_climb_in_the_swing(route):
    (move,) = route.moves
    far = replace(move.hand, pose=Pose(move.hand.pose.position * 1.8, move.hand.pose.rotation))
    found = plan_climb(replace(route, moves=(replace(move, hand=far),)))
    assert (found.failure.phase, found.failure.limb) == ("swing", "front_left")
    assert "out of reach by" in found.failure.reason
    assert found.knots[-1].phase == "open"


def test_a_link_in_the_way_is_named(route):
    """A body so near the rock that links go through it."""
    start = route.start
    near = start.body.position + 0.3 * start.hands[0].pose.rotation[:, 2]
    (move,) = route.moves
    shifted = replace(move, body=Pose(near, start.body.rotation))
    found = plan_climb(replace(route, moves=(shifted,)))
    assert found.failure.phase == "shift"
    assert found.failure.move == 1
    assert len(found.knots) == 1


def test_a_shift_into_rock_says_so(route):
    """A limb could not follow either: but what is so is that the body ends in the rock."""
    (move,), start = route.moves, route.start
    into = Pose(start.body.position + 0.5 * start.hands[0].pose.rotation[:, 2], start.body.rotation)
    found = plan_climb(replace(route, moves=(replace(move, body=into),)))
    assert (found.failure.phase, len(found.knots)) == ("shift", 1)
    assert re.fullmatch(
        r"while the body shifts, body is [\d.]+ mm deep in rock of \w+; shift the body less or "
        "elsewhere",
        found.failure.reason,
    )


def test_joints_of_a_move_alone_are_refused_before_anything_is_planned(route):
    (move,) = route.moves
    bare = replace(route.start, joints=None)
    for limb in ("rear_left", move.hand.limb):
        given = replace(move, joints={limb: np.zeros(7)})
        with pytest.raises(InvalidInputError, match=r"requires stance\.joints") as raised:
            plan_climb(replace(route, start=bare, moves=(given,)))
        assert raised.value.field == "moves[0].joints"


@pytest.mark.parametrize("value", ["50", True, [50.0], float("nan"), 0.0, 1e5])
def test_rates_that_are_no_numbers_are_refused(value):
    with pytest.raises(InvalidInputError, match=r"must be .*0\.0001 to 10000, got ") as raised:
        ClimbSettings(joint_speed=value)
    assert raised.value.field == "joint_speed"


def test_what_a_climb_cannot_have_is_refused(route):
    floating = tuple(replace(hand, wrist="floating") for hand in route.start.hands)
    with pytest.raises(UnsupportedError) as raised:
        plan_climb(replace(route, start=replace(route.start, hands=floating)))
    assert raised.value.field == "stance.hands[0].wrist"
    with pytest.raises(UnsupportedError) as raised:
        plan_climb(replace(route, load=Load(angular_acceleration=(0.1, 0.0, 0.0))))
    assert raised.value.field == "load.angular_acceleration"
    with pytest.raises(UnsupportedError, match="comes off its rock") as raised:
        plan_climb(replace(route, limits=Limits(palm_margin=2.0)))
    assert raised.value.field == "limits.palm_margin"
    with pytest.raises(UnsupportedError, match="knots") as raised:
        plan_climb(replace(route, limits=Limits(margins="if_possible")))
    assert raised.value.field == "limits.margins"
    (move,) = route.moves
    given = replace(move, joints={"rear_left": np.zeros(7)})
    solved = replace(route.start, joints="solve")
    with pytest.raises(UnsupportedError) as raised:
        plan_climb(replace(route, start=solved, moves=(given,)))
    assert raised.value.field == "moves[0].joints.rear_left"
    air = replace(move.hand, hold_in_hand=Pose(np.array([0.0, 0.0, 0.5]), np.eye(3)))
    with pytest.raises(InvalidInputError) as raised:
        plan_climb(replace(route, moves=(replace(move, hand=air),)))
    assert raised.value.field == "moves[0].hold"


@pytest.mark.slow
def test_the_bundled_route_runs_from_end_to_end():
    route = questions.route_of(read_route("knobs"))
    climb = plan_climb(route)
    assert climb.failure is None
    assert [knot.stage for knot in climb.knots if knot.stage is not None] == list(range(11))
    check_knots(climb)
    check_rates(climb, ClimbSettings().complete())
    check_clear(climb)
    check_between(climb, np.linspace(0.02, 0.98, 20))


def check_clear(climb):
    """No link meets rock or another link, by dense sampling with other code than the search's."""
    route, robot = climb.route, climb.route.start.robot
    hands = [*route.start.hands, *(move.hand for move in route.moves)]
    scene = CollisionScene(robot, rocks_of(zip(hands, settle_each(robot.hand, hands), strict=True)))
    for before, after in zip(climb.knots[:-1], climb.knots[1:], strict=True):
        if after.phase not in ("shift", "swing"):
            continue
        for t in (0.0, 0.25, 0.5, 0.75):
            body, joints, _, _ = between(before, after, t)
            assert scene.nearest(body, joints).distance > 0.0


def test_a_bundled_route_fails_and_says_which_link_meets_what():
    found = plan_climb(questions.route_of(read_route("knobs-blocked")))
    assert (found.failure.move, found.failure.phase) == (3, "swing")
    assert "limb3" in found.failure.reason
    assert "mm" in found.failure.reason
    assert found.knots[-1].move == 3


@pytest.mark.slow
def test_random_moves():
    route, rng, whole = questions.route_of(read_route("knobs")), np.random.default_rng(5), 0
    for _ in range(15):
        hand = route.start.hands[rng.choice(4, p=[0.45, 0.05, 0.05, 0.45])]
        turn = Rotation.from_rotvec(0.15 * rng.normal(size=3)).as_matrix()
        way = hand.pose.rotation @ (rng.uniform([0.05, -0.08, -0.03], [0.2, 0.08, 0.03]))
        there = Pose(hand.pose.position + way, hand.pose.rotation @ turn)
        shift = 0.03 * rng.normal(size=3) * [0.3, 1.0, 1.0]
        if hand.limb.startswith("rear"):  # which the others can do without farther up only
            aside = -0.1 * np.sign(hand.pose.position[1])
            shift = shift + 0.18 * route.start.body.rotation[:, 0] + [0.0, aside, 0.0]
        small = Rotation.from_rotvec(0.03 * rng.normal(size=3)).as_matrix()
        start = route.start.body
        body = Pose(start.position + shift, start.rotation @ small)
        move = Move(
            replace(hand, pose=there),
            body if hand.limb.startswith("rear") or rng.random() < 0.5 else None,
        )
        found = plan_climb(replace(route, moves=(move,)))
        whole += found.failure is None
        assert found.failure is None or len(found.failure.reason) > 20
        check_knots(found)
        check_rates(found, ClimbSettings().complete())
        check_clear(found)
        check_between(found, rng.uniform(size=5))
    assert whole >= 6


def test_a_deadline_says_how_far_the_climb_is(monkeypatch):
    route = questions.route_of(read_route("six-moves"))

    def expire(done: int, count: int) -> None:
        monkeypatch.setattr("planner.deadline.clock.time.perf_counter", lambda: float("inf"))

    said = "before the climb was planned, at the shift of move 2 of 6"
    with deadline.within(600.0), pytest.raises(deadline.DeadlineError, match=said):
        plan_climb(route, progress=expire)
