"""Answer a question with a verified plan: prepare, solve, recover the numbers, verify, explain."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from hand_models.base import Array
from planner import deadline, programs
from planner.advice import StanceTrial, add_advice
from planner.deadline import Budget
from planner.execution import KeptMargins, kept_margins
from planner.explanation import LimitUse, certify
from planner.floating import SETTINGS
from planner.prepare import PreparedStance, checked_question, prepare_stance
from planner.programs import CAP_SLACK
from planner.question import Limits, Question
from planner.result import Finding, LoadFactor, Plan
from planner.solving.explained import explained_plan, reason_beyond, unexplained
from planner.solving.fixed_wrists import FixedSolution, fixed_solutions, nearest_solutions
from planner.solving.floating_wrists import (
    FloatingSolution,
    floating_solution,
    next_solution,
    wrench_is_given,
)
from planner.solving.objectives import objective_of
from planner.solving.solution import (
    Answer,
    Failed,
    Infeasible,
    Solution,
    Verified,
    load_factor_of,
)
from planner.solving.verified import Checks, beyond_all_loads, prepare_checks, recover, verify

__all__ = [
    "KnownStance",
    "StanceAnswer",
    "answer_on",
    "plan",
    "try_stance",
    "with_advice",
]


def plan(question: Question) -> Plan:
    """Answer a question: return the best plan, verified, or the reason why there is none.

    Parameters
    ----------
    question : Question
        Stance, load, limits and objective; advice is added if the question wants it.

    Returns
    -------
    Plan
        Plan with the status ``optimal``, ``overloaded``, ``infeasible`` or ``failed``.

    Raises
    ------
    InvalidInputError
        If the question is not valid; the error's field is relative to the question.
    DeadlineError
        If the deadline passes before a plan passes the checks or is proven infeasible.
    """
    start = time.perf_counter()
    with deadline.within(checked_question(question).deadline, started=start):
        answer = _with_margins(prepare_stance(question), question.limits, start).plan()
        return with_advice(question, answer) if "advice" in question.want else answer


class StanceAnswer(NamedTuple):
    """Answer to the question of a prepared stance, before its explanation.

    Attributes
    ----------
    prepared : PreparedStance
    checks : Checks
    answer : Answer
        Verified loads, a proof of infeasibility, or a failure.
    budget : Budget
        Number of programs that may still be solved.
    moments : tuple of (float, float)
        Times at which the answer was begun and prepared, on the clock of `time.perf_counter` [s].
    kept, free : KeptMargins and StanceAnswer, or None
        What of the margins the answer keeps, if it need not keep all; the answer without any.
    """

    prepared: PreparedStance
    checks: Checks
    answer: Answer
    budget: Budget
    moments: tuple[float, float]
    kept: KeptMargins | None = None
    free: StanceAnswer | None = None

    @property
    def optimal(self) -> bool:
        """True if there is a plan within the cap on the utilisation."""
        return self.answer.whole <= self.prepared.question.limits.utilisation + CAP_SLACK

    @property
    def reason(self) -> str | None:
        """Why there is no plan within the cap on the utilisation; None if there is one."""
        return reason_beyond(self.prepared, self.checks, self.answer)

    def plan(self) -> Plan:
        """Return the plan, with its explanation and the extras that the question wants."""
        prepared, checks, answer, budget, moments, kept, _ = self
        factor, free = LoadFactor(), self.free or self
        if "load_factor" in prepared.question.want:
            factor, solution = load_factor_of(
                free.prepared, free.answer, budget, overloaded=checks.overloaded
            )
            if free is self and solution is not answer.solution:
                better = _first_verified(prepared, checks, [solution])
                answer = better if better.utilisation < answer.utilisation else answer
        solved = *moments, time.perf_counter()
        return explained_plan(prepared, checks, answer, factor, try_stance, solved, kept)


def answer_on(
    prepared: PreparedStance,
    start: float,
    known: Checks | None = None,
    near: Solution | None = None,
    *,
    prove: bool = True,
) -> StanceAnswer:
    """Answer the question of a prepared stance.

    Parameters
    ----------
    prepared : PreparedStance
    start : float
        Time at which the answer was begun, on the clock of `time.perf_counter` [s].
    known : Checks, optional
        Recovery and checks of the stance's plans; prepared here by default.
    near : Solution, optional
        Solution for the same hands at another body wrench, as a warm start.
    prove : bool, optional
        False to leave out the proof where nothing has passed the checks, and the solver's own
        multipliers at utilisations far above one.

    Raises
    ------
    DeadlineError
        If the deadline passes before a plan passes the checks or is proven infeasible.
    """
    modelled, budget = time.perf_counter(), Budget(SETTINGS.programs)
    done = "knowing the limits" if known else "closing the hands on their holds"
    deadline.check_after(done, modelled - start)
    checks = prepare_checks(prepared) if known is None else known
    answer: Answer | None = _next_verified(prepared, checks, budget, near)
    if answer is None:
        answer = _first_verified(prepared, checks, _solutions(prepared, budget, near, twice=prove))
    answer = _second_look(prepared, checks, answer, budget, prove=prove)
    if isinstance(answer, Failed):
        deadline.check("a plan was found or proven infeasible")
    return StanceAnswer(prepared, checks, answer, budget, (start, modelled))


def _with_margins(prepared: PreparedStance, asked: Limits, start: float) -> StanceAnswer:
    """Answer with the margins that are asked for, or with what can be kept of them."""
    if asked.margins == "required":
        return answer_on(prepared, start)
    found = answer_on(replace(prepared, question=prepared.question.bare()), start)
    free, known = found.answer, prepare_checks(prepared.with_margins(asked))
    if not isinstance(free, Verified):
        return found._replace(prepared=prepared)

    def answered(share: float) -> tuple[float, StanceAnswer]:
        there = prepared.with_margins(asked.with_share(share))
        near = free.solution if prepared.hands.floating and share < 1.0 else None
        each = answer_on(there, start, known.on(there), near, prove=near is None)
        held = isinstance(each.answer, Verified)
        return each.answer.solution.least.value if held else np.inf, each

    kept, best = kept_margins(prepared, asked, free.solution.least.value, answered)
    return best._replace(moments=found.moments, kept=kept, free=found)


def _solutions(
    prepared: PreparedStance, budget: Budget, near: Solution | None = None, *, twice: bool = True
) -> Iterator[Solution]:
    """Yield the plan that a question asks for, in one way after the other."""
    if prepared.hands.floating:
        return _best_in(prepared, [floating_solution(prepared, budget, near)], budget)
    return _best_in(prepared, fixed_solutions(prepared, near, twice=twice), budget)


def _best_in(
    prepared: PreparedStance, found: Iterable[Solution], budget: Budget
) -> Iterator[Solution]:
    """Yield plans of least utilisation, or what a question's objective makes of each."""
    objective = objective_of(prepared.question)
    for least in found:
        capped = objective.within(prepared, least.sets, least.loads) if least.loads else None
        yield least if capped is None else least.best_in(capped, prepared, budget)


def _first_verified(prepared: PreparedStance, checks: Checks, found: Iterable[Solution]) -> Answer:
    """Recover and verify one solution after the other, until one passes."""
    for solution in found:
        if not solution.loads:
            answer: Answer = Failed(solution, solution.no_answer(prepared))
            continue
        answer = verify(prepared, checks, recover(prepared, checks, solution))
        if not isinstance(answer, Failed):
            break
    return answer


def _next_verified(
    prepared: PreparedStance, checks: Checks, budget: Budget, near: Solution | None
) -> Verified | None:
    """Return the verified plan close to that of another body wrench; None without one.

    Only with compliant wrists: other solutions near a known one are tried by `fixed_solutions`.
    """
    if not isinstance(near, FloatingSolution):
        return None
    found = next_solution(prepared, budget, near)
    if found is None:
        return None
    answer = _first_verified(prepared, checks, _best_in(prepared, [found], budget))
    within = prepared.question.limits.utilisation + CAP_SLACK
    return answer if isinstance(answer, Verified) and answer.whole <= within else None


def _second_look(
    prepared: PreparedStance, checks: Checks, found: Answer, budget: Budget, *, prove: bool
) -> Answer:
    """Return the proof that there is no balance, or a plan at its border; else what was found.

    Of what does not pass its checks, if a proof is wanted; and of loads beyond `load_box`.
    """
    if not isinstance(found, Failed):
        if not beyond_all_loads(prepared, found):
            return found
        prove = True
    solution = found.solution
    if prove and solution.least.balance_dual is None:
        deadline.check("a plan was found")
    data = solution.sets.data
    nearest = programs.nearest(data)
    # relative distance for which rounding alone is to blame
    far = 1e-7 * max(1.0, float(np.linalg.norm(data.wrench)))
    if nearest.solved and nearest.value <= far:
        if prepared.hands.floating or not isinstance(found, Failed):
            return found
        # rounding put the wrench a hair outside: plan for the nearest that can be had
        inside = _best_in(prepared, nearest_solutions(prepared, solution, nearest), budget)
        found = _first_verified(prepared, checks, inside)
        if not (isinstance(found, Failed) and found.solution.loads):
            return found
        # of next to no wrench a hair is more than rounding
    if wrench_is_given(prepared) or not prove:
        return found
    given = len(data.wrench) > len(prepared.wrench)
    known = None if given else nearest
    proof = certify(prepared, solution.sets, solution.least, nearest=known)
    if proof is None:
        return found
    return Infeasible(solution.late(*unexplained(prepared, proof)), proof)


def try_stance(
    prepared: PreparedStance,
    idle: Sequence[LimitUse] | None = None,
    near: Solution | None = None,
) -> StanceTrial:
    """Solve and verify the plan of a stance without explanation; nothing is cached.

    Parameters
    ----------
    prepared : PreparedStance
    idle : sequence of LimitUse, optional
        Utilisation of the joints of limbs without a hand; computed by default.
    near : Solution, optional
        Solution of a similar stance, as a warm start.

    Returns
    -------
    StanceTrial
        Utilisation of the verified plan, infinite without one, and a function for the load factor.
    """
    budget = Budget(SETTINGS.programs)
    checks = Checks.of(prepared, idle)
    answer = _first_verified(prepared, checks, _solutions(prepared, budget, near))
    answer = _second_look(prepared, checks, answer, budget, prove=False)
    overloaded = checks.overloaded

    def factor() -> LoadFactor:
        return load_factor_of(prepared, answer, budget, overloaded=overloaded)[0]

    solution, whole = answer.solution, answer.whole
    return StanceTrial(prepared, solution.sets.data, solution.least, whole, factor)


class KnownStance:
    """A prepared stance, for a planner that asks about one body wrench after the other.

    Hands, joints and wrench spaces are computed once. Each further query costs the check of its
    plan, and a call of the solver unless the limits that bound the previous plan still bind. With
    compliant wrists the plan is sought close to the previous one; that is local, so that its
    utilisation may differ from that of `plan` by some thousandths.

    Parameters
    ----------
    question : Question
        The stance, with limits, objective and extras, which apply to every body wrench. Joint
        torques stay those of the question's load.

    Attributes
    ----------
    prepared : PreparedStance

    Raises
    ------
    InvalidInputError
        If the question is not valid; the error's field is relative to the question.
    """

    def __init__(self, question: Question) -> None:
        self.prepared = prepared = prepare_stance(question)
        self._checks: Checks | None = None
        self._near: Solution | None = None
        self._asked = question.limits
        # what joints bear changes with the wrench
        if prepared.where is None and question.stance.joints is None:
            self._checks = prepare_checks(prepared)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Findings about the stance and the numbers of its question, whatever the body wrench."""
        return (self._checks or prepare_checks(self.prepared)).findings

    def plan(self, body_wrench: Array) -> Plan:
        """Answer for another body wrench, like `planner.solving.plan`, but without advice.

        Parameters
        ----------
        body_wrench : ndarray, shape (6,)
            Wrench that the rock must exert on the robot, in B [N, N·m].

        Raises
        ------
        InvalidInputError
            If the wrench is not six finite numbers, or too large to be plausible.
        DeadlineError
            If the deadline passes before a plan passes the checks or is proven infeasible.
        """
        start = time.perf_counter()
        with deadline.within(self.prepared.question.deadline, started=start):
            return self.answer(body_wrench, start).plan()

    def answer(self, body_wrench: Array, start: float) -> StanceAnswer:
        """Answer for another body wrench, without an explanation.

        Parameters
        ----------
        body_wrench : ndarray, shape (6,)
            Body wrench as for `plan`, which also says when an error is raised.
        start : float
            Time at which the answer was begun, on the clock of `time.perf_counter` [s].
        """
        near, prepared = self._near, self.prepared.turned(body_wrench)
        if self._asked.margins != "required":
            return _with_margins(prepared, self._asked, start)
        found = answer_on(prepared, start, self._checks, near)
        if isinstance(near, FloatingSolution) and not found.optimal:
            # the search from the wrists of another wrench is local
            found = answer_on(prepared, start, self._checks, None)
        solution = found.answer.solution
        if isinstance(solution, FixedSolution):
            self._near = near if solution.start is None else solution
        elif isinstance(solution, FloatingSolution) and prepared.hands.together is not None:
            self._near = solution if found.optimal else near
        return found


def with_advice(question: Question, answer: Plan) -> Plan:
    """Return a plan with advice added: changes of the question that would help.

    There is no search while a finding doubts a number; a warning says so, or that it was cut off.

    Parameters
    ----------
    question : Question
    answer : Plan
        The question's plan.
    """
    return add_advice(question, answer, try_stance)
