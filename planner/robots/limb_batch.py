"""Limbs whose hands are to be put somewhere, moved together, with one pass of Pinocchio for all."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pinocchio as pin

from hand_models.base import Array, Indices, Pose
from planner.robots.robot import Robot

__all__ = ["LimbBatch"]


class LimbBatch:
    """L limbs of up to m joints, the poses that their hands are to have, and what these carry.

    Angles are (L, m) [rad]. A hand's error is the twist in H that is missing, its Jacobian that of
    the hand, both with lengths over the limb's reach. An effort is a joint's torque over its limit,
    at rest. Limbs of fewer joints have columns of zeros at the end.

    Parameters
    ----------
    robot : Robot
    poses : mapping of str to Pose
        H in B, by limb.
    loads : mapping of str to ndarray, shape (6,)
        Wrench that a limb's hand exerts on the rock, in H [N, N·m]; none if it is left out. It
        turns with the hand.
    gravity : ndarray, shape (3,)
        In B [m/s²].

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
    levers : ndarray, shape (L,)
        Distance of H from the end of the limb, up to which its reach goes [m].
    """

    def __init__(
        self, robot: Robot, poses: Mapping[str, Pose], loads: Mapping[str, Array], gravity: Array
    ) -> None:
        self.robot, self.poses, self.loads, self.gravity = robot, poses, loads, gravity
        self.limbs = tuple(poses)
        self._chains = [robot.chains[limb] for limb in poses]
        self.joints = [len(chain.joints) for chain in self._chains]
        self.shape = len(poses), max(self.joints)
        self.lower, self.upper = np.zeros(self.shape), np.zeros(self.shape)
        self._limits = np.ones(self.shape)
        for i, (chain, n) in enumerate(zip(self._chains, self.joints, strict=True)):
            self.lower[i, :n] = chain.lower
            self.upper[i, :n] = chain.upper
            # a joint without a motor has no effort
            self._limits[i, :n] = np.where(chain.torque_limits > 0.0, chain.torque_limits, np.inf)
        self.reach = np.array([chain.reach for chain in self._chains])
        mounts = robot.description.mounts
        self.levers = np.array([np.linalg.norm(mounts[limb].pose.position) for limb in poses])
        stretches = robot.stretches(Pose.identity(), self.limbs, list(poses.values()))
        beyond = (np.array(stretches) - 1.0) * self.reach
        # a stretched limb's end may be beyond its reach by rounding
        self.beyond = np.where(beyond > 1e-9 * self.reach, beyond, 0.0)
        self._neutral = robot.configuration({})
        targets = [robot.root @ pose for pose in poses.values()]
        self._targets = [pin.SE3(target.rotation, target.position) for target in targets]
        self._acceleration = robot.root_acceleration(gravity)
        self._still = np.zeros_like(self._acceleration)
        self._forces = pin.StdVec_Force()
        for _ in range(robot.model.njoints):
            self._forces.append(pin.Force.Zero())
        for limb, load in loads.items():
            chain = robot.chains[limb]
            place = robot.model.frames[chain.frame].placement
            self._forces[chain.ids[-1]] = place.act(pin.Force(-load))

    def part(self, chosen: Indices) -> LimbBatch:
        """Return the batch of some of the limbs."""
        if len(chosen) == len(self.limbs):
            return self
        names = [self.limbs[i] for i in chosen]
        poses = {limb: self.poses[limb] for limb in names}
        return LimbBatch(self.robot, poses, self.loads, self.gravity)

    def _configuration(self, angles: Array) -> Array:
        """Return Pinocchio's configuration of angles (L, m)."""
        q = self._neutral.copy()
        for chain, n, values in zip(self._chains, self.joints, angles, strict=True):
            chain.turn(q, values[:n])
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
        model, data = self.robot.model, self.robot.data
        errors = np.empty((*angles.shape[:2], 6))
        jacobians = np.zeros((*angles.shape[:2], 6, angles.shape[2]))
        hands = list(zip(self._chains, self._targets, self.joints, strict=True))
        for posture, missing, motions in zip(angles, errors, jacobians, strict=True):
            pin.computeJointJacobians(model, data, self._configuration(posture))
            for i, (chain, target, n) in enumerate(hands):
                off = pin.updateFramePlacement(model, data, chain.frame).actInv(target)
                missing[i, :3] = off.translation
                missing[i, 3:] = pin.log3(off.rotation)
                jacobian = pin.getFrameJacobian(model, data, chain.frame, pin.ReferenceFrame.LOCAL)
                motions[i, :, :n] = jacobian[:, chain.columns] @ chain.coupling
        errors[..., :3] /= self.reach[:, None]
        jacobians[..., :3, :] /= self.reach[:, None, None]
        return errors, jacobians

    def efforts(self, angles: Array) -> tuple[Array, Array]:
        """Return the efforts of angles (S, L, m), of that shape, and their slopes.

        The slopes are of shape (S, L, m, m) [1/rad].
        """
        model, data = self.robot.model, self.robot.data
        efforts = np.zeros(angles.shape)
        slopes = np.zeros((*angles.shape, angles.shape[-1]))
        for posture, effort, slope in zip(angles, efforts, slopes, strict=True):
            q = self._configuration(posture)
            pin.computeRNEADerivatives(
                model, data, q, self._still, self._acceleration, self._forces
            )
            torques, changes = data.tau, data.dtau_dq
            for i, (chain, n) in enumerate(zip(self._chains, self.joints, strict=True)):
                own, turned = chain.columns, chain.coupling
                effort[i, :n] = turned.T @ torques[own]
                slope[i, :n, :n] = turned.T @ changes[own, own] @ turned
        return efforts / self._limits, slopes / self._limits[:, :, None]

    def cost(self, angles: Array) -> Array:
        """Return Σ (τ / τ_max)² of angles (S, L, m), shape (S, L)."""
        efforts, _ = self.efforts(angles)
        return np.asarray((efforts * efforts).sum(axis=-1))
