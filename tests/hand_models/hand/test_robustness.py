"""Whatever a hand is asked to hold: finite numbers, or an error of its own, and no warnings."""

import itertools
import math
import re
import warnings

import numpy as np
import pytest
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hand_models import (
    Cylinder,
    Edge,
    EmptySetError,
    Grasp,
    InvalidInputError,
    LimitError,
    Plane,
    Pose,
    Profile,
    Sphere,
    Surface,
    tension_limits,
)
from hand_models.fixed_wrist import wrench_space
from hand_models.hand import closing_sequence
from tests.suite.helpers.hands import HAND
from tests.suite.helpers.shares import given_some, some_and_all

ROCK = Surface.named("rock")
CURLED = 50.0
"""Tension at which all joints stand at their limits in the air, the last at 45 N = K q / r [N]."""

SIZES = [1e-3, 1e-2, 1.0, 30.0, 1e3]


def stress(hold, surface, grasp, pose):
    """Everything that can be asked of a hand; how it ended, once every number is looked at."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            settled = HAND.settle(hold, surface, grasp, pose)
        except InvalidInputError as error:
            slack = error.field == "grasp.closing_tension" and re.search(
                "must be (at least|larger)", str(error)
            )
            if error.field != "hold" and not slack:
                raise
            return "refused"
        numbers = [settled.positions, settled.axes, settled.loads, settled.palm.centre]
        numbers += [torque for _, _, torque in settled.stops]
        assert all(np.isfinite(each).all() for each in numbers)
        lengths = np.linalg.norm(settled.axes, axis=2)
        np.testing.assert_allclose(lengths, 1.0, atol=1e-9)
        # loads grow with tension by a lever of pulleys and phalanges, never without bound
        assert np.abs(settled.loads[..., 1]).max() < 100.0
        assert not np.isnan(settled.palm.gaps).any()
        assert all(limit.tension >= 0.0 for limit in tension_limits(settled))
        space = wrench_space(settled)
        for each in (space.origin, space.generators, space.A, space.b):
            assert np.isfinite(each).all()
        try:
            vertices, faces = space.vertices(), space.half_spaces()
        except EmptySetError:
            return "empty"
        except LimitError:
            assert np.isfinite([space.support(direction) for direction in np.eye(6)]).all()
            return "held"
        assert len(vertices) >= 1
        assert np.isfinite(vertices).all()
        off = vertices @ faces.equation_normals.T - faces.equation_offsets
        size = 1.0 + np.abs(vertices).max()
        assert np.abs(off).max(initial=0.0) < 1e-5 * size
        if len(vertices) < 3000:
            slack = faces.offsets - vertices @ faces.normals.T
            assert slack.min(initial=0.0) > -1e-5 * size
        return "held"


@some_and_all(
    "cases",
    itertools.product(
        SIZES, (0.0, 0.4, 2.8, math.pi), (Cylinder, Sphere, lambda size: Edge(size, 1.2))
    ),
    7,
)
def test_holds_from_a_millimetre_to_a_kilometre_can_be_taken(cases):
    ends = {stress(hold(size), ROCK, Grasp(rotation), None) for size, rotation, hold in cases}
    assert "held" in ends


@pytest.mark.slow
@some_and_all(
    "cases",
    itertools.product(
        (1e-9, 1e-3, math.pi - 1e-3, math.pi - 1e-9),
        (1e-4, 0.1),
        ((0.0, 0.1), (1.0, 0.0), (math.pi, 0.1)),
    ),
    7,
)
def test_knife_edges_and_edges_that_are_nearly_flat(cases):
    for angle, radius, (rotation, tilt) in cases:
        pose = Pose(
            np.array([0.03, 0.0, 0.004]), Rotation.from_rotvec([0.0, tilt, 0.2]).as_matrix()
        )
        stress(Edge(radius, angle), ROCK, Grasp(rotation), None)
        stress(Edge(radius, angle), ROCK, Grasp(rotation), pose)


def test_an_edge_that_is_nearly_flat_holds_like_a_plane():
    """Its crest lies between the finger tiles, all of which lie on its faces."""
    pose = Pose(np.array([0.045, 0.0, 0.0041]), np.eye(3))
    edge = HAND.settle(Edge(0.01, math.pi - 1e-6), ROCK, Grasp(palm=False), pose)
    plane = HAND.settle(Plane(), ROCK, Grasp(palm=False), pose)
    np.testing.assert_allclose(edge.positions, plane.positions, atol=1e-6)
    np.testing.assert_allclose(edge.loads, plane.loads, atol=1e-3)


@pytest.mark.parametrize("hold", [Plane(), Cylinder(0.3), Sphere(0.3), Edge(0.05, 1.0)])
@some_and_all(
    "poses",
    itertools.product(
        (0.0, 0.5, 1.2, math.pi / 2, math.pi),
        np.vstack([np.eye(3), [[0.6, 0.8, 0.0]]]),
        ([0.0, 0.0, 0.0], [0.03, 0.0, 0.02], [0.1, 0.1, 0.1]),
    ),
    23,
)
def test_holds_tilted_as_far_as_they_go(hold, poses):
    for tilt, axis, place in poses:
        turned = Rotation.from_rotvec(tilt * axis).as_matrix()
        stress(hold, ROCK, Grasp(1.0), Pose(np.array(place), turned))


def test_a_hand_far_from_its_hold_carries_nothing():
    for distance, closing in [(0.05, CURLED), (1.0, 1e-3), (1e4, 37.0)]:
        pose = Pose(np.array([0.0, 0.0, distance]), np.eye(3))
        for hold in (Plane(), Cylinder(0.3), Sphere(0.3), Edge(0.05, 1.0)):
            settled = HAND.settle(hold, ROCK, Grasp(closing_tension=closing), pose)
            assert settled.palm.engaged == ()
            if distance >= 1.0:
                assert not settled.touching.any()
                space = wrench_space(settled)
                np.testing.assert_array_equal(space.vertices(), np.zeros((1, 6)))


def test_fingers_that_more_tension_brings_to_the_rock_are_told_so_and_no_others():
    """Their joints' springs hold them open; 0.2 m off the rock they curl past nothing."""
    for distance, tension, comes in ((0.03, 1.0, True), (0.03, 5.0, None), (0.2, 1.0, False)):
        pose = Pose(np.array([0.0, 0.0, distance]), np.eye(3))
        grasp = Grasp(closing_tension=tension)
        if comes:
            with pytest.raises(InvalidInputError, match="larger: at 1 N no finger") as caught:
                HAND.settle(Plane(), ROCK, grasp, pose)
            assert caught.value.field == "grasp.closing_tension"
        else:
            settled = HAND.settle(Plane(), ROCK, grasp, pose)
            assert settled.touching.any() == (comes is None)


def test_a_hold_behind_the_palm_is_refused():
    for behind in [0.0051, 0.3, 1e4]:
        for hold in [Plane(), Cylinder(0.3), Sphere(0.3), Edge(0.05, 1.0)]:
            with pytest.raises(InvalidInputError, match="inside the palm") as caught:
                HAND.settle(
                    hold, ROCK, Grasp(), Pose(np.array([0.0135, 0.014, -behind]), np.eye(3))
                )
            assert caught.value.field == "hold"


def test_a_joint_in_the_middle_of_a_ball_is_no_division_by_zero():
    pose = Pose(HAND.inner_joint - [0.0, 0.0, 5e-4], np.eye(3))
    assert stress(Sphere(1e-3), ROCK, Grasp(), pose) in ("held", "empty")


def test_strengths_and_closing_tensions_of_any_size():
    for closing in [9.0, 37.0, 700.0]:
        for strength in [1e-3, 1.0, 1e5]:
            for half_planes, lateral in ((1, True), (3, False)):
                surface = Surface.from_values({"shear_limit": strength, "half_planes": half_planes})
                for rotation in (0.0, math.pi)[half_planes % 2 :]:
                    ended = stress(
                        Cylinder(0.3), surface, Grasp(rotation, closing, True, lateral), None
                    )
                    assert ended == "empty" or strength > 0.01 * closing


@given_some(5, 30, st.integers(0, 2**32 - 1))
def test_anything_anywhere_ends_in_numbers_or_is_refused(seed):
    assert anything_anywhere(seed) in ("held", "empty", "refused")


@pytest.mark.slow
def test_much_anywhere_ends_in_numbers_or_is_refused():
    """Of known seeds: the vertices of a hand in a thousand need more memory than there is."""
    for seed in range(200):
        assert anything_anywhere(seed) in ("held", "empty", "refused")


def anything_anywhere(seed):
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-3.0, 3.0)
    hold = (Plane(), Cylinder(size), Sphere(size), Edge(size, rng.uniform(0.01, 3.13)))[
        rng.integers(4)
    ]
    surface = Surface.from_values(
        {"shear_limit": 10.0 ** rng.uniform(-2.0, 4.0), "half_planes": int(rng.integers(1, 3))}
    )
    grasp = Grasp(
        float(rng.choice([0.0, math.pi, rng.uniform(0.0, math.pi)])),
        float(10.0 ** rng.uniform(-1.0, 2.8)),
        bool(rng.integers(2)),
        bool(rng.integers(2)),
    )
    turned = Rotation.from_rotvec(rng.uniform(0.0, math.pi) * rng.normal(size=3)).as_matrix()
    place = rng.choice([0.0, 1e-3, 0.05, 1.0, 1e4]) * rng.normal(size=3)
    pose = Pose(place, turned) if rng.random() < 0.7 else None
    return stress(hold, surface, grasp, pose)


def test_closing_beyond_the_tendons_maximum_is_refused():
    with pytest.raises(InvalidInputError, match=r"at most tendon.maximum_tension, 700 N") as caught:
        HAND.settle(Cylinder(0.3), ROCK, Grasp(closing_tension=701.0))
    assert caught.value.field == "grasp.closing_tension"


def test_a_tension_that_closes_no_joint_is_refused_and_the_least_that_does_is_named():
    """The joints' springs hold against the tendons: f M r = p + K q (Section 3.2)."""
    for hold in [Cylinder(0.3), Cylinder(0.7)]:
        needed = max(
            stage.ends
            for finger in closing_sequence(HAND.settle(hold, ROCK))
            for stage in finger[1][1:4]
        )
        assert 2.0 < needed < 10.0
        told = math.ceil(100.0 * needed) / 100.0
        HAND.settle(hold, ROCK, Grasp(closing_tension=told))
        assert HAND.settle(hold, ROCK, Grasp(closing_tension=needed + 1e-9)).touching.any()
        for tension in (1e-3, 0.999 * needed):
            with pytest.raises(InvalidInputError, match=f"at least {told:g} N") as caught:
                HAND.settle(hold, ROCK, Grasp(closing_tension=tension))
            assert caught.value.field == "grasp.closing_tension"


def test_a_profile_whose_top_is_nowhere_on_the_way_of_a_pinch():
    outline = [[0.1713, 0.0513], [0.02604, -0.02449], [0.07038, 0.06011], [0.02808, 0.00927]]
    assert stress(Profile(np.array(outline)), ROCK, Grasp(math.pi), None) in ("held", "empty")
