"""Plain friction contacts as the sets of hands, and the margin of their equilibrium.

With the loads of a hand the generators of its friction pyramid, and minus each load a limit row of
1 N, the least utilisation is −b0, where b0 is the largest with which every generator carries at
least b0, in newtons by a factor of the pyramid.
"""

from __future__ import annotations

import numpy as np

from hand_models.wrench_spaces import Row, WrenchSpace
from planner.programs import WRENCH_UNIT, HandData, StanceData, solvers

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
    return StanceData.of(tuple(hands), wrench / WRENCH_UNIT)


def our_margin(case: dict) -> float | None:
    outcome = solvers.margin(stance_of(case))
    # the distance from the sum of the unit generators to the pyramid's faces, per newton of b0
    edges = pyramid(np.array(case["normals"][-1]), case["friction"])
    per_newton = np.linalg.norm(np.cross(edges.sum(axis=1), edges[:, 0]))
    return -outcome.value * per_newton if outcome.solved else None
