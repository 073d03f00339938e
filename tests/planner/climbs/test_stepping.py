"""Climbs that are found step by step, with joint angles before their moves are planned."""

from __future__ import annotations

import json
from itertools import pairwise

import numpy as np
import pytest

from planner import DeadlineError, deadline
from planner.climbs import ClimbStep, MoveChecks, Stepping
from planner.route import Failure
from planner.search import SearchMemory, search
from service.commands.cli import run_command_line
from tests.suite.helpers.knob_walls import ends, factor, knob_wall, neighbours

LEAST = 1.0


def stepping(first, last):
    """A search between two ends, after one for states alone."""
    wall, memory = knob_wall(), SearchMemory()
    search(wall, first, last, floor=LEAST, within=1.0, memory=memory)
    return Stepping(MoveChecks(wall), (first, last), memory, LEAST)


@pytest.mark.parametrize(
    ("first", "last"),
    [
        (([0, 1, 2], None), ([6, 7, 8], None)),
        pytest.param(([1], (0, 2, 4, 6)), ([7], (1, 2, 5, 6)), marks=pytest.mark.slow),
    ],
)
def test_each_state_holds_and_hands_are_where_joints_put_them(first, last):
    wall = knob_wall()
    start, goal = ends(wall, *first), ends(wall, *last)
    found = stepping(start, goal).find()
    states, postures = found.states, found.postures
    assert start.bodies[states[0].body]
    assert goal.bodies[states[-1].body]
    assert start.members in (None, states[0].members)
    assert goal.members in (None, states[-1].members)
    for before, after in pairwise(states):
        assert after in neighbours(wall, before)
    assert min(factor(wall, state) for state in states) >= LEAST * (1.0 - 1e-9)
    for each in postures:
        angles = dict(zip(wall.robot.limbs, each.angles, strict=True))
        hands = wall.robot.hand_poses(angles)
        for limb, place in zip(wall.robot.limbs, each.state.members, strict=True):
            pose = wall.bodies[each.state.body] @ hands[limb]
            wanted = wall.places[place].pose
            np.testing.assert_allclose(pose.position, wanted.position, atol=1e-6)
            np.testing.assert_allclose(pose.rotation, wanted.rotation, atol=1e-5)
    for before, after in pairwise(postures):
        kept = [i for i in range(4) if i != after.limb and after.limb >= 0]
        assert all(before.angles[i] is after.angles[i] for i in kept)
    moved = [each for each in postures if each.limb >= 0]
    assert len(ClimbStep.each(states)) >= len(moved) == len(found.choice.placed)


def test_a_step_that_has_no_plan_is_not_taken_again():
    wall = knob_wall()
    steps = stepping(ends(wall, [1], (0, 2, 4, 6)), ends(wall, [1], (0, 2, 4, 7)))
    found = steps.find()
    taken = {each.step for each in found.postures}
    steps.refuse(found, Failure(1, "swing", "front_left", "no way was found"))
    again = steps.find()
    refused = next(each.step for each in found.postures if each.limb >= 0)
    assert refused in taken
    assert again is None or refused not in {each.step for each in again.postures}


def test_the_search_ends_with_its_time():
    wall = knob_wall()
    steps = stepping(ends(wall, [1]), ends(wall, [7]))
    with deadline.within(0.0), pytest.raises(DeadlineError):
        steps.find()


@pytest.mark.slow
def test_from_height_to_height_a_climb_of_moves_comes_out(tmp_path):
    between = ["--from", "height:0.86", "--to", "height:1.0", "--at-least", "1", "--time", "500"]
    grids = ["--spacing", "0.25", "--body-spacing", "0.2", "--stand-off", "0.65"]
    done = run_command_line(["climb", "knob-wall", *between, *grids, "-q", "-o", str(tmp_path)])
    assert done == 0
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["feasible"]
    assert summary["climb"]["failure"] is None
    knots = [json.loads(line) for line in (tmp_path / "trajectory.jsonl").open()]
    assert len(knots) == summary["climb"]["knots"] > 20
    assert all(knot["verified"] for knot in knots)
    assert knots[0]["body"]["position"][2] <= 0.86
    assert knots[-1]["body"]["position"][2] >= 1.0
