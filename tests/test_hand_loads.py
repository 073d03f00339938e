"""What the tiles of a hand carry: every force of every finger, and their sum."""

import math

import numpy as np
from hands import HAND, pinch, settled_at
from hypothesis import given, settings
from hypothesis import strategies as st

from hand_models import FINGERS, wrench_space

seeds = st.integers(0, 2**32 - 1)


def test_seated_on_300_mm_at_37_n_the_fingers_carry_figure_12():
    settled = pinch()
    loads = settled.tile_loads(np.full(4, 37.0))
    for i in range(4):
        tiles = np.flatnonzero(settled.finger_of == i)[-3:]
        np.testing.assert_allclose(loads[tiles, 0], [4.85, 6.95, 8.05], atol=1e-6)
        assert (np.abs(loads[tiles, 1] - [8.45, 1.0, 1.85]) <= [0.2535, 0.2, 0.2]).all()
        np.testing.assert_array_equal(loads[tiles, 2], 0.0)


def equation_6(settled, i, tension):
    """Shear and normal of finger i's three tiles by the full square system, forces in H.

    Joint rows: the torque about the joint's axis of the rock's forces, tendon and spring. Tile
    rows: the rock's force along a phalanx is its shear; where nothing touches, both forces are 0.
    """
    model, finger = HAND.finger, settled.fingers[i]
    tiles = np.flatnonzero(settled.finger_of == i)[-3:]
    frame = HAND.frames(settled.grasp.outer_rotation)[i]
    up = np.array([0.0, 0.0, 1.0])
    axis = np.cross(frame.along, up)
    joints = [frame.joint + c.joint[0] * frame.along + c.joint[1] * up for c in finger.contacts]
    A, b = np.zeros((6, 6)), np.zeros(6)
    closing = settled.closing_tension
    for j, tile in enumerate(tiles):
        if not finger.touching[j]:
            A[2 * j, 2 * j] = A[2 * j + 1, 2 * j + 1] = 1.0
            continue
        for k in range(j, 3):
            if finger.touching[k]:
                arm = settled.positions[tiles[k]] - joints[j]
                A[2 * j, 2 * k : 2 * k + 2] = [
                    axis @ np.cross(arm, unit) for unit in (frame.along, up)
                ]
        angle = finger.contacts[j].angle - (finger.contacts[j - 1].angle if j else 0.0)
        b[2 * j] = model.joint_stiffness[j] * angle - tension * model.pulley_radii[j]
        distal = -settled.axes[tile, 0]
        A[2 * j + 1, 2 * j : 2 * j + 2] = [distal @ frame.along, distal @ up]
        b[2 * j + 1] = model.engagement[j] * closing + model.shear_gain * (tension - closing)
    on_tiles = np.linalg.solve(A, b).reshape(3, 2)
    on_rock = -(on_tiles[:, :1] * frame.along + on_tiles[:, 1:] * up)
    return np.einsum("tkx,tx->tk", settled.axes[tiles, :2], on_rock)


@settings(max_examples=100, deadline=None)
@given(seeds, st.floats(0.0, 700.0))
def test_loads_are_those_of_the_full_system_of_equation_6(seed, tension):
    settled = settled_at(seed)
    if settled is None:
        return
    loads = settled.tile_loads(np.full(4, tension))
    for i in range(4):
        tiles = np.flatnonzero(settled.finger_of == i)[-3:]
        expected = equation_6(settled, i, tension)
        scale = 1.0 + np.abs(expected).max()
        np.testing.assert_allclose(loads[tiles, :2] / scale, expected / scale, atol=1e-9)


@settings(max_examples=100, deadline=None)
@given(seeds)
def test_the_hands_wrench_is_the_sum_of_its_tiles_and_palms_forces(seed):
    settled = settled_at(seed)
    if settled is None:
        return
    rng = np.random.default_rng(seed)
    space = wrench_space(settled)
    y = rng.uniform(0.0, 100.0, len(space.columns))
    value = dict(zip(space.columns, y, strict=True))
    lateral = np.array([value.get(f"{finger}/lateral", 0.0) for finger in FINGERS])
    loads = settled.tile_loads(y[:4], lateral)
    forces = np.einsum("tk,tkx->tx", loads, settled.axes)
    palm = np.array([-value.get("palm_shear", 0.0), 0.0, value.get("palm_pressing", 0.0)])
    forces = np.vstack([forces, palm])
    places = np.vstack([settled.positions, settled.palm.centre])
    expected = np.concatenate([forces.sum(axis=0), np.cross(places, forces).sum(axis=0)])
    np.testing.assert_allclose(space.wrench(y), expected, rtol=1e-9, atol=1e-9)


def tension_range(rows):
    """Least and largest tension at which constant + slope f ≥ 0 for every row."""
    least, most = 0.0, math.inf
    for constant, slope in rows:
        if slope > 0.0:
            least = max(least, -constant / slope)
        elif slope < 0.0:
            most = min(most, -constant / slope)
        elif constant < 0.0:
            most = -math.inf
    return least, most


def test_a_finger_stays_closed_exactly_where_some_tension_keeps_it():
    """Its tiles dragged forward and its joints' stops pushing; else it is released."""
    released = 0
    for seed in range(60):
        settled = settled_at(seed)
        if settled is None:
            continue
        hand_in_hold = settled.seating.pose.inverse()
        turn = hand_in_hold.rotation
        frames = HAND.frames(settled.grasp.outer_rotation)
        for i, (name, frame) in enumerate(zip(FINGERS, frames, strict=True)):
            section = settled.hold.section(
                hand_in_hold.apply(frame.joint), turn @ frame.along, turn[:, 2]
            )
            closed = HAND.finger.settle(section, (0.0, 0.0))
            outer = name.startswith("outer")
            shears = closed.shears(settled.closing_tension, outer)
            stops = closed.stop_torques(shears, closed.normals(shears, outer), outer)
            least, most = tension_range([*shears, *stops])
            stays = any(closed.touching) and least <= most
            assert any(settled.fingers[i].touching) == stays
            held = [torque for finger, _, torque in settled.stops if finger == i]
            assert len(held) == (closed.touching.count(False) if stays else 0)
            if not stays:
                tiles = np.flatnonzero(settled.finger_of == i)[-3:]
                assert not settled.touching[tiles].any()
                np.testing.assert_array_equal(settled.loads[tiles], 0.0)
                released += any(closed.touching)
    assert released >= 3
