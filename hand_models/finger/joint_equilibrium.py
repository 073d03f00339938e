"""Where a phalanx that gives way swings back to: where its joint balances (Section 5.7).

With no rock that presses on it, a phalanx is held by the spines of its tile alone, if they still
reach the rock. Where its joint balances, phalanges beyond it bear; a little closer the joint would
be turned back, a little opener turned in. Between two angles tried where that changes, the angle is
narrowed to a small part of the interval: where the torque on the joint runs smoothly at once, where
a contact comes or goes in three steps.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.finger.model import FingerModel
from hand_models.finger.posture_loads import TendonBatch, left_torque
from hand_models.finger.postures import JOINTS, LOWER, UPPER, Postures, swing
from hand_models.finger.sequential_closure import NONE
from hand_models.sections import SectionRows

__all__ = ["JointEquilibrium"]

ANGLES: Final = 17
"""At which a phalanx without contact is tried."""

PARTS: Final = 2**11
"""Of the interval between two of them, to one of which an angle of balance is narrowed."""

AT_ONCE: Final = 16
"""Places in such an interval that are tried together."""


class _Tries(NamedTuple):
    """Phalanges at angles.

    Attributes
    ----------
    of, phalanx : ndarray of int, shape (n,)
        Whose, and which: 0 or 1, in this order.
    angles : ndarray, shape (n, k)
        At which each is tried [rad].
    """

    of: Indices
    phalanx: Indices
    angles: Array


class JointEquilibrium:
    """Phalanges of fingers that were laid on the rock bottom-up, and may give way.

    Parameters
    ----------
    model : FingerModel
    rock : SectionRows
        Under each finger.
    tendons : TendonBatch
    laid : Postures
    pulls : ndarray, shape (3, n)
        Normal loads of the phalanges as laid, negative where the rock pulls; NaN or infinite where
        they do not balance [N].
    """

    def __init__(
        self,
        model: FingerModel,
        rock: SectionRows,
        tendons: TendonBatch,
        laid: Postures,
        pulls: Array,
    ) -> None:
        self._model, self._rock, self._tendons, self._laid = model, rock, tendons, laid
        self._pulled = (pulls < 0.0) & np.isfinite(pulls).all(axis=0)

    def balances(self, fingers: list[int]) -> tuple[Indices, Postures]:
        """Return fingers with a phalanx where it balances, and which of them each one is."""
        tries = self._tries(fingers)
        row = np.zeros(0, dtype=np.intp)
        if len(tries.of):
            _, torques = self._at(tries)
            turned = torques >= 0.0
            row, place = np.nonzero(turned[:, :-1] & ~turned[:, 1:])
        if not len(row):
            return row, self._laid.take(row)
        begin, end = tries.angles[row, place], tries.angles[row, place + 1]
        parts = _guesses(PARTS * _zero_between(tries.angles[row], torques[row], place))
        high, each = np.full(len(row), PARTS), np.arange(len(row))
        while True:
            angles = begin[:, None] + (end - begin)[:, None] * (parts / PARTS)
            tries = _Tries(tries.of[row], tries.phalanx[row], angles)
            found, torques = self._at(tries)
            # the last of the places tried before the joint is turned back, which it is not at first
            back = ~(torques >= 0.0)
            back[:, 0] = False
            last = np.where(back.any(axis=1), back.argmax(axis=1), AT_ONCE) - 1
            next_one = np.append(parts, high[:, None], axis=1)[each, last + 1]
            low, high, row = parts[each, last], next_one, each
            if (high - low <= 1).all():
                return tries.of, found.take(AT_ONCE * each + last)
            parts = low[:, None] + (high - low)[:, None] * np.arange(AT_ONCE) // AT_ONCE

    def _tries(self, fingers: list[int]) -> _Tries:
        """Return phalanges that may give way, and the angles at which they are tried.

        Those that their contact pulls at, that find no rock of their own, or that put a later one
        into the rock; not the last, as where one balances those beyond it bear.
        """
        pulled, stops, angles = (
            value.tolist() for value in (self._pulled, self._laid.stops, self._laid.angles)
        )
        found = []
        for i in range(JOINTS - 1):
            for of in fingers:
                angle, none = angles[i][of], stops[i][of] == UPPER
                if none or pulled[i][of] or any(later[of] == LOWER for later in stops[i + 1 :]):
                    before = angles[i - 1][of] if i else 0.0
                    reach = angle - before - self._model.joint_lower[i]
                    # one that has been on the rock swings back a little rather than far
                    found.append((of, i, angle, reach, 1 if none else 2))
        whose, which, end, reaches, power = np.reshape(found, (-1, 5)).T
        back = np.linspace(1.0, 0.0, ANGLES) ** power[:, None]
        tried = end[:, None] - reaches[:, None] * back
        return _Tries(whose.astype(np.intp), which.astype(np.intp), tried)

    def _at(self, tries: _Tries) -> tuple[Postures, Array]:
        """Return the fingers of all tries, one after the other, and the torques there, (n, k).

        Those are what turns the joints in with no rock that presses on their own phalanges; NaN
        where nothing beyond them bears [N·m].
        """
        count = tries.angles.shape[1]
        of, proximal = np.repeat(tries.of, count), count * int((tries.phalanx == 0).sum())
        rock, laid = self._rock.take(of), self._laid.take(of)
        found = swing(self._model, rock, laid, proximal, tries.angles.ravel())
        torques = left_torque(self._model, found, self._tendons.take(of), proximal)
        beyond = found.kinds[2] != NONE
        beyond[:proximal] |= found.kinds[1, :proximal] != NONE
        return found, np.where(beyond, torques, np.nan).reshape(tries.angles.shape)


def _guesses(guess: Array) -> Indices:
    """Return places to try first, in order, from 0 on: around a guess, and all over; (n, k)."""
    parts = np.empty((len(guess), AT_ONCE), dtype=np.intp)
    parts[:, ::2] = np.arange(0, PARTS, 2 * PARTS // AT_ONCE)
    parts[:, 1::2] = guess[:, None] + np.arange(AT_ONCE // 2) - AT_ONCE // 4
    return np.sort(np.minimum(np.maximum(parts, 0), PARTS - 1))


def _zero_between(angles: Array, torques: Array, place: Indices) -> Array:
    """Return about which part of the way from a place to the next one torques vanish, shape (n,).

    The angle as a cubic of the torque through the two places before and after, or as a straight
    line if that leads elsewhere.

    Parameters
    ----------
    angles, torques : ndarray, shape (n, k)
        [rad, N·m]
    place : ndarray of int, shape (n,)
    """
    index = np.minimum(np.maximum(place + np.arange(-1, 3)[:, None], 0), angles.shape[1] - 1)
    row = np.arange(len(place))
    angle, torque = angles[row, index], torques[row, index]
    zero = np.zeros(len(place))
    for i, own in enumerate(angle):
        others = np.delete(torque, i, axis=0)
        zero += own * (others / (others - torque[i])).prod(axis=0)
    part = (zero - angle[1]) / (angle[2] - angle[1])
    straight = torque[1] / (torque[1] - torque[2])
    part = np.where((part >= 0.0) & (part <= 1.0), part, straight)
    return np.where(np.isnan(part), 0.5, part)
