"""The stance of a stream: prepared once, then solved for one body wrench after the other.

Loads y of all hands are one array (hands, m): row h has the loads of hand h, padded with zeros to
m, the largest number of loads of a hand. So recovery and checks are products of stacked matrices.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hand_models.base import Array
from hand_models.hand import FINGERS
from hand_models.wrench_spaces import WrenchSpace
from planner import programs
from planner.programs import (
    LOAD_UNIT,
    WRENCH_UNIT,
    Outcome,
    is_least,
    least_bound,
    tension_trade,
)
from planner.question import Question
from planner.result import LoadRecovery, Plan, PlanArrays
from planner.solving import KnownStance, LeastUtilisation, least_utilisation
from planner.streaming.affine_bounds import AffineBound, affine_bound
from planner.verification import Check, LoadsCheck

__all__ = ["LoadEffects", "Solved", "StreamStance", "SupportBound"]


class Solved(NamedTuple):
    """A plan of one body wrench, from the solver.

    Attributes
    ----------
    loads : ndarray, shape (hands, m)
        Loads y of each hand, padded with zeros [N].
    outcome : Outcome
        Outcome of the program of least utilisation.
    bound : float
        Lower bound of the least utilisation.
    start : LeastUtilisation or None
        Result with which the search for the plan of a wrench near by begins; None without one.
    """

    loads: Array
    outcome: Outcome
    bound: float
    start: LeastUtilisation | None = None


class LoadEffects(NamedTuple):
    """Wrenches and utilisation that a stance's loads give.

    Attributes
    ----------
    wrenches : ndarray, shape (hands, 6)
        Wrench of each hand on the rock, in H [N, N·m].
    utilisation : float
        Largest utilisation of the hands' limits.
    """

    wrenches: Array
    utilisation: float


class SupportBound(NamedTuple):
    """Proof that no body wrench w with direction · w > most has a plan.

    Attributes
    ----------
    direction : ndarray, shape (6,)
        Direction in B.
    most : float
        Upper bound of direction · w over all feasible body wrenches w.
    """

    direction: Array
    most: float


class StreamStance:
    """A stance whose hands all have fixed wrists, prepared for many body wrenches.

    Parameters
    ----------
    question : Question
        The stance and its limits, as of `WrenchStream`. Its body wrench, or its load, is only the
        first.

    Attributes
    ----------
    known : KnownStance
        Answers with a complete plan of a body wrench, or with the proof of infeasibility.
    first : ndarray, shape (6,)
        Body wrench of the question, in B [N, N·m].
    cap : float
        Cap on the utilisation.
    limbs : tuple of str
        Limbs of the hands, in the order of all arrays.
    columns : tuple of tuple of str
        Names of each hand's loads.
    shape : tuple of int
        Number of hands, and largest number of loads of a hand.
    check : LoadsCheck
        Check that every plan must pass.
    drive : TendonDrive
        Motor and winch of a tendon.
    winches : ndarray, shape (2, hands, 4)
        Winch angles at zero tension [rad], and their change per newton of tension [rad/N].

    Raises
    ------
    InvalidInputError
        If the question is not valid.
    """

    def __init__(self, question: Question) -> None:
        known = KnownStance(question)
        self.known, prepared = known, known.prepared
        self.first = prepared.wrench
        self.cap = question.limits.utilisation
        self.limbs = tuple(hand.limb for hand in question.stance.hands)
        spaces, self._data = prepared.at_rest
        self.columns = tuple(space.columns for space in spaces)
        self.shape = len(spaces), max(map(len, self.columns))
        reader = LoadRecovery(prepared.batch, spaces)
        # any wrench, not only that of the load
        check = Check(prepared.turned(self.first).question, prepared.batch, prepared.where)
        self.check = LoadsCheck(check, reader, self.columns)
        self.drive = prepared.batch.hands[0].hand.drive
        self.winches = _winches(reader, spaces)
        self._closing = prepared.batch.closing_tensions
        self._least = reader.least
        self._rows, self._rest = reader.rows / LOAD_UNIT, reader.at_rest

    def read(self, loads: Array) -> LoadEffects:
        """Compute the hands' wrenches and the largest utilisation from loads.

        Parameters
        ----------
        loads : ndarray, shape (hands, m)
            Loads y of each hand, padded with zeros [N].
        """
        rows = (self._rows @ loads[:, :, None])[:, :, 0]
        rows += self._rest
        return LoadEffects(rows[:, :6], float(np.maximum.reduce(rows[:, 6:], axis=None)))

    def solve(self, body_wrench: Array, near: Solved | None = None) -> Solved | None:
        """Solve for the plan of a body wrench: a little above the least utilisation, less tension.

        Parameters
        ----------
        body_wrench : ndarray, shape (6,)
            Wrench that the rock must exert on the robot, in B [N, N·m].
        near : Solved, optional
            Plan of a body wrench near by: no solver is called if nearly the same rows are active.

        Returns
        -------
        Solved or None
            None if the least utilisation is not proven.
        """
        data = self._data.turned(self._scaled(body_wrench))
        start = None if near is None else near.start
        found = least_utilisation(data, self.cap, self._closing, start)
        outcome, bound, meant = found.outcome, found.bound, found.meant
        if not found.proven:
            meant = None
            outcome = programs.margin(data)
            if not outcome.solved:
                return None
            bound = least_bound(data, outcome)
            if not is_least(outcome.value, bound):
                return None
        if meant is None:
            meant = programs.less_tension(data, tension_trade(outcome.value, self.cap))
        loads = self._stacked((meant if meant.solved else outcome).loads)
        return Solved(loads, outcome, bound, found if found.proven else None)

    def overload(self, body_wrench: Array) -> str | None:
        """Return which limit the plan of a body wrench exceeds most; None if it exceeds none.

        Parameters
        ----------
        body_wrench : ndarray, shape (6,)
            Wrench that the rock must exert on the robot, in B [N, N·m].
        """
        return self.known.answer(body_wrench, time.perf_counter()).reason

    def affine_bound(self, body_wrench: Array, solved: Solved) -> AffineBound | None:
        """Return the lower bound of the utilisation that a solved plan proves for every wrench.

        Parameters
        ----------
        body_wrench : ndarray, shape (6,)
            Body wrench of the plan, in B [N, N·m].
        solved : Solved

        Returns
        -------
        AffineBound or None
            None if the plan's multipliers prove no bound.
        """
        return affine_bound(self._data.turned(self._scaled(body_wrench)), solved.outcome)

    def proof(self, plan: Plan) -> SupportBound | None:
        """Return the body wrenches that an infeasible plan's certificate excludes.

        None if the plan has no certificate, or one that depends on the cap on the utilisation.
        """
        found = plan.certificate
        if found is None or found.utilisation is not None:
            return None
        # the part of wrenches that hands are given stays as it is
        given = found.needed - float(found.direction @ plan.body_wrench)
        return SupportBound(found.direction, found.supremum - given)

    def loads_of(self, plan: Plan) -> Array:
        """Return the loads y of a plan, padded with zeros, shape (hands, m) [N]."""
        return self.check.loads_of(PlanArrays.of(plan.hands or ()))

    def _scaled(self, body_wrench: Array) -> Array:
        whole = self._data.wrench.copy()
        whole[:6] = body_wrench / WRENCH_UNIT
        return whole

    def _stacked(self, loads: Sequence[Array]) -> Array:
        """Return the hands' loads as one array; what may not be negative by rounding is zero."""
        whole = np.zeros(self.shape)
        for row, y in zip(whole, loads, strict=True):
            row[: len(y)] = y
        return np.maximum(whole, self._least)


def _winches(reader: LoadRecovery, spaces: Sequence[WrenchSpace]) -> Array:
    """Return the winches' angles without tension and per newton, which no other load changes."""
    tendons = len(FINGERS)
    loads = [np.zeros(len(space.columns)) for space in spaces]
    at_zero = reader.read(loads)[0].drives[-1]
    for y in loads:
        y[:tendons] = 1.0
    per_newton = reader.read(loads)[0].drives[-1] - at_zero
    return np.array([at_zero, per_newton]).reshape(2, -1, tendons)
