"""Build Pinocchio's model of a robot from its URDF and the mounts of its hands."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from textwrap import shorten
from typing import Any, Final

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from hand_models.base import Array, Indices, InvalidInputError, Pose, errors_under
from planner.robots.limb_joints import JointCoupling, coupling_of, limb_joints, locked_joints
from planner.robots.robot_file import Mount, RobotDescription
from planner.robots.tolerances import TOLERANCES
from planner.robots.urdf import JointElement, Urdf

__all__ = ["ROOT_JOINT", "Chain", "build_model", "pose_of"]

ROOT_JOINT: Final = 1
"""Index of the joint that lets the whole robot move freely, in Pinocchio's model."""


@dataclass(frozen=True, eq=False)
class Chain:
    """A limb: joints from the body outward, with a hand on the last link.

    A limb has k joints. Of these, n move by themselves, most often all; the others follow these by
    a fixed ratio (mimic). Angles, torques and limits are of the n. For a joint that slides, read
    lengths [m] for angles [rad], and forces [N] for torques [N·m].

    Attributes
    ----------
    joints : tuple of str, length n
        Names of the joints that move by themselves, from the body outward.
    moving : tuple of str, length k
        Names of all joints.
    sliding : ndarray of bool, shape (n,)
        True for a joint that slides along its axis.
    coupling : ndarray, shape (k, n)
        Motion of each of the k joints per unit of each of the n.
    offset : ndarray, shape (k,)
        Positions of all joints while the n are at zero [rad].
    lower, upper : ndarray, shape (n,)
        Limits of the joint angles [rad], infinite for continuous joints.
    torque_limits : ndarray, shape (n,)
        Largest torques of the joints [N·m]; zero for a joint without a motor.
    rated : bool
        True if the torque limits are from the robot's file, False if they are the URDF's efforts.
    shoulder : ndarray, shape (3,)
        Start of the limb, in B [m]: its second joint if that lies on the axis of the first, so
        that no joint moves it, otherwise its first.
    reach : float
        Upper bound of the distance from the shoulder to the link that carries the hand [m]: the
        sum of the distances from joint to joint, or where that link only turns in its place, the
        distance of H from the link's origin.
    spacing : ndarray, shape (k,)
        Distance of each joint from the one before it, of the first from the origin of the root
        link [m].
    ids : tuple of int, length k
        Indices of all joints in Pinocchio's model.
    frame : int
        Index of the hand frame H in Pinocchio's model.
    places : ndarray of int, shape (k,)
        Index of each joint's first entry in a configuration.
    turning : ndarray of int, shape (at most k,)
        Indices of the continuous joints among the k; a configuration has cosine and sine of these.
    columns : slice
        Columns of the joints among Pinocchio's rates.
    """

    joints: tuple[str, ...]
    moving: tuple[str, ...]
    sliding: NDArray[np.bool_]
    coupling: Array
    offset: Array
    lower: Array
    upper: Array
    torque_limits: Array
    rated: bool
    shoulder: Array
    reach: float
    spacing: Array
    ids: tuple[int, ...]
    frame: int
    places: Indices
    turning: Indices
    columns: slice

    @property
    def rest(self) -> Array:
        """Default angles of the joints, shape (n,) [rad]: zero, or the limit nearest to zero."""
        return np.asarray(np.clip(0.0, self.lower, self.upper))

    def turn(self, q: Array, given: Array) -> None:
        """Write the limb's angles (n,) into a Pinocchio configuration ``q`` (nq,), in place."""
        angles = self.coupling @ given + self.offset
        q[self.places] = angles
        if self.turning.size:
            at, endless = self.places[self.turning], angles[self.turning]
            q[at], q[at + 1] = np.cos(endless), np.sin(endless)


def pose_of(placement: Any) -> Pose:
    """Convert a placement of Pinocchio (`pinocchio.SE3`) to a `Pose`."""
    return Pose(np.array(placement.translation), np.array(placement.rotation))


def build_model(
    tree: Urdf, urdf: str, described: RobotDescription, hand_mass: float
) -> tuple[Any, Pose, dict[str, Chain], dict[str, float]]:
    """Build Pinocchio's model of a robot with hands and a free-floating body.

    Joints that belong to no limb are fixed where they are locked, or at zero.

    Parameters
    ----------
    tree : Urdf
        Links and joints of the URDF.
    urdf : str
        Text of the URDF, which Pinocchio parses by itself.
    described : RobotDescription
        Content of the robot's file.
    hand_mass : float
        Mass of one hand [kg].

    Returns
    -------
    model : pinocchio.Model
        The model; its gravity is zero, as gravity is given as an acceleration of the root link.
    root : Pose
        Pose of B in the root link.
    chains : dict of str to Chain
        Joints of each limb, by limb.
    locked : dict of str to float
        Positions of the joints that never move, by name [rad, or m].

    Raises
    ------
    InvalidInputError
        If Pinocchio cannot read the URDF, no link has a mass, a link is not in the URDF, or a limb
        is no chain of joints of its own.
    """
    with errors_under("body"):
        tree.require(described.body)
    if not any(link.mass > 0.0 for link in tree.links.values()):
        raise InvalidInputError(
            "no link has a mass; give at least one link an <inertial> with a mass above 0 kg",
            field="urdf",
        )
    locked = locked_joints(tree, described)
    joints = limb_joints(tree, described, locked)
    try:
        # which no joint of a URDF can have: XML allows no such character
        whole = pin.buildModelFromXML(urdf, pin.JointModelFreeFlyer(), "free body\x01")
    except (ValueError, RuntimeError) as error:
        raise InvalidInputError(
            "cannot be made a model of the robot; check the URDF with check_urdf (Pinocchio said "
            f"{' '.join(str(error).split())})",
            field="urdf",
        ) from None
    model = _reduced(whole, {joint.name for chain in joints.values() for joint in chain}, locked)
    model.gravity.setZero()  # gravity comes as an acceleration of the root, so that it may vary
    root = pose_of(model.frames[model.getFrameId(described.body, pin.FrameType.BODY)].placement)
    chains = {
        limb: _mounted(model, root, limb, mount, joints[limb], hand_mass)
        for limb, mount in described.mounts.items()
    }
    return model, root, chains, locked


def _reduced(whole: Any, kept: Collection[str], locked: Mapping[str, float]) -> Any:
    """Return Pinocchio's model of the joints that are kept; all others stay where they are.

    `buildReducedModel` looks up frames by name alone, whatever they are frames of. URDF lets a
    link have the name of a joint, so meanwhile each name says which of the two it names.
    """
    q, others = pin.neutral(whole), []
    for i in range(ROOT_JOINT + 1, whole.njoints):
        joint, name = whole.joints[i], whole.names[i]
        if name not in kept:
            others.append(i)
        if name in locked:
            value = locked[name]
            q[joint.idx_q : joint.idx_q + joint.nq] = (
                (np.cos(value), np.sin(value)) if joint.nq == 2 else value
            )
        whole.names[i] = f"joint {name}"
    for frame in list(whole.frames)[ROOT_JOINT + 1 :]:
        kind = "link" if frame.type == pin.FrameType.BODY else "joint"
        frame.name = f"{kind} {frame.name}"
    model = pin.buildReducedModel(whole, others, q)
    for i in range(ROOT_JOINT + 1, model.njoints):
        model.names[i] = model.names[i].removeprefix("joint ")
    for frame in list(model.frames)[ROOT_JOINT + 1 :]:
        frame.name = frame.name.partition(" ")[2]
    return model


def _mounted(
    model: Any,
    root: Pose,
    limb: str,
    mount: Mount,
    elements: tuple[JointElement, ...],
    hand_mass: float,
) -> Chain:
    """Put a hand on its link in Pinocchio's model, and return the limb that it is on."""
    names = list(model.names)
    ids = tuple(names.index(joint.name, ROOT_JOINT + 1) for joint in elements)
    joints = [model.joints[i] for i in ids]
    # limbs share no joints and the others are locked, so a limb's joints follow each other
    columns = slice(joints[0].idx_v, joints[-1].idx_v + 1)
    link = model.frames[model.getFrameId(mount.link, pin.FrameType.BODY)]
    with errors_under(f"limbs.{limb}.link"):
        coupled = coupling_of(elements)
    shoulder, reach = _bound(model, elements, ids, columns.start, pose_of(link.placement))
    if reach <= TOLERANCES.axis_distance:
        reach = float(np.linalg.norm(mount.pose.position))
    if reach <= TOLERANCES.axis_distance:
        raise InvalidInputError(
            "the hand is on the axes of the limb's joints, which cannot move the hand; must "
            f"be away from them, got {mount.pose.position.tolist()} m; give another position",
            field=f"limbs.{limb}.position",
        )
    with errors_under(f"limbs.{limb}.torque_limit"):
        limits = _torque_limits(mount, coupled)
    place = link.placement * pin.SE3(mount.pose.rotation, mount.pose.position)
    hand = pin.Inertia(hand_mass, np.array(mount.hand_com), np.zeros((3, 3)))
    model.appendBodyToJoint(ids[-1], hand, place)
    frame = model.addFrame(
        pin.Frame(f"hand of {limb}", ids[-1], link.parentFrame, place, pin.FrameType.OP_FRAME)
    )
    return Chain(
        joints=tuple(joint.name for joint in coupled.driving),
        moving=tuple(joint.name for joint in elements),
        sliding=np.array([joint.slides for joint in coupled.driving]),
        coupling=coupled.matrix,
        offset=coupled.offset,
        lower=coupled.lower,
        upper=coupled.upper,
        torque_limits=limits,
        rated=mount.torque_limits is not None,
        shoulder=root.inverse().apply(shoulder),
        reach=reach,
        spacing=np.array([np.linalg.norm(model.jointPlacements[i].translation) for i in ids]),
        ids=ids,
        frame=frame,
        places=np.array([joint.idx_q for joint in joints]),
        turning=np.flatnonzero([joint.nq == 2 for joint in joints]),
        columns=columns,
    )


def _torque_limits(mount: Mount, coupled: JointCoupling) -> Array:
    """Return what the joints that move by themselves bear: as the robot's file says, or its URDF.

    An effort of zero is what URDF demands where nothing is known, and a large one of all joints
    alike what exporters write then.
    """
    joints = coupled.driving
    given = mount.torque_limits
    if given is not None:
        if len(given) not in (1, len(joints)):
            raise InvalidInputError(
                f"one number is needed, or {len(joints)}, one for each joint from the body "
                f"outward, got {len(given)}"
            )
        return np.broadcast_to(np.array(given), len(joints)).copy()
    efforts = np.array([joint.effort for joint in joints])
    advice = "give torque_limit; 0 in its list means a joint without a motor"
    unknown = [joint.name for joint in joints if not 0.0 < joint.effort <= TOLERANCES.joint_torque]
    if unknown:
        raise InvalidInputError(
            f"missing, and the URDF has no effort above 0 and up to {TOLERANCES.joint_torque:g} "
            f"N·m (sliding: N) for {shorten(', '.join(unknown), 100, placeholder=' …')}; {advice}"
        )
    if efforts.min() == efforts.max() >= 1e3:  # [N·m, N] a placeholder
        raise InvalidInputError(
            f"missing, and the URDF has an effort of {efforts[0]:g} N·m (sliding: N) for "
            f"every joint, which exporters write where nothing is known; {advice}"
        )
    return efforts


def _bound(
    model: Any, elements: Sequence[JointElement], ids: Sequence[int], first: int, link: Pose
) -> tuple[Array, float]:
    """Return a limb's shoulder in the root link, and how far its last link can be from it [m].

    The link is given in its joint, which its reach goes up to; ``first`` is the first joint's rate.
    """
    data = model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    joints = [pose_of(data.oMi[i]) for i in ids]
    places = [joint.position for joint in joints]
    places.append(joints[-1].apply(link.position))
    if len(joints) > 1 and not elements[0].slides:
        axis = np.array(data.J[3:, first])
        if np.linalg.norm(np.cross(axis, places[1] - places[0])) <= TOLERANCES.axis_distance:
            places = places[1:]
    slides = sum(max(abs(each.lower), abs(each.upper)) for each in elements if each.slides)
    return places[0], sum(float(np.linalg.norm(b - a)) for a, b in pairwise(places)) + slides
