"""What a wrench-space request may cost: answered or refused beforehand, and no less right."""

from __future__ import annotations

import itertools
import json
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest
from scipy.optimize import linprog

from hand_models.wrench_spaces import clipping
from planner import programs
from planner.programs import Outcome, Reached
from service import answering
from service.answering import dispatch
from service.commands.stances import read_request
from tests.suite.helpers.replies import departures
from tests.suite.helpers.requests import flat_request

KEY = "crux/robosimian/wrench_space"
VIEWS = ("vertices", "half_spaces")
AXES = ("fx", "fy", "fz", "mx", "my", "mz")


def asked(half_planes: int, stance: str = "wall-300", **fields: Any) -> dict[str, Any]:
    """A request for the first hand of a bundled stance, alone."""
    whole = json.loads(msgspec.json.encode(read_request(stance).stance))
    hand = whole["hands"][0] | {"surface": {"shear_limit": 60.0, "half_planes": half_planes}}
    hand |= {name: fields.pop(name) for name in ("wrist", "grasp") if name in fields}
    whole |= {"hands": [hand], "joints": None}
    return {"v": 1, "stance": whole, "limb": hand["limb"]} | fields


def answered(request: dict[str, Any]) -> dict[str, Any]:
    answer = dispatch.handle(KEY, json.dumps(request).encode())
    reply: dict[str, Any] = json.loads(answer.payload)
    if answer.good:
        assert departures("WrenchSpaceRequest", request) == []
        assert departures("WrenchSpaceReply", reply) == []
    return reply


def highest(reply: dict[str, Any], direction: np.ndarray) -> float:
    """Of direction · w over the reply's rows, by HiGHS."""
    V = np.array([column["wrench"] for column in reply["generators"]])
    A = np.array([row["coefficients"] for row in reply["rows"]])
    b = np.array([row["capacity"] - row["constant"] for row in reply["rows"]])
    found = linprog(-V @ direction, A, b, bounds=(None, None))
    return float(-found.fun + direction @ reply["origin"])


SOME = ((2, "fixed"), (5, "fixed"))


@pytest.mark.parametrize(
    ("half_planes", "wrist"),
    [
        pytest.param(*case, marks=() if case in SOME else pytest.mark.slow)
        for case in itertools.product((1, 2, 5, 8, 64), ("fixed", "floating"))
    ],
)
def test_a_wrench_space_of_any_number_of_half_planes_is_told_or_refused(
    half_planes: int, wrist: str
) -> None:
    reply = answered(asked(half_planes, wrist=wrist))
    left_out = {view for view in VIEWS if reply[view] is None}
    assert {warning.split()[0] for warning in reply["warnings"]} == left_out
    assert bool(left_out) == (half_planes >= (5 if wrist == "fixed" else 8))
    bare = answered(asked(half_planes, wrist=wrist, want=[]))
    assert {bare[view] for view in VIEWS} == {None}
    assert bare["warnings"] == []
    for name in ("origin", "generators", "rows", "capability", "dimension", "tension_limits"):
        assert bare[name] == reply[name]
    for i, axis in enumerate(AXES):
        for sign in "+-":
            direction = np.eye(6)[i] * (1.0 if sign == "+" else -1.0)
            extent = bare["capability"][f"{sign}{axis}"]["extent"]
            assert extent == pytest.approx(highest(bare, direction), rel=1e-6, abs=1e-5)
    for view in VIEWS:
        alone = answered(asked(half_planes, wrist=wrist, want=[view]))
        if view in left_out:
            error = alone["error"]
            assert (error["kind"], error["field"]) == ("limit", "want")
            assert error["message"].startswith(f"{view}: ")
            assert "half_planes" in error["message"]
        else:
            assert alone[view] == reply[view]
            assert [alone[other] for other in VIEWS if other != view] == [None]


def test_without_lateral_many_half_planes_have_their_views() -> None:
    reply = answered(asked(64, grasp={"lateral": False}, want=["vertices", "half_spaces"]))
    corners = np.array(reply["vertices"])
    for direction in np.random.default_rng(0).normal(size=(5, 6)):
        highest_corner = (corners @ direction).max()
        assert highest_corner == pytest.approx(highest(reply, direction), rel=1e-6)


@pytest.mark.slow
def test_a_cut_that_turns_out_too_dear_is_left_out_or_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    few = replace(clipping.SETTINGS, most_pairs=1000, pairs_per_vertex=0)
    monkeypatch.setattr(clipping, "SETTINGS", few)
    assert answered(asked(2))["warnings"] == []  # nothing cuts this one
    reply = answered(asked(3))
    assert [reply[view] for view in VIEWS] == [None, None]
    assert all("pairs of vertices" in warning for warning in reply["warnings"])
    assert len(reply["warnings"]) == 2
    assert reply["capability"] is not None
    error = answered(asked(3, want=["half_spaces"]))["error"]
    assert (error["kind"], error["field"]) == ("limit", "want")


def test_what_is_wanted_is_wanted_once() -> None:
    error = answered(asked(1, want=["vertices", "vertices"]))["error"]
    assert (error["kind"], error["field"]) == ("invalid", "want[1]")


def test_a_scatter_of_many_rows_is_refused_before_it_is_drawn() -> None:
    error = answered(asked(64, want=["robust"]))["error"]
    assert (error["kind"], error["field"]) == ("limit", "want")
    assert "robust: 1887 rows" in error["message"]


def test_a_hand_that_carries_nothing_has_no_vertices_where_these_are_asked_for() -> None:
    request = {"v": 1, "stance": flat_request()["stance"], "limb": "front_left"}
    for hand in request["stance"]["hands"]:
        hand["surface"] = {"shear_limit": 0.5}
    for want, vertices in ((None, []), (["vertices"], []), ([], None)):
        reply = answered(request | {"want": want})
        assert (reply["vertices"], reply["half_spaces"]) == (vertices, None)
        assert (reply["capability"], reply["warnings"]) == (None, [])


def test_the_same_in_this_process() -> None:
    from service import WrenchSpaceRequest

    request = msgspec.convert(asked(1), WrenchSpaceRequest)
    reply = answering.answer_wrench_space(msgspec.structs.replace(request, want=["half_spaces"]))
    assert reply.vertices is None
    assert reply.half_spaces == answering.answer_wrench_space(request).half_spaces


def test_a_floating_wrist_that_nothing_holds_some_way_adds_nothing() -> None:
    for hold, grasp in [
        # no finger reaches it; above 45 N the joints close in the air up to their stops
        (
            {"shape": "sphere", "diameter": 0.004},
            {"palm": False, "lateral": False, "closing_tension": 60.0},
        ),
        # nothing holds the wrist sideways
        (
            {"shape": "edge", "fillet_radius": 0.0012, "angle": 3.05},
            {"palm": False, "lateral": False, "outer_rotation": 0.0},
        ),
    ]:
        request = asked(1, wrist="floating")
        request["stance"]["hands"][0] |= {"hold": hold, "grasp": grasp, "surface": "rock"}
        reply = answered(request)
        assert reply["dimension"] is not None
        assert reply["dimension"] < 6


def test_a_body_space_without_a_bound_is_refused_as_such(monkeypatch: pytest.MonkeyPatch) -> None:
    nothing = Outcome(False, "unbounded", 0, float("nan"))
    monkeypatch.setattr(programs, "reach", lambda *_: Reached(nothing, np.full(1, np.nan)))
    stance = json.loads(msgspec.json.encode(read_request("wall-300").stance))
    payload = json.dumps({"v": 1, "stance": stance, "directions": [[0, 0, 1]]}).encode()
    answer = dispatch.handle("crux/robosimian/body_space", payload)
    assert answer.status == "unsupported"
    assert "is unbounded" in json.loads(answer.payload)["error"]["message"]
