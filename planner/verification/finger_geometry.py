"""Geometry, springs and tendons of settled fingers, for the check of plans.

Moments are taken about the joints' axes in H. Each axis is a row (a × p, −a) that is multiplied by
a wrench (F, M) about the origin of H: with a across the finger, a × p = a × p_0 − x e_z + z e_x for
a joint at (x, z) of the finger's plane.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from hand_models.base import SKEW_MATRICES, Array, Indices
from hand_models.finger import PHALANGES
from hand_models.hand import HandModel
from planner.prepare import HandBatch, TileIndex

__all__ = ["RestingFingers", "frame_axes", "moments_of", "tendons_of", "wrenches_of"]

TURNED_PHALANGES: Final = np.tri(len(PHALANGES)).T
"""Ones where a joint (row) turns a phalanx (column)."""

CROSS_PRODUCT: Final = SKEW_MATRICES.transpose(0, 2, 1).reshape(9, 3)
"""The map of p ⊗ F to the moment p × F."""


def wrenches_of(points: Array, forces: Array) -> Array:
    """Return the wrenches about the origin of forces at points, shape (n, 6) [N, N·m].

    Parameters
    ----------
    points, forces : ndarray, shape (n, 3)
        Points [m] and the forces that act there [N], in one frame.
    """
    moments = (points[:, :, None] * forces[:, None]).reshape(-1, len(CROSS_PRODUCT)) @ CROSS_PRODUCT
    return np.concatenate((forces, moments), axis=1)


def tendons_of(places: TileIndex, hand: HandModel) -> tuple[Array, Array, Array, Array]:
    """Return the coefficients of tendons on joints and tiles, for hands of one model.

    The T tiles and F fingers are counted through all hands; all tiles are taken to touch.

    Parameters
    ----------
    places : TileIndex
        Index of the tiles of all hands.
    hand : HandModel
        Model of all the hands.

    Returns
    -------
    pull : ndarray, shape (F, 3)
        Torque of each joint per newton of tension, M r [m].
    left : ndarray, shape (T,)
        Share of the tension that is left at each tile after friction; of nails zero.
    gain : ndarray, shape (T,)
        Shear of each tile per newton of tension; of nails zero.
    engaged : ndarray, shape (T,)
        Shear of each tile at zero tension per newton of closing tension; of nails zero.
    """
    model = hand.finger
    loss = 1.0 - model.friction
    # what is left of the tension at each phalanx's tile; a base tile comes first
    local: Array = np.full((len(places.phalanges), len(PHALANGES)), loss) ** np.arange(
        len(PHALANGES)
    )
    local[places.base_fingers] *= loss
    left, gain, engaged = np.zeros((3, len(places.hand)))
    left[places.phalanges], left[places.bases] = local, 1.0
    gain[places.phalanges] = local * model.shear_gain
    gain[places.bases] = model.shear_gain[0]
    engaged[places.phalanges] = local * np.array(model.engagement)
    engaged[places.bases] = model.base_engagement
    return local * model.pulley_radii, left, gain, engaged - gain


def frame_axes(known: HandBatch) -> Array:
    """Return along, inward and the place of the proximal joint of each finger, (F, 3, 3), in H."""
    turns = tuple([hand.grasp.outer_rotation for hand in known.hands])
    return known.hands[0].hand.frame_stack(turns).planes.reshape(-1, 3, 3)


class RestingFingers(NamedTuple):
    """Fingers where they closed: what stays when tiles slip.

    Attributes
    ----------
    pull : ndarray, shape (F, 3)
        Torque of each joint per newton of tension [m].
    springs : ndarray, shape (F, 3)
        Torque of each joint's spring, positive if closing [N·m].
    left, gain, engaged : ndarray, shape (T,)
        Share of the tension that is left at each tile, shear of a whole tile per newton of tension,
        and at zero tension [N].
    joints : ndarray, shape (F, 3, 2)
        Position of each joint from the proximal one: along the straight finger, and into the rock
        [m].
    axes : ndarray, shape (F, 1, 6)
        Axis of each proximal joint, as a row for wrenches.
    turns : ndarray, shape (F, 2, 6)
        What is added to that row per metre along the finger and inward.
    moments : ndarray, shape (2, F, 3, 3)
        Moments of unit shears, then of unit normal loads, about the joints [m].
    """

    pull: Array
    springs: Array
    left: Array
    gain: Array
    engaged: Array
    joints: Array
    axes: Array
    turns: Array
    moments: Array

    @classmethod
    def of(cls, known: HandBatch) -> RestingFingers:
        """Return the fingers of settled hands."""
        places, body = known.places, known.hands[0].hand
        pull, left, gain, engaged = tendons_of(places, body)
        springs = known.bends * -np.array(body.finger.joint_stiffness)
        springs -= body.finger.joint_preload
        along, _, joints = frame_axes(known).swapaxes(0, 1)
        across = along[:, [1, 0, 2]] * [-1.0, 1.0, 0.0]
        # the proximal joints' axes as rows for wrenches; what is added per metre along and inward
        axes = wrenches_of(joints, -across)[:, None, [3, 4, 5, 0, 1, 2]]
        turns = np.zeros((len(along), 2, 6))
        turns[:, 0, 2], turns[:, 1, :3] = -1.0, along
        directions = np.empty((*known.angles.shape, 2))
        np.cos(known.angles, out=directions[..., 0])
        np.sin(known.angles, out=directions[..., 1])
        # ones where a phalanx (column) is before a joint (row)
        places_of_joints = body.finger.joint_spacing * np.tri(len(PHALANGES), k=-1) @ directions
        moments = moments_of(
            places_of_joints @ turns + axes, known.points, known.axes, places.phalanges
        )
        engaged *= np.array(known.closing_tensions).take(places.hand)
        return cls(pull, springs, left, gain, engaged, places_of_joints, axes, turns, moments)


def moments_of(rows: Array, points: Array, axes: Array, phalanges: Indices) -> Array:
    """Return the moments of unit shears and unit normal loads about joints, (2, F, 3, 3) [m].

    Axes: joint, phalanx; positive if they would open the joint.

    Parameters
    ----------
    rows : ndarray, shape (F, 3, 6)
        The joints' axes, as rows for wrenches.
    points, axes : ndarray, shapes (at least T, 3), (T, 3, 3)
        Point of each tile in H [m], and unit vectors of its shear, normal and lateral load, in H.
    phalanges : ndarray of int, shape (F, 3)
        Tiles on the phalanges of each finger.
    """
    own, forces = points[phalanges.ravel()], axes[phalanges.ravel(), :2].swapaxes(0, 1)
    wrenches = wrenches_of(np.concatenate((own, own)), forces.reshape(-1, 3))
    wrenches = wrenches.reshape(2, *phalanges.shape, 6)
    return np.asarray(rows @ wrenches.swapaxes(2, 3) * TURNED_PHALANGES)
