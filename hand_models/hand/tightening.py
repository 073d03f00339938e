"""Order in which a hand closes as its tendons are tightened, from its springs (Section 3.2).

Each moving part of a finger holds against the tendon with a preload p and a spring K, and moves by
x when the tendon's tension f at it, times its pulley's radius or ratio r, is more than both:

    f M r = p + K x.

So it starts at p / (M r), and is at rest, at its end of travel or on the rock, at (p + K x)/(M r).
The fingernail turns until it is retracted (or hooks), each joint until its phalanx rests; the tiles
slide until they catch the rock at the closing tension. The springs are meant to do this one after
the other: nail, then joints from the base outward, then tiles.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from hand_models.base import Array
from hand_models.finger import PHALANGES, FingerModel
from hand_models.hand.names import FINGERS, NAIL
from hand_models.hand.settled_hand import SettledHand

__all__ = ["ClosingSequence", "ClosingStage", "closing_sequence", "resting_tensions"]


class ClosingStage(NamedTuple):
    """One part of a finger on its way.

    Attributes
    ----------
    part : str
        ``nail``, a phalanx (for its joint), or ``tiles``.
    starts, ends : float
        Tension of the tendon at which it begins to move and is at rest [N].
    """

    part: str
    starts: float
    ends: float


class ClosingSequence(NamedTuple):
    """Stages in which one finger closes.

    Attributes
    ----------
    finger : str
    stages : tuple of ClosingStage
        Nail, joints from the base outward, tiles.
    in_order : bool
        Whether nail and joints move one after the other, as Section 3.2 wants it: each starts no
        sooner than the one before it ends.
    closure : str
        How it has ended, as of `SettledHand.closures`.
    """

    finger: str
    stages: tuple[ClosingStage, ...]
    in_order: bool
    closure: str


def resting_tensions(model: FingerModel, turns: Array, losses: Array) -> Array:
    """Return the tensions at which joints are at rest that have turned so far [N].

    Parameters
    ----------
    model : FingerModel
    turns : ndarray, shape (..., 3)
        q of each joint [rad].
    losses : ndarray, shape (..., 3)
        Diagonals of M (Eq. 8).
    """
    springs = np.asarray(model.joint_preload) + np.asarray(model.joint_stiffness) * turns
    return np.asarray(springs / (losses * np.asarray(model.pulley_radii)))


def closing_sequence(settled: SettledHand) -> tuple[ClosingSequence, ...]:
    """Return how each finger of a settled hand has closed, in the order of `FINGERS`.

    A joint that the rock has pushed open, or that stands at its lower limit, has not been closed by
    the tendon: its stage is over where it starts. The tiles' preload is not published, so it is
    taken as zero and their start is not judged.

    Parameters
    ----------
    settled : SettledHand
    """
    hand = settled.hand
    nail = hand.nail
    sequence = []
    for i, name in enumerate(FINGERS):
        finger = settled.fingers[i]
        model = finger.model
        turned = nail.preload + nail.stiffness * float(settled.nail_angles[i])
        stages = [
            ClosingStage(NAIL, nail.preload / nail.pulley_radius, turned / nail.pulley_radius)
        ]
        starts, ends = (
            resting_tensions(model, turns, hand.losses[i]).tolist()
            for turns in (np.zeros(len(PHALANGES)), finger.joint_angles)
        )
        for phalanx, start, end in zip(PHALANGES, starts, ends, strict=True):
            start = max(0.0, start)
            stages.append(ClosingStage(phalanx, start, max(start, end)))
        stages.append(ClosingStage("tiles", 0.0, settled.closing_tension))
        ordered = all(
            later.starts >= earlier.ends for earlier, later in itertools.pairwise(stages[:-1])
        )
        sequence.append(ClosingSequence(name, tuple(stages), ordered, settled.closures[i]))
    return tuple(sequence)
