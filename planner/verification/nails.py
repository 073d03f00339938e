"""What nails that hook do, for the check of plans: balance, friction and strength.

P across a nail follows from the balance about its pin; A along it is a load of its own.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.hand import FINGERS, NAIL
from planner.prepare import CONTACTS, NONE, HandBatch
from planner.result import PlanArrays

__all__ = ["NO_NAILS", "NailLoads", "Nails"]


class NailLoads(NamedTuple):
    """What a plan's forces do to k nails that hook.

    Attributes
    ----------
    fingers : ndarray of int, shape (k,)
        Whose they are, counted through all hands.
    far : ndarray, shape (3,)
        How far the pin of a straight finger is from its joints [m].
    angles : ndarray, shape (k,)
        How far each has turned, by where it hooks [rad].
    opening : ndarray, shape (k, 3)
        What keeps the joints of its finger from closing, over those [N].
    turning : ndarray, shape (k,)
        What is left of the balance about its pin, over its arm [N].
    reach : ndarray, shape (k,)
        That arm [m].
    pressed : ndarray, shape (k,)
        How hard it presses on the rock [N].
    dragged : ndarray, shape (k,)
        Its force along the rock [N].
    within : ndarray, shape (k,)
        What friction bears beyond that [N].
    grips : ndarray, shape (k, 3)
        How hard it presses, and what friction bears beyond its force in the finger's plane, one way
        and the other: affine in the loads [N].
    used : ndarray, shape (k, 2)
        Utilisations by shear of its finger, and by what its tip bears.
    """

    fingers: Indices
    far: Array
    angles: Array
    opening: Array
    turning: Array
    reach: Array
    pressed: Array
    dragged: Array
    within: Array
    grips: Array
    used: Array


NO_NAILS: Final = NailLoads(NONE, *np.zeros((8, 0)), *np.zeros((2, 0, 3)))
"""Those of hands of which no nail hooks."""


class Nails:
    """The nails of settled hands that hook.

    Parameters
    ----------
    known : HandBatch

    Attributes
    ----------
    tiles, fingers : ndarray of int, shape (k,)
        Which of the tiles they are, and whose.
    """

    def __init__(self, known: HandBatch) -> None:
        self.tiles = np.flatnonzero(known.touch.contacts == CONTACTS[NAIL])
        self.fingers = known.places.finger[self.tiles]
        body = known.hands[0].hand
        self._nail, self._model, structure = body.nail, body.finger, body.structure
        self._strengths = np.array([-structure.finger_shear, structure.fingertip_force])
        radii = np.array(self._model.pulley_radii)
        # from the base outward, each pulley leaves less of the tension; the pin's is the last
        loss = 1.0 - self._model.friction
        self._local = np.empty((len(self.tiles), len(radii) + 1))
        frames, outs = [], []
        for local, finger in zip(self._local, self.fingers.tolist(), strict=True):
            h, i = divmod(finger, len(FINGERS))
            hand = known.hands[h]
            local[:] = loss ** (np.arange(len(local)) + FINGERS[i].startswith("outer"))
            frames.append(hand.hand.frames(hand.grasp.outer_rotation)[i])
            outs.append(hand.nail_normals[i])
        self._far: Array = self._model.joint_spacing * np.arange(len(radii), 0.0, -1.0)
        self._pulls = np.append(radii, self._nail.pulley_radius)
        self._along = np.array([frame.along for frame in frames]).reshape(-1, 3)
        self._joints = np.array([frame.joint for frame in frames]).reshape(-1, 3)
        self._outs = np.array(outs).reshape(-1, 3)
        self._sideways = np.cross(self._outs, np.cross(self._along, [0.0, 0.0, 1.0]))

    def loads(self, arrays: PlanArrays) -> NailLoads:
        """Return what a plan's forces do to them."""
        nail, force = self._nail, arrays.forces[self.tiles]
        arm = arrays.points[self.tiles] - self._joints - self._far[0] * self._along
        x, z = (arm * self._along).sum(axis=1), arm[:, 2]
        along, into = (force * self._along).sum(axis=1), force[:, 2]
        angles, reach = np.arctan2(z, x), np.hypot(x, z)
        pulls = self._local * self._pulls * arrays.tensions[self.fingers, None]
        about_pin = x * into - z * along
        opening = np.outer(into, self._far) + about_pin[:, None]
        opening -= pulls[:, :-1] - self._model.joint_preload
        turning = pulls[:, -1] - nail.preload - nail.stiffness * angles - about_pin
        pressed = -(force * self._outs).sum(axis=1)
        dragged = np.linalg.norm(force + pressed[:, None] * self._outs, axis=1)
        aside, held = (force * self._sideways).sum(axis=1), nail.friction * pressed
        return NailLoads(
            fingers=self.fingers,
            far=self._far,
            angles=angles,
            opening=opening / self._far,
            turning=turning / reach,
            reach=reach,
            pressed=pressed,
            dragged=dragged,
            within=held - dragged,
            grips=np.column_stack([pressed, held - aside, held + aside]),
            used=np.column_stack([along, into]) / self._strengths,
        )
