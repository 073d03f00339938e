"""Hands whose tiles have slipped, on all kinds of rock, against the check's balance of joints."""

from collections import Counter

import numpy as np
import pytest

from hand_models.base import InvalidInputError
from hand_models.fixed_wrist import slipped_hand, wrench_space
from hand_models.hand import SettledHand
from planner.prepare import HandBatch
from planner.verification.joint_balance import JointBalance
from planner.verification.residuals import PartNames
from tests.suite.helpers.hands import HAND, pinch, settled_at
from tests.suite.helpers.moved_hands import random_placement


def closed(seed: int) -> SettledHand | None:
    """A hand on smooth rock, or on rough rock or a mesh, with all contact states."""
    if seed % 2:
        return settled_at(seed)
    placement, _ = random_placement(seed)
    (hand,) = HAND.settle_each([placement])
    return None if isinstance(hand, InvalidInputError) else hand


def slips(hand: SettledHand, seed: int) -> list[int]:
    chance, on = np.random.default_rng(seed), np.flatnonzero(hand.touching)
    count = min(len(on), int(chance.integers(1, 4)))
    return chance.choice(on, count, replace=False).tolist()


@pytest.mark.parametrize(
    "first", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(20, 80, 20))]
)
def test_loads_are_those_of_the_balance_of_the_joints(first: int):
    states: Counter[str] = Counter()
    for seed in range(first, first + 20):
        hand = closed(seed)
        if hand is None or not hand.touching.any():
            continue
        slipped = slipped_hand(hand, slips(hand, seed))
        batch = HandBatch.of([slipped])
        balance = JointBalance(PartNames(("front_left",), batch))
        tensions = np.random.default_rng(seed).uniform(20.0, 200.0, 4)
        loads, left = balance.loads(tensions, np.zeros(len(hand.tiles)))
        own = slipped.tile_loads(tensions)
        assert own[:, :2] == pytest.approx(loads[:, :2], abs=1e-9 * max(1.0, np.abs(own).max()))
        for finger, joint, torque in slipped.stops:
            if torque.any():
                rows = zip(balance.stop_fingers, balance.stop_joints, strict=True)
                at = list(rows).index((finger, joint))
                expected = torque @ [1.0, tensions[finger]]
                assert balance.stops(left)[at] == pytest.approx(expected, abs=1e-9)
        states.update(tile.contact for tile in slipped.tiles)
    assert states["slipped"] > 10
    assert states["none"] > 0


def test_a_set_has_the_rows_of_the_hand_as_it_closed():
    for seed in range(12):
        hand = closed(seed)
        if hand is None or not hand.touching.any():
            continue
        tiles = slips(hand, seed)
        slipped = slipped_hand(hand, tiles)
        before, after = wrench_space(hand), wrench_space(slipped)
        assert after.rows == before.rows
        assert after.columns == before.columns
        y = np.random.default_rng(seed).uniform(0.0, 60.0, len(before.columns))
        used = after.utilisations(y)
        lost = {hand.tiles[t][:2] for t in tiles}
        for row, each in zip(after.rows, used, strict=False):
            if (row.finger, row.phalanx) in lost and row.limit in ("shear", "pull_off"):
                assert each == 0.0
        laterals = [f"{name}/lateral" for name in ("outer_left", "inner_left")]
        y[[i for i, name in enumerate(after.columns) if name in laterals]] = 0.0
        palm = slipped.palm.engaged
        loads = slipped.tile_loads(
            y[:4],
            np.array(
                [
                    y[after.columns.index(f"{f}/lateral")] if f"{f}/lateral" in after.columns else 0
                    for f in ("outer_left", "inner_left", "inner_right", "outer_right")
                ]
            ),
        )
        force = np.einsum("tk,tkx->x", loads, slipped.axes)
        if palm:
            force += [-y[-2], 0.0, y[-1]]
        assert after.wrench(y)[:3] == pytest.approx(force, abs=1e-9 * max(1.0, np.abs(force).max()))


def test_a_tile_that_slips_must_be_pressed():
    """Of a laid finger the hard row of a slipped tile is N >= 0, where friction alone is."""
    hand = pinch()
    tile = next(t for t, each in enumerate(hand.tiles) if each[:2] == ("inner_left", "middle"))
    slipped = slipped_hand(hand, [tile])
    space = wrench_space(slipped)
    hard = [row.label for row in space.rows[len(space.s) :]]
    row = hard.index("inner_left/middle/dragged_backwards")
    least = space.h[row] / space.H[row, 1]
    at_zero, per_newton = slipped.loads[tile, 1]
    assert least == pytest.approx(-at_zero / per_newton)
    assert per_newton > 0.0
