"""Conic programs for the body space of a stance: the farthest feasible point in a direction.

As in a plan, the programs take joints, force caps, prescribed hand wrenches and the weight of limbs
without a hand into account.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import Final, NamedTuple

import numpy as np
from msgspec import structs

from hand_models.base import Array, CruxError, InvalidInputError, SolverError, UnsupportedError
from planner import deadline, programs
from planner.explanation import TOLERANCES, joint_name, limit_name
from planner.floating import disagreements
from planner.prepare import (
    HandSets,
    LinearisationPoint,
    Posture,
    assemble,
    posture_at,
)
from planner.programs import CAP_SLACK, WRENCH_UNIT, Outcome, Reached, StanceData
from planner.question import Question
from planner.result import LimitName, Plan
from planner.solving import plan

__all__ = ["BodyPrograms", "End", "Motion", "size_of"]

MISSING_RESULT: Final = "it was known what the stance can hold"
"""Result that a deadline prevents, in the words of the error."""


class Motion(NamedTuple):
    """Effect of the body's acceleration on the stance's programs.

    The acceleration has k components in world frame W: three linear and, if known, three angular.
    With joints at rest, the wrench that accelerates the robot and the joints' torques are affine in
    the acceleration: one column for each component describes them.

    Attributes
    ----------
    rest : StanceData
        Scaled rows of the hands with the body at rest.
    wrench : ndarray, shape (6, k)
        Body wrench in body frame B for one unit of each component [kg, kg·m, kg·m²].
    torques : tuple of ndarray, shape (nl, k)
        For each hand, the change of utilisation of its limit rows for one unit of each component.
    """

    rest: StanceData
    wrench: Array
    torques: tuple[Array, ...]


class End(NamedTuple):
    """Farthest feasible point of a stance in a direction.

    Attributes
    ----------
    reach : float
        Largest t for which t times the direction is feasible; from `BodySpace.support`, largest
        product of direction and body wrench. For a unit direction in N, N·m, m/s² or rad/s².
    wrench : ndarray, shape (6,)
        Body wrench at that point, in body frame B [N, N·m].
    limiting : LimitName or None
        Limit with the largest multiplier at that point: one per cent more of this limit would
        extend the reach most. None if no limit binds.
    loads : tuple of ndarray
        Loads y of each hand [N]; of a floating hand the wrist's twist [m, rad].
    """

    reach: float
    wrench: Array
    limiting: LimitName | None
    loads: tuple[Array, ...]


class BodyPrograms:
    """Conic programs that find the farthest feasible body wrench or acceleration of a stance.

    Parameters
    ----------
    question : Question

    Attributes
    ----------
    question : Question
        The question for the least utilisation, without extras and deadline.
    plan : Plan
        Plan of that question.
    data : StanceData
        Scaled rows of the hands; those of compliant and floating hands are linearised about
        the plan.
    motion : Motion or None
        Effect of the body's acceleration; None if the question gives a body wrench.
    exact : bool
        Whether all wrists are fixed, so that no set is linearised.
    """

    def __init__(self, question: Question) -> None:
        self.question = question.bare()
        self.plan = plan(self.question)
        where = None if self.plan.joints is None else posture_at(question, self.plan.joints)
        _, self._hands = assemble(self.question, where, self.plan.body_wrench)
        self._point = _where_planned(self._hands, self.plan)
        self.exact = not self._hands.floating
        self._spaces, data = self._hands.sets(self._point)
        self.data = _with_idle(data, question, where)
        self.motion = _motion(self.question, where, self._point)
        limbs = [hand.limb for hand in question.stance.hands]
        self._names = [
            [limit_name(limb, row) for row in space.rows[: len(space.s)]]
            for limb, space in zip(limbs, self._spaces, strict=True)
        ]
        for limb, joints in ({} if where is None else where.idle(question.stance)).items():
            driven = joints.driven
            names = map(partial(joint_name, limb), driven.names, driven.sliding.tolist())
            self._names[0] += [*names] * 2

    @property
    def cap(self) -> float:
        """Cap on the utilisation, from the question's limits."""
        return self.question.limits.utilisation

    @cached_property
    def cap_at_needed(self) -> float | None:
        """Utilisation cap for searches from the question's body wrench; None if infeasible.

        The question's cap, or slightly more where the least utilisation equals that cap.
        """
        return self._cap_of(self.data)

    @cached_property
    def at_rest(self) -> tuple[StanceData, float] | None:
        """Scaled rows of the hands with the body at rest, and utilisation cap.

        None if the body is infeasible at rest. Requires ``motion``.
        """
        assert self.motion is not None
        cap = self._cap_of(self.motion.rest)
        return None if cap is None else (self.motion.rest, cap)

    def _cap_of(self, data: StanceData) -> float | None:
        """Return the utilisation to go up to, where a balance can be had within it."""
        outcome = programs.margin(data)
        if not outcome.solved:
            if outcome.status not in programs.INFEASIBLE_STATUSES:
                raise _unsolved(outcome)
            return None
        # where the least utilisation is the cap itself, rounding must not empty the set
        within = outcome.value <= self.cap + CAP_SLACK
        return max(self.cap, outcome.value + CAP_SLACK) if within else None

    def reached(
        self, goal: Array, columns: Array, start: Array, cap: float | None = None
    ) -> Reached | None:
        """Find the feasible body wrench that is farthest along a goal.

        Maximises goal · t over body wrenches ``start + WRENCH_UNIT * (columns @ t)``.

        Parameters
        ----------
        goal : ndarray, shape (n,)
            Direction in the space of t; not zero.
        columns : ndarray, shape (6, n)
            Directions of body wrenches in body frame B, over `WRENCH_UNIT`; not zero.
        start : ndarray, shape (6,)
            Body wrench in B at t = 0 [N, N·m].
        cap : float, optional
            Cap on the utilisation; the question's by default.

        Returns
        -------
        Reached or None
            Outcome of the program and t, shape (n,). None if no t is feasible.

        Raises
        ------
        InvalidInputError
            If ``goal`` or ``columns`` is zero.
        SolverError
            If the program is not solved.
        UnsupportedError
            If t is unbounded.
        """
        # after the body wrench come the wrenches of hands that are given, which stay
        of_hands = self.data.wrench[6:]
        data = self.data.turned(np.concatenate([start / WRENCH_UNIT, of_hands]))
        return _solved(data, goal, columns, self.cap if cap is None else cap)

    def accelerated(self, goal: Array, ways: Array) -> Reached | None:
        """Find the feasible acceleration of the body that is farthest along a goal.

        Maximises goal · t over accelerations ``ways @ t``. Requires ``motion`` and ``at_rest``.

        Parameters
        ----------
        goal : ndarray, shape (n,)
            Direction in the space of t; not zero.
        ways : ndarray, shape (k, n)
            Directions of acceleration, as columns of the k components of `Motion`, in frame W.

        Returns
        -------
        Reached or None
            Outcome of the program and t, shape (n,) [m/s², rad/s²]. None if no t is feasible.

        Raises
        ------
        SolverError
            If the program is not solved.
        UnsupportedError
            If t is unbounded.
        """
        assert self.motion is not None
        assert self.at_rest is not None
        data, cap = self.at_rest
        columns = self.motion.wrench @ ways / WRENCH_UNIT[:, None]
        return _solved(data, goal, columns, cap, [each @ ways for each in self.motion.torques])

    def wrench(self, found: Reached) -> Array:
        """Return the body wrench that a solved program's loads exert, in B, shape (6,) [N, N·m]."""
        return np.asarray(programs.body_wrench(self.data, found.outcome.loads)[:6] * WRENCH_UNIT)

    def limiting(self, outcome: Outcome) -> LimitName | None:
        """Return the limit with the largest dual value (multiplier) in a solved program.

        Multipliers of all rows of a limit are added.

        Parameters
        ----------
        outcome : Outcome

        Returns
        -------
        LimitName or None
            None if no limit binds.
        """
        worth: dict[LimitName, float] = {}
        for names, duals in zip(self._names, outcome.limit_duals, strict=True):
            for name, multiplier in zip(names, duals, strict=True):
                worth[name] = worth.get(name, 0.0) + float(multiplier)
        most = max(
            worth, key=lambda name: round(worth[name], TOLERANCES.ranking_digits), default=None
        )
        return most if most is not None and worth[most] > TOLERANCES.binding_multiplier else None

    def linearisation_error(self, ends: Sequence[End]) -> float:
        """Return the largest linearisation error of floating hands' wrenches at some end points.

        Parameters
        ----------
        ends : sequence of End

        Returns
        -------
        float
            Largest component of the difference between the linearised and the exact wrench of a
            hand [N], moments over 0.1 m. Zero where no wrist floats.

        Raises
        ------
        DeadlineError
            If the deadline has expired.
        """
        worst = 0.0
        for end in () if self.exact else ends:
            deadline.check(MISSING_RESULT)
            there = self._hands.sets(replace(self._point, loads=end.loads)).spaces
            off = disagreements(self._hands, self._spaces, there, end.loads)
            worst = max([worst, *(each for each in off if np.isfinite(each))])
        return worst


def _solved(
    data: StanceData, goal: Array, columns: Array, cap: float, K: Sequence[Array] | None = None
) -> Reached | None:
    """Solve `program.Reach`, and check its answer; None if nothing is within the cap.

    Raises
    ------
    SolverError
        If there is no answer that passes the checks; an `UnsupportedError` if it has no bound.
    """
    deadline.check(MISSING_RESULT)
    unit = size_of(columns)
    B = np.vstack([columns / unit, np.zeros((len(data.wrench) - 6, columns.shape[1]))])
    K = None if K is None else [torque / unit for torque in K]
    found = programs.reach(data, goal / size_of(goal), B, cap, K)
    if not found.outcome.solved:
        if found.outcome.status not in programs.INFEASIBLE_STATUSES:
            raise _unsolved(found.outcome)
        return None
    error = _error(data, found, B, cap, K)
    if error > (most := CAP_SLACK * max(1.0, float(np.abs(found.t).max()))):
        raise SolverError(
            f"body space: the solver's answer violates the balance or a limit by {error:.2g} of "
            f"its scale; at most {most:.2g} is accepted"
        )
    return found._replace(t=found.t / unit)


def size_of(direction: Array) -> float:
    """Return the largest absolute component of a direction.

    Raises
    ------
    InvalidInputError
        If the direction is zero.
    """
    size = float(np.abs(direction).max(initial=0.0))
    if not size > 0.0:
        raise InvalidInputError("a direction that is not zero is needed", field="direction")
    return size


def _where_planned(hands: HandSets, planned: Plan) -> LinearisationPoint:
    """Return the point of a plan's wrists; without hands in the plan, rest."""
    if planned.hands is None:
        return hands.at_rest()
    loads = list(hands.at_rest().loads)
    for i, hand in enumerate(planned.hands):
        if hand.wrist is not None:
            driven = [hand.tensions] if hand.wrist.driven else []
            loads[i] = np.concatenate([*driven, hand.wrist.twist])
    return LinearisationPoint(tuple(loads))


def _with_idle(data: StanceData, question: Question, where: Posture | None) -> StanceData:
    """Return the hands; with the first, rows of limbs without one."""
    first, idle = data.hands[0], []
    for loads in () if where is None else where.idle(question.stance).values():
        joints = loads.driven
        idle += [joints.gravity / joints.limits, -joints.gravity / joints.limits]
    l0 = np.concatenate([first.l0, *idle])
    L = np.pad(first.L, ((0, len(l0) - len(first.l0)), (0, 0)))
    return StanceData.of((first._replace(L=L, l0=l0), *data.hands[1:]), data.wrench)


def _motion(question: Question, where: Posture | None, point: LinearisationPoint) -> Motion | None:
    """Return how acceleration enters a question; None if its body wrench is given.

    Angular acceleration is known only at known joints, without a centre of mass that is given.
    """
    if question.body_wrench is not None:
        return None
    # components: three linear, and three angular where they are known
    count = 6 if where is not None and question.load.com is None else 3
    found = []
    for x, y, z, *turning in np.vstack([np.zeros(6), np.eye(6)[:count]]).tolist():
        load = structs.replace(
            question.load, acceleration=(x, y, z), angular_acceleration=(*turning,)
        )
        moving = replace(question, load=load)
        there = None if where is None else posture_at(moving, where.angles)
        wrench = moving.needed_wrench(None if there is None else there.weights)
        _, hands = assemble(moving, there, wrench)
        found.append(_with_idle(hands.sets(point).data, moving, there))
    rest, *others = found
    return Motion(
        rest,
        np.column_stack([(data.wrench - rest.wrench)[:6] * WRENCH_UNIT for data in others]),
        tuple(
            np.column_stack([data.hands[i].l0 - at_rest.l0 for data in others])
            for i, at_rest in enumerate(rest.hands)
        ),
    )


def _error(
    data: StanceData, found: Reached, B: Array, cap: float, K: Sequence[Array] | None
) -> float:
    """Return by how much an answer misses the balance, or breaks a row, scaled."""
    loads, t = found.outcome.loads, found.t
    missing = float(np.abs(programs.body_wrench(data, loads) - data.wrench - B @ t).max())
    if K is not None:
        hands = tuple(
            hand._replace(l0=hand.l0 + torque @ t)
            for hand, torque in zip(data.hands, K, strict=True)
        )
        data = StanceData.of(hands, data.wrench)
    return max(missing, programs.beyond(data, loads, cap))


def _unsolved(outcome: Outcome) -> CruxError:
    deadline.check(MISSING_RESULT)
    if outcome.status in ("unbounded", "unbounded_inaccurate"):
        return UnsupportedError(
            "the body space is unbounded: wrench spaces of compliant and floating wrists are "
            "linearised about this body wrench, too far from a feasible one; give one closer to "
            "feasible"
        )
    return SolverError(f"body space: the solver found no solution ({outcome.status})")
