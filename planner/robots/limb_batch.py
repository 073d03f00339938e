"""Evaluate limbs together for inverse kinematics: pose errors, Jacobians and joint torques."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pinocchio as pin

from hand_models.base import Array, Indices, Pose
from planner.robots.robot import Robot

__all__ = ["LimbBatch"]


class LimbBatch:
    """L limbs of up to m joints, with the target poses and the loads of their hands.

    Joint angles are arrays (L, m) [rad]. The error of a hand is the twist in H from its pose to its
    target, and its Jacobian maps joint rates to the hand's twist in H; lengths in both are divided
    by the limb's reach. The effort of a joint is its torque over its torque limit, at rest. Limbs
    of fewer than m joints have columns of zeros at the end.

    Parameters
    ----------
    robot : Robot
        Robot whose limbs carry the hands.
    poses : mapping of str to Pose
        Target pose of H in B, by limb.
    loads : mapping of str to ndarray, shape (6,)
        Wrench of a limb's hand on the rock, in H [N, N·m]; zero for a limb that is left out. The
        wrench turns with the hand.
    gravity : ndarray, shape (3,)
        Acceleration of gravity, in B [m/s²].

    Attributes
    ----------
    robot, poses, loads, gravity
        The parameters.
    limbs : tuple of str
        Names of the limbs, in the order of all arrays.
    joints : list of int, length L
        Number of joints of each limb.
    shape : tuple of int
        (L, m).
    lower, upper : ndarray, shape (L, m)
        Limits of the angles [rad].
    reach : ndarray, shape (L,)
        Reach of each limb [m].
    beyond : ndarray, shape (L,)
        Distance by which each target is farther than the limb's reach [m]; zero within reach.
    levers : ndarray, shape (L,)
        Distance of H from the origin of the link that carries the hand [m].
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
        """Return the batch of the limbs with the given indices."""
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
        """Return the pose errors of the hands and their Jacobians.

        Parameters
        ----------
        angles : ndarray, shape (S, L, m)
            Joint angles of S postures [rad].

        Returns
        -------
        errors : ndarray, shape (S, L, 6)
            Twist from pose to target, in H: linear part over the limb's reach [1], rotation [rad].
        jacobians : ndarray, shape (S, L, 6, m)
            Hand Jacobians, linear rows over the limb's reach [1/rad, 1].
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
        """Return the torque of each joint over its limit, and the derivatives by the joint angles.

        Parameters
        ----------
        angles : ndarray, shape (S, L, m)
            Joint angles of S postures [rad].

        Returns
        -------
        efforts : ndarray, shape (S, L, m)
            Joint torque over torque limit; zero for joints without a motor.
        slopes : ndarray, shape (S, L, m, m)
            Derivatives of the efforts by the angles of the same limb [1/rad].
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
        """Return the cost Σ (τ / τ_max)² of joint angles (S, L, m), shape (S, L).

        τ is a joint's torque, τ_max its limit; the sum is over a limb's joints.
        """
        efforts, _ = self.efforts(angles)
        return np.asarray((efforts * efforts).sum(axis=-1))
