"""Check tendons, motors, winches and nails that hook, and the published figures of fingers.

The force P across a nail follows from the balance about its pin; the force A along it is a load of
the program.
"""

from __future__ import annotations

from copy import copy
from enum import IntEnum

import numpy as np

from hand_models.base import BASE_TOLERANCES, Array, Indices
from hand_models.hand import FINGERS, NAIL
from planner.prepare import CONTACT_CODES, HandBatch
from planner.result import PlanArrays
from planner.verification.finger_geometry import frame_axes, wrenches_of
from planner.verification.residuals import (
    FINGER_COUNT,
    PartNames,
    Recomputed,
    RecomputedNails,
    Residual,
    ResidualLimits,
    claim,
)

__all__ = ["DriveLimits", "NailLimits", "TwistLimits"]


class _Row(IntEnum):
    """Rows of what tensions do: motors and winches as `PlanArrays.drives`, then utilisations."""

    TORQUE = 0
    CURRENT = 1
    WINCH = 2
    TENDON = 3
    TORQUE_USE = 4
    CURRENT_USE = 5
    SHEAR = 6  # of a finger
    LATERAL = 7  # reactions, of a row to either side
    TIP = 9


class DriveLimits(ResidualLimits):
    """Limits of tendons, motors and fingers, and the angles of the winches.

    Parameters
    ----------
    names : PartNames
        Names of the hands' parts.
    left : ndarray, shape (T,)
        Share of a tendon's tension that is left at each tile.
    strength : float
        Largest tension of every tendon [N].
    hooked : ndarray of int, shape (k,)
        Indices of the fingers whose nails hook, counted through all hands.
    """

    def __init__(self, names: PartNames, left: Array, strength: float, hooked: Indices) -> None:
        known = names.known
        hands, index, body = known.hands, known.places, known.hands[0].hand
        self._names, self._places, self._body, self._hooked = names, index, body, hooked
        self._lateral = np.array([hand.surface.lateral_limit for hand in hands])[index.hand]
        self._aside = self._per_reaction(known)
        drive, nail = body.drive, body.nail
        self._winch = drive.winch_radius
        # Eq. 5: a tile's spring and the rock's shear balance the tendon's two strands
        travel = drive.pulley_ratio / drive.tile_stiffness / self._winch
        torque = self._winch / drive.gear_ratio / drive.efficiency
        current, idle = torque / drive.torque_constant, drive.no_load_current
        driven = [torque / drive.maximum_torque, current / drive.maximum_current]
        self._per_newton, self._at_zero = np.zeros((2, _Row.TIP + 1, FINGER_COUNT * len(hands)))
        ratings = np.array([torque, current, 0.0, 1.0 / strength, *driven])
        self._per_newton[: _Row.SHEAR] = ratings[:, None]
        strands = np.add.reduceat(left, index.first_of_finger)
        self._per_newton[_Row.WINCH] = travel * drive.pulley_ratio * strands
        self._at_zero[_Row.CURRENT] = idle
        self._at_zero[_Row.CURRENT_USE] = idle / drive.maximum_current
        bent = known.bends @ np.array(body.finger.pulley_radii)
        self._at_zero[_Row.WINCH] = (bent + nail.pulley_radius * nail.retraction) / self._winch
        # shears of a finger's tiles together pull them away from the winch
        self._per_shear = np.zeros((_Row.TIP + 1, 1))
        self._per_shear[_Row.WINCH] = -travel
        self._per_shear[_Row.SHEAR] = 1.0 / body.structure.finger_shear
        self._hand = np.arange(len(hands)).repeat(FINGER_COUNT)
        self._hand_of_drive = np.tile(self._hand, _Row.TENDON)

    def _per_reaction(self, known: HandBatch) -> Array:
        """Return what a lateral reaction to either side uses per newton, shape (2, F) [1/N]."""
        aside = self._lateral * known.engagement * known.touch.touches
        aside = np.add.reduceat(aside, self._places.first_of_finger)
        # fingers without rock have no reaction
        return np.array([[1.0], [-1.0]]) / np.where(aside > 0.0, aside, np.inf)

    def after_slips(self, names: PartNames) -> DriveLimits:
        """Return the limits of the same hands after tiles have slipped, by the names of these."""
        other = copy(self)
        other._names, other._aside = names, other._per_reaction(names.known)
        return other

    def recompute(self, again: Recomputed) -> list[Residual]:
        """Return the utilisations of tendons, motors and fingers, and errors of reported drives.

        Drives are motor torques [N·m], motor currents [A] and winch angles [rad].
        """
        first, planned = self._places.first_of_finger, again.arrays
        f, nail = planned.tensions, self._body.nail
        shear, normal, lateral = again.loads.T
        uses = self._per_newton * f
        uses += self._at_zero
        uses += self._per_shear * np.add.reduceat(shear, first)
        uses[_Row.LATERAL : _Row.TIP] = self._aside * np.add.reduceat(lateral, first)
        uses[_Row.TIP] = normal.take(self._places.tips) / self._body.structure.fingertip_force
        if again.wound is not f:
            # the motors of hands that float stand still where they have tightened their tendons
            uses[_Row.WINCH] += self._per_newton[_Row.WINCH] * (again.wound - f)
            uses[_Row.WINCH] += self._per_shear[_Row.WINCH] * np.add.reduceat(
                again.drawn - shear, first
            )
        if len(self._hooked):
            turned = again.nails.angles - nail.retraction
            uses[_Row.WINCH, self._hooked] += nail.pulley_radius / self._winch * turned
        own, said, hand = uses[: _Row.TENDON].ravel(), planned.drives.ravel(), self._hand_of_drive
        return [
            Residual("use", uses[_Row.TENDON :].T, self._hand),
            claim(own, said, hand, 1e-9, self._name),
        ]

    def _name(self, i: int) -> str:
        drive, finger = divmod(i, len(self._hand))
        what = ("motor torque", "motor current", "winch angle")[drive]
        return self._names.finger(what, finger)


class TwistLimits(ResidualLimits):
    """Limits of the moments about fingers' phalanges, from tiles that bear on one side.

    Parameters
    ----------
    known : HandBatch
        The hands on their holds.
    """

    def __init__(self, known: HandBatch) -> None:
        along, _, joints = frame_axes(known).swapaxes(0, 1)
        across = np.array([-1.0, 1.0, 0.0]) * along[:, [1, 0, 2]]
        arms = known.points[known.places.phalanges] - joints[:, None]
        beside = np.abs((arms * across[:, None]).sum(axis=2)).max(axis=1)
        self._fingers = own = np.flatnonzero(beside > BASE_TOLERANCES.length)
        self._tiles, self._joints = known.places.phalanges[own], joints[own, None]
        angles = known.angles[own, :, None]
        # unit vectors along the phalanges
        self._axes = np.cos(angles) * along[own, None] + np.sin(angles) * [0.0, 0.0, 1.0]
        self._most = known.hands[0].hand.structure.finger_twist

    def recompute(self, again: Recomputed) -> list[Residual]:
        """Return the utilisations of joints by moments that the tiles from there on exert.

        Forces in the finger's plane count, about an axis in that plane: whatever its joint.
        """
        if not len(self._fingers):
            return []
        tiles, planned = self._tiles, again.arrays
        in_plane = again.loads[tiles][..., :2, None] * planned.axes[tiles][..., :2, :]
        arms, forces = planned.points[tiles] - self._joints, np.add.reduce(in_plane, axis=2)
        moments = wrenches_of(arms.reshape(-1, 3), forces.reshape(-1, 3))[:, 3:].reshape(arms.shape)
        beyond = np.cumsum(moments[:, ::-1], axis=1)[:, ::-1]
        used = (beyond * self._axes).sum(axis=2) / self._most
        return [Residual("use", np.hstack([used, -used]), self._fingers // FINGER_COUNT)]


class NailLimits:
    """Limits of the nails that hook: balance, friction and strength.

    Parameters
    ----------
    names : PartNames
        Names of the hands' parts.

    Attributes
    ----------
    tiles : ndarray of int, shape (k,)
        Index of each nail that hooks, among the tiles and nails of all hands.
    fingers : ndarray of int, shape (k,)
        Index of each such nail's finger, among the fingers of all hands.
    """

    def __init__(self, names: PartNames) -> None:
        known, self._names = names.known, names
        self.tiles = np.flatnonzero(known.touch.contacts == CONTACT_CODES[NAIL])
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

    def recompute(self, arrays: PlanArrays) -> RecomputedNails:
        """Return angles, utilisations, and residuals of balance and friction of the k nails."""
        if not len(self.tiles):
            return RecomputedNails([], np.zeros(0), np.zeros(0))
        nail, force = self._nail, arrays.forces[self.tiles]
        hand, name = self.fingers // FINGER_COUNT, self._names.of_fingers(NAIL, self.fingers)
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
        return RecomputedNails(residuals, angles, np.maximum.reduce(used, axis=1))
