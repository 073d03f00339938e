"""What the programs need of a question: its hands' sets, with all that the stance adds to them."""

from __future__ import annotations

import math
from collections.abc import Hashable
from typing import Final

import numpy as np

from hand_models.base import Array, BoundedStore, wrench_transports
from hand_models.fixed_wrist import wrench_spaces
from planner.prepare.hand_batch import HandBatch
from planner.prepare.hand_sets import HandSets, are_own
from planner.prepare.joint_posture import Posture
from planner.prepare.settled_stance import settle_stance, wrist_at
from planner.prepare.stance_constraints import NOTHING, StanceConstraints
from planner.programs import WRENCH_UNIT, ScaledRows, scaled_rows
from planner.question import Question

__all__ = ["assemble"]

FREE: Final = np.zeros((0, 6))
"""What is given of a hand's wrench where nothing is given of any."""

NO_AIMS: Final = np.zeros(0)
"""The values of that."""


KNOWN: Final[BoundedStore[Hashable, tuple[HandBatch, tuple[ScaledRows, ...]]]] = BoundedStore(
    "hands in arrays", 64
)
"""Hands of stances in arrays, and their sets' rows, by the hands and the cap on tensions: those
that were asked for last."""


def assemble(
    question: Question, where: Posture | None, wrench: Array
) -> tuple[HandBatch, HandSets]:
    """Return the hands of a question on their holds, and what the programs need of them.

    Parameters
    ----------
    question : Question
    where : Posture or None
    wrench : ndarray, shape (6,)
        The body wrench that is needed, in B [N, N·m].
    """
    stance, cap = question.stance, question.limits.tendon_tension
    settled = settle_stance(stance)
    wrists = [wrist_at(stance, i, hand, cap) for i, hand in enumerate(settled)]
    added = [_added_rows(question, where, i) for i in range(len(stance.hands))]
    fixed = [hand for hand, wrist in zip(settled, wrists, strict=True) if wrist is None]
    of_fixed = iter(wrench_spaces(fixed, cap))
    spaces = [
        rows.on(next(of_fixed) if wrist is None else wrist.linearised())
        for wrist, rows in zip(wrists, added, strict=True)
    ]
    held, aims = _held(question)

    def made() -> tuple[HandBatch, tuple[ScaledRows, ...]]:
        return HandBatch.of(settled), tuple([scaled_rows(space) for space in spaces])

    own = are_own(wrists, added)
    batch, scaled = made() if own else KNOWN.get((tuple(settled), cap), made)
    hands = HandSets(
        spaces=tuple(spaces),
        scaled=scaled,
        wrists=tuple(wrists),
        transports=wrench_transports(stance.body, [hand.pose for hand in stance.hands]),
        wrench=np.concatenate([wrench / WRENCH_UNIT, aims]) if len(aims) else wrench / WRENCH_UNIT,
        held=held,
        added=tuple(added),
    )
    return batch, hands


def _added_rows(question: Question, where: Posture | None, index: int) -> StanceConstraints:
    """Return what joints, caps and present tensions add to the set of the hand of that index."""
    hand, limits = question.stance.hands[index], question.limits
    cap, change = limits.per_hand.get(hand.limb), limits.tension_change
    if where is None and cap is None and change is None:
        return NOTHING
    frame = None
    if cap is not None:
        axes = {
            "hand": np.eye(3),
            "body": hand.pose.rotation.T @ question.stance.body.rotation,
            "world": hand.pose.rotation.T,
        }
        frame = axes[cap.frame]
    return StanceConstraints(
        joints=None if where is None else where.joints[hand.limb],
        cap=None if cap is None else cap.largest_force,
        frame=frame,
        present=question.present.get(hand.limb),
        change=math.inf if change is None else change,
    )


def _held(question: Question) -> tuple[tuple[Array, ...], Array]:
    """Return what of each hand's wrench is given, (k, 6) each, and its scaled values (k,)."""
    hands = question.stance.hands
    if not any(hand.wrench for hand in hands):
        return (FREE,) * len(hands), NO_AIMS
    given = [
        (i, j, value)
        for i, hand in enumerate(hands)
        for j, value in enumerate(hand.wrench or ())
        if value is not None
    ]
    if not given:
        return (FREE,) * len(hands), NO_AIMS
    held = [np.zeros((len(given), 6)) for _ in hands]
    for row, (i, j, _) in enumerate(given):
        held[i][row, j] = 1.0
    return tuple(held), np.array([value / WRENCH_UNIT[j] for _, j, value in given])
