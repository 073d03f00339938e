"""Check quickly that others hold the robot while a hand lets go or closes.

A lift's program has the free limb at rest. While that hand is unloaded it is still at its old
placement, and it is loaded at its new one: the others must hold the limb's weight there, and what
the closed hand does to its rock.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hand_models.base import Array, CruxError, Pose, wrench_transport
from planner.prepare import hand_space
from planner.programs import WRENCH_UNIT
from planner.question import Stance
from planner.route import closing_loads
from planner.screening import StanceIndices, solve_stance
from planner.search import State, Wall

__all__ = ["MoveChecks"]


class MoveChecks:
    """Checks of pairs of states, one after the other; each is made once.

    Parameters
    ----------
    wall : Wall
    most : float
        Utilisation that is allowed.
    """

    def __init__(self, wall: Wall, most: float = 1.0) -> None:
        self._wall, self._least = wall, 1.0 / most
        self._closed = dict[int, Array | None]()
        self._known = dict[tuple[State, int], bool]()

    def passes(self, before: State, after: State) -> bool:
        """Return whether one state may follow another: by a lift, a placement or a shift."""
        if before.body != after.body:
            return True
        whole, lift = (before, after) if -1 in after.members else (after, before)
        key = whole, lift.members.index(-1)
        if key not in self._known:
            self._known[key] = self._holds(*key)
        return self._known[key]

    def _holds(self, whole: State, limb: int) -> bool:
        """Return whether the others hold the robot and what the closed hand of a limb does."""
        members, screening = np.array(whole.members), self._wall.screening
        own = self._closed_wrench(int(members[limb]))
        if own is None:
            return False
        needed = screening.needed(StanceIndices(np.array([whole.body]), members[None]))[0]
        found = solve_stance(screening.hands, np.delete(members, limb), needed - own).factor
        # a solver that fails proves nothing: the whole planner decides
        return bool(np.isnan(found) or found >= self._least)

    def _closed_wrench(self, place: int) -> Array | None:
        """Return the rock's wrench on a closed hand without load, (6,); None if it cannot close."""
        if place not in self._closed:
            hand = self._wall.places[place]
            # the set of a hand does not depend on where the body is
            stance = Stance((replace(hand, wrist="fixed"),), hand.pose, robot=self._wall.robot)
            try:
                settled, space = hand_space(stance, hand.limb)
            except CruxError:
                self._closed[place] = None
            else:
                off = hand.pose.position - self._wall.screening.hands.about
                about = wrench_transport(Pose(off, hand.pose.rotation))
                wrench = space.wrench(closing_loads(settled, space))
                self._closed[place] = -(about @ wrench) / WRENCH_UNIT
        return self._closed[place]
