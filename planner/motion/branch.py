"""One branch of a limb's inverse kinematics kept along a path of hand poses, and several to choose.

The step to the next pose is Newton's of least norm. A limb of more than six joints also moves a
little along directions that leave its hand where it is, as much as its joints turn anyway: off its
limits and off postures in which its hand cannot move every way.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pinocchio as pin

from hand_models.base import Array, InvalidInputError, Pose
from planner import deadline
from planner.limbs import LimbChain
from planner.motion.settings import MOTION_SETTINGS
from planner.robots import LimbBatch, Robot, damped_step, postures_near

__all__ = ["BranchEndError", "branches", "follow_poses", "pose_between", "shift_postures"]


class BranchEndError(InvalidInputError):
    """Error of a hand that cannot follow its path with joint angles that change steadily.

    Parameters
    ----------
    limb : str
    share : float
        Part of the path that was followed, from 0 to 1.
    lacks : str
        What keeps the limb from going on.
    shifts : bool
        Whether the hand stays on its hold, and the body shifts.
    few_joints : bool
        Whether the limb has too few joints for the path, from whatever posture it starts.

    Attributes
    ----------
    limb, share, lacks, shifts, few_joints
        The parameters.
    """

    kind = "unreachable"

    def __init__(
        self,
        limb: str,
        share: float,
        lacks: str,
        *,
        shifts: bool = False,
        few_joints: bool = False,
    ) -> None:
        percent = f"{100.0 * share:.0f} %"
        if shifts:
            what = f"{limb} cannot keep its hold beyond {percent} of the body's shift"
            advice = "shift the body less or elsewhere"
        else:
            what = f"{limb} cannot follow its hand's path beyond {percent} of it"
            advice = "choose another path"
        other = "" if few_joints else ", or start from another posture"
        super().__init__(f"{what}: {lacks}; {advice}{other}")
        self.limb, self.share, self.lacks = limb, share, lacks
        self.shifts, self.few_joints = shifts, few_joints


def pose_between(first: Pose, second: Pose, part: float) -> Pose:
    """Return a pose between two: position on the straight line, along the shortest turn.

    Parameters
    ----------
    first, second : Pose
    part : float
        Progress from 0 to 1.
    """
    turn = pin.log3(first.rotation.T @ second.rotation)
    place = first.position + part * (second.position - first.position)
    return Pose(place, first.rotation @ pin.exp3(part * turn))


class _Limb:
    """A limb that follows its hand's poses."""

    def __init__(self, robot: Robot, limb: str) -> None:
        settings = MOTION_SETTINGS
        self.limb, self.chain = limb, robot.chains[limb]
        self._robot, self._compiled = robot, LimbChain.of(robot, limb)
        self._numbers = np.array(
            [
                settings.pose_error,
                settings.largest_step,
                settings.slope_step,
                settings.least_damping,
            ]
        )

    def follow(self, start: Array, pose: Pose) -> Array | None:
        """Return angles near others that solve a pose of H in B; None if none are near enough."""
        return self._compiled.follow(pose, start, self._numbers, MOTION_SETTINGS.newton_steps)

    def _errors(self, angles: Array, pose: Pose) -> tuple[Array, Array]:
        """Return the twist in H to a pose, (6,), over the reach, and its Jacobian (6, n)."""
        batch = LimbBatch(self._robot, {self.limb: pose}, {}, np.zeros(3))
        errors, jacobians = batch.errors(angles[None, None])
        return errors[0, 0], jacobians[0, 0]

    def lacks_joints(self, angles: Array, pose: Pose) -> bool:
        """Return whether a limb of few joints misses a pose, were there no limits of joints."""
        if len(angles) >= 6:
            return False
        for _ in range(MOTION_SETTINGS.newton_steps):
            error, J = self._errors(angles, pose)
            angles = angles + np.linalg.lstsq(J, error)[0]
        return bool(np.abs(self._errors(angles, pose)[0]).max() > MOTION_SETTINGS.missed)

    def lacking(self, angles: Array, pose: Pose) -> str:
        """Say what keeps the limb from a pose, from the angles that it has."""
        chain, (error, J) = self.chain, self._errors(angles, pose)
        within, slope = MOTION_SETTINGS.at_limit, error @ J
        low = (angles - chain.lower < within) & (slope < 0.0)
        high = (chain.upper - angles < within) & (slope > 0.0)
        stopped = []
        for i in np.flatnonzero(low | high).tolist():
            limit = chain.lower[i] if low[i] else chain.upper[i]
            unit = "m" if chain.sliding[i] else "rad"
            stopped.append(f"{chain.joints[i]} is at its limit of {limit:.4g} {unit}")
        if self.lacks_joints(angles, pose):
            count = len(angles)
            stopped = [f"a limb of {count} joints moves its hand in {count} of 6 ways only"]
        elif np.linalg.svd(J, compute_uv=False)[-1] < MOTION_SETTINGS.singular:
            stopped.append("the limb is stretched or folded, so its hand cannot move every way")
        if not stopped:
            step = MOTION_SETTINGS.largest_step
            stopped.append(f"a joint would turn by more than {step:g} rad at once")
        way, turn = np.linalg.norm(error[:3]) * chain.reach, np.linalg.norm(error[3:])
        parts = [(way, f"{1e3 * way:.3g} mm"), (turn, f"{turn:.2g} rad")]
        # what rounding leaves is no distance
        off = " and ".join(text for size, text in parts if size > 1e-6) or parts[0][1]
        return f"{', and '.join(stopped)}, {off} from the next pose"


def follow_poses(robot: Robot, limb: str, start_angles: Array, poses: Sequence[Pose]) -> Array:
    """Return joint angles that keep a limb's hand on a path, on one branch.

    Parameters
    ----------
    robot : Robot
    limb : str
    start_angles : ndarray, shape (n,)
        Angles from which the first pose is reached by a small motion [rad].
    poses : sequence of Pose, length m
        Poses of H in B. The path goes straight to the first and from one to the next, orientations
        along the shortest turn, in steps so small that no joint turns by more than
        `MotionSettings.largest_step`.

    Returns
    -------
    ndarray, shape (m, n)
        Joint angles within their limits that put H on each pose [rad].

    Raises
    ------
    BranchEndError
        If the branch ends; the error says where, and what is missing.
    DeadlineError
        If the deadline passes first.
    """
    one, found = _Limb(robot, limb), []
    angles = np.asarray(start_angles, dtype=float)
    before = robot.hand_poses({limb: angles})[limb]
    for i, pose in enumerate(poses):
        deadline.check("a limb had followed its hand's path")
        done, step = 0.0, 1.0
        while done < 1.0:
            part = min(done + step, 1.0)
            target = pose if part == 1.0 else pose_between(before, pose, part)
            moved = one.follow(angles, target)
            if moved is None:
                step *= 0.5
                if step < 0.5**MOTION_SETTINGS.finest:
                    share = (i + done) / len(poses)
                    few = one.lacks_joints(angles, pose)
                    raise BranchEndError(limb, share, one.lacking(angles, pose), few_joints=few)
                continue
            angles, done = moved, part
            step *= 2.0
        found.append(angles)
        before = pose
    return np.array(found).reshape(len(poses), -1)


def shift_postures(
    robot: Robot,
    hands: Mapping[str, Pose],
    bodies: Sequence[Pose],
    start: Mapping[str, Array],
) -> dict[str, Array]:
    """Return joint angles of limbs whose hands stay where they are while the body moves.

    Parameters
    ----------
    robot : Robot
    hands : mapping of str to Pose
        Pose of H in the world frame W, by limb.
    bodies : sequence of Pose, length m
        Poses of B in W, one after the other.
    start : mapping of str to ndarray, shape (n,)
        Joint angles before the first of them, by limb [rad].

    Returns
    -------
    dict of str to ndarray, shape (m, n)
        Joint angles at each pose of the body, by limb [rad].

    Raises
    ------
    BranchEndError
        If the branch of a limb ends.
    DeadlineError
        If the deadline passes first.
    """
    inverse = [body.inverse() for body in bodies]
    try:
        return {
            limb: follow_poses(robot, limb, start[limb], [body @ hand for body in inverse])
            for limb, hand in hands.items()
        }
    except BranchEndError as error:
        raise BranchEndError(
            error.limb, error.share, error.lacks, shifts=True, few_joints=error.few_joints
        ) from None


def branches(
    robot: Robot, limb: str, pose: Pose, near: Array | None = None, count: int = 6
) -> tuple[Array, ...]:
    """Return joint angles of several kinds that put a limb's hand on a pose.

    They are found from random postures whose hand is near the pose; two of them differ by more than
    `MotionSettings.alike` in some joint. None may be found where there are some.

    Parameters
    ----------
    robot : Robot
    limb : str
    pose : Pose
        Pose of H in B.
    near : ndarray, shape (n,), optional
        Angles that the first ones are to be nearest to [rad]; by default those come first whose
        joints are farthest from their limits.
    count : int
        Number of solutions at most.

    Returns
    -------
    tuple of ndarray, shape (n,)
        Joint angles within their limits [rad].

    Raises
    ------
    DeadlineError
        If the deadline passes first.
    """
    batch = LimbBatch(robot, {limb: pose}, {}, np.zeros(3))
    starts = postures_near(batch, 0, MOTION_SETTINGS.starts)
    angles = (starts if near is None else np.vstack([near, starts]))[:, None]
    for _ in range(MOTION_SETTINGS.branch_steps):
        deadline.check("postures with a hand on its hold were found")
        errors, jacobians = batch.errors(angles)
        left = np.abs(errors).max(axis=(1, 2)) > MOTION_SETTINGS.pose_error
        if not left.any():
            break
        angles[left] = damped_step(batch, angles[left], errors[left], jacobians[left])
    errors, _ = batch.errors(angles)
    solved = angles[np.abs(errors).max(axis=(1, 2)) <= MOTION_SETTINGS.pose_error, 0]
    room = np.minimum(solved - batch.lower, batch.upper - solved).min(axis=1)
    rank = -room if near is None else np.abs(solved - near).max(axis=1)
    found: list[Array] = []
    for each in solved[rank.argsort(kind="stable")]:
        if all(np.abs(each - other).max() > MOTION_SETTINGS.alike for other in found):
            found.append(each)
    return tuple(found[:count])
