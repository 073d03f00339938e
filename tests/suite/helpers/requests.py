"""Requests as callers write them, and spoilt ones, shared by the tests of the service."""

from __future__ import annotations

import copy
import math
import random
from typing import Any

import msgspec
import numpy as np

from hand_models.base import Pose
from service.requests import PlanRequest
from service.wire import decode_request
from tests.suite.helpers.stances import PALM_TO_WALL, PLACES, wall

JSON = "application/json"
MSGPACK = "application/msgpack"

LIGHT, HEAVY = 50.0, 150.0
"""Masses [kg] that four pinches of rock on a wall hold, and that are too much for them."""


def pose(where: Pose) -> dict[str, Any]:
    return {
        "position": np.asarray(where.position).tolist(),
        "orientation": where.quaternion().tolist(),
    }


def pose_of(message: dict[str, Any]) -> Pose:
    """What `pose` has written."""
    return Pose.from_quaternion(message["position"], message["orientation"])


def wall_request(mass: float | None = LIGHT, limbs: tuple[str, ...] = tuple(PLACES)) -> dict:
    """Pinches of 300 mm cylinders on a vertical wall, a whole plan request."""
    body = Pose([0.0, 0.0, 0.0], wall())
    request: dict[str, Any] = {
        "v": 1,
        "id": "wall",
        "stance": {
            "body": pose(body),
            "hands": [
                {
                    "limb": limb,
                    "pose": pose(body @ Pose([*PLACES[limb], -0.3], PALM_TO_WALL)),
                    "hold": {"shape": "cylinder", "diameter": 0.3},
                    "surface": "rock",
                    "grasp": {"outer_rotation": math.pi},
                }
                for limb in limbs
            ],
        },
    }
    if mass is not None:
        request["load"] = {"mass": mass, "com": [0.0, 0.0, 0.0]}
    return request


def compliant_request() -> dict[str, Any]:
    """The wall's request with compliant wrists on limbs of known stiffness."""
    request = wall_request()
    for hand in request["stance"]["hands"]:
        hand["wrist"] = "compliant"
    request["stance"]["limb_stiffness"] = {"position": 5000.0, "angle": 100.0}
    return request


def plan_request(request: dict | None = None) -> PlanRequest:
    """A request, decoded; the wall's by default."""
    return decode_request(msgspec.json.encode(request or wall_request()), PlanRequest)


def stream_request(request: dict | None = None, **more: object) -> dict:
    """A stream's declaration with a plan request's stance and load; the wall's by default."""
    asked = wall_request() if request is None else request
    kept = ("stance", "body_wrench", "load", "limits")
    return {"v": 1} | {name: asked[name] for name in kept if name in asked} | more


def flat_request() -> dict:
    """One hand without lateral reactions, whose wrench space is quick to draw."""
    request = wall_request(limbs=("front_left",))
    request["stance"]["hands"][0]["grasp"]["lateral"] = False
    del request["load"]
    request["body_wrench"] = [0.0, 0.0, 10.0, 0.0, 0.0, 0.0]
    return request


def full_request() -> dict:
    """Every field that a stance without joints understands, in one request."""
    request = wall_request()
    first, second, third, fourth = request["stance"]["hands"]
    home = {"position": [0.0, 0.0, 0.003], "orientation": [0.0, 0.0, 0.0, 1.0]}
    first["hold"] = {"shape": "plane"}
    second["hold"] = {"shape": "sphere", "diameter": 0.5, "pose_in_hand": home}
    third["hold"] = {"shape": "edge", "fillet_radius": 0.05, "angle": 2.0}
    third["grasp"] = {"outer_rotation": 0.5, "closing_tension": 30, "palm": True, "lateral": True}
    fourth["surface"] = {
        "shear_limit": 60.0,
        "pull_off_limit": 15.0,
        "pull_off_angle": 0.7,
        "lateral_limit": 20.0,
        "compression_gain": 0.1,
        "half_planes": 3,
        "lateral_pull_off_ratio": 0.6,
        "shear_scatter": 12.0,
    }
    fourth["wrist"] = "fixed"
    request["stance"] |= {
        "robot": "robosimian",
        "gravity": [0.0, 0.0, -3.7],
        "hand": {
            "hand": {"mass": {"value": 2.8, "unit": "kg", "source": "measured", "note": "own"}},
            "nail": {"friction": {"value": 0.6, "unit": "1", "source": "assumed"}},
            "palm": {"tile_y": {"value": [0.014, -0.014], "unit": "m", "source": "measured"}},
        },
    }
    request["load"] = {"mass": 100.0, "com": [0.0, 0.0, 0.1], "acceleration": [0.0, 0.0, 0.2]}
    request |= {
        "objective": "max_margin",
        "limits": {"utilisation": 0.8, "tendon_tension": 150.0},
        "want": ["load_factor", "prices", "model"],
    }
    return request


JOINTS = {
    "front_right": [0.3164, 0.086, -1.7675, -2.7432, 2.878, -3.0676, 1.5215],
    "rear_right": [-0.0277, 0.5392, -0.2148, -1.0866, 2.8888, 2.5642, -0.3988],
    "rear_left": [-1.8231, -2.4716, 1.5967, 1.4921, -0.8306, 2.9648, -1.734],
    "front_left": [-0.2017, 0.1978, -0.2439, 2.8993, -1.9501, 2.8792, -1.7158],
}
"""Angles that put the hands of the wall's stance where they are [rad]."""


def request_with_joints() -> dict:
    """Every field that goes with joints, in one request."""
    request = wall_request(mass=None)
    stance = request["stance"]
    stance["joints"] = copy.deepcopy(JOINTS)
    stance["gravity"] = [0.0, 0.0, -4.5]
    stance["hands"][1]["wrench"] = [None, None, 20.0, None, None, None]
    return request | {
        "load": {"acceleration": [0.0, 0.0, 0.1], "angular_acceleration": [0.0, 0.1, 0.0]},
        "objective": "min_effort",
        "limits": {
            "utilisation": 0.95,
            "joint_torque": {"front_left": 150.0, "rear_left": [180.0] * 7},
            "per_hand": {
                "rear_left": {"largest_force": 400.0},
                "front_left": {
                    "largest_force": [300.0, None, [-250.0, 300.0]],
                    "frame": "body",
                },
            },
            "tension_change": 60.0,
        },
        "present": {"rear_left": [40.0, 40.0, 40.0, 40.0], "front_left": [45.0, 50.0, 50.0, 45.0]},
        "want": ["load_factor", "prices", "model"],
    }


def paths(value: Any, path: tuple = ()) -> list[tuple]:
    """Every place in a document, the whole first."""
    found = [path]
    if isinstance(value, dict):
        for key, part in value.items():
            found += paths(part, (*path, key))
    elif isinstance(value, list):
        for i, part in enumerate(value):
            found += paths(part, (*path, i))
    return found


def at(value: Any, path: tuple) -> Any:
    for step in path:
        value = value[step]
    return value


def put(value: Any, path: tuple, part: Any) -> Any:
    """A copy of a document with another part at a path."""
    if not path:
        return part
    value = copy.deepcopy(value)
    at(value, path[:-1])[path[-1]] = part
    return value


def drop(value: Any, path: tuple) -> Any:
    value = copy.deepcopy(value)
    del at(value, path[:-1])[path[-1]]
    return value


def dotted(path: tuple) -> str:
    """A path as errors name it."""
    text = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path)
    return text.removeprefix(".")


HAND = "stance.hands[0]"
LATER = ((("confidence",), 0.99, "confidence"),)
"""What the contract knows and this version does not: path, value, and the field to blame."""

JUNK = (
    None, True, -1, 0, 3, 1e-300, 1e300, -1e300, 2**63, 10**30, 0.5, math.nan, math.inf, "", "x",
    "plane", "floating", "solve", "ü\u0000\U0001f9d7", [], [1], [[[]]], {}, {"v": 1},
    {"shape": "mesh"}, {"shape": "plane"}, {"shear_limit": 20.0}, {"front_left": None},
    {"front_left": [1.0] * 7}, {"nose": {"largest_force": 1.0}}, "a" * 5000,
)  # fmt: skip


def spoil(request: dict, chance: random.Random) -> tuple[bytes, str]:
    """A request with one to three things changed, encoded; some of them stay good."""
    for _ in range(chance.randint(1, 3)):
        places = paths(request)
        path = chance.choice(places)
        trick = chance.random()
        if trick < 0.35:
            numbers = [p for p in places if type(at(request, p)) in (int, float)]
            path = chance.choice(numbers) if numbers else ()
            if path:
                scale = 10.0 ** chance.uniform(-3.0, 3.0) * chance.choice((1.0, 1.0, -1.0))
                request = put(request, path, at(request, path) * scale)
        elif trick < 0.65:
            request = put(request, path, copy.deepcopy(chance.choice(JUNK)))
        elif trick < 0.78 and path:
            request = drop(request, path)
        elif trick < 0.8:
            path, value, _ = chance.choice(LATER)
            if path[:-1] in places and isinstance(at(request, path[:-1]), dict):
                request = put(request, path, value)
        elif isinstance(at(request, path), dict):
            names = (
                "colour", "joints", "deadline", "limits", "want", "gravity", "pose", "load",
                "present", "wrench", "per_hand", "joint_torque", "largest_force", "front_left",
                "tension_change", "angular_acceleration", "objective", "robot",
            )  # fmt: skip
            request = put(request, (*path, chance.choice(names)), chance.choice(JUNK))
        elif isinstance(at(request, path), list):
            request = put(request, path, at(request, path) * chance.randint(0, 3))
    return garble(request, chance)


def garble(request: Any, chance: random.Random) -> tuple[bytes, str]:
    """Bytes and an encoding, now and then the wrong ones."""
    form = chance.choice((JSON, MSGPACK, "", "application/msgpack;crux.PlanRequest@1"))
    plain = msgspec.msgpack.encode if "msgpack" in form else msgspec.json.encode
    try:
        payload = plain(request)
    except OverflowError:  # an integer too long for MessagePack
        form, payload = JSON, msgspec.json.encode(request)
    trick = chance.random()
    if trick < 0.05:
        payload = payload[: chance.randrange(len(payload) + 1)]
    elif trick < 0.1 and payload:
        spot = chance.randrange(len(payload))
        payload = payload[:spot] + bytes([chance.randrange(256)]) + payload[spot + 1 :]
    elif trick < 0.12:
        payload = chance.randbytes(chance.randrange(200))
    elif trick < 0.14:
        form = chance.choice((JSON, MSGPACK, "image/png", "text/json", "zenoh/bytes", "\x00"))
    elif trick < 0.15:
        payload = chance.choice((b"[", b'{"a":', b"\x91")) * 100_000
    elif trick < 0.16:
        payload = b" " * 2_000_000
    return payload, form
