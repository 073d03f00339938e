"""Rocks of a stance, which hands share: the plan of rock of their own, and a smaller request."""

from __future__ import annotations

import copy
import json
from pathlib import Path

import msgspec
import numpy as np
import pytest
import trimesh

from hand_models.base import InvalidInputError, Pose
from hand_models.rock import Mesh
from service.answering import questions
from service.commands.stances import read_request
from service.requests import RouteRequest
from service.wire import decode_request
from tests.suite.helpers.replies import departures, refusal, reply_to
from tests.suite.helpers.requests import JSON, MSGPACK, plan_request, pose, put, wall_request
from tests.suite.helpers.rocks import rough_wall
from tests.suite.helpers.stances import PALM_TO_WALL, wall

VERTICES, FACES = rough_wall()
WALL = {"shape": "mesh", "vertices": VERTICES, "faces": FACES}
IN_WORLD = pose(Pose(np.zeros(3), wall()) @ Pose(np.array([0.0, 0.0, -0.304]), PALM_TO_WALL))
"""4 mm off the palms."""

AWAY = {"position": [0.7, 0.0, 0.0], "orientation": [0.0, 0.0, 0.0, 1.0]}


def four_on(hold: dict, rocks: dict | None = None) -> dict:
    request = wall_request()
    for hand in request["stance"]["hands"]:
        hand["hold"] = copy.deepcopy(hold)
        hand["grasp"] = {}
    if rocks is not None:
        request["stance"]["rocks"] = rocks
    return request


def on_wall(rock: dict | None = None, **reference: object) -> dict:
    return four_on(
        {"shape": "rock", "rock": "wall"} | reference, {"wall": rock or WALL | {"pose": IN_WORLD}}
    )


def numbers(reply: object) -> np.ndarray:
    """All numbers of a reply but its times."""
    found: list[float] = []

    def walk(value: object) -> None:
        if isinstance(value, dict):
            for name, part in value.items():
                if name not in ("time", "solver"):
                    walk(part)
        elif isinstance(value, list):
            for part in value:
                walk(part)
        elif isinstance(value, float):
            found.append(value)

    walk(msgspec.to_builtins(reply))
    return np.array(found)


@pytest.mark.parametrize("form", [JSON, pytest.param(MSGPACK, marks=pytest.mark.slow)])
def test_a_shared_rock_gives_the_plan_of_four_alike(form: str) -> None:
    apart, shared = four_on(WALL | {"pose": IN_WORLD}), on_wall()
    assert len(msgspec.json.encode(apart)) > 3.9 * len(msgspec.json.encode(shared))
    assert not departures("PlanRequest", shared)
    replies = [reply_to(request, form) for request in (apart, shared)]
    assert replies[0].status == replies[1].status
    np.testing.assert_allclose(*map(numbers, replies), rtol=0.0, atol=1e-12)


def test_hands_share_one_hold_and_are_where_they_say_or_where_the_rock_is() -> None:
    request = on_wall(WALL | {"pose": IN_WORLD})
    hands = request["stance"]["hands"]
    hands[1]["hold"]["pose"] = moved = {**IN_WORLD, "position": [0.001, 0.0, 0.0]}
    hands[2]["hold"]["pose_in_hand"] = {**AWAY, "position": [0.0, 0.0, 0.004]}
    asked = questions.question(plan_request(request)).stance.hands
    assert len({id(hand.hold) for hand in asked}) == 1
    assert asked[0].hold_pose.position.tolist() == pytest.approx(IN_WORLD["position"])
    assert asked[1].hold_pose.position.tolist() == moved["position"]
    assert (asked[2].hold_pose, asked[2].hold_in_hand.position.tolist()) == (
        None,
        [0.0, 0.0, 0.004],
    )


def test_without_any_pose_hands_are_seated_on_it() -> None:
    asked = questions.question(plan_request(on_wall(WALL))).stance.hands
    assert all(hand.placed_hold() is None for hand in asked)


def test_any_hold_may_be_shared() -> None:
    holds = [
        {"shape": "cylinder", "diameter": 0.3},
        {"shape": "profile", "points": [[-1, 0], [1, 0]]},
    ]
    for hold in holds:
        replies = [reply_to(four_on(hold)), reply_to(on_wall(hold))]
        np.testing.assert_allclose(*map(numbers, replies), rtol=0.0, atol=1e-12)


def test_meshes_alike_are_built_once_and_others_apart() -> None:
    first, again = (questions.question(plan_request(on_wall())) for _ in range(2))
    assert first.stance.hands[0].hold is again.stance.hands[3].hold
    vertices, faces = rough_wall(seed=1)
    other = on_wall({"shape": "mesh", "vertices": vertices, "faces": faces, "pose": IN_WORLD})
    assert questions.question(plan_request(other)).stance.hands[0].hold is not first.stance.hands[0]


def test_moves_of_a_route_refer_to_the_rocks_of_its_stance() -> None:
    request = on_wall()
    move = copy.deepcopy(request["stance"]["hands"][0])
    del request["id"]
    route = request | {"moves": [move]}
    assert not departures("RouteRequest", route)
    asked = questions.route_of(decode_request(msgspec.json.encode(route), RouteRequest))
    assert asked.moves[0].hand.hold is asked.start.hands[0].hold
    assert isinstance(asked.moves[0].hand.hold, Mesh)
    move["hold"]["rock"] = "roof"
    with pytest.raises(InvalidInputError, match=r"moves\[0\].hold.rock: unknown rock 'roof'"):
        questions.route_of(decode_request(msgspec.json.encode(route), RouteRequest))


HOLD = ("stance", "hands", 2, "hold")
ROCK = ("stance", "rocks", "wall")


def test_errors_name_the_field() -> None:
    for place, value, field, words in [
        (
            (*HOLD, "rock"),
            "roof",
            "stance.hands[2].hold.rock",
            "unknown rock 'roof'; known are wall",
        ),
        (("stance", "rocks"), {}, "stance.hands[0].hold.rock", "stance.rocks names none"),
        ((*HOLD, "rock"), 3, "stance.hands[2].hold.rock", "a string"),
        ((*HOLD, "diameter"), 3.0, "stance.hands[2].hold.diameter", "unknown field"),
        ((*ROCK, "pose_in_hand"), IN_WORLD, "stance.rocks.wall.pose_in_hand", "hands share"),
        (
            (*ROCK, "pose"),
            AWAY | {"orientation": [0, 0, 0, 2.0]},
            "stance.rocks.wall.pose.orientation",
            "norm",
        ),
        ((*ROCK[:-1], ""), WALL, "stance.rocks", "a rock needs a name"),
        ((*ROCK, "file"), "wall.ply", "stance.rocks.wall.file", "only the command line"),
        ((*ROCK, "faces"), [[0, 1, 9999]], "stance.rocks.wall.faces[0]", "must name vertices"),
        (
            ROCK,
            {"shape": "rock", "rock": "wall"},
            "stance.rocks.wall.shape",
            "not known; valid: plane",
        ),
    ]:
        _, blamed, message = refusal(put(on_wall(), place, value))
        assert blamed == field
        assert words in message


def test_a_rock_may_begin_anywhere_but_where_a_hand_is_seated() -> None:
    far = np.add(VERTICES, [0.0, 0.0, 2.0]).tolist()
    turned = [face[::-1] for face in FACES]
    for vertices, faces, words in (
        (far, FACES, "from the hold's origin"),
        (VERTICES, turned, "away"),
    ):
        rock = {"shape": "mesh", "vertices": vertices, "faces": faces}
        questions.question(plan_request(on_wall(rock | {"pose": IN_WORLD})))
        questions.question(plan_request(on_wall(rock, pose_in_hand=AWAY)))
        _, field, message = refusal(on_wall(rock))
        assert field == "stance.hands[0].hold.rock"
        assert words in message


def test_a_rock_may_be_in_a_file(tmp_path: Path) -> None:
    trimesh.Trimesh(VERTICES, FACES, process=False).export(tmp_path / "wall.ply")
    (tmp_path / "stance.json").write_text(
        json.dumps(on_wall({"shape": "mesh", "file": "wall.ply", "pose": IN_WORLD}))
    )
    rock = read_request(str(tmp_path / "stance.json")).stance.rocks["wall"]
    assert rock.file is None
    np.testing.assert_allclose(rock.vertices, VERTICES, atol=1e-6)
    (tmp_path / "wall.ply").unlink()
    with pytest.raises(InvalidInputError, match="no such file") as caught:
        read_request(str(tmp_path / "stance.json"))
    assert caught.value.field == "stance.rocks.wall.file"


def test_what_is_odd_about_a_rock_is_told_once_with_the_hand_that_has_it_first() -> None:
    vertices = np.array(VERTICES)
    vertices[90 * 45 + 2 : 90 * 45 + 32, 2] = vertices[90 * 46 + 2 : 90 * 46 + 32, 2] = -0.5
    odd = WALL | {"vertices": [*vertices.tolist(), [0.0, float("nan"), 0.0]]}
    shared = on_wall(odd | {"pose": IN_WORLD})
    shared["stance"]["hands"][0]["hold"] = {"shape": "cylinder", "diameter": 0.3}
    told = [
        "hands[1].hold.vertices: 60 vertices are at exactly z = -0.5 m, with cliffs around them; "
        "leave out cells that have no height",
        "hands[1].hold.vertices: 1 vertices without numbers, which no triangle names, were left "
        "out",
    ]
    assert [w for w in reply_to(shared, MSGPACK).warnings if "vertices" in w] == told
    assert not [w for w in reply_to(on_wall()).warnings if "vertices" in w]
    # in JSON there is no NaN
    assert refusal(shared)[1] == f"stance.rocks.wall.vertices[{len(VERTICES)}][1]"
