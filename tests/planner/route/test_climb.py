"""Climbs planned as one: every knot by an independent recomputation, and between the knots."""

from dataclasses import replace

import numpy as np
import pytest
import scipy
from scipy.spatial.transform import Rotation

from hand_models.base import InvalidInputError, Pose, UnsupportedError, wrench_transport
from hand_models.hand import FINGERS
from planner import ClimbSettings, Load, Question, Route, Stance, plan_climb, robosimian
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
    shifted = Pose(body.position + [0.0, -0.02, 0.02], body.rotation)
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
    assert full > 0.5 * len(climb.knots)


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
    leaving = [hand for hand in swing[-2].hands if hand.limb == "front_left"][0]
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
        fixed = dict(zip([f"{finger}/tension" for finger in FINGERS], tensions[hand.limb]))
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
    assert nearest < 1e-3


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
