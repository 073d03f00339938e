"""Tendons, motors, winches and the published figures of fingers, recomputed from tensions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from hand_models.base import Array, Indices
from planner.verification.residuals import COUNT, Names, Recomputed, Residual, claim

__all__ = ["DriveLimits"]

DRIVE: Final = 1e-9
"""Largest error of a motor's torque, current or winch angle that a plan says, relative."""

DRIVES: Final = ("motor torque", "motor current", "winch angle")
"""Rows of `PlanArrays.drives`."""

WINCH, DRIVEN, SHEAR, LATERAL, TIP = 2, 3, 6, slice(7, 9), 9
"""Rows of what tensions do, after the motors' torque and current: winches, the first that is a
utilisation, shears of fingers, their lateral reactions to either side, their tips."""

SIDES: Final = np.array([[1.0], [-1.0]])
"""Signs of a lateral reaction to either side."""


class DriveLimits:
    """Limits of tendons, motors and fingers, and the angles of their winches.

    Parameters
    ----------
    names : Names
    left : ndarray, shape (T,)
        Part of a tendon's tension that is left at each tile.
    strength : float
        What every tendon may hold [N].
    """

    def __init__(self, names: Names, left: Array, strength: float) -> None:
        known = names.known
        hands, index, body = known.hands, known.places, known.hands[0].hand
        self._names, self._places, self._body = names, index, body
        lateral = np.array([hand.surface.lateral_limit for hand in hands])[index.hand]
        aside = lateral * known.engagement * known.touch.touches
        aside = np.add.reduceat(aside, index.first_of_finger)
        # fingers without rock have no reaction
        self._aside = SIDES / np.where(aside > 0.0, aside, np.inf)
        drive, nail = body.drive, body.nail
        self._winch = drive.winch_radius
        # Eq. 5: a tile's spring and the rock's shear balance the tendon's two strands
        travel = drive.pulley_ratio / drive.tile_stiffness / self._winch
        torque = self._winch / drive.gear_ratio / drive.efficiency
        current, idle = torque / drive.torque_constant, drive.no_load_current
        driven = [torque / drive.maximum_torque, current / drive.maximum_current]
        self._per_newton, self._at_zero = np.zeros((2, TIP + 1, COUNT * len(hands)))
        ratings = np.array([torque, current, 0.0, 1.0 / strength, *driven])
        self._per_newton[:SHEAR] = ratings[:, None]
        strands = np.add.reduceat(left, index.first_of_finger)
        self._per_newton[WINCH] = travel * drive.pulley_ratio * strands
        self._at_zero[1], self._at_zero[SHEAR - 1] = idle, idle / drive.maximum_current
        bent = known.bends @ np.array(body.finger.pulley_radii)
        self._at_zero[WINCH] = (bent + nail.pulley_radius * nail.retraction) / self._winch
        # shears of a finger's tiles together pull them away from the winch
        self._per_shear = np.zeros((TIP + 1, 1))
        self._per_shear[WINCH] = -travel
        self._per_shear[SHEAR] = 1.0 / body.structure.finger_shear
        self._hand = np.arange(len(hands)).repeat(COUNT)
        self._hand_of_drive = np.tile(self._hand, len(DRIVES))

    def recompute(self, again: Recomputed, hooked: Indices, angles: Array) -> Iterator[Residual]:
        """Yield what tensions use of tendons, motors and fingers, and how far drives are off.

        ``hooked``: fingers whose nails hook, and by which angles these have turned [rad].
        """
        first, planned = self._places.first_of_finger, again.arrays
        f, nail = planned.tensions, self._body.nail
        shear, normal, lateral = again.loads.T
        uses = self._per_newton * f
        uses += self._at_zero
        uses += self._per_shear * np.add.reduceat(shear, first)
        uses[LATERAL] = self._aside * np.add.reduceat(lateral, first)
        uses[TIP] = normal.take(self._places.tips) / self._body.structure.fingertip_force
        if again.wound is not f:
            # the motors of hands that float stand still where they have tightened their tendons
            uses[WINCH] += self._per_newton[WINCH] * (again.wound - f)
            uses[WINCH] += self._per_shear[WINCH] * np.add.reduceat(again.drawn - shear, first)
        if len(hooked):
            turned = angles - nail.retraction
            uses[WINCH, hooked] += nail.pulley_radius / self._winch * turned
        yield Residual("use", uses[DRIVEN:].T, self._hand)
        own, said, hand = uses[:DRIVEN].ravel(), planned.drives.ravel(), self._hand_of_drive
        yield claim(own, said, hand, DRIVE, self._name)

    def _name(self, i: int) -> str:
        drive, finger = divmod(i, len(self._hand))
        return self._names.finger(DRIVES[drive], finger)
