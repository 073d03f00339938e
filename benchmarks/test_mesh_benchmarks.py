"""How long scanned rock takes: to be taken up, cut, and closed on by one hand.

``pytest benchmarks --benchmark-enable -m slow`` measures; else each runs once, as a test.
"""

import math

import numpy as np
import pytest

from hand_models import Grasp
from hand_models.hand import Placement, settle_hands
from hand_models.rock import Mesh
from tests.suite.helpers.hands import HAND, ROCK, seating_on

pytestmark = pytest.mark.slow


def scan(triangles: int = 200_000, roughness: float = 2e-4) -> tuple[np.ndarray, np.ndarray]:
    """An open scan, 0.4 m square, of a rough log."""
    count = round(math.sqrt(triangles / 2)) + 1
    rng = np.random.default_rng(0)
    line = np.linspace(-0.2, 0.2, count)
    x, y = (v.ravel() for v in np.meshgrid(line, line, indexing="ij"))
    z = 0.15 - np.sqrt(np.maximum(0.15**2 - x**2 - 0.2 * y**2, 1e-4))
    z = z + 1e-3 * np.sin(40.0 * x + 25.0 * y) + rng.normal(0.0, roughness, len(x))
    i = np.arange(count**2).reshape(count, count)
    a, b, c, d = (v.ravel() for v in (i[:-1, :-1], i[1:, :-1], i[:-1, 1:], i[1:, 1:]))
    faces = np.vstack([np.column_stack([a, c, b]), np.column_stack([b, c, d])])
    return np.column_stack([x, y, z - z[count**2 // 2]]), faces


VERTICES, FACES = scan()


@pytest.fixture(scope="module")
def hold() -> Mesh:
    return Mesh(VERTICES, FACES)


@pytest.mark.benchmark(group="scan of 200,000 triangles")
def test_take_up(benchmark):
    assert len(benchmark(Mesh, VERTICES, FACES).triangles.faces) == len(FACES)


@pytest.mark.benchmark(group="scan of 200,000 triangles")
def test_section(benchmark, hold):
    section = benchmark(hold.section, [0.066, 0.0165, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    assert len(section.pieces) == 1


@pytest.mark.benchmark(group="scan of 200,000 triangles")
@pytest.mark.parametrize("rotation", [0.0, 1.0, math.pi])
def test_close_a_placed_hand(benchmark, hold, rotation):
    pose = seating_on(hold, Grasp(rotation)).pose
    (settled,) = benchmark(settle_hands, HAND, [Placement(hold, ROCK, Grasp(rotation), pose)])
    assert settled.touching.sum() > 6


@pytest.mark.benchmark(group="scan of 200,000 triangles")
def test_seat_a_hand(benchmark, hold):
    assert benchmark(seating_on, hold, Grasp(math.pi)).rule == "pinch"
