"""The paper's own search for the wrenches of a hand with its wrist fixed, written down plainly.

Section 5.5.1: each finger's tendon is tightened step by step; at each step Eq. 6 is solved for the
contact forces, and the finger has failed where one of them exceeds its limit (Eq. 21). Section 5.6:
the wrenches of all fingers are summed (Eqs. 9, 10), every combination of the steps that hold, and
the hull of that cloud of points is the wrench space. Palm and lateral reactions are left out.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial import ConvexHull

from hand_models.finger import SettledFinger
from hand_models.hand import FINGERS, SettledHand
from hand_models.wrench_spaces.half_spaces import affine_hull

__all__ = ["searched"]


def searched(settled: SettledHand, step: float) -> tuple[np.ndarray, ConvexHull]:
    """Search a hand's wrench space.

    Parameters
    ----------
    settled : SettledHand
        All of whose fingers touch rock, without nails.
    step : float
        Of the tensions [N].

    Returns
    -------
    wrenches : ndarray, shape (n, 6)
        That hold.
    hull : ConvexHull
        Of these, in coordinates of their affine hull.
    """
    cloud = np.zeros((1, 6))
    for name, finger in zip(FINGERS, settled.fingers, strict=True):
        held = _finger(settled, name, finger, step)
        cloud = (cloud[:, None, :] + held[None, :, :]).reshape(-1, 6)
    directions, reach = affine_hull(cloud - cloud[0])
    return cloud, ConvexHull((cloud - cloud[0]) @ directions.T / reach)


def _finger(settled: SettledHand, name: str, finger: SettledFinger, step: float) -> np.ndarray:
    """Return one finger's wrenches at all tensions at which its tiles hold, and drag forward."""
    mine = [i for i, tile in enumerate(settled.tiles) if tile.finger == name]
    base = len(mine) > len(finger.contacts)
    wrenches = []
    tension = 0.0
    while tension <= settled.hand.maximum_tension:
        forces = contact_forces(finger, tension, settled.closing_tension)
        if base:
            share = settled.engagement[mine[0]]
            gain = finger.model.shear_gain[0]
            engagement = finger.model.base_engagement
            shear = engagement * settled.closing_tension + gain * (
                tension - settled.closing_tension
            )
            forces = np.vstack([[share * shear, 0.0], forces])
        pressed = forces[:, 1].copy()
        if base:
            pressed[0] = settled.engagement[mine[0]] * forces[1, 1]
        if (forces[:, 0] + settled.surface.friction * pressed >= 0.0).all():
            shares = settled.engagement[mine]
            if not all(
                _holds(settled, force / share)
                for force, share in zip(forces, shares, strict=True)
                if share > 0.0
            ):
                break
            wrench = np.zeros(6)
            for tile, (shear, normal) in zip(mine, forces, strict=True):
                force = shear * settled.axes[tile, 0] + normal * settled.axes[tile, 1]
                wrench[:3] += force
                wrench[3:] += np.cross(settled.positions[tile], force)
            wrenches.append(wrench)
        tension += step
    return np.array(wrenches)


def contact_forces(finger: SettledFinger, tension: float, closing: float) -> np.ndarray:
    """Solve Eq. 6, A f_c = b, for shear and normal load of each phalanx, shape (3, 2).

    Rows: the torque about each joint, the force along each tile; all three phalanges touch.
    """
    model, contacts = finger.model, finger.contacts
    A, b = np.zeros((6, 6)), np.zeros(6)
    turn = 0.0
    for i, contact in enumerate(contacts):
        joint = np.array(contact.joint)
        for j in range(i, 3):
            arm = np.array(contacts[j].point(model.tile_height)) - joint
            cosine, sine = math.cos(contacts[j].angle), math.sin(contacts[j].angle)
            # of a unit of shear along −x of the phalanx, and of pressing along its z
            A[i, 2 * j] = -(arm[0] * sine - arm[1] * cosine)
            A[i, 2 * j + 1] = arm[0] * cosine + arm[1] * sine
        bend, turn = contact.angle - turn, contact.angle
        b[i] = tension * model.pulley_radii[i]
        b[i] -= model.joint_stiffness[i] * bend + model.joint_preload[i]
        A[3 + i, 2 * i] = 1.0
        b[3 + i] = model.engagement[i] * closing + model.shear_gain[i] * (tension - closing)
    return np.linalg.solve(A, b).reshape(3, 2)


def _holds(settled: SettledHand, force: np.ndarray) -> bool:
    shear, normal = force
    angle = math.atan2(-normal, shear)
    strength = settled.surface.strength(np.clip(angle, -math.pi / 2, math.pi / 2))
    return bool(math.hypot(shear, normal) <= strength)
