"""Climbing robots (RoboSimian, which is bundled, or any from a file): kinematics and statics.

Positions and forces follow from joint angles, in the body frame B, by Pinocchio. Signs: a hand's
Jacobian J maps joint rates to the twist of the hand frame H in H's axes; a joint's torque is its
gravity torque + Jᵀ·(wrench of the hand on the rock).
"""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from hand_models.base import (
    Array,
    InvalidInputError,
    Pose,
    errors_under,
    finite_vector,
    in_file,
    stored,
    wrench_transport,
)
from hand_models.hand import SpinyHand, spiny_hand
from hand_models.parameters import ParameterTable
from planner.robots.build import build_model, pose_of
from planner.robots.capsules import capsules_of
from planner.robots.robot_file import RobotDescription, RobotFile
from planner.robots.urdf import parse_urdf

__all__ = ["Angles", "Robot", "Statics", "robosimian", "robot_of"]


Angles = Mapping[str, Array] | Mapping[str, Sequence[float]]
"""Angles of limbs' joints, by limb [rad]."""


class Statics(NamedTuple):
    """Body wrench and joint torques that carry a robot's weight and acceleration.

    Attributes
    ----------
    body_wrench : ndarray, shape (6,)
        Wrench that the rock must exert on the robot, in B about B's origin [N, N·m].
    joint_torque : dict of str to ndarray, shape (n,)
        Torques of a limb's joints while its hand exerts no wrench, by limb [N·m].
    """

    body_wrench: Array
    joint_torque: dict[str, Array]


class Robot:
    """A climbing robot: a body and its limbs, each a chain of joints that ends in a hand.

    Joint angles are a mapping of limb name to array (n,) [rad], [m] for joints that slide, from the
    body outward. A limb that is left out has all joints at zero, or at the limit nearest to zero.
    Joints that belong to no limb stay where the robot's file or equal limits lock them, or at zero.
    A hand counts as a point mass. Threads may share a robot.

    Parameters
    ----------
    description : RobotDescription
        Content of the robot's file.
    urdf : str
        Text of the robot's URDF, without hands.
    hand : SpinyHand
        The hand on every limb.
    folder : Path, optional
        Folder of the URDF, from which it names its meshes.

    Attributes
    ----------
    description, urdf, hand, folder
        The parameters.
    name : str
        Name of the robot in its file.
    mass : float
        Mass of the robot with its hands [kg].
    com : ndarray, shape (3,)
        Centre of mass in B that is used while no joint angles are given [m].
    limbs : tuple of str
        Names of the limbs, in the order of the robot's file.
    chains : dict of str to Chain
        Joints of each limb, by limb.
    back : ndarray, shape (3,), or None
        Unit vector out of the robot's back, in B; None if its file has none.
    reach : float
        Reach of the longest limb [m].
    tree : Urdf
        Links and joints of the URDF.
    model : pinocchio.Model
        The robot with a free-floating body.
    root : Pose
        Pose of B in the root link.
    locked : dict of str to float
        Positions of the joints that never move, by name [rad, or m].
    capsules : Capsules
        Capsules about the links, without the hands, for clearance (collision) checks.
    body_capsules : tuple of ndarray, shapes (n, 2, 3), (n,)
        Segments in B and radii of the capsules that no joint moves [m].

    Raises
    ------
    InvalidInputError
        If the URDF is invalid, a link is not in it, or a limb is no chain of joints of its own.
    """

    def __init__(
        self, description: RobotDescription, urdf: str, hand: SpinyHand, folder: Path = Path()
    ) -> None:
        self.description, self.urdf, self.hand, self.folder = description, urdf, hand, folder
        with errors_under("urdf"):
            self.tree = parse_urdf(urdf)
        self.model, self.root, self.chains, self.locked = build_model(
            self.tree, urdf, description, hand.mass
        )
        self._local = threading.local()
        self._from_root = self.root.inverse()
        self._to_body = wrench_transport(self._from_root)
        self.name = description.name
        self.limbs = tuple(self.chains)
        self.back = None if description.back is None else np.array(description.back)
        self.reach = max(chain.reach for chain in self.chains.values())
        self.mass = float(pin.computeTotalMass(self.model))
        self._com_at_zero = self.com_at({})
        self.com = self._com_at_zero if description.com is None else np.array(description.com)
        self._limb_weights = self._weighed_limbs()
        self.capsules = capsules_of(self.model, description, self.chains)
        of_body = int((self.capsules.steps == 0).sum())
        self.body_capsules = (
            self._from_root.apply(self.capsules.ends[:of_body]),
            self.capsules.radii[:of_body],
        )
        # of each limb: its link's origin in H, its shoulder in B, its reach
        self._ends = {
            limb: (*mount.pose.inverse().position.tolist(), *chain.shoulder.tolist(), chain.reach)
            for (limb, chain), mount in zip(
                self.chains.items(), description.mounts.values(), strict=True
            )
        }

    def __reduce__(self) -> tuple[type[Robot], tuple[Any, ...]]:
        # Pinocchio's model and the thread's data stay behind: the other process builds its own
        return Robot, (self.description, self.urdf, self.hand, self.folder)

    def stretches(self, body: Pose, limbs: Sequence[str], hands: Sequence[Pose]) -> list[float]:
        """Return the distance of each hand from its limb's shoulder as a share of the limb's reach.

        Parameters as in `limb_spans`. A hand with a share above 1 is out of reach.
        """
        away, reach = self.limb_spans(body, limbs, hands)
        return (np.sqrt(np.einsum("nx,nx->n", away, away)) / reach).tolist()  # type: ignore[no-any-return]

    def limb_spans(
        self, body: Pose, limbs: Sequence[str], hands: Sequence[Pose]
    ) -> tuple[Array, Array]:
        """Return each limb's reach, and the vector from its shoulder to the link of its hand.

        Parameters
        ----------
        body : Pose
            Pose of B in the world frame W.
        limbs : sequence of str, length n
            Name of the limb of each hand.
        hands : sequence of Pose, length n
            Pose of each limb's hand frame H in W.

        Returns
        -------
        away : ndarray, shape (n, 3)
            Vectors from shoulder to link, in B [m].
        reach : ndarray, shape (n,)
            Upper bound of the length of each vector [m].
        """
        ends = np.array([self._ends[limb] for limb in limbs])
        links = np.einsum("nxy,ny->nx", np.array([hand.rotation for hand in hands]), ends[:, :3])
        links += np.array([hand.position for hand in hands]) - body.position
        return links @ body.rotation - ends[:, 3:6], ends[:, 6]

    @property
    def data(self) -> Any:
        """Pinocchio's working memory (`pinocchio.Data`), one for each thread."""
        try:
            return self._local.data
        except AttributeError:
            self._local.data = self.model.createData()
            return self._local.data

    def configuration(self, angles: Angles) -> Array:
        """Return Pinocchio's configuration vector, shape (nq,), with the root link at the origin.

        Raises
        ------
        InvalidInputError
            If an angle is invalid or beyond its joint's limits; see `checked_angles`.
        """
        q, known = np.array(pin.neutral(self.model)), self.checked_angles(angles)
        for limb, chain in self.chains.items():
            chain.turn(q, known.get(limb, chain.rest))
        return q

    def checked_angles(self, angles: Angles) -> dict[str, Array]:
        """Return joint angles as arrays, by limb, after a check against the joints' limits.

        Raises
        ------
        InvalidInputError
            If a limb is unknown, or an angle is missing, not finite or more than 1e-6 beyond its
            joint's limits; the error's field is the limb, with the joint's index.
        """
        found = {}
        for limb, given in angles.items():
            if limb not in self.chains:
                known = ", ".join(self.limbs)
                raise InvalidInputError(f"unknown limb; known are {known}", field=limb)
            chain = self.chains[limb]
            found[limb] = finite_vector(given, len(chain.joints), limb)
            beyond = np.maximum(chain.lower - found[limb], found[limb] - chain.upper)
            for i in np.flatnonzero(beyond > 1e-6).tolist():  # [rad, or m] rounding of seven digits
                unit = "m" if chain.sliding[i] else "rad"
                raise InvalidInputError(
                    f"{chain.joints[i]} goes from {chain.lower[i]:.6g} to {chain.upper[i]:.6g} "
                    f"{unit}, got {found[limb][i]:.6g} {unit}",
                    field=f"{limb}[{i}]",
                )
        return found

    def hand_poses(self, angles: Angles) -> dict[str, Pose]:
        """Return the pose of each limb's hand frame H in B (forward kinematics), by limb.

        Raises
        ------
        InvalidInputError
            If an angle is invalid or beyond its joint's limits; see `checked_angles`.
        """
        return {limb: pose for limb, (pose, _) in self.kinematics(angles).items()}

    def jacobians(self, angles: Angles) -> dict[str, Array]:
        """Return the Jacobian of each limb's hand, shape (6, n), by limb [m/rad, 1].

        The Jacobian maps joint rates to the twist of H against B in H's axes, linear part first.
        """
        return {limb: jacobian for limb, (_, jacobian) in self.kinematics(angles).items()}

    def kinematics(self, angles: Angles) -> dict[str, tuple[Pose, Array]]:
        """Return the pose of H in B and the Jacobian, shape (6, n), of each limb, from one pass."""
        model, data = self.model, self.data
        pin.computeJointJacobians(model, data, self.configuration(angles))
        found: dict[str, tuple[Pose, Array]] = {}
        for limb, chain in self.chains.items():
            pose = self._from_root @ pose_of(pin.updateFramePlacement(model, data, chain.frame))
            jacobian = pin.getFrameJacobian(model, data, chain.frame, pin.ReferenceFrame.LOCAL)
            found[limb] = pose, jacobian[:, chain.columns] @ chain.coupling
        return found

    def statics(
        self,
        angles: Angles,
        gravity: Array,
        acceleration: Array | None = None,
    ) -> Statics:
        """Return the body wrench and joint torques that carry the robot (inverse dynamics).

        All velocities are zero and the joints stand still.

        Parameters
        ----------
        angles : mapping of str to ndarray, shape (n,)
            Joint angles, by limb [rad, or m].
        gravity : ndarray, shape (3,)
            Acceleration of gravity, in B [m/s²].
        acceleration : ndarray, shape (6,), optional
            Acceleration of B, in B, linear part first [m/s², rad/s²]; zero by default.
        """
        model, data = self.model, self.data
        rates = self.root_acceleration(gravity, acceleration)
        torque = pin.rnea(model, data, self.configuration(angles), np.zeros(model.nv), rates)
        return Statics(
            self._to_body @ torque[:6],  # of the joint that lets the root link move freely
            {limb: chain.coupling.T @ torque[chain.columns] for limb, chain in self.chains.items()},
        )

    def root_acceleration(self, gravity: Array, acceleration: Array | None = None) -> Array:
        """Return Pinocchio's accelerations, shape (nv,), for a body that moves as in `statics`.

        Gravity is included, as an acceleration of the root link in the opposite direction.
        """
        spatial = (
            np.zeros(6) if acceleration is None else finite_vector(acceleration, 6, "acceleration")
        )
        spatial = spatial - np.concatenate([finite_vector(gravity, 3, "gravity"), np.zeros(3)])
        rates = np.zeros(self.model.nv)
        rates[:6] = self._to_body.T @ spatial
        return rates

    @property
    def limb_mass(self) -> float:
        """Mass of all limbs with their hands [kg]."""
        return sum(mass for mass, _, _ in self._limb_weights.values())

    def com_at(self, angles: Angles) -> Array:
        """Return the centre of mass of the robot with its hands, in B, shape (3,) [m]."""
        centre = pin.centerOfMass(self.model, self.data, self.configuration(angles))
        return self._from_root.apply(np.array(centre))

    def com_reaching(self, hands: Mapping[str, Array]) -> Array:
        """Estimate the robot's centre of mass in B from where its hands are, shape (3,) [m].

        The centre of mass of a limb in ``hands`` is taken to be on the line from shoulder to hand,
        at the same share of its length as with all joints at zero. Other limbs are at zero.

        Parameters
        ----------
        hands : mapping of str to ndarray, shape (3,)
            Origin of H in B, by limb [m].
        """
        moment = self.mass * self._com_at_zero
        for limb, place in hands.items():
            mass, share, com = self._limb_weights[limb]
            shoulder = self.chains[limb].shoulder
            moment = moment + mass * (shoulder + share * (place - shoulder) - com)
        return np.asarray(moment / self.mass)

    def _weighed_limbs(self) -> dict[str, tuple[float, float, Array]]:
        """Return of each limb its mass, how far along its centre is at zero, and where, in B."""
        model, data, found = self.model, self.data, {}
        hands = self.hand_poses({})
        pin.centerOfMass(model, data, self.configuration({}))
        for limb, chain in self.chains.items():
            mass = float(data.mass[chain.ids[0]])
            com = self._from_root.apply(data.oMi[chain.ids[0]].act(data.com[chain.ids[0]]))
            way = hands[limb].position - chain.shoulder
            share = float((com - chain.shoulder) @ way / max(float(way @ way), 1e-12))
            found[limb] = mass, share, com
        return found

    def placed_capsules(self, angles: Angles) -> Array:
        """Return the segments of all `capsules` in B at joint angles, shape (n, 2, 3) [m]."""
        data = self.data
        pin.forwardKinematics(self.model, data, self.configuration(angles))
        moved = [pose_of(data.oMi[int(joint)]) for joint in self.capsules.joints]
        placed = [pose.apply(pair) for pose, pair in zip(moved, self.capsules.ends, strict=True)]
        return self._from_root.apply(np.array(placed).reshape(-1, 2, 3))

    def link_chain(self, angles: Angles, limb: str) -> Array:
        """Return the positions in B of a limb's k joints and of its H, shape (k + 1, 3) [m]."""
        data, chain = self.data, self.chains[limb]
        pin.framesForwardKinematics(self.model, data, self.configuration(angles))
        places = [data.oMi[i].translation for i in chain.ids]
        places.append(data.oMf[chain.frame].translation)
        return self._from_root.apply(np.array(places))


def robosimian(hand_numbers: ParameterTable | None = None) -> Robot:
    """Return RoboSimian with four SpinyHands, from ``parameters/robosimian.toml``; cached.

    Parameters
    ----------
    hand_numbers : ParameterTable, optional
        All parameters of the hands; the bundled ones by default.

    Raises
    ------
    InvalidInputError
        If a parameter of the hand is missing or impossible.
    """
    return robot_of(RobotFile.bundled(), hand_numbers)


@stored("robots", 32)
def robot_of(file: RobotFile, hand_numbers: ParameterTable | None = None) -> Robot:
    """Return the robot that a robot file describes; the last 32 are kept (LRU cache).

    Parameters
    ----------
    file : RobotFile
        Texts of the robot's file and of its URDF.
    hand_numbers : ParameterTable, optional
        All parameters of the hands; the bundled ones by default.

    Raises
    ------
    InvalidInputError
        If an entry of the file is unknown, missing or impossible, or does not fit the URDF; the
        message names file and entry. Also if a parameter of the hand is missing or impossible.
    """
    hand = spiny_hand(hand_numbers)
    with in_file(file.origin):
        return Robot(RobotDescription.read(file.toml), file.urdf, hand, file.folder)
