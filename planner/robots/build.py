"""Pinocchio's model of a robot, built from its URDF and the places of its hands."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final

import numpy as np
import pinocchio as pin

from hand_models.base import Array, Indices, InvalidInputError, Pose, within
from planner.robots.limb_joints import limb_joints, locked_joints
from planner.robots.robot_file import Mount, RobotDescription
from planner.robots.urdf import JointElement, parse_urdf

__all__ = ["Chain", "build_model", "pose_of"]

ROOT_JOINT: Final = 1
"""Index of the joint that lets the whole robot move freely, in Pinocchio's model."""

ROOT_NAME: Final = "free body\x01"
"""Its name, which no joint of a URDF can have: XML does not allow its last character."""

ON_AXIS: Final = 1e-9
"""How far from a joint's axis the next joint may be and still count as on it [m]."""


@dataclass(frozen=True, eq=False)
class Chain:
    """A limb: turning joints from the body outward, with a hand on the last link.

    Attributes
    ----------
    joints : tuple of str
        Names, from the body outward.
    lower, upper : ndarray, shape (n,)
        Limits of the joints' angles [rad], infinite for continuous joints.
    torque_limits : ndarray, shape (n,)
        What the joints bear [N·m].
    shoulder : ndarray, shape (3,)
        Where the limb begins, in B [m]: its second joint if that lies on the axis of the first, so
        that no joint moves it, otherwise its first.
    reach : float
        Upper bound of the distance from the shoulder to the link that carries the hand [m]: the
        sum of the distances from joint to joint, or where that link only turns in its place, the
        distance of H from there.
    spacing : ndarray, shape (n,)
        How far each joint is from the one before it, the first from B [m].
    ids, frame : tuple of int, int
        Of the joints and of H in Pinocchio's model.
    places : ndarray, shape (n,)
        Where the joints are in a configuration.
    turning : ndarray, shape (at most n,)
        Which of them are there as cosine and sine: those that turn without end.
    columns : slice
        Where they are among the rates.
    """

    joints: tuple[str, ...]
    lower: Array
    upper: Array
    torque_limits: Array
    shoulder: Array
    reach: float
    spacing: Array
    ids: tuple[int, ...]
    frame: int
    places: Indices
    turning: Indices
    columns: slice

    def turn(self, q: Array, angles: Array) -> None:
        """Write the limb's angles (n,) into a configuration of Pinocchio's, shape (nq,)."""
        q[self.places] = angles
        if self.turning.size:
            at, endless = self.places[self.turning], angles[self.turning]
            q[at], q[at + 1] = np.cos(endless), np.sin(endless)


def pose_of(placement: Any) -> Pose:
    """Return the pose that a placement of Pinocchio's says."""
    return Pose(np.array(placement.translation), np.array(placement.rotation))


def build_model(
    urdf: str, described: RobotDescription, hand_mass: float
) -> tuple[Any, Pose, dict[str, Chain], dict[str, float]]:
    """Return Pinocchio's model of a robot that floats, with its hands.

    Joints that no limb has are where they are locked, or at zero.

    Returns
    -------
    model
    root : Pose
        B in the root link.
    chains : dict of str to Chain
        By limb.
    locked : dict of str to float
        Where joints are that never move, by name [rad, or m].

    Raises
    ------
    InvalidInputError
        If the URDF is none, a link is not in it, or a limb is no chain of turning joints of its
        own.
    """
    with within("urdf"):
        tree = parse_urdf(urdf)
    with within("body"):
        tree.require(described.body)
    if not any(link.mass > 0.0 for link in tree.links.values()):
        raise InvalidInputError("no link has a mass; at least one must", field="urdf")
    locked = locked_joints(tree, described)
    joints = limb_joints(tree, described, locked)
    try:
        whole = pin.buildModelFromXML(urdf, pin.JointModelFreeFlyer(), ROOT_NAME)
    except (ValueError, RuntimeError) as error:
        raise InvalidInputError(
            f"Pinocchio cannot read it: {' '.join(str(error).split())}", field="urdf"
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
    link have the name of a joint, so meanwhile names tell what they are names of.
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
    shoulder, reach = _bound(model, ids, columns.start, pose_of(link.placement))
    if reach <= ON_AXIS:
        reach = float(np.linalg.norm(mount.pose.position))
    if reach <= ON_AXIS:
        raise InvalidInputError(
            "the limb's joints only turn the hand in its place; it must be away from them",
            field=f"limbs.{limb}.position",
        )
    if len(mount.torque_limits) not in (1, len(joints)):
        raise InvalidInputError(
            f"one number is needed, or {len(joints)}, one for each joint from the body outward, "
            f"got {len(mount.torque_limits)}",
            field=f"limbs.{limb}.torque_limit",
        )
    place = link.placement * pin.SE3(mount.pose.rotation, mount.pose.position)
    hand = pin.Inertia(hand_mass, np.array(mount.hand_com), np.zeros((3, 3)))
    model.appendBodyToJoint(ids[-1], hand, place)
    frame = model.addFrame(
        pin.Frame(f"hand of {limb}", ids[-1], link.parentFrame, place, pin.FrameType.OP_FRAME)
    )
    return Chain(
        joints=tuple(joint.name for joint in elements),
        lower=np.array([joint.lower for joint in elements]),
        upper=np.array([joint.upper for joint in elements]),
        torque_limits=np.broadcast_to(np.array(mount.torque_limits), len(joints)).copy(),
        shoulder=root.inverse().apply(shoulder),
        reach=reach,
        spacing=np.array([np.linalg.norm(model.jointPlacements[i].translation) for i in ids]),
        ids=ids,
        frame=frame,
        places=np.array([joint.idx_q for joint in joints]),
        turning=np.flatnonzero([joint.nq == 2 for joint in joints]),
        columns=columns,
    )


def _bound(model: Any, ids: tuple[int, ...], first: int, link: Pose) -> tuple[Array, float]:
    """Return a limb's shoulder in the root link, and how far its last link can be from it [m].

    The link is given in its joint, which its reach goes up to; ``first`` is the first joint's rate.
    """
    data = model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    joints = [pose_of(data.oMi[i]) for i in ids]
    places = [joint.position for joint in joints]
    places.append(joints[-1].apply(link.position))
    if len(joints) > 1:
        axis = np.array(data.J[3:, first])
        if np.linalg.norm(np.cross(axis, places[1] - places[0])) <= ON_AXIS:
            places = places[1:]
    return places[0], sum(float(np.linalg.norm(b - a)) for a, b in pairwise(places))
