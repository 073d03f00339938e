"""Ellipsoids of rock: their sections, and hands on them."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hand_models import Cylinder, Ellipsoid, Grasp, InvalidInputError, Sphere
from service.answering import dispatch
from service.wire import ServiceName
from tests.suite.helpers.hands import HAND, ROCK
from tests.suite.helpers.requests import wall_request

size = st.floats(0.03, 3.0)
axes = st.tuples(size, size, size)
seeds = st.integers(0, 2**32 - 1)


def level(hold: Ellipsoid, points: np.ndarray) -> np.ndarray:
    """Of points in the hold's frame: one on the rock, less inside."""
    centred = np.asarray(points) - [0.0, 0.0, hold.semi_axes[2]]
    return np.linalg.norm(centred / hold.semi_axes, axis=-1)


@given(axes, seeds)
def test_entry_is_the_first_point_of_a_line_on_the_rock(semi_axes, seed):
    rng = np.random.default_rng(seed)
    hold = Ellipsoid(semi_axes)
    start = rng.normal(size=3) * 4.0
    aim = np.array([0.0, 0.0, semi_axes[2]]) + 0.5 * rng.uniform(-1, 1, 3) * semi_axes - start
    direction = aim / np.linalg.norm(aim)
    entry = hold.entry(start, direction)
    assert level(hold, start + entry * direction) == pytest.approx(1.0, abs=1e-9)
    before = start + (entry - np.linspace(1e-6, 5.0, 50))[:, None] * direction
    assert (level(hold, before) > 1.0).all()


def test_a_line_that_misses_enters_nowhere():
    assert Ellipsoid((0.1, 0.2, 0.3)).entry((0.11, 0.0, 0.0), (0.0, 0.0, 1.0)) == math.inf


@given(axes, seeds)
def test_a_section_is_the_rock_in_its_plane(semi_axes, seed):
    rng = np.random.default_rng(seed)
    hold = Ellipsoid(semi_axes)
    s, t, _ = np.linalg.qr(rng.normal(size=(3, 3)))[0].T
    inside = np.array([0.0, 0.0, semi_axes[2]]) + 0.5 * rng.uniform(-1, 1, 3) * semi_axes / 2.0
    section = hold.section(inside, s, t)
    assert section is not None
    plane = rng.normal(size=(200, 2)) * max(semi_axes)
    for q in plane:
        value = float(level(hold, inside + q[0] * s + q[1] * t))
        if abs(value - 1.0) > 1e-6:
            assert (section.clearance((q[0], q[1])) > 0.0) == (value > 1.0)


def test_a_plane_past_it_meets_nothing():
    hold = Ellipsoid((0.1, 0.1, 0.1))
    assert hold.section((0.0, 0.11, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)) is None


@pytest.mark.parametrize("rotation", [0.0, 0.5, math.pi])
def test_with_equal_axes_it_is_a_sphere(rotation: float):
    ball = HAND.settle(Sphere(0.3), ROCK, Grasp(rotation))
    same = HAND.settle(Ellipsoid((0.15, 0.15, 0.15)), ROCK, Grasp(rotation))
    assert same.tiles == ball.tiles
    assert same.seating.rule == ball.seating.rule
    # a phalanx that swings back balances on a sketch of the ellipsoid
    np.testing.assert_allclose(same.positions, ball.positions, atol=1e-5)
    np.testing.assert_allclose(same.loads, ball.loads, atol=0.05)
    assert same.palm.engaged == ball.palm.engaged


@pytest.mark.parametrize("rotation", [0.0, math.pi])
def test_drawn_out_along_y_it_is_a_cylinder(rotation: float):
    log = HAND.settle(Cylinder(0.3), ROCK, Grasp(rotation))
    same = HAND.settle(Ellipsoid((0.15, 1e3, 0.15)), ROCK, Grasp(rotation))
    # closed along the path, within a milliradian of the closed form of the log
    np.testing.assert_allclose(same.positions, log.positions, atol=1.3e-4)
    np.testing.assert_allclose(same.loads, log.loads, atol=0.25)


@pytest.mark.parametrize("semi_axes", [(0.2, 0.1, 0.1), (0.3, 0.3, 0.1), (0.5, 0.5, 0.2)])
@pytest.mark.parametrize("rotation", [0.0, math.pi])
def test_a_seated_hand_touches_at_c1_with_its_palm_where_the_grasp_wants_it(semi_axes, rotation):
    settled = HAND.settle(Ellipsoid(semi_axes), ROCK, Grasp(rotation))
    x, _, z = settled.seating.pose.position
    if rotation:
        assert settled.seating.rule == "pinch"
        assert x == pytest.approx(0.03215)
        assert z >= 0.0
    else:
        assert settled.seating.rule == "palm_on_rock"
        assert z == pytest.approx(0.0, abs=1e-9)
    for finger in settled.fingers[1:3]:
        assert finger.contacts[0].kind == "face"
        # where the face touches; its bed presses nearer to the tile's middle on flatter rock
        assert finger.contacts[0].along == pytest.approx(0.0247, abs=3.5e-3)
        assert finger.contacts[0].along <= 0.0247 + 1e-6


@pytest.mark.slow
@given(axes, st.floats(0.0, math.pi))
def test_faces_are_on_the_rock_and_edges_within_the_spines_reach(semi_axes, rotation):
    hold = Ellipsoid(semi_axes)
    # curled to the joints' limits also beside needles, which no finger comes to
    settled = HAND.settle(hold, ROCK, Grasp(rotation, closing_tension=46.0))
    rock = settled.seating.pose.inverse()
    for tile, point in zip(settled.tiles, settled.positions, strict=True):
        value = level(hold, rock.apply(point))
        if tile.contact in ("face", "edge"):
            assert value > 1.0 - 2e-3


@pytest.mark.parametrize("semi_axes", [(0.1, 0.1), (0.1, -0.1, 0.1), (0.1, 0.1, math.nan)])
def test_impossible_axes_are_refused(semi_axes):
    with pytest.raises(InvalidInputError) as caught:
        Ellipsoid(semi_axes)
    assert caught.value.field.startswith("semi_axes")


def test_a_request_may_have_one():
    request = wall_request()
    for hand in request["stance"]["hands"]:
        hand["hold"] = {"shape": "ellipsoid", "semi_axes": [0.2, 0.3, 0.12]}
    reply = json.loads(dispatch.handle(ServiceName.PLAN, json.dumps(request).encode()).payload)
    assert reply["verified"] is True
    assert all(hand["seating"]["rule"] == "pinch" for hand in reply["hands"])
    request["stance"]["hands"][1]["hold"]["semi_axes"] = [0.2, 0.3]
    error = json.loads(dispatch.handle(ServiceName.PLAN, json.dumps(request).encode()).payload)[
        "error"
    ]
    assert error["field"] == "stance.hands[1].hold.semi_axes"
