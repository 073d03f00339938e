"""What a stance can lose: as many losses as parts, each the plan without it, and its picture."""

from dataclasses import replace
from pathlib import Path

import pytest

from planner import DeadlineError, deadline
from planner.pictures import plot_redundancy
from planner.prepare import prepare_stance
from planner.question import LostTile
from planner.recovery import Recovery, find_redundancy
from planner.result import Redundancy
from service.answering.questions import question
from service.commands.stances import read_request


@pytest.fixture(scope="module")
def redundancy() -> Redundancy:
    return find_redundancy(question(read_request("wall-300")))


def test_each_tile_finger_and_hand_is_lost_once(redundancy: Redundancy):
    names = [(loss.limb, loss.finger, loss.phalanx) for loss in redundancy.losses]
    assert len(set(names)) == len(names) == 56 + 16 + 4
    assert {kind: count for kind, (_, count) in redundancy.held.items()} == {
        "tile": 56,
        "finger": 16,
        "hand": 4,
    }
    assert all(loss.verified for loss in redundancy.losses)
    for kind, (held, _) in redundancy.held.items():
        own = [loss for loss in redundancy.losses if loss.kind == kind]
        assert held == sum(loss.utilisation <= 1.0 + 1e-6 for loss in own)
        most = max(loss.utilisation for loss in own)
        assert redundancy.worst[kind].utilisation == pytest.approx(most, abs=1e-4)


def test_losses_are_the_plans_without_them(redundancy: Redundancy):
    recovery = Recovery(prepare_stance(question(read_request("wall-300"))))
    for loss in redundancy.losses[::13]:
        if loss.kind == "tile":
            found = recovery.plan([LostTile(loss.limb, loss.finger, loss.phalanx)])
        elif loss.kind == "finger":
            found = recovery.plan((), released=[(loss.limb, loss.finger)])
        else:
            found = recovery.plan((), off=[loss.limb])
        assert loss.utilisation == pytest.approx(found.utilisation, abs=1e-5)
        assert loss.holds == found.holds


def test_all_tiles_of_a_finger_are_the_finger(redundancy: Redundancy):
    recovery = Recovery(prepare_stance(question(read_request("wall-300"))))
    own = [t for t in recovery.tiles if (t.limb, t.finger) == ("rear_left", "inner_left")]
    (loss,) = [
        each
        for each in redundancy.losses
        if (each.kind, each.limb, each.finger) == ("finger", "rear_left", "inner_left")
    ]
    assert recovery.plan(own).utilisation == pytest.approx(loss.utilisation, abs=1e-5)


def test_a_hand_costs_more_than_its_worst_finger_and_a_lighter_robot_loses_more(
    redundancy: Redundancy,
):
    worst = redundancy.worst
    assert worst["hand"].utilisation > worst["finger"].utilisation > redundancy.utilisation
    asked = question(read_request("wall-300"))
    wrench = 0.5 * prepare_stance(asked).wrench
    lighter = find_redundancy(replace(asked, load=None, body_wrench=wrench))
    for kind, (held, _) in redundancy.held.items():
        assert lighter.held[kind][0] >= held
    assert lighter.held["tile"] == [56, 56]


def test_the_deadline_ends_it():
    asked = question(read_request("wall-300"))
    with deadline.within(1e-6), pytest.raises(DeadlineError):
        find_redundancy(asked)


def test_its_picture(redundancy: Redundancy, tmp_path: Path):
    for name in ("redundancy.png", "redundancy.svg"):
        plot_redundancy(redundancy, tmp_path / name, "wall-300")
        assert (tmp_path / name).stat().st_size > 10_000
