"""Why there is no plan, or none within the cap: the proof, or another try."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from planner import deadline, programs
from planner.deadline import Budget, Overlap, Unfinished, late
from planner.explanation import LimitUse, certify, certify_idle
from planner.prepare import PreparedStance
from planner.programs import LOAD_UNIT, SLACK, UNLIMITED, Outcome
from planner.result import Certificate
from planner.solving.prepared_checks import PreparedChecks
from planner.solving.solution import Solution, solve_at_vertex, solve_effort, solve_in_two

__all__ = ["beyond_all_loads", "given_wrench", "look_again", "overload", "unexplained"]


SQUEEZED: Final = 1e3
"""Loads over the body's force beyond which hands do little but squeeze each other."""

BALANCED: Final = 1e-7
"""Distance to the nearest body wrench, relative, below which rounding alone is to blame."""


def beyond_all_loads(prepared: PreparedStance, found: Solution) -> bool:
    """Whether a plan of fixed wrists has loads beyond `UNLIMITED`, and far beyond what is needed.

    Rows that all but contradict the balance let it be had so, a hair before they do.
    """
    if prepared.floating or found.utilisation <= 1.0:
        return False
    most = max(np.abs(loads).max(initial=0.0) for loads in found.outcome.loads)
    needed = float(np.linalg.norm(prepared.wrench[:3]))
    return bool(most > max(UNLIMITED * LOAD_UNIT, SQUEEZED * needed))


def look_again(
    prepared: PreparedStance,
    checks: Overlap[PreparedChecks],
    found: Solution,
    budget: Budget,
    *,
    prove: bool = True,
) -> tuple[Solution, Certificate | None]:
    """Tell no balance at all, with the proof of it if that is wanted, from a solver that failed."""
    data = found.sets.data
    nearest = programs.nearest(data)
    far = BALANCED * max(1.0, float(np.linalg.norm(data.wrench)))
    missed = found
    if nearest.solved and nearest.value <= far:
        if prepared.hands.floating or found.passes:
            return found, None
        # rounding put the wrench a hair outside: plan for the nearest that can be had
        inside = found.sets._replace(data=data.turned(programs.body_wrench(data, nearest.loads)))
        missed = solve_in_two(prepared, checks, inside)
        if not (missed.outcome.solved or deadline.expired()):
            missed = solve_at_vertex(prepared, checks, inside)
        missed = missed.late(*found.unfinished)
        if not missed.wrong:
            if prepared.question.objective == "min_effort":
                missed = solve_effort(prepared, checks, missed, budget)
            return missed, None
        # of next to no wrench a hair is more than rounding
    if given_wrench(prepared) or not prove:
        return missed, None
    given = len(data.wrench) > len(prepared.wrench)
    proof = _certify(prepared, found, None, None if given else nearest)
    if proof is None:
        return missed, None
    found = found._replace(outcome=replace(found.outcome, solved=False))
    return found.late(*unexplained(prepared, proof)), proof


def given_wrench(prepared: PreparedStance) -> bool:
    """Whether a floating hand's wrench is given: sets linearised elsewhere prove little."""
    return any(
        hand.wrist == "floating" and hand.wrench is not None
        for hand in prepared.question.stance.hands
    )


def unexplained(prepared: PreparedStance, proof: Certificate) -> tuple[Unfinished, ...]:
    """Return that a proof is not explained, if it was to be, and that is for the time."""
    if not prepared.question.explain:
        return ()
    whole = proof.irreducible is not None and proof.sufficient is not None
    return () if whole else late("explanation")


def _certify(
    prepared: PreparedStance, found: Solution, cap: float | None, nearest: Outcome | None = None
) -> Certificate | None:
    """Return the proof that there is no plan: at any utilisation, or within a cap."""
    spaces, data = found.sets
    question = prepared.question
    stance = data, prepared.limbs, spaces, prepared.hands.held, question.limits
    known = found.outcome
    return certify(*stance, cap, nearest=nearest, known=known, explain=question.explain)


def overload(
    prepared: PreparedStance, found: Solution, idle: Sequence[LimitUse]
) -> Certificate | None:
    """Return the proof that no plan keeps to the cap on the utilisation; None without one.

    Of floating hands with their sets linearised at the plan.
    """
    cap = prepared.question.limits.utilisation
    most = max(idle, key=lambda used: used.utilisation, default=None)
    beyond = [used for used in idle if used.utilisation > cap + SLACK]
    if most is not None and beyond and most.utilisation >= found.utilisation:
        alone: bool | None = len(beyond) == 1
        if found.utilisation > cap + SLACK:
            alone = None if found.unproven else False
        return certify_idle(most, cap, alone)
    if found.unproven:
        return None
    proof = _certify(prepared, found, cap)
    # what a limb without a hand cannot bear stays in the way, whatever is taken from the hands
    return replace(proof, sufficient=()) if proof is not None and beyond else proof
