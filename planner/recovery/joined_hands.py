"""Join a hand that has lost tiles of several fingers from hands that have lost those of one each.

The fingers of a hand with a fixed wrist do not depend on each other. So a finger's rows and columns
of the hand's wrench space, and its tiles, are those of the hand that has lost only that finger's
tiles. Rows of the whole hand depend on its wrench alone: each finger adds its own columns to them,
and what it changes of the wrench at zero load.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hand_models.hand import FINGERS, SettledHand
from hand_models.wrench_spaces import WrenchSpace

__all__ = ["JoinedHands"]


class JoinedHands:
    """A hand as it closed, and its wrench space, for joining hands after slips.

    Parameters
    ----------
    hand : SettledHand
        The hand as it closed.
    space : WrenchSpace
        Its wrench space, with the rows that the stance adds.
    """

    def __init__(self, hand: SettledHand, space: WrenchSpace) -> None:
        self._hand, self._space, count = hand, space, len(space.s)
        of_rows = np.array([name.finger or "" for name in space.rows])
        of_columns = np.array([name.partition("/")[0] for name in space.columns])
        self._tiles = [np.flatnonzero(hand.finger_of == finger) for finger in range(len(FINGERS))]
        self._columns = [np.flatnonzero(of_columns == name) for name in FINGERS]
        self._limits = [np.flatnonzero(of_rows[:count] == name) for name in FINGERS]
        self._hard = [np.flatnonzero(of_rows[count:] == name) for name in FINGERS]
        self._of_hand = tuple(
            np.flatnonzero(own == "") for own in (of_rows[:count], of_rows[count:])
        )

    def join(
        self, parts: Mapping[int, tuple[SettledHand, WrenchSpace]]
    ) -> tuple[SettledHand, WrenchSpace]:
        """Return the hand without all tiles of several hands, and its wrench space.

        Parameters
        ----------
        parts : mapping of int to (SettledHand, WrenchSpace)
            For each finger that has lost tiles, or is released, by its index: the hand without
            these alone, with rows of the same names.
        """
        hand, space = self._hand, self._space
        loads, engagement, tiles = hand.loads.copy(), hand.engagement.copy(), list(hand.tiles)
        of_joints = {(finger, joint): torque for finger, joint, torque in hand.stops}
        origin, generators = space.origin.copy(), space.generators.copy()
        L, l0, s, H, h = (each.copy() for each in (space.L, space.l0, space.s, space.H, space.h))
        limits, hard = self._of_hand
        for finger, (settled, alone) in parts.items():
            at, columns = self._tiles[finger], self._columns[finger]
            loads[at], engagement[at] = settled.loads[at], settled.engagement[at]
            tiles[at[0] : at[-1] + 1] = settled.tiles[at[0] : at[-1] + 1]
            of_joints |= {(f, joint): torque for f, joint, torque in settled.stops if f == finger}
            origin += alone.origin - space.origin
            generators[:, columns] = alone.generators[:, columns]
            for rows, of_hand, matrix, mine, ends, my_ends in (
                (self._limits[finger], limits, L, alone.L, l0, alone.l0),
                (self._hard[finger], hard, H, alone.H, h, alone.h),
            ):
                matrix[rows], ends[rows] = mine[rows], my_ends[rows]
                matrix[of_hand[:, None], columns] = mine[of_hand[:, None], columns]
            l0[limits] += alone.l0[limits] - space.l0[limits]
            h[hard] += alone.h[hard] - space.h[hard]
            s[self._limits[finger]] = alone.s[self._limits[finger]]
        for array in (loads, engagement, origin, generators, L, l0, s, H, h):
            array.setflags(write=False)
        stops = tuple([(f, joint, of_joints[f, joint]) for f, joint, _ in hand.stops])
        joined = replace(
            hand,
            tiles=tuple(tiles),
            loads=loads,
            engagement=engagement,
            stops=stops,
            closed=hand,
        )
        own = WrenchSpace(origin, generators, space.columns, space.rows, L, l0, s, H, h, space.D)
        return joined, own
