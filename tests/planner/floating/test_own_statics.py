"""Loads of plans with compliant wrists, against statics of their own.

Of the product only numbers of the closed hands are taken: geometry, springs, and loads at rest. The
chain of phalanges is laid on the round rock anew where a wrist has gone, beds of springs are
integrated, all states of the tendon's joints are tried, and joints are balanced one by one.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from hand_models.base import Array
from hand_models.hand import FINGERS, SettledHand
from hand_models.tendon import FingerTendon
from planner.prepare import settle_hand
from planner.result import HandPlan
from planner.solving import KnownStance
from service.answering import questions
from service.commands.stances import read_request
from tests.hand_models.tendon.test_finger_tendon import by_enumeration
from tests.suite.helpers.stances import complying

PHALANGES = 3
RADIUS = 0.15
"""Of the logs that the bundled stance holds on to [m]."""


def displaced(twist: Array, place: Array) -> Array:
    """Where a point of the hand goes [m]; rotations count to second order."""
    turned = np.cross(twist[3:], place)
    return twist[:3] + turned + 0.5 * np.cross(twist[3:], turned)


def pressed_at(near: float, far: float, touches: float, depth: float) -> float:
    """Centre of the pressure that a bed exerts on round rock, by a sum of thin strips [m]."""
    strips = np.linspace(near, far, 4001)
    pressure = np.maximum(depth - (strips - touches) ** 2 / (2.0 * RADIUS), 0.0)
    return float(pressure @ strips / pressure.sum())


class Laid(NamedTuple):
    """A finger on its log, in its plane: three phalanges."""

    joints: Array
    points: Array
    """Where they bear [m]."""
    angles: Array
    behind: Array
    """Where each tile touches, along its face, less the arc from there on the rock [m]."""


def laid(settled: SettledHand, i: int, twist: Array) -> Laid:
    """Lay each phalanx on the log: by its tile's face, or by an edge where that would end."""
    hand, seat = settled.hand, settled.seating.pose
    frame = hand.frames(settled.grasp.outer_rotation)[i]
    axes = np.array([frame.along, [0.0, 0.0, 1.0]])
    axis = seat.rotation @ np.array([0.0, 0.0, RADIUS]) + seat.position
    centre, base = axes @ (axis - frame.joint), axes @ displaced(twist, frame.joint)
    model, outer = hand.finger, FINGERS[i].startswith("outer")
    near, far = model.tile_range
    joints, points, angles, behind = [base], [], [], []
    for depth in settled.closing_tension * np.array(model.depths(outer)):
        away = centre - joints[-1]
        toward, far_away = math.atan2(away[1], away[0]), math.hypot(*away)
        angle = toward - math.asin((model.tile_height + RADIUS) / far_away)
        touches = far_away * math.cos(toward - angle)
        if not near <= touches <= far:
            touches = near if touches < near else far
            arm = math.hypot(touches, model.tile_height)
            square = far_away**2 + arm**2 - RADIUS**2
            opening = math.acos(square / (2.0 * far_away * arm))
            angle = toward - math.atan2(model.tile_height, touches) - opening
        at = pressed_at(near, far, touches, depth)
        u, n = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
        place = joints[-1] + touches * u + model.tile_height * n - centre
        points.append(joints[-1] + at * u + model.tile_height * n)
        angles.append(angle)
        behind.append(touches - RADIUS * math.atan2(place[1], place[0]))
        joints.append(joints[-1] + model.joint_spacing * u)
    return Laid(*map(np.array, (joints[:PHALANGES], points, angles, behind)))


def own_loads(settled: SettledHand, i: int, plan: HandPlan) -> Array:
    """Shear and normal load of each phalanx of a finger, shape (3, 2) [N]."""
    hand, twist, tension = settled.hand, plan.wrist.twist, float(plan.tensions[i])
    model, table = hand.finger, hand.table
    outer = FINGERS[i].startswith("outer")
    tiles = np.flatnonzero(settled.finger_of == i)
    frame = hand.frames(settled.grasp.outer_rotation)[i]
    rest, (joints, points, angles, behind) = (laid(settled, i, x) for x in (np.zeros(6), twist))
    turned = -float(twist[3:] @ frame.across)
    q = np.diff([turned, *angles])
    shift = behind - rest.behind
    turn = q - np.diff([0.0, *rest.angles])
    if outer:
        place = settled.positions[tiles[0]]
        shift = np.concatenate([[-frame.along @ displaced(twist, place)], shift])
        turn = np.concatenate([[0.0], turn])
    tendon = FingerTendon.from_table(table, outer)
    at_rest = settled.loads[tiles, 0] @ [1.0, tension]
    start = tendon.closed(tension, at_rest)
    share = tuple(settled.engagement[tiles] * tendon.contact_stiffness)
    held = table.scalar("tendon", "holding_friction")
    holding = replace(tendon, contact_stiffness=share, friction=held)
    travel, tensions = by_enumeration(holding, start, shift, turn, tension)[0]
    shears = (start.shears + np.array(share) * (shift + travel))[-PHALANGES:]
    loads, pulls = np.zeros((PHALANGES, 2)), tensions[-PHALANGES:]
    radii, u = np.array(model.pulley_radii), np.column_stack([np.cos(angles), np.sin(angles)])
    loads[:, 0] = shears
    for j in reversed(range(PHALANGES)):
        torque = pulls[j] * radii[j] - model.joint_stiffness[j] * q[j] - model.joint_preload[j]
        for k in range(j, PHALANGES):
            arm, n = points[k] - joints[j], np.array([-u[k, 1], u[k, 0]])
            torque += loads[k, 0] * (arm[0] * u[k, 1] - arm[1] * u[k, 0])
            lever = arm[0] * n[1] - arm[1] * n[0]
            if k > j:
                torque -= loads[k, 1] * lever
            else:
                own = lever
        loads[j, 1] = torque / own
    return loads


@pytest.mark.parametrize("count", [2, pytest.param(50, marks=pytest.mark.slow)])
def test_loads_of_plans_are_those_of_statics_of_their_own(count: int) -> None:
    question = complying(questions.question(read_request("wall-300")))
    known, rng = KnownStance(question), np.random.default_rng(0)
    hands = [settle_hand(hand, question.stance) for hand in question.stance.hands]
    wrench, compared = question.needed_wrench(), 0
    for _ in range(count):
        aside = rng.normal(size=6) * [60.0, 60.0, 60.0, 8.0, 8.0, 8.0]
        answer = known.plan(rng.uniform(0.5, 0.95) * wrench + aside)
        assert answer.verified
        for plan, settled in zip(answer.hands, hands, strict=True):
            for i in range(len(FINGERS)):
                tiles = np.flatnonzero(settled.finger_of == i)[-PHALANGES:]
                found, own = plan.loads[tiles, :2], own_loads(settled, i, plan)
                np.testing.assert_allclose(found, own, rtol=0.0, atol=0.1)  # [N]
                compared += 1
    assert compared == 16 * count
