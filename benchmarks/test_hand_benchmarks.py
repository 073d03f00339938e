"""How long a hand takes, from its hold to its wrench space and the views of that.

``pytest benchmarks --benchmark-enable -m slow`` measures; else each runs once, as a test.
"""

import dataclasses
import functools
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hand_models import Cylinder, Edge, Grasp, Plane, Pose, Sphere, tension_limits
from hand_models.finger import ClosedFinger, OpenFinger, close_all
from hand_models.fixed_wrist import wrench_space, wrench_spaces
from hand_models.hand import Placement
from hand_models.tendon import share_load
from tests.suite.helpers.hands import HAND, ROCK, pinch
from tests.suite.helpers.rocks import random_axes
from tests.suite.helpers.stances import SANDPAPER

pytestmark = pytest.mark.slow

HOLDS = {
    "pinch on 300 mm": (Cylinder(0.3), math.pi),
    "oblique on 300 mm": (Cylinder(0.3), 0.5),
    "forward on an edge": (Edge(0.1, 1.5), 0.0),
    "pinch on a ball": (Sphere(0.4), math.pi),
    "flat on a wall": (Plane(), 0.0),
}

LATERAL = pytest.mark.parametrize("lateral", [False, True], ids=["in plane", "lateral"])


def fresh(space):
    """The same set without the views that it has kept."""
    return dataclasses.replace(space)


@pytest.mark.benchmark(group="hand, from hold to o, V, A, b")
@pytest.mark.parametrize(("hold", "rotation"), HOLDS.values(), ids=HOLDS.keys())
def test_settle_and_wrench_space(benchmark, hold, rotation):
    grasp = Grasp(outer_rotation=rotation)
    space = benchmark.pedantic(
        lambda: wrench_space(HAND.settle(hold, ROCK, grasp)), setup=HAND.settled.clear, rounds=300
    )
    assert len(space.columns) == 4 + 4 + 2
    assert np.isfinite(space.A).all()


@pytest.mark.benchmark(group="hand, from settled to o, V, A, b")
@LATERAL
def test_wrench_space_alone(benchmark, lateral):
    space = benchmark(wrench_space, pinch(lateral=lateral))
    assert len(space.columns) == (10 if lateral else 6)


FOUR = (
    (Cylinder(0.3), ROCK, math.pi),
    (Sphere(0.4), ROCK, math.pi),
    (Cylinder(0.5), SANDPAPER, 0.5),
    (Plane(), SANDPAPER, 0.0),
)
"""Holds, surfaces and outer rotations of a stance's hands, all different."""


@pytest.mark.benchmark(group="four hands, from holds to settled")
@pytest.mark.parametrize("askew", [False, True], ids=["seated", "askew"])
@pytest.mark.parametrize("way", ["one by one", "together", "known"])
def test_four_hands_settle(benchmark, way, askew):
    tilted = Rotation.from_rotvec([0.02, 0.0, 0.03]).as_matrix()
    place = Pose(np.array([0.01, 0.005, 0.003]), tilted) if askew else None
    placements = [Placement(hold, ROCK, Grasp(rotation), place) for hold, _, rotation in FOUR]

    def forget():
        if way != "known":
            HAND.settled.clear()

    def each():
        return [HAND.settle(*placement) for placement in placements]

    def together():
        return HAND.settle_each(placements)

    work = each if way == "one by one" else together
    settled = benchmark.pedantic(work, setup=forget, rounds=300)
    assert [type(hand.hold) for hand in settled] == [type(hold) for hold, *_ in FOUR]


@pytest.mark.benchmark(group="four hands, from settled to o, V, A, b")
@pytest.mark.parametrize("way", ["one by one", "together", "known"])
def test_four_wrench_spaces(benchmark, way):
    hands = [HAND.settle(hold, rock, Grasp(rotation)) for hold, rock, rotation in FOUR]

    def settled():
        # a copy is a hand of its own, whose set is not known yet
        return ([hand if way == "known" else dataclasses.replace(hand) for hand in hands],), {}

    def each(those):
        return [wrench_space(hand) for hand in those]

    work = each if way == "one by one" else wrench_spaces
    spaces = benchmark.pedantic(work, setup=settled, rounds=300)
    assert [space.columns[-1] for space in spaces] == ["palm_pressing"] * 4


@functools.cache
def giving_way(hold):
    """Sixteen fingers over a hold of which some contact gives way as they close."""
    rng, found = np.random.default_rng(0), []
    while len(found) < 16:
        closings = []
        for _ in range(16):
            axes = random_axes(rng, 0.3)
            origin = np.array([*rng.uniform(-0.05, 0.0, 2), -rng.uniform(0.005, 0.02)])
            rock = hold.finger_rock(origin, axes[:, 0], axes[:, 2], HAND.finger.size)
            closings.append(OpenFinger(rock, SANDPAPER, 37.0))
        for closing, closed in zip(closings, close_all(HAND.finger, closings), strict=True):
            if isinstance(closed, ClosedFinger) and any(c.stop for c in closed.finger.contacts):
                found.append(closing)
    return found[:16]


@pytest.mark.benchmark(group="fingers of which a contact gives way")
@pytest.mark.parametrize("count", [1, 4, 16])
@pytest.mark.parametrize(
    "hold", [Edge(0.05, 2.0), Plane(), Sphere(0.4)], ids=["edge", "wall", "ball"]
)
def test_fingers_that_do_not_stay(benchmark, hold, count):
    closings = giving_way(hold)[:count]
    closed = benchmark(close_all, HAND.finger, closings)
    assert all(any(contact.stop for contact in each.finger.contacts) for each in closed)


@pytest.mark.benchmark(group="hull of a hand")
@LATERAL
def test_half_spaces(benchmark, lateral):
    space = wrench_space(pinch(lateral=lateral))
    faces = benchmark(lambda: fresh(space).half_spaces())
    assert len(faces.normals) > (100 if lateral else 20)


@pytest.mark.benchmark(group="hull of a hand")
@LATERAL
def test_half_spaces_and_vertices(benchmark, lateral):
    space = wrench_space(pinch(lateral=lateral))

    def hull():
        made = fresh(space)
        return made.half_spaces(), made.vertices()

    faces, vertices = benchmark(hull)
    assert len(vertices) > len(faces.normals)


@pytest.mark.benchmark(group="views of a hand")
def test_support(benchmark):
    space = wrench_space(pinch())
    down = np.array([1.0, 0.0, -0.5, 0.0, 0.0, 0.0])
    most = benchmark(lambda: fresh(space).support(down))
    assert most == pytest.approx((space.vertices() @ down).max())


@pytest.mark.benchmark(group="views of a hand")
def test_capability(benchmark):
    low, high = benchmark(wrench_space(pinch()).capability, [0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    assert low < 0.0 < high


@pytest.mark.benchmark(group="views of a hand")
def test_tension_limits(benchmark):
    limits = benchmark(tension_limits, pinch())
    assert all(37.0 < limit.tension < 700.0 for limit in limits)


@pytest.mark.benchmark(group="palm of eight tiles")
@pytest.mark.parametrize("friction", [0.0, 0.34])
def test_palm_sharing(benchmark, friction):
    stiffness = [1400.0, 4900.0, 2200.0, 4900.0, 1400.0, 2200.0, 4900.0, 1400.0]
    sharing = benchmark(share_load, stiffness, 840.0, friction)
    assert (sharing.tile_stiffness > 0.0).all()
