"""From a solution to the plan that is told: proven, explained, with its warnings."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array
from hand_models.hand import FINGERS
from planner import deadline
from planner.deadline import Unfinished, late, late_sentence
from planner.explanation import (
    LEAST_FACTOR,
    NO_FACTOR,
    UNKNOWN,
    UNPROVEN,
    ActiveLimits,
    LimitUse,
    far_wrists,
    idle_preloads,
    limit_sentence,
    overload_sentence,
    shortfall_sentence,
    strained_preloads,
    tension_path,
    unit_of,
    unsafe_sentence,
)
from planner.prepare import PreparedStance
from planner.programs import SLACK, SOLVER
from planner.result import (
    Certificate,
    Clearance,
    Finding,
    HandPlan,
    LimitName,
    Plan,
    Price,
    Solver,
    Status,
    TensionPath,
    Time,
)
from planner.scene import clearance, scene_of, wrench_findings
from planner.solving.load_factor import FoundFactor, needs_hands
from planner.solving.prepared_checks import PreparedChecks, Reading
from planner.solving.robust import find_robust_load_factor
from planner.solving.solution import Solution, not_least
from planner.solving.spread import find_spread
from planner.solving.why_not import given_wrench, overload, unexplained

__all__ = ["explained_plan"]

LEFT: Final = 0.5
"""How far a tension may be from that of closing to be left there [N]: less than motors are held."""


class _Verdict(NamedTuple):
    """What is to be said of a solution: of a plan that may leave, or of none."""

    status: Status
    reason: str
    plan: Reading | None = None
    limiting: LimitName | None = None
    prices: tuple[Price, ...] | None = None
    path: TensionPath | None = None
    proof: Certificate | None = None
    unfinished: tuple[Unfinished, ...] = ()


def explained_plan(
    prepared: PreparedStance,
    checks: PreparedChecks,
    found: Solution,
    proof: Certificate | None,
    factor: FoundFactor,
    times: Time,
    start: float,
) -> Plan:
    """Return the plan, verified and explained.

    Parameters
    ----------
    prepared : PreparedStance
    checks : PreparedChecks
    found : Solution
    proof : Certificate or None
        That there is no balance.
    factor : FoundFactor
    times : Time
        Of what came before.
    start : float
        When all began, on the clock of `time.perf_counter`.
    """
    question, where = prepared.question, prepared.where
    if found.outcome.solved and found.reading is not None:
        told = _of_plan(prepared, checks, found, found.reading)
    elif proof is not None:
        touching = any(h.holding.any() or h.palm.engaged for h in prepared.batch.hands)
        reason = shortfall_sentence(proof, touching, floating=prepared.floating)
        told = _Verdict("infeasible", reason, proof=proof)
    else:
        told = _Verdict("failed", _no_answer(prepared, found))
    robust, spread = None, None
    unfinished = found.unfinished + factor.unfinished + told.unfinished
    if "robust" in question.want and needs_hands(prepared):
        # last: they take the longest
        robust = find_robust_load_factor(prepared, checks.idle)
        unfinished += late("robust") if robust is None else ()
    if "spread" in question.want:
        spread = find_spread(prepared, checks.idle, found.least_use)
        unfinished += late("spread") if spread is None else ()
    read, hands = told.plan, None if told.plan is None else told.plan.hands
    odd = wrench_findings(question)
    if hands is not None:
        odd = (*odd, *_spare_findings(prepared, found))
    return Plan(
        status=told.status,
        body_wrench=prepared.wrench,
        utilisation=None if read is None else read.whole,
        effort=None if read is None else read.effort,
        load_factor=factor.factor,
        load_factor_unbounded=factor.unbounded,
        load_factor_status=factor.status if "load_factor" in question.want else "not_asked",
        limiting=told.limiting,
        hands=hands,
        prices=told.prices,
        effort_prices=None if read is None else _effort_prices(prepared, found),
        certificate=told.proof if question.explain else None,
        residual=None if read is None else _residual(prepared, read),
        joints=None if where is None else where.angles,
        joint_torque=_joint_torque(prepared, hands),
        joint_torque_limit=None
        if where is None
        else {limb: joints.limits for limb, joints in where.joints.items()},
        path=told.path,
        verified=told.status != "failed",
        reason=told.reason,
        findings=(*checks.findings, *odd),
        warnings=(
            *checks.oddities,
            *(each.message for each in odd),
            *_warnings(prepared, found, factor, told, unfinished),
        ),
        solver=Solver(SOLVER, found.outcome.status, found.outcome.iterations),
        time=Time(times.model, times.solve, time.perf_counter() - start),
        unfinished=unfinished,
        robust=robust,
        spread=spread,
        clearance=_clearance(prepared) if "clearance" in question.want else None,
    )


def _spare_findings(prepared: PreparedStance, found: Solution) -> Iterator[Finding]:
    """Yield which hands add nothing to the plan."""
    if found.effort is not None or found.reading is None:
        return
    loads, closing = found.reading.loads, prepared.batch.closing_tensions
    for i, without, _ in found.spare:
        message = (
            f"{prepared.limbs[i]} adds nothing: without it the least utilisation would be "
            f"{without:.4g}, with it {found.outcome.value:.4g}"
        )
        off = np.abs(loads[i][: len(FINGERS)] - closing[i]).max()
        if off <= LEFT:
            message += f"; its tendons are left at their closing tension of {closing[i]:g} N"
        field = f"stance.hands[{i}]"
        yield Finding("hand_adds_nothing", field, message, without, "1")


def _clearance(prepared: PreparedStance) -> Clearance:
    where, stance = prepared.where, prepared.question.stance
    angles = None if where is None else where.angles
    return clearance(scene_of(stance, prepared.batch.hands), angles)


def _of_plan(
    prepared: PreparedStance, checks: PreparedChecks, found: Solution, read: Reading
) -> _Verdict:
    """Return what is to be said of a plan."""
    question, idle = prepared.question, checks.idle
    wrong = found.wrong or not_least(found)
    if wrong:
        return _Verdict("failed", f"the solver's plan does not pass the checks: {wrong[0]}")
    if checks.recovery is not None:
        hands = read.arrays.hands(prepared.limbs, prepared.batch, found.sets.spaces)
        read = read._replace(hands=hands)
    cap = question.limits.utilisation
    binding = ActiveLimits(prepared.limbs, found.sets.spaces, found.outcome.limit_duals)
    limiting, reason = _explain(binding, read, idle, cap)
    told = _Verdict("optimal", reason, read, limiting)
    if "prices" in question.want:
        told = told._replace(prices=_prices(binding, found, read, idle))
    if question.present:
        spaces, data = found.sets
        path = tension_path(data, prepared.limbs, spaces, read.loads, question.present, cap, idle)
        told = told._replace(path=path, unfinished=late("path") if path is None else ())
    if read.whole <= cap + SLACK:
        return told
    told = told._replace(status="overloaded")
    if not question.explain:
        return told
    proof = overload(prepared, found, idle)
    missing = late("certificate") if proof is None else unexplained(prepared, proof)
    return told._replace(
        reason=reason + overload_sentence(proof, floating=prepared.floating),
        proof=proof,
        unfinished=told.unfinished + missing,
    )


def _no_answer(prepared: PreparedStance, found: Solution) -> str:
    """Return why there is neither a plan nor a proof of none."""
    if found.search is None:
        return f"the solver gave no usable answer ({found.outcome.status})"
    reason = "no pose of the floating wrists was found that balances the body"
    if given_wrench(prepared):
        reason += " with the wrenches that they are given; that is no proof of none"
    idle = _idle_preloads(prepared)
    return f"{reason}; {idle[0]}" if idle else reason


def _idle_preloads(prepared: PreparedStance) -> tuple[str, ...]:
    return idle_preloads(prepared.limbs, prepared.batch.hands, prepared.hands.wrists)


def _warnings(
    prepared: PreparedStance,
    found: Solution,
    factor: FoundFactor,
    told: _Verdict,
    unfinished: Sequence[Unfinished],
) -> Iterator[str]:
    """Yield what a caller should know besides."""
    question, seconds = prepared.question, deadline.seconds()
    if unfinished and seconds is not None:
        yield late_sentence(seconds, unfinished)
    if prepared.hands.floating:
        yield from _idle_preloads(prepared)
        cap = question.limits.tendon_tension
        yield from strained_preloads(prepared.limbs, prepared.hands.wrists, cap)
        if found.outcome.solved and found.reading is not None:
            yield from far_wrists(found.reading.hands)
    if found.unproven:
        yield UNPROVEN
    if told.path is not None and not told.path.safe:
        yield unsafe_sentence(told.path)
    unknown = told.plan is not None and question.present and told.path is None
    if unknown and "path" not in unfinished:
        yield UNKNOWN
    asked = "load_factor" in question.want and not factor.unbounded
    asked = asked and "load_factor" not in unfinished
    if found.search is not None and asked and factor.factor is None:
        yield NO_FACTOR
    if factor.least:
        yield LEAST_FACTOR


def _residual(prepared: PreparedStance, read: Reading) -> Array:
    """Return the body wrench of the hands' wrenches less the one planned for."""
    arrays = prepared.hands.transports @ read.arrays.wrenches[:, :, None]
    return np.asarray(-prepared.wrench - np.add.reduce(arrays).ravel())


def _joint_torque(
    prepared: PreparedStance, hands: Sequence[HandPlan] | None
) -> dict[str, Array] | None:
    """Return the torques of all joints [N·m], as the hands' wrenches make them."""
    if prepared.where is None or hands is None:
        return None
    wrenches = {hand.limb: hand.wrench for hand in hands}
    return {
        limb: joints.torques(wrenches.get(limb, np.zeros(6)))
        for limb, joints in prepared.where.joints.items()
    }


def _explain(
    binding: ActiveLimits, read: Reading, idle: Sequence[LimitUse], cap: float
) -> tuple[LimitName | None, str]:
    """Return the limit with the largest utilisation, and a sentence about it."""
    most = binding.limiting(read.used, read.whole, idle)
    if most is None:
        return None, "nothing limits this stance"
    held = read.whole <= 1.0 + SLACK
    hand = next((hand for hand in read.hands if hand.limb == most.name.limb), None)
    sentence = limit_sentence(most, hand, held=held)
    if held and read.whole > cap + SLACK:
        sentence += f"; that is beyond the utilisation of {cap:g} that was asked for"
    return most.name, sentence


def _prices(
    binding: ActiveLimits, found: Solution, read: Reading, idle: Sequence[LimitUse]
) -> tuple[Price, ...]:
    """Return what more of each limit that binds would take off the utilisation."""
    most = max(idle, key=lambda used: used.utilisation, default=None)
    if most is not None and most.utilisation > read.utilisation + SLACK:
        # a limb without a hand bears the most: nothing else counts
        price = most.utilisation / most.capacity
        return (Price.of(most.name, price, unit_of(most.name.limit)),)
    return binding.prices(found.outcome.value)


def _effort_prices(prepared: PreparedStance, found: Solution) -> tuple[Price, ...] | None:
    """Return what more of each limit that binds would take off the effort."""
    if found.effort is None:
        return None
    duals = found.effort.limit_duals
    return ActiveLimits(prepared.limbs, found.sets.spaces, duals).prices(found.cap)
