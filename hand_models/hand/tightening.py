"""Order in which a hand's parts move as its tendons are tightened (Section 3.2).

Each moving part of a finger resists the tendon with a preload p and a spring K, and moves by x when
the tendon's tension f, times the friction loss M and the part's pulley radius or ratio r, exceeds
both:

    f M r = p + K x.

So the part starts at p / (M r), and is at rest, at its end of travel or on the rock, at
(p + K x)/(M r). The fingernail turns until it is retracted (or hooks), each joint until its phalanx
rests; the tiles slide until they catch the rock at the closing tension. The springs are meant to
order these: nail, then joints from the base outward, then tiles.
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
    """Motion of one part of a finger while its tendon is tightened.

    Attributes
    ----------
    part : str
        ``nail``, a phalanx (for its joint), or ``tiles``.
    starts, ends : float
        Tension of the tendon at which the part begins to move and is at rest [N].
    """

    part: str
    starts: float
    ends: float


class ClosingSequence(NamedTuple):
    """Order in which the parts of one finger close.

    Attributes
    ----------
    finger : str
        One of `FINGERS`.
    stages : tuple of ClosingStage
        Nail, joints from the base outward, tiles.
    in_order : bool
        Whether nail and joints move one after the other, as Section 3.2 intends: each starts no
        sooner than the one before it ends.
    closure : str
        How the finger has ended its closing; see `SettledHand.closures`.
    """

    finger: str
    stages: tuple[ClosingStage, ...]
    in_order: bool
    closure: str


def resting_tensions(model: FingerModel, turns: Array, losses: Array) -> Array:
    """Return the tensions (p + K q) / (M r) that balance the springs of joints at angles q.

    Parameters
    ----------
    model : FingerModel
        Preloads p, stiffnesses K and pulley radii r of the joints.
    turns : ndarray, shape (..., 3)
        q, angle of each joint [rad].
    losses : ndarray, shape (..., 3)
        Diagonals of M, friction losses of the tendon (Eq. 8).

    Returns
    -------
    ndarray, shape (..., 3)
        Tension for each joint [N].
    """
    springs = np.asarray(model.joint_preload) + np.asarray(model.joint_stiffness) * turns
    return np.asarray(springs / (losses * np.asarray(model.pulley_radii)))


def closing_sequence(settled: SettledHand) -> tuple[ClosingSequence, ...]:
    """Return the order in which each finger of a settled hand has closed, with its tensions.

    A joint that the rock has pushed open, or that is at its lower limit, has not been closed by the
    tendon: its stage ends where it starts. The tiles' preload is not published, so it is taken as
    zero, and ``in_order`` ignores the tiles.

    Parameters
    ----------
    settled : SettledHand

    Returns
    -------
    tuple of ClosingSequence, length 4
        Sequence of each finger, in the order of `FINGERS`.
    """
    hand = settled.hand
    nail = hand.nail
    sequence = []
    for i, (name, finger) in enumerate(zip(FINGERS, settled.fingers, strict=True)):
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
