"""Check quickly that others hold the robot while a hand lets go or closes.

A lift's program has the free limb at rest. While that hand is unloaded it is still at its old
placement, and it is loaded at its new one: the others must hold the limb's weight there, and what
the closed hand does to its rock.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import replace
from itertools import combinations, pairwise, product

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, CruxError, Pose, wrench_transport
from planner.climbs.clearances import Clearances
from planner.climbs.holds import HoldWays, Stay
from planner.climbs.joint_loads import JointLoadPrograms, LimbLoads
from planner.climbs.settings import PostureSettings
from planner.prepare import hand_space
from planner.programs import WRENCH_UNIT
from planner.question import Limits, Stance
from planner.route import closing_loads
from planner.screening import StanceIndices, solve_stance
from planner.search import State, Wall

__all__ = ["MoveChecks"]


class MoveChecks:
    """Checks of pairs of states, one after the other; each is made once.

    Parameters
    ----------
    wall : Wall
    limits : Limits, optional
        Of every stage.
    settings : PostureSettings, optional

    Attributes
    ----------
    multiple : float
        Multiple of the robot's weight that joints bear in each state; 1 at first.
    """

    multiple: float = 1.0

    def __init__(
        self, wall: Wall, limits: Limits | None = None, settings: PostureSettings | None = None
    ) -> None:
        self.wall, self._limits = wall, limits or Limits()
        self.settings = settings or PostureSettings()
        self._least = 1.0 / self._limits.utilisation
        self._closed = dict[int, Array | None]()
        self._known = dict[tuple[State, int], bool]()
        self._fits = dict[State, bool]()
        self._meets = dict[tuple[int, int, int, int, int], NDArray[np.bool_]]()
        self._loads = dict[tuple[int, int, int], list[LimbLoads]]()
        self._met = dict[int, set[tuple[tuple[int, int], tuple[int, int]]]]()
        self._lost = dict[tuple[int, int], set[tuple[int, int]]]()
        self.clearances = Clearances(wall)
        self.programs = JointLoadPrograms(wall, self._limits)
        self.ways = HoldWays(wall, self.clearances, self.settings)

    def bearing(self, multiple: float) -> MoveChecks:
        """Return the same checks, but of states in which joints bear a multiple of the weight."""
        other = copy(self)
        other.multiple, other._known, other._fits = multiple, {}, {}
        return other

    def passes(self, before: State, after: State) -> bool:
        """Return whether one state may follow another: by a lift, a placement or a shift."""
        if before == after:
            if before not in self._fits:
                clear = next(self._clear(before), None) is not None
                # what four hands hold is seen to where one of them lifts
                self._fits[before] = clear and (-1 not in before.members or self.borne(before))
            return self._fits[before] and not self._meeting(before)
        if before.body != after.body:
            ends = min(before.body, after.body), max(before.body, after.body)
            lost = self._lost.get(ends)
            return lost is None or lost.isdisjoint(enumerate(after.members))
        if -1 not in (*before.members, *after.members):
            return True
        whole, lift = (before, after) if -1 in after.members else (after, before)
        limb = lift.members.index(-1)
        hold = Stay(limb, whole.members[limb], (whole.body,))
        way = hold._replace(lifts=True) if whole is before else hold._replace(placed=True)
        key = whole, limb
        if key not in self._known:
            self._known[key] = self._holds(*key)
        return self._known[key] and bool(self.ways.of(way))

    def _meeting(self, state: State) -> bool:
        """Return whether limbs of a state are known to meet at its placements."""
        pairs = self._met.get(state.body)
        if pairs is None:
            return False
        own = set(enumerate(state.members))
        return any(first in own and second in own for first, second in pairs)

    def learn_pair(self, body: int, first: tuple[int, int], second: tuple[int, int]) -> None:
        """Leave states out in which two limbs, each with its placement, meet at a body."""
        self._met.setdefault(body, set()).add((first, second))

    def learn_shift(self, states: Sequence[State], limb: int) -> None:
        """Leave out what keeps a limb from its hold in a shift of the body.

        These are shifts from body to body in which it cannot keep its hold; if it can in each of
        them, though not in all together, the last one.
        """
        place, ends = states[0].members[limb], list[tuple[int, int]]()
        for before, after in pairwise(states):
            pair = min(before.body, after.body), max(before.body, after.body)
            if not self.ways.of(Stay(limb, place, pair)):
                ends.append(pair)
        for each in ends or [pair]:
            self._lost.setdefault(each, set()).add((limb, place))

    def borne(self, state: State, more: Array | None = None) -> bool:
        """Return whether limbs keep clear of each other at joint angles that bear the loads.

        ``more`` is as of `JointLoadPrograms.share`.
        """
        own = {limb: place for limb, place in enumerate(state.members) if place >= 0}
        loads = {limb: self._loads_of(limb, place, state.body) for limb, place in own.items()}
        for chosen in self._clear(state):
            picked = {limb: loads[limb][k] for limb, k in chosen.items()}
            if self.share(state, picked, more) <= self.settings.torque_share:
                return True
        return False

    def share(
        self, state: State, loads: Mapping[int, LimbLoads], more: Array | None = None
    ) -> float:
        """Return the least share of joint torque limits in a state, as `JointLoadPrograms.share`.

        Without ``more`` it is at least `share_of_multiple`, and no more than that where that is
        beyond what is allowed.
        """
        whole = self.share_of_multiple(state, loads) if more is None else 0.0
        if whole > self.settings.torque_share:
            return whole
        return max(whole, self.programs.share(state, loads, more))

    def share_of_multiple(self, state: State, loads: Mapping[int, LimbLoads]) -> float:
        """Return the least share of torque limits in a state at the multiple; 0 if that is 1.

        The multiple may reach the limits: that counts as the share that is allowed.
        """
        if self.multiple <= 1.0:
            return 0.0
        whole = self.programs.share(state, loads, multiple=self.multiple)
        return self.settings.torque_share * whole

    def _loads_of(self, limb: int, place: int, body: int) -> list[LimbLoads]:
        """Return the joint loads of a limb at each of the table's joint angles."""
        key = limb, place, body
        if key not in self._loads:
            ways = self.wall.branches(place, body, limb)
            self._loads[key] = [self.programs.loads(*key, angles) for angles in ways]
        return self._loads[key]

    def _clear(self, state: State) -> Iterator[dict[int, int]]:
        """Yield joint angles at which limbs keep clear of each other: their number, by limb."""
        limbs = [limb for limb, place in enumerate(state.members) if place >= 0]
        wall, body = self.wall, state.body
        counts = [len(wall.reach.branches(state.members[i], body, i)) for i in limbs]
        for chosen in product(*map(range, counts)):
            pairs = combinations(zip(limbs, chosen, strict=True), 2)
            if all(self._apart(state, i, j)[k, m] for (i, k), (j, m) in pairs):
                yield dict(zip(limbs, chosen, strict=True))

    def _apart(self, state: State, first: int, second: int) -> NDArray[np.bool_]:
        """Return which joint angles of two limbs keep them apart, by those of one and the other."""
        places = state.members[first], state.members[second]
        key = state.body, first, second, *places
        if key not in self._meets:
            limbs = zip((first, second), places, strict=True)
            ways = [self.wall.branches(place, state.body, limb) for limb, place in limbs]
            self._meets[key] = self.clearances.apart((first, second), *ways)
        return self._meets[key]

    def _holds(self, whole: State, limb: int) -> bool:
        """Return whether the others hold the robot and what the closed hand of a limb does."""
        members, screening = np.array(whole.members), self.wall.screening
        own = self.closed_wrench(int(members[limb]))
        if own is None:
            return False
        lift = whole._replace(
            members=tuple(np.where(np.arange(len(members)) == limb, -1, members).tolist())
        )
        needed = screening.needed(StanceIndices(np.array([whole.body]), members[None]))[0]
        found = solve_stance(screening.hands, np.delete(members, limb), needed - own).factor
        # a solver that fails proves nothing: the whole planner decides
        if not (np.isnan(found) or found >= self._least):
            return False
        # the limb is in the air, and where its placement is
        more = -own
        more[3:] += screening.moments[whole.body, limb, members[limb]]
        return self.borne(lift, more) and self.borne(whole)

    def closed_wrench(self, place: int) -> Array | None:
        """Return the rock's wrench on a closed hand without load, (6,); None if it cannot close."""
        if place not in self._closed:
            hand = self.wall.places[place]
            # the set of a hand does not depend on where the body is
            stance = Stance((replace(hand, wrist="fixed"),), hand.pose, robot=self.wall.robot)
            try:
                settled, space = hand_space(stance, hand.limb)
            except CruxError:
                self._closed[place] = None
            else:
                off = hand.pose.position - self.wall.screening.hands.about
                about = wrench_transport(Pose(off, hand.pose.rotation))
                wrench = space.wrench(closing_loads(settled, space))
                self._closed[place] = -(about @ wrench) / WRENCH_UNIT
        return self._closed[place]
