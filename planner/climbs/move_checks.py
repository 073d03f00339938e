"""Check quickly that others hold the robot while a hand lets go or closes.

A lift's program has the free limb at rest. While that hand is unloaded it is still at its old
placement, and it is loaded at its new one: the others must hold the limb's weight there, and what
the closed hand does to its rock.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations, islice, product

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, CruxError, Pose, wrench_transport
from planner.motion import CollisionScene, capsule_distances
from planner.prepare import hand_space
from planner.programs import WRENCH_UNIT
from planner.question import Limits, Question, Stance
from planner.robots import scene_number
from planner.route import closing_loads
from planner.screening import StanceIndices, solve_stance
from planner.search import State, Wall
from planner.solving import plan

__all__ = ["MoveChecks"]


class MoveChecks:
    """Checks of pairs of states, one after the other; each is made once.

    Parameters
    ----------
    wall : Wall
    limits : Limits, optional
        Of every stage.
    """

    def __init__(self, wall: Wall, limits: Limits | None = None) -> None:
        self._wall, self._limits = wall, limits or Limits()
        self._least = 1.0 / self._limits.utilisation
        self._closed = dict[int, Array | None]()
        self._known = dict[tuple[State, int], bool]()
        self._fits = dict[State, bool]()
        self._meets = dict[tuple[int, int, int, int, int], NDArray[np.bool_]]()
        self._scene = CollisionScene(wall.robot, ())

    def passes(self, before: State, after: State) -> bool:
        """Return whether one state may follow another: by a lift, a placement or a shift."""
        if before == after:
            if before not in self._fits:
                self._fits[before] = next(self._clear(before), None) is not None
            return self._fits[before]
        if before.body != after.body or -1 not in (*before.members, *after.members):
            return True
        whole, lift = (before, after) if -1 in after.members else (after, before)
        key = whole, lift.members.index(-1)
        if key not in self._known:
            self._known[key] = self._holds(*key)
        return self._known[key]

    def joints(self, state: State, most: int = 24) -> Iterator[dict[str, Array]]:
        """Yield joint angles of the reach table with which a state has a plan [rad].

        Limbs keep clear of each other, and joints bear what the hands hold.
        """
        wall, robot = self._wall, self._wall.robot
        hands = [
            replace(wall.places[place], limb=robot.limbs[limb])
            for limb, place in enumerate(state.members)
            if place >= 0
        ]
        body = wall.bodies[state.body]
        for chosen in islice(self._clear(state), most):
            angles = dict[str, Array]()
            for limb, k in chosen.items():
                ways = wall.reach.branches(state.members[limb], state.body, limb)
                name = robot.limbs[limb]
                angles[name] = ways[k, : len(robot.chains[name].joints)]
            stance = Stance(tuple(hands), body, robot=robot, joints=angles)
            try:
                found = plan(Question(stance, limits=self._limits, explain=False))
            except CruxError:
                return
            if found.status == "optimal":
                yield angles

    def _clear(self, state: State) -> Iterator[dict[int, int]]:
        """Yield joint angles at which limbs keep clear of each other: their number, by limb."""
        limbs = [limb for limb, place in enumerate(state.members) if place >= 0]
        wall, body = self._wall, state.body
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
            scene, limbs = self._scene, self._wall.robot.limbs
            ways, segments = list[Array](), list[Array]()
            for limb, place in zip((first, second), places, strict=True):
                n = len(self._wall.robot.chains[limbs[limb]].joints)
                ways.append(self._wall.reach.branches(place, state.body, limb)[:, :n])
                segments.append(scene.limbs[limbs[limb]].segments(ways[-1]))
            own = [scene.own[limbs[limb]] for limb in (first, second)]
            mine = np.concatenate(own)
            inside = [np.isin(scene.pairs, each) for each in own]
            between = (inside[0] | inside[1]).all(axis=1) & inside[0].any(1) & inside[1].any(1)
            pairs = np.argsort(mine)[np.searchsorted(np.sort(mine), scene.pairs[between])].reshape(
                -1, 2
            )
            i, j = np.indices((len(ways[0]), len(ways[1]))).reshape(2, -1)
            both = np.ascontiguousarray(np.hstack([segments[0][i], segments[1][j]]))
            gaps = capsule_distances(both, scene.radii[mine], pairs, 0.02)
            least = scene_number("motion", "margin_at_hold")
            clear = gaps.min(axis=1, initial=np.inf) >= least
            self._meets[key] = clear.reshape(len(ways[0]), len(ways[1]))
        return self._meets[key]

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
