"""Twist of fingers whose tiles bear on one side: moments that the pins of their joints carry.

Let a tile exert the force F on the rock in its finger's plane, its shear T and its normal load N,
at the distance b beside that plane (b > 0 along ŷ, y of the finger frame F). About every point of
the plane it has the moment b ŷ × F, besides the one about ŷ that the tendon balances. A pin lets
its joint turn about ŷ only, so each joint between the tile and the finger's base carries all of
b ŷ × F. Its part about the axis u_j of phalanx j twists joint j; over the tiles from there on,

    m_j = Σ_{t ≥ j} b_t u_j · (ŷ × F_t) = Σ_{t ≥ j} b_t n_j · F_t,

n_j the normal of phalanx j: of its own tile b N, of later ones what their normal load and shear
have along n_j. ``|m_j|`` is limited. The part about n_j, which bends a finger sideways, is not, nor
are the moments of lateral reactions, for which no strength is known: spines limit these.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hand_models.base import BASE_TOLERANCES, Array
from hand_models.finger import PHALANGES
from hand_models.hand import SettledHand

__all__ = ["FINGER_TWIST", "twist_arms", "twist_moments", "twisted_joints"]

FINGER_TWIST = "finger_twist"


def twisted_joints(settled: SettledHand) -> tuple[tuple[int, int], ...]:
    """Return the joints that tiles twist, as indices of the finger and of the joint in it.

    These are all joints from the base to the last tile of a finger that bears beside its plane.
    """
    beside = np.abs(settled.postures.across) > BASE_TOLERANCES.length
    if settled.grasp.fingernail or not beside.any():
        return ()
    twisted = np.logical_or.accumulate(beside[:, ::-1], axis=1)[:, ::-1]
    return tuple([(finger, joint) for finger, joint in np.argwhere(twisted).tolist()])


def twist_arms(settled: SettledHand, joints: Sequence[tuple[int, int]]) -> Array:
    """Return the twist of joints per newton along each axis of H that each tile exerts.

    Parameters
    ----------
    settled : SettledHand
        Hand with n tiles.
    joints : sequence of (int, int), length k
        Finger and joint, as from `twisted_joints`.

    Returns
    -------
    ndarray, shape (k, n, 3)
        b_t n_j for the tiles from the joint on, else zero [m]; times the force on the rock in the
        finger's plane it is the moment on the rock about the phalanx's axis.
    """
    arms, postures = np.zeros((len(joints), len(settled.tiles), 3)), settled.postures
    frames = settled.hand.frames(settled.grasp.outer_rotation)
    for arm, (finger, joint) in zip(arms, joints, strict=True):
        angle, phalanges = postures.angles[finger, joint], slice(joint, len(PHALANGES))
        normal = -np.sin(angle) * frames[finger].along + [0.0, 0.0, np.cos(angle)]
        own = np.flatnonzero(settled.finger_of == finger)[-len(PHALANGES) :]
        arm[own[phalanges]] = postures.across[finger, phalanges, None] * normal
    return arms


def twist_moments(hands: Sequence[SettledHand], joints: Sequence[tuple[int, int]]) -> Array:
    """Return the twist of joints of hands whose wrists are fixed.

    Parameters
    ----------
    hands : sequence of SettledHand, length h
    joints : sequence of (int, int), length k
        The `twisted_joints` of each of the hands.

    Returns
    -------
    ndarray, shape (2, h, k)
        m_j at zero tension [N·m], and per newton of the finger's tension [m].
    """
    found = np.zeros((2, len(hands), len(joints)))
    for h, hand in enumerate(hands):
        forces = hand.loads.swapaxes(1, 2) @ hand.axes[:, :2]
        terms = twist_arms(hand, joints)[:, :, None] * forces
        found[:, h] = terms.sum(axis=(1, 3)).T
    return found
