"""Whether forces on the rock balance joints and tendons (Eqs. 4–8), for the check of plans.

Nothing is solved here: what a plan tells is put into the balance. About joint i, of angle q_i to
the phalanx before it, the forces F_j on the rock of its own phalanx and those beyond turn as much
as what the tendon leaves of its spring,

    Σ_{j ≥ i} (p_j − p_i) × F_j = M_i r_i f − k_i q_i − τ_i,

and a tile carries the shear φ_t M_t (g f + (e_t − g) f_c), with the closing tension f_c at which
its spines engaged and the share φ_t of them that did. Moments are taken about the joints' axes in
H, of the forces where the plan has them, each axis a row (a × p, −a) that is multiplied by a wrench
(F, M) about the origin of H: with a across the finger, a × p = a × p_0 − x e_z + z e_x for a joint
at (x, z) of its plane.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array
from hand_models.hand import HandModel
from planner.prepare import KEPT, NONE, NOTHING, HandBatch
from planner.verification.equilibrium import JOINTS, SIDES, tendons_of

__all__ = ["LEVER", "JointBalance"]

LEVER: Final = 5e-4
"""Loads whose balance is off by no more than a force at this lever are off by no more than it [m].

That is with the shears' own error, as if all acted a metre out. Normals lie farther from their
joints, but each takes the errors of those beyond it.
"""

NOWHERE: Final = np.zeros(0)
"""Of no joints."""

OUTWARD: Final = np.tri(JOINTS).T
"""Of each joint, the phalanges that it turns."""


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
        self._places, body = places, hands[0].hand
        self._tendons = tendons = tendons_of(places, body)
        closing = np.array([hand.closing_tension for hand in hands])
        self._shear = tendons.engaged * closing.take(places.hand) * known.engagement
        self._gain = tendons.gain * known.engagement
        self._rest = known.bends * -tendons.stiffness - tendons.preload
        planes = _planes_of(body, tuple([hand.grasp.outer_rotation for hand in hands]))
        directions = np.empty((*known.angles.shape, 2))
        np.cos(known.angles, out=directions[:, :, 0])
        np.sin(known.angles, out=directions[:, :, 1])
        self._axes = planes.chain @ directions @ planes.turns
        self._axes += planes.axes

        self.held: NDArray[np.bool_] | None = None
        self.stop_fingers = self.stop_joints = NONE
        if len(touch.touching) < len(places.hand):
            bears = touch.contacts[places.phalanges] != NOTHING
            alone = ~bears.any(axis=1, keepdims=True)
            self.held = (known.stops > 0) | alone
            sides = SIDES[known.stops] * ~alone
            self.stop_fingers, self.stop_joints = sides.nonzero()
            self._sides = sides[self.stop_fingers, self.stop_joints]

    def shears(self, tensions: Array) -> Array:
        """Return the shear of each tile at tensions (F,) of the tendons, shape (T,); of nails 0."""
        found = tensions.take(self._places.finger)
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
        outward = OUTWARD @ wrenches.take(self._places.phalanges, 0)
        found = self._tendons.pull * tensions[:, None]
        found += self._rest
        found -= np.add.reduce(self._axes * outward, axis=2)
        return found

    def stops(self, left: Array) -> Array:
        """Return how each joint that stands at a limit presses on it, shape (k,) [N·m]."""
        if not len(self.stop_fingers):
            return NOWHERE
        return np.asarray(left[self.stop_fingers, self.stop_joints] * self._sides)


class _Planes(NamedTuple):
    """Planes of the fingers of some hands.

    Attributes
    ----------
    axes : ndarray, shape (F, 1, 6)
        The proximal joints' axes, as rows for wrenches about the origin of H.
    turns : ndarray, shape (F, 2, 6)
        What is added to those per metre along the finger and into the rock.
    chain : ndarray, shape (3, 3)
        From directions of the phalanges to places of the joints [m].
    """

    axes: Array
    turns: Array
    chain: Array


@lru_cache(maxsize=KEPT)
def _planes_of(hand: HandModel, rotations: tuple[float, ...]) -> _Planes:
    """Return the planes of hands of one model turned so far."""
    frames = [frame for rotation in rotations for frame in hand.frames(rotation)]
    axes, turns = np.zeros((len(frames), 1, 6)), np.zeros((len(frames), 2, 6))
    for axis, turn, frame in zip(axes[:, 0], turns, frames, strict=True):
        across = np.cross([0.0, 0.0, 1.0], frame.along)
        axis[:3], axis[3:] = np.cross(across, frame.joint), -across
        turn[0, 2], turn[1, :3] = -1.0, frame.along
    return _Planes(axes, turns, hand.finger.joint_spacing * np.tri(JOINTS, k=-1))
