"""Body and hands moved by a person: the rock stays, and hands are seated on it again."""

from __future__ import annotations

import math

import numpy as np
import pytest
from msgspec import structs

import planner
from hand_models.base import InvalidInputError
from service import answering, requests
from service.answering.own_models import BUNDLED_ROBOTS
from service.commands.stances import read_request
from service.viewing import MovableStance, StanceMoves

RADIUS = 0.15
"""Of the cylinders of wall-300 [m]."""

LIMB = "front_right"


@pytest.fixture(scope="module")
def movable():
    return MovableStance(read_request("wall-300"), BUNDLED_ROBOTS)


def hand_of(request):
    (found,) = (h for h in answering.question(request).stance.hands if h.limb == LIMB)
    return found


def test_without_moves_the_request_is_the_given_one(movable):
    assert movable.moved(StanceMoves()) is movable.request
    assert movable.moved(StanceMoves(hands={LIMB: (0.0, 0.0, 0.0)})) is movable.request


def test_along_a_cylinder_a_hand_keeps_its_axes_and_its_grip(movable):
    before, after = (
        hand_of(movable.moved(StanceMoves(hands={LIMB: (0.0, way, 0.0)}))) for way in (0.0, 0.02)
    )
    step = after.pose.position - before.pose.position
    # quaternions of the file have nine digits
    np.testing.assert_allclose(step, 0.02 * before.pose.rotation[:, 1], atol=1e-7)
    np.testing.assert_allclose(after.pose.rotation, before.pose.rotation, atol=1e-9)


@pytest.mark.parametrize("way", [-0.06, 0.03, 0.09])
def test_around_a_cylinder_a_hand_turns_with_the_rock(movable, way):
    given = hand_of(movable.request)
    hand = movable.moved(StanceMoves(hands={LIMB: (way, 0.0, 0.0)})).stance.hands[0]
    point, approach = np.array(hand.place.point), np.array(hand.place.approach)
    # the crest of the given hand is in front of its palm, the axis a radius deeper
    depth = given.hold.entry([0.0, 0.0, -1.0], [0.0, 0.0, 1.0]) - 1.0
    assert depth == pytest.approx(0.0, abs=1e-12)
    x, _, z = given.pose.rotation.T
    (settled,) = planner.settle_each(answering.question(movable.request).stance.robot.hand, [given])
    crest = given.pose.apply(settled.seating.pose.position)
    axis = crest + RADIUS * z
    off = point - axis
    assert off @ x == pytest.approx(way, abs=1e-9)
    assert math.hypot(off @ x, off @ z) == pytest.approx(RADIUS, abs=1e-9)
    # toward the axis, as far as chords of a palm's length tell
    turned = math.asin(way / RADIUS)
    angle = math.atan2(-(approach @ x), approach @ z)
    assert angle == pytest.approx(turned, abs=0.03)


def test_a_hand_moved_by_a_hair_plans_as_the_given_one(movable):
    plans = [
        planner.plan(answering.question(movable.moved(StanceMoves(hands={LIMB: (way, way, 0.0)}))))
        for way in (0.0, 1e-7)
    ]
    assert plans[1].utilisation == pytest.approx(plans[0].utilisation, abs=1e-5)


def test_a_moved_body_is_where_it_was_moved_and_joints_are_found_again():
    movable = MovableStance(read_request("wall-300-joints"), BUNDLED_ROBOTS)
    moved = movable.moved(StanceMoves(body=(0.01, -0.02, 0.03, 0.0, 0.0, 0.0)))
    given = movable.request.stance
    step = np.subtract(moved.stance.body.position, given.body.position)
    np.testing.assert_allclose(step, [0.01, -0.02, 0.03], atol=1e-12)
    assert moved.stance.joints == "solve"
    assert moved.stance.hands == given.hands


def test_a_hand_whose_rock_is_given_in_it_moves_over_that_rock():
    request = read_request("wall-300")
    given = answering.question(request).stance
    rests = planner.settle_each(given.robot.hand, given.hands)
    hands = [
        structs.replace(
            hand,
            hold=structs.replace(
                hand.hold, pose_in_hand=answering.pose_of_request(rest.seating.pose)
            ),
        )
        for hand, rest in zip(request.stance.hands, rests, strict=True)
    ]
    request = structs.replace(request, stance=structs.replace(request.stance, hands=hands))
    moved = MovableStance(request, BUNDLED_ROBOTS).moved(
        StanceMoves(hands={LIMB: (0.0, 0.02, 0.0)})
    )
    (hand,) = (each for each in moved.stance.hands if each.limb == LIMB)
    assert isinstance(hand.place, requests.Place)
    assert hand.hold.pose_in_hand is None
    now = {each.limb: each for each in answering.question(moved).stance.hands}[LIMB]
    (before,) = (each for each in given.hands if each.limb == LIMB)
    (settled,) = planner.settle_each(given.robot.hand, [now])
    rest = rests[given.hands.index(before)]
    rocks = now.pose @ settled.seating.pose, before.pose @ rest.seating.pose
    np.testing.assert_allclose(rocks[0].position, rocks[1].position, atol=1e-9)
    np.testing.assert_allclose(rocks[0].rotation, rocks[1].rotation, atol=1e-9)


def test_off_the_rock_and_without_a_hand_there_is_an_error_in_words(movable):
    with pytest.raises(InvalidInputError, match="there is no rock 5000 mm along x"):
        movable.moved(StanceMoves(hands={LIMB: (5.0, 0.0, 0.0)}))
    with pytest.raises(InvalidInputError, match="unknown limb 'tail'; known are front_right"):
        movable.moved(StanceMoves(hands={"tail": (0.0, 0.01, 0.0)}))


def test_a_hand_turns_about_its_approach_where_it_is(movable):
    before, after = (
        hand_of(movable.moved(StanceMoves(hands={LIMB: (0.0, 0.02, turn)}))) for turn in (0.0, 0.2)
    )
    turned = before.pose.rotation.T @ after.pose.rotation
    c, s = math.cos(0.2), math.sin(0.2)
    np.testing.assert_allclose(turned, [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]], atol=1e-9)
    np.testing.assert_allclose(movable_crest(movable, after), movable_crest(movable, before))


def movable_crest(movable, hand):
    """The point on the rock in front of a hand's place, in W."""
    (settled,) = planner.settle_each(answering.question(movable.request).stance.robot.hand, [hand])
    return (hand.pose @ settled.seating.pose).apply(hand.at.position)


def test_the_body_turns_about_its_origin_in_w(movable):
    request = movable.moved(StanceMoves(body=(0.0, 0.01, 0.0, 0.0, 0.0, 0.1)))
    given, moved = (answering.question(each).stance for each in (movable.request, request))
    np.testing.assert_allclose(moved.body.position - given.body.position, [0.0, 0.01, 0.0])
    turn = moved.body.rotation @ given.body.rotation.T
    c, s = math.cos(0.1), math.sin(0.1)
    np.testing.assert_allclose(turn, [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]], atol=1e-9)
    turns = movable.handles(moved)["body"]["turns"]
    np.testing.assert_allclose(list(turns.values()), moved.body.rotation.T, atol=1e-12)
    assert [*turns] == ["roll", "pitch", "yaw"]
    # what hangs at the turned body stays where it was
    assert request.stance.hands == movable.request.stance.hands
