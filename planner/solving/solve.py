"""From a question to a verified plan: settle the hands, solve, read, check, explain."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Final

import numpy as np

from hand_models.base import Array
from hand_models.hand import SettledHand
from planner import deadline, programs
from planner.deadline import Budget, Overlap, Unfinished, late_sentence
from planner.explanation import (
    LEAST_FACTOR,
    NO_FACTOR,
    UNKNOWN,
    UNPROVEN,
    ActiveLimits,
    InfeasibleStance,
    LimitUse,
    certify,
    certify_idle,
    far_wrists,
    idle_preloads,
    joint_name,
    limit_sentence,
    overload_sentence,
    shortfall_sentence,
    strained_preloads,
    tension_path,
    unit_of,
    unsafe_sentence,
)
from planner.floating import (
    NO_WRENCH,
    PROGRAMS,
    LargestFactor,
    WristSolution,
    least_effort,
    least_use,
    most_load,
    with_room,
)
from planner.prepare import HandSets, Posture
from planner.programs import SLACK, SOLVER, Outcome
from planner.question import Question
from planner.result import (
    Certificate,
    HandPlan,
    LimitName,
    Plan,
    PlanArrays,
    Price,
    SolverInfo,
    Status,
    TensionPath,
    Times,
    WristPlan,
    load_recovery_of,
    recover_floating_hand,
)
from planner.solving import dual_bounds
from planner.solving.prepared_checks import PreparedChecks, prepare_checks
from planner.solving.prepared_stance import PreparedStance, checked_question, prepare_stance
from planner.solving.unique_plan import LeastUtilisation, is_least, least_utilisation

__all__ = ["plan", "plan_on"]

BALANCED: Final = 1e-7
"""Distance to the nearest body wrench, relative, below which rounding alone is to blame."""


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
        answer = _Answer(*prepared)
        answer.solve()
        solved = time.perf_counter()
        return answer.read(Times(modelled - start, solved - modelled, 0.0), start)


class _Answer:
    """One question on its way from data to plan."""

    def __init__(
        self,
        question: Question,
        where: Posture | None,
        settled: Sequence[SettledHand],
        hands: HandSets,
        wrench: Array,
        checks: PreparedChecks | None,
    ) -> None:
        self.question = question
        self.where = where
        self.settled = settled
        self.parts = hands
        self.spaces, self.data = hands.sets(hands.at_rest(hands.idle))
        self.wrench = wrench
        self.limbs = [hand.limb for hand in question.stance.hands]
        self.idle = _idle_joints(where, self.limbs)
        self.idle_preloads = idle_preloads(self.limbs, settled, hands.wrists)
        self.search: WristSolution | None = None
        self.least_used: WristSolution | None = None
        self.budget = Budget(PROGRAMS)
        self.known_factor: LargestFactor | None = None
        self.outcome: Outcome
        self.bound: float | None = None
        """Of the least utilisation, from below, where it is known already."""
        self.loads: tuple[Array, ...] = ()
        self.arrays: PlanArrays
        self.used: Array
        self.effort = math.inf
        self.hands: tuple[HandPlan, ...] = ()
        self.least_effort: Outcome | None = None
        self.utilisation = math.inf
        self.wrong: list[str] = []
        self.cap = question.limits.utilisation
        self.certificate: Certificate | None = None
        self.load_factor: float | None = None
        self.least_factor = False
        self.unbounded = False
        self.path: TensionPath | None = None
        self.path_unknown = False
        self.unfinished: list[Unfinished] = []
        self._ready = checks
        self._preparing: Overlap[PreparedChecks] | None = None

    # Solving ------------------------------------------------------------------------------------

    def solve(self) -> None:
        """Find the loads, or the certificate that there are none."""
        if self.parts.floating:
            self._settle_wrists()
        else:
            self._settle_fixed()
        self._settle_effort()
        if not self.outcome.solved or self.wrong:
            if self.outcome.balance_dual is None:
                deadline.check("a plan was found")
            self._look_again()
        if self.certificate is None and (not self.outcome.solved or self.wrong):
            deadline.check("a plan was found, or proven away")
        if "load_factor" in self.question.want:
            self._find_load_factor()

    def _settle_wrists(self) -> None:
        """Find where floating wrists go, and take the plan there."""
        self.search, self.known_factor = least_use(self.parts, self.budget)
        self.least_used = self.search
        self._mind_time("wrists")
        self.outcome = self.search.outcome
        if self.search.exact:
            self._take_search(self.search)
        else:
            self.spaces, self.data = self.parts.sets(self.search.point)

    def _take_search(self, found: WristSolution) -> None:
        """Take the plan that a search for floating wrists has found."""
        self.search = found
        self.spaces, self.data = found.sets
        self._take(found.point.loads)

    def _settle_fixed(self) -> None:
        """Take the plan of least utilisation, of these that of least tensions.

        One solve has its utilisation, and mostly its active rows, which give its last digits; else
        a second solve has these.
        """
        found = self._least()
        self.outcome = found.outcome
        if found.proven:
            self.bound = found.bound
            if found.loads is None:
                self._settle_tie()
            else:
                self._take(found.loads)
            if not self.wrong:
                return
        one, bound = self.outcome, self.bound
        self._settle_in_two()
        if one.solved and not self.outcome.solved and deadline.expired():
            self.outcome, self.bound = one, bound
            self._take(one.loads)
            self._mind_time("least_utilisation")

    def _least(self) -> LeastUtilisation:
        """Solve, and prepare meanwhile what reads and checks the loads."""
        if self._ready is not None:
            return least_utilisation(self.data)
        with Overlap(self._prepare) as self._preparing:
            return least_utilisation(self.data)

    def _settle_in_two(self) -> None:
        """Take the plan of least effort among those of the very least utilisation."""
        self.outcome, self.bound = programs.margin(self.data), None
        self._settle_tie()

    def _settle_tie(self) -> None:
        """Take the plan of least tensions among those of least utilisation."""
        if not self.outcome.solved:
            return
        tidy = programs.least_tensions(self.data, self.outcome.value)
        if tidy.solved:
            self._take(tidy.loads)
        else:
            self._mind_time("tie_break")
        if not tidy.solved or self.wrong:
            self._take(self.outcome.loads)

    def _settle_effort(self) -> None:
        """Take the plan of least effort, if it is asked for and any is within the cap."""
        if self.question.objective != "min_effort" or not self.outcome.solved or self.wrong:
            return
        cap = self.question.limits.utilisation
        if self.search is not None:
            self._settle_floating_effort(self.search, cap)
            return
        if self.outcome.value > cap + SLACK:
            return
        # where the least utilisation is the cap itself, rounding must not empty the set
        self.cap = max(cap, self.outcome.value + 0.5 * SLACK)
        found = programs.effort(self.data, self.cap)
        if not found.solved and deadline.expired():
            self._mind_time("least_effort")
            return
        self.least_effort = found
        if self.least_effort.solved:
            self._take(self.least_effort.loads)
        else:
            self.wrong = [f"least effort: {self.least_effort.status}"]

    def _settle_floating_effort(self, plan: WristSolution, cap: float) -> None:
        """Take the plan of least effort that floating wrists come to from that of least use."""
        used = plan.measure.utilisation
        if used > cap + SLACK:
            return
        self.cap = with_room(cap, used)
        found = least_effort(self.parts, plan, self.cap, self.budget)
        self._mind_time("least_effort")
        if not found.outcome.solved and deadline.expired():
            return
        self.least_effort = found.outcome if found.outcome.solved else None
        self._take_search(found)

    def _take(self, loads: tuple[Array, ...]) -> None:
        """Read these loads, and check them."""
        self.loads = loads
        reader, check, _ = self._checks
        if reader is None:
            self.hands = tuple(self._read_hand(i, y) for i, y in enumerate(loads))
            self.arrays = PlanArrays.of(self.hands)
            self.used = programs.used(self.data, loads)
            self.effort = programs.used_effort(self.data, loads)
        else:
            self.hands = ()
            self.arrays, self.used, self.effort = reader.read(loads)
        self.utilisation = float(np.maximum.reduce(self.arrays.utilisations))
        self.wrong = check.problems(self.arrays, self._whole_utilisation, self.wrench, self.effort)

    @cached_property
    def _checks(self) -> PreparedChecks:
        """What reads and checks plans."""
        if self._ready is not None:
            return self._ready
        return self._prepare() if self._preparing is None else self._preparing.result()

    def _prepare(self) -> PreparedChecks:
        spaces = None if self.parts.floating else self.spaces
        return prepare_checks(self.question, self.where, self.settled, spaces)

    def _read_hand(self, index: int, y: Array) -> HandPlan:
        """Read one hand of a stance of which some float."""
        limb, settled = self.limbs[index], self.settled[index]
        space, wrist, search = self.spaces[index], self.parts.wrists[index], self.search
        if wrist is None or search is None:
            reader = load_recovery_of((settled,), (space,))
            return reader.hands((limb,), reader.read((y,)).arrays)[0]
        pose = WristPlan(y, search.point.palms[index] or "off", search.rounds, search.error)
        return recover_floating_hand(limb, settled, wrist.hand, space, pose)

    def _look_again(self) -> None:
        """Tell no balance at all from a solver that failed."""
        nearest = programs.nearest(self.data)
        far = BALANCED * max(1.0, float(np.linalg.norm(self.data.wrench)))
        if not nearest.solved or nearest.value > far:
            given = len(self.data.wrench) > len(self.wrench)
            if not self._held_floating:
                self.certificate = certify(
                    self._hindered(None), None if given else nearest, self.outcome
                )
            if self.certificate is not None:
                self._mind_explained(self.certificate)
                self.outcome = replace(self.outcome, solved=False)
        elif not self.outcome.solved and not self.parts.floating:
            # rounding put the wrench a hair outside: plan for the nearest that can be had
            inside = programs.body_wrench(self.data, nearest.loads)
            self.data = self.data.turned(inside)
            self._settle_in_two()
            self._settle_effort()

    @property
    def _held_floating(self) -> bool:
        """Whether a floating hand's wrench is given: sets linearised elsewhere prove little."""
        return any(
            hand.wrist == "floating" and hand.wrench is not None
            for hand in self.question.stance.hands
        )

    def _hindered(self, cap: float | None) -> InfeasibleStance:
        """Return what a proof is made of: at any utilisation, or within a cap."""
        limits = self.question.limits
        return InfeasibleStance(self.data, self.limbs, self.spaces, self.parts.held, cap, limits)

    def _overload(self) -> Certificate | None:
        """Return the proof that no plan keeps to the cap on the utilisation; None without one.

        Of floating hands with their sets linearised at the plan.
        """
        cap = self.question.limits.utilisation
        most = max(self.idle, key=lambda used: used.utilisation, default=None)
        beyond = [used for used in self.idle if used.utilisation > cap + SLACK]
        if most is not None and beyond and most.utilisation >= self.utilisation:
            alone: bool | None = len(beyond) == 1
            if self.utilisation > cap + SLACK:
                alone = None if self._unproven else False
            return certify_idle(most, cap, alone)
        if self._unproven:
            return None
        proof = certify(self._hindered(cap), known=self.outcome)
        # what a limb without a hand cannot bear stays in the way, whatever is taken from the hands
        return replace(proof, sufficient=()) if proof is not None and beyond else proof

    def _find_load_factor(self) -> None:
        if any(used.utilisation > 1.0 + SLACK for used in self.idle):
            # a limb without a hand cannot bear itself, whatever the body needs
            return
        if not np.abs(self.data.wrench[:6]).max() > NO_WRENCH:
            # nothing is asked of the hands: any multiple of it can be held, or none
            self.unbounded = self.outcome.solved and self.outcome.value <= 1.0 + SLACK
            return
        if deadline.expired():
            self._mind_time("load_factor")
            return
        if self.least_used is not None:
            most = most_load(self.parts, self.least_used, self.known_factor, self.budget)
            if most is not None:
                self.load_factor, self.least_factor = most.factor, not most.sure
            else:
                self._mind_time("load_factor")
            return
        result = programs.load_factor(self.data)
        if not result.solved:
            self._mind_time("load_factor")
        else:
            scaled = self.data.turned(self.parts.goal(result.value))
            error = programs.body_wrench(scaled, result.loads) - scaled.wrench
            used = max(
                float(np.max(hand.L @ (y / hand.unit) + hand.l0, initial=0.0))
                for hand, y in zip(self.data.hands, result.loads, strict=True)
            )
            if np.abs(error).max() <= SLACK and used <= 1.0 + SLACK:
                self.load_factor = max(result.value, 0.0)

    # Time ---------------------------------------------------------------------------------------

    def _mind_time(self, name: Unfinished) -> None:
        """Note what is not finished, if it is for the time."""
        if deadline.expired():
            self.unfinished.append(name)

    def _mind_explained(self, proof: Certificate) -> None:
        """Note that a proof is not explained, if it is for the time."""
        if proof.irreducible is None or proof.sufficient is None:
            self._mind_time("explanation")

    # Reading ------------------------------------------------------------------------------------

    def read(self, times: Times, start: float) -> Plan:
        """Return the plan, verified."""
        hands: tuple[HandPlan, ...] | None = None
        utilisation: float | None = None
        limiting: LimitName | None = None
        residual: Array | None = None
        verified = False
        status: Status = "failed"
        if self.outcome.solved:
            wrong = self.wrong or self._not_least()
            if wrong:
                reason = f"the solver's plan does not pass the checks: {wrong[0]}"
            else:
                if self._checks.reader is not None:
                    self.hands = self._checks.reader.hands(self.limbs, self.arrays)
                verified, hands = True, self.hands
                utilisation = self._whole_utilisation
                cap = self.question.limits.utilisation
                status = "optimal" if utilisation <= cap + SLACK else "overloaded"
                residual = self._residual()
                limiting, reason = self._explain(utilisation)
                self._find_path()
                if status == "overloaded":
                    self.certificate = self._overload()
                    if self.certificate is None:
                        self._mind_time("certificate")
                    else:
                        self._mind_explained(self.certificate)
                    reason += overload_sentence(self.certificate, floating=self._floating)
        elif self.certificate is not None:
            status = "infeasible"
            verified = True
            touching = any(h.holding.any() or h.palm.engaged for h in self.settled)
            reason = shortfall_sentence(self.certificate, touching, floating=self._floating)
        elif self.search is not None:
            reason = "no pose of the floating wrists was found that balances the body"
            if self._held_floating:
                reason += " with the wrenches that they are given; that is no proof of none"
            if self.idle_preloads:
                reason += f"; {self.idle_preloads[0]}"
        else:
            reason = f"the solver gave no usable answer ({self.outcome.status})"
        return Plan(
            status=status,
            body_wrench=self.wrench,
            utilisation=utilisation,
            effort=self.effort if hands else None,
            load_factor=self.load_factor,
            load_factor_unbounded=self.unbounded,
            limiting=limiting,
            hands=hands,
            prices=self._prices() if hands and "prices" in self.question.want else None,
            effort_prices=self._effort_prices() if hands else None,
            certificate=self.certificate,
            residual=residual,
            joints=None if self.where is None else self.where.angles,
            joint_torque=self._joint_torque(hands),
            joint_torque_limit=None
            if self.where is None
            else {limb: joints.limits for limb, joints in self.where.joints.items()},
            path=self.path,
            verified=verified,
            reason=reason,
            warnings=self._warnings(),
            solver=SolverInfo(SOLVER, self.outcome.status, self.outcome.iterations),
            time=Times(times.model, times.solve, time.perf_counter() - start),
            unfinished=tuple(self.unfinished),
        )

    def _find_path(self) -> None:
        """Find whether the way from the present tensions, if any are given, is safe."""
        if not self.question.present:
            return
        self.path = tension_path(
            self.data,
            self.limbs,
            self.spaces,
            self.loads,
            self.question.present,
            self.question.limits.utilisation,
            self.idle,
        )
        if self.path is None:
            self._mind_time("path")
            self.path_unknown = "path" not in self.unfinished

    def _warnings(self) -> tuple[str, ...]:
        found = self._checks.oddities
        seconds = deadline.seconds()
        if self.unfinished and seconds is not None:
            found += (late_sentence(seconds, self.unfinished),)
        cap = self.question.limits.tendon_tension
        found += (*self.idle_preloads, *strained_preloads(self.limbs, self.parts.wrists, cap))
        if self.outcome.solved:
            found += tuple(far_wrists(self.hands))
        if self._unproven:
            found += (UNPROVEN,)
        if self.path is not None and not self.path.safe:
            found += (unsafe_sentence(self.path),)
        if self.path_unknown:
            found += (UNKNOWN,)
        asked = "load_factor" in self.question.want and not self.unbounded
        asked = asked and "load_factor" not in self.unfinished
        if self.search is not None and asked and self.load_factor is None:
            found += (NO_FACTOR,)
        if self.least_factor:
            found += (LEAST_FACTOR,)
        return found

    def _not_least(self) -> list[str]:
        """Return what is wrong if the multipliers do not prove the plan the best.

        With floating hands, the best of their sets about the plan.
        """
        if self._unproven or "least_utilisation" in self.unfinished:
            return []
        data = self.data
        if self.least_used is not None and self.least_effort is not None:
            # of these sets, which are about another point, the outcome is
            data = self.least_used.sets.data
        bound = self.bound
        if bound is None:
            bound = dual_bounds.least_bound(data, self.outcome)
        used = self.utilisation if self.least_effort is None else self.outcome.value
        if not is_least(used, bound):
            return [f"utilisation {used:.6g} is only proven to be above {bound:.6g}"]
        if self.least_effort is not None:
            effort = self.least_effort.value
            if self.search is not None:
                effort = self.search.measure.effort
            bound = dual_bounds.least_effort_bound(self.data, self.least_effort, self.cap)
            if not is_least(effort, bound):
                return [f"effort {effort:.6g} is only proven to be above {bound:.6g}"]
        return []

    def _residual(self) -> Array:
        """Return the body wrench of the hands' wrenches less the one planned for."""
        arrays = self.parts.transports @ self.arrays.wrenches[:, :, None]
        return np.asarray(-self.wrench - np.add.reduce(arrays).ravel())

    @property
    def _floating(self) -> list[str]:
        pairs = zip(self.limbs, self.parts.wrists, strict=True)
        return [limb for limb, wrist in pairs if wrist is not None]

    @property
    def _unproven(self) -> bool:
        """Whether a search for floating wrists ended without proof."""
        return self.search is not None and self.search.found == "unproven"

    @property
    def _whole_utilisation(self) -> float:
        """The largest of the hands, and of the joints of limbs without one."""
        return max([self.utilisation, *(used.utilisation for used in self.idle)])

    def _joint_torque(self, hands: Sequence[HandPlan] | None) -> dict[str, Array] | None:
        """Return the torques of all joints [N·m], as the hands' wrenches make them."""
        if self.where is None or hands is None:
            return None
        wrenches = {hand.limb: hand.wrench for hand in hands}
        return {
            limb: joints.torques(wrenches.get(limb, np.zeros(6)))
            for limb, joints in self.where.joints.items()
        }

    def _explain(self, utilisation: float) -> tuple[LimitName | None, str]:
        """Return the limit with the largest utilisation, and a sentence about it."""
        most = self._binding.limiting(self.used, utilisation, self.idle)
        if most is None:
            return None, "nothing limits this stance"
        cap, held = self.question.limits.utilisation, utilisation <= 1.0 + SLACK
        hand = next((hand for hand in self.hands if hand.limb == most.name.limb), None)
        sentence = limit_sentence(most, hand, held=held)
        if held and utilisation > cap + SLACK:
            sentence += f"; that is beyond the utilisation of {cap:g} that was asked for"
        return most.name, sentence

    @cached_property
    def _binding(self) -> ActiveLimits:
        """What binds the plan."""
        return ActiveLimits(self.limbs, self.spaces, self.outcome.limit_duals)

    def _prices(self) -> tuple[Price, ...]:
        """Return what more of each limit that binds would take off the utilisation."""
        most = max(self.idle, key=lambda used: used.utilisation, default=None)
        if most is not None and most.utilisation > self.utilisation + SLACK:
            # a limb without a hand bears the most: nothing else counts
            price = most.utilisation / most.capacity
            return (Price(most.name, price, unit_of(most.name.limit)),)
        return self._binding.prices(self.outcome.value)

    def _effort_prices(self) -> tuple[Price, ...] | None:
        """Return what more of each limit that binds would take off the effort."""
        if self.least_effort is None:
            return None
        return ActiveLimits(self.limbs, self.spaces, self.least_effort.limit_duals).prices(self.cap)


def _idle_joints(where: Posture | None, limbs: Sequence[str]) -> list[LimitUse]:
    """Return how much of their joints' torque limbs without a hand use."""
    return [
        LimitUse(joint_name(limb, name), abs(float(torque)), float(most))
        for limb, joints in ({} if where is None else where.joints).items()
        if limb not in limbs
        for name, torque, most in zip(joints.names, joints.gravity, joints.limits, strict=True)
    ]
