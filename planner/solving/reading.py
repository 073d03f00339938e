"""From what has been found to the plan that is told: verified, explained, with its warnings."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from hand_models.base import Array
from planner import deadline
from planner.deadline import late_sentence
from planner.explanation import (
    LEAST_FACTOR,
    NO_FACTOR,
    UNKNOWN,
    UNPROVEN,
    ActiveLimits,
    far_wrists,
    limit_sentence,
    overload_sentence,
    shortfall_sentence,
    strained_preloads,
    tension_path,
    unit_of,
    unsafe_sentence,
)
from planner.programs import SLACK, SOLVER
from planner.result import HandPlan, LimitName, Plan, Price, Solver, Status, Time
from planner.solving import dual_bounds
from planner.solving.answer import Answer
from planner.solving.load_factor import find_robust_load_factor
from planner.solving.unique_plan import is_least
from planner.solving.why_not import overload

__all__ = ["read_plan"]


def read_plan(answer: Answer, times: Time, start: float) -> Plan:
    """Return the plan, verified."""
    hands: tuple[HandPlan, ...] | None = None
    utilisation: float | None = None
    limiting: LimitName | None = None
    residual: Array | None = None
    verified = False
    status: Status = "failed"
    if answer.outcome.solved:
        wrong = answer.wrong or _not_least(answer)
        if wrong:
            reason = f"the solver's plan does not pass the checks: {wrong[0]}"
        else:
            if answer.checks.reader is not None:
                answer.hands = answer.checks.reader.hands(answer.limbs, answer.arrays)
            verified, hands = True, answer.hands
            utilisation = answer.whole_utilisation
            cap = answer.question.limits.utilisation
            status = "optimal" if utilisation <= cap + SLACK else "overloaded"
            residual = _residual(answer)
            limiting, reason = _explain(answer, utilisation)
            _find_path(answer)
            if status == "overloaded":
                answer.certificate = overload(answer)
                if answer.certificate is None:
                    answer.mind_time("certificate")
                else:
                    answer.mind_explained(answer.certificate)
                reason += overload_sentence(answer.certificate, floating=answer.floating)
    elif answer.certificate is not None:
        status = "infeasible"
        verified = True
        touching = any(h.holding.any() or h.palm.engaged for h in answer.batch.hands)
        reason = shortfall_sentence(answer.certificate, touching, floating=answer.floating)
    elif answer.search is not None:
        reason = "no pose of the floating wrists was found that balances the body"
        if answer.held_floating:
            reason += " with the wrenches that they are given; that is no proof of none"
        if answer.idle_preloads:
            reason += f"; {answer.idle_preloads[0]}"
    else:
        reason = f"the solver gave no usable answer ({answer.outcome.status})"
    # last: it takes the longest
    find_robust_load_factor(answer)
    return Plan(
        status=status,
        body_wrench=answer.wrench,
        utilisation=utilisation,
        effort=answer.effort if hands else None,
        load_factor=answer.load_factor,
        load_factor_unbounded=answer.unbounded,
        limiting=limiting,
        hands=hands,
        prices=_prices(answer) if hands and "prices" in answer.question.want else None,
        effort_prices=_effort_prices(answer) if hands else None,
        certificate=answer.certificate,
        residual=residual,
        joints=None if answer.where is None else answer.where.angles,
        joint_torque=_joint_torque(answer, hands),
        joint_torque_limit=None
        if answer.where is None
        else {limb: joints.limits for limb, joints in answer.where.joints.items()},
        path=answer.path,
        verified=verified,
        reason=reason,
        warnings=_warnings(answer),
        solver=Solver(SOLVER, answer.outcome.status, answer.outcome.iterations),
        time=Time(times.model, times.solve, time.perf_counter() - start),
        unfinished=tuple(answer.unfinished),
        robust=answer.robust,
    )


def _find_path(answer: Answer) -> None:
    """Find whether the way from the present tensions, if any are given, is safe."""
    if not answer.question.present:
        return
    answer.path = tension_path(
        answer.data,
        answer.limbs,
        answer.spaces,
        answer.loads,
        answer.question.present,
        answer.question.limits.utilisation,
        answer.idle,
    )
    if answer.path is None:
        answer.mind_time("path")
        answer.path_unknown = "path" not in answer.unfinished


def _warnings(answer: Answer) -> tuple[str, ...]:
    found = answer.checks.oddities
    seconds = deadline.seconds()
    if answer.unfinished and seconds is not None:
        found += (late_sentence(seconds, answer.unfinished),)
    cap = answer.question.limits.tendon_tension
    found += (*answer.idle_preloads, *strained_preloads(answer.limbs, answer.parts.wrists, cap))
    if answer.outcome.solved:
        found += tuple(far_wrists(answer.hands))
    if answer.unproven:
        found += (UNPROVEN,)
    if answer.path is not None and not answer.path.safe:
        found += (unsafe_sentence(answer.path),)
    if answer.path_unknown:
        found += (UNKNOWN,)
    asked = "load_factor" in answer.question.want and not answer.unbounded
    asked = asked and "load_factor" not in answer.unfinished
    if answer.search is not None and asked and answer.load_factor is None:
        found += (NO_FACTOR,)
    if answer.least_factor:
        found += (LEAST_FACTOR,)
    return found


def _not_least(answer: Answer) -> list[str]:
    """Return what is wrong if the multipliers do not prove the plan the best.

    With floating hands, the best of their sets about the plan.
    """
    if answer.unproven or "least_utilisation" in answer.unfinished:
        return []
    data = answer.data
    if answer.least_used is not None and answer.least_effort is not None:
        # of these sets, which are about another point, the outcome is
        data = answer.least_used.sets.data
    bound = answer.bound
    if bound is None:
        bound = dual_bounds.least_bound(data, answer.outcome)
    used = answer.utilisation if answer.least_effort is None else answer.outcome.value
    if not is_least(used, bound):
        return [f"utilisation {used:.6g} is only proven to be above {bound:.6g}"]
    if answer.least_effort is not None:
        effort = answer.least_effort.value
        if answer.search is not None:
            effort = answer.search.measure.effort
        bound = dual_bounds.least_effort_bound(answer.data, answer.least_effort, answer.cap)
        if not is_least(effort, bound):
            return [f"effort {effort:.6g} is only proven to be above {bound:.6g}"]
    return []


def _residual(answer: Answer) -> Array:
    """Return the body wrench of the hands' wrenches less the one planned for."""
    arrays = answer.parts.transports @ answer.arrays.wrenches[:, :, None]
    return np.asarray(-answer.wrench - np.add.reduce(arrays).ravel())


def _joint_torque(answer: Answer, hands: Sequence[HandPlan] | None) -> dict[str, Array] | None:
    """Return the torques of all joints [N·m], as the hands' wrenches make them."""
    if answer.where is None or hands is None:
        return None
    wrenches = {hand.limb: hand.wrench for hand in hands}
    return {
        limb: joints.torques(wrenches.get(limb, np.zeros(6)))
        for limb, joints in answer.where.joints.items()
    }


def _explain(answer: Answer, utilisation: float) -> tuple[LimitName | None, str]:
    """Return the limit with the largest utilisation, and a sentence about it."""
    most = answer.binding.limiting(answer.used, utilisation, answer.idle)
    if most is None:
        return None, "nothing limits this stance"
    cap, held = answer.question.limits.utilisation, utilisation <= 1.0 + SLACK
    hand = next((hand for hand in answer.hands if hand.limb == most.name.limb), None)
    sentence = limit_sentence(most, hand, held=held)
    if held and utilisation > cap + SLACK:
        sentence += f"; that is beyond the utilisation of {cap:g} that was asked for"
    return most.name, sentence


def _prices(answer: Answer) -> tuple[Price, ...]:
    """Return what more of each limit that binds would take off the utilisation."""
    most = max(answer.idle, key=lambda used: used.utilisation, default=None)
    if most is not None and most.utilisation > answer.utilisation + SLACK:
        # a limb without a hand bears the most: nothing else counts
        price = most.utilisation / most.capacity
        return (Price.of(most.name, price, unit_of(most.name.limit)),)
    return answer.binding.prices(answer.outcome.value)


def _effort_prices(answer: Answer) -> tuple[Price, ...] | None:
    """Return what more of each limit that binds would take off the effort."""
    if answer.least_effort is None:
        return None
    duals = answer.least_effort.limit_duals
    return ActiveLimits(answer.limbs, answer.spaces, duals).prices(answer.cap)
