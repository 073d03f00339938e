"""What reading and checking plans needs of the hands alone, made before there are loads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from hand_models.hand import SettledHand
from hand_models.wrench_spaces import WrenchSpace
from planner.explanation import warnings
from planner.prepare import Posture
from planner.question import Question
from planner.result import LoadRecovery, load_recovery_of
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


def prepare_checks(
    question: Question,
    where: Posture | None,
    settled: Sequence[SettledHand],
    spaces: Sequence[WrenchSpace] | None,
) -> PreparedChecks:
    """Return what reading and checking plans needs of the hands alone.

    It changes nothing but caches that threads may share, so it may run beside a solver.

    Parameters
    ----------
    question : Question
    where : Posture or None
        The joints; None if the question says nothing of them.
    settled : sequence of SettledHand
        The hands on their holds.
    spaces : sequence of WrenchSpace or None
        Their sets; None where a wrist floats.
    """
    return PreparedChecks(
        reader=None if spaces is None else load_recovery_of(settled, spaces),
        check=Check(question, settled, where),
        oddities=warnings(question.stance, settled),
    )
