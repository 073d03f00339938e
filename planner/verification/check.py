"""The check that every plan passes before it leaves: from its numbers back to the rock.

Nothing here is shared with the way the plan was found. The plan's own forces must balance every
joint and tendon (`joint_balance`), which says nothing of the affine maps of Eq. 14, and motors and
winches must fit; wrenches are summed force by force; limits are Eq. 21 itself, the plan's
half-planes (`LimitCurves`) and the structure's published figures; balance is added up about the
body's origin. What is different where a wrist floats is in `floating`, what nails need in `nails`,
what joints and callers ask in `limbs`.

All hands are checked at once, in arrays. What hangs on the hands alone is worked out when a `Check`
is made, before there is a plan. Where numbers are not near enough to be right whatever their size,
it is worked out by how much each is off, and how much it may be (`sentences`).
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from typing import Final

import numpy as np

from hand_models.base import SKEW, Array, BoundedStore
from planner.prepare import HandBatch, Posture
from planner.question import HandOnHold, Question
from planner.result import PlanArrays
from planner.verification.limbs import (
    JointUse,
    check_asked,
    check_limbs,
    check_passive,
    force_use,
)
from planner.verification.recomputation import Recomputing
from planner.verification.sentences import COUNT, UTILISATION

__all__ = ["BALANCE", "Check"]

BALANCE: Final = 1e-6
"""Largest error of the balance, relative to the body wrench (moments over a metre)."""

EFFORT: Final = 1e-6
"""How far the effort may be from what the plan says, relative."""


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

    Attributes
    ----------
    carry : ndarray, shape (6, 6 H)
        From the hands' wrenches on the rock, each in its H, to the rock's reaction in B.
    """

    def __init__(self, question: Question, known: HandBatch, where: Posture | None = None) -> None:
        hands, stance, limits = known.hands, question.stance, question.limits
        self.question, self.where, self.known = question, where, known
        self.limbs = tuple([place.limb for place in stance.hands])
        cap, most = limits.tendon_tension, hands[0].hand.maximum_tension
        self.strength = most if cap is None else min(most, cap)
        self.again = _recomputing(known, stance.hands, self.strength)
        self.floating = [h for h, place in enumerate(stance.hands) if place.wrist == "floating"]
        self.asked = [
            h
            for h, place in enumerate(stance.hands)
            if place.wrench or place.limb in question.present or place.limb in limits.per_hand
        ]
        poses = [place.pose for place in stance.hands]
        into_body = stance.body.rotation.T
        turns = into_body @ np.concatenate([pose.rotation for pose in poses]).reshape(-1, 3, 3)
        levers = (np.array([pose.position for pose in poses]) - stance.body.position) @ into_body.T
        carry = np.zeros((len(poses), 6, 6))
        carry[:, :3, :3] = carry[:, 3:, 3:] = turns
        carry[:, 3:, :3] = (levers @ SKEW.reshape(3, 9)).reshape(-1, 3, 3) @ turns
        self.carry = -carry.transpose(1, 0, 2).reshape(6, -1)

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
        with np.errstate(invalid="ignore", over="ignore"):
            joints = self.joints(found, arrays.wrenches, body_wrench)
            again = self.again.of(found, arrays, self.asked_for(found, arrays, joints))
            if not again.near():
                found.extend(self.again.solved(again).off(self.again.allowed(arrays)))
            used = [float(np.abs(each.shares).max()) for each in joints.values()]
            worst = max([float(np.maximum.reduce(again.hands)), *used])
            if not abs(worst - utilisation) <= UTILISATION * max(1.0, worst):
                found.append(f"plan: utilisation is {worst:.8g}, not {utilisation:.8g}")
            reaction = self.carry @ arrays.wrenches.ravel()
            error, size = math.hypot(*(reaction - body_wrench)), math.hypot(*body_wrench)
            if not error <= BALANCE * max(size, 1.0):
                found.append(f"balance is off by {error:.3g} of {size:.3g}")
            if effort is not None:
                relative = float(arrays.tensions.dot(arrays.tensions)) / self.strength**2
                own = [joints[limb].shares for limb in self.limbs if limb in joints]
                relative += sum(float(shares @ shares) for shares in own)
                if not abs(relative - effort) <= EFFORT * max(1.0, relative):
                    found.append(f"plan: effort is {relative:.8g}, not {effort:.8g}")
        return list(dict.fromkeys(found))

    def joints(self, found: list[str], wrenches: Array, body_wrench: Array) -> dict[str, JointUse]:
        """Check the limbs' joints; return what they bear, by limb."""
        if self.where is None and self.question.stance.joints is None:
            return {}
        told = dict(zip(self.limbs, wrenches, strict=True))
        return check_limbs(found, self.question, told, body_wrench, self.where)

    def asked_for(
        self, found: list[str], arrays: PlanArrays, joints: Mapping[str, JointUse]
    ) -> Array | None:
        """Check what a question asks of its hands; return how much of joints and caps they use."""
        places = self.question.stance.hands
        floats = [h for h, wrist in enumerate(arrays.wrists) if wrist is not None]
        if floats != self.floating:
            found.extend(
                f"{place.limb}: the wrist is not {place.wrist}"
                for h, place in enumerate(places)
                if (h in floats) != (place.wrist == "floating")
            )
        if not (self.asked or joints):
            return None
        used = np.zeros(len(self.limbs))
        allowed = self.again.allowed(arrays)
        for h, limb in enumerate(self.limbs):
            if limb in joints:
                used[h] = np.abs(joints[limb].shares).max()
                check_passive(found, limb, joints[limb], float(allowed[h]))
        for h in self.asked:
            wrench, error = arrays.wrenches[h], float(allowed[h])
            tensions = arrays.tensions[COUNT * h : COUNT * (h + 1)]
            check_asked(found, self.question, places[h], wrench, tensions, error)
            capped, _ = force_use(found, self.question, places[h], wrench, error)
            used[h] = max([used[h], *capped])
        return used


KNOWN: Final[BoundedStore[Hashable, Recomputing]] = BoundedStore("recomputing", 64)
"""What recomputes plans, by the hands, limbs, wrists, strength and preloads: the last ones."""


def _recomputing(known: HandBatch, places: Sequence[HandOnHold], strength: float) -> Recomputing:
    preloads = [place.tendon_preload for place in places]
    told = tuple([None if preload is None else preload.tobytes() for preload in preloads])
    names = tuple([(place.limb, place.wrist) for place in places])
    key = known.hands, names, told, strength
    return KNOWN.get(key, lambda: Recomputing(known, places, strength))
