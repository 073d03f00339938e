"""What the programs need of a question: its hands' sets, with all that the stance adds to them."""

from __future__ import annotations

import math

import numpy as np

from hand_models.fixed_wrist import wrench_space
from hand_models.frames import Array, wrench_transport
from hand_models.hand import SettledHand
from hand_models.row_layout import PALM_PRESSING, PALM_SHEAR, TENDON_TENSION
from hand_models.wrench_space import WrenchSpace
from planner.hand_rows import AddedRows
from planner.hand_sets import Hands
from planner.posture import Posture
from planner.question import Question
from planner.settling import settle_at, wrist_at
from planner.stance_data import LOAD_UNIT, WRENCH_UNIT

__all__ = ["gather"]


def gather(
    question: Question, where: Posture | None, wrench: Array
) -> tuple[list[SettledHand], Hands]:
    """Return the hands of a question on their holds, and what the programs need of them.

    Parameters
    ----------
    question : Question
    where : Posture or None
    wrench : ndarray, shape (6,)
        The body wrench that is needed, in B [N, N·m].
    """
    stance, cap = question.stance, question.limits.tendon_tension
    settled = [settle_at(stance, i) for i in range(len(stance.hands))]
    wrists = [wrist_at(stance, i, hand, cap) for i, hand in enumerate(settled)]
    added = [_added_rows(question, where, i) for i in range(len(stance.hands))]
    spaces = [
        rows.on(wrench_space(hand, cap) if wrist is None else wrist.linearised())
        for hand, wrist, rows in zip(settled, wrists, added, strict=True)
    ]
    body = stance.body.inverse()
    held, aims = _held(question)
    hands = Hands(
        spaces=tuple(spaces),
        wrists=tuple(wrists),
        transports=tuple(wrench_transport(body @ hand.pose) for hand in stance.hands),
        reaches=tuple(
            _reach(space) if wrist is None else None
            for space, wrist in zip(spaces, wrists, strict=True)
        ),
        wrench=np.concatenate([wrench / WRENCH_UNIT, aims]),
        held=held,
        added=tuple(added),
    )
    return settled, hands


def _added_rows(question: Question, where: Posture | None, index: int) -> AddedRows:
    """Return what joints, caps and present tensions add to the set of the hand of that index."""
    hand, limits = question.stance.hands[index], question.limits
    cap = limits.per_hand.get(hand.limb)
    axes = {
        "hand": np.eye(3),
        "body": hand.pose.rotation.T @ question.stance.body.rotation,
        "world": hand.pose.rotation.T,
    }
    change = limits.tension_change
    return AddedRows(
        joints=None if where is None else where.joints[hand.limb],
        cap=None if cap is None else cap.largest_force,
        frame=None if cap is None else axes[cap.frame],
        present=question.present.get(hand.limb),
        change=math.inf if change is None else change,
    )


def _held(question: Question) -> tuple[tuple[Array, ...], Array]:
    """Return what of each hand's wrench is given, (k, 6) each, and its scaled values (k,)."""
    hands = question.stance.hands
    given = [
        (i, j, value)
        for i, hand in enumerate(hands)
        for j, value in enumerate(hand.wrench or ())
        if value is not None
    ]
    held = [np.zeros((len(given), 6)) for _ in hands]
    for row, (i, j, _) in enumerate(given):
        held[i][row, j] = 1.0
    return tuple(held), np.array([value / WRENCH_UNIT[j] for _, j, value in given])


def _reach(space: WrenchSpace) -> Array:
    """Return what each column's load is measured by in the tie-break [N].

    Its own capacity where it has one (tendons, the palm); `LOAD_UNIT` for lateral reactions.
    """
    reach = np.full(len(space.columns), LOAD_UNIT)
    for coefficients, row, capacity in zip(space.L, space.rows, space.s, strict=False):
        if row.limit in (TENDON_TENSION, PALM_SHEAR, PALM_PRESSING):
            reach[np.flatnonzero(coefficients)[0]] = capacity
    return reach
