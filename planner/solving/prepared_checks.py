"""What reading and checking plans needs of the hands alone, made before there are loads."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Final, NamedTuple

from hand_models.base import BoundedStore
from planner.explanation import warnings
from planner.prepare import HandBatch, HandSets, Posture
from planner.question import Question
from planner.result import LoadRecovery
from planner.verification import Check

__all__ = ["PreparedChecks", "prepare_checks"]


class PreparedChecks(NamedTuple):
    """What is known of reading and checking before there are loads.

    Attributes
    ----------
    reader : LoadRecovery or None
        Reads loads; None where a wrist floats.
    check : Check
        What every plan must pass.
    oddities : tuple of str
        What is odd about the stance.
    """

    reader: LoadRecovery | None
    check: Check
    oddities: tuple[str, ...]


RECOVERIES: Final[BoundedStore[Hashable, LoadRecovery]] = BoundedStore("load recoveries", 64)
"""What reads loads, by the hands and the cap on tensions: those asked for last."""


def prepare_checks(
    question: Question, where: Posture | None, batch: HandBatch, hands: HandSets
) -> PreparedChecks:
    """Return what reading and checking plans needs of the hands alone.

    It changes nothing but a store that threads may share, so it may run beside a solver.

    Parameters
    ----------
    question : Question
    where : Posture or None
        The joints; None if the question says nothing of them.
    batch : HandBatch
        The hands on their holds.
    hands : HandSets
        Their sets.
    """
    return PreparedChecks(
        reader=None if hands.floating else _reader(batch, hands, question.limits.tendon_tension),
        check=Check(question, batch, where),
        oddities=warnings(question.stance, batch),
    )


def _reader(batch: HandBatch, hands: HandSets, cap: float | None) -> LoadRecovery:
    def made() -> LoadRecovery:
        return LoadRecovery(batch, hands.spaces, hands.scaled)

    return made() if hands.own else RECOVERIES.get((batch.hands, cap), made)
