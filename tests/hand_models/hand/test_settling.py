"""Hands settled together, against fingers closed one by one; and what is kept of them."""

from __future__ import annotations

import dataclasses
import gc
import math
import pickle
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, strategies as st
from msgspec import structs

from hand_models import Cylinder, Edge, Ellipsoid, Grasp, InvalidInputError, Plane, Pose, Sphere
from hand_models.base import BoundedStore, stores
from hand_models.finger import ClosedFinger, OpenFinger, close_all, settle_finger
from hand_models.hand import FINGERS, HandModel, Placement, SettledHand, SpinyHand, spiny_hand
from hand_models.hand.spinyhand import _rock_bytes
from hand_models.rock import Mesh, Profile
from hand_models.tile import Surface
from planner.prepare.settled_stance import settle_stance
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.hands import HAND, PINCH, ROCK, changed_hand, seating_on
from tests.suite.helpers.rocks import (
    cylinder_mesh,
    random_axes,
    random_ellipsoid,
    random_hold,
    random_mesh,
    random_profile,
)
from tests.suite.helpers.shares import given_some
from tests.suite.helpers.stances import on_wall

seeds = st.integers(0, 2**32 - 1)

UP = np.array([0.0, 0.0, 1.0])


def random_placement(rng: np.random.Generator, *, rough: float = 0.15) -> Placement:
    """A hand on any kind of hold, seated or tilted, gripping or clinging; sometimes in it."""
    kinds = (random_hold, random_ellipsoid, random_profile, random_mesh)
    chances = np.array([0.65, 0.35, 0.0, 0.0]) * (1.0 - rough) + [
        0.0,
        0.0,
        0.8 * rough,
        0.2 * rough,
    ]
    hold = kinds[rng.choice(4, p=chances)](rng)
    surface = Surface.from_values(
        {"shear_limit": rng.uniform(15.0, 100.0), "pull_off_angle": rng.uniform(0.3, 1.5)}
    )
    grasp = Grasp(
        outer_rotation=float(rng.choice([0.0, math.pi, 0.5 * math.pi, rng.uniform(0.0, math.pi)])),
        closing_tension=None if rng.random() < 0.5 else float(rng.uniform(15.0, 60.0)),
        palm=bool(rng.random() < 0.8),
        fingernail=bool(rng.random() < 0.07),
    )
    pose = None
    if rng.random() < 0.6:
        tilt = float(rng.choice([0.0, 0.05, 0.3]))
        axes = random_axes(rng, tilt) if tilt else np.eye(3)
        pose = Pose(rng.uniform([-0.04, -0.03, -0.002], [0.07, 0.03, 0.012]), axes)
    return Placement(hold, surface, grasp, pose)


def same(one: SettledHand, other: SettledHand) -> None:
    assert one.tiles == other.tiles
    assert one.palm.engaged == other.palm.engaged
    assert one.seating.rule == other.seating.rule
    for a, b in (
        (one.positions, other.positions),
        (one.axes, other.axes),
        (one.loads, other.loads),
        (one.palm.gaps, other.palm.gaps),
        (one.palm.centre, other.palm.centre),
        (one.nail_angles, other.nail_angles),
        (one.seating.pose.position, other.seating.pose.position),
        (one.palm.shear_limit, other.palm.shear_limit),
    ):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-10)


def forget() -> None:
    HAND.settled.clear()


# Each hand, from its finger planes ----------------------------------------------------------------


def check_hand(placement: Placement, settled: SettledHand, hand: SpinyHand = HAND) -> None:
    """Against the hand put together from sections and fingers closed one by one."""
    hold, surface, grasp, pose, _ = placement
    assert settled.seating.rule == ("given" if pose is not None else seating_on(hold, grasp).rule)
    there = settled.seating.pose
    if pose is not None:
        np.testing.assert_array_equal(there.position, pose.position)
    inverse = there.inverse()
    into = inverse.rotation[:, 2]
    closing = hand.closing_tension if grasp.closing_tension is None else grasp.closing_tension
    row = 0
    for name, frame, finger in zip(
        FINGERS, hand.frames(grasp.outer_rotation), settled.fingers, strict=True
    ):
        outer = name.startswith("outer")
        if outer:
            place = frame.joint + (hand.base_tile_reach - hand.outer_reach) * frame.along
            place[2] = hand.base_tile_surface
            gap = hold.entry(inverse.apply(place), into)
            share = 0.0 if grasp.fingernail else on_rock(abs(gap), hand)
            on = share > 0.0
            assert settled.tiles[row] == (name, "base", "face" if on else "none")
            np.testing.assert_allclose(
                settled.positions[row], place + (gap if on else 0.0) * UP, atol=1e-11
            )
            np.testing.assert_allclose(settled.engagement[row], share, atol=1e-8)
            gain = hand.finger.shear_gain[0]
            drag = share * np.array([(hand.finger.base_engagement - gain) * closing, gain])
            np.testing.assert_allclose(settled.loads[row], [drag, (0.0, 0.0)], atol=1e-7)
            row += 1
        rock = hand.frames(grasp.outer_rotation)[FINGERS.index(name)].rock(hold, there.inverse())
        if grasp.fingernail:
            angles, shears, normals = np.zeros(3), np.zeros((3, 2)), np.zeros((3, 2))
        else:
            rubs = outer and hand.finger.friction > 0.0
            if all(c.kind == "face" and c.stop is None for c in finger.contacts):
                laid = settled.fingers[FINGERS.index(name)]
                shears = laid.shears(closing, rubs)
                closed = ClosedFinger(
                    laid,
                    shears,
                    laid.normals(shears, rubs),
                    np.zeros((3, 2)),
                )
            else:
                (closed,) = close_all(hand.finger, [OpenFinger(rock, surface, closing, rubs)])
            assert isinstance(closed, ClosedFinger)
            angles = [contact.angle for contact in closed.finger.contacts]
            shears, normals = closed.shears, closed.normals
            assert [(c.kind, c.stop) for c in closed.finger.contacts] == [
                (c.kind, c.stop) for c in finger.contacts
            ]
            alongs = [contact.along for contact in closed.finger.contacts]
            np.testing.assert_allclose([c.along for c in finger.contacts], alongs, atol=2e-5)
        np.testing.assert_allclose([c.angle for c in finger.contacts], angles, atol=1e-7)
        joint = frame.joint
        for i, contact in enumerate(finger.contacts):
            u, n = turned(frame, contact.angle)
            place = joint + contact.along * u + (hand.finger.tile_height + contact.rise) * n
            place = place + contact.across * frame.across
            np.testing.assert_allclose(settled.positions[row], place, atol=1e-12)
            drag, push = turned(frame, contact.angle + contact.tilt)
            np.testing.assert_allclose(settled.axes[row], [-drag, push, frame.across], atol=1e-12)
            size = 1.0 + np.abs(normals).max()
            # other points of the rock beside them round otherwise
            np.testing.assert_allclose(settled.loads[row, 0], shears[i], atol=1e-6)
            np.testing.assert_allclose(settled.loads[row, 1], normals[i], atol=1e-6 * size)
            assert settled.tiles[row].contact == contact.kind
            share = contact.engagement if contact.kind in ("face", "edge") else 0.0
            assert settled.engagement[row] == share
            joint = joint + hand.finger.joint_spacing * u
            row += 1
        row += grasp.fingernail
    assert row == len(settled.tiles)
    gaps = [hold.entry(inverse.apply(tile), into) for tile in hand.palm_tiles]
    np.testing.assert_allclose(settled.palm.gaps, gaps, atol=1e-11)
    engaged = [i for i, gap in enumerate(gaps) if gap < hand.spine_travel and grasp.palm]
    assert settled.palm.engaged == tuple(engaged)
    if engaged:
        places = hand.palm_tiles[engaged] + np.array(gaps)[engaged, None] * UP
        shares = [on_rock(gaps[i], hand) for i in engaged]
        np.testing.assert_allclose(settled.palm.engagement, shares, atol=1e-8)
        np.testing.assert_allclose(
            settled.palm.centre, np.average(places, axis=0, weights=shares), atol=1e-9
        )


def on_rock(gap: float, hand: SpinyHand) -> float:
    """Share of a tile's spines that are on rock across a gap."""
    part = min(max(gap / hand.spine_travel, 0.0), 1.0)
    return 1.0 - part**hand.engagement_exponent


def turned(frame, angle):
    """Unit vectors along and across a phalanx at an angle, in H."""
    return (
        math.cos(angle) * frame.along + math.sin(angle) * UP,
        math.cos(angle) * UP - math.sin(angle) * frame.along,
    )


@given_some(3, 15, seeds)
def test_hands_settled_together_are_as_their_fingers_closed_one_by_one(seed):
    rng = np.random.default_rng(seed)
    placements = [random_placement(rng) for _ in range(rng.integers(1, 5))]
    for placement, settled in zip(placements, HAND.settle_each(placements), strict=True):
        if isinstance(settled, SettledHand):
            check_hand(placement, settled)


# another law of engagement; tendons that rub
OTHERS = [("tile", "engagement_exponent", 3.0), ("tendon", "friction", 0.1)]


@given_some(4, 20, seeds, st.sampled_from(OTHERS))
def test_hands_of_other_numbers_are_as_their_fingers_closed_one_by_one(seed, changed):
    rng = np.random.default_rng(seed)
    hand = changed_hand(*changed)
    placements = [random_placement(rng, rough=0.0) for _ in range(3)]
    for placement, settled in zip(placements, hand.settle_each(placements), strict=True):
        if isinstance(settled, SettledHand):
            check_hand(placement, settled, hand)


@given_some(2, 8, seeds)
def test_neither_company_nor_order_changes_a_hand(seed):
    rng = np.random.default_rng(seed)
    placements = [random_placement(rng, rough=0.1) for _ in range(4)]
    together = HAND.settle_each(placements)
    order = rng.permutation(4)
    forget()
    others = HAND.settle_each([placements[i] for i in order])
    for i, other in zip(order, others, strict=True):
        forget()
        (alone,) = HAND.settle_each([placements[i]])
        for found in (together[i], other):
            if isinstance(alone, InvalidInputError):
                assert (type(found), str(found)) == (type(alone), str(alone))
            else:
                assert isinstance(found, SettledHand)
                same(found, alone)


def test_a_hand_that_cannot_be_where_it_is_has_its_error_in_place():
    deep = Pose(np.array([0.0, 0.0, -0.02]), np.eye(3))
    good = Placement(Cylinder(0.3), ROCK, PINCH, None)
    outcomes = HAND.settle_each(
        [
            good,
            Placement(Plane(), ROCK, Grasp(), deep),
            Placement(Cylinder(0.3), ROCK, Grasp(closing_tension=900.0), deep),
            good,
        ]
    )
    first, palm, tension, last = outcomes
    assert first is last
    assert isinstance(first, SettledHand)
    assert (palm.field, tension.field) == ("hold", "grasp.closing_tension")
    assert "20.0 mm inside the palm" in str(palm)
    assert "must be at most tendon.maximum_tension, 700 N, got 900 N" in str(tension)
    with pytest.raises(InvalidInputError, match=r"^hold: the hold stands 20\.0 mm inside the palm"):
        HAND.settle(Plane(), ROCK, Grasp(), deep)


def test_the_first_hand_of_a_stance_that_is_impossible_is_named():
    stance = on_wall()
    hands = list(stance.hands)
    for i, depth in ((1, 0.03), (3, 0.04)):
        into = Pose(np.array([0.0, 0.0, -depth]), np.eye(3))
        hands[i] = dataclasses.replace(hands[i], hold_in_hand=into)
    with pytest.raises(InvalidInputError, match=r"^stance\.hands\[1\]\.hold: .* 29\.4 mm inside"):
        settle_stance(dataclasses.replace(stance, hands=tuple(hands)))


def test_a_stance_settles_as_its_hands_do():
    stance = on_wall()
    hand = stance.hands[2]
    for settled in settle_stance(stance):
        same(settled, HAND.settle(hand.hold, hand.surface, hand.grasp))


# What is kept -------------------------------------------------------------------------------------

LEVEL = Pose(np.array([0.0, 0.0, 0.003]), np.eye(3))
BASIC = Placement(Cylinder(0.3), ROCK, Grasp(0.5), LEVEL)


def test_a_hand_is_kept_for_the_same_hold_place_grasp_and_surface_only():
    others = [
        BASIC._replace(hold=Cylinder(0.31)),
        BASIC._replace(hold=Sphere(0.3)),
        BASIC._replace(hold=Edge(0.15, 2.0)),
        BASIC._replace(hold=Ellipsoid((0.15, 0.3, 0.15))),
        BASIC._replace(surface=Surface.named("sandpaper-36")),
        BASIC._replace(surface=dataclasses.replace(ROCK, half_planes=2)),
        BASIC._replace(grasp=Grasp(0.6)),
        BASIC._replace(grasp=Grasp(0.5, closing_tension=30.0)),
        BASIC._replace(grasp=Grasp(0.5, palm=False)),
        BASIC._replace(grasp=Grasp(0.5, lateral=False)),
        BASIC._replace(grasp=Grasp(0.5, fingernail=True)),
        BASIC._replace(hold_in_hand=Pose(np.array([0.0, 1e-9, 0.003]), np.eye(3))),
        BASIC._replace(hold_in_hand=Pose(LEVEL.position, np.diag([-1.0, -1.0, 1.0]))),
        BASIC._replace(hold_in_hand=None),
    ]
    HAND.settled.clear()
    (first,) = HAND.settle_each([BASIC])
    copies = BASIC._replace(
        hold=Cylinder(0.3),
        grasp=Grasp(0.5),
        surface=dataclasses.replace(ROCK),
        hold_in_hand=Pose(LEVEL.position.copy(), np.eye(3)),
    )
    (again,) = HAND.settle_each([copies])
    assert again is first
    for other, different in zip(others, HAND.settle_each(others), strict=True):
        assert different is not first
        assert (different.hold, different.surface, different.grasp) == other[:3]
    assert HAND.settled.info()[:3] == (1, 1 + len(others), 1 + len(others))


def test_each_hand_keeps_its_own():
    own = changed_hand("finger", "tile_height", 0.006)
    (first,), (other,) = HAND.settle_each([BASIC]), own.settle_each([BASIC])
    assert first.hand is HAND
    assert other.hand is own
    assert np.abs(first.positions - other.positions).max() > 1e-5


def test_scanned_rock_is_known_by_the_object():
    for kind in ["mesh", "profile"]:
        rng = np.random.default_rng(5)
        rock = random_mesh(rng) if kind == "mesh" else random_profile(rng)
        alike = (
            Mesh(rock.triangles.vertices, rock.triangles.faces)
            if isinstance(rock, Mesh)
            else Profile(rock.outlines[0])
        )
        one, again, other = (HAND.settle(each, ROCK, PINCH) for each in (rock, rock, alike))
        assert one is again
        assert other is not one


def test_what_is_kept_cannot_be_changed():
    place = Pose(np.array([0.0, 0.0, 0.003]), np.eye(3))
    settled = HAND.settle(Edge(0.1, 1.5), ROCK, Grasp(), place)
    arrays = (
        *(getattr(settled, name) for name in ("positions", "axes", "loads", "finger_of")),
        *(settled.palm.gaps, settled.palm.centre, settled.nail_angles, settled.nail_normals),
        *(settled.seating.pose.position, settled.seating.pose.rotation),
        *settled.postures,
        *(torque for _, _, torque in settled.stops),
    )
    for array in arrays:
        with pytest.raises(ValueError, match="read-only"):
            array.flat[0] = 1.0
    # nor through what the caller gave
    place.position[2] = 0.5
    assert settled.seating.pose.position[2] == 0.003


def test_only_so_many_hands_are_kept_the_last_ones():
    hand = SpinyHand()
    placements = [Placement(Plane(), ROCK, Grasp(0.01 * i), None) for i in range(300)]
    first = hand.settle_each(placements)
    assert hand.settled.info()[:3] == (0, 300, hand.settled.most)
    again = hand.settle_each(placements)
    kept = [one is other for one, other in zip(first, again, strict=True)]
    assert kept == [False] * (300 - hand.settled.most) + [True] * hand.settled.most


def test_hands_on_scans_are_kept_as_long_as_these_are_not_too_large():
    hand = SpinyHand()
    hand.settled = BoundedStore("scans", 256, _rock_bytes, 20_000)
    holds = [Profile([[-0.3, 0.0], [0.0, 0.0], [0.3, 0.01]]), *(_log(0.3) for _ in range(3))]
    assert [hold.nbytes for hold in holds] == [0, 7_104, 7_104, 7_104]
    placements = [Placement(hold, ROCK, Grasp(), None) for hold in holds]
    placements.insert(2, Placement(Plane(), ROCK, Grasp(), None))
    settled = hand.settle_each(placements)
    assert [each.hold for each in settled] == [each.hold for each in placements]
    assert hand.settled.info()[:3] == (0, 5, 3)
    assert hand.settle_each(placements[2:]) == settled[2:]
    assert hand.settle(holds[1], ROCK) is not settled[1]


def test_a_route_on_one_scan_is_found_again():
    hand, hold = SpinyHand(), _log(0.3)
    places = [Pose(np.array([0.032, 1e-3 * i, 0.003]), np.eye(3)) for i in range(8)]
    placements = [Placement(hold, ROCK, Grasp(math.pi), place) for place in places]
    settled = hand.settle_each(placements)
    assert hand.settled.info()[:3] == (0, 8, 8)
    again = hand.settle_each(placements)
    assert all(one is other for one, other in zip(again, settled, strict=True))


def _log(diameter):
    return Mesh(*cylinder_mesh(diameter, around=74))


@pytest.mark.slow
def test_threads_share_what_is_kept():
    hand = SpinyHand()
    rng = np.random.default_rng(11)
    placements = [random_placement(rng, rough=0.0) for _ in range(8)]
    orders = [rng.integers(0, len(placements), 6) for _ in range(20)]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda o: hand.settle_each([placements[i] for i in o]), orders))
    alone = SpinyHand().settle_each(placements)
    for order, outcomes in zip(orders, found, strict=True):
        for i, outcome in zip(order, outcomes, strict=True):
            if isinstance(alone[i], SettledHand):
                same(outcome, alone[i])
            else:
                assert str(outcome) == str(alone[i])
    hits, misses, kept, _ = hand.settled.info()
    assert hits + misses == 20 * 6
    assert kept == sum(isinstance(each, SettledHand) for each in alone)


def test_a_hand_travels_between_processes_without_what_it_keeps():
    # the one that this process has now: others may have come between
    hand = spiny_hand()
    assert pickle.loads(pickle.dumps(hand)) is hand
    recent = BoundedStore("few", 3)
    recent.keep([("a", 1)])
    copy = pickle.loads(pickle.dumps(recent))
    assert (copy.name, copy.info()) == ("few", (0, 0, 0, 3))


@given(st.integers(1, 5), st.lists(st.tuples(st.booleans(), st.integers(0, 7)), max_size=40))
def test_recent_answers_are_those_asked_for_last(most, steps):
    recent, model, order = BoundedStore("some", most), {}, []
    for asking, question in steps:
        known = question in model
        if asking:
            assert recent.find([question]) == [model.get(question)]
        elif not known:
            recent.keep([(question, str(question))])
            model[question] = str(question)
        if asking == known:
            order = [other for other in order if other != question] + [question]
        for gone in order[:-most]:
            del model[gone]
        order = order[-most:]
    assert recent.info().kept == len(model)


# The bottom-up state of a finger ------------------------------------------------------------------


@given_some(5, 50, seeds)
def test_a_finger_is_laid_as_on_its_section(seed):
    """On planes of any tilt through smooth holds."""
    rng = np.random.default_rng(seed)
    placement = random_placement(rng, rough=0.0)
    placement = placement._replace(grasp=structs.replace(placement.grasp, fingernail=False))
    (settled,) = HAND.settle_each([placement])
    if isinstance(settled, InvalidInputError):
        return
    for name, finger in zip(FINGERS, settled.fingers, strict=True):
        if len(finger.free) < 3:
            continue
        section = HAND.section(name, placement.hold, placement.grasp, settled.seating.pose)
        first = settle_finger(HAND.finger, section, (0.0, 0.0))
        angles = [contact.angle for contact in first.contacts]
        if not np.allclose([contact.angle for contact in finger.contacts], angles, atol=1e-6):
            continue  # it has given way
        np.testing.assert_allclose(
            [(c.angle, *c.joint) for c in finger.contacts],
            [(c.angle, *c.joint) for c in first.contacts],
            atol=1e-10,
        )
        # the bed presses aside of where the face first touches near an end of the tile, by half of
        # its 24 mm at most; 9.6 mm is the largest that was met (seed 921)
        alongs = [[c.along for c in each.contacts] for each in (finger, first)]
        np.testing.assert_allclose(*alongs, atol=1e-2)


def test_hands_at_one_place_are_seated_on_rock_that_is_cut_once(monkeypatch):
    rock, at = Mesh(*cylinder_mesh(0.3, 64), anywhere=True), Pose.identity()
    placements = [Placement(rock, ROCK, grasp, None, at) for grasp in (Grasp(), PINCH)]
    alone = [SpinyHand(HAND.table).settle_each([each])[0].seating for each in placements]
    cuts: list[tuple[float, ...]] = []
    real = Mesh.section

    def counted(self: Mesh, origin: np.ndarray, s_axis: np.ndarray, t_axis: np.ndarray):
        cuts.append(tuple(np.round(np.concatenate([origin, s_axis, t_axis]), 12)))
        return real(self, origin, s_axis, t_axis)

    monkeypatch.setattr(Mesh, "section", counted)
    together = SpinyHand(HAND.table).settle_each(placements)
    assert [each.seating.rule for each in together] == [each.rule for each in alone]
    for one, each in zip(together, alone, strict=True):
        np.testing.assert_array_equal(one.seating.pose.position, each.pose.position)
    # five under the palm
    assert len(cuts) == 5


@pytest.mark.slow
def test_hands_of_the_same_numbers_are_equal_in_every_process():
    one, other = SpinyHand(HAND.table), spiny_hand()
    assert one is not other
    assert one == other
    assert hash(one) == hash(other)
    assert one != changed_hand("tendon", "closing_tension", 31.0)
    asked = (
        "import pickle, sys; from tests.suite.helpers.hands import HAND; "
        "assert pickle.load(sys.stdin.buffer) in {HAND: 1}"
    )
    for each in (one, HandModel(HAND.table)):
        subprocess.run(
            [sys.executable, "-c", asked], input=pickle.dumps(each), check=True, cwd=ROOT
        )


def test_one_function_tells_of_all_stores():
    # or hands of other tests might go on the way, and their stores with them
    gc.collect()
    before = stores()["settled hands"]
    hand = SpinyHand(HAND.table)
    for diameter in (0.3, 0.31, 0.3):
        hand.settle(Cylinder(diameter), ROCK)
    after = stores()["settled hands"]
    assert after.kept - before.kept == 2
    assert after.hits - before.hits == 1
    assert after.misses - before.misses == 2
    assert after.most - before.most == hand.settled.most
    assert "best seats" in stores()


def test_stores_are_told_while_another_thread_makes_some():
    made = []

    def make() -> None:
        for _ in range(3000):
            made.append(BoundedStore("made meanwhile", 1))

    thread = threading.Thread(target=make)
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        thread.start()
        while thread.is_alive():
            stores()
    finally:
        sys.setswitchinterval(before)
        thread.join()
    assert "settled hands" in stores()


def test_what_a_store_does_not_know_is_made_once():
    made: list[int] = []
    store: BoundedStore[int, int] = BoundedStore("squares", 2)

    def square(x: int) -> int:
        made.append(x)
        return x * x

    asked = (3, 3, 4, 3, 5, 3, 4)
    assert [store.get(x, lambda x=x: square(x)) for x in asked] == [x * x for x in asked]
    assert made == [3, 4, 5, 4]
