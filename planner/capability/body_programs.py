"""The programs of a stance's body space: its hands, how far they reach, and what ends the way.

Everything that a plan counts is counted: joints, caps, hand wrenches that are given, and what limbs
without a hand bear of their own weight.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, CruxError, InvalidInputError, SolverError, UnsupportedError
from hand_models.wrench_spaces import SCALE
from planner import deadline, programs
from planner.capability.body_motion import Motion, motion_of
from planner.explanation import ALIKE, BINDING, joint_name, limit_name
from planner.prepare import (
    HandSets,
    LinearisationPoint,
    Posture,
    assemble,
    posture_at,
    widest_at_rest,
)
from planner.programs import JOINT_TORQUE, SLACK, WRENCH_UNIT, Outcome, Reached, StanceData
from planner.question import Question
from planner.result import LimitName, Plan
from planner.solving import plan

__all__ = ["BodyPrograms", "size_of"]

MISSING: Final = "it was known what the stance can hold"
"""What a deadline may come before."""


class BodyPrograms:
    """What a question's stance can hold, direction by direction.

    Parameters
    ----------
    question : Question

    Attributes
    ----------
    question : Question
        Without extras and deadline, and for the least utilisation.
    plan : Plan
        Its answer.
    data : StanceData
        Its hands; floating ones where the plan puts them.
    motion : Motion or None
        How the body's acceleration enters; None if the body wrench is given.
    exact : bool
        Whether no wrist floats.
    """

    def __init__(self, question: Question) -> None:
        self.question = replace(question, want=frozenset(), objective="max_margin", deadline=None)
        self.plan = plan(self.question)
        where = None if self.plan.joints is None else posture_at(question, self.plan.joints)
        _, hands = assemble(self.question, where, self.plan.body_wrench)
        self._hands = hands
        self._point = _where_planned(hands, self.plan)
        self.exact = not hands.floating
        spaces, data = hands.sets(self._point)
        limbs = [hand.limb for hand in question.stance.hands]
        names = [
            [(limit_name(limb, row), row.label[-1:]) for row in space.rows[: len(space.s)]]
            for limb, space in zip(limbs, spaces, strict=True)
        ]
        idle = _idle_rows(where, limbs)
        # no load changes these: they go with the first hand's
        names[0] += idle.names
        first = data.hands[0]
        first = first._replace(
            L=np.vstack([first.L, np.zeros((len(idle.names), first.L.shape[1]))]),
            l0=np.concatenate([first.l0, idle.utilisations]),
        )
        self.data = StanceData((first, *data.hands[1:]), data.wrench)
        self._names = [[name for name, _ in each] for each in names]
        self.motion = motion_of(question, where)
        self._torques = _torque_rows(names, self.motion, where)

    @property
    def cap(self) -> float:
        """The utilisation to go up to."""
        return self.question.limits.utilisation

    @cached_property
    def cap_at_needed(self) -> float | None:
        """The cap for ways from the wrench asked for; None if that is not held."""
        return self._cap_of(self.data)

    @cached_property
    def at_rest(self) -> tuple[StanceData, float] | None:
        """The hands while the body is at rest, and the cap; None if it cannot be held so."""
        assert self.motion is not None
        asked = self.motion.asked
        hands = tuple(
            hand._replace(l0=hand.l0 - torque @ asked)
            for hand, torque in zip(self.data.hands, self._torques, strict=True)
        )
        wrench = self.data.wrench.copy()
        wrench[:6] -= self.motion.wrench @ asked / WRENCH_UNIT
        data = StanceData(hands, wrench)
        cap = self._cap_of(data)
        return None if cap is None else (data, cap)

    def _cap_of(self, data: StanceData) -> float | None:
        """Return the utilisation to go up to, where a balance can be had within it."""
        outcome = programs.margin(data)
        if not outcome.solved:
            if outcome.status not in programs.PROVEN:
                raise _unsolved(outcome)
            return None
        # where the least utilisation is the cap itself, rounding must not empty the set
        within = outcome.value <= self.cap + SLACK
        return max(self.cap, outcome.value + SLACK) if within else None

    def reached(
        self, goal: Array, columns: Array, start: Array, cap: float | None = None
    ) -> Reached | None:
        """Return the farthest body wrench; None if there is none.

        Parameters
        ----------
        goal : ndarray, shape (n,)
            Of t.
        columns : ndarray, shape (6, n)
            The body wrenches are the start and `WRENCH_UNIT` times these columns times t.
        start : ndarray, shape (6,)
            [N, N·m]
        cap : float, optional
            The utilisation to go up to; the question's by default.
        """
        data = self.data.turned(np.concatenate([start / WRENCH_UNIT, self.data.wrench[6:]]))
        return _solved(data, goal, columns, self.cap if cap is None else cap)

    def accelerated(self, goal: Array, ways: Array) -> tuple[Reached | None, float]:
        """Return the farthest acceleration t / unit along columns (k, n) of W, and that unit."""
        assert self.motion is not None
        assert self.at_rest is not None
        data, cap = self.at_rest
        columns = self.motion.wrench @ ways / WRENCH_UNIT[:, None]
        unit = float(np.abs(columns).max())
        K = [torque @ ways / unit for torque in self._torques]
        return _solved(data, goal, columns / unit, cap, K), unit

    def wrench(self, found: Reached) -> Array:
        """Return the body wrench that a program's loads give, shape (6,) [N, N·m]."""
        return np.asarray(programs.body_wrench(self.data, found.outcome.loads)[:6] * WRENCH_UNIT)

    def limiting(self, outcome: Outcome) -> LimitName | None:
        """Return the limit with the largest multiplier, all rows of a name taken together."""
        worth: dict[LimitName, float] = {}
        for names, duals in zip(self._names, outcome.limit_duals, strict=True):
            for name, multiplier in zip(names, duals, strict=True):
                worth[name] = worth.get(name, 0.0) + float(multiplier)
        most = max(worth, key=lambda name: round(worth[name], ALIKE), default=None)
        return most if most is not None and worth[most] > BINDING else None

    def linearisation_error(self, ends: Sequence[Sequence[Array]]) -> float:
        """Return how far floating hands' sets are off at most with some loads [N].

        The largest disagreement of a hand's wrench with the exact model there: forces, and moments
        over 0.1 m. Zero where no wrist floats.
        """
        if self.exact:
            return 0.0
        spaces, worst = self._hands.sets(self._point).spaces, 0.0
        for loads in ends:
            deadline.check(MISSING)
            there = self._hands.sets(replace(self._point, loads=tuple(loads))).spaces
            for wrist, a, b, y in zip(self._hands.wrists, spaces, there, loads, strict=True):
                off = 0.0
                if wrist is not None:
                    off = float(np.abs((a.wrench(y) - b.wrench(y)) * SCALE).max())
                worst = max(worst, off) if np.isfinite(off) else worst
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
    deadline.check(MISSING)
    B = np.vstack([columns, np.zeros((len(data.wrench) - 6, columns.shape[1]))])
    found = programs.reach(data, goal / size_of(goal), B, cap, K)
    if not found.outcome.solved:
        if found.outcome.status not in programs.PROVEN:
            raise _unsolved(found.outcome)
        return None
    if _error(data, found, B, cap, K) > SLACK * max(1.0, float(np.abs(found.t).max())):
        raise SolverError("body space: the solver's answer does not pass the checks")
    return found


def size_of(direction: Array) -> float:
    """Return the largest component of a direction, which must not be zero."""
    size = float(np.abs(direction).max(initial=0.0))
    if not size > 0.0:
        raise InvalidInputError("a direction that is not zero is needed", field="direction")
    return size


def _where_planned(hands: HandSets, planned: Plan) -> LinearisationPoint:
    """Return where floating wrists are in a plan; without one, at rest as they can do most."""
    if planned.hands is None:
        palms = [None if wrist is None else widest_at_rest(wrist)[0] for wrist in hands.wrists]
        return hands.at_rest(palms)
    point = hands.at_rest(hands.idle)
    loads, palms = list(point.loads), list(point.palms)
    for i, hand in enumerate(planned.hands):
        if hand.wrist is not None:
            loads[i], palms[i] = hand.wrist.twist, hand.wrist.palm
    return LinearisationPoint(tuple(loads), tuple(palms))


class _Rows(NamedTuple):
    """Limit rows that no load changes: name and sign, and utilisation."""

    names: list[tuple[LimitName, str]]
    utilisations: list[float]


def _idle_rows(where: Posture | None, limbs: Sequence[str]) -> _Rows:
    """Return what the joints of limbs without a hand bear."""
    rows = _Rows([], [])
    for limb, joints in ({} if where is None else where.joints).items():
        if limb not in limbs:
            for name, torque, most in zip(joints.names, joints.gravity, joints.limits, strict=True):
                for sign, value in (("+", torque), ("-", -torque)):
                    rows.names.append((joint_name(limb, name), sign))
                    rows.utilisations.append(float(value / most))
    return rows


def _torque_rows(
    names: Sequence[Sequence[tuple[LimitName, str]]], motion: Motion | None, where: Posture | None
) -> list[Array]:
    """Return how each hand's limit rows change with acceleration, (nl, k) each."""
    if motion is None:
        return []
    limits = {
        joint_name(limb, joint): float(most)
        for limb, joints in ({} if where is None else where.joints).items()
        for joint, most in zip(joints.names, joints.limits, strict=True)
    }
    found = []
    for rows in names:
        K = np.zeros((len(rows), motion.wrench.shape[1]))
        for i, (name, sign) in enumerate(rows):
            if name.limit == JOINT_TORQUE:
                K[i] = (1.0 if sign == "+" else -1.0) * motion.torque[name] / limits[name]
        found.append(K)
    return found


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
        data = StanceData(hands, data.wrench)
    return max(missing, programs.beyond(data, loads, cap))


def _unsolved(outcome: Outcome) -> CruxError:
    deadline.check(MISSING)
    if outcome.status in programs.UNBOUNDED:
        return UnsupportedError(
            "what the hands hold has no bound some way: sets of floating wrists, taken about this "
            "body wrench, do not hold them everywhere; ask about one that can nearly be held"
        )
    return SolverError(f"body space: the solver gave no usable answer ({outcome.status})")
