"""Pinocchio's model of a robot, built from its URDF and the places of its hands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final

import numpy as np
import pinocchio as pin

from hand_models.base import Array, Indices, InvalidInputError, Pose, within
from planner.robots.robot_file import Mount, RobotDescription
from planner.robots.urdf import JointElement, Urdf, parse_urdf

__all__ = ["Chain", "build_model", "pose_of"]

ROOT_JOINT: Final = 1
"""Index of the joint that lets the whole robot move freely, in Pinocchio's model."""

MOST_JOINTS: Final = 64
"""More joints of a limb than this no request names."""

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


def _limb_joints(
    tree: Urdf, body: str, mounts: Mapping[str, Mount]
) -> dict[str, tuple[JointElement, ...]]:
    """Return every limb's joints; refuse limbs without any, and limbs that share some."""
    chains: dict[str, tuple[JointElement, ...]] = {}
    owner: dict[str, str] = {}
    for limb, mount in mounts.items():
        field = f"limbs.{limb}.link"
        with within(field):
            chain = tree.chain(body, mount.link)
        if not chain:
            raise InvalidInputError(
                f"no joint moves between {body!r} and {mount.link!r}; a limb has at least one",
                field=field,
            )
        if len(chain) > MOST_JOINTS:
            raise InvalidInputError(
                f"a limb has at most {MOST_JOINTS} joints, got {len(chain)}", field=field
            )
        for joint in chain:
            other = owner.setdefault(joint.name, limb)
            if other != limb:
                raise InvalidInputError(
                    f"limbs {other!r} and {limb!r} share joint {joint.name!r}; every limb needs "
                    "joints of its own",
                    field=field,
                )
        chains[limb] = chain
    return chains


def build_model(
    urdf: str, described: RobotDescription, hand_mass: float
) -> tuple[Any, Pose, dict[str, Chain]]:
    """Return Pinocchio's model of a robot that floats, with its hands, other joints at zero.

    Returns
    -------
    model
    root : Pose
        B in the root link.
    chains : dict of str to Chain
        By limb.

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
    joints = _limb_joints(tree, described.body, described.mounts)
    try:
        whole = pin.buildModelFromXML(urdf, pin.JointModelFreeFlyer(), "free body")
    except (ValueError, RuntimeError) as error:
        raise InvalidInputError(
            f"Pinocchio cannot read it: {' '.join(str(error).split())}", field="urdf"
        ) from None
    kept = {joint.name for chain in joints.values() for joint in chain}
    locked = [i for i in range(ROOT_JOINT + 1, whole.njoints) if whole.names[i] not in kept]
    model = pin.buildReducedModel(whole, locked, pin.neutral(whole))
    model.gravity.setZero()  # gravity comes as an acceleration of the root, so that it may vary
    root = pose_of(model.frames[model.getFrameId(described.body, pin.FrameType.BODY)].placement)
    chains = {
        limb: _mounted(model, root, limb, mount, joints[limb], hand_mass)
        for limb, mount in described.mounts.items()
    }
    return model, root, chains


def _mounted(
    model: Any,
    root: Pose,
    limb: str,
    mount: Mount,
    elements: tuple[JointElement, ...],
    hand_mass: float,
) -> Chain:
    """Put a hand on its link in Pinocchio's model, and return the limb that it is on."""
    ids = tuple(model.getJointId(joint.name) for joint in elements)
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
