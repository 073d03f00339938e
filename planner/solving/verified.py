"""Recover a plan's numbers from loads, and verify them; the checks are prepared before solving."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from hand_models.hand import SettledHand
from planner import programs
from planner.explanation import LimitUse, joint_name, oddities
from planner.prepare import HandBatch, PreparedStance
from planner.programs import CAP_SLACK, LOAD_UNIT, is_least
from planner.question import LostTile
from planner.result import (
    Finding,
    HandPlan,
    LoadRecovery,
    OpenLoopSample,
    PlanArrays,
    recover_floating_hand,
)
from planner.solving.objective import CappedObjective
from planner.solving.solution import Answer, ByHand, Failed, Solution, Verified
from planner.verification import Check, execution_problems

__all__ = [
    "Checks",
    "beyond_all_loads",
    "execution_passes",
    "idle_joints",
    "prepare_checks",
    "recover",
    "verify",
]


class Checks(NamedTuple):
    """Recovery and checks of the loads of a stance, prepared before there are any loads.

    Attributes
    ----------
    check : Check
        Check that every plan must pass.
    recovery : LoadRecovery or None
        Converts loads of fixed wrists to a plan's numbers; None if a wrist is floating or
        compliant.
    idle : tuple of LimitUse
        Utilisation of the joint torques of limbs without a hand.
    findings : tuple of Finding
        Findings about the geometry of the stance and about likely units of the question's numbers.
    oddities : tuple of str
        Sentences about all that is odd in the stance, the findings included.
    """

    check: Check
    recovery: LoadRecovery | None
    idle: tuple[LimitUse, ...]
    findings: tuple[Finding, ...] = ()
    oddities: tuple[str, ...] = ()

    @property
    def idle_use(self) -> float:
        """Largest utilisation of the joints of limbs without a hand; 0 without such joints."""
        return max([used.utilisation for used in self.idle], default=0.0)

    @property
    def overloaded(self) -> bool:
        """True if a limb without a hand cannot carry its own weight, whatever the body wrench."""
        return self.idle_use > 1.0 + CAP_SLACK

    @classmethod
    def of(
        cls,
        prepared: PreparedStance,
        idle: Sequence[LimitUse] | None = None,
    ) -> Checks:
        """Return recovery and checks of the loads of a stance, without findings.

        Parameters
        ----------
        prepared : PreparedStance
            The question's stance, with hands on their holds and their sets.
        idle : sequence of LimitUse, optional
            Utilisation of the joints of limbs without a hand; computed by default.
        """
        batch, hands = prepared.batch, prepared.hands
        fixed = None if hands.floating else LoadRecovery(batch, hands.spaces, hands.scaled)
        used = idle_joints(prepared) if idle is None else tuple(idle)
        return cls(Check(prepared.question, batch, prepared.where), fixed, used)

    def on(self, prepared: PreparedStance) -> Checks:
        """Return recovery and checks of the same stance with other margins, and the findings."""
        found = Checks.of(prepared, self.idle)
        return found._replace(findings=self.findings, oddities=self.oddities)

    def after_slips(self, prepared: PreparedStance, lost: Sequence[LostTile]) -> Checks:
        """Return recovery and checks of the same stance, whose wrists are fixed, after slips.

        Parameters
        ----------
        prepared : PreparedStance
            The stance with its hands after tiles have slipped.
        lost : sequence of LostTile
            The tiles that have slipped.
        """
        question, batch, hands = prepared.question, prepared.batch, prepared.hands
        check = Check(question, batch, prepared.where, lost, self.check)
        reader = LoadRecovery(batch, hands.spaces, hands.scaled, self.recovery)
        return Checks(check, reader, self.idle)


def prepare_checks(prepared: PreparedStance) -> Checks:
    """Return recovery and checks of the loads of a stance, with the findings about the stance.

    Raises
    ------
    InvalidInputError
        If the stance is impossible; the error's field is relative to the question.
    """
    findings, words = oddities(prepared)
    return Checks.of(prepared)._replace(findings=findings, oddities=words)


def idle_joints(prepared: PreparedStance) -> tuple[LimitUse, ...]:
    """Return the utilisation of the joint torques of limbs without a hand."""
    where = prepared.where
    idle = {} if where is None else where.idle(prepared.question.stance)
    return tuple(
        LimitUse(joint_name(limb, *joint), abs(float(torque)), float(most))
        for limb, loads in idle.items()
        for joints in (loads.driven,)
        for *joint, torque, most in zip(
            joints.names, joints.sliding, joints.gravity, joints.limits, strict=True
        )
    )


def recover(prepared: PreparedStance, checks: Checks, solution: Solution) -> Verified:
    """Compute a plan's numbers from the loads of a solution; `verify` checks these numbers.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.
    checks : Checks
        Recovery and checks of the stance's loads.
    solution : Solution
        A solution that has loads.
    """
    spaces, data = solution.sets
    if checks.recovery is not None:
        arrays, used, effort = checks.recovery.read(solution.loads)
        by_hand: ByHand = partial(arrays.hands, prepared.limbs, prepared.batch, spaces)
    else:
        hands = tuple([_hand(prepared, solution, i) for i in range(len(prepared.limbs))])
        arrays, used = PlanArrays.of(hands), programs.used(data, solution.loads)
        effort, by_hand = programs.used_effort(data, solution.loads), lambda: hands
    utilisation = float(np.maximum.reduce(arrays.utilisations))
    whole = max([utilisation, *(each.utilisation for each in checks.idle)])
    return Verified(solution, arrays, used, effort, utilisation, whole, by_hand)


def _hand(prepared: PreparedStance, solution: Solution, index: int) -> HandPlan:
    """Return what one hand does of a stance of which some float."""
    limb, settled = prepared.limbs[index], prepared.batch.hands[index]
    space, wrist = solution.sets.spaces[index], prepared.hands.wrists[index]
    pose = solution.poses[index]
    if wrist is None or pose is None:
        alone, own = HandBatch.of((settled,)), (space,)
        arrays, _, _ = LoadRecovery(alone, own).read((solution.loads[index],))
        return arrays.hands((limb,), alone, own)[0]
    stiffness, y = prepared.question.stance.limb_stiffness, solution.loads[index]
    return recover_floating_hand(limb, settled, wrist, space, y, pose, stiffness)


def verify(prepared: PreparedStance, checks: Checks, recovered: Verified) -> Verified | Failed:
    """Check recovered loads; return them if every check passes, and otherwise the first error.

    The plan's numbers must pass `Check.problems` and the objective's check, the loads must be
    proven optimal, and their utilisation must not exceed ``solution.most``.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.
    checks : Checks
        Recovery and checks of the stance's loads.
    recovered : Verified
        Numbers from `recover`.
    """
    solution, arrays = recovered.solution, recovered.arrays
    wrong = checks.check.problems(arrays, recovered.whole, prepared.wrench, recovered.effort)
    objective = solution.objective
    if isinstance(objective, CappedObjective):
        value = objective.value(solution.sets.data, solution.loads)
        wrong += objective.problems(arrays, value)
    wrong += solution.faults
    used, most = recovered.utilisation, solution.most
    if not is_least(used, most):
        wrong.append(f"utilisation {used:.6g} is above {most:.6g}, what less tension is worth")
    if not wrong:
        return recovered
    return Failed(solution, f"the solver's plan does not pass the checks: {wrong[0]}")


def beyond_all_loads(prepared: PreparedStance, found: Answer) -> bool:
    """Return whether loads of a plan of fixed wrists exceed `programs.load_box`.

    With such loads the body is balanced where the hard rows nearly contradict the balance.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.
    found : Answer
        Verified loads, a proof of infeasibility, or a failure.
    """
    if prepared.hands.floating or found.utilisation <= 1.0:
        return False
    most = max(np.abs(loads).max(initial=0.0) for loads in found.solution.least.loads)
    return bool(most > programs.load_box(prepared.hands.wrench) * LOAD_UNIT)


def execution_passes(
    prepared: PreparedStance,
    closed: Sequence[SettledHand],
    hands: Sequence[HandPlan],
    sample: OpenLoopSample,
) -> bool:
    """Return whether an equilibrium of displaced hands passes the checks.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.
    closed : sequence of SettledHand
        The hands, displaced and closed.
    hands : sequence of HandPlan
        Loads of the hands in equilibrium.
    sample : OpenLoopSample
        The outcome that is to be reported.
    """
    stance = prepared.question.stance
    # where the hands are displaced, they have other wrenches than those that were given
    free = tuple([replace(place, wrench=None) for place in stance.hands])
    question = replace(prepared.question, stance=replace(stance, hands=free), present={})
    check = Check(question, HandBatch.of(tuple(closed)), prepared.where)
    return not execution_problems(check, hands, sample, prepared.wrench)
