"""Whether forces on the rock balance joints and tendons (Eqs. 4–8), for the check of plans.

What a plan tells is put into the balance. About joint i, of angle q_i to the phalanx before it, the
forces F_j on the rock of its own phalanx and those beyond turn as much as what the tendon leaves of
its spring,

    Σ_{j ≥ i} (p_j − p_i) × F_j = M_i r_i f − k_i q_i − τ_i,

and a tile carries the shear φ_t M_t (g f + (e_t − g) f_c), with the closing tension f_c at which
its spines engaged and the share φ_t of them that did. Moments are taken about the joints' axes in
H, of the forces where the plan has them, each axis a row (a × p, −a) that is multiplied by a wrench
(F, M) about the origin of H: with a across the finger, a × p = a × p_0 − x e_z + z e_x for a joint
at (x, z) of its plane. Nothing here is shared with the way settled hands find their affine maps
(Eq. 14); only where something is off, the balance is solved for what would be right.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import SKEW, Array
from hand_models.finger import PHALANGES, STOPS
from hand_models.hand import HandModel
from planner.prepare import KEPT, NONE, NOTHING, HandBatch, TileIndex

__all__ = ["LEVER", "Fingers", "JointBalance", "tendons_of", "wrenches_of"]

JOINTS: Final = len(PHALANGES)

SIDES: Final = np.array([{"upper": 1.0, "lower": -1.0}.get(str(stop), 0.0) for stop in STOPS])
"""Which way a joint presses on the limit at which it stands, by code of `STOPS`."""

LEVER: Final = 5e-4
"""Loads whose balance is off by no more than a force at this lever are off by no more than it [m].

That is with the shears' own error, as if all acted a metre out. Normals lie farther from their
joints, but each takes the errors of those beyond it.
"""

NOWHERE: Final = np.zeros(0)
"""Of no joints."""

BEFORE: Final = np.tri(JOINTS, k=-1)
"""Of each joint, the phalanges before it."""

OUTWARD: Final = np.tri(JOINTS).T
"""Of each joint, the phalanges that it turns."""

CROSS: Final = SKEW.transpose(0, 2, 1).reshape(9, 3)
"""From p ⊗ F to the moment p × F."""


def wrenches_of(points: Array, forces: Array) -> Array:
    """Return the wrenches (n, 6) of forces at some places, both (n, 3)."""
    moments = (points[:, :, None] * forces[:, None]).reshape(-1, len(CROSS)) @ CROSS
    return np.concatenate((forces, moments), axis=1)


@lru_cache(maxsize=KEPT)
def tendons_of(places: TileIndex, hand: HandModel) -> tuple[Array, Array, Array, Array]:
    """Return what the tendons of hands do, all of one model whose tiles all touch.

    Returns
    -------
    pull : ndarray, shape (F, 3)
        M r of the joints [m].
    left : ndarray, shape (T,)
        What is left of the tension at each tile; of nails zero.
    gain, engaged : ndarray, shape (T,)
        Shear of each tile per newton of tension, and at zero tension per newton of closing tension;
        of nails zero.
    """
    model = hand.finger
    loss = 1.0 - model.friction
    # what is left of the tension at each phalanx's tile; a base tile comes first
    local: Array = np.full((len(places.phalanges), JOINTS), loss) ** np.arange(JOINTS)
    local[places.base_fingers] *= loss
    left, gain, engaged = np.zeros((3, len(places.hand)))
    left[places.phalanges], left[places.bases] = local, 1.0
    gain[places.phalanges] = local * model.shear_gain
    gain[places.bases] = model.shear_gain[0]
    engaged[places.phalanges] = local * (np.array(model.engagement) - model.shear_gain)
    engaged[places.bases] = model.base_engagement - model.shear_gain[0]
    return local * model.pulley_radii, left, gain, engaged


class Fingers(NamedTuple):
    """Fingers on their holds, and what they carry but for their tiles' normals.

    Attributes
    ----------
    shear : ndarray, shape (T,)
        Of each tile [N].
    torques : ndarray, shape (F, 3)
        What tendons leave of the joints' springs [N·m].
    joints : ndarray, shape (F, 3, 2)
        Along each straight finger and into the rock, from its proximal joint [m].
    points, axes : ndarray, shapes (T + …, 3), (T, 3, 3)
        Of the tiles.
    """

    shear: Array
    torques: Array
    joints: Array
    points: Array
    axes: Array


class JointBalance:
    """The balance of the fingers of settled hands.

    Parameters
    ----------
    known : HandBatch

    Attributes
    ----------
    held : ndarray of bool, shape (F, 3), or None
        Joints that a stop holds, or whose finger bears nothing; None where none are.
    stop_fingers, stop_joints : ndarray of int, shape (k,)
        Joints that stand at a limit, of fingers that touch rock.
    """

    def __init__(self, known: HandBatch) -> None:
        hands, places, touch = known.hands, known.places, known.touch
        self._known, body = known, hands[0].hand
        self._pull, _, gain, engaged = tendons_of(places, body)
        closing = np.array([hand.closing_tension for hand in hands])
        self._shear = engaged * closing.take(places.hand) * known.engagement
        self._gain = gain * known.engagement
        self._rest = known.bends * -np.array(body.finger.joint_stiffness)
        self._rest -= body.finger.joint_preload
        self._planes = _planes_of(body, tuple([hand.grasp.outer_rotation for hand in hands]))
        directions = np.empty((*known.angles.shape, 2))
        np.cos(known.angles, out=directions[:, :, 0])
        np.sin(known.angles, out=directions[:, :, 1])
        self._joints = body.finger.joint_spacing * BEFORE @ directions
        self._axes = self._axes_of(self._joints)

        self.held: NDArray[np.bool_] | None = None
        self.stop_fingers = self.stop_joints = NONE
        if len(touch.touching) < len(places.hand):
            self._bears = touch.contacts[places.phalanges] != NOTHING
            alone = ~self._bears.any(axis=1, keepdims=True)
            self.held = (known.stops > 0) | alone
            sides = SIDES[known.stops] * ~alone
            self.stop_fingers, self.stop_joints = sides.nonzero()
            self._sides = sides[self.stop_fingers, self.stop_joints]

    def shears(self, tensions: Array) -> Array:
        """Return the shear of each tile at tensions (F,) of the tendons, shape (T,); of nails 0."""
        found = tensions.take(self._known.places.finger)
        found *= self._gain
        found += self._shear
        return found

    def left(self, tensions: Array, wrenches: Array) -> Array:
        """Return what is left of each joint's balance, closing it, shape (F, 3) [N·m].

        Parameters
        ----------
        tensions : ndarray, shape (F,)
        wrenches : ndarray, shape (T + …, 6)
            Of each tile on the rock about the origin of H, first those of the tiles.
        """
        found = self._pull * tensions[:, None]
        found += self._rest
        found -= _turned(self._axes, wrenches.take(self._known.places.phalanges, 0))
        return found

    def stops(self, left: Array) -> Array:
        """Return how each joint that stands at a limit presses on it, shape (k,) [N·m]."""
        if not len(self.stop_fingers):
            return NOWHERE
        return np.asarray(left[self.stop_fingers, self.stop_joints] * self._sides)

    def solved(self, fingers: Fingers) -> tuple[Array, Array]:
        """Solve the balance of the joints that are free for the normals.

        Returns
        -------
        normal : ndarray, shape (T,)
            Of each tile [N]; of nails zero.
        left : ndarray, shape (F, 3)
            As of `left`.

        Raises
        ------
        numpy.linalg.LinAlgError
            If contacts do not hold the joints that are free.
        """
        phalanges, points = self._known.places.phalanges, fingers.points[: len(fingers.shear)]
        along = wrenches_of(points, fingers.axes[:, 0] * fingers.shear[:, None])
        into = wrenches_of(points, fingers.axes[:, 1])
        rows = self._axes_of(fingers.joints)
        left = fingers.torques - _turned(rows, along[phalanges])
        turns = rows @ into[phalanges].transpose(0, 2, 1) * OUTWARD
        A, b = turns.copy(), left.copy()
        if self.held is not None:
            which, held = self.held.nonzero()
            idle, phalanx = (~self._bears).nonzero()
            if not np.array_equal(which, idle):
                raise np.linalg.LinAlgError("contacts do not hold the joints that are free")
            # in place of the balance of a joint that is held, the normal of what bears nothing is 0
            A[which, held], b[which, held] = 0.0, 0.0
            A[which, held, phalanx] = 1.0
        normals = np.linalg.solve(A, b[:, :, None])
        normal = np.zeros(len(fingers.shear))
        normal[phalanges] = normals[:, :, 0]
        return normal, left - (turns @ normals)[:, :, 0]

    def fingers(self, tensions: Array) -> Fingers:
        """Return the fingers at rest, with their tendons' tensions (F,)."""
        known = self._known
        torques = self._pull * tensions[:, None] + self._rest
        return Fingers(self.shears(tensions), torques, self._joints, known.points, known.axes)

    def _axes_of(self, joints: Array) -> Array:
        """Return the joints' axes where these are, as rows for wrenches, shape (F, 3, 6)."""
        axes, turns = self._planes
        return np.asarray(joints @ turns + axes)


def _turned(axes: Array, wrenches: Array) -> Array:
    """Return what wrenches of each finger's phalanges turn its joints with, shape (F, 3) [N·m]."""
    return np.asarray(np.add.reduce(axes * (OUTWARD @ wrenches), axis=2))


@lru_cache(maxsize=KEPT)
def _planes_of(hand: HandModel, rotations: tuple[float, ...]) -> tuple[Array, Array]:
    """Return the planes of the fingers of hands of one model turned so far.

    Returns
    -------
    axes : ndarray, shape (F, 1, 6)
        The proximal joints' axes, as rows for wrenches about the origin of H.
    turns : ndarray, shape (F, 2, 6)
        What is added to those per metre along the finger and into the rock.
    """
    frames = [frame for rotation in rotations for frame in hand.frames(rotation)]
    axes, turns = np.zeros((len(frames), 1, 6)), np.zeros((len(frames), 2, 6))
    for axis, turn, frame in zip(axes[:, 0], turns, frames, strict=True):
        across = np.cross([0.0, 0.0, 1.0], frame.along)
        axis[:3], axis[3:] = np.cross(across, frame.joint), -across
        turn[0, 2], turn[1, :3] = -1.0, frame.along
    return axes, turns
