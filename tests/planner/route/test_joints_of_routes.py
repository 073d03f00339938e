"""Joint angles that a route gives: where they count, and what is found where they do not."""

import json
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest

from hand_models.base import InvalidInputError, Pose
from planner.robots import robosimian
from planner.route import Move, Route, evaluate
from planner.route.climb import stages
from service.answering import questions
from service.commands.stances import read_route
from service.requests import RouteRequest
from service.wire import decode_request

UP = np.array([0.0, 0.0, 1.0])


def raised(pose: Pose, by: float) -> Pose:
    return Pose(pose.position + by * UP, pose.rotation)


@pytest.fixture(scope="module")
def solved() -> Route:
    """Two moves: a hand, and after a shift of the body another one."""
    bundled = questions.route_of(read_route("six-moves"))
    start = replace(bundled.start, joints="solve")
    hand = next(each for each in start.hands if each.limb == "front_right")
    second = Move(replace(hand, pose=raised(hand.pose, 0.03)), raised(start.body, 0.01))
    return replace(bundled, start=start, moves=(bundled.moves[0], second))


@pytest.fixture(scope="module")
def climbed(solved):
    result = evaluate(solved)
    assert {answer.status for answer in result.plans} == {"optimal"}
    return result


def angles_of(climbed, move, phase):
    return next(
        dict(answer.joints)
        for stage, answer in zip(climbed.stages, climbed.plans, strict=True)
        if (stage.move, stage.phase) == (move, phase)
    )


def given_by(climbed, solved) -> Route:
    """The same climb with the angles that were found."""
    moves = [
        replace(move, joints=angles_of(climbed, number, "place"))
        for number, move in enumerate(solved.moves, start=1)
    ]
    start = replace(solved.start, joints=angles_of(climbed, 0, "start"))
    return replace(solved, start=start, moves=tuple(moves))


def test_angles_that_were_found_give_the_same_climb(climbed, solved):
    given = evaluate(given_by(climbed, solved))
    for stage, one, other in zip(given.stages, given.plans, climbed.plans, strict=True):
        if stage.phase == "lift":
            # the limb in the air is where it was, not at zero
            continue
        assert one.status == other.status
        assert one.utilisation == pytest.approx(other.utilisation, rel=1e-4)
        assert one.verified


def test_every_stage_has_the_angles_that_hold_then(climbed, solved):
    route = given_by(climbed, solved)
    first, second = (move.joints for move in route.moves)
    start = route.start.joints
    lifted, other = (move.hand.limb for move in route.moves)
    by = {(s.move, s.phase): s.question.stance.joints for s in stages(route)}
    assert [*by] == [
        *((0, "start"), (1, "lift"), (1, "place")),
        *((2, "shift"), (2, "lift"), (2, "place")),
    ]
    np.testing.assert_array_equal(by[0, "start"][lifted], start[lifted])
    # the limb that lifts keeps its angles in the air, and has the new ones on its hold
    np.testing.assert_array_equal(by[1, "lift"][lifted], start[lifted])
    np.testing.assert_array_equal(by[1, "place"][lifted], first[lifted])
    # a shift changes all: those given count, those of the limb that moves next are found
    assert by[2, "shift"][other] == "solve"
    assert other not in by[2, "lift"]
    np.testing.assert_array_equal(by[2, "place"][other], second[other])
    for limb in set(first) - {lifted, other}:
        np.testing.assert_array_equal(by[1, "lift"][limb], first[limb])
        np.testing.assert_array_equal(by[2, "shift"][limb], second[limb])


def test_angles_left_out_stay_until_the_body_shifts(climbed, solved):
    route = given_by(climbed, solved)
    bare = replace(route, moves=tuple(replace(move, joints="solve") for move in route.moves))
    by = {(s.move, s.phase): s.question.stance.joints for s in stages(bare)}
    lifted = route.moves[0].hand.limb
    assert by[1, "place"][lifted] == "solve"
    for limb in set(route.start.joints) - {lifted}:
        np.testing.assert_array_equal(by[1, "place"][limb], route.start.joints[limb])
    assert by[2, "shift"] == by[2, "lift"] == by[2, "place"] == "solve"
    assert {answer.status for answer in evaluate(bare).plans} == {"optimal"}


def test_a_limb_may_be_given_and_the_others_found(climbed, solved):
    """Beside the limbs that are found, those that are given stay exactly where they are."""
    place = angles_of(climbed, 1, "place")
    turned = place["rear_left"]
    moves = (replace(solved.moves[0], joints={"rear_left": turned}), *solved.moves[1:])
    result = evaluate(replace(solved, moves=moves))
    for stage, answer in zip(result.stages, result.plans, strict=True):
        assert answer.status == "optimal"
        if stage.move == 1:
            np.testing.assert_array_equal(answer.joints["rear_left"], turned)


@pytest.mark.parametrize(
    ("number", "limb", "change", "field", "words"),
    [
        (0, "front_left", lambda q: q[:6], "moves[0].joints.front_left", "7"),
        (1, "rear_left", lambda q: [*q, 0.0], "moves[1].joints.rear_left", "7"),
        (0, "front_left", lambda q: q * np.nan, "moves[0].joints.front_left", "finite"),
        (1, "front_right", lambda q: q + 9.0, "moves[1].joints.front_right[", "goes from"),
        (0, "rear_right", lambda q: q - 9.0, "moves[0].joints.rear_right[", "goes from"),
        (0, "nobody", lambda _: [0.0] * 7, "moves[0].joints.nobody", "unknown limb"),
        (0, "nobody", lambda _: "solve", "moves[0].joints.nobody", "unknown limb"),
        (1, "", lambda _: "solve", "moves[1].joints.", "unknown limb"),
        (1, "rear_left", lambda _: "guess", "moves[1].joints.rear_left", "'solve'"),
        (0, "front_left", lambda q: 0.5 * q, "moves[0].pose", "of the pose of"),
        (1, "rear_right", lambda q: 0.5 * q, "stance.hands[", "of the pose of"),
        (1, "front_right", lambda q: 0.9 * q, "moves[1].pose", "of the pose of"),
    ],
)
def test_angles_that_cannot_be_are_told_with_their_move(
    climbed, solved, number, limb, change, field, words
):
    route = given_by(climbed, solved)
    moves = list(route.moves)
    angles = dict(moves[number].joints)
    angles[limb] = change(angles.get(limb))
    moves[number] = replace(moves[number], joints=angles)
    with pytest.raises(InvalidInputError) as caught:
        evaluate(replace(route, moves=tuple(moves)))
    assert caught.value.field.startswith(field)
    assert words in caught.value.message


def test_a_route_without_joints_takes_none(solved):
    moves = (replace(solved.moves[0], joints={"front_left": np.zeros(7)}), solved.moves[1])
    bare = replace(solved, start=replace(solved.start, joints=None))
    assert all(stage.question.stance.joints is None for stage in stages(bare))
    with pytest.raises(InvalidInputError, match="joints in the start stance") as caught:
        evaluate(replace(bare, moves=moves))
    assert caught.value.field == "moves[0].joints"


def test_a_route_of_a_file_takes_them(climbed):
    file = resources.files("service").joinpath("examples", "routes", "six-moves.json")
    text = json.loads(file.read_text(encoding="utf-8"))
    text["moves"] = text["moves"][:1]
    text["stance"]["joints"] = {
        limb: angles.tolist() for limb, angles in angles_of(climbed, 0, "start").items()
    }
    place = angles_of(climbed, 1, "place")["front_left"]
    text["moves"][0]["joints"] = {"front_left": place.tolist(), "rear_left": "solve"}
    request = decode_request(json.dumps(text).encode(), RouteRequest)
    result = evaluate(questions.route_of(request))
    assert [answer.status for answer in result.plans] == ["optimal"] * 3
    np.testing.assert_array_equal(result.plans[2].joints["front_left"], place)
    assert set(result.plans[0].joints) == set(robosimian().limbs)
