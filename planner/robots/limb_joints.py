"""Find the joints of a robot's limbs in its URDF: driven ones, ones that follow, locked ones.

A limb's joints are ``q = matrix · a + offset`` where a are those that motors move; the others
follow these (mimic). By virtual work the force of a motor is then ``matrixᵀ · τ``: its own joint's,
and that of every joint that follows it, times how far that one moves for each radian or metre of
its own.
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
    """Return where joints are that never move, by name [rad, or m]: by limits, or by the file.

    Raises
    ------
    InvalidInputError
        If the file locks a joint that is not there, or where it cannot be.
    """
    joints = {joint.name: joint for joint in tree.joints.values()}
    units = {n: LOCKED_UNITS[j.type] for n, j in joints.items() if j.type in LOCKED_UNITS}
    found = {name: joint.lower for name, joint in joints.items() if _stuck(joint)}
    farthest = 100.0  # [rad, or m]: joints without limits may be locked up to here
    for section, name, quantity in section_table(described.locked, "locked", units):
        field = f"{section}.{name}"
        if isinstance(quantity.value, list):
            raise InvalidInputError("one number is needed, not a list", field=field)
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
    """Return every limb's joints, from the body outward.

    Raises
    ------
    InvalidInputError
        If a limb has no joints, too many, some that others have too, or some that neither turn nor
        slide, or follow a joint that is none of the limb's; the message says how to lock these.
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
                f"a limb has at most {most} joints, got {len(chains[limb])}", field=field
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
    """Positions of k joints of a limb as a function of the n that move by themselves.

    Attributes
    ----------
    driving : tuple of JointElement, length n
        Joints that move by themselves, from the body outward.
    matrix : ndarray, shape (k, n)
        [1, or m/rad or rad/m where one of them slides]
    offset : ndarray, shape (k,)
        [rad, or m]
    lower, upper : ndarray, shape (n,)
        Limits of those that drive, such that those that follow keep to theirs, too [rad, or m].
    """

    driving: tuple[JointElement, ...]
    matrix: Array
    offset: Array
    lower: Array
    upper: Array


def coupling_of(chain: Sequence[JointElement]) -> JointCoupling:
    """Return how the joints of a limb hang together, all of which follow its own motors.

    Raises
    ------
    InvalidInputError
        If the limits of coupled joints leave no room to a joint that drives them.
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
                    "common range"
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
