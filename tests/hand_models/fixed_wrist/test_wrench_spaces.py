"""Sets of many hands, worked out together, against the formulas summed tile by tile."""

from __future__ import annotations

import gc
import math
import weakref
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hand_models import (
    FINGERS,
    Cylinder,
    Grasp,
    InvalidInputError,
    Plane,
    Pose,
    Profile,
    SettledHand,
    Surface,
    WrenchSpace,
)
from hand_models.fixed_wrist import wrench_space, wrench_spaces
from hand_models.hand import HELD_DIRECTIONS
from hand_models.tile import inner_half_planes
from tests.suite.helpers.hands import HAND, PINCH, ROCK, changed_hand, pinch, settled_at

Row = tuple[dict[str, float], float, float]
"""Coefficients by column, and of a limit l0 and s, of a hard row zero and h."""


def moment(place: np.ndarray, force: np.ndarray) -> list[float]:
    (x, y, z), (a, b, c) = place, force
    return [y * c - z * b, z * a - x * c, x * b - y * a]


def wrench_of(place: np.ndarray, force: np.ndarray) -> np.ndarray:
    return np.array([*force, *moment(place, force)])


class ByHand:
    """A settled hand's set: its columns and rows by name, each from its own formula."""

    def __init__(self, settled: SettledHand, cap: float) -> None:
        self.settled = settled
        self.origin = np.zeros(6)
        self.columns = {f"{finger}/tension": np.zeros(6) for finger in FINGERS}
        self.limits: dict[str, Row] = {}
        self.hard: dict[str, Row] = {}
        self.shares = dict.fromkeys(FINGERS, 0.0)
        for tile, share in zip(settled.tiles, settled.engagement, strict=True):
            self.shares[tile.finger] += share
            assert (share > 0.0) == (tile.contact in ("face", "edge"))
        for t in range(len(settled.tiles)):
            self.add_tile(t)
        self.add_tendons(min(cap, settled.hand.maximum_tension))
        self.add_structure()
        self.add_stops_and_nails()
        if settled.palm.engaged:
            self.add_palm()
        self.add_hand_load()

    def add_tile(self, t: int) -> None:
        settled = self.settled
        (finger, phalanx, contact), place, axes = (
            settled.tiles[t],
            settled.positions[t],
            settled.axes[t],
        )
        (shear, more_shear), (normal, more_normal) = settled.loads[t].tolist()
        tension, lateral = f"{finger}/tension", f"{finger}/lateral"
        self.origin = self.origin + wrench_of(place, shear * axes[0] + normal * axes[1])
        self.columns[tension] += wrench_of(place, more_shear * axes[0] + more_normal * axes[1])
        if contact == "frame":
            self.hard[f"{finger}/{phalanx}/frame_pulled"] = {tension: -more_normal}, 0.0, normal
        if contact not in ("face", "edge"):
            return
        friction, pressed = settled.surface.friction, (normal, more_normal)
        if phalanx == "base":
            pressed = settled.engagement[t] * settled.loads[t + 1, 1]
        self.hard[f"{finger}/{phalanx}/dragged_backwards"] = (
            {tension: -more_shear - friction * pressed[1]},
            0.0,
            shear + friction * pressed[0] + settled.drag_allowances[t],
        )
        engagement = settled.engagement[t]
        share = engagement / self.shares[finger]
        if settled.grasp.lateral:
            self.columns.setdefault(lateral, np.zeros(6))
            self.columns[lateral] += wrench_of(place, share * axes[2])
        pulls = 0
        for piece in inner_half_planes(settled.surface):
            pulls += piece.limit == "pull_off"
            name = f"{finger}/{phalanx}/{piece.limit}" + (f"_{pulls}" if pulls > 1 else "")
            row = {tension: piece.a_shear * more_shear + piece.a_normal * more_normal}
            at_zero = piece.a_shear * shear + piece.a_normal * normal
            signs = (("+", 1.0), ("-", -1.0)) if settled.grasp.lateral else (("", 0.0),)
            for sign, factor in signs:
                sideways = {lateral: factor * piece.a_lateral * share} if sign else {}
                self.limits[name + sign] = (
                    row | sideways,
                    at_zero,
                    settled.limit_shares[t] * piece.capacity,
                )

    def add_tendons(self, most: float) -> None:
        drive = self.settled.hand.drive
        for finger in FINGERS:
            own = f"{finger}/tension"
            self.limits[f"{finger}/tendon_tension"] = {own: 1.0}, 0.0, most
            self.limits[f"{finger}/motor_torque"] = (
                {own: drive.torque_per_newton},
                0.0,
                drive.maximum_torque,
            )
            self.limits[f"{finger}/motor_current"] = (
                {own: drive.current_per_newton},
                drive.no_load_current,
                drive.maximum_current,
            )
            self.hard[f"{finger}/slack_tendon"] = {own: -1.0}, 0.0, 0.0

    def add_structure(self) -> None:
        settled, structure = self.settled, self.settled.hand.structure
        for i, finger in enumerate(FINGERS):
            own = f"{finger}/tension"
            mine = [t for t in range(len(settled.tiles)) if settled.finger_of[t] == i]
            if self.shares[finger]:
                self.limits[f"{finger}/finger_shear"] = (
                    {own: sum(settled.loads[t, 0, 1] for t in mine)},
                    sum(settled.loads[t, 0, 0] for t in mine),
                    structure.finger_shear,
                )
                if settled.grasp.lateral:
                    for sign, factor in (("+", 1.0), ("-", -1.0)):
                        self.limits[f"{finger}/finger_lateral{sign}"] = (
                            {f"{finger}/lateral": factor},
                            0.0,
                            settled.surface.lateral_limit * self.shares[finger],
                        )
            for t in mine:
                if settled.tiles[t].phalanx == "distal" and settled.tiles[t].contact != "none":
                    at_zero, slope = settled.loads[t, 1].tolist()
                    limit = {own: slope}, at_zero, structure.fingertip_force
                    self.limits[f"{finger}/distal/fingertip_force"] = limit

    def add_stops_and_nails(self) -> None:
        settled = self.settled
        for i, joint, torque in settled.stops:
            name = f"{FINGERS[i]}/{('proximal', 'middle', 'distal')[joint]}/joint_stop"
            scale = max(abs(torque[1]), 1e-6)
            self.hard[name] = {f"{FINGERS[i]}/tension": -torque[1] / scale}, 0.0, torque[0] / scale
        nails = [t for t, tile in enumerate(settled.tiles) if tile.contact == "nail"]
        for t, (H, h) in zip(nails, settled.nail_rows, strict=True):
            finger = settled.tiles[t].finger
            own, along = f"{finger}/tension", f"{finger}/nail"
            self.columns[along] = wrench_of(settled.positions[t], settled.axes[t, 0])
            at_zero, slope = settled.loads[t, 1].tolist()
            for limit in settled.nail_limits(t):
                self.limits[f"{finger}/nail/{limit.limit}"] = (
                    {own: limit.a_normal * slope, along: limit.a_shear},
                    limit.a_normal * at_zero,
                    limit.capacity,
                )
            names = [f"{finger}/nail/nail_{name}" for name in ("lifts", "slips+", "slips-")]
            names += [f"{finger}/{link}/joint_stop" for link in ("proximal", "middle", "distal")]
            for name, row, most in zip(names, H.tolist(), h.tolist(), strict=True):
                self.hard[name] = dict(zip((own, along), row, strict=True)), 0.0, most
        if settled.hand.finger.friction > 0.0:
            drawing = {settled.tiles[t].finger for t in nails}
            drawing |= {finger for finger, count in self.shares.items() if count}
            for finger in drawing:
                sticks = {f"{finger}/tension": -1.0}, 0.0, -settled.closing_tension
                self.hard[f"{finger}/tendon_sticks"] = sticks

    def add_palm(self) -> None:
        palm = self.settled.palm
        for name, force, most in (
            ("palm_shear", np.array([-1.0, 0.0, 0.0]), palm.shear_limit),
            ("palm_pressing", np.array([0.0, 0.0, 1.0]), palm.pressing_limit),
        ):
            self.columns[name] = wrench_of(palm.centre, force)
            self.limits[name] = {name: 1.0}, 0.0, most
            self.hard[f"{name}_reversed"] = {name: -1.0}, 0.0, 0.0

    def add_hand_load(self) -> None:
        for k, direction in enumerate(HELD_DIRECTIONS):
            self.limits[f"hand_load/{k + 1}"] = (
                {name: direction @ wrench[:3] for name, wrench in self.columns.items()},
                direction @ self.origin[:3],
                self.settled.hand.structure.hand_load,
            )

    def check(self, space: WrenchSpace) -> None:
        assert set(space.columns) == set(self.columns)
        kinds = [row.kind for row in space.rows]
        assert kinds == ["limit"] * len(space.s) + ["hard"] * len(space.h)
        agree(space.origin, self.origin)
        for name, generator in zip(space.columns, space.generators.T, strict=True):
            agree(generator, self.columns[name])
        for kind, found, A, b, s in (
            ("limit", self.limits, space.L, space.l0, space.s),
            ("hard", self.hard, space.H, np.zeros(len(space.h)), space.h),
        ):
            # twists are worked out by hand elsewhere
            kept = [row.limit != "finger_twist" for row in space.rows if row.kind == kind]
            A, b, s = A[kept], b[kept], s[kept]
            rows = [row for row in space.rows if row.kind == kind and row.limit != "finger_twist"]
            assert {row.label for row in rows} == set(found)
            assert len(rows) == len(b) == len(s)
            for row, slopes, at_zero, end in zip(rows, A, b, s, strict=True):
                own = found[row.label]
                agree(slopes, [own[0].get(name, 0.0) for name in space.columns])
                agree([at_zero, end], own[1:])


def agree(found, expected) -> None:
    size = max(1.0, float(np.abs(expected).max(initial=0.0)))
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12 * size)


random_hand = cache(settled_at)


def first(trait: Callable[[SettledHand], bool], seed: int = 0) -> SettledHand:
    """Return the first of the random hands from a seed on with a trait."""
    hands = (hand for hand in map(random_hand, range(seed, 300)) if hand is not None)
    return next(hand for hand in hands if trait(hand))


@cache
def odd_hands() -> tuple[SettledHand, ...]:
    """Nails that hook, all and some; friction; stops; frames; no palm; nothing on rock at all."""
    step = Profile([[-0.3, 0.0], [0.0, 0.0], [0.0, 0.02], [0.3, 0.02]])
    sliding = changed_hand("tendon", "friction", 0.1)
    nails = [
        hand.settle(step, ROCK, Grasp(turn, fingernail=True), Pose(np.array([x, 0, z]), np.eye(3)))
        for hand, turn, x, z in (
            (HAND, 0.0, 0.193, 0.006),
            (sliding, 0.0, 0.197, 0.006),
            (HAND, 0.4, 0.186, 0.006),
            (HAND, 0.0, 0.3, 0.009),
        )
    ]
    away = Pose(np.array([0.0, 0.0, 0.3]), np.eye(3))
    return (
        *nails,
        sliding.settle(Cylinder(0.3), Surface.named("sandpaper-36"), PINCH),
        first(lambda hand: bool(hand.stops), 142),
        first(lambda hand: any(tile.contact == "frame" for tile in hand.tiles)),
        HAND.settle(Plane(), ROCK, Grasp(fingernail=True)),
        HAND.settle(Plane(), ROCK, Grasp(palm=False, lateral=False)),
        HAND.settle(Plane(), ROCK, Grasp(), away),
    )


def test_the_odd_hands_are_odd():
    hands = odd_hands()
    kinds = [{tile.contact for tile in hand.tiles} for hand in hands]
    hooked = [sum(tile.contact == "nail" for tile in hand.tiles) for hand in hands]
    assert {0, 4} <= set(hooked)
    assert any(0 < count < 4 for count in hooked)
    assert any("frame" in kind for kind in kinds)
    assert any(hand.stops for hand in hands)
    assert kinds[-1] == {"none"}
    assert any(hand.palm.engaged and hand.nail_rows for hand in hands)


last_seeds = pytest.mark.parametrize("last", [5, pytest.param(60, marks=pytest.mark.slow)])


def drawn_hands(data: st.DataObject, fewest: int, last: int) -> list[SettledHand]:
    """Up to five random hands of seeds up to the last."""
    seeds = data.draw(st.lists(st.integers(0, last), min_size=fewest, max_size=5))
    return [hand for hand in map(random_hand, seeds) if hand is not None]


@last_seeds
@given(
    data=st.data(),
    odd=st.lists(st.integers(0, 9), max_size=2),
    cap=st.one_of(st.none(), st.floats(1.0, 1e3)),
)
def test_every_number_is_that_of_its_formula(last, data, odd, cap):
    hands = drawn_hands(data, 1, last)
    hands += [odd_hands()[i] for i in odd]
    spaces = wrench_spaces(hands, cap)
    assert len(spaces) == len(hands)
    for hand, space in zip(hands, spaces, strict=True):
        ByHand(hand, math.inf if cap is None else cap).check(space)


def test_odd_hands_by_themselves():
    for hand in odd_hands():
        ByHand(hand, 60.0).check(wrench_space(hand, 60.0))


def test_a_set_is_known_again_while_its_hand_is():
    # copies, which nobody else has
    one, other = replace(pinch(0.31)), replace(pinch(0.32))
    spaces = wrench_spaces([one, other, one], 50.0)
    assert spaces[0] is spaces[2]
    assert spaces[0] is wrench_spaces([one], 50.0)[0]
    assert spaces[1] is not spaces[0]
    # above the hand's own maximum a cap is none
    assert wrench_spaces([one]) == wrench_spaces([one], 1e4)
    assert wrench_spaces([one])[0] is not spaces[0]
    # by itself it has the same arrays, and keeps its own vertices
    assert wrench_space(one, 50.0) is not spaces[0]
    assert wrench_space(one, 50.0).L is spaces[0].L
    gone = weakref.ref(spaces[1])
    del spaces, other
    gc.collect()
    assert gone() is None


def test_few_sets_of_a_hand_are_kept():
    hand = pinch(0.33)
    most = hand.sets.most
    sets = [wrench_spaces([hand], 50.0 + i)[0] for i in range(most + 1)]
    assert hand.sets.info().kept == most
    assert wrench_spaces([hand], 50.0 + most)[0] is sets[-1]
    again = wrench_spaces([hand], 50.0)[0]
    assert again is not sets[0]
    np.testing.assert_array_equal(again.b, sets[0].b)


def test_nobody_changes_a_kept_set():
    space = wrench_space(pinch())
    for name in ("origin", "generators", "L", "l0", "s", "H", "h", "D"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(space, name)[...] = 1.0


@pytest.mark.parametrize("cap", [0.0, -5.0])
def test_a_cap_must_leave_some_tension(cap):
    with pytest.raises(InvalidInputError, match=r"tension_limit: must be above 0 N, got"):
        wrench_space(pinch(), cap)


def test_no_hands_have_no_sets():
    assert wrench_spaces([]) == []


@last_seeds
@given(data=st.data())
def test_a_set_is_the_same_to_the_last_bit_whatever_other_hands_there_are(last, data):
    # copies, of which no set is known
    hands = [replace(hand) for hand in drawn_hands(data, 2, last)]
    for hand, together in zip(hands, wrench_spaces(hands), strict=True):
        alone = wrench_space(replace(hand))
        for name in ("origin", "generators", "L", "l0", "s", "H", "h"):
            np.testing.assert_array_equal(getattr(together, name), getattr(alone, name))
