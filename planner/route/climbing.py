"""Plan a climb whole: every move from stance to stance as knots of verified loads.

A move has these parts, in this order: the body *shifts* on all hands; the leaving hand is *unloaded*
to its closing tensions, while the others take over; it *opens* along its opening path; it *swings*,
back from its hold, through the air and on to the next; it *closes* along its closing path; and it is
*loaded* as the plan of the new stance has it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from hand_models.base import Array, InvalidInputError, Pose, UnsupportedError
from hand_models.hand import SettledHand
from hand_models.parameters import bundled_table
from planner.motion import (
    CollisionScene,
    branches,
    pose_between,
    rocks_of,
    shift_postures,
    swing,
)
from planner.prepare import posture, settle_hand
from planner.question import HandOnHold, Question
from planner.robots import UnreachableError
from planner.route.between import Passage
from planner.route.climb import Move, Route, RouteStage, stages
from planner.route.evaluation import must_touch
from planner.route.held import Held, MovingHand, NoPlanError, Posed, hold_as_planned, hold_with
from planner.route.knots import Climb, Failure, HandKnot, Knot, KnotPhase
from planner.route.moving import at_closing, closing_states, in_air, opening_states
from planner.route.settings import ClimbSettings

__all__ = ["plan_climb"]


def plan_climb(
    route: Route,
    settings: ClimbSettings | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Climb:
    """Plan a climb: knots from the start to its end, or to the move that fails.

    Every knot has loads that pass the checks of a plan, at the centre of mass of its posture.
    Between neighbouring knots a controller interpolates, within the rates of the settings and, if
    the route's limits have ``tension_change``, with no larger change of a tension.

    Parameters
    ----------
    route : Route
        All wrists are fixed. Joints that the start stance does not give are found by inverse
        kinematics.
    settings : ClimbSettings, optional
        Rates of the controller; those of ``climb.toml`` by default.
    progress : callable, optional
        Called after each move with (number of moves planned, number of moves).

    Raises
    ------
    InvalidInputError
        If a stance or a move is not valid; the field is relative to the route.
    UnsupportedError
        If a wrist is not fixed, the body accelerates about an axis, or a move gives joint angles of
        a limb that stays.
    """
    _refuse(route)
    change = route.limits.tension_change
    planner = _Planner(route, (settings or ClimbSettings()).complete(), math.inf if change is None else change)
    failure = None
    try:
        planner.start()
        for number, move in enumerate(route.moves, start=1):
            planner.move(number, move)
            if progress is not None:
                progress(number, len(route.moves))
    except _BlockedError as blocked:
        failure = blocked.failure
    return Climb(route, tuple(planner.knots), failure)


def _refuse(route: Route) -> None:
    """Refuse what a climb cannot have."""
    places = [(f"stance.hands[{i}]", hand) for i, hand in enumerate(route.start.hands)]
    places += [(f"moves[{i}]", move.hand) for i, move in enumerate(route.moves)]
    for field, hand in places:
        if hand.wrist != "fixed":
            raise UnsupportedError(
                f"{hand.wrist} is not available in a climb, whose loads are interpolated between "
                "knots; valid is fixed",
                field=f"{field}.wrist",
            )
        if hand.wrench is not None:
            raise UnsupportedError(
                "is not available in a climb, in which every hand is loaded and unloaded; leave it "
                "out",
                field=f"{field}.wrench",
            )
    if any(route.load.angular_acceleration):
        raise UnsupportedError(
            "is not available in a climb, whose loads are those at rest; leave it out",
            field="load.angular_acceleration",
        )
    for i, move in enumerate(route.moves):
        others = [] if isinstance(move.joints, str) else [*move.joints]
        for limb in others:
            if limb != move.hand.limb:
                raise UnsupportedError(
                    "is not available in a climb: a limb that stays keeps its branch of inverse "
                    f"kinematics; give angles of {move.hand.limb} only",
                    field=f"moves[{i}].joints.{limb}",
                )


class _BlockedError(Exception):
    """Error that ends a climb."""

    def __init__(self, failure: Failure) -> None:
        super().__init__(failure.reason)
        self.failure = failure


class _Planner:
    """A climb as far as it is planned.

    Parameters
    ----------
    route : Route
    settings : ClimbSettings
        Rates, all of them given.
    change : float
        Largest change of a tension between neighbouring knots [N].
    """

    def __init__(self, route: Route, settings: ClimbSettings, change: float) -> None:
        self.route, self.settings, self.change = route, settings, change
        self.knots: list[Knot] = []
        self._stages = _stages_of(route)
        self._stage, self._move = 0, 0
        self._limb: str | None = None
        self._phase: KnotPhase = "start"
        self._scene: CollisionScene | None = None
        table = bundled_table("climb.toml", "planner.parameters")
        self._excess = table.positive("knots", "excess")
        self._floor = table.positive("knots", "excess_floor")
        self._halvings = int(table.positive("knots", "halvings"))

    @property
    def at(self) -> Held:
        """Where the climb has come to."""
        return self._at

    def start(self) -> None:
        """Plan the start stance."""
        stance = self.route.start
        if stance.joints is None:
            stance = replace(stance, joints="solve")
        with _Phase(self, "start"):
            where = posture(replace(self._stages[0].question, stance=stance))
            assert where is not None
            posed = Posed(self.route, stance.hands, stance.body, where.angles)
            self._at = hold_as_planned(posed)
        self._append(self._at, None, stage=True)

    def move(self, number: int, move: Move) -> None:
        """Plan one move."""
        self._move, self._limb = number, move.hand.limb
        self._solution = self._at.solution
        if move.body is not None:
            with _Phase(self, "shift"):
                self._shift(move.body)
        with _Phase(self, "unload"):
            states = self._unload()
        with _Phase(self, "open"):
            self._open(states)
        with _Phase(self, "swing"):
            self._swing(move)
        with _Phase(self, "close"):
            self._close(move.hand)
        with _Phase(self, "load"):
            self._load(move.hand)

    # Parts of a move ----------------------------------------------------------------------------

    def _shift(self, goal: Pose) -> None:
        """Shift the body on all hands."""
        first = self._at.posed
        hands = {hand.limb: hand.pose for hand in first.hands}
        count = 4
        bodies = [pose_between(first.body, goal, k / count) for k in range(1, count)] + [goal]
        robot = self.route.start.robot
        found = shift_postures(robot, hands, bodies, first.angles)
        for k, body in enumerate(bodies):
            angles = {**first.angles, **{limb: each[k] for limb, each in found.items()}}
            self._go(self._plan(replace(first, body=body, angles=angles)), stage=k == count - 1)

    def _unload(self) -> list[MovingHand]:
        """Take the load off the leaving hand; return its states while it opens."""
        held, limb = self._at, self._limb
        assert limb is not None
        h = held.prepared.limbs.index(limb)
        settled, space = held.prepared.batch.hands[h], held.prepared.hands.spaces[h]
        states = opening_states(limb, settled, space)
        others = tuple(hand for hand in held.posed.hands if hand.limb != limb)
        self._solution = None
        alone = self._plan(replace(held.posed, hands=others, moving=states[0]))
        loads = [*alone.loads[:h], at_closing(settled, space), *alone.loads[h:]]
        self._go(hold_with(replace(held.posed, moving=None), loads))
        self._at = alone
        return states

    def _open(self, states: Sequence[MovingHand]) -> None:
        """Let the leaving hand open."""
        self._follow(states)

    def _close(self, place: HandOnHold) -> None:
        """Close the hand on its new hold."""
        stance = replace(self.route.start, hands=(place,), joints=None)
        settled = settle_hand(place, stance)
        space = self._space_of(place)
        self._follow(closing_states(place.limb, settled, space))
