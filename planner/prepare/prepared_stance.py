"""A question's stance, prepared: all that is known before a solver is asked."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from hand_models.base import Array, InvalidInputError
from planner.prepare.assembly import assemble
from planner.prepare.hand_batch import HandBatch
from planner.prepare.hand_sets import HandSets, Sets
from planner.prepare.joint_posture import Posture, posture
from planner.question import Question

__all__ = ["PreparedStance", "checked_question", "prepare_stance"]


@dataclass(frozen=True, eq=False)
class PreparedStance:
    """All that is known of a question before a solver is asked; the owner of its arrays.

    Attributes
    ----------
    question : Question
    where : Posture or None
        The joints; None if the question says nothing of them.
    batch : HandBatch
        The hands on their holds.
    hands : HandSets
        What the programs need of them.
    wrench : ndarray, shape (6,)
        The body wrench that is planned for, in B [N, N·m].
    """

    question: Question
    where: Posture | None
    batch: HandBatch
    hands: HandSets
    wrench: Array

    @property
    def limbs(self) -> tuple[str, ...]:
        """Of the hands, in the order of all arrays."""
        return tuple([hand.limb for hand in self.question.stance.hands])

    @property
    def floating(self) -> list[str]:
        """Limbs whose hands' wrists float."""
        pairs = zip(self.limbs, self.hands.wrists, strict=True)
        return [limb for limb, wrist in pairs if wrist is not None]

    @cached_property
    def at_rest(self) -> Sets:
        """The hands' sets, of floating ones at rest with idle palms, and the programs' data."""
        return self.hands.sets(self.hands.at_rest(self.hands.idle))

    def turned(self, wrench: Array) -> PreparedStance:
        """Return the same stance for another body wrench, shape (6,) [N, N·m], in B."""
        question = replace(self.question, body_wrench=wrench)
        return replace(self, question=question, hands=self.hands.turned(wrench), wrench=wrench)


def checked_question(question: Question) -> Question:
    """Return a question.

    Raises
    ------
    InvalidInputError
        If it is none.
    """
    if not isinstance(question, Question):
        raise InvalidInputError(f"a Question is needed, got a {type(question).__name__}")
    return question


def prepare_stance(question: Question) -> PreparedStance:
    """Return what is known of a question before a solver is asked.

    Raises
    ------
    InvalidInputError
        If it cannot be understood; the field is relative to the question.
    """
    checked_question(question)
    where = posture(question)
    try:
        wrench = question.needed_wrench(None if where is None else where.body_wrench)
    except InvalidInputError as error:
        raise error.within("load") from None
    return PreparedStance(question, where, *assemble(question, where, wrench), wrench)
