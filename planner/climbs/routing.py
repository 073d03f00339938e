"""States of a wall as a route: a move for each limb that is lifted and placed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise, zip_longest
from typing import NamedTuple, Self

from msgspec import structs

from hand_models.base import Array, Pose
from hand_models.rock import Plane
from hand_models.tile import Surface
from planner.question import HandOnHold, Limits, Objective, Question, Stance
from planner.robots import Robot
from planner.route import KnotPhase, Move, Route, refuse
from planner.search import Arc, State, Wall

__all__ = ["ClimbStep", "RouteMaker", "refuse_limits"]


def refuse_limits(robot: Robot, limits: Limits, objective: Objective) -> None:
    """Refuse what no climb of a robot can have, before there is a wall.

    Parameters
    ----------
    robot : Robot
    limits : Limits
        Of every stage.
    objective : str
        Of every stage.

    Raises
    ------
    InvalidInputError
        If a limit is impossible, or names what the robot has not.
    UnsupportedError
        If climbs cannot have a limit.
    """
    on_rock = partial(HandOnHold, pose=Pose.identity(), hold=Plane(), surface=Surface.named("rock"))
    hands = tuple(on_rock(limb=limb) for limb in robot.limbs)
    stance = Stance(hands, Pose.identity(), robot=robot, joints="solve")
    # changes between knots count in a climb alone
    of_stage = structs.replace(limits, tension_change=None)
    Question(stance, limits=of_stage, objective=objective)
    refuse(Route("", stance, (), limits=limits, objective=objective))


class ClimbStep(NamedTuple):
    """The states of one move.

    Attributes
    ----------
    shifts : tuple of State
        With all hands on the rock, from before the body shifts to where the limb lifts; one state
        if the body does not shift.
    lift, place : State or None
        With the limb in the air, and on its new placement; None for a last shift without a move.
    """

    shifts: tuple[State, ...]
    lift: State | None
    place: State | None

    @classmethod
    def each(cls, states: Sequence[State]) -> list[Self]:
        """Return the moves of a climb's states; of one state a step without any."""
        found = list[Self]()
        shifts, lift = [states[0]], None
        for state in states[1:]:
            if min(state.members) < 0:
                lift = state
            elif lift is None:
                shifts.append(state)
            else:
                found.append(cls(tuple(shifts), lift, state))
                shifts, lift = [state], None
        if len(shifts) > 1 or not found:
            found.append(cls(tuple(shifts), None, None))
        return found

    @property
    def is_shift(self) -> bool:
        """Return whether the body shifts without a move after it."""
        return self.lift is None and len(self.shifts) > 1

    @property
    def limb(self) -> int:
        """Index of the limb that moves."""
        assert self.lift is not None
        return self.lift.members.index(-1)

    def refused(self, phase: KnotPhase) -> frozenset[Arc]:
        """Return what is to be left out of further climbs if a part of this move has no plan."""
        before = self.shifts[-1]
        if phase == "start":
            return frozenset({(self.shifts[0], self.shifts[0])})
        if phase == "shift" or self.lift is None or self.place is None:
            # the body goes straight from the first to the last of them
            ends = (self.shifts[0], self.shifts[-1])
            return frozenset({*pairwise(self.shifts), ends})
        if phase in ("unload", "open"):
            return frozenset({(before, self.lift)})
        if phase in ("swing", "close"):
            return frozenset({(before, self.place)})
        return frozenset({(self.lift, self.place)})


class RouteMaker:
    """Makes routes of a wall's states; equal moves are the same objects.

    Parameters
    ----------
    wall : Wall
    name : str
        Of the routes.
    limits : Limits
    objective : str
        Of every stage.
    """

    def __init__(self, wall: Wall, name: str, limits: Limits, objective: Objective) -> None:
        self.wall, self._name, self.limits, self._objective = wall, name, limits, objective
        self._moves = dict[tuple[int, int, int | None, bytes], Move]()

    def route(
        self,
        steps: Sequence[ClimbStep],
        joints: Mapping[str, Array] | None = None,
        placed: Sequence[Array] = (),
    ) -> Route:
        """Return the route of moves, from the first state on.

        Parameters
        ----------
        steps : sequence of ClimbStep
        joints : mapping of str to ndarray, shape (n,), optional
            Joint angles at the start [rad]; they are to be found by default.
        placed : sequence of ndarray, shape (n,)
            Joint angles of the limb of each move on its new placement [rad].
        """
        wall, first = self.wall, steps[0].shifts[0]
        hands = [self._hand(limb, p) for limb, p in enumerate(first.members)]
        last, moves = steps[-1], [step for step in steps if step.lift is not None]
        return Route(
            name=self._name,
            start=Stance(
                tuple(hands), wall.bodies[first.body], robot=wall.robot, joints=joints or "solve"
            ),
            moves=tuple(self._move(step, angles) for step, angles in zip_longest(moves, placed)),
            end=wall.bodies[last.shifts[-1].body] if last.is_shift else None,
            limits=self.limits,
            objective=self._objective,
            explain=False,
        )

    def _hand(self, limb: int, place: int) -> HandOnHold:
        return replace(self.wall.places[place], limb=self.wall.robot.limbs[limb])

    def _move(self, step: ClimbStep, angles: Array | None) -> Move:
        assert step.place is not None
        limb, body = self.wall.robot.limbs[step.limb], step.place.body
        shifted = self.wall.bodies[body] if len(step.shifts) > 1 else None
        place = step.place.members[step.limb]
        key = (
            step.limb,
            place,
            body if shifted else None,
            b"" if angles is None else angles.tobytes(),
        )
        if key not in self._moves:
            hand = self._hand(step.limb, place)
            found = Move(hand, shifted)
            self._moves[key] = found if angles is None else replace(found, joints={limb: angles})
        return self._moves[key]
