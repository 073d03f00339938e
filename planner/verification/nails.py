"""What nails that hook do, for the check of plans: balance, friction and strength.

P across a nail follows from the balance about its pin; A along it is a load of its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.hand import FINGERS, NAIL
from planner.prepare import CONTACTS
from planner.result import PlanArrays
from planner.verification.residuals import COUNT, Names, Residual

__all__ = ["NailLimits", "NailLoads"]


class NailLoads(NamedTuple):
    """What a plan's forces do to k nails that hook.

    Attributes
    ----------
    tiles, fingers : ndarray of int, shape (k,)
        Which of the tiles they are, and whose, counted through all hands.
    angles : ndarray, shape (k,)
        How far each has turned, by where it hooks [rad].
    opening : ndarray, shape (k, 3)
        What keeps the joints of its finger from closing [N·m].
    turning : ndarray, shape (k,)
        What is left of the balance about its pin [N·m].
    reach : ndarray, shape (k,)
        The arm of that [m].
    pressed, aside : ndarray, shape (k,)
        How hard it presses on the rock, and its force along it in the finger's plane [N].
    dragged : ndarray, shape (k,)
        Its whole force along the rock [N].
    used : ndarray, shape (k, 2)
        Utilisations by shear of its finger, and by what its tip bears.
    """

    tiles: Indices
    fingers: Indices
    angles: Array
    opening: Array
    turning: Array
    reach: Array
    pressed: Array
    aside: Array
    dragged: Array
    used: Array


class NailLimits:
    """The nails of settled hands that hook: balance, friction and strength.

    Parameters
    ----------
    names : Names
    """

    def __init__(self, names: Names) -> None:
        known, self._names = names.known, names
        self._tiles = np.flatnonzero(known.touch.contacts == CONTACTS[NAIL])
        self._fingers = known.places.finger[self._tiles]
        body = known.hands[0].hand
        self._nail, self._model, structure = body.nail, body.finger, body.structure
        self._strengths = np.array([-structure.finger_shear, structure.fingertip_force])
        radii = np.array(self._model.pulley_radii)
        # from the base outward, each pulley leaves less of the tension; the pin's is the last
        loss = 1.0 - self._model.friction
        self._local = np.empty((len(self._tiles), len(radii) + 1))
        frames, outs = [], []
        for local, finger in zip(self._local, self._fingers.tolist(), strict=True):
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
        nail, force = self._nail, arrays.forces[self._tiles]
        arm = arrays.points[self._tiles] - self._joints - self._far[0] * self._along
        x, z = (arm * self._along).sum(axis=1), arm[:, 2]
        along, into = (force * self._along).sum(axis=1), force[:, 2]
        angles, reach = np.arctan2(z, x), np.hypot(x, z)
        pulls = self._local * self._pulls * arrays.tensions[self._fingers, None]
        about_pin = x * into - z * along
        opening = np.outer(into, self._far) + about_pin[:, None]
        opening -= pulls[:, :-1] - self._model.joint_preload
        pressed = -(force * self._outs).sum(axis=1)
        return NailLoads(
            tiles=self._tiles,
            fingers=self._fingers,
            angles=angles,
            opening=opening,
            turning=pulls[:, -1] - nail.preload - nail.stiffness * angles - about_pin,
            reach=reach,
            pressed=pressed,
            aside=(force * self._sideways).sum(axis=1),
            dragged=np.linalg.norm(force + pressed[:, None] * self._outs, axis=1),
            used=np.column_stack([along, into]) / self._strengths,
        )

    def recompute(self, nails: NailLoads) -> Iterator[Residual]:
        """Yield what is left of balance and friction, and what is used of fingers' strength."""
        hand = self._fingers // COUNT
        name = self._names.of_fingers(NAIL, self._fingers)
        turning, text = nails.turning / nails.reach, " is out of balance by {:.3g} N·m"
        yield Residual("zero", turning, hand, name, text, (nails.turning,))
        opening, text = (
            nails.opening / self._far,
            " lets a joint of its finger close, by {:.3g} N·m",
        )
        yield Residual("least", opening, hand, name, text, (-nails.opening,))
        held, pressed = self._nail.friction * nails.pressed, nails.pressed
        text = " would slip: {:.3g} N along rock pressed with {:.3g} N"
        grips = np.column_stack([pressed, held - nails.aside, held + nails.aside])
        numbers = nails.dragged, pressed
        yield Residual("least", grips, hand, name, text, numbers)
        yield Residual("least", held - nails.dragged, hand, name, text, numbers, affine=False)
        yield Residual("use", nails.used, hand)
