"""Represent the links of a robot by capsules, to compute its clearance from the rock.

A capsule is the set of points within a radius of a line segment. A robot's file may define the
capsules of any link (``[capsules]``, by the link's name or a pattern of names). A joint of a limb
whose links have no capsule gets one from that joint to the next; its radius is the limb's
``radius``, or else that of ``parameters/scene.toml``. Other links have no capsule.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from hand_models.base import Array, Indices
from hand_models.parameters import bundled_table
from planner.robots.build import ROOT_JOINT, Chain, pose_of
from planner.robots.robot_file import RobotDescription

__all__ = ["Capsules", "capsules_of", "scene_number"]


class Capsules(NamedTuple):
    """Capsules of a robot's links: first those of the body, then limb by limb, outward.

    Attributes
    ----------
    names : tuple of str, length n
        Link of each capsule that the robot's file defines; of the others, the joint that moves the
        capsule. A link may have several.
    limbs : tuple of str or None, length n
        Limb of each capsule; None for the body's.
    steps : ndarray of int, shape (n,)
        Number of the limb's joints that move a capsule; zero for the body's.
    joints : ndarray of int, shape (n,)
        Index in Pinocchio's model of the joint that a capsule moves with.
    ends : ndarray, shape (n, 2, 3)
        Ends of each segment, in the frame of that joint [m].
    radii : ndarray, shape (n,)
        Radius of each capsule [m].
    assumed : ndarray of bool, shape (n,)
        True if the radius is from ``parameters/scene.toml``, not from the robot's file.
    """

    names: tuple[str, ...]
    limbs: tuple[str | None, ...]
    steps: Indices
    joints: Indices
    ends: Array
    radii: Array
    assumed: NDArray[np.bool_]


class _Capsule(NamedTuple):
    name: str
    limb: str | None
    step: int
    joint: int
    ends: Array
    radius: float
    assumed: bool = False


def capsules_of(model: Any, described: RobotDescription, chains: Mapping[str, Chain]) -> Capsules:
    """Return the capsules of a robot's links.

    Parameters
    ----------
    model : pinocchio.Model
        Pinocchio's model of the robot.
    described : RobotDescription
        Content of the robot's file, with its capsules and radii.
    chains : mapping of str to Chain
        Joints of each limb.
    """
    places = {ROOT_JOINT: (None, 0)} | {  # moved by no joint
        joint: (limb, step)
        for limb, chain in chains.items()
        for step, joint in enumerate(chain.ids, start=1)
    }
    found = list(_given(model, described, places))
    known = {capsule.joint for capsule in found}
    for limb, chain in chains.items():
        known_radius = described.mounts[limb].radius
        assumed = known_radius is None
        radius = scene_number("link", "radius") if known_radius is None else known_radius
        link = model.frames[model.getFrameId(described.mounts[limb].link, pin.FrameType.BODY)]
        steps = [model.jointPlacements[joint].translation for joint in chain.ids[1:]]
        tips = zip(chain.ids, [*steps, link.placement.translation], strict=True)
        for step, (joint, tip) in enumerate(tips, start=1):
            if joint not in known:
                name, segment = chain.moving[step - 1], np.array([np.zeros(3), tip])
                found.append(_Capsule(name, limb, step, joint, segment, radius, assumed))
    order = [None, *chains]
    found.sort(key=lambda each: (order.index(each.limb), each.step))
    return Capsules(
        names=tuple(each.name for each in found),
        limbs=tuple(each.limb for each in found),
        steps=np.array([each.step for each in found], dtype=np.intp),
        joints=np.array([each.joint for each in found], dtype=np.intp),
        ends=np.array([each.ends for each in found]).reshape(-1, 2, 3),
        radii=np.array([each.radius for each in found], dtype=float),
        assumed=np.array([each.assumed for each in found], dtype=bool),
    )


def _given(
    model: Any, described: RobotDescription, places: Mapping[int, tuple[str | None, int]]
) -> Iterator[_Capsule]:
    """Yield the capsules that a robot's file has; those of links that no limb has stay out."""
    for frame in model.frames:
        if frame.type != pin.FrameType.BODY or frame.parentJoint not in places:
            continue
        limb, step = places[frame.parentJoint]
        for pattern, rows in described.capsules.items():
            if fnmatchcase(frame.name, pattern):
                for *places_of_ends, radius in rows:
                    ends = pose_of(frame.placement).apply(np.reshape(places_of_ends, (2, 3)))
                    yield _Capsule(frame.name, limb, step, frame.parentJoint, ends, radius)


def scene_number(section: str, name: str) -> float:
    """Return a positive number of ``parameters/scene.toml``, in SI units."""
    return bundled_table("scene.toml", "planner.parameters").positive(section, name)
