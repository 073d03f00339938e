"""Hands that hardly hold, or not at rest, or not at all: searches, limits and poses stay right."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from msgspec import structs

from hand_models import (
    Cylinder,
    Edge,
    Grasp,
    Hold,
    InvalidInputError,
    Plane,
    Pose,
    Profile,
    Sphere,
    Surface,
)
from hand_models.base import EmptySetError
from hand_models.compliance import (
    CompliantHand,
    FloatingWrist,
    Gripper,
    boundary,
    farthest,
    linear_box,
    search_box,
    search_grid,
    wrist_pose,
)
from tests.suite.helpers.hands import HAND, PINCH, ROCK, changed_hand, settled_at

PULL = np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0])
OPEN = Grasp(lateral=False, palm=False)
CURLED = structs.replace(PINCH, closing_tension=46.0)
"""Pulled to the joints' limits in the air: 1.75 rad of 0.05 N·m/rad on 1.945 mm is 45 N."""


HOLDS: dict[str, tuple[Hold, Grasp, Pose | None]] = {
    "no fingers sideways": (Plane(), OPEN, None),
    "a pebble": (Sphere(0.01), CURLED, None),
    "a ball in the fingers": (Sphere(0.1), PINCH, None),
    "a sharp edge": (Edge(fillet_radius=1e-6, angle=1.57), Grasp(), None),
    "far off": (Cylinder(0.3), CURLED, Pose(np.array([0.0, 0.0, 0.5]), np.eye(3))),
    "beside": (Sphere(0.2), CURLED, Pose(np.array([0.0, 0.3, 0.0]), np.eye(3))),
}

RESTLESS = (4, 11, 33)
"""Random hands that do not hold at rest."""


def floating(name: str) -> FloatingWrist:
    hold, grasp, pose = HOLDS[name]
    return FloatingWrist(CompliantHand(HAND.settle(hold, ROCK, grasp, pose)))


@pytest.mark.slow
@pytest.mark.parametrize("name", HOLDS)
def test_motions_that_load_nothing_do_not_stop_the_search(name: str) -> None:
    wrist = floating(name)
    found = boundary(wrist, search_box(wrist), 40)
    assert np.isfinite(found.wrenches).all()
    assert wrist.evaluate(found.poses).holds.all()
    end = farthest(wrist, PULL)
    verdict = wrist.evaluate(end.twist[None])
    assert verdict.utilisation[0] <= 1.0 + 1e-5
    assert verdict.violation[0] <= 1e-5


@pytest.mark.parametrize("seed", RESTLESS)
def test_a_search_is_about_a_pose_that_holds(seed: int) -> None:
    settled = settled_at(seed)
    assert settled is not None
    rng = np.random.default_rng(seed + 10**6)
    wrist = FloatingWrist(CompliantHand(settled, rng.uniform(0.0, 120.0, 4)))
    try:
        box = linear_box(wrist)
    except EmptySetError:
        # then none of many poses about rest holds either
        twists = rng.normal(size=(3000, 6)) * [*[3e-4] * 3, *[3e-3] * 3]
        assert not wrist.evaluate(twists).holds.any()
        return
    assert wrist.evaluate(box.centre[None]).holds[0]
    assert wrist.evaluate(boundary(wrist, box, 40).poses).holds.all()


@pytest.mark.parametrize("per_axis", [-1, 0, 1])
def test_a_grid_without_poses_is_refused(per_axis: int) -> None:
    with pytest.raises(InvalidInputError, match="per_axis"):
        search_grid(Gripper(0.3, 37.0), per_axis)


def test_a_grid_of_which_one_pose_holds_has_a_wrench_but_no_hull() -> None:
    found = search_grid(Gripper(0.3, 37.0), 3)
    assert found.held == len(found.wrenches) == 1
    with pytest.raises(EmptySetError, match="no volume"):
        _ = found.hull


@pytest.mark.parametrize(
    ("section", "name", "value"),
    [
        ("beam", "bending_stiffness", 0.0),
        ("beam", "torsional_stiffness", 0.0),
        ("tile", "lateral_stiffness", 0.0),
        ("palm", "pressing_stiffness", 0.0),
        ("tendon", "holding_friction", 1.0),
        ("tendon", "entry_friction", 1.5),
    ],
)
def test_a_hand_that_cannot_give_way_is_refused_when_it_is_read(
    section: str, name: str, value: float
) -> None:
    with pytest.raises(InvalidInputError, match=f"{section}.{name}: must be"):
        changed_hand(section, name, value)


@pytest.mark.slow
def test_poses_of_an_edge_are_found_from_other_starts() -> None:
    """From rest alone, Newton's steps stop short at kinks for some of them."""
    settled = settled_at(56)
    assert settled is not None
    wrist = FloatingWrist(CompliantHand(settled))
    for twist in boundary(wrist, search_box(wrist), 12).poses:
        wrench = wrist.evaluate(twist[None]).wrenches[0]
        pose = wrist_pose(wrist.hand, wrench)
        assert pose.converged
        np.testing.assert_allclose(wrist.evaluate(pose.twist[None]).wrenches[0], wrench, atol=1e-6)


def test_a_hand_that_touches_nothing_gives_no_wrench_and_no_warning() -> None:
    hand = floating("far off").hand
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pose = wrist_pose(hand, PULL)
    assert not pose.converged
    assert math.isclose(pose.residual[2], -1.0)


def test_a_face_that_lies_far_along_the_rock_does_not_roll() -> None:
    """The rock's radius there is less than the way to where the face's line is nearest to it."""
    rock = Profile(np.array([[-0.0975723, 0.00926578], [0.1602632, 0.0890436]]))
    settled = HAND.settle(rock, Surface.named("concrete-fine"), Grasp(3.0049519663715873), None)
    loads = CompliantHand(settled).loads(np.zeros((1, 6)))
    assert np.isfinite(loads.normals[0]).all()
