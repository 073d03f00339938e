"""Changes tried: each is planned and verified as its question would be, within a count of plans."""

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
    """Result of a stance that was tried.

    Attributes
    ----------
    prepared : PreparedStance
    data : StanceData
        Data of its hands, about its plan.
    outcome : Outcome
        Outcome of the program of least utilisation.
    utilisation : float
        Utilisation of the verified plan; infinite without one.
    load_factor : callable
        Finds how many times the body wrench could be held.
    """

    prepared: PreparedStance
    data: StanceData
    outcome: Outcome
    utilisation: float
    load_factor: Callable[[], LoadFactor]


class Attempt(Protocol):
    """Plans a stance that is only tried; see `planner.solving.try_stance`."""

    def __call__(
        self,
        prepared: PreparedStance,
        idle: Sequence[LimitUse] | None = None,
        near: Any | None = None,
    ) -> StanceTrial:
        """Return the result of a stance."""


class Tried(NamedTuple):
    """Change of a question, with the result of its stance."""

    change: Change
    question: Question
    trial: StanceTrial

    @property
    def utilisation(self) -> float:
        """Utilisation of its plan; infinite without a plan."""
        return self.trial.utilisation


class Trials:
    """A count of plans, and the changes that were tried with them.

    Parameters
    ----------
    question : Question
        As it is tried: `Question.bare`.
    attempt : callable
        Plans a stance.
    plans : int, optional
        How many may be made.

    Attributes
    ----------
    question : Question
    base : StanceTrial
        The question as it is.
    left : int
        Plans that may still be made.
    found : list of Tried
        All changes with which there is a plan.

    Raises
    ------
    DeadlineError
        By all that plans, if the time is over.
    """

    def __init__(self, question: Question, attempt: Attempt, plans: int = SETTINGS.plans) -> None:
        self.left = plans
        self.found: list[Tried] = []
        self.question, self._attempt = question, attempt
        self.base = self._try(prepare_stance(self.question))
        self._odd = _odd(self.base.prepared)

    def holds(self, utilisation: float) -> bool:
        """Return whether a utilisation is within the question's cap."""
        return utilisation <= self.question.limits.utilisation + CAP_SLACK

    @property
    def helped(self) -> bool:
        """True if some change makes it hold, not counting lighter bodies and stronger holds."""
        return any(
            self.holds(each.utilisation)
            for each in self.found
            if each.change.kind not in SETTINGS.kinds_of_other_task
        )

    def of(self, candidates: Iterable[Change]) -> list[Tried]:
        """Try changes as far as plans are left; return those with which there is a plan."""
        asked = self._asked(list(candidates)[: max(self.left, 0)])
        self._settle([question for _, question in asked])
        before = len(self.found)
        for change, question in asked:
            self._tried(change, question)
        return self.found[before:]

    def one(self, change: Change) -> StanceTrial | None:
        """Try a change; return what came of it, with a plan or without; None if it cannot be."""
        for each, question in self._asked([change]):
            return self._tried(each, question)
        return None

    def possible(self, change: Change) -> bool:
        """Return whether a change gives a stance that can be planned; no plan is made."""
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
        """Try the hands as they are for another body wrench, shape (6,) [N, N·m], in B."""
        return self._try(self.base.prepared.turned(wrench))

    def again(self, question: Question, objective: Objective | OwnObjective) -> StanceTrial:
        """Plan what was tried for another objective."""
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
    """Return the body wrenches' direction in which a stance lacks most, shape (6,), if known."""
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
