"""A robot's links and joints as its URDF has them, checked before anything is built on them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from textwrap import shorten
from typing import Final
from xml.etree import ElementTree

import numpy as np

from hand_models.base import InvalidInputError

__all__ = ["JointElement", "Urdf", "parse_urdf"]

TURNING: Final = ("revolute", "continuous")
"""Types of joint that a limb may have."""

TYPES: Final = (*TURNING, "fixed", "prismatic", "floating", "planar")
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


@dataclass(frozen=True)
class JointElement:
    """A joint of a URDF.

    Attributes
    ----------
    name, type, parent, child : str
        As the file has them.
    lower, upper : float
        Limits [rad]; infinite for any but revolute joints.
    mimic : bool
        Whether it follows another joint.
    """

    name: str
    type: str
    parent: str
    child: str
    lower: float
    upper: float
    mimic: bool


@dataclass(frozen=True)
class Urdf:
    """The tree of a URDF.

    Attributes
    ----------
    links : tuple of str
    joints : mapping of str to JointElement
        By child link.
    mass : float
        Of all links [kg].
    """

    links: tuple[str, ...]
    joints: Mapping[str, JointElement]
    mass: float

    def chain(self, body: str, link: str) -> tuple[JointElement, ...]:
        """Return the joints that move between a link and the body, from the body outward.

        Raises
        ------
        InvalidInputError
            If there is no such link, it does not hang on the body, or a joint between them
            neither turns nor is fixed, or follows another.
        """
        self.require(link)
        chain: list[JointElement] = []
        at = link
        while at != body:
            joint = self.joints.get(at)
            if joint is None:
                raise InvalidInputError(
                    f"link {link!r} does not hang on the body {body!r}; every limb must be a chain "
                    "of joints from the body to its link"
                )
            if joint.type != "fixed":
                if joint.type not in TURNING:
                    raise InvalidInputError(
                        f"joint {joint.name!r} between {body!r} and {link!r} is {joint.type}; "
                        f"a limb's joints must be {' or '.join(TURNING)}, or fixed"
                    )
                if joint.mimic:
                    raise InvalidInputError(
                        f"joint {joint.name!r} between {body!r} and {link!r} follows another "
                        "(mimic); each joint of a limb must move by itself"
                    )
                chain.append(joint)
            at = joint.parent
        return tuple(reversed(chain))

    def require(self, link: str) -> None:
        """Refuse a link that is not there."""
        if link not in self.links:
            known = shorten(", ".join(self.links), 200, placeholder=" …")
            raise InvalidInputError(f"unknown link {link!r}; known are {known}")


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
        if joint.child in by_child:
            raise InvalidInputError(
                f"link {joint.child!r} hangs on two joints, {by_child[joint.child].name!r} and "
                f"{joint.name!r}; a robot must be a tree"
            )
        by_child[joint.child] = joint
    roots = [link for link in links if link not in by_child]
    if len(roots) != 1:
        raise InvalidInputError(
            f"one link must be the root of all others, got {len(roots)}: "
            f"{shorten(', '.join(roots) or 'a ring of joints', 200, placeholder=' …')}"
        )
    _no_ring(by_child)
    mass = math.fsum(_mass(element) for element in root.findall("link"))
    return Urdf(tuple(links), by_child, mass)


def _name(element: ElementTree.Element) -> str:
    name = element.get("name")
    if not name:
        raise InvalidInputError(f"a <{element.tag}> has no name")
    return name


def _distinct(kind: str, names: list[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise InvalidInputError(f"{kind} {name!r} appears twice")


def _no_ring(joints: Mapping[str, JointElement]) -> None:
    """Refuse links that hang on each other instead of on the root."""
    safe: set[str] = set()
    for link in joints:
        trail: list[str] = []
        at = link
        while at in joints and at not in safe:
            if at in trail:
                raise InvalidInputError(f"link {at!r} hangs on itself; a robot must be a tree")
            trail.append(at)
            at = joints[at].parent
        safe.update(trail)


def _numbers(
    owner: str, element: ElementTree.Element, attribute: str, count: int, largest: float
) -> list[float]:
    """Return the numbers of an attribute; refuse any other count, and any absurd one."""
    place = f"{owner}: {attribute} of <{element.tag}>"
    raw = element.get(attribute)
    if raw is None:
        raise InvalidInputError(f"{place} is missing")
    try:
        numbers = [float(word) for word in raw.split()]
    except ValueError:
        numbers = []
    # written so that what is not a number fails
    if len(numbers) != count or not all(abs(number) <= largest for number in numbers):
        wanted = "a number" if count == 1 else f"{count} numbers"
        got = shorten(raw, 100, placeholder=" …")
        raise InvalidInputError(f"{place} must be {wanted} within ±{largest:g}, got {got!r}")
    return numbers


def _origin(owner: str, element: ElementTree.Element) -> None:
    origin = element.find("origin")
    if origin is not None:
        if "xyz" in origin.attrib:
            _numbers(owner, origin, "xyz", 3, LONGEST)
        if "rpy" in origin.attrib:
            _numbers(owner, origin, "rpy", 3, WIDEST)


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
    _origin(owner, element)
    axis = element.find("axis")
    if axis is not None and kind in (*TURNING, "prismatic", "planar"):
        direction = _numbers(owner, axis, "xyz", 3, LONGEST)
        if not np.linalg.norm(direction) > 0.0:
            raise InvalidInputError(f"{owner}: its axis must not be zero")
    lower, upper = -math.inf, math.inf
    if kind in ("revolute", "prismatic"):
        limit = element.find("limit")
        if limit is None:
            raise InvalidInputError(f"{owner} is {kind} and has no <limit>; continuous needs none")
        for rating in ("effort", "velocity"):
            _numbers(owner, limit, rating, 1, math.inf)
        # URDF takes a limit that is left out for zero
        low, high = (
            _numbers(owner, limit, end, 1, WIDEST)[0] if end in limit.attrib else 0.0
            for end in ("lower", "upper")
        )
        if kind == "revolute":
            lower, upper = low, high
            if not lower < upper:
                raise InvalidInputError(
                    f"{owner}: lower must be less than upper, got {lower:g} and {upper:g} rad"
                )
    return JointElement(
        name, kind, ends["parent"], ends["child"], lower, upper, element.find("mimic") is not None
    )


def _mass(element: ElementTree.Element) -> float:
    """Return the mass of a link; refuse an inertia that no body has."""
    inertial = element.find("inertial")
    if inertial is None:
        return 0.0
    owner = f"link {_name(element)!r}"
    _origin(owner, inertial)
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
    principal = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if principal[0] < -NEGATIVE * principal[-1]:
        raise InvalidInputError(
            f"{owner}: its inertia must have no negative principal moment, got {principal[0]:g}"
        )
    return mass
