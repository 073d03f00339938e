"""Plan a stance without each of its tiles, fingers and hands, one at a time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import get_args

from planner import deadline
from planner.prepare import checked_question, prepare_stance
from planner.question import Question
from planner.recovery.recovery import Recovered, Recovery
from planner.result import Loss, LossKind, Redundancy, Status
from planner.solving import Infeasible

__all__ = ["find_redundancy"]


def find_redundancy(question: Question) -> Redundancy:
    """Plan a stance without each of its tiles, fingers and hands, one at a time.

    Parameters
    ----------
    question : Question
        The stance, load and limits; plans are those of least utilisation, whatever the objective.

    Raises
    ------
    InvalidInputError
        If the question is not valid; an `UnsupportedError` as by `Recovery`.
    DeadlineError
        If the deadline passes before all losses are planned.
    """
    bare = replace(checked_question(question).bare(), objective="max_margin", present={})
    recovery = Recovery(prepare_stance(bare))
    whole = recovery.plan(())
    losses = list(_losses(recovery))
    held: dict[LossKind, list[int]] = {}
    worst: dict[LossKind, Loss] = {}
    for kind in get_args(LossKind):
        own = [loss for loss in losses if loss.kind == kind]
        if own:
            held[kind] = [sum(loss.holds for loss in own), len(own)]
            # of mirror images, which differ by rounding, the first
            worst[kind] = max(own, key=_rounded)
    return Redundancy(None if whole.verified is None else whole.utilisation, losses, held, worst)


def _losses(recovery: Recovery) -> Iterator[Loss]:
    """Yield the plan without each tile, then without each finger, then without each hand."""
    tiles = recovery.tiles
    for tile in tiles:
        yield _loss(recovery.plan([tile]), "tile", tile.limb, tile.finger, tile.phalanx)
    # in the order of the tiles, hand by hand
    for limb, finger in dict.fromkeys((tile.limb, tile.finger) for tile in tiles):
        yield _loss(recovery.plan((), released=[(limb, finger)]), "finger", limb, finger)
    for limb in recovery.prepared.limbs:
        yield _loss(recovery.plan((), off=[limb]), "hand", limb)


def _loss(found: Recovered, kind: LossKind, *names: str) -> Loss:
    """Return what a plan without a part says of it."""
    deadline.check("all losses were planned")
    status: Status = "failed"
    if found.verified is not None:
        status = "optimal" if found.holds else "overloaded"
    elif isinstance(found.found.answer, Infeasible):
        status = "infeasible"
    used = None if found.verified is None else float(found.utilisation)
    limb, finger, phalanx = (*names, None, None)[:3]
    assert limb is not None
    return Loss(kind, limb, finger, phalanx, status, used, status != "failed")


def _rounded(loss: Loss) -> float:
    return math.inf if loss.utilisation is None else round(loss.utilisation, 4)
