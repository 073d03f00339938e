"""Compute link poses and joint torques of a robot from its URDF, joint by joint.

The check of plans compares joint torques with these. Nothing is shared with the computation that it
checks (`planner.robots.robot`) but the texts: link poses follow from the joints of the parsed URDF,
and the torque of a joint from the moments about its axis of every link beyond the joint and of the
rock on the hand.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, Pose, turns_about
from planner.robots.payload import Payload
from planner.robots.robot import Robot

__all__ = ["LimbTorques", "LinkTree"]


class LimbTorques(NamedTuple):
    """Joint torques and body wrench that carry a robot's weight, acceleration and payloads.

    Attributes
    ----------
    torques : dict of str to ndarray, shape (n,)
        Joint torques by limb [N·m].
    body_wrench : ndarray, shape (6,)
        Wrench that the rock must exert for the robot's own weight and acceleration, in B [N, N·m].
    hands : dict of str to Pose
        Pose of each limb's hand frame H in B.
    com : ndarray, shape (3,)
        Centre of mass of the robot with its hands, without payloads, in B [m].
    payloads : ndarray, shape (6,)
        Wrench that the rock must exert for the payloads' weight and acceleration, in B [N, N·m].
    """

    torques: dict[str, Array]
    body_wrench: Array
    hands: dict[str, Pose]
    com: Array
    payloads: Array


class LinkTree:
    """The links of a robot with its hands, each after its parent (forward kinematics and statics).

    Parameters
    ----------
    robot : Robot
        Robot whose links are placed.

    Attributes
    ----------
    robot : Robot
        Robot whose links are placed.
    links : list of Link
        Links of the URDF, the root link first.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        tree = robot.tree
        trails = sorted(map(tree.trail, tree.links), key=len)
        self.links = [tree.links[trail[0]] for trail in trails]
        # all but the root hang on a joint
        self._joints = [tree.joints[link.name] for link in self.links[1:]]
        self._mimics = {j.name: j.mimic for j in self._joints if j.mimic is not None}
        self._coupled = self._followers()
        index = {link.name: i for i, link in enumerate(self.links)}
        # which link is beyond which, itself included
        self._beyond = np.zeros((len(index), len(index)))
        for trail in trails:
            self._beyond[[index[name] for name in trail], index[trail[0]]] = 1.0

    def _followers(self) -> list[str]:
        """Return the limbs' joints that follow others, each after the one that it follows."""
        chains = self.robot.chains.values()
        left = [name for chain in chains for name in chain.moving if name in self._mimics]
        found: list[str] = []
        while left:
            ready = [name for name in left if self._mimics[name].joint not in left]
            found += ready
            left = [name for name in left if name not in ready]
        return found

    def places(self, angles: Mapping[str, float]) -> dict[str, Pose]:
        """Return the pose of every link in B at given joint positions, by link name.

        A joint that is left out is at its locked position, follows another joint (mimic), or is at
        zero.

        Parameters
        ----------
        angles : mapping of str to float
            Joint positions, by joint name [rad, or m].
        """
        found = {self.links[0].name: Pose.identity()}
        where = {**self.robot.locked, **angles}
        for name in self._coupled:
            other, multiplier, offset = self._mimics[name]
            where[name] = multiplier * where.get(other, 0.0) + offset
        moved = np.array([where.get(joint.name, 0.0) * joint.axis for joint in self._joints])
        slides = np.array([[joint.slides] for joint in self._joints])
        turns = turns_about(np.where(slides, 0.0, moved))
        for joint, turn, shift in zip(self._joints, turns, moved * slides, strict=True):
            at = joint.place @ Pose(shift, turn)
            found[joint.child] = found[joint.parent] @ at
        if self.robot.description.body == self.links[0].name:
            return found
        from_body = found[self.robot.description.body].inverse()
        return {name: from_body @ pose for name, pose in found.items()}

    def hold_up(
        self,
        angles: Mapping[str, Array],
        wrenches: Mapping[str, Array],
        gravity: Array,
        acceleration: Array,
        *,
        held: Mapping[str, Pose] | None = None,
        payloads: Sequence[Payload] = (),
    ) -> LimbTorques:
        """Return the joint torques and body wrench that carry the robot (inverse dynamics).

        The body accelerates, all velocities are zero, and the joints stand still.

        Parameters
        ----------
        angles : mapping of str to ndarray, shape (n,)
            Joint angles of every limb [rad, or m].
        wrenches : mapping of str to ndarray, shape (6,)
            Wrench of each hand on the rock, in H [N, N·m]; zero for a limb that is left out.
        gravity : ndarray, shape (3,)
            Acceleration of gravity, in B [m/s²].
        acceleration : ndarray, shape (6,)
            Acceleration of B, in B, linear part first [m/s², rad/s²].
        held : mapping of str to Pose, optional
            Pose of H in B at which each hand's wrench acts on its link; by default the one that the
            joint angles give.
        payloads : sequence of Payload
            Masses that the links carry.
        """
        chains, mounts = self.robot.chains, self.robot.description.mounts
        by_name = {
            name: float(angle)
            for limb, chain in chains.items()
            for name, angle in zip(chain.joints, angles[limb], strict=True)
        }
        places = self.places(by_name)
        index = {link.name: i for i, link in enumerate(self.links)}
        hands = {limb: places[mount.link] @ mount.pose for limb, mount in mounts.items()}
        turns = np.array([places[link.name].rotation for link in self.links])
        origins = np.array([places[link.name].position for link in self.links])
        coms = origins + _turned(turns, np.array([link.com for link in self.links]))
        inertias = turns @ np.array([link.inertia for link in self.links]) @ turns.mT
        masses = np.array([link.mass for link in self.links])
        linear, angular = acceleration[:3] - gravity, acceleration[3:]
        needed = _moved(masses, coms, linear, angular)
        needed[:, 3:] += inertias @ angular
        pushed, carried = np.zeros_like(needed), np.zeros_like(needed)
        held_up = np.array([hands[limb].apply(np.array(m.hand_com)) for limb, m in mounts.items()])
        own = np.full(len(mounts), self.robot.hand.mass)
        moments_of_mass = masses @ coms + own @ held_up
        weights = _moved(own, held_up, linear, angular)
        for (limb, mount), weight in zip(mounts.items(), weights, strict=True):
            hand, at = hands[limb], index[mount.link]
            needed[at] += weight
            if limb in wrenches:
                hand = hand if held is None else held[limb]
                force, moment = (hand.rotation @ part for part in wrenches[limb].reshape(2, 3))
                pushed[at, :3] += force
                pushed[at, 3:] += moment + _cross(hand.position, force)
        for load in payloads:
            on_hand = mounts.get(load.limb or "")
            name = str(load.link) if on_hand is None else on_hand.link
            frame = places[name] if on_hand is None else places[name] @ on_hand.pose
            place = frame.apply(np.array(load.com))
            carried[index[name]] += _moved(np.array([load.mass]), place[None], linear, angular)[0]
        total = self._beyond @ (needed + pushed + carried)
        moments = total[:, 3:] - _cross(origins, total[:, :3])
        axes = _turned(turns[1:], np.array([joint.axis for joint in self._joints]))
        # along the axis of a joint that slides, about that of one that turns
        slides = np.array([[joint.slides] for joint in self._joints])
        about = np.einsum("nx,nx->n", axes, np.where(slides, total[1:, :3], moments[1:])).tolist()
        torque = {joint.name: value for joint, value in zip(self._joints, about, strict=True)}
        # the outermost follower first: what it bears goes on to whom it follows
        for name in reversed(self._coupled):
            mimic = self._mimics[name]
            torque[mimic.joint] += mimic.multiplier * torque[name]
        return LimbTorques(
            {limb: np.array([torque[name] for name in chains[limb].joints]) for limb in chains},
            needed.sum(axis=0),
            hands,
            moments_of_mass / (masses.sum() + len(mounts) * self.robot.hand.mass),
            carried.sum(axis=0),
        )


def _moved(masses: Array, places: Array, linear: Array, angular: Array) -> Array:
    """Return the wrenches about B's origin that move masses with their body, shape (n, 6)."""
    forces = masses[:, None] * (linear + _cross(angular, places))
    return np.hstack([forces, _cross(places, forces)])


def _cross(first: Array, second: Array) -> Array:
    """Return cross products, as `numpy.cross` does at several times the cost."""
    after, before = [1, 2, 0], [2, 0, 1]
    return np.asarray(
        first[..., after] * second[..., before] - first[..., before] * second[..., after]
    )


def _turned(turns: Array, vectors: Array) -> Array:
    return np.asarray(np.einsum("nij,nj->ni", turns, vectors))
