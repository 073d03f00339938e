"""Plan a climb whole: every move from stance to stance as knots of verified loads.

A move has these parts, in this order: the body *shifts* on all hands; the leaving hand is
*unloaded* to its closing tensions, while the others take over; it *opens* along its opening path;
it *swings*, back from its hold, through the air and on to the next; it *closes* along its closing
path; and it is *loaded* as the plan of the new stance has it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import takewhile

import numpy as np
from msgspec import structs

from hand_models.base import Array, Pose
from planner.deadline import DeadlineError
from planner.motion import (
    BranchEndError,
    NoWayError,
    shift_postures,
)
from planner.prepare import posture
from planner.programs import CAP_SLACK
from planner.question import HandOnHold, Objective, objective_needs
from planner.robots import UnreachableError, solve_limbs
from planner.route.between import Passage
from planner.route.branch_choice import ends_of_swing, start_joints, swing_to
from planner.route.climb import Move, Route, stages
from planner.route.first_checks import checked_stages, climb_scene, refuse
from planner.route.held import (
    HeldPosture,
    NoPlanError,
    Posed,
    hold_as_planned,
    hold_with,
)
from planner.route.knots import Climb, Failure, Knot, KnotPhase
from planner.route.moving import (
    closing_loads,
    closing_states,
    in_air,
    opening_states,
    shift_of_body,
)
from planner.route.moving_hand import MovingHand
from planner.route.settings import ClimbSettings, KnotNumbers
from planner.solving import Solution

__all__ = ["plan_climb"]


def plan_climb(
    route: Route,
    settings: ClimbSettings | None = None,
    progress: Callable[[int, int], None] | None = None,
    *,
    after: Climb | None = None,
    knots: Callable[[Sequence[Knot]], None] | None = None,
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
    progress, knots : callable, optional
        Called after each move with the numbers of moves planned and in all; with all knots so far.
    after : Climb, optional
        Of the same start, load and limits: its knots are kept while moves are the same objects.

    Raises
    ------
    InvalidInputError
        If a stance or a move is not valid; the field is relative to the route.
    UnsupportedError
        If a wrist is not fixed, the body accelerates about an axis, palms have a margin, or a move
        gives joint angles of a limb that stays.
    """
    # what is wrong with the route itself comes before what a climb cannot have
    tuple(stages(route))
    joints = "solve" if route.start.joints is None else route.start.joints
    solved = replace(route, start=replace(route.start, joints=joints))
    refuse(solved)
    rates = (settings or ClimbSettings()).complete()
    planner, failure = _Planner(solved, rates), None
    try:
        begun = planner.begin() if after is None or not after.held else planner.branch_off(after)
        for number, move in enumerate(route.moves[begun:], start=begun + 1):
            planner.move(number, move)
            if knots is not None:
                knots(planner.knots)
            if progress is not None:
                progress(number, len(route.moves))
        planner.end()
    except _BlockedError as blocked:
        failure = blocked.failure
    return Climb(route, tuple(planner.knots), failure, structs.asdict(rates), tuple(planner.held))


class _BlockedError(Exception):
    """Error that ends a climb."""

    def __init__(self, failure: Failure) -> None:
        super().__init__(failure.reason)
        self.failure = failure


class _Planner:
    """A climb as far as it is planned.

    The parameters are those of `plan_climb`, with all rates given.

    Attributes
    ----------
    knots : list of Knot
    held : list of HeldPosture
        At the start and after each move.
    """

    _at: HeldPosture

    def __init__(self, route: Route, settings: ClimbSettings) -> None:
        self.knots: list[Knot] = []
        self.held: list[HeldPosture] = []
        self._route, self._settings = route, settings
        self._numbers = KnotNumbers.bundled()
        self._stages = checked_stages(route)
        self._scene = climb_scene(route)
        self._stage = self._move = 0
        self._limb: str | None = None
        self._phase: KnotPhase = "start"
        self._near: Solution | None = None

    # Parts of a climb ---------------------------------------------------------------------------

    def begin(self) -> int:
        """Plan the start stance; return the number of moves that are planned."""
        stance = self._route.start
        with self._in("start"):
            where = posture(self._stages[0].question)
            assert where is not None
            angles = start_joints(self._route, self._scene, where.angles)
            nearest = self._scene.nearest(stance.body, angles)
            if nearest.distance < 0.0:
                raise NoPlanError(str(nearest))
            posed = Posed(self._route, stance.hands, stance.body, angles)
            self._at = self._plan(posed, stage=True)
        self._append(self._at, None, stage=True)
        self.held.append(self._at)
        return 0

    def branch_off(self, other: Climb) -> int:
        """Keep what another climb has of the same moves; return their number."""
        pairs = zip(self._route.moves, other.route.moves[: len(other.held) - 1], strict=False)
        same = sum(1 for _ in takewhile(lambda pair: pair[0] is pair[1], pairs))
        self.knots = [knot for knot in other.knots if knot.move <= same]
        self.held = [*other.held[: same + 1]]
        self._at = self.held[-1]
        self._stage = sum(knot.stage is not None for knot in self.knots)
        return same

    def end(self) -> None:
        """Shift the body to where it is to be after all moves."""
        self._move, self._limb = len(self._route.moves) + 1, None
        if self._route.end is not None:
            with self._in("shift"):
                self._shift(self._route.end)

    def move(self, number: int, move: Move) -> None:
        """Plan one move."""
        self._move, self._limb = number, move.hand.limb
        if move.body is not None:
            with self._in("shift"):
                self._shift(move.body)
        with self._in("unload"):
            states = self._unload(move.hand.limb)
        with self._in("open"):
            self._follow(states[1:])
        with self._in("swing"):
            self._swing(move)
        with self._in("close"):
            whole, states = self._arrived(move.hand)
            self._follow(states)
        with self._in("load"):
            self._load(whole, move.hand.limb)
        self.held.append(self._at)

    def _shift(self, goal: Pose) -> None:
        """Shift the body on all hands."""
        first = self._at.posed
        bodies, ways = shift_of_body(first, goal, self._scene, self._numbers)
        for k, body in enumerate(bodies, start=1):
            angles = {**first.angles, **{limb: way[k] for limb, way in ways.items()}}
            stage = body is goal
            posed = Posed(first.route, first.hands, body, angles, first.moving)
            self._go(self._plan(posed, stage=stage), stage=stage)

    def _unload(self, limb: str) -> list[MovingHand]:
        """Take the load off the leaving hand; return its states while it opens."""
        held = self._at
        h = held.prepared.limbs.index(limb)
        settled, space = held.prepared.batch.hands[h], held.prepared.hands.spaces[h]
        states = opening_states(limb, settled, space)
        others = tuple(hand for hand in held.posed.hands if hand.limb != limb)
        self._near = None
        at = held.posed
        alone = self._plan(Posed(at.route, others, at.body, at.angles, states[0]))
        loads = [*alone.loads[:h], closing_loads(settled, space), *alone.loads[h:]]
        self._go(hold_with(held.posed, loads))
        self._at = alone
        return states

    def _follow(self, states: Sequence[MovingHand]) -> None:
        """Follow the states of a hand that opens or closes."""
        k = 0
        while k < len(states):
            state = states[k]
            after = states[k + 1] if k + 1 < len(states) else None
            if after is None or np.abs(after.tensions - state.tensions).max() > 1e-6:
                self._go(self._plan(self._at.posed.beside(state)))
                k += 1
                continue
            # spines let go or catch at one tension: all others keep theirs
            middle = replace(state, wrench=0.5 * (state.wrench + after.wrench))
            held = self._plan(self._at.posed.beside(middle))
            for each in (state, after):
                posed = held.posed.beside(each)
                self._go(hold_with(posed, Passage(held, held).settled(0.0, posed)))
            k += 2

    def _swing(self, move: Move) -> None:
        """Swing the hand from its old hold to the new one."""
        posed, limb = self._at.posed, move.hand.limb
        given = None if isinstance(move.joints, str) else move.joints.get(limb)
        kinds: Sequence[Sequence[Array]]
        if isinstance(given, np.ndarray):
            kinds = [[given]]
        else:
            here = self._route, self._move, self._scene, posed.body, posed.angles
            kinds = ends_of_swing(*here)
        if not kinds:
            target = posed.body.inverse() @ move.hand.pose
            solve_limbs(self._route.start.robot, {limb: target}, {}, np.zeros(3))
            raise NoPlanError(f"no joint angles were found for {limb} on its new hold")
        way = swing_to(self._scene, posed.body, posed.angles, limb, kinds)
        assert posed.moving is not None
        air = in_air(posed.moving)
        for k, angles in enumerate(way.path[1:], start=1):
            # on the first way from the rock its wrench goes, somehow
            moving = replace(air, deviation=np.abs(posed.moving.wrench)) if k == 1 else air
            at = self._at.posed.beside(moving, angles)
            self._go(self._plan(at, stage=k == way.retreat), stage=k == way.retreat)

    def _arrived(self, place: HandOnHold) -> tuple[Posed, list[MovingHand]]:
        """Return the posture with the hand on its new hold, and its states while it closes."""
        posed, by_limb = self._at.posed, {hand.limb: hand for hand in self._at.posed.hands}
        by_limb[place.limb] = place
        order = [hand.limb for hand in self._route.start.hands]
        hands = tuple(by_limb[limb] for limb in order)
        whole = Posed(posed.route, hands, posed.body, posed.angles)
        prepared, h = whole.holding.prepared, order.index(place.limb)
        states = closing_states(place.limb, prepared.batch.hands[h], prepared.hands.spaces[h])
        states[0] = replace(states[0], deviation=np.abs(states[0].wrench))
        return whole, states

    def _load(self, whole: Posed, limb: str) -> None:
        """Load the hand on its new hold."""
        prepared = whole.holding.prepared
        h = prepared.limbs.index(limb)
        settled, space = prepared.batch.hands[h], prepared.hands.spaces[h]
        alone = self._at.loads
        self._at = hold_with(whole, [*alone[:h], closing_loads(settled, space), *alone[h:]])
        self._near = None
        self._go(self._plan(whole, stage=True), stage=True)

    # Knots --------------------------------------------------------------------------------------

    @contextmanager
    def _in(self, phase: KnotPhase) -> Iterator[None]:
        """Plan a part of a move; what stands in its way ends the climb."""
        self._phase = phase
        try:
            yield
        except DeadlineError as error:
            count = len(self._route.moves)
            done = f"the climb was planned, at the {phase} of move {self._move} of {count}"
            raise DeadlineError(error.seconds, done) from error
        except (NoPlanError, UnreachableError, BranchEndError, NoWayError) as error:
            failure = Failure(self._move, phase, self._limb, str(error))
            raise _BlockedError(failure) from error

    def _plan(self, posed: Posed, *, stage: bool = False) -> HeldPosture:
        """Return the plan of a posture; between stages palms press, so that they can settle.

        Plans that may use all of the cap leave no room on the way; between stages the margin is
        the largest in their place.
        """
        press = self._numbers.press
        wide = objective_needs(self._route.objective).whole_cap and not stage
        objective: Objective | None = "max_margin" if wide else None
        for least in (0.0,) if stage else (press, 0.25 * press, 0.0):
            try:
                held = hold_as_planned(posed, self._near, least, objective)
            except NoPlanError:
                if not least:
                    raise
            else:
                self._near = held.solution
                return held
        raise AssertionError  # the last one returns or raises

    def _shifted(self, posed: Posed, body: Pose) -> Posed:
        """Return a posture with the body elsewhere and all hands where they are."""
        robot, hands = self._route.start.robot, {hand.limb: hand.pose for hand in posed.hands}
        found = shift_postures(robot, hands, [body], posed.angles)
        angles = {**posed.angles, **{limb: each[-1] for limb, each in found.items()}}
        return Posed(posed.route, posed.hands, body, angles, posed.moving)

    def _go(self, end: HeldPosture, *, stage: bool = False, halvings: int | None = None) -> None:
        """Append knots on the way to where the robot is held next."""
        left = self._numbers.halvings if halvings is None else halvings
        start, numbers = self._at, self._numbers
        passage = Passage(start, end, numbers.excess)
        bound, top = passage.bound(), max(start.utilisation, end.utilisation)
        cap = self._route.limits.utilisation + CAP_SLACK
        near = bound <= min((1.0 + numbers.excess) * top + numbers.excess_floor, cap)
        if not (near or passage.still) and left:
            middle = passage.posed(0.5)
            if middle.body is not start.posed.body:
                middle = self._shifted(start.posed, middle.body)
            self._go(self._plan(middle), halvings=left - 1)
            self._go(end, stage=stage, halvings=left - 1)
            return
        if not bound <= cap:
            raise NoPlanError(
                "between two knots passive reactions do not balance the way of the centre of mass"
                if math.isinf(bound)
                else f"between two knots the utilisation may be {bound:.3g}"
            )
        change = max(
            float(np.abs(now.tensions - before.tensions).max())
            for now, before in zip(end.hand_knots(), start.hand_knots(), strict=True)
        )
        most = self._route.limits.tension_change
        pieces = 1 if most is None else math.ceil(change / most - 1e-9)
        for k in range(1, pieces):
            self._append(passage.hold(k / pieces), bound)
        self._append(end, bound, stage=stage)
        self._at = end

    def _append(self, held: HeldPosture, bound: float | None, *, stage: bool = False) -> None:
        """Append a knot."""
        used, limiting = held.most_used
        knot = Knot(
            index=len(self.knots),
            move=self._move,
            phase=self._phase,
            limb=self._limb,
            stage=self._stage if stage else None,
            time=0.0,
            body=held.posed.body,
            joints=held.posed.angles,
            joint_torque=held.joint_torque,
            hands=held.hand_knots(),
            utilisation=used,
            bound=bound,
            limiting=limiting,
            verified=True,
        )
        if self.knots:
            before = self.knots[-1]
            time = before.time + self._settings.duration(before, knot, self._route.start.robot)
            knot = replace(knot, time=time)
        self.knots.append(knot)
        self._stage += stage
