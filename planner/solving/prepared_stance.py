"""What is known of a question before a solver is asked."""

from __future__ import annotations

from typing import NamedTuple

from hand_models.base import Array, InvalidInputError
from planner.prepare import HandBatch, HandSets, Posture, assemble, posture
from planner.question import Question
from planner.solving.prepared_checks import PreparedChecks

__all__ = ["PreparedStance", "checked_question", "prepare_stance"]


class PreparedStance(NamedTuple):
    """All that is known of a question before a solver is asked.

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
    checks : PreparedChecks or None
        What reads and checks its plans; by default it is made with each.
    """

    question: Question
    where: Posture | None
    batch: HandBatch
    hands: HandSets
    wrench: Array
    checks: PreparedChecks | None = None


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
    where = posture(question)
    try:
        wrench = question.needed_wrench(None if where is None else where.body_wrench)
    except InvalidInputError as error:
        raise error.within("load") from None
    return PreparedStance(question, where, *assemble(question, where, wrench), wrench)
