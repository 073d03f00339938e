"""The proofs that there is no plan: at any utilisation, or within the cap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from planner.deadline import Unfinished, late
from planner.explanation import LimitUse, certify, certify_idle
from planner.prepare import PreparedStance
from planner.programs import SLACK, Outcome
from planner.result import Certificate
from planner.solving.solution import Solution, Verified

__all__ = ["overload", "proof_of_none", "unexplained"]


def proof_of_none(
    prepared: PreparedStance, solution: Solution, nearest: Outcome
) -> Certificate | None:
    """Return the proof that nothing balances the body at any utilisation; None without one.

    Parameters
    ----------
    prepared : PreparedStance
    solution : Solution
        That has no loads which pass the checks.
    nearest : Outcome
        Of `programs.nearest`.
    """
    sets, least = solution.sets, solution.least
    given = len(sets.data.wrench) > len(prepared.wrench)
    return certify(prepared, sets, least, nearest=None if given else nearest)


def unexplained(prepared: PreparedStance, proof: Certificate) -> tuple[Unfinished, ...]:
    """Return that a proof is not explained, if it was to be, and that is for the time."""
    if not prepared.question.explain:
        return ()
    whole = proof.irreducible is not None and proof.sufficient is not None
    return () if whole else late("explanation")


def overload(
    prepared: PreparedStance, found: Verified, idle: Sequence[LimitUse]
) -> Certificate | None:
    """Return the proof that no plan keeps to the cap on the utilisation; None without one.

    Of floating hands with their sets linearised at the plan.
    """
    cap, used = prepared.question.limits.utilisation, found.utilisation
    most = max(idle, key=lambda each: each.utilisation, default=None)
    beyond = [each for each in idle if each.utilisation > cap + SLACK]
    proven = found.solution.proven
    if most is not None and beyond and most.utilisation >= used:
        alone: bool | None = len(beyond) == 1
        if used > cap + SLACK:
            alone = False if proven else None
        return certify_idle(most, cap, alone)
    if not proven:
        return None
    proof = certify(prepared, found.solution.sets, found.solution.least, cap)
    # what a limb without a hand cannot bear stays in the way, whatever is taken from the hands
    return replace(proof, sufficient=()) if proof is not None and beyond else proof
