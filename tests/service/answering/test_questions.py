"""Requests as the questions that the planner is asked."""

from __future__ import annotations

import math

import numpy as np

from service.answering import questions
from service.requests import SurfaceMessage
from tests.suite.helpers.requests import (
    JOINTS,
    full_request,
    plan_request,
    put,
    request_with_joints,
    wall_request,
)


def test_a_request_becomes_a_question() -> None:
    asked = questions.question(plan_request(full_request()))
    plane, sphere, edge, cylinder = asked.stance.hands
    assert [h.hold.shape for h in asked.stance.hands] == ["plane", "sphere", "edge", "cylinder"]
    assert plane.placed_hold() is None
    np.testing.assert_allclose(sphere.placed_hold().position, [0.0, 0.0, 0.003])
    assert (edge.hold.fillet_radius, edge.hold.angle) == (0.05, 2.0)
    assert (edge.grasp.outer_rotation, edge.grasp.closing_tension) == (0.5, 30.0)
    assert (cylinder.surface.pull_off_limit, cylinder.surface.half_planes) == (15.0, 3)
    assert asked.stance.gravity.tolist() == [0.0, 0.0, -3.7]
    assert asked.load.acceleration == (0.0, 0.0, 0.2)
    assert (asked.limits.utilisation, asked.limits.tendon_tension) == (0.8, 150.0)
    assert asked.want == {"load_factor", "prices", "model"}
    np.testing.assert_allclose(
        asked.needed_wrench()[:3], asked.stance.body.rotation.T @ [0.0, 0.0, 390.0]
    )


def test_a_request_with_joints_becomes_a_question() -> None:
    asked = questions.question(plan_request(request_with_joints()))
    for limb, angles in JOINTS.items():
        np.testing.assert_array_equal(asked.stance.joints[limb], angles)
    assert asked.stance.hands[1].wrench == (None, None, 20.0, None, None, None)
    assert asked.load.angular_acceleration == (0.0, 0.1, 0.0)
    assert asked.objective == "min_effort"
    limits = asked.limits
    assert limits.joint_torque == {"front_left": 150.0, "rear_left": (180.0,) * 7}
    assert limits.per_hand["rear_left"].most == 400.0
    assert limits.per_hand["rear_left"].frame == "hand"
    capped = limits.per_hand["front_left"]
    assert capped.most == ((-300.0, 300.0), (-math.inf, math.inf), (-250.0, 300.0))
    assert capped.frame == "body"
    assert limits.tension_change == 60.0
    np.testing.assert_array_equal(asked.present["front_left"], [45.0, 50.0, 50.0, 45.0])
    assert questions.question(
        plan_request(put(wall_request(), ("stance", "joints"), "solve"))
    ).stance.joints == ("solve")


def test_every_number_of_a_surface_is_in_the_question() -> None:
    own = {
        "shear_limit": 80.0,
        "pull_off_limit": 20.0,
        "pull_off_angle": 1.1,
        "lateral_limit": 40.0,
        "compression_gain": 0.7,
        "half_planes": 2,
        "lateral_pull_off_ratio": 0.6,
        "shear_scatter": 9.0,
        "friction": 0.3,
        "pull_off_exponent": 2.0,
    }
    assert set(own) == set(SurfaceMessage.__struct_fields__)
    request = wall_request()
    request["stance"]["hands"][0]["surface"] = own
    asked = questions.question(plan_request(request)).stance.hands[0].surface
    assert {name: getattr(asked, name) for name in own} == own


def test_seats_are_asked_for() -> None:
    request = wall_request()
    first, second, *_ = request["stance"]["hands"]
    first["seat"], first["seat_direction"] = "best", [0, 0, -1, 0, 0, 0.1]
    second["seat"] = "best"
    one, two, three, _ = questions.question(plan_request(request)).stance.hands
    assert (one.seat, two.seat, three.seat) == ("best", "best", "rest")
    np.testing.assert_array_equal(one.seat_direction, [0.0, 0.0, -1.0, 0.0, 0.0, 0.1])
    assert two.seat_direction is None


def test_hold_placed_in_the_world() -> None:
    request = wall_request()
    hand = request["stance"]["hands"][0]
    hand["hold"]["pose"] = hand["pose"]
    placed = questions.question(plan_request(request)).stance.hands[0].placed_hold()
    np.testing.assert_allclose(placed.position, 0.0, atol=1e-12)
    np.testing.assert_allclose(placed.rotation, np.eye(3), atol=1e-12)
