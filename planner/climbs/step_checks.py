"""Check the steps of a climb one by one: a limb that lets go or is placed, a shift of the body.

Each is checked at the joint angles that limbs have, which they keep from when their hands are
placed till they lift; what was found is kept for further steps.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import product
from typing import NamedTuple

import numpy as np

from hand_models.base import Array
from planner.climbs.holds import Stay
from planner.climbs.joint_loads import LimbLoads
from planner.climbs.move_checks import MoveChecks
from planner.climbs.postures import PostureChoice
from planner.motion import BranchEndError, follow_poses, straight_off
from planner.robots import scene_number
from planner.search import State

__all__ = ["ClimbPosture", "StepChecks", "SteppedClimb", "with_lift"]

Angles = tuple[Array, ...]
"""Joint angles of each limb, shape (n,) [rad]."""


class ClimbPosture(NamedTuple):
    """A state with all hands on the rock, at joint angles that bear it.

    Attributes
    ----------
    state : State
    angles : tuple of ndarray, shape (n,)
        Of each limb [rad].
    before : ClimbPosture or None
        From which it follows; None at the start.
    limb : int
        The limb that was moved; −1 at the start, and after a shift of the body.
    """

    state: State
    angles: Angles
    before: ClimbPosture | None = None
    limb: int = -1

    @property
    def key(self) -> tuple[object, ...]:
        """State and angles, whatever was before."""
        return self.state, *(each.tobytes() for each in self.angles)

    @property
    def step(self) -> tuple[object, ...]:
        """Ends of the step that leads to it."""
        return *self.key, *(() if self.before is None else self.before.key)


class SteppedClimb(NamedTuple):
    """A climb with its joint angles.

    Attributes
    ----------
    states : list of State
    choice : PostureChoice
    postures : list of ClimbPosture
        From the start to the goal.
    """

    states: list[State]
    choice: PostureChoice
    postures: list[ClimbPosture]

    @classmethod
    def to(cls, last: ClimbPosture, limbs: Sequence[str]) -> SteppedClimb:
        """Return the climb that ends in a posture, of a robot with these limbs."""
        postures = [last]
        while (before := postures[-1].before) is not None:
            postures.append(before)
        postures.reverse()
        states, placed = [postures[0].state], list[Array]()
        for each in postures[1:]:
            if each.limb >= 0:
                states.append(with_lift(each.state, each.limb))
                placed.append(each.angles[each.limb])
            states.append(each.state)
        start = dict(zip(limbs, postures[0].angles, strict=True))
        return cls(states, PostureChoice(start, tuple(placed), ()), postures)


def with_lift(state: State, limb: int) -> State:
    """Return a state with a limb in the air."""
    return State(state.body, (*state.members[:limb], -1, *state.members[limb + 1 :]))


class StepChecks:
    """Checks of steps; each is made once.

    Parameters
    ----------
    checks : MoveChecks
    """

    def __init__(self, checks: MoveChecks) -> None:
        self._checks, self._wall = checks, checks.wall
        self._names = checks.wall.robot.limbs
        self._most = checks.settings.torque_share
        self._back = scene_number("motion", "stand_off")
        self._clear = dict[tuple[int, int, int], list[Array]]()
        self._straight = dict[tuple[object, ...], Array | None]()
        self._followed = dict[tuple[object, ...], Array | None]()
        self._loads = dict[tuple[object, ...], LimbLoads]()
        self._off = dict[tuple[object, ...], Array | None]()
        self._placed = dict[tuple[object, ...], list[Angles]]()

    def postures(self, state: State) -> Iterator[ClimbPosture]:
        """Yield postures of a state at which limbs are clear and bear it."""
        ways = [self._ways(limb, place, state.body) for limb, place in enumerate(state.members)]
        for angles in product(*ways):
            clear = all(self._apart(limb, angles) for limb in range(len(angles)))
            if clear and self._bears(state, angles):
                yield ClimbPosture(state, angles)

    def off(self, posture: ClimbPosture, limb: int) -> Array | None:
        """Return the way (m, n) of a limb straight off its hold [rad]; None if it cannot let go."""
        key = *posture.key, limb
        if key not in self._off:
            self._off[key] = self._let_go(posture, limb)
        return self._off[key]

    def placed(self, posture: ClimbPosture, state: State, limb: int) -> list[ClimbPosture]:
        """Return the postures of a state after a limb was moved to its placement there."""
        key = *posture.key, state
        if key not in self._placed:
            off = self.off(posture, limb)
            found = [] if off is None else [*self._moved(posture, state, limb, off)]
            self._placed[key] = found
        return [ClimbPosture(state, angles, posture, limb) for angles in self._placed[key]]

    def follows(self, posture: ClimbPosture, limb: int, body: int) -> bool:
        """Return whether a limb keeps its hold, clear of rock, while the body is shifted."""
        return self._follow(posture, limb, body) is not None

    def shifted(self, posture: ClimbPosture, body: int) -> ClimbPosture | None:
        """Return the posture after a shift of the body; None if limbs cannot follow or bear it."""
        state, ways = State(body, posture.state.members), list[Array]()
        for limb in range(len(posture.angles)):
            way = self._follow(posture, limb, body)
            if way is None:
                return None
            ways.append(way)
        every = [tuple(way[k] for way in ways) for k in range(len(ways[0]))]
        if not all(self._apart(limb, at) for at in every for limb in range(len(at))):
            return None
        wrenches = self._wall.screening.wrenches
        half = 0.5 * (wrenches[posture.state.body] - wrenches[body])
        if not self._bears(state, every[len(every) // 2 - 1], half):
            return None
        return ClimbPosture(state, every[-1], posture) if self._bears(state, every[-1]) else None

    def _let_go(self, posture: ClimbPosture, limb: int) -> Array | None:
        (body, members), angles = posture.state, posture.angles
        wrench = self._checks.closed_wrench(members[limb])
        way = self._straight_off(limb, body, angles[limb])
        if wrench is None or way is None or not self._passes(limb, way, angles):
            return None
        more = self._with_moment(-wrench, limb, body, angles[limb])
        return way if self._bears(with_lift(posture.state, limb), angles, more) else None

    def _moved(
        self, posture: ClimbPosture, state: State, limb: int, off: Array
    ) -> Iterator[Angles]:
        """Yield joint angles of all limbs after one has moved, those first that turn least."""
        body, place, lift = state.body, state.members[limb], with_lift(state, limb)
        wrench, parts = self._checks.closed_wrench(place), self._checks.settings.swing_parts
        ways = [
            (each, self._straight_off(limb, body, each)) for each in self._ways(limb, place, body)
        ]
        onto = [(each, way) for each, way in ways if way is not None]
        if wrench is None:
            return
        for own, way in sorted(onto, key=lambda each: float(np.abs(each[1][-1] - off[-1]).max())):
            angles = (*posture.angles[:limb], own, *posture.angles[limb + 1 :])
            if not self._apart(limb, angles) or not self._passes(limb, way, angles):
                continue
            swing = np.linspace(off[-1], way[-1], parts + 1)
            air = [self._with_moment(np.zeros(6), limb, body, each) for each in swing]
            air.append(self._with_moment(-wrench, limb, body, own))
            held = self._bears(state, angles) and self._bears(lift, angles)
            if held and all(self._bears(lift, angles, at) for at in air):
                yield angles

    def _with_moment(self, wrench: Array, limb: int, body: int, angles: Array) -> Array:
        """Return a wrench with the moment that the weight of a limb in the air needs."""
        moment = self._checks.programs.moment(limb, body, angles)
        return np.asarray(wrench + np.append(np.zeros(3), moment))

    def _ways(self, limb: int, place: int, body: int) -> list[Array]:
        """Return joint angles of a limb on a hold, clear of the rock, the body and of itself.

        They are those of the reach table; others are searched for if none of these is clear.
        """
        key = limb, place, body
        if key not in self._clear:
            at, of_rock = [self._wall.bodies[body]], self._checks.clearances.of_rock
            known = self._wall.branches(place, body, limb)
            found = [each for each in known if of_rock(limb, at, each[None], holds=True)]
            more = [] if found else self._checks.ways.of(Stay(limb, place, (body,)))
            self._clear[key] = found or [way[0] for way in more]
        return self._clear[key]

    def _straight_off(self, limb: int, body: int, angles: Array) -> Array | None:
        """Return the way straight off a hold, if the limb is clear of the rock at its end."""
        key = limb, body, angles.tobytes()
        if key not in self._straight:
            found, at = None, [self._wall.bodies[body]]
            with suppress(BranchEndError):
                way = straight_off(self._wall.robot, self._names[limb], angles, self._back)
                clear = self._checks.clearances.of_rock(limb, at, way[-1:], holds=False)
                found = way if clear else None
            self._straight[key] = found
        return self._straight[key]

    def _passes(self, limb: int, way: Array, angles: Angles) -> bool:
        """Return whether a limb passes all others on its way straight off a hold."""
        apart = self._checks.clearances.apart
        return all(
            apart((limb, other), way[:-1], still[None]).all()
            and apart((limb, other), way[-1:], still[None], swings=True).all()
            for other, still in enumerate(angles)
            if other != limb
        )

    def _apart(self, limb: int, angles: Angles) -> bool:
        """Return whether a limb keeps clear of all others."""
        apart = self._checks.clearances.apart
        return all(
            apart((limb, other), angles[limb][None], each[None]).all()
            for other, each in enumerate(angles)
            if other != limb
        )

    def _follow(self, posture: ClimbPosture, limb: int, other: int) -> Array | None:
        """Return the joint angles (m, n) of a limb in a shift [rad]; None if it cannot follow."""
        body, place = posture.state.body, posture.state.members[limb]
        key = limb, place, body, other, posture.angles[limb].tobytes()
        if key not in self._followed:
            path = self._checks.ways.path(Stay(limb, place, (body, other)))[0][1:]
            hand, found = self._wall.places[place].pose, None
            at = [each.inverse() @ hand for each in path]
            with suppress(BranchEndError):
                way = follow_poses(self._wall.robot, self._names[limb], posture.angles[limb], at)
                clear = self._checks.clearances.of_rock(limb, path, way, holds=True)
                found = way if clear else None
            self._followed[key] = found
        return self._followed[key]

    def _bears(self, state: State, angles: Angles, more: Array | None = None) -> bool:
        """Return whether joints bear a state; ``more`` is as of `MoveChecks.share`."""
        loads = dict[int, LimbLoads]()
        for limb, place in enumerate(state.members):
            key = limb, place, state.body, angles[limb].tobytes()
            if place >= 0 and key not in self._loads:
                self._loads[key] = self._checks.programs.loads(
                    limb, place, state.body, angles[limb]
                )
            if place >= 0:
                loads[limb] = self._loads[key]
        return self._checks.share(state, loads, more) <= self._most
