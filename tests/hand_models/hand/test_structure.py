"""Limits of the hand's structure: their rows by brute force, and plans that they limit."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, strategies as st
from msgspec import structs

from hand_models import InvalidInputError
from hand_models.base import Pose
from hand_models.fixed_wrist import wrench_space
from hand_models.hand import HELD_DIRECTIONS
from planner.result import LimitName
from planner.solving import plan
from tests.suite.helpers.hands import HAND, changed_hand, settled_at
from tests.suite.helpers.robots import with_hand
from tests.suite.helpers.shares import given_some
from tests.suite.helpers.stances import CALIBRATION_LOAD, ask, on_wall

seeds = st.integers(0, 2**32 - 1)

LIMIT = 50.0 * 9.80665
"""What a hand holds [N]."""


def held(force):
    """Of forces (..., 3): what is not pressing."""
    return np.linalg.norm(np.minimum(force, [np.inf, np.inf, 0.0]), axis=-1)


def used(space, y, limit):
    """Utilisation of the rows of one limit, by finger."""
    return {
        row.finger: u
        for row, u in zip(space.rows, space.utilisations(y), strict=False)
        if row.limit == limit
    }


def test_no_direction_says_less_than_what_is_held_nor_an_eighth_more():
    forces = np.random.default_rng(1).normal(size=(20_000, 3)) * [1.0, 1.0, 1.5]
    ratio = (forces @ HELD_DIRECTIONS.T).max(axis=1) / held(forces)
    assert ratio.min() >= 1.0 - 1e-12
    assert ratio.max() <= 1.12


def test_along_the_hands_axes_the_directions_say_four_per_cent_more_at_most():
    axes = np.vstack([np.eye(3)[:2], -np.eye(3)[:2]])
    assert (axes @ HELD_DIRECTIONS.T).max() <= 1.04


def test_the_corners_of_what_they_allow_lie_on_the_ball():
    """A corner where three rows meet, in or under the plane of the rock, is one newton away."""
    triples = [HELD_DIRECTIONS[[i, j, k]] for i in range(17) for j in range(i) for k in range(j)]
    corners = []
    for triple in triples:
        if abs(np.linalg.det(triple)) > 1e-6:
            corner = np.linalg.solve(triple, np.ones(3))
            if (HELD_DIRECTIONS @ corner <= 1.0 + 1e-9).all() and corner[2] <= 1e-9:
                corners.append(np.linalg.norm(corner))
    assert len(corners) >= 24
    assert max(corners) == pytest.approx(1.0, abs=1e-9)


def test_pressing_counts_for_nothing_and_both_sides_of_the_hand_are_alike():
    assert (HELD_DIRECTIONS[:, 2] <= 0.0).all()
    for mirror in ([-1.0, 1.0, 1.0], [1.0, -1.0, 1.0]):
        gaps = np.linalg.norm(HELD_DIRECTIONS[:, None] * mirror - HELD_DIRECTIONS, axis=2)
        assert gaps.min(axis=1).max() < 1e-12


@given_some(8, 60, seeds)
def test_rows_say_what_the_tiles_and_the_whole_wrench_say(seed):
    settled = settled_at(seed)
    assume(settled is not None)
    space = wrench_space(settled)
    y = np.random.default_rng(seed).uniform(0.0, 120.0, len(space.columns))
    loads = settled.tile_loads(y[:4])
    for finger, u in used(space, y, "finger_shear").items():
        mine = [t.finger == finger for t in settled.tiles]
        assert u == pytest.approx(loads[mine, 0].sum() / 500.0, abs=1e-9)
    for finger, u in used(space, y, "fingertip_force").items():
        (tip,) = (
            load
            for tile, load in zip(settled.tiles, loads, strict=True)
            if (tile.finger, tile.phalanx) == (finger, "distal")
        )
        assert u == pytest.approx(tip[1] / 600.0, abs=1e-9)
    names = [row.limit for row in space.rows[: len(space.s)]]
    assert names[-len(HELD_DIRECTIONS) :] == ["hand_load"] * len(HELD_DIRECTIONS)
    force = space.wrench(y)[:3]
    most = space.utilisations(y)[-len(HELD_DIRECTIONS) :].max()
    assert most == pytest.approx((HELD_DIRECTIONS @ force).max() / LIMIT, abs=1e-9)
    assert held(force) / LIMIT - 1e-9 <= most
    assert max(most, 0.0) <= 1.12 * held(force) / LIMIT + 1e-9


@given_some(8, 60, seeds)
def test_wrench_rows_are_functions_of_the_wrench_alone(seed):
    settled = settled_at(seed)
    assume(settled is not None)
    space = wrench_space(settled)
    y = np.random.default_rng(seed).normal(size=len(space.columns)) * 50.0
    load = (space.L @ y + space.l0)[-len(space.D) :]
    np.testing.assert_allclose(load, space.D @ space.wrench(y), atol=1e-8)


OVERLOADS = {
    "finger_shear": ("structure", "finger_shear", 60.0, "tiles of", "in shear together", "N"),
    "fingertip_force": ("structure", "fingertip_force", 0.3, "fingertip of", "in pressing", "N"),
    "hand_load": ("structure", "held_mass", 20.0, "the hand would hold", "N of", "N"),
    "motor_torque": ("motor", "maximum_torque", 1e-3, "would give", "mN·m of 1 mN·m", "N·m"),
    "motor_current": ("motor", "maximum_current", 0.06, "would draw", "A of 0.06 A", "A"),
}


@pytest.mark.parametrize("limit", OVERLOADS)
def test_a_plan_that_a_limit_overloads_names_it_and_prices_it(limit):
    section, name, value, *words, unit = OVERLOADS[limit]
    stance, hand = on_wall(), HAND
    if limit == "fingertip_force":
        # outer fingers that are not turned press with their tips before spines are pulled off, as
        # far as the distal pulleys are large
        stance = on_wall(outer_rotation=0.0)
        hand = changed_hand("finger", "pulley_radii", [0.0055, 0.00308, 0.00269])
    weak = with_hand(stance.robot, changed_hand(section, name, value, hand))
    answer = plan(ask(replace(stance, robot=weak), "prices"))
    assert answer.status == "overloaded"
    assert answer.verified
    assert answer.limiting.limit == limit
    assert all(word in answer.reason for word in words), answer.reason
    assert answer.utilisation > 1.0
    price = next(p for p in answer.prices if p.name == answer.limiting)
    assert price.unit == unit
    assert price.price > 0.0


def test_a_hand_that_presses_hard_is_not_overloaded_by_it():
    """Lain on, palms carry 350 N each; held by them as much would be most of what they bear."""
    question = ask(on_wall(), body_wrench=np.array([0.0, 0.0, 1400.0, 0.0, 0.0, 0.0]))
    answer = plan(question)
    pressing = [hand.wrench[2] for hand in answer.hands]
    assert min(pressing) > 300.0
    assert answer.utilisation < 1.0
    assert answer.limiting.limit != "hand_load"


def test_no_plan_holds_more_than_is_published_at_its_utilisation():
    for mass in (40.0, 110.0, 200.0):
        answer = plan(ask(on_wall(), load=structs.replace(CALIBRATION_LOAD, mass=mass)))
        for hand in answer.hands:
            assert held(hand.wrench[:3]) <= answer.utilisation * LIMIT + 1e-6


def test_a_hand_in_the_air_neither_holds_nor_hinders():
    stance = on_wall()
    away = Pose(np.array([0.0, 0.0, 0.5]), np.eye(3))
    hands = (replace(stance.hands[0], hold_in_hand=away), *stance.hands[1:])
    light = structs.replace(CALIBRATION_LOAD, mass=60.0)
    answer = plan(ask(replace(stance, hands=hands), load=light))
    alone = plan(ask(replace(stance, hands=stance.hands[1:]), load=light))
    assert answer.status == alone.status
    assert answer.verified
    assert answer.utilisation == pytest.approx(alone.utilisation, rel=1e-5)
    np.testing.assert_allclose(answer.hands[0].wrench, 0.0, atol=1e-6)


def test_rows_of_a_hand_in_the_air_are_constant_and_leave_its_only_wrench():
    away = Pose(np.array([0.0, 0.0, 0.5]), np.eye(3))
    stance = on_wall(limbs=("front_left",))
    hand = replace(stance.hands[0], hold_in_hand=away)
    answer = plan(ask(replace(stance, hands=(hand,)), body_wrench=np.zeros(6)))
    space = answer.hands[0].space
    assert not (space.L[-len(HELD_DIRECTIONS) :]).any()
    assert {row.limit for row in space.rows}.isdisjoint({"finger_shear", "fingertip_force"})
    np.testing.assert_array_equal(space.vertices(), np.zeros((1, 6)))
    assert space.volume() == (0.0, 0)
    assert space.support([1.0, 2.0, 3.0, 0.0, 0.0, 0.0]) == 0.0


def test_a_structure_that_bears_nothing_is_refused_by_name():
    for name in [
        "finger_shear",
        "fingertip_force",
        "finger_twist",
        "held_mass",
        "standard_gravity",
    ]:
        with pytest.raises(InvalidInputError) as caught:
            changed_hand("structure", name, 0.0)
        assert caught.value.field == f"structure.{name}"


def test_limits_of_one_hand_have_one_name_each():
    """Rows of the whole hand's force are one limit, those of a finger its own."""
    answer = plan(ask(on_wall(), "prices"))
    names = [price.name for price in answer.prices]
    assert len(set(names)) == len(names)
    for name in names:
        if name.limit == "hand_load":
            assert name == LimitName(name.limb, None, None, "hand_load")
