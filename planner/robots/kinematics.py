"""A robot's kinematics and statics by joint angles, in the body frame B, with Pinocchio.

Rates of joints, twists and wrenches have the project's signs: a hand's Jacobian turns joint rates
into the twist of H in H's axes, and a joint's torque is its gravity torque + Jᵀ·(hand wrench on the
rock).
"""

from __future__ import annotations

import threading
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final

import numpy as np
import pinocchio as pin

from hand_models.base import (
    Array,
    Indices,
    InvalidInputError,
    Pose,
    finite_vector,
    wrench_transport,
)
from planner.robots.build import Mount, build_model, pose_of

__all__ = ["RobotModel", "Statics"]

ON_AXIS: Final = 1e-9
"""How far from a joint's axis the next joint may be and still count as on it [m]."""


@dataclass(frozen=True, eq=False)
class Statics:
    """What holds a robot up whose joints stand still.

    Attributes
    ----------
    body_wrench : ndarray, shape (6,)
        That the rock must exert on the robot, in B about B's origin [N, N·m].
    joint_torque : mapping of str to ndarray, shape (n,)
        By limb: torque of its joints while its hand carries nothing [N·m].
    """

    body_wrench: Array
    joint_torque: Mapping[str, Array]


class RobotModel:
    """A body and its limbs, each a chain of turning joints that ends in a hand.

    Angles are always a mapping of limb to an array (n,) [rad], from the body outward; limbs that
    are left out are at zero. Joints of the URDF that no limb has are locked at zero. A hand counts
    as a point mass. Threads may share a model.

    Parameters
    ----------
    urdf : str
        Text of the robot's URDF, without hands.
    body : str
        The link whose frame is B.
    mounts : mapping of str to Mount
        By limb.
    hand_mass : float
        [kg]

    Attributes
    ----------
    urdf, body, mounts, hand_mass
        As given.
    limbs : tuple of str
    joint_names : mapping of str to tuple of str
        By limb, from the body outward.
    lower, upper : mapping of str to ndarray, shape (n,)
        Limits of the joints' angles [rad], infinite for continuous joints.
    mass : float
        With the hands [kg].
    shoulders : mapping of str to ndarray, shape (3,)
        Where a limb begins, in B [m]: its second joint if that lies on the axis of the first, so
        that no joint moves it, otherwise its first.
    reach : mapping of str to float
        Upper bound of the distance from the shoulder to the link that carries the hand [m]: the
        sum of the distances from joint to joint, or where that link only turns in its place, the
        distance of H from there.
    built : BuiltModel
        Pinocchio's model; the body floats, with its root link at the origin.
    places, continuous, columns
        By limb: where its joints are in a configuration, which of them are there as cosine and
        sine, and where they are among the rates.

    Raises
    ------
    InvalidInputError
        If the URDF is none, a link is not in it, or a limb is no chain of turning joints of its
        own.
    """

    def __init__(self, urdf: str, body: str, mounts: Mapping[str, Mount], hand_mass: float) -> None:
        self.urdf, self.body, self.mounts, self.hand_mass = urdf, body, dict(mounts), hand_mass
        self.built = built = build_model(urdf, body, tuple(mounts.items()), hand_mass)
        self._model = built.model
        self._local = threading.local()
        self.limbs = tuple(mounts)
        self.joint_names = {
            limb: tuple(joint.name for joint in chain) for limb, chain in built.joints.items()
        }
        self.lower = {
            limb: np.array([joint.lower for joint in chain]) for limb, chain in built.joints.items()
        }
        self.upper = {
            limb: np.array([joint.upper for joint in chain]) for limb, chain in built.joints.items()
        }
        self.continuous = {
            limb: np.array([built.model.joints[i].nq == 2 for i in built.ids[limb]])
            for limb in self.limbs
        }
        self.places: dict[str, Indices] = {
            limb: np.array([built.model.joints[i].idx_q for i in built.ids[limb]])
            for limb in self.limbs
        }
        # limbs share no joints and the others are locked, so a limb's joints follow each other
        self.columns: Mapping[str, slice] = {
            limb: slice(
                built.model.joints[ids[0]].idx_v,
                built.model.joints[ids[-1]].idx_v + 1,
            )
            for limb, ids in built.ids.items()
        }
        self._neutral = np.array(pin.neutral(built.model))
        self._from_root = built.body.inverse()
        self._to_body = wrench_transport(self._from_root)
        self.mass = float(pin.computeTotalMass(built.model))
        ends = {limb: self._bound(limb) for limb in self.limbs}
        self.shoulders = {limb: shoulder for limb, (shoulder, _) in ends.items()}
        self.reach = {limb: reach for limb, (_, reach) in ends.items()}

    def __reduce__(self) -> tuple[type[RobotModel], tuple[Any, ...]]:
        # Pinocchio's model and the thread's data stay behind: the other process builds its own
        return RobotModel, (self.urdf, self.body, self.mounts, self.hand_mass)

    @property
    def data(self) -> Any:
        """Pinocchio's working memory of this thread."""
        try:
            return self._local.data
        except AttributeError:
            self._local.data = self.built.model.createData()
            return self._local.data

    def configuration(self, angles: Mapping[str, Array]) -> Array:
        """Return Pinocchio's configuration, shape (nq,), with the root link at the origin.

        Raises
        ------
        InvalidInputError
            If a limb is unknown, or its angles are not as many finite numbers as it has joints.
        """
        q = self._neutral.copy()
        for limb, given in angles.items():
            if limb not in self.places:
                raise InvalidInputError(
                    f"unknown limb {limb!r}; known are {', '.join(self.limbs)}", field="joints"
                )
            places, turning = self.places[limb], self.continuous[limb]
            values = finite_vector(given, len(places), f"joints.{limb}")
            q[places] = np.where(turning, np.cos(values), values)
            q[places[turning] + 1] = np.sin(values[turning])
        return q

    def hand_poses(self, angles: Mapping[str, Array]) -> dict[str, Pose]:
        """Return every limb's H in B."""
        return {limb: pose for limb, (pose, _) in self.kinematics(angles).items()}

    def jacobians(self, angles: Mapping[str, Array]) -> dict[str, Array]:
        """Return every limb's Jacobian, shape (6, n) [m/rad, 1].

        It turns the joints' rates into the twist of H against B in H's axes, linear part first.
        """
        return {limb: jacobian for limb, (_, jacobian) in self.kinematics(angles).items()}

    def kinematics(
        self, angles: Mapping[str, Array], limbs: Iterable[str] | None = None
    ) -> dict[str, tuple[Pose, Array]]:
        """Return H in B and the Jacobian of each limb, of all by default, from one pass."""
        model, data = self._model, self.data
        pin.computeJointJacobians(model, data, self.configuration(angles))
        found: dict[str, tuple[Pose, Array]] = {}
        for limb in self.limbs if limbs is None else limbs:
            frame = self.built.frames[limb]
            pose = self._from_root @ pose_of(pin.updateFramePlacement(model, data, frame))
            jacobian = pin.getFrameJacobian(model, data, frame, pin.ReferenceFrame.LOCAL)
            found[limb] = pose, np.ascontiguousarray(jacobian[:, self.columns[limb]])
        return found

    def statics(
        self,
        angles: Mapping[str, Array],
        gravity: Array,
        acceleration: Array | None = None,
    ) -> Statics:
        """Return what holds the robot up, at rest or while it accelerates as one rigid body.

        Parameters
        ----------
        angles : mapping of str to ndarray
        gravity : ndarray, shape (3,)
            In B [m/s²].
        acceleration : ndarray, shape (6,), optional
            Of B in B, linear part first [m/s², rad/s²]; none by default. Velocities are zero.
        """
        model, data = self._model, self.data
        rates = self.root_acceleration(gravity, acceleration)
        torque = pin.rnea(model, data, self.configuration(angles), np.zeros(model.nv), rates)
        return Statics(
            self._to_body @ torque[:6],
            {limb: np.array(torque[columns]) for limb, columns in self.columns.items()},
        )

    def forces(self, loads: Mapping[str, Array]) -> Any:
        """Return Pinocchio's outer forces on every joint, of hands that exert wrenches on the rock.

        Parameters
        ----------
        loads : mapping of str to ndarray, shape (6,)
            By limb, in H [N, N·m]; none where it is left out.
        """
        forces = pin.StdVec_Force()
        for _ in range(self._model.njoints):
            forces.append(pin.Force.Zero())
        for limb, load in loads.items():
            place = self._model.frames[self.built.frames[limb]].placement
            wrench = finite_vector(load, 6, f"loads.{limb}")
            forces[self.built.ids[limb][-1]] = place.act(pin.Force(-wrench))
        return forces

    def root_acceleration(self, gravity: Array, acceleration: Array | None = None) -> Array:
        """Return Pinocchio's accelerations, shape (nv,), of a body that moves as in `statics`.

        Gravity is an acceleration of the root link the other way.
        """
        spatial = (
            np.zeros(6) if acceleration is None else finite_vector(acceleration, 6, "acceleration")
        )
        spatial = spatial - np.concatenate([finite_vector(gravity, 3, "gravity"), np.zeros(3)])
        rates = np.zeros(self._model.nv)
        rates[:6] = self._to_body.T @ spatial
        return rates

    def com(self, angles: Mapping[str, Array]) -> Array:
        """Return the centre of mass of the robot with its hands in B, shape (3,) [m]."""
        data = self.data
        centre = pin.centerOfMass(self._model, data, self.configuration(angles))
        return self._from_root.apply(np.array(centre))

    def inertia(self, angles: Mapping[str, Array]) -> Array:
        """Return the spatial inertia about B's origin in B, shape (6, 6) [kg, kg·m, kg·m²].

        The robot's wrench in `statics` is ``inertia @ [a − g, α]``.
        """
        data = self.data
        mass_matrix = np.array(pin.crba(self._model, data, self.configuration(angles)))
        composite = mass_matrix[:6, :6]
        composite = np.triu(composite) + np.triu(composite, 1).T
        return np.asarray(self._to_body @ composite @ self._to_body.T)

    def link_chain(self, angles: Mapping[str, Array], limb: str) -> Array:
        """Return the places in B of a limb's joints and of its H, shape (n + 1, 3) [m]."""
        data = self.data
        pin.framesForwardKinematics(self._model, data, self.configuration(angles))
        places = [data.oMi[i].translation for i in self.built.ids[limb]]
        places.append(data.oMf[self.built.frames[limb]].translation)
        return self._from_root.apply(np.array(places))

    def _bound(self, limb: str) -> tuple[Array, float]:
        """Return a limb's shoulder in B, and the farthest that its last link can be from it [m]."""
        built, data = self.built, self.data
        pin.forwardKinematics(built.model, data, self._neutral)
        joints = [pose_of(data.oMi[i]) for i in built.ids[limb]]
        places = [joint.position for joint in joints]
        places.append(joints[-1].apply(built.links[limb].position))
        pin.computeJointJacobians(built.model, data, self._neutral)
        if len(joints) > 1:
            axis = np.array(data.J[3:, self.columns[limb].start])
            if np.linalg.norm(np.cross(axis, places[1] - places[0])) <= ON_AXIS:
                places = places[1:]
        reach = sum(float(np.linalg.norm(b - a)) for a, b in pairwise(places))
        if reach <= ON_AXIS:
            reach = float(np.linalg.norm(self.mounts[limb].position))
        if reach <= ON_AXIS:
            raise InvalidInputError(
                "the limb's joints only turn the hand in its place; it must be away from them",
                field=f"limbs.{limb}.position",
            )
        return self._from_root.apply(places[0]), reach
