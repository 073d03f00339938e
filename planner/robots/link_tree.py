"""Compute link places and joint torques of a robot from its URDF, joint by joint.

This is the second way to joint torques, for checking the first (`planner.robots.robot`), with which
it shares nothing but the texts: places follow from the joints of the URDF as it was read, and the
torque of a joint from the moments about its axis of every link beyond it and of the rock on the
hand.
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
    """Joint torques and body wrench that hold a robot up.

    Attributes
    ----------
    torques : dict of str to ndarray, shape (n,)
        Joint torques by limb [N·m].
    body_wrench : ndarray, shape (6,)
        Wrench of its own weight and acceleration, which the rock must give, in B [N, N·m].
    hands : dict of str to Pose
        H in B.
    com : ndarray, shape (3,)
        Centre of mass in B [m].
    payloads : ndarray, shape (6,)
        Wrench of the weight and acceleration of its payloads, in B [N, N·m].
    """

    torques: dict[str, Array]
    body_wrench: Array
    hands: dict[str, Pose]
    com: Array
    payloads: Array


class LinkTree:
    """The links of a robot with its hands, each after its parent.

    Parameters
    ----------
    robot : Robot
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
        """Return every link in B, for angles by the joints' names.

        Joints left out are where they are locked, or those are that they follow; else at zero.
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
        """Return what holds the robot up while its body accelerates and nothing turns yet.

        Parameters
        ----------
        angles : mapping of str to ndarray, shape (n,)
            Of every limb [rad].
        wrenches : mapping of str to ndarray, shape (6,)
            What hands exert on the rock, in H; nothing where a limb is left out.
        gravity : ndarray, shape (3,)
            In B [m/s²].
        acceleration : ndarray, shape (6,)
            Of B in B, linear and angular [m/s², rad/s²].
        held : mapping of str to Pose, optional
            H in B where hands exert these, fixed to their links; where the joints put it by
            default.
        payloads : sequence of Payload
            What the links carry.
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
        moments_of_mass = masses @ coms
        for limb, mount in mounts.items():
            hand, at = hands[limb], index[mount.link]
            com = hand.apply(np.array(mount.hand_com))
            needed[at] += _moved(np.array([self.robot.hand.mass]), com[None], linear, angular)[0]
            moments_of_mass += self.robot.hand.mass * com
            if limb in wrenches:
                hand = hand if held is None else held[limb]
                force, moment = (hand.rotation @ part for part in wrenches[limb].reshape(2, 3))
                pushed[at, :3] += force
                pushed[at, 3:] += moment + np.cross(hand.position, force)
        for load in payloads:
            on_hand = mounts.get(load.limb or "")
            name = str(load.link) if on_hand is None else on_hand.link
            frame = places[name] if on_hand is None else places[name] @ on_hand.pose
            place = frame.apply(np.array(load.com))
            carried[index[name]] += _moved(np.array([load.mass]), place[None], linear, angular)[0]
        total = self._beyond @ (needed + pushed + carried)
        moments = total[:, 3:] - np.cross(origins, total[:, :3])
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
    forces = masses[:, None] * (linear + np.cross(angular, places))
    return np.hstack([forces, np.cross(places, forces)])


def _turned(turns: Array, vectors: Array) -> Array:
    return np.asarray(np.einsum("nij,nj->ni", turns, vectors))
