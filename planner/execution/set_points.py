"""Judge a plan's tensions on hands that are not as planned: kept, or balanced by feedback.

The tensions are set-points: nobody plans anew, and nobody knows the strengths. Wrists are fixed:
with tensions kept, palms and lateral reactions balance the body as far as they can.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hand_models.base import Array
from hand_models.hand import FINGERS
from planner import programs
from planner.prepare import PreparedStance
from planner.programs import CAP_SLACK, LOAD_UNIT, Outcome
from planner.result import LoadRecovery, SentPlan
from planner.verification import Check

__all__ = ["sent_plans"]


def sent_plans(
    there: PreparedStance, tensions: Sequence[Array], idle: float
) -> tuple[SentPlan, SentPlan]:
    """Return what tensions do on other hands: kept as they are, and balanced by feedback.

    Parameters
    ----------
    there : PreparedStance
        Stance with the other hands, all wrists fixed, without margins.
    tensions : sequence of ndarray, shape (4,)
        Planned tensions of each hand [N].
    idle : float
        Largest utilisation of the joints of limbs without a hand.

    Returns
    -------
    kept, feedback : SentPlan
        Verified; a balance that does not pass the checks, or has loads beyond
        `programs.load_box`, counts as none. Feedback changes nothing where the tensions can be
        kept.
    """
    data, held = there.hands.data, []
    for space, own in zip(there.hands.spaces, tensions, strict=True):
        loads = np.full(len(space.columns), np.nan)
        loads[[space.columns.index(f"{finger}/tension") for finger in FINGERS]] = own
        held.append(loads)
    kept = _verified(there, programs.kept(data, held), idle)
    if kept.utilisation is not None:
        return kept, kept
    near = programs.least_change(data, held)
    if not near.solved:
        return kept, SentPlan()
    changed = [np.where(np.isnan(f), f, y) for f, y in zip(held, near.loads, strict=True)]
    return kept, _verified(there, programs.kept(data, changed), idle)


def _verified(there: PreparedStance, outcome: Outcome, idle: float) -> SentPlan:
    """Return what the loads of a program say if they pass the checks of any plan."""
    if not outcome.solved:
        return SentPlan()
    box = programs.load_box(there.hands.wrench) * LOAD_UNIT
    if max(np.abs(loads).max(initial=0.0) for loads in outcome.loads) > box:
        return SentPlan()
    recovery = LoadRecovery(there.batch, there.hands.spaces, there.hands.scaled)
    arrays, _, effort = recovery.read(outcome.loads)
    used = max(float(arrays.utilisations.max()), idle)
    check = Check(there.question, there.batch, there.where)
    if check.problems(arrays, used, there.wrench, effort):
        return SentPlan()
    return SentPlan(used, used <= there.question.limits.utilisation + CAP_SLACK)
