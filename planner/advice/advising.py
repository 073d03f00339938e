"""Suggest changes that would make a stance feasible: single ones, or several if none does."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from planner import deadline
from planner.advice.body import BodySearch, can_move
from planner.advice.changes import SETTINGS, Change
from planner.advice.combinations import CombinationSearch
from planner.advice.hands import closings, grasps, lettings, placed, turn_motions, way_motions
from planner.advice.new_holds import try_new_holds
from planner.advice.strength import lighter, stronger
from planner.advice.trials import Attempt, StanceTrial, Trials, Tried
from planner.deadline import DeadlineError, late_sentence
from planner.programs import CAP_SLACK
from planner.question import Question
from planner.result import Advice, Plan, Time

__all__ = ["add_advice", "advise"]


def advise(
    question: Question, attempt: Attempt, plans: int = SETTINGS.plans
) -> tuple[tuple[Advice, ...], bool]:
    """Return changes that would make a question's stance feasible, or lower its utilisation.

    Parameters
    ----------
    question : Question
        Stance, load, limits and objective.
    attempt : callable
        Plans a candidate stance; see `planner.advice.trials.Attempt`.
    plans : int, optional
        Largest number of plans in all.

    Returns
    -------
    advice : tuple of Advice
        Ten at most, the best first, each with a lower utilisation than the stance has.
    whole : bool
        Whether all changes were tried before the deadline.

    Raises
    ------
    InvalidInputError
        If the question is invalid.
    """
    # changes that are returned are planned again for least effort, where that is the objective
    plain = question.bare()
    again = question.objective != plain.objective
    most = 10  # advices that are returned
    try:
        trials = Trials(plain, attempt, plans - most - 1 if again else plans)
    except DeadlineError:
        return (), False
    whole, advices = True, []
    try:
        _try_all(trials)
    except DeadlineError:
        whole = False
    try:
        known = trials.again(trials.question, question.objective) if again else trials.base
        for tried in _ranked(trials)[:most]:
            trial = trials.again(tried.question, question.objective) if again else tried.trial
            # what costs least effort may use more than it has to, or have no plan that passes
            if trial.utilisation < known.utilisation:
                advices.append(_advice(trials, tried.change, trial))
    except DeadlineError:
        whole = False
    return tuple(advices), whole


def _try_all(trials: Trials) -> None:
    """Try single changes; a lighter body and stronger holds; then combinations if none holds."""
    base, prepared = trials.base, trials.base.prepared
    order = _order(trials)
    near = base.utilisation <= 2.5  # small changes of every hand may do
    trials.of(lettings(prepared.question))
    if can_move(prepared):
        body = BodySearch(trials)
        body.run()
        trials.of(body.changes())
        trials.of(body.tilts())
    trials.of(grasps(prepared, order if near else order[:2]))
    trials.of(closings(prepared))
    for i in order[: 2 if near else 1]:
        trials.of(placed(prepared, i, (*turn_motions(), *way_motions())))
    try_new_holds(trials)
    if trials.holds(base.utilisation):
        return
    lighter(trials, base.load_factor().factor, min(5, trials.left))
    # fewer plans where combinations are tried, too
    stronger(trials, order, min(14 if trials.helped else 5, trials.left))
    if not trials.helped:
        CombinationSearch(trials).run()


def _order(trials: Trials) -> list[int]:
    """Return the hands' indices, those first whose limits weigh most."""
    duals, limbs = trials.base.outcome.limit_duals, trials.base.prepared.limbs
    weights = [-round(float(np.sum(each)), 6) for each in duals] or [0.0] * len(limbs)
    return sorted(range(len(limbs)), key=lambda i: (weights[i], limbs[i]))


def _ranked(trials: Trials) -> list[Tried]:
    """Return changes that help: first what holds, by its size; then by gain for the size."""
    base = trials.base.utilisation
    holds = trials.holds(base)

    def rank(tried: Tried) -> tuple[bool, float]:
        gain = 1.0 / max(tried.utilisation, CAP_SLACK) - 1.0 / max(base, CAP_SLACK)
        does = not holds and trials.holds(tried.utilisation)
        return not does, tried.change.size if does else -gain / max(tried.change.size, CAP_SLACK)

    def worthwhile(tried: Tried) -> bool:
        # on its way to one that holds the search tries others
        found = not trials.helped or trials.holds(tried.utilisation)
        # a decrease by 1 % at least; beyond 5 what does not make it hold is no help
        enough = tried.utilisation < min((1.0 - 0.01) * base, 5.0)
        # kinds of several changes together
        return enough and (found or tried.change.kind not in ("pair", "combination"))

    found, seen = [], set()
    for tried in sorted(filter(worthwhile, trials.found), key=rank):
        change = tried.change
        alike = (
            change.kind,
            change.limbs,
            round(tried.utilisation, 3) if change.kind == "body" else None,
        )
        if alike not in seen:
            seen.add(alike)
            found.append(tried)
    return found


def _advice(trials: Trials, change: Change, trial: StanceTrial) -> Advice:
    """Return a change and its trial as an advice."""
    holds, factor = trials.holds(trial.utilisation), trial.load_factor()
    return Advice(
        kind=change.kind,
        limbs=list(change.limbs),
        sentence=change.words,
        changes=dict(change.changes),
        size=change.size,
        status="optimal" if holds else "overloaded",
        utilisation=trial.utilisation,
        load_factor=factor.factor,
        load_factor_status=factor.status,
        holds=holds,
    )


def add_advice(question: Question, answer: Plan, attempt: Attempt) -> Plan:
    """Return a plan with advice added, or with the reason why there is none.

    Parameters
    ----------
    question : Question
    answer : Plan
        The question's plan.
    attempt : callable
        As of `advise`.
    """
    start = time.perf_counter()
    if odd := [each.field for each in answer.findings if each.doubts_number]:
        warning = f"no search for advice while a number is in doubt: {', '.join(odd)}"
        return replace(answer, advice=(), warnings=(*answer.warnings, warning))
    found, whole = advise(question, attempt)
    seconds, unfinished, warnings = deadline.seconds(), answer.unfinished, answer.warnings
    if not whole and seconds is not None:
        unfinished = (*unfinished, "advice")
        warnings = (*warnings, late_sentence(seconds, ["advice"]))
    total = answer.time.total + time.perf_counter() - start
    return replace(
        answer,
        advice=found,
        unfinished=unfinished,
        warnings=warnings,
        time=Time(answer.time.model, answer.time.solve, total),
    )
