"""How long a hand takes, from its hold to its wrench space and the views of that.

``pytest tests/benchmarks --benchmark-enable`` measures; otherwise each runs once, as a test.
"""

import dataclasses
import math

import numpy as np
import pytest
from hands import HAND, ROCK, pinch

from hand_models import Cylinder, Edge, Grasp, Plane, Sphere, tension_limits, wrench_space
from hand_models.palm import share_load

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
    space = benchmark(lambda: wrench_space(HAND.settle(hold, ROCK, grasp)))
    assert len(space.columns) == 4 + 4 + 2
    assert np.isfinite(space.A).all()


@pytest.mark.benchmark(group="hand, from settled to o, V, A, b")
@LATERAL
def test_wrench_space_alone(benchmark, lateral):
    space = benchmark(wrench_space, pinch(lateral=lateral))
    assert len(space.columns) == (10 if lateral else 6)


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
