"""Nails that hook, in the check of plans: balance, friction and strength.

P across a nail follows from the balance about its pin; A along it is a load of its own.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from hand_models.base import Array
from hand_models.hand import FINGERS, NAIL
from planner.prepare import CONTACTS
from planner.result import PlanArrays
from planner.verification.residuals import COUNT, Names, Residual

__all__ = ["NailLimits"]

NONE: Final = np.zeros(0)
"""Angles and utilisations where no nail hooks."""


class NailLimits:
    """The nails of settled hands that hook: balance, friction and strength.

    Parameters
    ----------
    names : Names

    Attributes
    ----------
    tiles, fingers : ndarray of int, shape (k,)
        Which of the tiles they are, and whose, counted through all hands.
    """

    def __init__(self, names: Names) -> None:
        known, self._names = names.known, names
        self.tiles = np.flatnonzero(known.touch.contacts == CONTACTS[NAIL])
        self.fingers = known.places.finger[self.tiles]
        if not len(self.tiles):
            return
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

    def recompute(self, arrays: PlanArrays) -> tuple[list[Residual], Array, Array]:
        """Return what a plan's forces leave of balance and friction of k nails.

        Returns
        -------
        residuals : list of Residual
        angles : ndarray, shape (k,)
            How far each has turned, by where it hooks [rad].
        used : ndarray, shape (k,)
            Utilisation of each, by shear of its finger and by what its tip bears.
        """
        if not len(self.tiles):
            return [], NONE, NONE
        nail, force = self._nail, arrays.forces[self.tiles]
        hand, name = self.fingers // COUNT, self._names.of_fingers(NAIL, self.fingers)
        arm = arrays.points[self.tiles] - self._joints - self._far[0] * self._along
        x, z = (arm * self._along).sum(axis=1), arm[:, 2]
        along, into = (force * self._along).sum(axis=1), force[:, 2]
        angles, reach = np.arctan2(z, x), np.hypot(x, z)
        pulls = self._local * self._pulls * arrays.tensions[self.fingers, None]
        about_pin = x * into - z * along
        # what keeps the joints of its finger from closing, and what is left about its pin
        opening = np.outer(into, self._far) + about_pin[:, None]
        opening -= pulls[:, :-1] - self._model.joint_preload
        turning = pulls[:, -1] - nail.preload - nail.stiffness * angles - about_pin
        pressed = -(force * self._outs).sum(axis=1)
        # along the rock: in the finger's plane, and in all
        aside = (force * self._sideways).sum(axis=1)
        dragged = np.linalg.norm(force + pressed[:, None] * self._outs, axis=1)
        held = nail.friction * pressed
        grips = np.column_stack([pressed, held - aside, held + aside])
        used = np.column_stack([along, into]) / self._strengths
        balanced = " is out of balance by {:.3g} N·m"
        closes = " lets a joint of its finger close, by {:.3g} N·m"
        slips = " would slip: {:.3g} N along rock pressed with {:.3g} N"
        numbers = dragged, pressed
        residuals = [
            Residual("zero", turning / reach, hand, name, balanced, (turning,)),
            Residual("least", opening / self._far, hand, name, closes, (-opening,)),
            Residual("least", grips, hand, name, slips, numbers),
            Residual("least", held - dragged, hand, name, slips, numbers, affine=False),
            Residual("use", used, hand),
        ]
        return residuals, angles, np.maximum.reduce(used, axis=1)
