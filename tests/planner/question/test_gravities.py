"""Slab, wall, overhang and ceiling, on the Earth, Mars and the Moon: sensible, and monotone."""

import math
from dataclasses import replace
from functools import cache

import numpy as np

from planner.question import Limits, Load
from planner.result import Plan
from planner.solving import plan
from tests.suite.helpers.stances import TILE_60N, ask, on_wall

ANGLES = {"slab": -30, "wall": 0, "overhang": 45, "ceiling": 90}
"""How far the rock leans over the climber [°]."""

GRAVITIES = {"Earth": 9.81, "Mars": 3.71, "Moon": 1.62}

ALONG = range(-60, 91, 15)

CLOSE = 1e-6


@cache
def answer(degrees: float, gravity: float, joints: bool = False) -> Plan:
    stance = on_wall(surface=TILE_60N, overhang=math.radians(degrees), gravity=(0.0, 0.0, -gravity))
    if joints:
        stance = replace(stance, joints="solve")
    return plan(ask(stance, "load_factor", "prices", load=Load()))


def test_rock_that_leans_farther_over_asks_more_and_leaves_less():
    """Not so on slabs, where palms off the rock are used by pressing."""
    found = [answer(degrees, GRAVITIES["Earth"]) for degrees in ALONG if degrees >= -30]
    used = [each.utilisation for each in found]
    factors = [each.load_factor for each in found]
    assert (np.diff(used) > 0.0).all()
    assert (np.diff(factors) < 0.0).all()


def test_the_earth_is_held_on_a_slab_and_a_wall_but_not_on_an_overhang_or_a_ceiling():
    found = {place: answer(degrees, 9.81).status for place, degrees in ANGLES.items()}
    assert found == {
        "slab": "optimal",
        "wall": "optimal",
        "overhang": "overloaded",
        "ceiling": "overloaded",
    }


def test_weaker_gravity_is_held_everywhere():
    for body in ["Mars", "Moon"]:
        assert all(answer(d, GRAVITIES[body]).status == "optimal" for d in ANGLES.values())


def test_weaker_gravity_asks_less():
    for place in ANGLES:
        for joints in [False, True]:
            used = [answer(ANGLES[place], g, joints).utilisation for g in GRAVITIES.values()]
            assert used[0] > used[1] > used[2]


def test_what_is_carried_at_the_limit_is_one_weight_whatever_the_gravity():
    """Without joints the hands do not know the limbs: s m g is the same on every body."""
    for place in ANGLES:
        carried = [answer(ANGLES[place], g).load_factor * g for g in GRAVITIES.values()]
        np.testing.assert_allclose(carried, carried[0], rtol=1e-5)


def test_joints_can_only_make_it_harder():
    for place in ANGLES:
        for gravity in GRAVITIES.values():
            # with joints the weight is that of the posture: ask for the same wrench without them
            mine = answer(ANGLES[place], gravity, joints=True)
            stance = on_wall(
                surface=TILE_60N,
                overhang=math.radians(ANGLES[place]),
                gravity=(0.0, 0.0, -gravity),
            )
            free = plan(ask(stance, body_wrench=mine.body_wrench))
            assert mine.utilisation >= free.utilisation - CLOSE


def test_weaker_joints_ask_more():
    for place in ANGLES:
        stance = on_wall(surface=TILE_60N, overhang=math.radians(ANGLES[place]))
        stance = replace(stance, joints="solve")
        used = [
            plan(ask(stance, load=Load(), limits=Limits(joint_torque=most))).utilisation
            for most in (200.0, 80.0, 40.0, 20.0)
        ]
        assert (np.diff(used) >= -CLOSE).all()
        assert used[-1] > used[0]


def test_posture_is_the_same_whatever_the_gravity_and_its_weight_goes_with_it():
    whole, half = answer(0, 9.81, joints=True), answer(0, 9.81 / 2.0, joints=True)
    for limb, angles in whole.joints.items():
        np.testing.assert_allclose(half.joints[limb], angles, atol=1e-5)
    np.testing.assert_allclose(half.body_wrench, whole.body_wrench / 2.0, rtol=1e-6, atol=1e-4)
