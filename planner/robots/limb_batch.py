"""Limbs whose hands are to be put somewhere, moved together, with one pass of Pinocchio for all."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import pinocchio as pin

from hand_models.base import Array, Indices, Pose
from planner.robots.robot import Robot

__all__ = ["Efforts", "LimbBatch"]

ROUNDING: Final = 1e-9
"""Part of its reach that a stretched limb's end may be beyond it by rounding."""


class LimbBatch:
    """L limbs of up to m joints, and the poses that their hands are to have.

    Angles are (L, m) [rad]. A hand's error is the twist in H that is missing, its Jacobian that of
    the hand, both with lengths over the limb's reach. Limbs of fewer joints have columns of zeros
    at the end.

    Parameters
    ----------
    robot : Robot
    poses : mapping of str to Pose
        H in B, by limb.

    Attributes
    ----------
    limbs : tuple of str
    joints : list of int
        How many each limb has.
    lower, upper : ndarray, shape (L, m)
        Limits of the angles [rad].
    reach : ndarray, shape (L,)
        [m]
    beyond : ndarray, shape (L,)
        How far each pose is out of reach of the limb, stretched out [m]; zero if it is not.
    """

    def __init__(self, robot: Robot, poses: Mapping[str, Pose]) -> None:
        model = robot.model
        self.robot = robot
        self.poses = dict(poses)
        self.limbs = tuple(poses)
        self.joints = [len(model.joint_names[limb]) for limb in poses]
        self.shape = len(poses), max(self.joints)
        self.lower, self.upper = np.zeros(self.shape), np.zeros(self.shape)
        for i, (limb, n) in enumerate(zip(poses, self.joints, strict=True)):
            self.lower[i, :n] = model.lower[limb]
            self.upper[i, :n] = model.upper[limb]
        self.reach = np.array([robot.reaches[limb] for limb in poses])
        beyond = np.array([robot.beyond(limb, pose) for limb, pose in poses.items()])
        self.beyond = np.where(beyond > ROUNDING * self.reach, beyond, 0.0)
        self._there = np.arange(self.shape[1]) < np.array(self.joints)[:, None]
        self._places: Indices = np.concatenate([model.places[limb] for limb in poses])
        self._continuous = np.concatenate([model.continuous[limb] for limb in poses])
        self._turns = bool(self._continuous.any())
        self._neutral = model.configuration({})
        root = model.built.body
        targets = [root @ pose for pose in poses.values()]
        self._targets = [pin.SE3(target.rotation, target.position) for target in targets]
        self._frames = [model.built.frames[limb] for limb in poses]
        self._columns = [model.columns[limb] for limb in poses]

    def by_limb(self, angles: Array) -> dict[str, Array]:
        """Return the limbs' angles by name."""
        return {limb: angles[i, : self.joints[i]] for i, limb in enumerate(self.limbs)}

    def part(self, chosen: Indices) -> LimbBatch:
        """Return the batch of some of the limbs."""
        if len(chosen) == len(self.limbs):
            return self
        names = [self.limbs[i] for i in chosen]
        return LimbBatch(self.robot, {limb: self.poses[limb] for limb in names})

    def configuration(self, angles: Array) -> Array:
        """Return Pinocchio's configuration of angles (L, m)."""
        q = self._neutral.copy()
        values = angles[self._there]
        q[self._places] = values
        if self._turns:
            turning, values = self._places[self._continuous], values[self._continuous]
            q[turning], q[turning + 1] = np.cos(values), np.sin(values)
        return q

    def errors(self, angles: Array) -> tuple[Array, Array]:
        """Return the hands' errors and their Jacobians.

        Parameters
        ----------
        angles : ndarray, shape (S, L, m)
            Of S postures.

        Returns
        -------
        errors : ndarray, shape (S, L, 6)
        jacobians : ndarray, shape (S, L, 6, m)
        """
        model, data = self.robot.model.built.model, self.robot.model.data
        errors = np.empty((*angles.shape[:2], 6))
        jacobians = np.zeros((*angles.shape[:2], 6, angles.shape[2]))
        hands = list(zip(self._frames, self._targets, self._columns, self.joints, strict=True))
        for posture, missing, motions in zip(angles, errors, jacobians, strict=True):
            pin.computeJointJacobians(model, data, self.configuration(posture))
            for i, (frame, target, columns, n) in enumerate(hands):
                off = pin.updateFramePlacement(model, data, frame).actInv(target)
                missing[i, :3] = off.translation
                missing[i, 3:] = pin.log3(off.rotation)
                jacobian = pin.getFrameJacobian(model, data, frame, pin.ReferenceFrame.LOCAL)
                motions[i, :, :n] = jacobian[:, columns]
        errors[..., :3] /= self.reach[:, None]
        jacobians[..., :3, :] /= self.reach[:, None, None]
        return errors, jacobians


class Efforts:
    """Torques of the limbs of a batch over their joints' limits, at rest.

    Parameters
    ----------
    batch : LimbBatch
    loads : mapping of str to ndarray, shape (6,)
        Wrench that a limb's hand exerts on the rock, in H [N, N·m]; none if it is left out. It
        turns with the hand.
    gravity : ndarray, shape (3,)
        In B [m/s²].

    Raises
    ------
    InvalidInputError
        If a load or gravity is not of its shape or not finite.
    """

    def __init__(self, batch: LimbBatch, loads: Mapping[str, Array], gravity: Array) -> None:
        model = batch.robot.model
        self._batch = batch
        self._forces: Any = model.forces(loads)
        self._acceleration = model.root_acceleration(gravity)
        self._still = np.zeros_like(self._acceleration)
        self._columns = [model.columns[limb] for limb in batch.limbs]
        self._limits = np.ones(batch.shape)
        for i, limb in enumerate(batch.limbs):
            self._limits[i, : batch.joints[i]] = batch.robot.torque_limits[limb]

    def __call__(self, angles: Array) -> tuple[Array, Array]:
        """Return the efforts of angles (S, L, m), of that shape, and their slopes.

        The slopes are of shape (S, L, m, m) [1/rad].
        """
        model, data = self._batch.robot.model.built.model, self._batch.robot.model.data
        efforts = np.zeros(angles.shape)
        slopes = np.zeros((*angles.shape, angles.shape[-1]))
        for posture, effort, slope in zip(angles, efforts, slopes, strict=True):
            q = self._batch.configuration(posture)
            pin.computeRNEADerivatives(
                model, data, q, self._still, self._acceleration, self._forces
            )
            torques, changes = data.tau, data.dtau_dq
            for i, columns in enumerate(self._columns):
                n = self._batch.joints[i]
                effort[i, :n] = torques[columns]
                slope[i, :n, :n] = changes[columns, columns]
        return efforts / self._limits, slopes / self._limits[:, :, None]

    def cost(self, angles: Array) -> Array:
        """Return Σ (τ / τ_max)² of angles (S, L, m), shape (S, L)."""
        model, data = self._batch.robot.model.built.model, self._batch.robot.model.data
        efforts = np.zeros(angles.shape)
        for posture, effort in zip(angles, efforts, strict=True):
            q = self._batch.configuration(posture)
            torques = pin.rnea(model, data, q, self._still, self._acceleration, self._forces)
            for i, columns in enumerate(self._columns):
                effort[i, : self._batch.joints[i]] = torques[columns]
        efforts /= self._limits
        return np.asarray((efforts * efforts).sum(axis=-1))
