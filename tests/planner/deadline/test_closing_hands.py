"""Hands that close on rock are broken off where the time of who asked is over."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hand_models.base import Pose, broken_off_by, go_on
from hand_models.fixed_wrist import best_seats
from hand_models.hand import Placement, SpinyHand
from hand_models.hand.placement import PlacedHands
from hand_models.rock import Mesh, Sphere
from hand_models.sections import FingerRock
from planner import deadline
from planner.deadline import DeadlineError
from planner.solving import plan
from tests.suite.helpers.hands import HAND, PINCH, ROCK
from tests.suite.helpers.rocks import fractal_wall
from tests.suite.helpers.stances import ask, on_wall


@pytest.fixture(scope="module")
def wall() -> Mesh:
    return Mesh(*fractal_wall(0, size=0.6, count=121, height=0.01))


class EnoughError(Exception):
    """Whoever asked has had enough."""


def test_closing_is_broken_off_and_begun_again(wall: Mesh) -> None:
    hand = SpinyHand(HAND.table)
    calls = 0

    def check() -> None:
        nonlocal calls
        calls += 1
        if calls == 20:
            raise EnoughError

    with broken_off_by(check), pytest.raises(EnoughError):
        hand.settle(wall, ROCK, PINCH)
    assert calls == 20
    assert hand.settled.info().kept == 0
    go_on()
    whole = hand.settle(wall, ROCK, PINCH)
    again = SpinyHand(HAND.table).settle(wall, ROCK, PINCH)
    np.testing.assert_array_equal(whole.positions, again.positions)


def test_no_two_fingers_are_laid_on_rock_without_a_look_at_the_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    hand, ball, rocks = SpinyHand(HAND.table), Sphere(0.4), []
    cut = PlacedHands.rock

    def counted(placed: PlacedHands, i: int, finger: int) -> FingerRock:
        rocks.append(1)
        return cut(placed, i, finger)

    monkeypatch.setattr(PlacedHands, "rock", counted)
    turned = Rotation.from_euler("xyz", [[0.01 * k, 0.02, 0.3] for k in range(6)]).as_matrix()
    poses = [Pose(np.array([0.01, 0.0, 0.03]), turn) for turn in turned]
    between: list[int] = []

    def check() -> None:
        between.append(len(rocks))
        rocks.clear()

    with broken_off_by(check):
        hand.settle_each([Placement(ball, ROCK, PINCH, pose) for pose in poses])
    assert sum(between) + len(rocks) >= len(poses)
    assert max(between) <= 1


def test_what_is_asked_inside_counts_inside_alone() -> None:
    with broken_off_by(pytest.fail):
        with broken_off_by(None):
            go_on()
        with pytest.raises(pytest.fail.Exception):
            go_on()
    go_on()


def test_the_best_seat_is_not_looked_for_beyond_a_deadline(wall: Mesh) -> None:
    """Three hundred hands on a scan take longer than a hundredth of a second on any machine."""
    placements = [Placement(wall, ROCK, PINCH, None)]
    with deadline.within(0.01), pytest.raises(DeadlineError, match="hands were closed"):
        best_seats(SpinyHand(HAND.table), placements)


@pytest.mark.slow
def test_what_is_robust_is_left_out_where_there_is_no_time_for_all_draws(wall: Mesh) -> None:
    asked = ask(on_wall(wall, outer_rotation=0.0), "robust")
    # the plan itself is quick then
    known = plan(replace(asked, want=frozenset()))
    found = plan(replace(asked, deadline=1.0))
    assert found.robust is None
    assert "robust" in found.unfinished
    assert found.status == known.status
    assert found.utilisation == pytest.approx(known.utilisation)
