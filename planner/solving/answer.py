"""One question on its way from data to plan: what is known of it, and what has been found."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from hand_models.base import Array
from planner import deadline, programs
from planner.deadline import Budget, Overlap, Unfinished
from planner.explanation import ActiveLimits, LimitUse, idle_preloads, joint_name
from planner.floating import PROGRAMS, LargestFactor, WristSolution
from planner.prepare import HandBatch, HandSets, Posture
from planner.programs import Outcome
from planner.question import Question
from planner.result import (
    Certificate,
    HandPlan,
    LoadRecovery,
    PlanArrays,
    RobustLoadFactor,
    TensionPath,
    WristPlan,
    recover_floating_hand,
)
from planner.solving.prepared_checks import PreparedChecks, prepare_checks

__all__ = ["Answer"]


class Answer:
    """One question on its way from data to plan: what is known of it, and what has been found."""

    def __init__(
        self,
        question: Question,
        where: Posture | None,
        batch: HandBatch,
        hands: HandSets,
        wrench: Array,
        checks: PreparedChecks | None,
    ) -> None:
        self.question = question
        self.where = where
        self.batch = batch
        self.parts = hands
        self.spaces, self.data = hands.sets(hands.at_rest(hands.idle))
        self.wrench = wrench
        self.limbs = [hand.limb for hand in question.stance.hands]
        self.idle = _idle_joints(where, self.limbs)
        self.idle_preloads = idle_preloads(self.limbs, batch.hands, hands.wrists)
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
        self.robust: RobustLoadFactor | None = None
        self.path: TensionPath | None = None
        self.path_unknown = False
        self.unfinished: list[Unfinished] = []
        self.ready = checks
        """What reads and checks plans, where it is known already."""
        self.preparing: Overlap[PreparedChecks] | None = None
        """What makes it beside a solver."""

    def take_search(self, found: WristSolution) -> None:
        """Take the plan that a search for floating wrists has found."""
        self.search = found
        self.spaces, self.data = found.sets
        self.take(found.point.loads)

    def take(self, loads: tuple[Array, ...]) -> None:
        """Read these loads, and check them."""
        self.loads = loads
        reader, check, _ = self.checks
        if reader is None:
            self.hands = tuple(self._read_hand(i, y) for i, y in enumerate(loads))
            self.arrays = PlanArrays.of(self.hands)
            self.used = programs.used(self.data, loads)
            self.effort = programs.used_effort(self.data, loads)
        else:
            self.hands = ()
            self.arrays, self.used, self.effort = reader.read(loads)
        self.utilisation = float(np.maximum.reduce(self.arrays.utilisations))
        self.wrong = check.problems(self.arrays, self.whole_utilisation, self.wrench, self.effort)

    @cached_property
    def checks(self) -> PreparedChecks:
        """What reads and checks plans."""
        if self.ready is not None:
            return self.ready
        return self.prepare() if self.preparing is None else self.preparing.result()

    def prepare(self) -> PreparedChecks:
        """Return what reads and checks plans, made anew."""
        return prepare_checks(self.question, self.where, self.batch, self.parts)

    def _read_hand(self, index: int, y: Array) -> HandPlan:
        """Read one hand of a stance of which some float."""
        limb, settled = self.limbs[index], self.batch.hands[index]
        space, wrist, search = self.spaces[index], self.parts.wrists[index], self.search
        if wrist is None or search is None:
            reader = LoadRecovery(HandBatch.of((settled,)), (space,))
            return reader.hands((limb,), reader.read((y,))[0])[0]
        pose = WristPlan(y, search.point.palms[index] or "off", search.rounds, search.error)
        return recover_floating_hand(limb, settled, wrist.hand, space, pose)

    def mind_time(self, name: Unfinished) -> None:
        """Note what is not finished, if it is for the time."""
        if deadline.expired():
            self.unfinished.append(name)

    def mind_explained(self, proof: Certificate) -> None:
        """Note that a proof is not explained, if it is for the time."""
        if proof.irreducible is None or proof.sufficient is None:
            self.mind_time("explanation")

    @property
    def held_floating(self) -> bool:
        """Whether a floating hand's wrench is given: sets linearised elsewhere prove little."""
        return any(
            hand.wrist == "floating" and hand.wrench is not None
            for hand in self.question.stance.hands
        )

    @property
    def floating(self) -> list[str]:
        """Limbs whose hands' wrists float."""
        pairs = zip(self.limbs, self.parts.wrists, strict=True)
        return [limb for limb, wrist in pairs if wrist is not None]

    @property
    def unproven(self) -> bool:
        """Whether a search for floating wrists ended without proof."""
        return self.search is not None and self.search.found == "unproven"

    @property
    def whole_utilisation(self) -> float:
        """The largest of the hands, and of the joints of limbs without one."""
        return max([self.utilisation, *(used.utilisation for used in self.idle)])

    @cached_property
    def binding(self) -> ActiveLimits:
        """What binds the plan."""
        return ActiveLimits(self.limbs, self.spaces, self.outcome.limit_duals)


def _idle_joints(where: Posture | None, limbs: Sequence[str]) -> list[LimitUse]:
    """Return how much of their joints' torque limbs without a hand use."""
    return [
        LimitUse(joint_name(limb, name), abs(float(torque)), float(most))
        for limb, joints in ({} if where is None else where.joints).items()
        if limb not in limbs
        for name, torque, most in zip(joints.names, joints.gravity, joints.limits, strict=True)
    ]
