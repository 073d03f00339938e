"""How long wrists that move take: linearised sets, poses for a wrench, searches, plans."""

import math
from dataclasses import replace
from itertools import cycle

import numpy as np
import pytest

from hand_models import Cylinder, Grasp
from hand_models.compliance import (
    CompliantHand,
    FloatingWrist,
    Gripper,
    farthest,
    search_box,
    search_grid,
    wrist_pose,
)
from hand_models.fixed_wrist import wrench_space
from planner import KnownStance, WrenchStream, plan
from service.answering.questions import question
from service.commands.stances import read_request
from tests.suite.helpers.hands import HAND, ROCK
from tests.suite.helpers.stances import complying

pytestmark = pytest.mark.slow

PULL = np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0])


def settled():
    return HAND.settle(Cylinder(0.3), ROCK, Grasp(outer_rotation=math.pi, palm=False))


@pytest.mark.benchmark(group="a hand's set, settled to o, V, A, b")
def test_linearised_set(benchmark):
    wrist = FloatingWrist(CompliantHand(settled()))
    space = benchmark(wrist.linearised)
    assert len(space.columns) == 6


@pytest.mark.benchmark(group="a hand's set, settled to o, V, A, b")
def test_fixed_wrist_beside_it(benchmark):
    assert benchmark(wrench_space, settled()).columns


@pytest.mark.benchmark(group="a wrist's pose")
def test_pose_for_a_wrench(benchmark):
    hand = CompliantHand(settled())
    wrench = hand.loads(np.array([[1e-4, 5e-5, -2e-4, 1e-3, 1e-3, 1e-3]])).wrenches[0]
    assert benchmark(wrist_pose, hand, wrench).converged


@pytest.mark.benchmark(group="a wrist's pose")
def test_limit_along_a_direction(benchmark):
    wrist = FloatingWrist(CompliantHand(settled()))
    assert benchmark(farthest, wrist, PULL).reach > 0.0


@pytest.mark.benchmark(group="search of the plane, 2 fingers, 60^3 poses", min_rounds=3)
def test_search_of_the_plane(benchmark):
    gripper = Gripper(0.3, 37.0)

    def hull():
        found = search_grid(gripper, 60)
        return found, found.hull

    found, hull = benchmark(hull)
    assert found.tried == 60**3
    assert hull.volume > 0.0


@pytest.mark.benchmark(group="search of the plane, 2 fingers, 60^3 poses", min_rounds=3)
def test_floor_of_that_search(benchmark):
    """The loads of both fingers at every pose, and nothing else."""
    gripper = Gripper(0.3, 37.0)
    box = search_box(gripper)
    assert benchmark(gripper.finger_loads, box.poses(box.grid(60, 0, 60**3)))[0].reached.any()


@pytest.mark.benchmark(group="search of 6-D, 4 fingers", min_rounds=1)
@pytest.mark.parametrize("per_axis", [5, 7])
def test_search_of_a_whole_hand(benchmark, per_axis):
    """11^6 poses take (11/7)^6 = 15 times as long as 7^6."""
    wrist = FloatingWrist(CompliantHand(settled()))
    found = benchmark.pedantic(search_grid, (wrist, per_axis), rounds=1)
    assert found.tried == per_axis**6


COMPLIANT = complying(question(read_request("wall-300")))
"""Four compliant hands at rest; nothing of their wrists is known from before."""

WRENCHES = [
    COMPLIANT.needed_wrench() + k * np.array([0.5, -0.3, 0.2, 0.02, 0.01, -0.03]) for k in range(4)
]
"""Body wrenches 1 N apart [N, N·m]."""


@pytest.mark.benchmark(group="four compliant hands")
@pytest.mark.parametrize("want", [(), ("load_factor",)], ids=["plan", "with load factor"])
def test_plan_of_compliant_wrists(benchmark, want):
    asked = replace(COMPLIANT, want=frozenset(want))
    assert benchmark(plan, asked).verified


@pytest.mark.benchmark(group="four compliant hands")
def test_next_wrench_of_compliant_wrists(benchmark):
    known, wrenches = KnownStance(COMPLIANT), cycle(WRENCHES)
    known.plan(next(wrenches))
    assert benchmark(lambda: known.plan(next(wrenches))).verified


@pytest.mark.benchmark(group="four compliant hands")
def test_set_points_of_compliant_wrists(benchmark):
    wrenches = cycle(WRENCHES)
    with WrenchStream(COMPLIANT) as stream:
        stream.set_points(next(wrenches))
        assert benchmark(lambda: stream.set_points(next(wrenches))).verified
