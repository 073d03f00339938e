"""Seats that are searched for hold no less than those they begin with, and are where they say."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hand_models import (
    Cylinder,
    Edge,
    EmptySetError,
    Grasp,
    InvalidInputError,
    Plane,
    Pose,
    Profile,
    Sphere,
)
from hand_models.fixed_wrist import PULL_OFF, best_seats, wrench_space
from hand_models.hand import Placement
from hand_models.rock import Mesh
from tests.suite.helpers.hands import HAND, ROCK, seating_on
from tests.suite.helpers.rocks import random_mesh, random_profile
from tests.suite.helpers.shares import some_and_all

MIRROR = np.diag([1.0, -1.0, 1.0])
NOTHING = -math.inf, -math.inf

DOWN = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""A wrench toward the fingers' tips."""


def reach(settled, direction=PULL_OFF):
    """How much of a wrench a hand can carry, alone and with whatever else; −∞ if none."""
    space = wrench_space(settled)
    try:
        ends = space.capability(direction)
        return -math.inf if ends is None else ends[1], space.support(direction)
    except EmptySetError:
        return NOTHING


def placement(hold, rotation=0.0):
    return Placement(hold, ROCK, Grasp(rotation), None)


def random_rock(seed):
    rng = np.random.default_rng(seed)
    return random_mesh(rng) if seed % 3 == 0 else random_profile(rng)


@pytest.mark.slow
@some_and_all("seeds", range(18), 9)
def test_the_best_seat_holds_no_less_and_is_as_near_as_it_says(seeds):
    more = 0
    for seed in seeds:
        each = placement(random_rock(seed), math.pi * (seed % 2))
        (best,) = best_seats(HAND, [each])
        seat = seating_on(each.hold, each.grasp)
        try:
            rest = reach(HAND.settle(*each))
        except InvalidInputError:
            rest = NOTHING
        # where it begins without backing off is one of its places
        if rest > NOTHING and not HAND.settle(*each).seating.backed_off:
            assert reach(best) >= rest
        more += reach(best) > rest
        assert best.seating.rule == "best"
        moved = seat.pose @ best.seating.pose.inverse()
        assert moved.position == pytest.approx([0.0, 0.0, -best.seating.backed_off], abs=1e-12)
        assert 0.0 <= best.seating.backed_off <= HAND.back_off
        tilt = math.acos(np.clip(moved.rotation[2, 2], -1.0, 1.0))
        assert tilt <= math.sqrt(2.0) * HAND.seat_tilt + 1e-9
        turn = Rotation.from_matrix(moved.rotation).magnitude()
        assert turn <= math.hypot(HAND.seat_turn, math.sqrt(2.0) * HAND.seat_tilt) + 1e-3
    assert more >= len(seeds) / 3


@pytest.mark.parametrize(
    ("hold", "rotation"),
    [(Plane(), 0.0), pytest.param(Sphere(0.4), math.pi, marks=pytest.mark.slow)],
)
def test_a_hand_put_where_its_best_seat_is_is_the_same(hold, rotation):
    each = placement(hold, rotation)
    (best,) = best_seats(HAND, [each])
    there = HAND.settle(hold, ROCK, each.grasp, best.seating.pose)
    np.testing.assert_array_equal(best.loads, there.loads)
    assert reach(best) == reach(there) >= reach(HAND.settle(*each))


@pytest.mark.slow
def test_a_direction_may_be_given_in_which_to_hold():
    each = placement(random_rock(1))
    (pulled,), (down,) = best_seats(HAND, [each]), best_seats(HAND, [each], DOWN)
    assert reach(down, DOWN) >= reach(HAND.settle(*each), DOWN)
    assert reach(pulled) > reach(down)
    assert reach(pulled, DOWN) < reach(down, DOWN)


def test_together_hands_are_seated_as_alone_and_searched_for_once():
    group = [placement(Cylinder(0.31)), placement(Plane(), math.pi), placement(Cylinder(0.31))]
    together = best_seats(HAND, group)
    assert together[0].seating.pose == together[2].seating.pose
    for each, best in zip(group, together, strict=True):
        (alone,) = best_seats(HAND, [each])
        assert alone.seating.pose.position == pytest.approx(best.seating.pose.position)
    assert best_seats(HAND, group[:1])[0] is together[0]


@pytest.mark.slow
def test_on_mirrored_rock_the_best_seat_holds_as_much():
    hold = random_mesh(np.random.default_rng(3))
    other = Mesh(hold.triangles.vertices @ MIRROR, hold.triangles.faces[:, ::-1])
    one, two = best_seats(HAND, [placement(hold), placement(other)])
    assert reach(one) == pytest.approx(reach(two), rel=1e-6)
    place = one.seating.pose.position
    np.testing.assert_allclose(MIRROR @ place, two.seating.pose.position, atol=1e-9)


@pytest.mark.slow
def test_a_hand_that_can_be_nowhere_is_told_why():
    x = np.linspace(-0.4, 0.4, 801)
    spike = Profile(np.column_stack([x, -0.12 * np.exp(-(((x - 0.12) / 0.02) ** 2))]))
    (refused,) = best_seats(HAND, [placement(spike)])
    assert isinstance(refused, InvalidInputError)
    assert "even with its joints fully open" in str(refused)


def test_a_hand_with_a_pose_is_not_seated():
    given = Placement(Edge(0.05, 1.5), ROCK, Grasp(), Pose.identity())
    with pytest.raises(InvalidInputError, match="remove the pose") as caught:
        best_seats(HAND, [given])
    assert caught.value.field == "seat"


@pytest.mark.slow
def test_the_best_seat_holds_no_less_than_one_that_a_hand_backs_off_to():
    """Which is between those of the first stage."""
    x = np.linspace(-0.3, 0.3, 61).round(4)
    z = 0.0352028 * (np.sin(15.03 * x + 1.98507) - np.sin(1.98507))
    each = placement(Profile(np.column_stack([x, z.round(5)])), math.pi)
    (rest,), up = HAND.settle_each([each]), (-1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert rest.seating.backed_off > 0.0
    (best,) = best_seats(HAND, [each], up)
    assert reach(best, up) >= reach(rest, up)
    assert best.seating.rule == "best"
