"""Constants of a limb's kinematics as plain arrays, taken from Pinocchio's model."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from hand_models.base import Array, Indices, Pose
from planner.robots import Robot

__all__ = ["LimbChain"]


class LimbChain(NamedTuple):
    """A limb of k joints, of which n are driven, with a hand on its last link.

    Attributes
    ----------
    turns, shifts : ndarray, shapes (k, 3, 3), (k, 3)
        Axes and origin of each joint's frame at zero in the frame of the joint before it, of the
        first in the body frame B [1, m].
    axes, slides : ndarray, shape (k, 3)
        Axis of each joint that turns, and direction of each that slides, in its own frame.
    coupling, offset : ndarray, shapes (k, n), (k,)
        Positions of all joints are coupling a + offset, a being the angles of the driven ones.
    hand : ndarray, shape (3, 4)
        Axes and origin of the hand frame H in the last joint's frame [1, m].
    lower, upper : ndarray, shape (n,)
        Limits of the angles [rad].
    shoulder : ndarray, shape (3,)
        Start of the limb in B [m].
    lever : ndarray, shape (3,)
        Origin of the link that carries the hand, in H [m].
    reach : float
        Upper bound of the distance of that link's origin from the shoulder [m].
    masses, coms : ndarray, shapes (k,), (k, 3)
        Mass of what each joint moves before the next, and its centre in the joint's frame [kg, m].
    """

    turns: Array
    shifts: Array
    axes: Array
    slides: Array
    coupling: Array
    offset: Array
    hand: Array
    lower: Array
    upper: Array
    shoulder: Array
    lever: Array
    reach: float
    masses: Array
    coms: Array

    @classmethod
    def of(cls, robot: Robot, limb: str) -> LimbChain:
        """Return the constants of a robot's limb."""
        chain, model, root = robot.chains[limb], robot.model, robot.root.inverse()
        placements = [model.jointPlacements[i] for i in chain.ids]
        turns = np.array([each.rotation for each in placements])
        shifts = np.array([each.translation for each in placements])
        turns[0], shifts[0] = root.rotation @ turns[0], root.apply(shifts[0])
        # the motion of a joint of one degree of freedom does not depend on where it is
        motions = np.array([robot.data.joints[i].S.ravel() for i in chain.ids])
        place = model.frames[chain.frame].placement
        mount = robot.description.mounts[limb].pose
        inertias = [model.inertias[i] for i in chain.ids]
        return cls(
            turns=turns,
            shifts=shifts,
            axes=np.ascontiguousarray(motions[:, 3:]),
            slides=np.ascontiguousarray(motions[:, :3]),
            coupling=chain.coupling,
            offset=chain.offset,
            hand=np.ascontiguousarray(np.column_stack([place.rotation, place.translation])),
            lower=chain.lower,
            upper=chain.upper,
            shoulder=chain.shoulder,
            lever=mount.inverse().position,
            reach=chain.reach,
            masses=np.array([each.mass for each in inertias]),
            coms=np.array([each.lever for each in inertias]),
        )

    @property
    def constants(self) -> tuple[Any, ...]:
        """Attributes that compiled kinematics take: those from turns to upper, and the reach."""
        return (*self[:9], self.reach)

    def frames(self, angles: Array) -> Array:
        """Return axes and origins (S, 3, 4) of H in B at joint angles (S, n)."""
        last = self._joint_frames(angles)[:, -1]
        found = last[:, :, :3] @ self.hand
        found[:, :, 3] += last[:, :, 3]
        return np.asarray(found)

    def centres(self, angles: Array) -> Array:
        """Return centres of mass (S, 3) of the limb with its hand, in B, at joint angles (S, n)."""
        frames = self._joint_frames(angles)
        places = (frames[..., :3] @ self.coms[:, :, None])[..., 0] + frames[..., 3]
        return np.asarray(self.masses @ places / self.masses.sum())

    def _joint_frames(self, angles: Array) -> Array:
        from planner.limbs.compiled_kinematics import joint_frames

        return joint_frames(self.constants, np.ascontiguousarray(angles))

    def follow(self, target: Pose, start: Array, numbers: Array, steps: int) -> Array | None:
        """Return angles near others (n,) that put H on a pose in B [rad]; None without any.

        ``numbers`` and ``steps`` are as of `compiled_kinematics.follow_pose`.
        """
        from planner.limbs.compiled_kinematics import follow_pose

        at = np.column_stack([target.rotation, target.position])
        angles, found = follow_pose(self.constants, at, start, numbers, steps)
        return angles if found else None

    def solve(
        self, targets: Array, starts: Array, numbers: Array, steps: int, branches: int
    ) -> tuple[Array, Indices]:
        """Return angles (N, branches, n) for poses of H in B, and how many each has, (N,).

        The parameters are those of `compiled_kinematics.solve_poses`.
        """
        from planner.limbs.compiled_kinematics import solve_poses

        return solve_poses(self.constants, targets, starts, numbers, steps, branches)

    def spans(self, targets: Array) -> Array:
        """Return how far poses of H in B (N, 3, 4) are from the shoulder, over the reach, (N,)."""
        links = targets[:, :, :3] @ self.lever + targets[:, :, 3]
        found: Array = np.linalg.norm(links - self.shoulder, axis=1) / self.reach
        return found
