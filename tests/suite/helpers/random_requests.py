"""Random plan requests, as JSON that `crux plan` takes: every way of asking, by seed.

A request that finds no good answer can be written to a file and asked again, by anyone.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from hand_models.base import Pose
from tests.suite.helpers.requests import pose
from tests.suite.helpers.stances import PALM_TO_WALL, PLACES, wall

GRAVITIES = (9.81, 3.71, 1.62)
SURFACES = ("rock", "concrete-coarse", "concrete-fine", "sandpaper-36")


def random_request(seed: int) -> dict[str, Any]:
    """A random stance of one to four hands, and a random question about it."""
    rng = np.random.default_rng([2026, seed])
    lean = rng.uniform(-0.9, 1.6)
    yaw = Rotation.from_rotvec([0.0, 0.0, rng.uniform(-math.pi, math.pi)]).as_matrix()
    body = Pose(rng.uniform(-5.0, 5.0, 3), yaw @ wall(lean))
    limbs = [str(limb) for limb in rng.permutation(list(PLACES))[: rng.choice([1, 2, 3, 4, 4, 4])]]
    off = rng.uniform(0.2, 0.45)
    stance: dict[str, Any] = {
        "gravity": [0.0, 0.0, -float(rng.choice(GRAVITIES))],
        "body": pose(body),
        "hands": [_hand(rng, limb, body, off) for limb in limbs],
    }
    if rng.random() < 0.4:
        stance["joints"] = "solve"
    request: dict[str, Any] = {"v": 1, "id": f"random-{seed}", "stance": stance}
    asked = rng.random()
    if asked < 0.25:
        request["body_wrench"] = (rng.normal(0.0, 1.0, 6) * [200, 200, 200, 40, 40, 40]).tolist()
    elif asked < 0.5:
        request["load"] = {
            "mass": float(rng.uniform(30.0, 130.0)),
            "com": rng.uniform(-0.1, 0.1, 3).tolist(),
            "acceleration": rng.normal(0.0, 0.5, 3).tolist(),
        }
    request["objective"] = "min_effort" if rng.random() < 0.3 else "max_margin"
    _limit(rng, request, limbs)
    request["want"] = ["prices", *(["load_factor"] if rng.random() < 0.5 else [])]
    return request


def _hand(rng: np.random.Generator, limb: str, body: Pose, off: float) -> dict[str, Any]:
    place = np.array([*PLACES[limb], -off]) + rng.uniform(-0.1, 0.1, 3)
    turn = Rotation.from_rotvec([*rng.uniform(-0.2, 0.2, 2), rng.uniform(-0.4, 0.4)])
    rotation = float(rng.choice([math.pi, math.pi, 0.0, rng.uniform(0.0, math.pi)]))
    grasp: dict[str, Any] = {
        "outer_rotation": rotation,
        "palm": bool(rng.random() < 0.9),
        "lateral": bool(rng.random() < 0.9),
    }
    if rng.random() < 0.4:
        grasp["closing_tension"] = float(rng.uniform(20.0, 60.0))
    hand: dict[str, Any] = {
        "limb": limb,
        "pose": pose(body @ Pose(place, PALM_TO_WALL @ turn.as_matrix())),
        "hold": _hold(rng),
        "surface": str(rng.choice(SURFACES))
        if rng.random() < 0.6
        else {
            "shear_limit": float(rng.uniform(30.0, 150.0)),
            "half_planes": int(rng.choice([1, 2, 5])),
        },
        "grasp": grasp,
    }
    if rng.random() < 0.06:
        held = rng.normal(0.0, 1.0, 6) * [60, 60, 60, 5, 5, 5]
        given = rng.random(6) < 0.3
        hand["wrench"] = [float(v) if g else None for v, g in zip(held, given, strict=True)]
    return hand


def _hold(rng: np.random.Generator) -> dict[str, Any]:
    kind = int(rng.integers(6))
    if kind == 0:
        return {"shape": "sphere", "diameter": float(rng.uniform(0.2, 1.0))}
    if kind == 1:
        return {
            "shape": "edge",
            "fillet_radius": float(rng.uniform(0.03, 0.2)),
            "angle": float(rng.uniform(1.2, 2.8)),
        }
    if kind == 2:
        return {"shape": "plane"}
    return {"shape": "cylinder", "diameter": float(rng.uniform(0.15, 0.7))}


def _limit(rng: np.random.Generator, request: dict[str, Any], limbs: list[str]) -> None:
    limits: dict[str, Any] = {}
    if rng.random() < 0.3:
        limits["utilisation"] = float(rng.uniform(0.5, 1.0))
    if rng.random() < 0.2:
        limits["tendon_tension"] = float(rng.uniform(60.0, 300.0))
    if "joints" in request["stance"] and rng.random() < 0.5:
        limits["joint_torque"] = float(rng.uniform(40.0, 300.0))
    if rng.random() < 0.2:
        cap = float(rng.uniform(80.0, 400.0))
        most = cap if rng.random() < 0.5 else [cap, None, [-cap, 0.0]]
        frame = str(rng.choice(["hand", "body", "world"]))
        limits["per_hand"] = {limbs[0]: {"largest_force": most, "frame": frame}}
    if rng.random() < 0.2:
        request["present"] = {limbs[-1]: rng.uniform(30.0, 80.0, 4).tolist()}
        if rng.random() < 0.5:
            limits["tension_change"] = float(rng.uniform(5.0, 60.0))
    if limits:
        request["limits"] = limits
