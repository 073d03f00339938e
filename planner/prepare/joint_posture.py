"""Joint angles of a stance (given, or by inverse kinematics), joint torques and the robot's weight.

A hand's pose may differ slightly from the one that its joint angles give. Limbs without a hand or
an angle are at zero, or the limit nearest to zero. Torques and weight come from one Newton–Euler
pass over the whole robot (inverse dynamics), with the body accelerated and the joints at rest.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import scipy

from hand_models.base import Array, InvalidInputError, Pose, errors_under, wrench_transport
from planner.prepare.stance_constraints import TOLERANCES, JointLoads
from planner.question import Question, Stance, Weights
from planner.robots import UnreachableError, carriers, held_up, solve_limbs

__all__ = ["Posture", "posture"]


@dataclass(frozen=True, eq=False)
class Posture:
    """Joint angles of a stance, with the joint torques and the weight of the robot at these angles.

    Attributes
    ----------
    angles : mapping of str to ndarray, shape (n,)
        Joint angles of every limb [rad]; of prismatic joints [m].
    joints : mapping of str to JointLoads
        Joint torques of every limb as a function of its hand's wrench, and their limits.
    weights : Weights
        Body wrench from the robot's weight, centre of mass, and positions of payloads.
    off : mapping of str to tuple of float, float
        Distance [m] and angle [rad] by which a hand misses its pose, by limb; only for hands whose
        pose inverse kinematics reaches nearly.
    """

    angles: Mapping[str, Array]
    joints: Mapping[str, JointLoads]
    weights: Weights
    off: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def idle(self, stance: Stance) -> dict[str, JointLoads]:
        """Return the joint loads of the limbs that have no hand in a stance, by limb."""
        holding = {hand.limb for hand in stance.hands}
        return {limb: joints for limb, joints in self.joints.items() if limb not in holding}


def posture(question: Question) -> Posture | None:
    """Return the joint angles of a question, found by inverse kinematics where not given.

    Returns
    -------
    Posture or None
        Joint angles with joint torques and weight; None if the question has no joints.

    Raises
    ------
    UnreachableError
        If a hand's pose is out of its limb's reach; the field is relative to the question.
    InvalidInputError
        If given angles are outside the joints' ranges, or do not fit the hands' poses.
    DeadlineError
        If the deadline expires before angles are found.
    """
    stance = question.stance
    if stance.joints is None:
        return None
    body = stance.body.inverse()
    poses = {hand.limb: body @ hand.pose for hand in stance.hands}
    given = _given(stance, poses)
    asked = {limb: pose for limb, pose in poses.items() if limb in stance.solved_limbs}
    if not asked:
        return posture_at(question, given)
    angles = _solved(question, asked)
    off = _off(stance, angles, asked)
    # [m, rad] joints that were found put a hand at its pose up to here
    far = {limb: each for limb, each in off.items() if max(each) > 5e-6}
    return replace(posture_at(question, given | angles), off=far)


def posture_at(question: Question, angles: Mapping[str, Array]) -> Posture:
    """Return joint torques and weight of the robot at given joint angles.

    Hands act on the rock at the poses of the stance, even if the angles put them slightly off: the
    balance of the body and the joint torques then refer to the same pose.

    Parameters
    ----------
    question : Question
        Stance, load, limits and objective.
    angles : mapping of str to ndarray, shape (n,)
        Joint angles by limb [rad], of prismatic joints [m]; limbs left out are at their rest
        angles.
    """
    stance, robot, load = question.stance, question.stance.robot, question.load
    whole = {
        limb: np.asarray(angles.get(limb, chain.rest), dtype=float)
        for limb, chain in robot.chains.items()
    }
    with errors_under("load"):
        linear, angular = load.motion(stance)
        frames = carriers(robot, whole, load.payloads)
    statics = robot.statics(whole, -linear, np.concatenate([np.zeros(3), angular]))
    torques, jacobians = statics.joint_torque, _jacobians_at(stance, whole)
    places = []
    for payload, (pose, motions) in zip(load.payloads, frames, strict=True):
        places.append(pose.apply(np.array(payload.com)))
        wrench = held_up(payload.mass, places[-1], linear, angular)
        local = wrench_transport(pose.inverse()) @ wrench
        for limb, motion in motions.items():
            torques[limb] = torques[limb] + motion.T @ local
    limits = torque_limits(question)
    return Posture(
        angles=whole,
        joints={
            limb: JointLoads(
                robot.chains[limb].joints,
                robot.chains[limb].sliding,
                torques[limb],
                jacobians[limb],
                limits[limb],
            )
            for limb in robot.limbs
        },
        weights=Weights(statics.body_wrench, robot.com_at(whole), np.array(places).reshape(-1, 3)),
    )


def _jacobians_at(stance: Stance, angles: Mapping[str, Array]) -> dict[str, Array]:
    """Return every limb's Jacobian (6, n) of H where the stance has it, fixed to the last link."""
    found, body = {}, stance.body.inverse()
    asked = {hand.limb: body @ hand.pose for hand in stance.hands}
    for limb, (reached, jacobian) in stance.robot.kinematics(angles).items():
        found[limb] = jacobian
        if limb in asked:
            found[limb] = wrench_transport(reached.inverse() @ asked[limb]).T @ jacobian
    return found


def torque_limits(question: Question) -> dict[str, Array]:
    """Return the torque limits of each limb's joints, shape (n,) [N·m], by limb.

    The question's limits come before the robot's. Of prismatic joints the limits are forces [N].
    """
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
    with errors_under("stance.joints"):
        stance.robot.checked_angles(joints)
    for limb in poses:
        if limb not in joints and limb not in solved:
            raise InvalidInputError(
                f"missing for {limb}, which is on the rock; give angles or 'solve' for each limb "
                "with a hand, or 'solve' for all",
                field="stance.joints",
            )
    index = {hand.limb: i for i, hand in enumerate(stance.hands)}
    known = {limb: pose for limb, pose in poses.items() if limb not in solved}
    for limb, (off, turned) in _off(stance, joints, known).items():
        if off > TOLERANCES.hand_offset or turned > TOLERANCES.hand_turn:
            raise InvalidInputError(
                f"must be within {TOLERANCES.hand_offset:g} m and {TOLERANCES.hand_turn:g} rad of "
                f"the pose of {limb}'s joint angles, got {off:.3g} m and {turned:.3g} rad; correct "
                "one of the two, or let the limb's joints be 'solve'",
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


def _solved(question: Question, poses: Mapping[str, Pose]) -> dict[str, Array]:
    """Return angles for the hands' poses, with low torques where each carries its share."""
    gravity = -question.load.motion(question.stance)[0]
    robot, hands = question.stance.robot, question.stance.hands
    force = robot.mass * gravity / len(hands)
    shares = {
        limb: np.concatenate([pose.rotation.T @ force, np.zeros(3)]) for limb, pose in poses.items()
    }
    try:
        return solve_limbs(
            robot, poses, shares, gravity, (TOLERANCES.hand_offset, TOLERANCES.hand_turn)
        )
    except UnreachableError as error:
        index = [hand.limb for hand in hands].index(next(iter(error.missing)))
        error.field = f"stance.hands[{index}].pose"
        raise
