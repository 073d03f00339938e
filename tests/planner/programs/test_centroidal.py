"""The equilibrium margin of hpp-centroidal-dynamics, from plain friction contacts as our sets.

Its margin is the largest b0 with which every generator of every friction pyramid carries at least
b0, in newtons by a factor of the pyramid. With the loads of a hand the pyramid's generators, and
minus each load a limit row of 1 N, our least utilisation is −b0.
"""

import sys

import numpy as np
import pytest

from hand_models.wrench_spaces import Row, WrenchSpace
from planner.programs import WRENCH_UNIT, HandData, StanceData, solvers
from tests.suite.helpers import centroidal_peer

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="its wheels are for Linux")

GRAVITY = 9.81
EDGES = 4
ENOUGH = 1e4
"""A cap on each load that is never reached [N]: a set has hard rows."""


def pyramid(normal: np.ndarray, friction: float) -> np.ndarray:
    """Unit generators (3, 4) of a contact's friction pyramid, turned by 45° from its tangents."""
    first = np.cross(normal, [0.0, 1.0, 0.0])
    first /= np.linalg.norm(first)
    second = np.cross(normal, first)
    turns = np.pi / 4.0 + np.arange(EDGES) * np.pi / 2.0
    edges = friction * (np.outer(first, np.sin(turns)) + np.outer(second, np.cos(turns)))
    edges += normal[:, None]
    return edges / np.linalg.norm(edges, axis=0)


def contact(point: np.ndarray, edges: np.ndarray) -> HandData:
    """A contact as a hand at the body's origin: what it exerts on the ground, by its loads."""
    wrenches = np.vstack([edges, np.cross(point, edges.T).T])
    names = [
        Row(None, None, "generator", kind, f"{kind}{i}")
        for kind in ("limit", "hard")
        for i in range(EDGES)
    ]
    space = WrenchSpace(
        origin=np.zeros(6),
        generators=-wrenches,
        columns=tuple(f"edge{i}" for i in range(EDGES)),
        rows=tuple(names),
        L=-np.eye(EDGES),
        l0=np.zeros(EDGES),
        s=np.ones(EDGES),
        H=np.eye(EDGES),
        h=np.full(EDGES, ENOUGH),
    )
    return HandData.of(space, np.eye(6))


def random_case(rng: np.random.Generator) -> dict:
    count = int(rng.integers(3, 6))
    points = rng.uniform(-1.0, 1.0, (count, 3)) * [1.0, 1.0, 0.3]
    normals = rng.normal([0.0, 0.0, 1.0], 0.3, (count, 3))
    return {
        "points": points.tolist(),
        "normals": (normals / np.linalg.norm(normals, axis=1)[:, None]).tolist(),
        "friction": float(rng.uniform(0.3, 1.0)),
        "mass": float(rng.uniform(20.0, 110.0)),
        "com": [*(points[:, :2].mean(axis=0) + rng.normal(0.0, 0.2, 2)).tolist(), 0.5],
    }


def stance_of(case: dict) -> StanceData:
    """A case as the planner's programs take it."""
    hands = []
    for point, normal in zip(case["points"], case["normals"], strict=True):
        edges = pyramid(np.array(normal), case["friction"])
        hands.append(contact(np.array(point), edges))
    weight = np.array([0.0, 0.0, case["mass"] * GRAVITY])
    wrench = np.concatenate([weight, np.cross(case["com"], weight)])
    return StanceData(tuple(hands), wrench / WRENCH_UNIT)


def our_margin(case: dict) -> float | None:
    outcome = solvers.margin(stance_of(case))
    # the distance from the sum of the unit generators to the pyramid's faces, per newton of b0
    edges = pyramid(np.array(case["normals"][-1]), case["friction"])
    per_newton = np.linalg.norm(np.cross(edges.sum(axis=1), edges[:, 0]))
    return -outcome.value * per_newton if outcome.solved else None


def test_margin_is_that_of_hpp_centroidal_dynamics():
    rng = np.random.default_rng(7)
    cases = [random_case(rng) for _ in range(60)]
    theirs = centroidal_peer.margins(cases, EDGES)
    ours = [our_margin(case) for case in cases]
    assert sum(margin is not None and margin > 0.0 for margin in theirs) > 20
    assert sum(margin is not None and margin < 0.0 for margin in theirs) > 5
    for mine, other in zip(ours, theirs, strict=True):
        assert mine == (None if other is None else pytest.approx(other, rel=1e-6, abs=1e-6))
