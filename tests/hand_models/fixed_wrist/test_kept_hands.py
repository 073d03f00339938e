"""Closed hands in a file: the same hands, which are not closed again."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hand_models import Cylinder, Grasp, InvalidInputError, Pose, SettledHand, SpinyHand, Surface
from hand_models.base import UnsupportedError
from hand_models.fixed_wrist import (
    ClosedPlacement,
    approach_frame,
    read_hands,
    wrench_space,
    write_hands,
)
from hand_models.hand import Placement, spinyhand
from hand_models.rock import Mesh
from tests.suite.helpers.hands import HAND, ROCK, changed_hand
from tests.suite.helpers.rocks import fractal_wall


def wall(seed: int = 3) -> Mesh:
    return Mesh(*fractal_wall(seed, size=0.5, count=101), anywhere=True)


def closed_on(rock: Mesh) -> list[ClosedPlacement]:
    """Hands that were seated at their hold's frame, at a place, and put at a pose."""
    at = approach_frame([0.02, -0.03, 0.0], [0.05, 0.0, 1.0])
    first = HAND.settle(rock, ROCK, Grasp(math.pi))
    placements = [
        Placement(rock, ROCK, Grasp(math.pi), None),
        Placement(rock, ROCK, Grasp(0.0, lateral=False, closing_tension=30.0), None, at),
        Placement(rock, ROCK, Grasp(math.pi, palm=False), first.seating.pose),
    ]
    hands = HAND.settle_each(placements)
    assert all(isinstance(each, SettledHand) for each in hands)
    return [ClosedPlacement(*each) for each in zip(placements, hands, strict=True)]


def test_hands_that_were_read_are_those_that_were_written(tmp_path, monkeypatch):
    rock = wall()
    closed = closed_on(rock)
    write_hands(closed, tmp_path / "hands.npz")
    again, kind = wall(), SpinyHand(HAND.table)
    monkeypatch.setattr(spinyhand, "settle_hands", None)
    found = read_hands(tmp_path / "hands.npz", again, ROCK, kind)
    for (placement, want), (there, got) in zip(closed, found, strict=True):
        assert there.hold is again
        assert there.grasp == placement.grasp
        assert got.tiles == want.tiles
        assert got.closures == want.closures
        assert got.closing_tension == want.closing_tension
        for name in ("positions", "axes", "loads", "engagement", "finger_of", "nail_angles"):
            np.testing.assert_array_equal(getattr(got, name), getattr(want, name))
            assert not getattr(got, name).flags.writeable
        for one, other in zip(got.postures, want.postures, strict=True):
            np.testing.assert_array_equal(one, other)
        for one, other in zip(got.palm, want.palm, strict=True):
            np.testing.assert_array_equal(one, other)
        assert [stop[:2] for stop in got.stops] == [stop[:2] for stop in want.stops]
        for way in np.eye(6):
            assert wrench_space(got).support(way) == wrench_space(want).support(way)
        # it is not closed again, which would fail here
        assert kind.settle_each([there])[0] is got


def test_a_stance_takes_hands_that_were_read(tmp_path, monkeypatch):
    rock = wall()
    placement, want = closed_on(rock)[1]
    write_hands([ClosedPlacement(placement, want)], tmp_path / "hands.npz")
    kind = SpinyHand(HAND.table)
    ((there, got),) = read_hands(tmp_path / "hands.npz", rock, ROCK, kind)
    monkeypatch.setattr(spinyhand, "settle_hands", None)
    assert kind.settle(rock, ROCK, there.grasp, None, there.at) is got


@pytest.mark.parametrize(
    ("which", "rock", "surface", "hand"),
    [
        ("rock", wall(4), ROCK, HAND),
        ("surface", wall(), Surface.named("concrete-fine"), HAND),
        ("hand", wall(), ROCK, changed_hand("tile", "spine_travel", 0.004)),
    ],
    ids=["rock", "surface", "hand"],
)
def test_hands_on_another_rock_or_of_another_hand_are_refused(tmp_path, which, rock, surface, hand):
    write_hands(closed_on(wall())[:1], tmp_path / "hands.npz")
    with pytest.raises(InvalidInputError, match=f"another {which}: close") as caught:
        read_hands(tmp_path / "hands.npz", rock, surface, hand)
    assert caught.value.field == "file"


def test_what_is_no_file_of_closed_hands_is_refused(tmp_path):
    path = tmp_path / "hands.npz"
    path.write_text("tiles")
    with pytest.raises(InvalidInputError) as caught:
        read_hands(path, wall(), ROCK, HAND)
    assert caught.value.field == "file"
    np.savez(path, a=np.zeros(3))
    with pytest.raises(InvalidInputError, match="not a file of closed hands"):
        read_hands(path, wall(), ROCK, HAND)


def test_what_cannot_be_written_is_refused(tmp_path):
    path = tmp_path / "hands.npz"
    with pytest.raises(InvalidInputError, match="at least one"):
        write_hands([], path)
    two = [closed_on(wall())[0], closed_on(wall())[0]]
    with pytest.raises(InvalidInputError, match="one rock"):
        write_hands(two, path)
    log = Placement(Cylinder(0.3), ROCK, Grasp(), Pose.identity())
    with pytest.raises(UnsupportedError):
        write_hands([ClosedPlacement(log, HAND.settle(*log[:4]))], path)
    assert not path.exists()
