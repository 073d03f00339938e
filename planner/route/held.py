"""A robot held at one time of a climb: its posture, and verified loads of all hands on the rock."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

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


class HoldingHands(NamedTuple):
    """The hands that hold the robot in a posture.

    Attributes
    ----------
    prepared : PreparedStance
        Their stance, prepared for the solver.
    recovery : LoadRecovery
        Conversion of their loads to a plan's numbers.
    rows : HoldRows
        Their rows; moments about the body's origin.
    """

    prepared: PreparedStance
    recovery: LoadRecovery
    rows: HoldRows


class Posed:
    """A robot's posture in a climb, with its hands on the rock, and perhaps one that moves.

    Parameters
    ----------
    route : Route
        Load, limits and objective.
    hands : tuple of HandOnHold
        The hands that hold the robot.
    body : Pose
        Pose of the body frame B in W.
    angles : mapping of str to ndarray, shape (n,)
        Joint angles of every limb [rad].
    moving : MovingHand, optional
        The hand that moves.
    posture : Posture, optional
        Joint torques and weight of the robot at the joint angles, where they are known.
    known : HoldingHands, optional
        The same hands beside another state of the moving hand.

    Attributes
    ----------
    question : Question
        What is asked of the hands that hold the robot.
    needed : ndarray, shape (6,)
        Wrench that these hands must supply, in B [N, N·m].
    hand_poses : dict of str to Pose
        Pose of each limb's hand frame H in B: where its hand is held, or its joints put it.
    """

    def __init__(
        self,
        route: Route,
        hands: tuple[HandOnHold, ...],
        body: Pose,
        angles: Mapping[str, Array],
        moving: MovingHand | None = None,
        posture: Posture | None = None,
        known: HoldingHands | None = None,
    ) -> None:
        self.route, self.hands, self.body, self.angles = route, hands, body, angles
        self.moving, self._known, start = moving, known, route.start
        on_rock = {hand.limb: body.inverse() @ hand.pose for hand in hands}
        caps = {limb: cap for limb, cap in route.limits.per_hand.items() if limb in on_rock}
        stance = Stance(hands, body, start.gravity, start.robot, dict(angles))
        limits = structs.replace(route.limits, per_hand=caps, tension_change=None)
        question = Question(stance, load=route.load, limits=limits, objective=route.objective)
        self.posture = posture_at(question, angles) if posture is None else posture
        self.hand_poses = start.robot.hand_poses(angles) | on_rock
        self.needed = question.needed_wrench(self.posture.weights)
        if moving is not None and moving.on_rock:
            carried = wrench_transport(self.hand_poses[moving.limb]) @ moving.wrench
            self.needed = np.asarray(self.needed + carried)
            question = replace(question, body_wrench=self.needed)
        self.question = question

    @cached_property
    def holding(self) -> HoldingHands:
        """The hands that hold the robot, prepared for the solver."""
        question, posture, known = self.question, self.posture, self._known
        if known is not None:
            batch, hands = known.prepared.batch, known.prepared.hands.turned(self.needed)
            prepared = PreparedStance(question, posture, batch, hands, self.needed)
            return known._replace(prepared=prepared)
        parts = batch, hands = assemble(question, posture, self.needed)
        poses = [hand.pose for hand in self.hands]
        return HoldingHands(
            PreparedStance(question, posture, *parts, self.needed),
            LoadRecovery(batch, hands.spaces, hands.scaled),
            HoldRows.of(hands.spaces, poses, self.body.position),
        )

    def beside(self, moving: MovingHand | None, angles: Array | None = None) -> Posed:
        """Return the posture with another state of the moving hand, while all others hold still.

        ``angles``, shape (n,), are new joint angles of its limb [rad]. What the others can carry is
        not computed again.
        """
        joints, posture = self.angles, self.posture if angles is None else None
        if angles is not None and moving is not None:
            joints = {**joints, moving.limb: angles}
        return Posed(self.route, self.hands, self.body, joints, moving, posture, self.holding)

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
        return self.posture.idle(self.question.stance)


class HeldPosture:
    """Verified loads of a posture.

    Parameters
    ----------
    posed : Posed
    loads : sequence of ndarray, shape (m,)
        Loads y of each hand that holds the robot [N].
    arrays : PlanArrays
        Their numbers.
    used : ndarray
        Utilisation of each limit row of their sets, hand by hand.
    solution : Solution, optional
        Of the solver, as a start for others.

    Attributes
    ----------
    prepared : PreparedStance
        The stance of the hands that hold the robot.
    wrenches : dict of str to ndarray, shape (6,)
        Wrench of each hand on the rock, in its H [N, N·m]; zero in the air.
    most_used : tuple of float and LimitName
        Largest utilisation of all limits, and the limit that has it.
    """

    def __init__(
        self,
        posed: Posed,
        loads: Sequence[Array],
        arrays: PlanArrays,
        used: Array,
        solution: Solution | None = None,
    ) -> None:
        self.posed, self.prepared, self.loads = posed, posed.holding.prepared, tuple(loads)
        self.arrays, self.used, self.solution = arrays, used, solution
        self.wrenches = {limb: np.zeros(6) for limb in posed.route.start.robot.limbs}
        self.wrenches |= dict(zip(self.prepared.limbs, arrays.wrenches, strict=True))
        if posed.moving is not None:
            self.wrenches[posed.moving.limb] = posed.moving.wrench
        self.most_used = max(self._largest(), key=lambda each: each[0])

    @property
    def joint_torque(self) -> dict[str, Array]:
        """Joint torques of every limb, shape (n,) [N·m]."""
        joints = self.posed.posture.joints
        return {limb: own.torques(self.wrenches[limb]) for limb, own in joints.items()}

    def _idle(self) -> list[tuple[float, LimitName]]:
        """Return the utilisation of the joints of limbs whose hand is not in the set."""
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

    def _largest(self) -> list[tuple[float, LimitName | None]]:
        """Return the utilisations among which the largest of all is, and their limits."""
        limits = [
            (limb, row)
            for limb, space in zip(self.prepared.limbs, self.prepared.hands.spaces, strict=True)
            for row in space.rows[: len(space.s)]
        ]
        most, i = float(self.used.max()), most_used(self.used)
        found: list[tuple[float, LimitName | None]] = [
            (max(most, 0.0), limit_name(*limits[i])),
            *self._idle(),
        ]
        moving = self.posed.moving
        if moving is not None and moving.on_rock:
            found.append((moving.utilisation, moving.limiting))
            cap = LimitName(moving.limb, None, None, FORCE_CAP)
            found.append((self.posed.cap_use(np.zeros(3)), cap))
        return found

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
    prepared, recovery, _ = posed.holding
    check = Check(prepared.question, prepared.batch, prepared.where)
    checks = Checks(check, recovery, idle_joints(prepared))
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
    solution = answer.solution
    return _checked(HeldPosture(posed, solution.loads, answer.arrays, answer.used, solution))


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
    prepared, recovery, _ = posed.holding
    arrays, used, _ = recovery.read(loads)
    # the check knows of no wrench of a hand beside those of the stance
    alone = HeldPosture(posed.beside(None), loads, arrays, used)
    check = Check(prepared.question, prepared.batch, prepared.where)
    wrong = check.problems(arrays, alone.utilisation, prepared.wrench)
    if wrong:
        raise NoPlanError(f"the loads do not pass the checks: {wrong[0]}")
    return _checked(HeldPosture(posed, loads, arrays, used))


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
