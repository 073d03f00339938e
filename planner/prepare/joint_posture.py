"""Where the joints of a stance are, what they bear without hands, and what the robot weighs there.

Angles are given, or found by inverse kinematics from the hands' poses; hands may be a little off
these. Limbs without a hand or an angle are at zero, or the limit nearest to it. Torques and the
weight are those of one Newton–Euler pass over the whole robot, its body accelerated and its joints
at rest.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
import scipy

from hand_models.base import Array, InvalidInputError, Pose, within
from planner.prepare.stance_constraints import JointLoads
from planner.question import Question, Stance
from planner.robots import UnreachableError, solve_limbs

__all__ = ["Posture", "posture"]

OFF: Final = 0.01
"""How far a hand's pose may be from where its joints put it [m]."""

TURNED: Final = 0.05
"""How far its axes may be turned from those [rad]."""

EXACT: Final = 5e-6
"""Up to so far [m], and so much turned [rad], joints that were found put a hand at its pose."""


@dataclass(frozen=True, eq=False)
class Posture:
    """The joints of a stance.

    Attributes
    ----------
    angles : mapping of str to ndarray, shape (n,)
        Of every limb [rad].
    joints : mapping of str to JointLoads
        What every limb's joints bear.
    body_wrench : ndarray, shape (6,)
        That the rock must exert on the robot for its own weight and acceleration, in B.
    off : mapping of str to tuple of float, float
        By limb, of those whose pose no joint angles were found for, only some near it: how far its
        hand is off there [m], and by how much it is turned [rad].
    """

    angles: Mapping[str, Array]
    joints: Mapping[str, JointLoads]
    body_wrench: Array
    off: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def idle(self, stance: Stance) -> dict[str, JointLoads]:
        """Return what the joints bear of limbs that have no hand in a stance."""
        holding = {hand.limb for hand in stance.hands}
        return {limb: joints for limb, joints in self.joints.items() if limb not in holding}


def posture(question: Question) -> Posture | None:
    """Return where a question's joints are; None if nothing is said of them.

    Raises
    ------
    UnreachableError
        If a hand's pose is out of its limb's reach; the field is relative to the question.
    InvalidInputError
        If given joints are impossible, or not where the hands' poses are.
    DeadlineError
        If the time is over before they are found.
    """
    stance = question.stance
    if stance.joints is None:
        return None
    body = stance.body.inverse()
    poses = {hand.limb: body @ hand.pose for hand in stance.hands}
    gravity, acceleration = gravity_and_acceleration(question)
    given = _given(stance, poses)
    asked = {limb: pose for limb, pose in poses.items() if limb in stance.solved_limbs}
    if not asked:
        return posture_at(question, given)
    angles = _solved(question, asked, gravity - acceleration[:3])
    off = _off(stance, angles, asked)
    far = {limb: each for limb, each in off.items() if max(each) > EXACT}
    return replace(posture_at(question, given | angles), off=far)


def posture_at(question: Question, angles: Mapping[str, Array]) -> Posture:
    """Return what the joints bear at these angles; limbs left out are at rest."""
    robot = question.stance.robot
    gravity, acceleration = gravity_and_acceleration(question)
    whole = {
        limb: np.asarray(angles.get(limb, chain.rest), dtype=float)
        for limb, chain in robot.chains.items()
    }
    statics = robot.statics(whole, gravity, acceleration)
    jacobians = robot.jacobians(whole)
    limits = torque_limits(question)
    return Posture(
        angles=whole,
        joints={
            limb: JointLoads(
                robot.chains[limb].joints,
                robot.chains[limb].sliding,
                statics.joint_torque[limb],
                jacobians[limb],
                limits[limb],
            )
            for limb in robot.limbs
        },
        body_wrench=statics.body_wrench,
    )


def gravity_and_acceleration(question: Question) -> tuple[Array, Array]:
    """Return gravity (3,) and the body's acceleration (6,), linear and angular, in B.

    A body wrench that is given leaves the acceleration open: it counts as none.
    """
    turn = question.stance.body.rotation.T
    acceleration = np.zeros(6)
    if question.body_wrench is None:
        load = question.load
        acceleration[:3] = turn @ np.asarray(load.acceleration)
        acceleration[3:] = turn @ np.asarray(load.angular_acceleration)
    return turn @ question.stance.gravity, acceleration


def torque_limits(question: Question) -> dict[str, Array]:
    """Return what each joint can bear: the caller's figures, or else the robot's [N·m]."""
    robot, own = question.stance.robot, question.limits.joint_torque
    if own is None:
        return {limb: chain.torque_limits for limb, chain in robot.chains.items()}
    found = {}
    for limb, chain in robot.chains.items():
        known = chain.torque_limits
        given = own.get(limb, known) if isinstance(own, Mapping) else own
        found[limb] = np.broadcast_to(np.asarray(given, dtype=float), known.shape)
    return found


def _given(stance: Stance, poses: Mapping[str, Pose]) -> dict[str, Array]:
    """Return given angles, which must be possible and where the hands' poses are."""
    joints, solved = stance.given_joints, stance.solved_limbs
    with within("stance.joints"):
        stance.robot.checked_angles(joints)
    for limb in poses:
        if limb not in joints and limb not in solved:
            raise InvalidInputError(
                f"missing for {limb}, which holds on; valid are all limbs with a hand, each with "
                "angles or 'solve', or 'solve'",
                field="stance.joints",
            )
    index = {hand.limb: i for i, hand in enumerate(stance.hands)}
    known = {limb: pose for limb, pose in poses.items() if limb not in solved}
    for limb, (off, turned) in _off(stance, joints, known).items():
        if off > OFF or turned > TURNED:
            raise InvalidInputError(
                f"{limb} is {off:.3g} m and {turned:.3g} rad from where its joints put it; "
                f"up to {OFF:g} m and {TURNED:g} rad are valid",
                field=f"stance.hands[{index[limb]}].pose",
            )
    return joints


def _off(
    stance: Stance, angles: Mapping[str, Array], poses: Mapping[str, Pose]
) -> dict[str, tuple[float, float]]:
    """Return how far joints put hands from their poses in B [m], and turned by how much [rad]."""
    there = stance.robot.hand_poses(angles)
    return {
        limb: (
            float(np.linalg.norm(pose.position - there[limb].position)),
            float(
                scipy.spatial.transform.Rotation.from_matrix(
                    there[limb].rotation.T @ pose.rotation
                ).magnitude()
            ),
        )
        for limb, pose in poses.items()
    }


def _solved(question: Question, poses: Mapping[str, Pose], gravity: Array) -> dict[str, Array]:
    """Return angles for the hands' poses, with low torques where each carries its share."""
    robot, hands = question.stance.robot, question.stance.hands
    force = robot.mass * gravity / len(hands)
    shares = {
        limb: np.concatenate([pose.rotation.T @ force, np.zeros(3)]) for limb, pose in poses.items()
    }
    try:
        return solve_limbs(robot, poses, shares, gravity, (OFF, TURNED))
    except UnreachableError as error:
        index = [hand.limb for hand in hands].index(next(iter(error.missing)))
        error.field = f"stance.hands[{index}].pose"
        raise
