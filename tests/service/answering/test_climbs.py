"""What a search for a climb finds is the reply, and its route is one that can be asked for."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import msgspec
import numpy as np
import pytest
from msgspec.structs import replace as changed

from hand_models.base import InvalidInputError, Pose
from hand_models.hand import WristTravel
from planner import (
    BodyGrid,
    MadeWall,
    PlaceGrid,
    climb_certificate,
    deadline,
    evaluate,
    find_climb,
    with_compliant_stages,
    with_compliant_wrists,
)
from planner.certification import check_bound
from planner.prepare import settle_each
from service import requests
from service.answering import SoughtClimb, climb_reply, climbs, route_of, seek_climb
from service.answering.climbs import _bodies_near, _Progress
from service.answering.questions import route_request
from service.climbs import verdict_sentences
from service.commands.stances import read_route
from service.replies import KnotReply, PartReply
from service.requests import ClimbEnd, ClimbRequest
from tests.suite.helpers.knob_walls import ends, knob_wall
from tests.suite.helpers.replies import departures

REQUEST = ClimbRequest(
    v=1,
    id="mine",
    name="up",
    rock="small-wall",
    start=ClimbEnd(height=0.0),
    goal=ClimbEnd(height=9.0),
    want=["trajectory", "certificate"],
)


@cache
def sought() -> SoughtClimb:
    """A climb on knobs of a slab, whose hands are where they have settled."""
    wall = knob_wall()
    outcomes = settle_each(wall.robot.hand, wall.places)
    places = tuple(
        replace(place, hold_pose=None, hold_in_hand=outcome.seating.pose)
        for place, outcome in zip(wall.places, outcomes, strict=True)
    )
    wall = replace(wall, places=places)
    first = tuple(range(0, len(places), 2))
    start, goal = ends(wall, [1], first), ends(wall, [len(wall.bodies) - 2])
    found = find_climb(wall, start, goal, name="up", within=0.5, seconds=60.0)
    made = MadeWall(
        wall=wall,
        tried=len(places),
        refused={},
        lost_trials=0,
        lost_places=0,
        in_rock=0,
        given=(),
        seconds={"placements": 1.0},
    )
    return SoughtClimb(found, made, places[0].hold, Pose.identity(), start, goal)


@pytest.mark.slow
def test_the_reply_is_what_was_found() -> None:
    found, reply = sought().found, climb_reply(REQUEST, sought())
    assert (reply.id, reply.name, reply.status) == ("mine", "up", found.status)
    assert found.status in ("found", "not_proven")
    assert reply.least == min(stage.load_factor for stage in reply.stages)
    assert reply.gap == pytest.approx(reply.bound / reply.least - 1.0)
    assert reply.deciding.load_factor == reply.least
    assert reply.stages[reply.deciding.stage].load_factor == reply.least
    assert reply.trajectory == [KnotReply.of(knot) for knot in found.climb.knots]
    assert reply.seconds["placements"] == 1.0
    assert departures("ClimbReply", msgspec.json.decode(msgspec.json.encode(reply))) == []


@pytest.mark.slow
def test_the_route_of_the_reply_has_the_stages_of_the_climb() -> None:
    reply = climb_reply(REQUEST, sought())
    rock = requests.EllipsoidMessage(semi_axes=tuple(sought().rock.semi_axes))
    stance = changed(reply.route.stance, rocks={"rock": rock})
    again = msgspec.json.decode(
        msgspec.json.encode(changed(reply.route, stance=stance)), type=requests.RouteRequest
    )
    result = evaluate(route_of(again), workers=1)
    assert len(result.stages) == len(reply.stages)
    for stage, plan, told in zip(result.stages, result.plans, reply.stages, strict=True):
        assert (stage.phase, stage.limb) == (told.phase, told.limb)
        assert plan.status == told.status


def test_nails_stay_fixed_where_other_wrists_give() -> None:
    route = route_of(read_route("knobs"))
    first, *others = route.start.hands
    nailed = replace(first, grasp=changed(first.grasp, fingernail=True))
    start = replace(route.start, hands=(nailed, *others))
    given = with_compliant_wrists(replace(route, start=start), WristTravel(angle=0.1))
    assert [hand.wrist for hand in given.start.hands] == ["fixed"] + ["compliant"] * 3
    assert {hand.wrist_travel for hand in given.start.hands[1:]} == {WristTravel(angle=0.1)}
    assert {move.hand.wrist for move in given.moves} == {"compliant"}


@pytest.mark.slow
def test_stages_are_planned_with_wrists_that_give_too() -> None:
    told: list[tuple[int, int]] = []
    travel = WristTravel(position=0.003)
    found = with_compliant_stages(sought().found, travel, lambda *part: told.append(part))
    reply = climb_reply(REQUEST, sought()._replace(found=found))
    count = len(reply.stages)
    assert told == [(k, count) for k in range(1, count + 1)]
    assert found.compliant is not None
    assert len(reply.stages_compliant) == count
    factors = [stage.load_factor for stage in reply.stages_compliant]
    assert reply.least_compliant == (None if None in factors else min(factors))
    for fixed, stage, plan in zip(
        sought().found.result.stages, found.compliant.stages, found.compliant.plans, strict=True
    ):
        assert {hand.wrist for hand in stage.question.stance.hands} == {"compliant"}
        assert {hand.wrist_travel for hand in stage.question.stance.hands} == {travel}
        # in the posture of the climb, not in one of its own
        assert stage.question.stance.joints == fixed.question.stance.joints
        assert plan.status != "failed", plan.reason
        assert plan.verified
    # the climb itself stays as it is
    assert (reply.least, reply.bound) == (found.least, found.bound)
    (said,) = (each for each in verdict_sentences(found, None) if "compliant" in each)
    held = sum(stage.status == "optimal" for stage in reply.stages_compliant)
    assert said.startswith(f"with compliant wrists {held} of {count} stages hold")
    route = route_request(REQUEST, found.compliant.route)
    assert {hand.wrist_travel for hand in route.stance.hands} == {travel}
    assert departures("ClimbReply", msgspec.json.decode(msgspec.json.encode(reply))) == []


@pytest.mark.slow
def test_a_deadline_leaves_the_climb_without_compliant_stages() -> None:
    with deadline.within(0.0):
        assert with_compliant_stages(sought().found) is sought().found


@pytest.mark.slow
def test_knots_come_move_by_move_where_parts_are_asked_for() -> None:
    parts: list[PartReply] = []
    reply = climb_reply(changed(REQUEST, parts=True), sought(), parts.append)
    assert reply.trajectory is msgspec.UNSET
    knots = [knot for part in parts for knot in part.knots]
    assert knots == climb_reply(REQUEST, sought()).trajectory
    moves = [{knot.move for knot in part.knots} for part in parts]
    assert moves == [{k} for k in range(len(moves))]


@pytest.mark.slow
def test_the_best_of_all_refined_searches_is_the_answer(monkeypatch) -> None:
    first, asked = sought(), []
    least = first.found.least
    assert least is not None
    # the second is worse, the third better, and after it a fourth as good
    factors = iter([least, 0.5 * least, 2.0 * least, 2.0 * least])

    def search(*given: object) -> SoughtClimb:
        asked.append(given[-2:])
        found = replace(first.found, status="not_proven", least=next(factors))
        return first._replace(found=found)

    monkeypatch.setattr(climbs, "_search", search)
    found = seek_climb(changed(REQUEST, refine=3))
    assert found.found.least == 2.0 * least
    assert [later for _, later in asked] == [3, 2, 1, 0]
    points = [len(source.more_points) for source, _ in asked]
    assert points[0] == 0 < points[1] < points[2] < points[3]


def test_a_climb_that_is_good_enough_is_not_refined(monkeypatch) -> None:
    first = sought()
    good = first._replace(found=replace(first.found, status="found"))
    monkeypatch.setattr(climbs, "_search", lambda *_: good)
    monkeypatch.setattr("planner.finer_about", None)
    assert seek_climb(changed(REQUEST, refine=3)) is good


@pytest.mark.slow
def test_where_a_coarse_grid_proves_that_there_is_no_climb_more_places_are_tried() -> None:
    coarse = changed(
        REQUEST,
        start=ClimbEnd(height=0.8),
        goal=ClimbEnd(height=1.0),
        places=PlaceGrid(spacing=0.3),
        bodies=BodyGrid(spacing=0.3, stand_offs=(0.6,)),
        time=120.0,
    )
    found, finer = seek_climb(coarse), seek_climb(changed(coarse, refine=1))
    assert found.found.status == finer.found.status == "none"
    assert len(finer.made.wall.places) > len(found.made.wall.places)
    assert len(finer.made.wall.bodies) > len(found.made.wall.bodies)
    # the proof is about all of them
    proof = climb_certificate(finer.made.wall, finer.start, finer.goal, finer.found.found)
    assert check_bound(proof).proven


def test_an_end_is_the_bodies_that_it_names() -> None:
    origins = np.array([[0.0, y, z] for y in (0.0, 0.5) for z in (1.0, 2.0, 3.0)])

    def found(name: str, **end: object) -> list[int]:
        return np.flatnonzero(_bodies_near(name, ClimbEnd(**end), origins)).tolist()

    assert found("start", height=2.0) == [0, 1, 3, 4]
    assert found("goal", height=2.0) == [1, 2, 4, 5]
    assert found("goal", near=(0.0, 0.2, 3.0)) == [2, 5]
    assert found("goal", near=(0.0, 0.2, 3.0), radius=0.25) == [2]
    for name, end, words in (
        ("start", {"height": 0.5}, r"at most so high; the lowest is 1.00 m high, got 0.5 m"),
        ("goal", {"height": 3.5}, r"at least so high; the highest is 3.00 m high, got 3.5 m"),
        ("goal", {"near": (0.0, 0.0, 4.0)}, r"within 0.3 m; the nearest is 1.00 m away"),
    ):
        with pytest.raises(InvalidInputError, match=words) as caught:
            found(name, **end)
        assert caught.value.field == f"{name}.{next(iter(end))}"


def test_ends_are_checked_before_the_wall_is_made() -> None:
    def make(*_: object) -> MadeWall:
        raise AssertionError

    with pytest.raises(InvalidInputError, match="no pose of the body is at most so high") as caught:
        seek_climb(REQUEST, make=make)
    assert caught.value.field == "start.height"


def test_progress_is_told_five_times_a_second_unless_it_is_new(monkeypatch) -> None:
    clock, told = [0.0], []
    monkeypatch.setattr("service.answering.climbs.time.perf_counter", lambda: clock[0])
    progress = _Progress("mine", lambda part: told.append(part.progress))
    for step in range(10):
        clock[0] = 0.05 * step
        progress.wall("placements", step, 10)
    assert [each.done for each in told] == [0, 4, 8]
    progress.wall("reach", 0, 1)
    assert (told[-1].phase, told[-1].gap) == ("reach", None)
    monkeypatch.undo()
