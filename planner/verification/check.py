"""The check that every plan passes before it leaves: from its numbers back to the rock.

Nothing here is shared with the way the plan was found. The plan's own forces must balance every
joint and tendon (`joint_balance`), which says nothing of the affine maps of Eq. 14, and motors and
winches must fit; wrenches are summed force by force; limits are Eq. 21 itself (`limit_curve`), the
plan's half-planes and the structure's published figures; balance is added up about the body's
origin. What is different where a wrist floats is in `verify_floating`, what nails need in
`verify_nails`, what joints and callers ask in `verify_limbs`.

All hands are checked at once, in arrays. What hangs on the hands alone is worked out when a `Check`
is made, before there is a plan. Where numbers are not near enough to be right whatever their size,
it is worked out by how much each is off, and how much it may be; `verify_words` says so.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from typing import Final

import numpy as np

from hand_models.base import Array, BoundedStore
from hand_models.hand import FINGERS, SettledHand
from planner.prepare import HandBatch, Posture
from planner.question import HandOnHold, Question
from planner.result import HandPlan, PlanArrays
from planner.verification.arrays import CROSS, LOAD, UTILISATION, roles_of
from planner.verification.limbs import LimbUse, check_asked, check_limbs, force_use
from planner.verification.recomputation import STOP, Recomputing
from planner.verification.sentences import Recomputed

__all__ = ["BALANCE", "LOAD", "STOP", "UTILISATION", "Check", "problems"]

BALANCE: Final = 1e-6
"""Largest error of the balance, relative to the body wrench (moments over a metre)."""

EFFORT: Final = 1e-6
"""How far the effort may be from what the plan says, relative."""

NO_LIMBS: Final = LimbUse({}, {})

COUNT: Final = len(FINGERS)


def problems(
    question: Question,
    settled: Sequence[SettledHand],
    hands: Sequence[HandPlan],
    utilisation: float,
    body_wrench: Array,
    where: Posture | None = None,
    effort: float | None = None,
) -> list[str]:
    """Return what is wrong with a plan, each in a sentence; nothing if it may leave.

    Parameters
    ----------
    question : Question
    settled : sequence of SettledHand
        The hands on their holds.
    hands : sequence of HandPlan
        The plan's numbers.
    utilisation : float
        The plan's.
    body_wrench : ndarray, shape (6,)
        The one planned for, in B.
    where : Posture, optional
        The joints; None if the question says nothing of them.
    effort : float, optional
        The plan's.
    """
    check = Check(question, HandBatch.of(settled), where)
    found = [
        f"{place.limb}: the plan is of {hand.limb}"
        for place, hand in zip(question.stance.hands, hands, strict=True)
        if place.limb != hand.limb
    ]
    return found + check.problems(PlanArrays.of(hands), utilisation, body_wrench, effort)


class Check:
    """What every plan for a stance must pass, made once for its settled hands.

    Parameters
    ----------
    question : Question
        Its body wrench only counts where joints bear the robot's own weight.
    known : HandBatch
        The hands on their holds.
    where : Posture, optional
        The joints; None if the question says nothing of them.
    """

    def __init__(self, question: Question, known: HandBatch, where: Posture | None = None) -> None:
        hands, stance, limits = known.hands, question.stance, question.limits
        self.question, self.where, self.known = question, where, known
        self.limbs = tuple([place.limb for place in stance.hands])
        cap, most = limits.tendon_tension, hands[0].hand.maximum_tension
        self.strength = most if cap is None else min(most, cap)
        self.again = _recomputing(known, self.limbs, self.strength, stance.hands)
        self.floating = [h for h, place in enumerate(stance.hands) if place.wrist == "floating"]
        self.asked = [
            h
            for h, place in enumerate(stance.hands)
            if place.wrench or place.limb in question.present or place.limb in limits.per_hand
        ]
        self.drawing = self._drawing() if hands[0].hand.finger.friction > 0.0 else []
        poses = [place.pose for place in stance.hands]
        turns = np.concatenate([pose.rotation for pose in poses])
        self.turns = turns.reshape(-1, 3, 3).transpose(0, 2, 1)
        self.at = np.array([pose.position for pose in poses]).T - stance.body.position[:, None]

    def _drawing(self) -> list[int]:
        """Return fingers of fixed hands whose tendon draws a tile or a nail along rock."""
        places = self.question.stance.hands
        return [
            i
            for i, holds in enumerate(self.known.touch.holding)
            if holds and places[i // COUNT].wrist == "fixed"
        ]

    # Checking -----------------------------------------------------------------------------------

    def problems(
        self,
        arrays: PlanArrays,
        utilisation: float,
        body_wrench: Array,
        effort: float | None = None,
    ) -> list[str]:
        """Return what is wrong with a plan, each in a sentence; nothing if it may leave.

        Parameters
        ----------
        arrays : PlanArrays
            The plan's numbers.
        utilisation : float
            The plan's.
        body_wrench : ndarray, shape (6,)
            The one planned for, in B.
        effort : float, optional
            The plan's.
        """
        found: list[str] = []
        limbs = NO_LIMBS
        # numbers that are not finite are off, too
        with np.errstate(invalid="ignore", over="ignore"):
            if self.where is not None or self.question.stance.joints is not None:
                wrenches = dict(zip(self.limbs, arrays.wrenches, strict=True))
                limbs = check_limbs(found, self.question, wrenches, body_wrench, self.where)
            again = self.again.of(found, arrays, self._asked_for(found, arrays, limbs))
            if not self.again.near(again):
                self._look(found, again)
            if self.drawing:
                self._stick(found, again)
            worst = max([float(np.maximum.reduce(again.hands)), *limbs.utilisation.values()])
            if not abs(worst - utilisation) <= UTILISATION * max(1.0, worst):
                found.append(f"plan: utilisation is {worst:.8g}, not {utilisation:.8g}")
            error, size = self._off_balance(arrays.wrenches, body_wrench)
            if not error <= BALANCE * max(size, 1.0):
                found.append(f"balance is off by {error:.3g} of {size:.3g}")
            if effort is not None:
                relative = float(arrays.tensions.dot(arrays.tensions)) / self.strength**2
                relative += sum(limbs.effort[limb] for limb in self.limbs if limb in limbs.effort)
                if not abs(relative - effort) <= EFFORT * max(1.0, relative):
                    found.append(f"plan: effort is {relative:.8g}, not {effort:.8g}")
        return list(dict.fromkeys(found))

    def _look(self, found: list[str], again: Recomputed) -> None:
        """Say what is off by more than it may be."""
        again = self.again.solved(again)
        arrays, roles = again.arrays, roles_of(self.known.places)
        most = self.again.allowed(arrays).take(roles.hand)
        beyond = np.flatnonzero(~(again.off <= most))
        found.extend(again.loads_off(beyond, roles.ends))
        used, told = again.used, again.told
        most = roles.relative * np.maximum(np.abs(used), 1.0)
        wrong = np.flatnonzero(~(np.abs(used - told) <= most)).tolist()
        found.extend(again.use(i, float(used[i]), float(told[i])) for i in wrong)
        found.extend(map(again.stop, np.flatnonzero(~(again.stops >= -STOP)).tolist()))
        found.extend(again.idle())
        spines = np.array_equal(arrays.engagement, self.known.engagement)
        for h, hand in enumerate(self.known.hands):
            same = arrays.tiles[h] is hand.tiles and arrays.engaged[h] == hand.palm.engaged
            if not (spines and same):
                found.extend(again.contacts_told(h))

    def _stick(self, found: list[str], again: Recomputed) -> None:
        """Say which tendons friction would hold, where they were slackened."""
        allowed = self.again.allowed(again.arrays)
        for finger in self.drawing:
            hand = self.known.hands[finger // COUNT]
            slack = hand.closing_tension - again.arrays.tensions[finger]
            if not slack <= allowed[finger // COUNT]:
                found.append(again.slack(finger))

    def _off_balance(self, wrenches: Array, body_wrench: Array) -> tuple[float, float]:
        """Return how far the reactions of the rock are from a body wrench, and its size."""
        # forces and moments about the body's origin, in axes of W
        off = body_wrench.reshape(2, 3) @ self.question.stance.body.rotation.T
        in_world = wrenches.reshape(-1, 2, 3) @ self.turns
        off += np.add.reduce(in_world)
        off[1] += (self.at @ in_world[:, 0]).ravel() @ CROSS
        error = off.ravel()
        return math.sqrt(error.dot(error)), math.sqrt(body_wrench.dot(body_wrench))

    def _asked_for(self, found: list[str], arrays: PlanArrays, limbs: LimbUse) -> Array | None:
        """Check what a question asks of its hands; return how much of joints and caps they use."""
        places = self.question.stance.hands
        floats = [h for h, wrist in enumerate(arrays.wrists) if wrist is not None]
        if floats != self.floating:
            found.extend(
                f"{place.limb}: the wrist is not {place.wrist}"
                for h, place in enumerate(places)
                if (h in floats) != (place.wrist == "floating")
            )
        if not (self.asked or limbs.utilisation):
            return None
        used = np.array([limbs.utilisation.get(limb, 0.0) for limb in self.limbs])
        allowed = self.again.allowed(arrays)
        for h in self.asked:
            wrench, error = arrays.wrenches[h], float(allowed[h])
            tensions = arrays.tensions[COUNT * h : COUNT * (h + 1)]
            check_asked(found, self.question, places[h], wrench, tensions, error)
            used[h] = max(used[h], force_use(found, self.question, places[h], wrench, error))
        return used


KNOWN: Final[BoundedStore[Hashable, Recomputing]] = BoundedStore("recomputing", 64)
"""What recomputes plans, by the hands, limbs, strength and preloads: those asked for last."""


def _recomputing(
    known: HandBatch, limbs: tuple[str, ...], strength: float, places: Sequence[HandOnHold]
) -> Recomputing:
    preloads = [place.tendon_preload for place in places]
    told = tuple([None if tensions is None else tuple(tensions) for tensions in preloads])
    key = known.hands, limbs, strength, told
    return KNOWN.get(key, lambda: Recomputing(known, limbs, strength, preloads))
