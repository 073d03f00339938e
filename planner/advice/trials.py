"""Plan and verify candidate changes of a question, within a budget of plans."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, NamedTuple, Protocol

import numpy as np

from hand_models.base import Array, InvalidInputError
from planner import deadline, programs
from planner.advice.changes import SETTINGS, Change, changed
from planner.explanation import LimitUse, scene_findings
from planner.prepare import PreparedStance, prepare_stance, settle_each
from planner.programs import CAP_SLACK, WRENCH_UNIT, Outcome, StanceData
from planner.question import Objective, OwnObjective, Question
from planner.result import LoadFactor
from planner.scene import body_clearance, scene_of

__all__ = [
    "Attempt",
    "StanceTrial",
    "Trials",
    "Tried",
    "direction",
]


class StanceTrial(NamedTuple):
    """Result of planning a candidate stance.

    Attributes
    ----------
    prepared : PreparedStance
        The stance, with its hands settled and its joints found.
    data : StanceData
        Scaled rows of all hands for the programs; those of floating hands are linearised about the
        plan.
    outcome : Outcome
        Outcome of the program that minimises the utilisation.
    utilisation : float
        Utilisation of the verified plan; infinite without one.
    load_factor : callable
        Computes the `LoadFactor`: the largest multiple of the body wrench that can be held at
        utilisation 1.
    """

    prepared: PreparedStance
    data: StanceData
    outcome: Outcome
    utilisation: float
    load_factor: Callable[[], LoadFactor]


class Attempt(Protocol):
    """Callable that plans a candidate stance; implemented by `planner.solving.try_stance`."""

    def __call__(
        self,
        prepared: PreparedStance,
        idle: Sequence[LimitUse] | None = None,
        near: Any | None = None,
    ) -> StanceTrial:
        """Plan and verify a stance.

        Parameters
        ----------
        prepared : PreparedStance
        idle : sequence of LimitUse, optional
            Use of joint torque by limbs without a hand, where it is known already.
        near : object, optional
            Solution of a similar stance, from which the search starts.

        Returns
        -------
        StanceTrial
            Plan; its utilisation is infinite if the stance has none.
        """


class Tried(NamedTuple):
    """A change of a question, and the plan of the changed stance.

    Attributes
    ----------
    change : Change
        Proposed change of the unchanged question.
    question : Question
        The changed question.
    trial : StanceTrial
        Plan of the changed question's stance.
    """

    change: Change
    question: Question
    trial: StanceTrial

    @property
    def utilisation(self) -> float:
        """Utilisation of the verified plan; infinite without one."""
        return self.trial.utilisation


class Trials:
    """Budget of plans, with all changes that were planned so far.

    All methods that plan raise `DeadlineError` once the deadline has expired.

    Parameters
    ----------
    question : Question
        For the least utilisation, without extras: as `Question.bare` returns it.
    attempt : callable
        Plans a stance; see `Attempt`.
    plans : int, optional
        Number of plans that may be made, with that of the unchanged stance.

    Attributes
    ----------
    question : Question
        The unchanged question.
    base : StanceTrial
        Plan of the unchanged question.
    left : int
        Number of plans that may still be made.
    found : list of Tried
        All changes whose stance has a plan, feasible or overloaded.

    Raises
    ------
    DeadlineError
        If the deadline has expired before the unchanged stance is planned.
    InvalidInputError
        If the question is invalid.
    """

    def __init__(self, question: Question, attempt: Attempt, plans: int = SETTINGS.plans) -> None:
        self.left = plans
        self.found: list[Tried] = []
        self.question, self._attempt = question, attempt
        self.base = self._try(prepare_stance(self.question))
        self._odd = _odd(self.base.prepared)

    def holds(self, utilisation: float) -> bool:
        """Return whether a utilisation is feasible: within the cap that the question sets."""
        return utilisation <= self.question.limits.utilisation + CAP_SLACK

    @property
    def helped(self) -> bool:
        """True if some change found is feasible, not counting changes of mass or strength."""
        return any(
            self.holds(each.utilisation)
            for each in self.found
            if each.change.kind not in SETTINGS.kinds_of_other_task
        )

    def of(self, candidates: Iterable[Change]) -> list[Tried]:
        """Plan several changes, in order, until no plan is left in the budget.

        Parameters
        ----------
        candidates : iterable of Change
            Changes to try, each alone.

        Returns
        -------
        list of Tried
            The changes whose stance has a plan, feasible or overloaded.
        """
        asked = self._asked(list(candidates)[: max(self.left, 0)])
        self._settle([question for _, question in asked])
        before = len(self.found)
        for change, question in asked:
            self._tried(change, question)
        return self.found[before:]

    def one(self, change: Change) -> StanceTrial | None:
        """Plan one change, whether or not the budget has plans left.

        Returns
        -------
        StanceTrial or None
            Plan of the change; its utilisation is infinite if there is none. None if the change is
            not `possible`.
        """
        for each, question in self._asked([change]):
            return self._tried(each, question)
        return None

    def possible(self, change: Change) -> bool:
        """Return whether a change gives a valid stance, without planning the stance.

        A change is not possible, either, if it causes or worsens a finding, such as a hand out of
        reach or a body in rock.
        """
        return any(self._prepared(question) for _, question in self._asked([change]))

    def _tried(self, change: Change, question: Question) -> StanceTrial | None:
        prepared = self._prepared(question)
        if prepared is None:
            return None
        try:
            trial = self._try(prepared)
        except InvalidInputError:
            return None
        if math.isfinite(trial.utilisation):
            self.found.append(Tried(change, question, trial))
        return trial

    def _prepared(self, question: Question) -> PreparedStance | None:
        """Return a question's stance; None if it cannot be, or would be odder than today's."""
        try:
            prepared = prepare_stance(question)
        except InvalidInputError:
            return None
        worse = any(
            size > self._odd.get(kind, 0.0) + SETTINGS.worse_tolerance
            for kind, size in _odd(prepared).items()
        )
        return None if worse else prepared

    def turned(self, wrench: Array) -> StanceTrial:
        """Plan the unchanged hands for another body wrench.

        Parameters
        ----------
        wrench : ndarray, shape (6,)
            Body wrench in body frame B [N, N·m].
        """
        return self._try(self.base.prepared.turned(wrench))

    def again(self, question: Question, objective: Objective | OwnObjective) -> StanceTrial:
        """Plan a question for another objective.

        Parameters
        ----------
        question : Question
            For example the changed question of a `Tried`.
        objective : str or OwnObjective
            Replaces the question's objective.

        Returns
        -------
        StanceTrial
            Plan; its utilisation is infinite if the stance has none.
        """
        return self._try(prepare_stance(replace(question, objective=objective)))

    def _asked(self, candidates: Sequence[Change]) -> list[tuple[Change, Question]]:
        found = []
        for change in candidates:
            with suppress(InvalidInputError):
                found.append((change, changed(self.question, change.changes)))
        return found

    def _settle(self, questions: Sequence[Question]) -> None:
        """Close all hands of some questions at once, which are found closed from then on."""
        hands = [hand for question in questions for hand in question.stance.hands]
        if hands:
            settle_each(self.question.stance.robot.hand, hands)

    def _try(self, prepared: PreparedStance) -> StanceTrial:
        deadline.check(SETTINGS.late)
        self.left -= 1
        trial = self._attempt(prepared)
        deadline.check(SETTINGS.late)
        return trial


def direction(trial: StanceTrial) -> Array | None:
    """Return the direction along which a stance's hands fall shortest of the body wrench.

    If the least utilisation was found: the gradient of that utilisation with respect to the body
    wrench, from the multipliers of the balance. Otherwise the part of the body wrench that the
    hands cannot exert, each component divided by the square of its `WRENCH_UNIT`.

    Parameters
    ----------
    trial : StanceTrial
        Plan of the stance, or the failed attempt at one.

    Returns
    -------
    ndarray, shape (6,), or None
        Direction of any length, in body frame B [1/N, 1/(N·m)]. None if no program was solved.
    """
    outcome, data = trial.outcome, trial.data
    if outcome.solved and outcome.balance_dual is not None:
        return np.asarray(-outcome.balance_dual[:6] / WRENCH_UNIT)
    nearest = programs.nearest(data)
    if not nearest.solved:
        return None
    return np.asarray((data.wrench - programs.body_wrench(data, nearest.loads))[:6] / WRENCH_UNIT)


def _odd(prepared: PreparedStance) -> dict[str, float]:
    """Return how much of each kind is odd about a stance, and how deep its body is in rock [m]."""
    nearest = body_clearance(scene_of(prepared.question.stance, prepared.batch.hands))
    found = {} if nearest is None else {"clearance": max(-nearest.distance, 0.0)}
    for each in scene_findings(prepared):
        found[each.kind] = max(abs(each.value), found.get(each.kind, 0.0))
    return found
