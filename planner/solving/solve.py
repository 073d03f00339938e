"""From a question to a verified plan: prepare, solve, recover the loads, verify, explain."""

from __future__ import annotations

import time
from functools import partial

from hand_models.base import Array, finite_vector
from planner import deadline
from planner.deadline import Budget, Overlap
from planner.floating import PROGRAMS
from planner.prepare import PreparedStance, checked_question, prepare_stance
from planner.question import Question, checked_body_wrench
from planner.result import Plan, Time
from planner.solving.explained import explained_plan
from planner.solving.load_factor import FoundFactor, find_load_factor
from planner.solving.prepared_checks import PreparedChecks, prepare_checks
from planner.solving.solution import solve_question
from planner.solving.unique_plan import LeastUtilisation
from planner.solving.why_not import beyond_all_loads, look_again

__all__ = ["KnownStance", "plan", "plan_on"]


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
        return plan_on(prepare_stance(question), start)[0]


def plan_on(
    prepared: PreparedStance,
    start: float,
    known: PreparedChecks | None = None,
    before: LeastUtilisation | None = None,
) -> tuple[Plan, LeastUtilisation | None]:
    """Answer a question of a prepared stance.

    Parameters
    ----------
    prepared : PreparedStance
    start : float
        When it began, on the clock of `time.perf_counter`.
    known : PreparedChecks, optional
        What reads and checks its plans; by default it is made beside the solver.
    before : LeastUtilisation, optional
        What came of the same hands at another wrench.

    Returns
    -------
    plan : Plan
    least : LeastUtilisation or None
        What it was found from, of fixed wrists.

    Raises
    ------
    DeadlineError
        If the deadline comes before anything is found that passes the checks.
    """
    question, modelled = prepared.question, time.perf_counter()
    deadline.check(f"the hands were closed on their holds, which took {modelled - start:.2g} s")
    checks, budget = Overlap(partial(prepare_checks, prepared), known), Budget(PROGRAMS)
    found, proof = solve_question(prepared, checks, budget, before=before), None
    if not found.passes or beyond_all_loads(prepared, found):
        if found.outcome.balance_dual is None:
            deadline.check("a plan was found")
        found, proof = look_again(prepared, checks, found, budget)
        if proof is None and not found.passes:
            deadline.check("a plan was found, or proven away")
    ready, factor = checks.result(), FoundFactor()
    if "load_factor" in question.want:
        factor = find_load_factor(prepared, found, ready.idle, budget)
    solved = time.perf_counter()
    times = Time(modelled - start, solved - modelled, 0.0)
    return explained_plan(prepared, ready, found, proof, factor, times, start), found.least


class KnownStance:
    """A stance on its holds, for a planner that asks about one body wrench after the other.

    Hands are settled, joints found and sets computed once; a query pays for the check of its plan
    and, unless the limits bind that bound in the query before, for its solver.

    Parameters
    ----------
    question : Question
        The stance, and what is asked of it; limits, objective and extras hold for every wrench.
        Its joints' torques stay those of its load.

    Raises
    ------
    InvalidInputError
        If the question cannot be understood; its ``field`` is relative to the question.
    """

    def __init__(self, question: Question) -> None:
        self.prepared = prepared = prepare_stance(question)
        self._checks: PreparedChecks | None = None
        self._before: LeastUtilisation | None = None
        # what joints bear changes with the wrench
        if prepared.where is None and question.stance.joints is None and not prepared.floating:
            self._checks = prepare_checks(prepared)

    def plan(self, body_wrench: Array) -> Plan:
        """Answer for another body wrench, as `planner.solving.plan` would.

        Parameters
        ----------
        body_wrench : ndarray, shape (6,)
            In B [N, N·m].

        Raises
        ------
        InvalidInputError
            If it is not six finite numbers, or absurdly large.
        """
        start = time.perf_counter()
        wrench = checked_body_wrench(finite_vector(body_wrench, 6, "body_wrench"), "body_wrench")
        with deadline.within(self.prepared.question.deadline, started=start):
            prepared = self.prepared.turned(wrench)
            answer, least = plan_on(prepared, start, self._checks, self._before)
        if least is not None and least.outcome.solved:
            self._before = least
        return answer
