"""What the check of a plan says of limbs: joints, and what is asked of a hand's force and tendons.

Joints are checked against the robot's URDF itself, by moments about each axis (`LinkTree`), not by
the Jacobians and the Newton–Euler pass that the program's rows are made of.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np
import scipy

from hand_models.base import Array
from hand_models.hand import FINGERS
from planner.prepare import BALL, Posture
from planner.question import HandOnHold, Question
from planner.robots import LimbTorques, LinkTree

__all__ = ["ARM", "JointUse", "check_asked", "check_limbs", "check_passive", "force_use"]

NOTHING: Final = np.zeros(0)
"""Of a hand without a cap."""

TORQUE: Final = 1e-6
"""Largest disagreement of a joint's torque, relative to the largest of its limb or 1 N·m."""

WEIGHT: Final = 1e-9
"""Largest disagreement of the body wrench with the robot's weight and acceleration, relative."""

PLACED: Final = (0.01, 0.05)
"""How far joints may put a hand from its pose [m], and turn it [rad]."""

TOLD: Final = 1e-5
"""How far what is told of that may be from it, of joints that were found [m, rad]."""

BEYOND: Final = 1e-6
"""How far an angle may be beyond its joint's limit [rad, or m]."""

ARM: Final = 1.0
"""Lever at which an error of a hand's loads turns a joint [m]: about a limb's length."""


class JointUse(NamedTuple):
    """What a limb's joints bear.

    Attributes
    ----------
    shares : ndarray, shape (n,)
        Torques over limits; zero of joints without a motor.
    passive : dict of str to float
        Torques of those of limbs with a hand, by name, which must be zero [N·m, N].
    """

    shares: Array
    passive: dict[str, float]


def check_limbs(
    found: list[str],
    question: Question,
    wrenches: Mapping[str, Array],
    body_wrench: Array,
    where: Posture | None,
) -> dict[str, JointUse]:
    """Check joints and the robot's own weight; return what the joints of all limbs bear.

    Parameters
    ----------
    found : list of str
        What is wrong so far; more is appended.
    question : Question
    wrenches : mapping of str to ndarray, shape (6,)
        Of the hands on the rock, by limb.
    body_wrench : ndarray, shape (6,)
        The one planned for, in B.
    where : Posture or None
    """
    uses: dict[str, JointUse] = {}
    if (where is None) != (question.stance.joints is None):
        found.append("the joints are not what the question says of them")
    if where is None:
        return uses
    robot = question.stance.robot
    own = _hold_up(question, wrenches, where)
    _check_places(found, question, where, own)
    if question.body_wrench is None:
        needed = _needed(question, own)
        off = float(np.linalg.norm(body_wrench - needed))
        if not off <= WEIGHT * max(1.0, float(np.linalg.norm(needed))):
            found.append(f"the robot's weight and acceleration ask for {off:.3g} N or N·m else")
    for limb in robot.limbs:
        said = where.joints[limb]
        torques = own.torques[limb]
        claimed = said.torques(wrenches.get(limb, np.zeros(6)))
        allowed = TORQUE * max(1.0, float(np.abs(torques).max()))
        for name, torque, claim in zip(said.names, torques, claimed, strict=True):
            if not abs(torque - claim) <= allowed:
                found.append(f"{limb}: joint {name} bears {torque:.6g} N·m, not {claim:.6g}")
        limits = _limits(question, limb)
        moved = limits > 0.0
        uses[limb] = JointUse(
            np.divide(torques, limits, out=np.zeros(len(limits)), where=moved),
            {said.names[i]: float(torques[i]) for i in np.flatnonzero(~moved).tolist()}
            if limb in wrenches
            else {},
        )
    return uses


def check_passive(found: list[str], limb: str, use: JointUse, allowed: float) -> None:
    """Check that joints without a motor bear nothing.

    ``allowed``: the error that the hand's loads may have [N].
    """
    for name, torque in use.passive.items():
        if not abs(torque) <= allowed * ARM:
            found.append(f"{limb}: joint {name} has no motor, and bears {torque:.6g} N·m")


def _limits(question: Question, limb: str) -> Array:
    """Return what a limb's joints bear: what the caller says of them, else the robot [N·m]."""
    limits, asked = question.stance.robot.chains[limb].torque_limits, question.limits.joint_torque
    own = asked.get(limb) if isinstance(asked, Mapping) else asked
    return limits if own is None else np.array(own, dtype=float) * np.ones(len(limits))


def _hold_up(question: Question, wrenches: Mapping[str, Array], where: Posture) -> LimbTorques:
    stance, load = question.stance, question.load
    into_body, body = stance.body.rotation.T, stance.body.inverse()
    acceleration = np.array([load.acceleration, load.angular_acceleration])
    return LinkTree(stance.robot).hold_up(
        where.angles,
        wrenches,
        into_body @ stance.gravity,
        (acceleration @ into_body.T).ravel(),
        held={place.limb: body @ place.pose for place in stance.hands},
        payloads=load.payloads,
    )


def _needed(question: Question, own: LimbTorques) -> Array:
    """Return the body wrench of what is carried, in B, shape (6,) [N, N·m]."""
    stance, load = question.stance, question.load
    mass, place, found = stance.robot.mass, own.com, own.body_wrench
    if load.com is not None:
        mass, place, found = 0.0, np.array(load.com), np.zeros(6)
    more = (stance.robot.mass if load.mass is None else load.mass) - mass
    turn = stance.body.rotation
    force = more * (np.array(load.acceleration) - stance.gravity) @ turn
    force = force + more * np.cross(np.array(load.angular_acceleration) @ turn, place)
    return np.asarray(found + own.payloads + np.concatenate([force, np.cross(place, force)]))


def _check_places(found: list[str], question: Question, where: Posture, own: LimbTorques) -> None:
    """Check that joints put the hands where the stance has them, within the joints' limits."""
    stance = question.stance
    most_off, most_turned = PLACED
    solved, told_angles = stance.solved_limbs, stance.given_joints
    body = stance.body.inverse()
    for place in stance.hands:
        pose, there = body @ place.pose, own.hands[place.limb]
        off = float(np.linalg.norm(pose.position - there.position))
        turned = float(
            scipy.spatial.transform.Rotation.from_matrix(
                there.rotation.T @ pose.rotation
            ).magnitude()
        )
        told_off, told_turned = where.off.get(place.limb, (0.0, 0.0))
        near = off <= most_off and turned <= most_turned
        told = abs(off - told_off) <= TOLD and abs(turned - told_turned) <= TOLD
        if not (near and (told or place.limb not in solved)):
            found.append(
                f"{place.limb}: its joints put the hand {off:.3g} m and {turned:.3g} rad from its "
                "pose"
            )
    for limb, angles in where.angles.items():
        chain = stance.robot.chains[limb]
        beyond = np.maximum(chain.lower - angles, angles - chain.upper)
        if not float(beyond.max()) <= BEYOND:
            found.append(f"{limb}: a joint is {beyond.max():.3g} rad beyond its limit")
        if limb not in solved:
            given = told_angles.get(limb, np.clip(0.0, chain.lower, chain.upper))
            if not np.array_equal(given, angles):
                found.append(f"{limb}: its joints are not at the angles that were given")


def force_use(
    found: list[str], question: Question, place: HandOnHold, wrench: Array, allowed: float
) -> tuple[Array, Array]:
    """Check the cap on a hand's force, by its wrench.

    Without a direction, the utilisation of its rows must be no less than that of the force itself.

    Returns
    -------
    used : ndarray
        Utilisation along each direction that is capped.
    none : ndarray
        The force along each direction in which there may be none [N].
    """
    cap = question.limits.per_hand.get(place.limb)
    if cap is None:
        return NOTHING, NOTHING
    force = wrench[:3]
    if not isinstance(cap.most, tuple):
        along, size = BALL @ force, float(np.linalg.norm(force))
        if not size <= along.max() + allowed:
            found.append(f"{place.limb}: the hand exerts {size:.6g} N, more than its rows say")
        return along / cap.most, NOTHING
    if cap.frame != "hand":
        force = place.pose.rotation @ force
    if cap.frame == "body":
        force = question.stance.body.rotation.T @ force
    ends = np.array(cap.most)
    both, barred = np.column_stack([force, force]), ends == 0.0
    none = both * [-1.0, 1.0]
    for axis in (barred & ~(none <= allowed)).any(axis=1).nonzero()[0].tolist():
        found.append(
            f"{place.limb}: {force[axis]:.6g} N along {'xyz'[axis]} of the {cap.frame}, of none"
        )
    return both[~barred] / ends[~barred], none[barred]


def check_asked(
    found: list[str],
    question: Question,
    place: HandOnHold,
    wrench: Array,
    tensions: Array,
    allowed: float,
) -> None:
    """Check what is asked of a hand: given components of its wrench, small changes of tensions."""
    for j, value in enumerate(place.wrench or ()):
        if value is not None and not abs(wrench[j] - value) <= allowed:
            found.append(
                f"{place.limb}: component {j + 1} of the wrench is {wrench[j]:.6g}, not {value:.6g}"
            )
    most, present = question.limits.tension_change, question.present.get(place.limb)
    if most is None or present is None:
        return
    for name, tension, before in zip(FINGERS, tensions, present, strict=True):
        change = tension - before
        if not abs(change) <= most + allowed:
            found.append(
                f"{place.limb}: tension of {name} changes by {change:.6g} N, more than {most:g}"
            )
