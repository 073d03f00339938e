"""Find the joints of a robot's limbs in its URDF: driven joints, mimic joints and locked joints.

The positions q of a limb's joints are ``q = matrix · a + offset``, where a are the positions of the
joints that motors move; the other joints follow these (mimic). By virtual work the torque of a
motor is then ``matrixᵀ · τ``, τ the torques at all joints.
"""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, InvalidInputError, errors_under
from planner.robots.robot_file import RobotDescription, section_table
from planner.robots.urdf import JointElement, Urdf

__all__ = ["JointCoupling", "coupling_of", "limb_joints", "locked_joints"]

LOCKED_UNITS: Final = {"revolute": "rad", "continuous": "rad", "prismatic": "m"}
"""Types of joint that can be locked, with the units of where."""


def locked_joints(tree: Urdf, described: RobotDescription) -> dict[str, float]:
    """Return the positions of the joints that never move, by joint name [rad, or m].

    A joint is locked if its limits are equal, or if the robot's file says so (``[locked]``).

    Raises
    ------
    InvalidInputError
        If the file locks an unknown joint, or a joint beyond its limits.
    """
    joints = {joint.name: joint for joint in tree.joints.values()}
    units = {n: LOCKED_UNITS[j.type] for n, j in joints.items() if j.type in LOCKED_UNITS}
    found = {name: joint.lower for name, joint in joints.items() if _stuck(joint)}
    farthest = 100.0  # [rad, or m]: joints without limits may be locked up to here
    for section, name, quantity in section_table(described.locked, "locked", units):
        field = f"{section}.{name}"
        if isinstance(quantity.value, list):
            raise InvalidInputError(f"one number is needed, got {quantity.value}", field=field)
        value, joint = float(quantity.value), joints[name]
        low, high = max(joint.lower, -farthest), min(joint.upper, farthest)
        if not low <= value <= high:
            raise InvalidInputError(
                f"must be from {low:.6g} to {high:.6g} {quantity.unit}, got {value:.6g}",
                field=field,
            )
        found[name] = value
    return found


def _stuck(joint: JointElement) -> bool:
    return joint.lower == joint.upper


def limb_joints(
    tree: Urdf, described: RobotDescription, locked: Collection[str]
) -> dict[str, tuple[JointElement, ...]]:
    """Return the joints of each limb that are not locked, by limb, from the body outward.

    Parameters
    ----------
    tree : Urdf
        Links and joints of the robot's URDF.
    described : RobotDescription
        Content of the robot's file.
    locked : collection of str
        Names of the joints that never move.

    Raises
    ------
    InvalidInputError
        If a limb has no joints or more than 64, shares a joint with another limb, or has a joint
        that neither turns nor slides or that follows a joint of another limb. The message says how
        to lock such joints.
    """
    body, chains = described.body, {}
    most = 64  # no request names more
    for limb, mount in described.mounts.items():
        field = f"limbs.{limb}.link"
        with errors_under(field):
            chains[limb] = tree.chain(body, mount.link, locked)
        if not chains[limb]:
            stuck = [each.name for each in tree.chain(body, mount.link, ()) if _stuck(each)]
            why = f" (the limits of {', '.join(map(repr, stuck))} are equal)" if stuck else ""
            raise InvalidInputError(
                f"no joint moves between {body!r} and {mount.link!r}{why}; a limb has at least one",
                field=field,
            )
        if len(chains[limb]) > most:
            raise InvalidInputError(
                f"a limb has at most {most} joints that move, got {len(chains[limb])}; lock some "
                "in [locked]",
                field=field,
            )
    _require_own(chains, described.locked)
    for limb, chain in chains.items():
        with errors_under(f"limbs.{limb}.link"):
            between = f"between {body!r} and {described.mounts[limb].link!r}"
            _require_moved(chain, between, described.locked)
    return chains


def _require_own(chains: Mapping[str, tuple[JointElement, ...]], already: Collection[str]) -> None:
    """Refuse limbs that share joints; say how to lock these where every limb keeps some."""
    owners: dict[JointElement, list[str]] = {}
    for limb, chain in chains.items():
        for joint in chain:
            owners.setdefault(joint, []).append(limb)
    shared = [joint for joint, limbs in owners.items() if len(limbs) > 1]
    if not shared:
        return
    first, other = owners[shared[0]][:2]
    theirs = [joint for joint in shared if owners[joint][:2] == [first, other]]
    keeps = all(set(chain).difference(shared) for chain in chains.values())
    raise InvalidInputError(
        f"limbs {first!r} and {other!r} share joint{'s' * (len(theirs) > 1)} "
        f"{', '.join(repr(joint.name) for joint in theirs)}; every limb needs joints of its own"
        f"{_advice(shared, already) if keeps else ''}",
        field=f"limbs.{other}.link",
    )


def _require_moved(chain: tuple[JointElement, ...], between: str, already: Collection[str]) -> None:
    """Refuse joints of a limb that no motor of it moves; say how to lock them."""
    moving = ("revolute", "continuous", "prismatic")  # types of joint that a limb may have
    free = [joint for joint in chain if joint.type not in moving]
    known = _drivers(chain)
    wrong = free or [joint for joint in chain if joint.name not in known]
    if not wrong:
        return
    last, advice = wrong[-1], _advice(wrong, already)
    if free:
        raise InvalidInputError(
            f"joint {last.name!r} {between} is {last.type}; a limb's joints must be "
            f"{', '.join(moving)}, or fixed{advice}"
        )
    follows = "" if last.mimic is None else last.mimic.joint
    raise InvalidInputError(
        f"joint {last.name!r} {between} follows another (mimic), {follows!r}, that no motor of "
        f"this limb moves; a limb's joint moves by itself, or follows one of the same limb{advice}"
    )


def _advice(joints: Iterable[JointElement], already: Collection[str]) -> str:
    """Return what to write to lock joints, at zero or the limit that is nearest to it.

    Nothing where one of them cannot be locked; ``already``: joints that the file locks.
    """
    entries = []
    for joint in joints:
        if joint.type not in LOCKED_UNITS:
            return ""
        key = joint.name
        if not re.fullmatch(r"[A-Za-z0-9_-]+", key):  # TOML wants quotes
            key = json.dumps(key, ensure_ascii=False)
        entries.append(f"{key} = {min(max(0.0, joint.lower), joint.upper)}")
    line = ", ".join(entries)
    them = "them" if len(entries) > 1 else "it"
    if already:
        return f"; to lock {them}, add to locked: {line}"
    return f"; to lock {them}, write: locked = {{ {line} }}, above the first section"


class JointCoupling(NamedTuple):
    """Coupling of a limb's k joints to the n of them that motors drive: q = matrix · a + offset.

    q are the positions of all joints, a those of the driving joints.

    Attributes
    ----------
    driving : tuple of JointElement, length n
        Joints that move by themselves, from the body outward.
    matrix : ndarray, shape (k, n)
        Motion of each joint per unit of each driving joint [1, m/rad or rad/m].
    offset : ndarray, shape (k,)
        Positions of all joints while the driving joints are at zero [rad, or m].
    lower, upper : ndarray, shape (n,)
        Limits of the driving joints [rad, or m], within which all joints keep to their limits.
    """

    driving: tuple[JointElement, ...]
    matrix: Array
    offset: Array
    lower: Array
    upper: Array


def coupling_of(chain: Sequence[JointElement]) -> JointCoupling:
    """Return the coupling of a limb's joints to those that motors move.

    Parameters
    ----------
    chain : sequence of JointElement
        The limb's joints, from the body outward; each moves by itself or follows one of them.

    Raises
    ------
    InvalidInputError
        If the limits of a joint and of those that follow it have no common range.
    """
    known = _drivers(chain)
    driving = tuple(joint for joint in chain if joint.mimic is None)
    names = [joint.name for joint in driving]
    matrix, offset = np.zeros((len(chain), len(driving))), np.zeros(len(chain))
    lower = np.array([joint.lower for joint in driving])
    upper = np.array([joint.upper for joint in driving])
    for i, joint in enumerate(chain):
        driver, ratio, shift = known[joint.name]
        j = names.index(driver)
        matrix[i, j], offset[i] = ratio, shift
        if ratio:
            ends = sorted(((joint.lower - shift) / ratio, (joint.upper - shift) / ratio))
            lower[j], upper[j] = max(lower[j], ends[0]), min(upper[j], ends[1])
            if lower[j] > upper[j]:
                raise InvalidInputError(
                    f"joint {joint.name!r} follows {driver!r} (mimic), and their limits have no "
                    "common range; widen the limits of one"
                )
    return JointCoupling(driving, matrix, offset, lower, upper)


def _drivers(chain: Sequence[JointElement]) -> dict[str, tuple[str, float, float]]:
    """Return of each joint that a motor of the limb moves that one's name, ratio and offset."""
    found = {joint.name: (joint.name, 1.0, 0.0) for joint in chain if joint.mimic is None}
    for _ in chain:
        for joint in chain:
            if joint.mimic is not None and joint.mimic.joint in found:
                driver, ratio, shift = found[joint.mimic.joint]
                by = joint.mimic.multiplier
                found[joint.name] = driver, by * ratio, by * shift + joint.mimic.offset
    return found
