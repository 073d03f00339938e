"""A robot's links as its URDF has them: where they are, and what holds them up, joint by joint.

The second way to joint torques, for checking the first (`planner.robots.kinematics`), with which it
shares nothing: places follow from the text of the URDF, and the torque of a joint from the moments
about its axis of every link beyond it and of the rock on the hand.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from hand_models.base import Array, Pose, skew
from planner.robots.build import Mount

__all__ = ["LimbTorques", "LinkTree"]


class _Link(NamedTuple):
    """A link, the joint on which it hangs, and its mass.

    Attributes
    ----------
    name : str
    parent, joint : str or None
        None for the root.
    place : Pose
        The joint in the parent, at zero.
    axis : ndarray, shape (3,)
        Of the joint, in its own frame, of unit length.
    mass : float
        [kg]
    com : ndarray, shape (3,)
        In the link [m].
    inertia : ndarray, shape (3, 3)
        About its centre of mass, in the link's axes [kg·m²].
    """

    name: str
    parent: str | None
    joint: str | None
    place: Pose
    axis: Array
    mass: float
    com: Array
    inertia: Array


class LimbTorques(NamedTuple):
    """What holds a robot up.

    Attributes
    ----------
    torques : dict of str to ndarray, shape (n,)
        By limb [N·m].
    body_wrench : ndarray, shape (6,)
        Of its own weight and acceleration, which the rock must give, in B [N, N·m].
    hands : dict of str to Pose
        H in B.
    """

    torques: dict[str, Array]
    body_wrench: Array
    hands: dict[str, Pose]


class LinkTree:
    """The links of a robot with its hands.

    Parameters
    ----------
    urdf : str
    body : str
        The link whose frame is B.
    mounts : mapping of str to Mount
        By limb.
    hand_mass : float
        [kg]
    """

    def __init__(self, urdf: str, body: str, mounts: Mapping[str, Mount], hand_mass: float) -> None:
        self.links, self._beyond = _links(urdf)
        self.body = body
        self.mounts = mounts
        self.hand_mass = hand_mass

    def places(self, angles: Mapping[str, float]) -> dict[str, Pose]:
        """Return every link in B, for angles by the joints' names; joints left out are at zero."""
        found: dict[str, Pose] = {}
        for link in self.links:
            turn = _turn(link.axis, angles.get(link.joint or "", 0.0))
            at = Pose(link.place.position, link.place.rotation @ turn)
            found[link.name] = at if link.parent is None else found[link.parent] @ at
        from_body = found[self.body].inverse()
        return {name: from_body @ pose for name, pose in found.items()}

    def hold_up(
        self,
        joints: Mapping[str, tuple[str, ...]],
        angles: Mapping[str, Array],
        wrenches: Mapping[str, Array],
        gravity: Array,
        acceleration: Array,
    ) -> LimbTorques:
        """Return what holds the robot up while its body accelerates and nothing turns yet.

        Parameters
        ----------
        joints : mapping of str to tuple of str
            Names of each limb's joints.
        angles : mapping of str to ndarray, shape (n,)
            By limb [rad].
        wrenches : mapping of str to ndarray, shape (6,)
            What hands exert on the rock, in H; nothing where a limb is left out.
        gravity : ndarray, shape (3,)
            In B [m/s²].
        acceleration : ndarray, shape (6,)
            Of B in B, linear and angular [m/s², rad/s²].
        """
        by_name = {
            name: float(angle)
            for limb, names in joints.items()
            for name, angle in zip(names, angles[limb], strict=True)
        }
        places = self.places(by_name)
        index = {link.name: i for i, link in enumerate(self.links)}
        hands = {limb: places[mount.link] @ mount.pose for limb, mount in self.mounts.items()}
        turns = np.array([places[link.name].rotation for link in self.links])
        origins = np.array([places[link.name].position for link in self.links])
        coms = origins + _turned(turns, np.array([link.com for link in self.links]))
        inertias = turns @ np.array([link.inertia for link in self.links]) @ turns.mT
        masses = np.array([link.mass for link in self.links])
        linear, angular = acceleration[:3] - gravity, acceleration[3:]
        needed = _moved(masses, coms, linear, angular)
        needed[:, 3:] += inertias @ angular
        pushed = np.zeros_like(needed)
        for limb, mount in self.mounts.items():
            hand, at = hands[limb], index[mount.link]
            com = hand.apply(np.array(mount.hand_com))
            needed[at] += _moved(np.array([self.hand_mass]), com[None], linear, angular)[0]
            if limb in wrenches:
                force, moment = (hand.rotation @ part for part in wrenches[limb].reshape(2, 3))
                pushed[at, :3] += force
                pushed[at, 3:] += moment + np.cross(hand.position, force)
        total = self._beyond @ (needed + pushed)
        moments = total[:, 3:] - np.cross(origins, total[:, :3])
        axes = _turned(turns, np.array([link.axis for link in self.links]))
        about = np.einsum("nx,nx->n", axes, moments)
        torque = {link.joint: float(value) for link, value in zip(self.links, about, strict=True)}
        return LimbTorques(
            {limb: np.array([torque[name] for name in names]) for limb, names in joints.items()},
            needed.sum(axis=0),
            hands,
        )


def _moved(masses: Array, places: Array, linear: Array, angular: Array) -> Array:
    """Return the wrenches about B's origin that move masses with their body, shape (n, 6)."""
    forces = masses[:, None] * (linear + np.cross(angular, places))
    return np.hstack([forces, np.cross(places, forces)])


def _turned(turns: Array, vectors: Array) -> Array:
    return np.asarray(np.einsum("nij,nj->ni", turns, vectors))


def _turn(axis: Array, angle: float) -> Array:
    """Return the rotation about an axis by an angle (Rodrigues)."""
    cross = skew(axis)
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross)


@lru_cache(maxsize=32)
def _links(urdf: str) -> tuple[tuple[_Link, ...], Array]:
    """Return the links of a URDF, each after its parent, and which are beyond which, (n, n).

    A link counts as beyond itself.
    """
    root = ElementTree.fromstring(urdf)
    hanging = {_attribute(joint.find("child"), "link"): joint for joint in root.findall("joint")}
    waiting = [_link(element, hanging) for element in root.findall("link")]
    found: dict[str, _Link] = {}
    while waiting:
        for link in waiting:
            if link.parent is None or link.parent in found:
                found[link.name] = link
        waiting = [link for link in waiting if link.name not in found]
    links = tuple(found.values())
    index = {link.name: i for i, link in enumerate(links)}
    beyond = np.eye(len(links))
    for i, link in reversed(list(enumerate(links))):
        if link.parent is not None:
            beyond[index[link.parent]] += beyond[i]
    return links, beyond


def _link(element: ElementTree.Element, hanging: Mapping[str, ElementTree.Element]) -> _Link:
    name = _attribute(element, "name")
    joint = hanging.get(name)
    inertial = element.find("inertial")
    mass, com, inertia = 0.0, np.zeros(3), np.zeros((3, 3))
    if inertial is not None:
        at = _origin(inertial)
        mass = float(_attribute(inertial.find("mass"), "value"))
        xx, xy, xz, yy, yz, zz = (
            float(_attribute(inertial.find("inertia"), part))
            for part in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        )
        com = at.position
        own = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        inertia = at.rotation @ own @ at.rotation.T
    if joint is None:
        return _Link(name, None, None, Pose.identity(), np.zeros(3), mass, com, inertia)
    given = joint.find("axis")
    axis = np.array([1.0, 0.0, 0.0]) if given is None else _numbers(_attribute(given, "xyz"))
    length = float(np.linalg.norm(axis))
    return _Link(
        name,
        _attribute(joint.find("parent"), "link"),
        _attribute(joint, "name"),
        _origin(joint),
        axis / length if length else axis,
        mass,
        com,
        inertia,
    )


def _origin(element: ElementTree.Element) -> Pose:
    origin = element.find("origin")
    if origin is None:
        return Pose.identity()
    position, angles = (_numbers(origin.get(part, "0 0 0")) for part in ("xyz", "rpy"))
    return Pose(position, Rotation.from_euler("xyz", angles).as_matrix())


def _numbers(text: str) -> Array:
    return np.array([float(word) for word in text.split()])


def _attribute(element: ElementTree.Element | None, name: str) -> str:
    """Return an attribute, which a URDF that was checked has."""
    value = None if element is None else element.get(name)
    assert value is not None
    return value
