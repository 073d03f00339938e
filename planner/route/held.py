"""A robot held at one time of a climb: its posture, and verified loads of all hands on the rock."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from msgspec import structs

from hand_models.base import Array, Pose, wrench_transport
from hand_models.fixed_wrist import PALM_PRESSING, PALM_SHEAR
from hand_models.hand import FINGERS
from planner.explanation import joint_name, limit_name, most_used
from planner.prepare import FORCE_CAP, JointLoads, Posture, PreparedStance, assemble, posture_at
from planner.programs import CAP_SLACK, LOAD_UNIT
from planner.question import HandOnHold, Objective, Question, Stance
from planner.result import LimitName, LoadRecovery, PlanArrays
from planner.robots import LinkTree
from planner.route.climb import Route
from planner.route.hold_rows import HoldRows
from planner.route.moving_hand import HandKnot, MovingHand
from planner.solving import Checks, Solution, Verified, answer_on, idle_joints
from planner.verification import Check

__all__ = ["HeldPosture", "NoPlanError", "Posed", "hold_as_planned", "hold_with"]


class NoPlanError(Exception):
    """Error: the hands cannot hold the robot in a posture; the message says why."""


@dataclass(frozen=True, eq=False)
class Posed:
    """A robot's posture in a climb, with its hands on the rock, and perhaps one that moves.

    Attributes
    ----------
    route : Route
        Load, limits and objective.
    hands : tuple of HandOnHold
        The hands that hold the robot.
    body : Pose
        Pose of the body frame B in W.
    angles : mapping of str to ndarray, shape (n,)
        Joint angles of every limb [rad].
    moving : MovingHand or None
        The hand that moves.
    """

    route: Route
    hands: tuple[HandOnHold, ...]
    body: Pose
    angles: Mapping[str, Array]
    moving: MovingHand | None = None

    @cached_property
    def _whole(self) -> Question:
        """The question without a hand that moves."""
        route, start = self.route, self.route.start
        on_rock = {hand.limb for hand in self.hands}
        caps = {limb: cap for limb, cap in route.limits.per_hand.items() if limb in on_rock}
        stance = Stance(self.hands, self.body, start.gravity, start.robot, dict(self.angles))
        limits = structs.replace(route.limits, per_hand=caps, tension_change=None)
        return Question(stance, load=route.load, limits=limits, objective=route.objective)

    @cached_property
    def posture(self) -> Posture:
        """Joint torques and weight of the robot at the joint angles."""
        return posture_at(self._whole, self.angles)

    @cached_property
    def needed(self) -> Array:
        """Wrench that the hands must supply that hold the robot, in B, shape (6,) [N, N·m]."""
        weight, moving = self._whole.needed_wrench(self.posture.weights), self.moving
        if moving is None or not moving.on_rock:
            return weight
        return np.asarray(weight + wrench_transport(self.hand_poses[moving.limb]) @ moving.wrench)

    @cached_property
    def prepared(self) -> PreparedStance:
        """The stance of the hands that hold the robot, prepared for the solver."""
        question, moving = self._whole, self.moving
        if moving is not None and moving.on_rock:
            question = replace(question, body_wrench=self.needed)
        parts = assemble(question, self.posture, self.needed)
        return PreparedStance(question, self.posture, *parts, self.needed)

    @cached_property
    def recovery(self) -> LoadRecovery:
        """Conversion of the hands' loads to a plan's numbers."""
        hands = self.prepared.hands
        return LoadRecovery(self.prepared.batch, hands.spaces, hands.scaled)

    @cached_property
    def rows(self) -> HoldRows:
        """The rows of the hands that hold the robot; moments about the body's origin."""
        poses = [hand.pose for hand in self.hands]
        return HoldRows.of(self.prepared.hands.spaces, poses, self.body.position)

    def beside(self, moving: MovingHand | None, angles: Array | None = None) -> Posed:
        """Return the posture with another state of the moving hand, while all others hold still.

        ``angles``, shape (n,), are new joint angles of its limb [rad]. What the others can carry is
        not computed again.
        """
        joints = self.angles
        if angles is not None and moving is not None:
            joints = {**joints, moving.limb: angles}
        found = replace(self, moving=moving, angles=joints)
        if angles is None:
            found.__dict__["posture"] = self.posture
        question = found._whole
        if moving is not None and moving.on_rock:
            question = replace(question, body_wrench=found.needed)
        before = self.prepared
        found.__dict__.update(recovery=self.recovery, rows=self.rows)
        found.__dict__["prepared"] = PreparedStance(
            question, found.posture, before.batch, before.hands.turned(found.needed), found.needed
        )
        return found

    def cap_use(self, beside: Array) -> float:
        """Return the share of the cap on its force that the moving hand has on its rock.

        ``beside``, shape (3,), is how far the force may be from there, in H [N].
        """
        moving = self.moving
        cap = None if moving is None else self.route.limits.per_hand.get(moving.limb)
        if cap is None or moving is None:
            return 0.0
        return moving.cap_use(cap, self.hand_poses[moving.limb].rotation, self.body, beside)

    @property
    def idle(self) -> dict[str, JointLoads]:
        """Joint loads of the limbs whose hands do not hold the robot, by limb."""
        return self.posture.idle(self._whole.stance)

    @cached_property
    def hand_poses(self) -> dict[str, Pose]:
        """Pose of each limb's hand frame H in B: where its hand is held, or its joints put it."""
        found, into_body = self.route.start.robot.hand_poses(self.angles), self.body.inverse()
        return found | {hand.limb: into_body @ hand.pose for hand in self.hands}


@dataclass(frozen=True, eq=False)
class HeldPosture:
    """Verified loads of a posture.

    Attributes
    ----------
    posed : Posed
    prepared : PreparedStance
        The stance of the hands that hold the robot.
    loads : tuple of ndarray, shape (m,)
        Loads y of each of these hands [N].
    arrays : PlanArrays
        Their numbers.
    used : ndarray
        Utilisation of each limit row of their sets, hand by hand.
    solution : Solution or None
        Of the solver, as a start for others.
    """

    posed: Posed
    prepared: PreparedStance
    loads: tuple[Array, ...]
    arrays: PlanArrays
    used: Array
    solution: Solution | None = None

    @cached_property
    def wrenches(self) -> dict[str, Array]:
        """Wrench of each hand on the rock, in its H, shape (6,) [N, N·m]; zero in the air."""
        found = {limb: np.zeros(6) for limb in self.posed.route.start.robot.limbs}
        found |= dict(zip(self.prepared.limbs, self.arrays.wrenches, strict=True))
        if self.posed.moving is not None:
            found[self.posed.moving.limb] = self.posed.moving.wrench
        return found

    @cached_property
    def joint_torque(self) -> dict[str, Array]:
        """Joint torques of every limb, shape (n,) [N·m]."""
        joints = self.posed.posture.joints
        return {limb: own.torques(self.wrenches[limb]) for limb, own in joints.items()}

    @cached_property
    def idle(self) -> list[tuple[float, LimitName]]:
        """Utilisation of the joints of limbs whose hand is not in the set of the stance."""
        found = list[tuple[float, LimitName]]()
        for limb, own in self.posed.idle.items():
            driven = own.driven
            shares = np.abs(driven.torques(self.wrenches[limb])) / driven.limits
            names = zip(driven.names, driven.sliding.tolist(), strict=True)
            found += [
                (share, joint_name(limb, *name))
                for share, name in zip(shares.tolist(), names, strict=True)
            ]
        return found

    @cached_property
    def most_used(self) -> tuple[float, LimitName | None]:
        """Largest utilisation of all limits, and the limit that has it."""
        limits = [
            (limb, row)
            for limb, space in zip(self.prepared.limbs, self.prepared.hands.spaces, strict=True)
            for row in space.rows[: len(space.s)]
        ]
        most, i = float(self.used.max()), most_used(self.used)
        found: list[tuple[float, LimitName | None]] = [
            (max(most, 0.0), limit_name(*limits[i])),
            *self.idle,
        ]
        moving = self.posed.moving
        if moving is not None and moving.on_rock:
            found.append((moving.utilisation, moving.limiting))
            cap = LimitName(moving.limb, None, None, FORCE_CAP)
            found.append((self.posed.cap_use(np.zeros(3)), cap))
        return max(found, key=lambda each: each[0])

    @property
    def utilisation(self) -> float:
        """Largest utilisation of all limits."""
        return self.most_used[0]

    def hand_knots(self) -> tuple[HandKnot, ...]:
        """Return the hands as a knot has them, in the order of the start stance."""
        limbs, posed = self.prepared.limbs, self.posed
        winches = self.arrays.drives[-1].reshape(-1, len(FINGERS))
        tensions = self.arrays.tensions.reshape(-1, len(FINGERS))
        poses = {hand.limb: hand.pose for hand in posed.hands}
        found, moving = list[HandKnot](), posed.moving
        for place in posed.route.start.hands:
            limb = place.limb
            if moving is not None and limb == moving.limb:
                pose, on_rock = posed.body @ posed.hand_poses[limb], moving.on_rock
                own = moving.tensions, moving.winch_angles
            else:
                h = limbs.index(limb)
                pose, on_rock, own = poses[limb], True, (tensions[h], winches[h])
            found.append(
                HandKnot(
                    limb=limb,
                    pose=pose,
                    on_rock=on_rock,
                    tensions=own[0],
                    winch_angles=own[1],
                    wrench=self.wrenches[limb],
                )
            )
        return tuple(found)


def hold_as_planned(
    posed: Posed,
    near: Solution | None = None,
    press: float = 0.0,
    objective: Objective | None = None,
) -> HeldPosture:
    """Return the verified plan of a posture.

    Parameters
    ----------
    posed : Posed
    near : Solution, optional
        Solution of the same hands, as a warm start.
    press : float, optional
        Force with which palms press, and drag, at least [N].
    objective : str, optional
        In place of the route's.

    Raises
    ------
    NoPlanError
        If there is no plan within the cap on the utilisation, or the moving limb's joints or
        fingers are overloaded.
    """
    prepared = posed.prepared
    check = Check(prepared.question, prepared.batch, prepared.where)
    checks = Checks(check, posed.recovery, idle_joints(prepared))
    asked = _pressing(prepared, press) if press > 0.0 else prepared
    if objective is not None:
        asked = replace(asked, question=replace(asked.question, objective=objective))
    found = answer_on(asked, time.perf_counter(), checks, near, prove=press == 0.0)
    answer = found.answer
    if (
        not isinstance(answer, Verified)
        or answer.utilisation > prepared.question.limits.utilisation + CAP_SLACK
    ):
        raise NoPlanError(found.reason or "no plan passes the checks")
    held = HeldPosture(
        posed, prepared, answer.solution.loads, answer.arrays, answer.used, answer.solution
    )
    return _checked(held)


def _pressing(prepared: PreparedStance, press: float) -> PreparedStance:
    """Return a stance whose palms press and drag on the rock at least with a force [N]."""
    spaces, scaled, hands = [], [], prepared.hands
    ways = (f"{PALM_PRESSING}_reversed", f"{PALM_SHEAR}_reversed")
    for space, rows in zip(hands.spaces, hands.scaled, strict=True):
        least = press * np.array(
            [row.limit in ways for row in space.rows[len(space.s) :]], dtype=float
        )
        spaces.append(replace(space, h=space.h - least))
        scaled.append(rows._replace(h=rows.h - least / LOAD_UNIT))
    return replace(prepared, hands=hands.with_sets(spaces, scaled=tuple(scaled)))


def hold_with(posed: Posed, loads: Sequence[Array]) -> HeldPosture:
    """Return the verified loads of a posture that are given, shape (m,) for each hand [N].

    Raises
    ------
    NoPlanError
        If the loads do not pass the checks.
    """
    prepared = posed.prepared
    arrays, used, _ = posed.recovery.read(loads)
    held = HeldPosture(posed, prepared, tuple(loads), arrays, used)
    # the check knows of no wrench of a hand beside those of the stance
    air = replace(posed, moving=None)
    check = Check(prepared.question, prepared.batch, prepared.where)
    alone = replace(held, posed=air)
    wrong = check.problems(arrays, alone.utilisation, prepared.wrench)
    if wrong:
        raise NoPlanError(f"the loads do not pass the checks: {wrong[0]}")
    return _checked(held)


def _checked(held: HeldPosture) -> HeldPosture:
    """Return loads whose moving limb passes its own check, and which are within the limits."""
    moving, most = held.posed.moving, held.prepared.question.limits.utilisation
    if moving is not None and moving.on_rock:
        _check_moving(held, moving)
    used, name = held.most_used
    if not used <= most + CAP_SLACK:
        from planner.explanation import constraint_words

        what = "a limit" if name is None else f"{name.limb}: {constraint_words(name)}"
        share = f", and would need {used / most:.6g} of what it may" if np.isfinite(used) else ""
        raise NoPlanError(f"{what}{share}")
    return held


def _check_moving(held: HeldPosture, moving: MovingHand) -> None:
    """Recompute balance and torques with the moving hand's wrench, link by link from the URDF."""
    posed, load = held.posed, held.posed.route.load
    gravity = posed.body.rotation.T @ posed.route.start.gravity
    acceleration = np.array([load.acceleration, load.angular_acceleration]) @ posed.body.rotation
    own = LinkTree(posed.route.start.robot).hold_up(
        posed.angles,
        held.wrenches,
        gravity,
        acceleration.ravel(),
        held=posed.hand_poses,
        payloads=load.payloads,
    )
    said, found = held.joint_torque[moving.limb], own.torques[moving.limb]
    if not np.abs(said - found).max() <= 1e-6 * max(1.0, float(np.abs(found).max())):
        raise NoPlanError(f"the joint torques of {moving.limb} do not pass the check")
    pushed = sum(
        wrench_transport(pose) @ held.wrenches[limb] for limb, pose in posed.hand_poses.items()
    )
    if load.own:
        off = own.body_wrench + own.payloads + pushed
        size = float(np.linalg.norm(own.body_wrench))
        if not float(np.linalg.norm(off)) <= 1e-6 * size:
            raise NoPlanError(f"the balance is off by {float(np.linalg.norm(off)):.3g} N or N·m")
