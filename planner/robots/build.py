"""Pinocchio's model of a robot, built from its URDF and the places of its hands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

import numpy as np
import pinocchio as pin

from hand_models.base import InvalidInputError, Pose
from planner.robots.urdf import JointElement, Urdf, parse_urdf

__all__ = ["BuiltModel", "Mount", "build_model", "pose_of"]

ROOT_JOINT: Final = 1
"""Index of the joint that lets the whole robot move freely, in Pinocchio's model."""

MOST_JOINTS: Final = 64
"""More joints of a limb than this no request names."""


@dataclass(frozen=True)
class Mount:
    """Where a hand sits.

    Attributes
    ----------
    link : str
        The link that carries it.
    position : tuple of float
        Origin of H in the link [m].
    orientation : tuple of float
        Quaternion ``[x, y, z, w]`` of H in the link.
    hand_com : tuple of float
        The hand's centre of mass in H [m].
    """

    link: str
    position: tuple[float, ...]
    orientation: tuple[float, ...] = (0.0, 0.0, 0.0, 1.0)
    hand_com: tuple[float, ...] = (0.0, 0.0, 0.0)

    @property
    def pose(self) -> Pose:
        """H in the link."""
        return Pose.from_quaternion(self.position, self.orientation)


@dataclass(frozen=True, eq=False)
class BuiltModel:
    """Pinocchio's model, and where a limb's parts are in it."""

    model: Any
    body: Pose  # B in the root link
    links: Mapping[str, Pose]  # of each limb, in its last joint
    joints: Mapping[str, tuple[JointElement, ...]]
    ids: Mapping[str, tuple[int, ...]]
    frames: Mapping[str, int]


def pose_of(placement: Any) -> Pose:
    """Return the pose that a placement of Pinocchio's says."""
    return Pose(np.array(placement.translation), np.array(placement.rotation))


def _limb_joints(
    tree: Urdf, body: str, mounts: tuple[tuple[str, Mount], ...]
) -> dict[str, tuple[JointElement, ...]]:
    """Return every limb's joints; refuse limbs without any, and limbs that share some."""
    chains: dict[str, tuple[JointElement, ...]] = {}
    owner: dict[str, str] = {}
    for limb, mount in mounts:
        field = f"limbs.{limb}.link"
        try:
            chain = tree.chain(body, mount.link)
        except InvalidInputError as error:
            raise error.within(field) from None
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


@lru_cache(maxsize=32)
def build_model(
    urdf: str, body: str, mounts: tuple[tuple[str, Mount], ...], hand_mass: float
) -> BuiltModel:
    """Return Pinocchio's model of a robot that floats, with its hands, other joints at zero."""
    try:
        tree = parse_urdf(urdf)
    except InvalidInputError as error:
        raise error.within("urdf") from None
    try:
        tree.require(body)
    except InvalidInputError as error:
        raise error.within("body") from None
    if not tree.mass > 0.0:
        raise InvalidInputError("no link has a mass; at least one must", field="urdf")
    joints = _limb_joints(tree, body, mounts)
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
    ids: dict[str, tuple[int, ...]] = {}
    frames: dict[str, int] = {}
    links: dict[str, Pose] = {}
    for limb, mount in mounts:
        ids[limb] = tuple(model.getJointId(joint.name) for joint in joints[limb])
        link = model.frames[model.getFrameId(mount.link, pin.FrameType.BODY)]
        links[limb] = pose_of(link.placement)
        place = link.placement * pin.SE3(mount.pose.rotation, mount.pose.position)
        last = ids[limb][-1]
        hand = pin.Inertia(hand_mass, np.array(mount.hand_com), np.zeros((3, 3)))
        model.appendBodyToJoint(last, hand, place)
        frames[limb] = model.addFrame(
            pin.Frame(f"hand of {limb}", last, link.parentFrame, place, pin.FrameType.OP_FRAME)
        )
    root = pose_of(model.frames[model.getFrameId(body, pin.FrameType.BODY)].placement)
    return BuiltModel(model, root, links, joints, ids, frames)
