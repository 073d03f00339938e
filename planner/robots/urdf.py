"""A robot's links and joints as its URDF has them, checked before anything is built on them."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from textwrap import shorten
from typing import Final
from xml.etree import ElementTree

import numpy as np

from hand_models.base import Array, InvalidInputError, Pose, stored

__all__ = ["JointElement", "Link", "Urdf", "parse_urdf"]

TYPES: Final = ("revolute", "continuous", "fixed", "prismatic", "floating", "planar")
"""Types of joint that URDF knows."""

LONGEST: Final = 100.0
"""Farthest that a frame may be from its parent's [m]; farther, the units are wrong."""

HEAVIEST: Final = 1e5
"""Largest mass of a link that is taken for one [kg]."""

LARGEST_INERTIA: Final = HEAVIEST * LONGEST**2
"""Largest moment of inertia of a link that is taken for one [kg·m²]."""

WIDEST: Final = 100.0
"""Largest angle that is taken for one [rad]."""

NEGATIVE: Final = 1e-9
"""How far below zero rounding may put a principal moment, over the largest."""

NUMBER: Final = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.ASCII | re.IGNORECASE)
"""A number of XML: what Pinocchio reads otherwise, as `1_0`, would be a link without mass there."""

THIN: Final = 1e-6
"""Radius of gyration that is none for a link [m]: so far below zero its mass may put a moment."""


@dataclass(frozen=True, eq=False)
class Link:
    """A link of a URDF.

    Attributes
    ----------
    name : str
    mass : float
        [kg]
    com : ndarray, shape (3,)
        In the link [m].
    inertia : ndarray, shape (3, 3)
        About its centre of mass, in the link's axes [kg·m²].
    """

    name: str
    mass: float
    com: Array
    inertia: Array


@dataclass(frozen=True, eq=False)
class JointElement:
    """A joint of a URDF.

    Attributes
    ----------
    name, type, parent, child : str
        As the file has them.
    place : Pose
        In the parent, at zero.
    axis : ndarray, shape (3,)
        In its own frame, of unit length.
    lower, upper : float
        Limits [rad]; infinite for any but revolute joints. Where they are equal nothing moves.
    mimic : bool
        Whether it follows another joint.
    """

    name: str
    type: str
    parent: str
    child: str
    place: Pose
    axis: Array
    lower: float
    upper: float
    mimic: bool


@dataclass(frozen=True, eq=False)
class Urdf:
    """The tree of a URDF.

    Attributes
    ----------
    links : mapping of str to Link
        By name.
    joints : mapping of str to JointElement
        By child link.
    """

    links: Mapping[str, Link]
    joints: Mapping[str, JointElement]

    def trail(self, link: str) -> list[str]:
        """Return a link and those that it hangs on, up to the root; refuse a ring."""
        trail = [link]
        while trail[-1] in self.joints:
            parent = self.joints[trail[-1]].parent
            if parent in trail:
                raise InvalidInputError(f"link {parent!r} hangs on itself; a robot must be a tree")
            trail.append(parent)
        return trail

    def chain(self, body: str, link: str, locked: Collection[str]) -> tuple[JointElement, ...]:
        """Return the joints that move between a link and the body, from the body outward.

        Parameters
        ----------
        body, link : str
        locked : collection of str
            Joints that do not move although they could.

        Raises
        ------
        InvalidInputError
            If there is no such link, or it does not hang on the body.
        """
        self.require(link)
        trail = self.trail(link)
        if body not in trail:
            raise InvalidInputError(
                f"link {link!r} does not hang on the body {body!r}; every limb must be a chain "
                f"of joints from the body to its link; all hang on body = {trail[-1]!r}"
            )
        joints = [self.joints[at] for at in trail[: trail.index(body)]]
        moving = (joint for joint in reversed(joints) if joint.type != "fixed")
        return tuple(joint for joint in moving if joint.name not in locked)

    def require(self, link: str) -> None:
        """Refuse a link that is not there."""
        if link not in self.links:
            known = shorten(", ".join(self.links), 200, placeholder=" …")
            raise InvalidInputError(f"unknown link {link!r}; known are {known}")


@stored("links and joints of robots", 32)
def parse_urdf(text: str) -> Urdf:
    """Read the tree of a URDF, and check its numbers.

    Raises
    ------
    InvalidInputError
        If it is no XML, no tree, or a number is missing, not finite or absurd; the message names
        the link or joint.
    """
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as error:
        raise InvalidInputError(f"must be a URDF, which is XML: {error}") from None
    if root.tag != "robot":
        raise InvalidInputError(f"must be a URDF, whose root is <robot>, got <{root.tag}>")
    links = [_name(element) for element in root.findall("link")]
    _distinct("link", links)
    joints = [_joint(element, set(links)) for element in root.findall("joint")]
    _distinct("joint", [joint.name for joint in joints])
    by_child: dict[str, JointElement] = {}
    for joint in joints:
        other = by_child.setdefault(joint.child, joint)
        if other is not joint:
            raise InvalidInputError(
                f"link {joint.child!r} hangs on two joints, {other.name!r} and {joint.name!r}; "
                "a robot must be a tree"
            )
    roots = [link for link in links if link not in by_child]
    if len(roots) != 1:
        raise InvalidInputError(
            f"one link must be the root of all others, got {len(roots)}: "
            f"{shorten(', '.join(roots) or 'a ring of joints', 200, placeholder=' …')}"
        )
    tree = Urdf({}, by_child)
    for child in by_child:
        tree.trail(child)
    return replace(tree, links={link.name: link for link in map(_link, root.findall("link"))})


def _name(element: ElementTree.Element) -> str:
    name = element.get("name")
    if not name:
        raise InvalidInputError(f"a <{element.tag}> has no name")
    return name


def _distinct(kind: str, names: list[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise InvalidInputError(f"{kind} {name!r} appears twice")


def _numbers(
    owner: str, element: ElementTree.Element, attribute: str, count: int, largest: float
) -> list[float]:
    """Return the numbers of an attribute; refuse any other count, and any absurd one."""
    place = f"{owner}: {attribute} of <{element.tag}>"
    raw = element.get(attribute)
    if raw is None:
        raise InvalidInputError(f"{place} is missing")
    words = raw.split()
    numbers = [float(word) for word in words] if all(map(NUMBER.fullmatch, words)) else []
    # written so that what is not a number fails
    if len(numbers) != count or not all(abs(number) <= largest for number in numbers):
        wanted = "a number" if count == 1 else f"{count} numbers"
        got = shorten(raw, 100, placeholder=" …")
        raise InvalidInputError(f"{place} must be {wanted} within ±{largest:g}, got {got!r}")
    return numbers


def _origin(owner: str, element: ElementTree.Element) -> Pose:
    """Return where an element is; at its parent's origin where it does not say."""
    origin = element.find("origin")
    if origin is None:
        return Pose.identity()
    position, angles = (
        _numbers(owner, origin, name, 3, most) if name in origin.attrib else [0.0, 0.0, 0.0]
        for name, most in (("xyz", LONGEST), ("rpy", WIDEST))
    )
    return Pose(np.array(position), _turned(*angles))


def _turned(roll: float, pitch: float, yaw: float) -> Array:
    """Return the rotation of URDF's angles about the fixed axes x, y, z, one after the other."""
    (cx, sx), (cy, sy), (cz, sz) = ((math.cos(a), math.sin(a)) for a in (roll, pitch, yaw))
    return np.array(
        [
            [cy * cz, sx * sy * cz - cx * sz, cx * sy * cz + sx * sz],
            [cy * sz, sx * sy * sz + cx * cz, cx * sy * sz - sx * cz],
            [-sy, sx * cy, cx * cy],
        ]
    )


def _joint(element: ElementTree.Element, links: set[str]) -> JointElement:
    name = _name(element)
    owner = f"joint {name!r}"
    ends = {}
    for end in ("parent", "child"):
        found = element.find(end)
        link = None if found is None else found.get("link")
        if link not in links:
            raise InvalidInputError(f"{owner}: its {end} must be a link of the file, got {link!r}")
        ends[end] = str(link)
    kind = element.get("type", "")
    if kind not in TYPES:
        raise InvalidInputError(f"{owner}: type must be one of {', '.join(TYPES)}, got {kind!r}")
    place = _origin(owner, element)
    given = element.find("axis")
    axis = np.array([1.0, 0.0, 0.0])
    if given is not None and kind not in ("fixed", "floating"):
        axis = np.array(_numbers(owner, given, "xyz", 3, LONGEST))
        length = np.linalg.norm(axis)
        if not length > 0.0:
            raise InvalidInputError(f"{owner}: its axis must not be zero")
        axis = axis / length
    lower, upper = -math.inf, math.inf
    if kind in ("revolute", "prismatic"):
        limit = element.find("limit")
        if limit is None:
            raise InvalidInputError(f"{owner} is {kind} and has no <limit>; continuous needs none")
        for rating in ("effort", "velocity"):
            _numbers(owner, limit, rating, 1, sys.float_info.max)
        # URDF takes a limit that is left out for zero
        low, high = (
            _numbers(owner, limit, end, 1, WIDEST)[0] if end in limit.attrib else 0.0
            for end in ("lower", "upper")
        )
        if kind == "revolute":
            lower, upper = low, high
            if lower > upper:
                raise InvalidInputError(
                    f"{owner}: lower must not be above upper, got {lower:g} and {upper:g} rad"
                )
    return JointElement(
        name=name,
        type=kind,
        parent=ends["parent"],
        child=ends["child"],
        place=place,
        axis=axis,
        lower=lower,
        upper=upper,
        mimic=element.find("mimic") is not None,
    )


def _link(element: ElementTree.Element) -> Link:
    """Return a link; refuse an inertia that no body has."""
    name = _name(element)
    inertial = element.find("inertial")
    if inertial is None:
        return Link(name, 0.0, np.zeros(3), np.zeros((3, 3)))
    owner = f"link {name!r}"
    at = _origin(owner, inertial)
    weight, tensor = inertial.find("mass"), inertial.find("inertia")
    if weight is None or tensor is None:
        raise InvalidInputError(f"{owner}: <inertial> needs <mass> and <inertia>")
    (mass,) = _numbers(owner, weight, "value", 1, HEAVIEST)
    if mass < 0.0:
        raise InvalidInputError(f"{owner}: mass must not be negative, got {mass:g} kg")
    xx, xy, xz, yy, yz, zz = (
        _numbers(owner, tensor, name, 1, LARGEST_INERTIA)[0]
        for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    )
    own = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    principal = np.linalg.eigvalsh(own)
    if principal[0] < -max(NEGATIVE * principal[-1], THIN**2 * mass):
        raise InvalidInputError(
            f"{owner}: its inertia must have no negative principal moment, got {principal[0]:g}"
        )
    return Link(name, mass, at.position, at.rotation @ own @ at.rotation.T)
