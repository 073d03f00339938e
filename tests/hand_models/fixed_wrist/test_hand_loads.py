"""What the tiles of a hand carry: every force of every finger, and their sum."""

import numpy as np
from hypothesis import assume, example, strategies as st

from hand_models import Cylinder
from hand_models.parameters import hand_table
from tests.suite.helpers.hands import HAND, PINCH, ROCK, changed_hand, pinch, settled_at
from tests.suite.helpers.shares import given_some

seeds = st.integers(0, 2**32 - 1)


FIGURE_12 = {
    ("finger", "pulley_radii"): [0.0055, 0.00308, 0.00269],
    ("tile", "engagement"): [4.85 / 37.0, 6.95 / 37.0, 8.05 / 37.0],
    ("tile", "base_engagement"): 4.85 / 37.0,
    ("tile", "contact_stiffness"): [1e4, 1e4, 1e4],
}
"""Numbers that alone meet Fig. 12, with the seat of the hand and not the gripper's."""


def test_seated_on_300_mm_at_37_n_fingers_fitted_to_figure_12_carry_it():
    hand = HAND
    for entry, value in FIGURE_12.items():
        hand = changed_hand(*entry, value, hand)
    settled = hand.settle(Cylinder(0.3), ROCK, PINCH)
    loads = settled.tile_loads(np.full(4, 37.0))
    for i in range(4):
        tiles = np.flatnonzero(settled.finger_of == i)[-3:]
        np.testing.assert_allclose(loads[tiles, 0], [4.85, 6.95, 8.05], atol=1e-6)
        assert (np.abs(loads[tiles, 1] - [8.45, 1.0, 1.85]) <= [0.2535, 0.2, 0.2]).all()
        np.testing.assert_array_equal(loads[tiles, 2], 0.0)


def test_tiles_are_dragged_by_their_engagement_at_the_closing_tension():
    settled = pinch()
    loads = settled.tile_loads(np.full(4, 37.0))
    for i in range(4):
        tiles = np.flatnonzero(settled.finger_of == i)[-3:]
        engagement = hand_table().vector("tile", "engagement")
        np.testing.assert_allclose(loads[tiles, 0], 37.0 * np.array(engagement), atol=1e-6)


def equation_6(settled, i, tension):
    """Shear and normal of finger i's three tiles by the full square system, forces in H.

    Joint rows, where contacts hold the joint: the torque about its axis of the rock's forces, of
    tendon and spring. Where a contact bears only a share of it, so much of the row, and of what its
    own normal load does about the joint the rest. Tile rows: the rock's force along a phalanx is
    its shear, nothing beside its tile; where nothing touches, both forces are 0.
    """
    model, finger = HAND.finger, settled.fingers[i]
    tiles = np.flatnonzero(settled.finger_of == i)[-3:]
    frame = HAND.frames(settled.grasp.outer_rotation)[i]
    up = np.array([0.0, 0.0, 1.0])
    axis = np.cross(frame.along, up)
    joints = [frame.joint + c.joint[0] * frame.along + c.joint[1] * up for c in finger.contacts]
    rows, values = [], []
    closing = settled.closing_tension
    for j, (tile, contact) in enumerate(zip(tiles, finger.contacts, strict=True)):
        if contact.stop is None:
            row = np.zeros(6)
            for k in range(j, 3):
                arm = settled.positions[tiles[k]] - joints[j]
                row[2 * k : 2 * k + 2] = [axis @ np.cross(arm, unit) for unit in (frame.along, up)]
            angle = contact.angle - (finger.contacts[j - 1].angle if j else 0.0)
            share, normal = contact.bearing_share, settled.axes[tile, 1]
            own = axis @ np.cross(settled.positions[tile] - joints[j], normal)
            row *= share
            row[2 * j : 2 * j + 2] += (1.0 - share) * own * (np.array([frame.along, up]) @ normal)
            rows.append(row)
            torque = model.joint_stiffness[j] * angle - tension * model.pulley_radii[j]
            values.append(share * torque)
        if contact.kind == "none":
            rows += [np.eye(6)[2 * j], np.eye(6)[2 * j + 1]]
            values += [0.0, 0.0]
            continue
        distal = -settled.axes[tile, 0]
        row = np.zeros(6)
        row[2 * j : 2 * j + 2] = [distal @ frame.along, distal @ up]
        shear = model.engagement[j] * closing + model.shear_gain[j] * (tension - closing)
        shear *= settled.engagement[tile]
        rows.append(row)
        values.append(0.0 if contact.kind == "frame" else shear)
    A, b = np.array(rows), np.array(values)
    on_tiles = np.linalg.solve(A, b).reshape(3, 2)
    on_rock = -(on_tiles[:, :1] * frame.along + on_tiles[:, 1:] * up)
    return np.einsum("tkx,tx->tk", settled.axes[tiles, :2], on_rock)


@given_some(5, 100, seeds, st.floats(0.0, 700.0))
@example(27669, 0.0)  # few spines
def test_loads_are_those_of_the_full_system_of_equation_6(seed, tension):
    settled = settled_at(seed)
    assume(settled is not None)
    loads = settled.tile_loads(np.full(4, tension))
    for i in range(4):
        if any(contact.bearing_share < 1.0 for contact in settled.fingers[i].contacts):
            # a joint that a tile with few spines bears in part is not in the equation
            continue
        tiles = np.flatnonzero(settled.finger_of == i)[-3:]
        expected = equation_6(settled, i, tension)
        scale = 1.0 + np.abs(expected).max()
        np.testing.assert_allclose(loads[tiles, :2] / scale, expected / scale, atol=1e-9)
