"""Prepare a question for the solver: hands on their holds, joint torques, all constraint rows."""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from hand_models.base import Array, BoundedStore, InvalidInputError, errors_under, wrench_transports
from hand_models.compliance import FloatingWrist
from hand_models.fixed_wrist import wrench_spaces
from hand_models.hand import SettledHand
from hand_models.wrench_spaces import WrenchSpace
from planner.prepare.hand_batch import HandBatch
from planner.prepare.hand_sets import HandSets, Sets, wrists_at
from planner.prepare.joint_posture import Posture, posture
from planner.prepare.settled_stance import settle_stance
from planner.prepare.stance_constraints import NO_CONSTRAINTS, TOLERANCES, StanceConstraints
from planner.programs import WRENCH_UNIT, ScaledRows
from planner.question import Limits, Question

__all__ = ["PreparedStance", "assemble", "checked_question", "prepare_stance"]

KNOWN_HANDS: Final[
    BoundedStore[Hashable, tuple[HandBatch, list[WrenchSpace], tuple[ScaledRows, ...]]]
] = BoundedStore("hands in arrays", 64)
"""LRU cache of hands with fixed wrists: arrays, wrench spaces and scaled rows.

The key is the settled hands and the cap on tensions."""


@dataclass(frozen=True, eq=False)
class PreparedStance:
    """A question, prepared for the solver: hands on their holds, their sets, and the body wrench.

    Attributes
    ----------
    question : Question
        The question, as it was asked.
    where : Posture or None
        Joint angles and torques; None if the question has no joints.
    batch : HandBatch
        The hands on their holds, as arrays.
    hands : HandSets
        Wrench spaces of the hands, as the programs need them.
    wrench : ndarray, shape (6,)
        Body wrench that is planned for, in the body frame B [N, N·m].
    limbs : tuple of str
        Limb of each hand, in the order of all arrays.
    """

    question: Question
    where: Posture | None
    batch: HandBatch
    hands: HandSets
    wrench: Array
    limbs: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        limbs = tuple([hand.limb for hand in self.question.stance.hands])
        object.__setattr__(self, "limbs", limbs)

    @property
    def floating(self) -> list[str]:
        """Limbs whose hands have a compliant or floating wrist."""
        pairs = zip(self.limbs, self.hands.wrists, strict=True)
        return [limb for limb, wrist in pairs if wrist is not None]

    @property
    def needs_hands(self) -> bool:
        """True if the body wrench is not zero, so that the hands must carry it."""
        return bool(np.abs(self.hands.wrench[:6]).max() > TOLERANCES.body_wrench)

    @property
    def at_rest(self) -> Sets:
        """Wrench spaces of all hands; of compliant or floating hands at rest with idle palms."""
        hands = self.hands
        if hands.floating:
            return hands.sets(hands.at_rest())
        return Sets(hands.spaces, hands.data)

    def turned(self, wrench: Array) -> PreparedStance:
        """Return the same stance for another body wrench, shape (6,) [N, N·m], in B."""
        question = self.question.turned(wrench)
        wrench = question.needed_wrench()
        return PreparedStance(question, self.where, self.batch, self.hands.turned(wrench), wrench)

    def with_hands(self, settled: Sequence[SettledHand]) -> PreparedStance:
        """Return the same stance with other settled hands; body, joints and constraints stay.

        Parameters
        ----------
        settled : sequence of SettledHand
            One for each hand of the stance, in its order.

        Raises
        ------
        InvalidInputError
            If a floating hand cannot have its preload there; the field begins with
            ``stance.hands``.
        """
        stance, cap = self.question.stance, self.question.limits.tendon_tension
        wrists = wrists_at(stance, settled, cap)
        spaces = _spaces_of(settled, wrists, self.hands.added, cap)
        hands = self.hands.with_sets(spaces, wrists)
        return replace(self, batch=HandBatch.of(settled), hands=hands)

    def with_margins(self, limits: Limits) -> PreparedStance:
        """Return the same stance with limits whose margins are others, and all else is the same."""
        limits = limits.with_share(1.0)
        names = {"hold_margin": "margin", "palm_margin": "palm", "least_tension": "least"}
        own = {rows: getattr(limits, name) for name, rows in names.items()}
        added = tuple([replace(each, **own) for each in self.hands.added])
        other = replace(self, question=replace(self.question, limits=limits))
        other = replace(other, hands=replace(self.hands, added=added))
        return other.with_hands(self.batch.hands)


def checked_question(question: Question) -> Question:
    """Return a question unchanged, after a check of its type.

    Raises
    ------
    InvalidInputError
        If the argument is no `Question`.
    """
    if not isinstance(question, Question):
        raise InvalidInputError(f"a Question is needed, got a {type(question).__name__}")
    return question


def prepare_stance(question: Question) -> PreparedStance:
    """Prepare a question for the solver.

    Returns
    -------
    PreparedStance
        Hands closed on their holds, joint torques, wrench spaces and the body wrench. Without
        margins if these need not be kept: `PreparedStance.with_margins` adds what can be.

    Raises
    ------
    InvalidInputError
        If the question is not valid; the field is relative to the question.
    """
    if checked_question(question).limits.margins == "if_possible":
        question = replace(question, limits=question.limits.with_share(0.0))
    where = posture(question)
    with errors_under("load"):
        wrench = question.needed_wrench(None if where is None else where.weights)
    return PreparedStance(question, where, *assemble(question, where, wrench), wrench)


def assemble(
    question: Question, where: Posture | None, wrench: Array
) -> tuple[HandBatch, HandSets]:
    """Close the hands of a question on their holds, and compute their wrench spaces.

    Parameters
    ----------
    question : Question
        Stance, load, limits and objective.
    where : Posture or None
        Joint angles and torques; None if joints are not known.
    wrench : ndarray, shape (6,)
        Body wrench that is planned for, in B [N, N·m].

    Returns
    -------
    batch : HandBatch
        The settled hands, as arrays.
    hands : HandSets
        Their wrench spaces with all rows that the stance adds.
    """
    stance, cap = question.stance, question.limits.tendon_tension
    settled = tuple(settle_stance(stance))
    wrists = wrists_at(stance, settled, cap)
    added = _added_rows(question, where)

    def made() -> tuple[HandBatch, list[WrenchSpace], tuple[ScaledRows, ...]]:
        spaces = _spaces_of(settled, wrists, added, cap)
        return HandBatch.of(settled), spaces, tuple(map(ScaledRows.of, spaces))

    # sets are of this stance alone where a wrist floats, or the stance adds rows
    own = any(each is not None for each in wrists) or any(
        each is not NO_CONSTRAINTS for each in added
    )
    batch, spaces, scaled = made() if own else KNOWN_HANDS.get((settled, cap), made)
    held, aims = _held(question)
    transports = wrench_transports(stance.body, [hand.pose for hand in stance.hands])
    needed = np.concatenate([wrench / WRENCH_UNIT, aims]) if len(aims) else wrench / WRENCH_UNIT
    return batch, HandSets.of(spaces, wrists, transports, needed, held, added, scaled)


def _spaces_of(
    settled: Sequence[SettledHand],
    wrists: Sequence[FloatingWrist | None],
    added: Sequence[StanceConstraints],
    cap: float | None,
) -> list[WrenchSpace]:
    """Return the sets of hands with what the stance adds to them; ``cap`` is on tensions [N]."""
    fixed = [hand for hand, wrist in zip(settled, wrists, strict=True) if wrist is None]
    of_fixed = iter(wrench_spaces(fixed, cap))
    plain = [next(of_fixed) if wrist is None else wrist.linearised() for wrist in wrists]
    pairs = zip(plain, added, strict=True)
    return [each if rows is NO_CONSTRAINTS else rows.on(each) for each, rows in pairs]


def _added_rows(question: Question, where: Posture | None) -> tuple[StanceConstraints, ...]:
    """Return what joints, caps and present tensions add to the set of each hand."""
    stance, limits = question.stance, question.limits
    change = limits.tension_change
    hold = limits.hold_margin or 0.0
    margins = max(hold, limits.least_tension, limits.palm_margin) > 0.0
    found = []
    for hand in stance.hands:
        cap, frame = limits.per_hand.get(hand.limb), None
        if where is None and cap is None and change is None and not margins:
            found.append(NO_CONSTRAINTS)
            continue
        if cap is not None:
            axes = {
                "hand": np.eye(3),
                "body": hand.pose.rotation.T @ stance.body.rotation,
                "world": hand.pose.rotation.T,
            }
            frame = axes[cap.frame]
        found.append(
            StanceConstraints(
                joints=None if where is None else where.joints[hand.limb],
                cap=None if cap is None else cap.most,
                frame=frame,
                present=question.present.get(hand.limb),
                change=math.inf if change is None else change,
                margin=hold,
                least=limits.least_tension,
                palm=limits.palm_margin,
            )
        )
    return tuple(found)


def _held(question: Question) -> tuple[tuple[Array, ...], Array]:
    """Return what of each hand's wrench is given, (k, 6) each, and its scaled values (k,)."""
    hands, free = question.stance.hands, np.zeros((0, 6))
    if not any(hand.wrench for hand in hands):
        return (free,) * len(hands), np.zeros(0)
    given = [
        (i, j, value)
        for i, hand in enumerate(hands)
        for j, value in enumerate(hand.wrench or ())
        if value is not None
    ]
    if not given:
        return (free,) * len(hands), np.zeros(0)
    held = [np.zeros((len(given), 6)) for _ in hands]
    for row, (i, j, _) in enumerate(given):
        held[i][row, j] = 1.0
    return tuple(held), np.array([value / WRENCH_UNIT[j] for _, j, value in given])
