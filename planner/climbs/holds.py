"""Stays of a climb: a limb's hand at a placement from when it is placed till it lifts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, Pose
from planner.climbs.clearances import Clearances
from planner.climbs.routing import ClimbStep
from planner.climbs.settings import PostureSettings
from planner.motion import (
    MOTION_SETTINGS,
    BranchEndError,
    branches,
    follow_poses,
    pose_between,
    straight_off,
)
from planner.robots import scene_number
from planner.route import KnotPhase
from planner.search import State, Wall

__all__ = ["HeldState", "HoldWays", "Stay", "holds_of"]


class Stay(NamedTuple):
    """A limb's hand at a placement, while the body is shifted from pose to pose.

    Attributes
    ----------
    limb, place : int
    bodies : tuple of int
        Poses of the body, straight from one to the next.
    placed, lifts : bool
        Whether the hand comes to the placement at the first of them, and leaves it at the last.
    """

    limb: int
    place: int
    bodies: tuple[int, ...]
    placed: bool = False
    lifts: bool = False


class HeldState(NamedTuple):
    """A state of a climb with the holds that it has.

    Attributes
    ----------
    move : int
        Number of the move, from one; zero at the start.
    phase : str
        Part of the move that ends with it, as of a knot.
    state : State
    holds : dict of int to int
        Of each hold, by its index, how many shifts of the body it has had.
    closed : int or None
        Placement at which the limb in the air is closed, without load.
    air : tuple of int
        Holds of the limb in the air: that at which it is closed, or those it swings between.
    """

    move: int
    phase: KnotPhase
    state: State
    holds: dict[int, int]
    closed: int | None
    air: tuple[int, ...]


def holds_of(steps: Sequence[ClimbStep]) -> tuple[list[Stay], list[HeldState]]:
    """Return the holds of moves, those of the start first, and all states in their order."""
    first = steps[0].shifts[0]
    holds = [Stay(limb, p, (first.body,)) for limb, p in enumerate(first.members)]
    now, held = list(range(len(holds))), list[HeldState]()

    def add(
        move: int,
        phase: KnotPhase,
        state: State,
        air: tuple[int, ...] = (),
        closed: int | None = None,
    ) -> None:
        own = {
            i: len(holds[i].bodies) - 1 for i, p in zip(now, state.members, strict=True) if p >= 0
        }
        held.append(HeldState(move, phase, state, own, closed, air))

    add(0, "start", first)
    for move, step in enumerate(steps, start=1):
        if len(step.shifts) > 1:
            for i in now:
                holds[i] = holds[i]._replace(bodies=(*holds[i].bodies, step.shifts[-1].body))
            add(move, "shift", step.shifts[-1])
        if step.lift is None or step.place is None:
            continue
        limb, left = step.limb, now[step.limb]
        holds[left] = holds[left]._replace(lifts=True)
        add(move, "unload", step.lift, (left,), holds[left].place)
        place, new = step.place.members[limb], len(holds)
        add(move, "swing", step.lift, (left, new))
        add(move, "close", step.lift, (new,), place)
        now[limb] = new
        holds.append(Stay(limb, place, (step.place.body,), placed=True))
        add(move, "load", step.place)
    return holds, held


class HoldWays:
    """Joint angles that limbs keep on holds, which are kept for further climbs.

    Parameters
    ----------
    wall : Wall
    clearances : Clearances
    settings : PostureSettings
    """

    def __init__(self, wall: Wall, clearances: Clearances, settings: PostureSettings) -> None:
        self._wall, self._clearances, self._settings = wall, clearances, settings
        self._known = dict[Stay, list[Array]]()
        self._off = dict[tuple[Stay, int], list[Array]]()

    def of(self, hold: Stay) -> list[Array]:
        """Return joint angles at all poses of `path`, shape (m, n) each [rad].

        They start from those of the reach table at each of the hold's bodies, and keep clear of the
        rock.
        """
        if hold not in self._known:
            found = list[Array]()
            for more in (False, True):
                # others are searched for where the table has few
                few = len(found) < self._settings.few_ways
                for way in self._followed(hold, more=more) if few or not more else ():
                    far = (np.abs(way - other).max() for other in found)
                    if min(far, default=np.inf) > MOTION_SETTINGS.alike and self._clear(hold, way):
                        found.append(way)
                    if len(found) == self._settings.ways:
                        break
            self._known[hold] = found
        return self._known[hold]

    def off(self, hold: Stay, end: int) -> list[Array]:
        """Return of each way the joint angles straight back from the hold, shape (m, n) [rad].

        The hand leaves its rock, or comes to it on the same way, at the first pose of the body or
        the last one: ``end`` is 0 or −1.
        """
        key = hold, end
        if key not in self._off:
            robot = self._wall.robot
            back, name = scene_number("motion", "stand_off"), robot.limbs[hold.limb]
            self._off[key] = [straight_off(robot, name, way[end], back) for way in self.of(hold)]
        return self._off[key]

    def path(self, hold: Stay) -> tuple[list[Pose], list[int]]:
        """Return the poses of the body with those between, and the index of each of the hold's."""
        bodies = [self._wall.bodies[b] for b in hold.bodies]
        path, at = [bodies[0]], [0]
        for before, body in pairwise(bodies):
            away = float(np.linalg.norm(body.position - before.position))
            pieces = 2 ** max(int(np.ceil(np.log2(max(away, 1e-9) / self._settings.step))), 1)
            path += [pose_between(before, body, k / pieces) for k in range(1, pieces)] + [body]
            at.append(len(path) - 1)
        return path, at

    def _followed(self, hold: Stay, *, more: bool) -> Iterator[Array]:
        """Yield ways that limbs can follow, by the reach table or from more joint angles."""
        wall, (path, at) = self._wall, self.path(hold)
        robot, name = wall.robot, wall.robot.limbs[hold.limb]
        inside = [body.inverse() @ wall.places[hold.place].pose for body in path]
        for j, body in zip(at, hold.bodies, strict=True):
            known = wall.branches(hold.place, body, hold.limb)
            for angles in branches(robot, name, inside[j], count=12) if more else known:
                way = angles[None]
                try:
                    if j > 0:
                        # the way there is followed once more as the climb goes it
                        first = follow_poses(robot, name, angles, inside[:j][::-1])[-1]
                        way = np.vstack(
                            [first, follow_poses(robot, name, first, inside[1 : j + 1])]
                        )
                    if j + 1 < len(inside):
                        way = np.vstack([way, follow_poses(robot, name, way[-1], inside[j + 1 :])])
                except BranchEndError:
                    continue
                yield way

    def _clear(self, hold: Stay, way: Array) -> bool:
        """Return whether a way is clear of the rock, also where the hand comes or leaves."""
        robot, (path, _), rocks = self._wall.robot, self.path(hold), self._clearances
        name, back = robot.limbs[hold.limb], scene_number("motion", "stand_off")
        for end in [0] * hold.placed + [-1] * hold.lifts:
            try:
                off = straight_off(robot, name, way[end], back)
            except BranchEndError:
                return False
            if not rocks.of_rock(hold.limb, [path[end]], off[-1:], holds=False):
                return False
        return rocks.of_rock(hold.limb, path, way, holds=True)
