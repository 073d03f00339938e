"""Find the joint angles of a stance, and the joint torques and the weight of the robot there.

Angles are given, or found by inverse kinematics from the hands' poses; hands may be a little off
these. Limbs without a hand or an angle are at zero, or the limit nearest to it. Torques and the
weight are those of one Newton–Euler pass over the whole robot, its body accelerated and its joints
at rest.
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
    """The joints of a stance.

    Attributes
    ----------
    angles : mapping of str to ndarray, shape (n,)
        Of every limb [rad].
    joints : mapping of str to JointLoads
        What every limb's joints bear.
    weights : Weights
        What the robot and its payloads weigh there.
    off : mapping of str to tuple of float, float
        By limb, of those whose pose no joint angles were found for, only some near it: how far its
        hand is off there [m], and by how much it is turned [rad].
    """

    angles: Mapping[str, Array]
    joints: Mapping[str, JointLoads]
    weights: Weights
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
    """Return what the joints bear at these angles; limbs left out are at rest.

    Hands act on the rock where the stance has them, also where the joints put them a little off:
    what balances the body and what the joints bear are wrenches at one pose.
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
                f"{limb} is {off:.3g} m and {turned:.3g} rad from the pose of its joint angles; "
                f"the tolerance is {TOLERANCES.hand_offset:g} m and {TOLERANCES.hand_turn:g} rad",
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
