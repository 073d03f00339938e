"""Compose the reported plan from a verified answer: limits, prices, certificate, warnings."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
from msgspec.structs import replace

from hand_models.base import Array
from hand_models.hand import FINGERS
from planner import deadline
from planner.advice import Attempt
from planner.deadline import DeadlineError, Unfinished, late, late_sentence
from planner.execution import KeptMargins, find_open_loop, margin_not_had, without_margins
from planner.explanation import (
    ActiveLimits,
    LimitUse,
    certify,
    certify_idle,
    changed_contacts,
    far_wrists,
    idle_preloads,
    limit_sentence,
    limit_unit,
    overload_sentence,
    palm_findings,
    shortfall_sentence,
    strained_preloads,
    stretch_findings,
    tension_path,
    unsafe_sentence,
)
from planner.prepare import PreparedStance
from planner.programs import CAP_SLACK
from planner.result import (
    Certificate,
    Clearance,
    Finding,
    HandPlan,
    LimitName,
    LoadFactor,
    Plan,
    Price,
    Solver,
    Time,
)
from planner.scene import clearance, scene_of, wrench_findings
from planner.solving.fixed_wrists import FixedSolution
from planner.solving.objective import CappedObjective
from planner.solving.robust import find_robust_load_factor
from planner.solving.solution import Answer, Failed, Infeasible, Verified
from planner.solving.spread import find_spread
from planner.solving.verified import Checks, execution_passes

__all__ = ["explained_plan", "reason_beyond", "unexplained"]


def explained_plan(
    prepared: PreparedStance,
    checks: Checks,
    answer: Answer,
    factor: LoadFactor,
    attempt: Attempt,
    moments: tuple[float, float, float],
    kept: KeptMargins | None = None,
) -> Plan:
    """Compose the reported plan, with its explanation and the extras that the question wants.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.
    checks : Checks
        Recovery and checks of the stance's loads.
    answer : Answer
        Verified loads, a proof of infeasibility, or a failure.
    factor : LoadFactor
        Load factor of the answer.
    attempt : callable
        Plans a stance with other hands, for the spread (`try_stance`).
    moments : tuple of (float, float, float)
        Times at which the answer was begun, prepared and solved, on the clock of
        `time.perf_counter` [s].
    kept : KeptMargins, optional
        What of the margins the answer keeps, if it need not keep all. The extras then are those of
        the stance without margins, which other loads, hands and rock may leave no room.
    """
    question, where, solution = prepared.question, prepared.where, answer.solution
    start, prepared_at, solved = moments
    # before the extras, which may take all of the time
    of_wrists = tuple(_wrist_warnings(prepared, answer))
    odd = wrench_findings(question)
    unfinished = solution.unfinished + (("load_factor",) if factor.unfinished else ())
    further: list[str] = []
    if isinstance(answer, Verified):
        parts, late_parts, further = _of_plan(prepared, checks, answer)
        unfinished += late_parts
        odd = (
            *odd,
            *_spare_findings(prepared, answer),
            *palm_findings(prepared, parts["hands"]),
            *stretch_findings(prepared, parts["hands"]),
        )
    else:
        parts = _of_none(prepared, answer)
    if kept is None:
        free, odd = prepared, (*odd, *_margin_findings(prepared, checks, answer, attempt))
    else:
        free, parts["margin_share"] = without_margins(prepared), kept.share
        odd = (*odd, *kept.findings(question.limits.utilisation))
    if "robust" in question.want and prepared.needs_hands:
        # last: these take the longest
        parts["robust"] = find_robust_load_factor(
            free, checks.idle, solution, attempt, overloaded=checks.overloaded
        )
        unfinished += late("robust") if parts["robust"] is None else ()
    if "open_loop" in question.want and isinstance(answer, Verified):
        passes = partial(execution_passes, prepared)
        parts["open_loop"] = find_open_loop(prepared, answer.by_hand(), checks.idle_use, passes)
        unfinished += late("open_loop") if parts["open_loop"] is None else ()
    if "spread" in question.want:
        hands = answer.by_hand() if isinstance(answer, Verified) else ()
        passes = partial(execution_passes, prepared)
        parts["spread"] = find_spread(free, checks.idle, solution, attempt, hands, passes)
        unfinished += late("spread") if parts["spread"] is None else ()
    if "clearance" in question.want:
        parts["clearance"] = _clearance(prepared)
    if where is not None:
        parts["joints"] = where.angles
        parts["joint_torque_limit"] = {limb: each.limits for limb, each in where.joints.items()}
    seconds = deadline.seconds()
    warnings = (
        *checks.oddities,
        *(each.message for each in odd),
        *([late_sentence(seconds, unfinished)] if unfinished and seconds is not None else ()),
        *of_wrists,
        *further,
        *_factor_warnings(prepared, factor),
    )
    return Plan(
        body_wrench=prepared.wrench,
        load_factor=factor.factor,
        load_factor_unbounded=factor.unbounded,
        load_factor_status=factor.status if "load_factor" in question.want else "not_asked",
        findings=(*checks.findings, *odd),
        warnings=warnings,
        solver=Solver("CLARABEL", solution.least.status, solution.least.iterations),
        time=Time(prepared_at - start, solved - prepared_at, time.perf_counter() - start),
        unfinished=unfinished,
        **parts,
    )


def _of_none(prepared: PreparedStance, answer: Infeasible | Failed) -> dict[str, Any]:
    """Return what is to be said of no plan, by fields of `Plan`."""
    reason = _reason_of_none(prepared, answer)
    if isinstance(answer, Failed):
        return {"status": "failed", "verified": False, "reason": reason}
    proof = answer.proof if prepared.question.explain else None
    return {"status": "infeasible", "reason": reason, "certificate": proof}


def _reason_of_none(prepared: PreparedStance, answer: Infeasible | Failed) -> str:
    """Return a sentence that says why there is no plan."""
    if isinstance(answer, Failed):
        return answer.reason
    touching = any(h.holding.any() or h.palm.engaged for h in prepared.batch.hands)
    return shortfall_sentence(answer.proof, touching, floating=prepared.floating)


def reason_beyond(prepared: PreparedStance, checks: Checks, answer: Answer) -> str | None:
    """Return why there is no plan, or which limit an overloaded one exceeds most; else None.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.
    checks : Checks
        Recovery and checks of the stance's loads.
    answer : Answer
        Verified loads, a proof of infeasibility, or a failure.
    """
    if not isinstance(answer, Verified):
        return _reason_of_none(prepared, answer)
    solution, cap = answer.solution, prepared.question.limits.utilisation
    if answer.whole <= cap + CAP_SLACK:
        return None
    binding = ActiveLimits(prepared.limbs, solution.sets.spaces, solution.least.limit_duals)
    return _explain(binding, answer, answer.by_hand(), checks.idle, cap)[1]


def _of_plan(
    prepared: PreparedStance, checks: Checks, found: Verified
) -> tuple[dict[str, Any], tuple[Unfinished, ...], list[str]]:
    """Return what is to be said of a plan, by fields of `Plan`; what is unfinished; warnings."""
    question, solution, idle = prepared.question, found.solution, checks.idle
    spaces, cap = solution.sets.spaces, question.limits.utilisation
    hands, unfinished, warnings = found.by_hand(), tuple[Unfinished, ...](), list[str]()
    binding = ActiveLimits(prepared.limbs, spaces, solution.least.limit_duals)
    limiting, reason = _explain(binding, found, hands, idle, cap)
    parts: dict[str, Any] = {
        "status": "optimal",
        "utilisation": found.whole,
        "effort": found.effort,
        "limiting": limiting,
        "hands": hands,
        "residual": _residual(prepared, found),
        "joint_torque": _joint_torque(prepared, hands),
    }
    if "prices" in question.want:
        parts["prices"] = _prices(binding, found, idle)
    if solution.best is not solution.least:
        own = ActiveLimits(prepared.limbs, spaces, solution.best.limit_duals)
        parts |= solution.objective.reported(own, solution.cap)
    if isinstance(solution.objective, CappedObjective):
        parts |= solution.objective.measured(found.arrays)
    if question.present:
        parts["path"] = path = tension_path(prepared, solution.sets, solution.loads, idle)
        unfinished += late("path") if path is None else ()
        if path is None and not unfinished:
            warnings.append(
                "whether the straight way from the present tensions is safe was not found out"
            )
        elif path is not None and not path.safe:
            warnings.append(unsafe_sentence(path))
    if found.whole > cap + CAP_SLACK:
        parts["status"] = "overloaded"
        if question.explain:
            proof = _overload(prepared, found, idle)
            parts["certificate"] = proof
            reason += overload_sentence(proof, floating=prepared.floating)
            unfinished += late("certificate") if proof is None else unexplained(prepared, proof)
            if not solution.proven and proof is None:
                warnings.append(
                    "no certificate proves the overload: the search for the wrists' poses is "
                    "local, and there may be a plan of less utilisation"
                )
    return {**parts, "reason": reason}, unfinished, warnings


def unexplained(prepared: PreparedStance, proof: Certificate) -> tuple[Unfinished, ...]:
    """Return ``("explanation",)`` if the deadline cut off the explanation of a proof, else nothing.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.
    proof : Certificate
        Complete if it has both an irreducible infeasible subset and sufficient changes.
    """
    if not prepared.question.explain:
        return ()
    whole = proof.irreducible is not None and proof.sufficient is not None
    return () if whole else late("explanation")


def _overload(
    prepared: PreparedStance, found: Verified, idle: Sequence[LimitUse]
) -> Certificate | None:
    """Return the proof that no plan keeps to the cap on the utilisation; None without one.

    Of floating hands with their sets linearised at the plan.
    """
    cap, used = prepared.question.limits.utilisation, found.utilisation
    most = max(idle, key=lambda each: each.utilisation, default=None)
    beyond = [each for each in idle if each.utilisation > cap + CAP_SLACK]
    proven = found.solution.proven
    if most is not None and beyond and most.utilisation >= used:
        alone: bool | None = len(beyond) == 1
        if used > cap + CAP_SLACK:
            alone = False if proven else None
        return certify_idle(most, cap, alone)
    if not proven:
        return None
    proof = certify(prepared, found.solution.sets, found.solution.least, cap)
    # what a limb without a hand cannot bear stays in the way, whatever is taken from the hands
    return replace(proof, sufficient=()) if proof is not None and beyond else proof


def _spare_findings(prepared: PreparedStance, found: Verified) -> Iterator[Finding]:
    """Yield which hands add nothing to a plan of least utilisation."""
    solution, closing = found.solution, prepared.batch.closing_tensions
    if not isinstance(solution, FixedSolution) or solution.best is not solution.least:
        return
    for i, without, _ in solution.spare:
        message = (
            f"{prepared.limbs[i]} adds nothing: without it the least utilisation would be "
            f"{without:.4g}, with it {solution.least.value:.4g}"
        )
        off = np.abs(solution.loads[i][: len(FINGERS)] - closing[i]).max()
        if off <= 0.5:  # [N]: finer than motors hold
            message += f"; its tendons are left at their closing tension of {closing[i]:g} N"
        field = f"stance.hands[{i}]"
        yield Finding("hand_adds_nothing", field, message, without, "1")


def _margin_findings(
    prepared: PreparedStance, checks: Checks, answer: Answer, attempt: Attempt
) -> Iterator[Finding]:
    """Yield at most one finding: that there is a plan within the cap without the margins."""
    question = prepared.question
    asked = question.limits.asked_margins
    # idle limbs do not depend on margins
    missed = answer.whole > question.limits.utilisation + CAP_SLACK and not checks.overloaded
    if not (asked and missed and question.explain) or deadline.expired():
        return
    near = answer.solution if isinstance(answer, Verified) else None
    try:
        used = attempt(without_margins(prepared), checks.idle, near).utilisation
    except DeadlineError:
        return
    if used > question.limits.utilisation + CAP_SLACK:
        return
    yield margin_not_had(asked, question.limits.utilisation, used)


def _clearance(prepared: PreparedStance) -> Clearance:
    where, stance = prepared.where, prepared.question.stance
    angles = None if where is None else where.angles
    return clearance(scene_of(stance, prepared.batch.hands), angles)


def _wrist_warnings(prepared: PreparedStance, answer: Answer) -> Iterator[str]:
    """Yield what a caller should know of floating wrists."""
    if prepared.hands.floating:
        yield from idle_preloads(prepared)
        yield from strained_preloads(prepared)
        if isinstance(answer, Verified):
            yield from far_wrists(answer.by_hand())
            try:
                yield from changed_contacts(prepared, answer.by_hand())
            except DeadlineError:
                yield "whether hands would close alike where their wrists go was not found in time"
    if not answer.solution.proven:
        yield (
            "the loads are exact, but the utilisation is not proven minimal: at these poses of the "
            "wrists the stiffness jumps, or the search ended"
        )


def _factor_warnings(prepared: PreparedStance, factor: LoadFactor) -> Iterator[str]:
    """Yield what a caller should know of the load factor."""
    if "load_factor" in prepared.question.want:
        if prepared.hands.floating and factor.status == "none":
            yield "no load factor found; with floating wrists there may be one all the same"
        if factor.least:
            yield (
                "the load factor is a lower bound: beyond it no plan was found, nor proven "
                "infeasible"
            )


def _residual(prepared: PreparedStance, found: Verified) -> Array:
    """Return the body wrench of the hands' wrenches less the one planned for."""
    given = prepared.hands.transports @ found.arrays.wrenches[:, :, None]
    return np.asarray(-prepared.wrench - np.add.reduce(given).ravel())


def _joint_torque(prepared: PreparedStance, hands: Sequence[HandPlan]) -> dict[str, Array] | None:
    """Return the torques of all joints [N·m], as the hands' wrenches make them."""
    if prepared.where is None:
        return None
    wrenches = {hand.limb: hand.wrench for hand in hands}
    return {
        limb: joints.torques(wrenches.get(limb, np.zeros(6)))
        for limb, joints in prepared.where.joints.items()
    }


def _explain(
    binding: ActiveLimits,
    found: Verified,
    hands: Sequence[HandPlan],
    idle: Sequence[LimitUse],
    cap: float,
) -> tuple[LimitName | None, str]:
    """Return the limit with the largest utilisation, and a sentence about it."""
    most = binding.limiting(found.used, found.whole, idle)
    if most is None:
        return None, "nothing limits this stance"
    held = found.whole <= 1.0 + CAP_SLACK
    hand = next((hand for hand in hands if hand.limb == most.name.limb), None)
    sentence = limit_sentence(most, hand, held=held)
    if held and found.whole > cap + CAP_SLACK:
        sentence += f"; that is beyond the utilisation of {cap:g} that was asked for"
    return most.name, sentence


def _prices(binding: ActiveLimits, found: Verified, idle: Sequence[LimitUse]) -> tuple[Price, ...]:
    """Return what more of each limit that binds would take off the utilisation."""
    most = max(idle, key=lambda used: used.utilisation, default=None)
    if most is not None and most.utilisation > found.utilisation + CAP_SLACK:
        # a limb without a hand bears the most: nothing else counts
        price = most.utilisation / most.capacity
        return (Price.of(most.name, price, limit_unit(most.name.limit)),)
    return binding.prices(found.solution.least.value)
