"""Meshes of a robot's links, as its URDF names them, to draw the robot."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from hand_models.base import InvalidInputError, Pose
from hand_models.rock import Triangles
from planner.robots.build import ROOT_JOINT, pose_of
from planner.robots.robot import Angles, Robot

__all__ = ["LinkMesh", "joint_poses", "link_meshes"]


class LinkMesh(NamedTuple):
    """Mesh of one ``<visual>`` of a robot's URDF.

    Attributes
    ----------
    joint : int
        Index in Pinocchio's model of the joint that the mesh moves with.
    pose : Pose
        Pose of the mesh in that joint's frame.
    file : str
        Path of the mesh, and its scale.
    triangles : Triangles
        In the mesh's own frame [m].
    """

    joint: int
    pose: Pose
    file: str
    triangles: Triangles


def link_meshes(robot: Robot) -> list[LinkMesh]:
    """Return the meshes of a robot's links; none if its URDF names none.

    A name ``package://NAME/...`` is looked for in the URDF's folder and all folders above it.

    Raises
    ------
    InvalidInputError
        If a mesh cannot be read.
    """
    if "<mesh" not in robot.urdf:
        return []
    # names without a scheme are from the URDF's folder
    plain = r"(<mesh\b[^>]*\bfilename=[\"'])(?!/|\w+:)"
    text = re.sub(plain, lambda match: f"{match[1]}{robot.folder}/", robot.urdf)
    above = [str(each) for each in (robot.folder, *robot.folder.parents)]
    try:
        found = pin.buildGeomFromUrdfString(
            robot.model, text, pin.GeometryType.VISUAL, package_dirs=above
        )
    except (ValueError, RuntimeError) as error:
        said = " ".join(str(error).split()).rpartition("message: ")[2].partition(" Hint: ")[0]
        raise InvalidInputError(f"a mesh cannot be read: {said}", field="urdf") from None
    return list(_meshes(robot, found.geometryObjects))


def joint_poses(robot: Robot, angles: Angles) -> list[Pose]:
    """Return the poses in B of all joints of Pinocchio's model, by index, at joint angles."""
    data, from_root = robot.data, robot.root.inverse()
    pin.forwardKinematics(robot.model, data, robot.configuration(angles))
    return [from_root @ pose_of(placement) for placement in data.oMi]


def _meshes(robot: Robot, geometry: pin.StdVec_GeometryObject) -> Iterator[LinkMesh]:
    """Yield the meshes, not the boxes and cylinders, that move with the body or a limb."""
    moved = {ROOT_JOINT, *(joint for chain in robot.chains.values() for joint in chain.ids)}
    known: dict[str, Triangles] = {}
    for each in geometry:
        shape = each.geometry
        if each.parentJoint not in moved or not hasattr(shape, "tri_indices"):
            continue
        file = f"{each.meshPath} {each.meshScale}"
        if file not in known:
            found = (shape.tri_indices(i) for i in range(shape.num_tris))
            corners = [(part[0], part[1], part[2]) for part in found]
            vertices = np.array(shape.vertices(), dtype=float).reshape(-1, 3)
            known[file] = Triangles(vertices, np.array(corners, dtype=np.intp).reshape(-1, 3))
        yield LinkMesh(each.parentJoint, pose_of(each.placement), file, known[file])
