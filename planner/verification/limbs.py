"""Check the joints of limbs, and the limits that a question sets on hands' forces and tendons.

Joint torques are recomputed from the robot's URDF itself, by moments about each axis (`LinkTree`),
not by the Jacobians and the Newton–Euler pass from which the program's rows are made.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import scipy

from hand_models.base import Array, Indices
from planner.prepare import FORCE_DIRECTIONS, Posture
from planner.question import ForceCap, Question
from planner.result import PlanArrays
from planner.robots import LimbTorques, LinkTree
from planner.verification.residuals import (
    FINGER_COUNT,
    PartNames,
    Recomputed,
    Residual,
    ResidualLimits,
)
from planner.verification.tiles import TileLimits

__all__ = ["AskedLimits", "JointUse", "check_limbs", "recompute_joints"]


class JointUse(NamedTuple):
    """Loads of a limb's joints.

    Attributes
    ----------
    shares : ndarray, shape (n,)
        Joint torque over torque limit, with sign; zero for joints without a motor.
    passive : dict of str to float
        Torques of the joints without a motor, by joint name, which must be zero [N·m, or N]; empty
        for a limb without a hand.
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
    """Check joint angles, joint torques and the body wrench of the robot's weight.

    Parameters
    ----------
    found : list of str
        Error messages so far; further ones are appended.
    question : Question
        Stance, load, limits and objective.
    wrenches : mapping of str to ndarray, shape (6,)
        Wrench of each hand on the rock in its H, by limb [N, N·m].
    body_wrench : ndarray, shape (6,)
        Wrench that the rock must exert on the robot, in B [N, N·m].
    where : Posture or None
        Joint angles and joint loads of the plan; None if it has none.

    Returns
    -------
    dict of str to JointUse
        Recomputed loads of the joints of every limb; empty without joints.
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
        if not off <= 1e-9 * max(1.0, float(np.linalg.norm(needed))):  # relative, or of 1 N
            found.append(f"the robot's weight and acceleration ask for {off:.3g} N or N·m else")
    for limb in robot.limbs:
        said = where.joints[limb]
        torques = own.torques[limb]
        claimed = said.torques(wrenches.get(limb, np.zeros(6)))
        allowed = 1e-6 * max(1.0, float(np.abs(torques).max()))  # relative, or of 1 N·m
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


def recompute_joints(limb: str, h: int, use: JointUse) -> list[Residual]:
    """Return the utilisations of a limb's joints, and the residuals of joints without a motor.

    Parameters
    ----------
    limb : str
        Name of the limb.
    h : int
        Index of the limb's hand.
    use : JointUse
        Recomputed loads of the limb's joints.
    """
    hand, torques = np.array([h]), np.array([*use.passive.values()])
    residuals = [Residual("use", np.concatenate((use.shares, -use.shares))[None], hand)]
    if use.passive:
        each, names = hand.repeat(len(torques)), [f"{limb}: joint {name}" for name in use.passive]
        text = " has no motor, and bears {:.6g} N·m"
        # an error of loads [N] turns a joint at a lever of a metre: about a limb's length
        residuals.append(Residual("zero", torques, each, names.__getitem__, text, (torques,)))
    return residuals


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
    most_off, most_turned = 0.01, 0.05  # [m], [rad]: up to here a posture is taken for the hand's
    solved, given_angles = stance.solved_limbs, stance.given_joints
    body = stance.body.inverse()
    error = 1e-5  # [m, rad] of what is reported of joints that were found
    for place in stance.hands:
        pose, there = body @ place.pose, own.hands[place.limb]
        off = float(np.linalg.norm(pose.position - there.position))
        turned = float(
            scipy.spatial.transform.Rotation.from_matrix(
                there.rotation.T @ pose.rotation
            ).magnitude()
        )
        reported_off, reported_turned = where.off.get(place.limb, (0.0, 0.0))
        near = off <= most_off and turned <= most_turned
        agrees = abs(off - reported_off) <= error and abs(turned - reported_turned) <= error
        if not (near and (agrees or place.limb not in solved)):
            found.append(
                f"{place.limb}: its joints put the hand {off:.3g} m and {turned:.3g} rad from its "
                "pose"
            )
    for limb, angles in where.angles.items():
        chain = stance.robot.chains[limb]
        beyond = np.maximum(chain.lower - angles, angles - chain.upper)
        if not float(beyond.max()) <= 1e-6:  # [rad, or m] rounding of seven digits
            found.append(f"{limb}: a joint is {beyond.max():.3g} rad beyond its limit")
        if limb not in solved:
            given = given_angles.get(limb, np.clip(0.0, chain.lower, chain.upper))
            if not np.array_equal(given, angles):
                found.append(f"{limb}: its joints are not at the angles that were given")


class _Cap(NamedTuple):
    """A cap on a hand's force: rows of utilisations, and of what may not be below zero.

    Attributes
    ----------
    hand : ndarray of int, shape (1,)
    use, none : ndarray, shape (…, 3)
    axes : tuple of str
        Names of the axes of the latter, along which there may be no force.
    ball : bool
        Whether it is on the force's size, which the rows are no more than.
    """

    hand: Indices
    use: Array
    none: Array
    axes: tuple[str, ...]
    ball: bool


def _cap_of(question: Question, h: int, cap: ForceCap) -> _Cap:
    stance, hand = question.stance, np.array([h])
    if not isinstance(cap.most, tuple):
        return _Cap(hand, FORCE_DIRECTIONS / cap.most, np.zeros((0, 3)), (), ball=True)
    turn = np.eye(3) if cap.frame == "hand" else stance.hands[h].pose.rotation
    if cap.frame == "body":
        turn = stance.body.rotation.T @ turn
    ends = np.array(cap.most)
    axis, end = (ends != 0.0).nonzero()
    barred, side = (ends == 0.0).nonzero()
    none = turn[barred] * np.where(side == 0, 1.0, -1.0)[:, None]
    axes = tuple(f"{'xyz'[i]} of the {cap.frame}" for i in barred.tolist())
    return _Cap(hand, turn[axis] / ends[axis, end][:, None], none, axes, ball=False)


class AskedLimits(ResidualLimits):
    """Limits that a question sets on hands: caps on forces, given wrenches, changes of tensions.

    Parameters
    ----------
    question : Question
        Stance, load, limits and objective.
    names : PartNames
        Names of the hands' parts.
    tiles : TileLimits
        Limits of the tiles, to which the question may add a margin.
    """

    def __init__(self, question: Question, names: PartNames, tiles: TileLimits) -> None:
        hands, limits, present = question.stance.hands, question.limits, question.present
        self._names = names
        self._caps = [
            _cap_of(question, h, limits.per_hand[place.limb])
            for h, place in enumerate(hands)
            if place.limb in limits.per_hand
        ]
        given = [
            (h, j, value)
            for h, place in enumerate(hands)
            for j, value in enumerate(place.wrench or ())
            if value is not None
        ]
        self._given = [np.array(own) for own in zip(*given, strict=True)]
        self._present = {
            h: np.asarray(present[place.limb])
            for h, place in enumerate(hands)
            if place.limb in present and limits.tension_change is not None
        }
        self._most = limits.tension_change or 0.0
        self._tiles, self._least = tiles, limits.least_tension
        self._margin = limits.hold_margin or 0.0
        self._hand = np.arange(len(hands)).repeat(FINGER_COUNT)
        self._palm_margin = limits.palm_margin
        self._palms = np.array(
            [
                h
                for h, (place, hand) in enumerate(zip(hands, names.known.hands, strict=True))
                if place.wrist == "fixed" and hand.palm.engaged
            ],
            dtype=np.intp,
        )

    def recompute(self, again: Recomputed) -> list[Residual]:
        """Return the residuals of the question's limits on tensions, forces and wrenches."""
        tensions, wrenches = again.arrays.tensions, again.arrays.wrenches
        residuals = self._tiles.holding(again.loads, self._margin) if self._margin else []
        if self._least:
            name = self._names.of_fingers("tension", np.arange(len(tensions)))
            text = f" is {{:.6g}} N, less than {self._least:g}"
            left = tensions - self._least
            residuals.append(Residual("least", left, self._hand, name, text, (tensions,)))
        if self._palm_margin and len(self._palms):
            presses, limb = again.arrays.palms[self._palms, 2], self._names.limb_of(self._palms)
            text = f"its palm presses with {{:.6g}} N, less than {self._palm_margin:g}"
            left = presses - self._palm_margin
            residuals.append(Residual("least", left, self._palms, limb, text, (presses,)))
        for cap in self._caps:
            force, limb = wrenches[cap.hand[0], :3], self._names.limb_of(cap.hand)
            residuals.append(Residual("use", (cap.use @ force)[None], cap.hand))
            for along, axis in zip(cap.none @ force, cap.axes, strict=True):
                text, left = f"{{:.6g}} N along {axis}, of none", along[None]
                residuals.append(Residual("least", left, cap.hand, limb, text, (np.abs(left),)))
        if self._given:
            hand, j, value = self._given
            own, limb = wrenches[hand, j], self._names.limb_of(hand)
            text = "component {} of the wrench is {:.6g}, not {:.6g}"
            numbers = j + 1, own, value
            residuals.append(Residual("zero", own - value, hand, limb, text, numbers))
        for h, present in self._present.items():
            fingers = np.arange(FINGER_COUNT * h, FINGER_COUNT * (h + 1))
            name = self._names.of_fingers("tension", fingers)
            text = f" changes by {{:.6g}} N, more than {self._most:g}"
            change, hand = tensions[fingers] - present, np.full(FINGER_COUNT, h)
            residuals += [
                Residual("least", left, hand, name, text, (change,))
                for left in (self._most - change, self._most + change)
            ]
        return residuals

    def recompute_curved(self, arrays: PlanArrays, loads: Array, wrenches: Array) -> list[Residual]:
        """Return by how much the program's linear bounds exceed the size of each capped force [N].

        For caps on a force in all directions; the bound must not be below the size.
        """
        residuals = []
        for cap in self._caps:
            if cap.ball:
                force, limb = wrenches[cap.hand, :3], self._names.limb_of(cap.hand)
                size = np.linalg.norm(force, axis=1)
                left = (force @ FORCE_DIRECTIONS.T).max(axis=1) - size
                text, by = "the hand exerts {:.6g} N, more than its rows say", (size,)
                residuals.append(Residual("least", left, cap.hand, limb, text, by, affine=False))
        return residuals
