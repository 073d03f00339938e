"""From a question to a verified plan: settle the hands, solve, read, check, explain."""

from __future__ import annotations

import time

from planner import deadline
from planner.question import Question
from planner.result import Plan, Time
from planner.solving.answer import Answer
from planner.solving.effort import settle_effort
from planner.solving.fixed import settle_fixed
from planner.solving.floating import settle_floating
from planner.solving.load_factor import find_load_factor
from planner.solving.prepared_stance import PreparedStance, checked_question, prepare_stance
from planner.solving.reading import read_plan
from planner.solving.why_not import look_again

__all__ = ["plan", "plan_on"]


def plan(question: Question) -> Plan:
    """Answer a question: the best plan, verified, or why there is none.

    Parameters
    ----------
    question : Question

    Returns
    -------
    Plan

    Raises
    ------
    InvalidInputError
        If the question cannot be understood; its ``field`` is relative to the question.
    DeadlineError
        If its deadline comes before anything is found that passes the checks.
    """
    start = time.perf_counter()
    with deadline.within(checked_question(question).deadline, started=start):
        return plan_on(prepare_stance(question), start)


def plan_on(prepared: PreparedStance, start: float) -> Plan:
    """Answer a question of a prepared stance.

    Parameters
    ----------
    prepared : PreparedStance
    start : float
        When it began, on the clock of `time.perf_counter`.

    Raises
    ------
    DeadlineError
        If the deadline comes before anything is found that passes the checks.
    """
    with deadline.within(prepared.question.deadline, started=start):
        modelled = time.perf_counter()
        deadline.check(f"the hands were closed on their holds, which took {modelled - start:.2g} s")
        answer = Answer(*prepared)
        _solve(answer)
        solved = time.perf_counter()
        return read_plan(answer, Time(modelled - start, solved - modelled, 0.0), start)


def _solve(answer: Answer) -> None:
    """Find the loads, or the certificate that there are none."""
    if answer.parts.floating:
        settle_floating(answer)
    else:
        settle_fixed(answer)
    settle_effort(answer)
    if not answer.outcome.solved or answer.wrong:
        if answer.outcome.balance_dual is None:
            deadline.check("a plan was found")
        look_again(answer)
    if answer.certificate is None and (not answer.outcome.solved or answer.wrong):
        deadline.check("a plan was found, or proven away")
    if "load_factor" in answer.question.want:
        find_load_factor(answer)
