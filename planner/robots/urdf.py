"""Parse a URDF into links and joints, and check its numbers."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from textwrap import shorten
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from hand_models.base import Array, InvalidInputError, Pose
from planner.robots.tolerances import TOLERANCES

__all__ = ["JointElement", "Link", "Mimic", "Urdf", "parse_urdf"]


@dataclass(frozen=True, eq=False)
class Link:
    """A link of a URDF.

    Attributes
    ----------
    name : str
        Name of the link in the file.
    mass : float
        Mass of the link [kg]; zero if the file has none.
    com : ndarray, shape (3,)
        Centre of mass in the link's frame [m].
    inertia : ndarray, shape (3, 3)
        Inertia about the centre of mass, in the link's axes [kg·m²].
    """

    name: str
    mass: float
    com: Array
    inertia: Array


class Mimic(NamedTuple):
    """Coupling of a joint to another: its position is ``multiplier · position of joint + offset``.

    Attributes
    ----------
    joint : str
        Name of the joint that is followed.
    multiplier : float
        Ratio of the motions [1], or [m/rad] or [rad/m] where one of the two slides.
    offset : float
        Position while the followed joint is at zero [rad, or m].
    """

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True, eq=False)
class JointElement:
    """A joint of a URDF.

    Attributes
    ----------
    name, type, parent, child : str
        Name of the joint, its URDF type, its parent link and its child link.
    place : Pose
        Pose of the joint in the parent link's frame, at position zero.
    axis : ndarray, shape (3,)
        Unit vector of the axis, in the joint's frame.
    lower, upper : float
        Limits of a revolute joint [rad] or a prismatic joint [m]; infinite for all other types. A
        joint with equal limits does not move.
    effort : float
        Largest torque [N·m], or force of a prismatic joint [N]; zero if the file has none.
    mimic : Mimic or None
        Coupling to another joint; None if the joint moves by itself.
    """

    name: str
    type: str
    parent: str
    child: str
    place: Pose
    axis: Array
    lower: float
    upper: float
    effort: float
    mimic: Mimic | None

    @property
    def slides(self) -> bool:
        """True for a prismatic joint, which moves along its axis instead of about it."""
        return self.type == "prismatic"


@dataclass(frozen=True, eq=False)
class Urdf:
    """The kinematic tree of a URDF.

    Attributes
    ----------
    links : mapping of str to Link
        Links by name.
    joints : mapping of str to JointElement
        Joints by the name of the child link.
    """

    links: Mapping[str, Link]
    joints: Mapping[str, JointElement]

    def trail(self, link: str) -> list[str]:
        """Return the names of a link and of its ancestors, up to the root link.

        Raises
        ------
        InvalidInputError
            If the links form a loop.
        """
        trail = [link]
        while trail[-1] in self.joints:
            parent = self.joints[trail[-1]].parent
            if parent in trail:
                raise InvalidInputError(f"link {parent!r} is in a loop; a robot must be a tree")
            trail.append(parent)
        return trail

    def chain(self, body: str, link: str, locked: Collection[str]) -> tuple[JointElement, ...]:
        """Return the joints that can move between a link and the body, from the body outward.

        Parameters
        ----------
        body, link : str
            Names of the body's link and of the other link.
        locked : collection of str
            Names of joints that are left out, as they are kept from moving.

        Raises
        ------
        InvalidInputError
            If the link is unknown, or is not connected to the body.
        """
        self.require(link)
        trail = self.trail(link)
        if body not in trail:
            raise InvalidInputError(
                f"link {link!r} is not connected to the body {body!r}; every limb must be a chain "
                f"of joints from the body to its link; every link has one to body = {trail[-1]!r}"
            )
        joints = [self.joints[at] for at in trail[: trail.index(body)]]
        moving = (joint for joint in reversed(joints) if joint.type != "fixed")
        return tuple(joint for joint in moving if joint.name not in locked)

    def require(self, link: str) -> None:
        """Reject an unknown link.

        Raises
        ------
        InvalidInputError
            If the URDF has no link of this name.
        """
        if link not in self.links:
            known = shorten(", ".join(self.links), 200, placeholder=" …")
            raise InvalidInputError(f"unknown link {link!r}; known are {known}")


def parse_urdf(text: str) -> Urdf:
    """Parse the text of a URDF into links and joints, and check its numbers.

    Raises
    ------
    InvalidInputError
        If the text is no XML, an unexpanded xacro or no tree, or a number is missing, not finite
        or too large to be plausible; the message names the link or joint.
    """
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as error:
        if "xacro:" in text:
            raise _unexpanded() from None
        raise InvalidInputError(
            f"must be a URDF, which is XML: {error}; correct the file there"
        ) from None
    if root.tag != "robot":
        raise InvalidInputError(f"must be a URDF, whose root is <robot>, got <{root.tag}>")
    _require_expanded(root, text)
    links = [_name(element) for element in root.findall("link")]
    _distinct("link", links)
    joints = [_joint(element, set(links)) for element in root.findall("joint")]
    _distinct("joint", [joint.name for joint in joints])
    by_child: dict[str, JointElement] = {}
    for joint in joints:
        other = by_child.setdefault(joint.child, joint)
        if other is not joint:
            raise InvalidInputError(
                f"link {joint.child!r} has two parent joints, {other.name!r} and {joint.name!r}; "
                "a robot must be a tree"
            )
    roots = [link for link in links if link not in by_child]
    if len(roots) != 1:
        raise InvalidInputError(
            f"one link must be the root of all others, got {len(roots)}: "
            f"{shorten(', '.join(roots) or 'a loop of joints', 200, placeholder=' …')}; give every "
            "link but one a parent joint"
        )
    tree = Urdf({}, by_child)
    for child in by_child:
        tree.trail(child)
    return replace(tree, links={link.name: link for link in map(_link, root.findall("link"))})


def _unexpanded() -> InvalidInputError:
    return InvalidInputError(
        "must be a URDF; this is a xacro, which is not expanded; expand it: "
        "xacro ROBOT.urdf.xacro > ROBOT.urdf (from ROS, or from pip install xacro)"
    )


def _require_expanded(root: ElementTree.Element, text: str) -> None:
    """Refuse a file with elements of xacro, or with values that xacro is to put in."""
    if "<xacro:" in re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL):
        raise _unexpanded()
    for element in root.iter():
        space = element.tag.rpartition("}")[0] if isinstance(element.tag, str) else ""
        values = [value for name, value in element.items() if name != "filename"]
        if space.endswith("/xacro") or any("${" in value or "$(" in value for value in values):
            raise _unexpanded()


def _name(element: ElementTree.Element) -> str:
    name = element.get("name")
    if not name:
        raise InvalidInputError(f"a <{element.tag}> has no name; give it one")
    return name


def _distinct(kind: str, names: list[str]) -> None:
    for name in names:
        if (count := names.count(name)) > 1:
            raise InvalidInputError(
                f"{kind} {name!r} appears {count} times; every {kind} needs a name of its own: "
                "rename or remove the others"
            )


def _numbers(
    owner: str,
    element: ElementTree.Element,
    attribute: str,
    count: int,
    largest: float,
    default: float | None = None,
) -> list[float]:
    """Return the numbers of an attribute; refuse any other count, and any absurd one.

    Where the attribute is missing they are the default; without one, it is refused.
    """
    place = f"{owner}: {attribute} of <{element.tag}>"
    raw = element.get(attribute)
    if raw is None:
        if default is None:
            raise InvalidInputError(f"{place} is missing")
        return [default] * count
    words = raw.split()
    # what Pinocchio reads otherwise, as `1_0`, would be a link without mass there
    number = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.ASCII | re.IGNORECASE)
    numbers = [float(word) for word in words] if all(map(number.fullmatch, words)) else []
    # written so that what is not a number fails
    if len(numbers) != count or not all(abs(number) <= largest for number in numbers):
        wanted = "a number" if count == 1 else f"{count} numbers"
        got = shorten(raw, 100, placeholder=" …")
        units = {"xyz": " m, not in mm", "rpy": " rad, not in degrees", "value": " kg"}
        units |= dict.fromkeys(("lower", "upper"), " rad, not in degrees (sliding: m)")
        unit = units.get(attribute if element.tag != "axis" else "", "")
        raise InvalidInputError(f"{place} must be {wanted} within ±{largest:g}{unit}, got {got!r}")
    return numbers


def _origin(owner: str, element: ElementTree.Element) -> Pose:
    """Return where an element is; at its parent's origin where it does not say."""
    origin = element.find("origin")
    if origin is None:
        return Pose.identity()
    position = _numbers(owner, origin, "xyz", 3, TOLERANCES.frame_distance, default=0.0)
    angles = _numbers(owner, origin, "rpy", 3, TOLERANCES.angle, default=0.0)
    # turned about the fixed axes x, y, z, one after the other
    (cx, sx), (cy, sy), (cz, sz) = ((math.cos(a), math.sin(a)) for a in angles)
    rotation = np.array(
        [
            [cy * cz, sx * sy * cz - cx * sz, cx * sy * cz + sx * sz],
            [cy * sz, sx * sy * sz + cx * cz, cx * sy * sz - sx * cz],
            [-sy, sx * cy, cx * cy],
        ]
    )
    return Pose(np.array(position), rotation)


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
    # types of joint that URDF knows
    types = ("revolute", "continuous", "fixed", "prismatic", "floating", "planar")
    if kind not in types:
        raise InvalidInputError(f"{owner}: type must be one of {', '.join(types)}, got {kind!r}")
    place = _origin(owner, element)
    given = element.find("axis")
    axis = np.array([1.0, 0.0, 0.0])
    if given is not None and kind not in ("fixed", "floating"):
        axis = np.array(_numbers(owner, given, "xyz", 3, TOLERANCES.frame_distance))
        length = np.linalg.norm(axis)
        if not length > 0.0:
            raise InvalidInputError(f"{owner}: its axis must not be zero, got {given.get('xyz')!r}")
        axis = axis / length
    lower, upper, effort = -math.inf, math.inf, 0.0
    limit = element.find("limit")
    # one motor can move these
    if (
        limit is not None
        and kind in ("revolute", "continuous", "prismatic")
        and "effort" in limit.attrib
    ):
        (effort,) = _numbers(owner, limit, "effort", 1, sys.float_info.max)
        if effort < 0.0:
            unit = "N" if kind == "prismatic" else "N·m"
            raise InvalidInputError(f"{owner}: effort must not be negative, got {effort:g} {unit}")
    if kind in ("revolute", "prismatic"):
        if limit is None:
            raise InvalidInputError(f"{owner} is {kind} and has no <limit>; give it one")
        for rating in ("effort", "velocity"):
            _numbers(owner, limit, rating, 1, sys.float_info.max)
        # URDF takes a limit that is left out for zero
        (lower,) = _numbers(owner, limit, "lower", 1, TOLERANCES.angle, default=0.0)
        (upper,) = _numbers(owner, limit, "upper", 1, TOLERANCES.angle, default=0.0)
        if lower > upper:
            unit = "m" if kind == "prismatic" else "rad"
            raise InvalidInputError(
                f"{owner}: lower must not be above upper, got {lower:g} and {upper:g} {unit}"
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
        effort=effort,
        mimic=_mimic(owner, element),
    )


def _mimic(owner: str, element: ElementTree.Element) -> Mimic | None:
    """Return how a joint follows another; None where it moves by itself."""
    mimic = element.find("mimic")
    if mimic is None:
        return None
    (multiplier,) = _numbers(owner, mimic, "multiplier", 1, 1e3, default=1.0)
    (offset,) = _numbers(owner, mimic, "offset", 1, TOLERANCES.angle, default=0.0)
    return Mimic(mimic.get("joint", ""), multiplier, offset)


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
        raise InvalidInputError(f"{owner}: <inertial> needs <mass> and <inertia>; add both")
    (mass,) = _numbers(owner, weight, "value", 1, TOLERANCES.link_mass)
    if mass < 0.0:
        raise InvalidInputError(f"{owner}: mass must not be negative, got {mass:g} kg")
    xx, xy, xz, yy, yz, zz = (
        _numbers(owner, tensor, name, 1, TOLERANCES.link_inertia)[0]
        for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    )
    own = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    principal = np.linalg.eigvalsh(own)
    # rounding, relative to the largest moment or to a radius of gyration of 1 µm
    if principal[0] < -max(1e-9 * principal[-1], 1e-6**2 * mass):
        raise InvalidInputError(
            f"{owner}: its inertia must have no negative principal moment, got "
            f"{principal[0]:g} kg·m²"
        )
    return Link(name, mass, at.position, at.rotation @ own @ at.rotation.T)
