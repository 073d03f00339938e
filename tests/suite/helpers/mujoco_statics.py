"""A robot in MuJoCo: joint torques and the rest of the balance, from what a knot says."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import mujoco
import numpy as np

from hand_models.base import Array
from planner import Knot, Robot

__all__ = ["MujocoStatics"]


class MujocoStatics:
    """A robot with point masses for hands, floating freely, in MuJoCo."""

    def __init__(self, robot: Robot) -> None:
        self._robot, described = robot, robot.description
        tree = ElementTree.fromstring(robot.urdf)
        for link in tree.iter("link"):
            for part in ("visual", "collision"):
                for each in link.findall(part):
                    link.remove(each)
        spec = mujoco.MjSpec.from_string(ElementTree.tostring(tree, encoding="unicode"))
        spec.compiler.fusestatic = False
        spec.compiler.balanceinertia = True
        spec.worldbody.first_body().add_freejoint()
        for limb, mount in described.mounts.items():
            link = spec.body(mount.link)
            link.add_site(name=limb, pos=mount.pose.position, quat=_quaternion(mount.pose.rotation))
            com = mount.pose.apply(np.array(mount.hand_com))
            link.add_body(
                name=f"hand of {limb}",
                pos=com,
                ipos=np.zeros(3),
                mass=robot.hand.mass,
                inertia=[1e-12] * 3,
                explicitinertial=True,
            )
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)

    def rest(self, knot: Knot, gravity: Array) -> tuple[dict[str, Array], Array]:
        """Return the joint torques by limb [N·m], and what is left of the balance, (6,) [N, N·m].

        Of the hands only the wrenches and poses in W are used, of the robot only the joint angles.
        """
        model, data, robot = self._model, self._data, self._robot
        model.opt.gravity[:] = gravity
        root = knot.body @ robot.root.inverse()
        data.qpos[:3], data.qpos[3:7] = root.position, _quaternion(root.rotation)
        at: dict[str, list[int]] = {}
        for limb, angles in knot.joints.items():
            chain = robot.chains[limb]
            own = [model.joint(name) for name in chain.joints]
            for joint, angle in zip(own, angles, strict=True):
                data.qpos[joint.qposadr[0]] = angle
            at[limb] = [int(joint.dofadr[0]) for joint in own]
        data.qvel[:] = data.qacc[:] = 0.0
        mujoco.mj_inverse(model, data)
        torques = data.qfrc_inverse.copy()
        rows = np.zeros((2, 3, model.nv))
        for hand in knot.hands:
            site = model.site(hand.limb).id
            # the wrench acts where the knot has H, on the link
            body = int(model.site_bodyid[site])
            mujoco.mj_jac(model, data, rows[0], rows[1], hand.pose.position, body)
            wrench = hand.wrench_in_world
            moment = wrench[3:] - np.cross(hand.pose.position, wrench[:3])
            torques -= rows[0].T @ wrench[:3] + rows[1].T @ moment
        return {limb: torques[own] for limb, own in at.items()}, torques[:6]


def _quaternion(rotation: Array) -> Array:
    found = np.zeros(4)
    mujoco.mju_mat2Quat(found, np.ascontiguousarray(rotation).ravel())
    return found
