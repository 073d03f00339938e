"""Rock in requests: drawn, scanned, or refused by its field."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from tests.suite.helpers.replies import refusal, reply_to
from tests.suite.helpers.requests import HEAVY, JSON, MSGPACK, put, wall_request
from tests.suite.helpers.rocks import cylinder_mesh

FRONT = ("stance", "hands", 0)

VERTICES, FACES = (part.tolist() for part in cylinder_mesh(0.3))
WALL = [[-0.5, 0.0], [0.5, 0.0]]
STRIPS = dict.fromkeys(("outer_left", "inner_left", "inner_right", "outer_right"), WALL)


def test_drawn_and_scanned_rock_is_planned_on() -> None:
    for hold in [
        {"shape": "mesh", "vertices": VERTICES, "faces": FACES},
        {"shape": "profile", "points": [[-0.2, 0.1], [0.0, 0.0], [0.2, 0.1]]},
        {"shape": "profile", "profiles": STRIPS},
    ]:
        for form in [JSON, MSGPACK]:
            request = put(wall_request(), (*FRONT, "hold"), hold)
            assert reply_to(request, form).verified


def test_a_cylinder_of_triangles_gives_the_plan_of_the_cylinder() -> None:
    """Outer fingers can take over from each other at the same utilisation: their sums are alike."""
    want = ["load_factor", "prices"]
    replies = []
    for hold in (
        {"shape": "cylinder", "diameter": 0.3},
        {"shape": "mesh", "vertices": VERTICES, "faces": FACES},
    ):
        request = wall_request(HEAVY) | {"want": want}
        for hand in request["stance"]["hands"]:
            hand["hold"] = hold
        replies.append(reply_to(request))
    exact, meshed = replies
    assert meshed.status == exact.status
    assert meshed.utilisation == pytest.approx(exact.utilisation, rel=0.01)
    assert meshed.load_factor == pytest.approx(exact.load_factor, rel=0.01)
    for a, b in zip(exact.hands, meshed.hands, strict=True):
        assert b.seating.rule == a.seating.rule
        np.testing.assert_allclose(b.seating.pose.position, a.seating.pose.position, atol=1e-4)
        tensions = [sum(f.tendon_tension for f in hand.fingers) for hand in (a, b)]
        assert tensions[1] == pytest.approx(tensions[0], rel=0.01)


def test_impossible_rock_is_refused_by_field() -> None:
    for hold, field, words in [
        ({"shape": "mesh"}, "vertices", "missing"),
        ({"shape": "mesh", "vertices": VERTICES}, "faces", "missing"),
        ({"shape": "mesh", "file": "rock.stl"}, "file", "only the command line reads files"),
        ({"shape": "mesh", "vertices": VERTICES, "faces": [[0, 1]]}, "faces[0]", "length 3"),
        ({"shape": "mesh", "vertices": VERTICES, "faces": [[0, 1, -1]]}, "faces[0][2]", ">= 0"),
        ({"shape": "mesh", "vertices": VERTICES, "faces": [[0, 1, 512]]}, "faces[0]", "0 to 511"),
        ({"shape": "mesh", "vertices": [[0, 0]], "faces": FACES}, "vertices[0]", "length 3"),
        ({"shape": "profile"}, "points", "points or profiles"),
        (
            {"shape": "profile", "points": WALL, "profiles": STRIPS},
            "points",
            "give points or profiles, got ",
        ),
        ({"shape": "profile", "points": WALL[:1]}, "points", "length >= 2"),
        ({"shape": "profile", "profiles": {"outer_left": WALL}}, "profiles.inner_left", "missing"),
        ({"shape": "profile", "points": WALL[::-1] * 2}, "points", "crosses itself|another x"),
    ]:
        kind, blamed, message = refusal(put(wall_request(), (*FRONT, "hold"), hold))
        assert (kind, blamed) == ("invalid", f"stance.hands[0].hold.{field}")
        assert re.search(words, message)


def test_numbers_of_a_mesh_that_are_none_are_refused_in_messagepack_too() -> None:
    vertices = [*VERTICES[:-1], [0.0, math.nan, 0.0]]
    hold = {"shape": "mesh", "vertices": vertices, "faces": FACES}
    kind, blamed, _ = refusal(put(wall_request(), (*FRONT, "hold"), hold), form=MSGPACK)
    assert kind == "invalid"
    assert blamed.startswith("stance.hands[0].hold.vertices[511]")
