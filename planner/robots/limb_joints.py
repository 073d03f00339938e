"""Which joints of a URDF move a robot's limbs, and which are locked, and where."""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterable, Mapping
from typing import Final

from hand_models.base import InvalidInputError, within
from planner.robots.joint_coupling import uncoupled
from planner.robots.robot_file import RobotDescription, section_table
from planner.robots.urdf import JointElement, Urdf

__all__ = ["limb_joints", "locked_joints"]

MOVING: Final = ("revolute", "continuous", "prismatic")
"""Types of joint that a limb may have."""

LOCKED_UNITS: Final = {"revolute": "rad", "continuous": "rad", "prismatic": "m"}
"""Types of joint that can be locked, with the units of where."""

MOST_JOINTS: Final = 64
"""More joints of a limb than this no request names."""

FARTHEST: Final = 100.0
"""Farthest from zero that a joint without limits may be locked [rad, or m]."""

BARE_KEY: Final = re.compile(r"[A-Za-z0-9_-]+")
"""Names that TOML takes as keys without quotes."""


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
    for section, name, quantity in section_table(described.locked, "locked", units):
        field = f"{section}.{name}"
        if isinstance(quantity.value, list):
            raise InvalidInputError("one number is needed, not a list", field=field)
        value, joint = float(quantity.value), joints[name]
        low, high = max(joint.lower, -FARTHEST), min(joint.upper, FARTHEST)
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
    for limb, mount in described.mounts.items():
        field = f"limbs.{limb}.link"
        with within(field):
            chains[limb] = tree.chain(body, mount.link, locked)
        if not chains[limb]:
            stuck = [each.name for each in tree.chain(body, mount.link, ()) if _stuck(each)]
            why = f" (the limits of {', '.join(map(repr, stuck))} are equal)" if stuck else ""
            raise InvalidInputError(
                f"no joint moves between {body!r} and {mount.link!r}{why}; a limb has at least one",
                field=field,
            )
        if len(chains[limb]) > MOST_JOINTS:
            raise InvalidInputError(
                f"a limb has at most {MOST_JOINTS} joints, got {len(chains[limb])}", field=field
            )
    _require_own(chains, described.locked)
    for limb, chain in chains.items():
        with within(f"limbs.{limb}.link"):
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
    free = [joint for joint in chain if joint.type not in MOVING]
    wrong = free or uncoupled(chain)
    if not wrong:
        return
    last, advice = wrong[-1], _advice(wrong, already)
    if free:
        raise InvalidInputError(
            f"joint {last.name!r} {between} is {last.type}; a limb's joints must be "
            f"{', '.join(MOVING)}, or fixed{advice}"
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
        if not BARE_KEY.fullmatch(key):
            key = json.dumps(key, ensure_ascii=False)
        entries.append(f"{key} = {min(max(0.0, joint.lower), joint.upper)}")
    line = ", ".join(entries)
    them = "them" if len(entries) > 1 else "it"
    if already:
        return f"; to lock {them}, add to locked: {line}"
    return f"; to lock {them}, write: locked = {{ {line} }}, above the first section"
