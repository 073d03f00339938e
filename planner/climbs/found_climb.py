"""The answer of a search for a climb that can be executed."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from hand_models.hand import WristTravel
from planner.climbs.outcome import ClimbStatus, DecidingStage, Raise, RefusedMoves
from planner.climbs.routing import ClimbStep
from planner.deadline import DeadlineError
from planner.question import HandOnHold, Question
from planner.route import Climb, Route, RouteResult, evaluate
from planner.search import Ends, Found, State, Wall, search

__all__ = [
    "FoundClimb",
    "deciding_stage",
    "weakest_state",
    "with_compliant_stages",
    "with_compliant_wrists",
    "with_joints",
]


@dataclass(frozen=True, eq=False, kw_only=True)
class FoundClimb:
    """The best climb that was planned whole, and how much better another could be.

    Attributes
    ----------
    status : {'found', 'not_proven', 'none', 'blocked', 'unknown'}
    wall : Wall
    ends : tuple of Ends, length 2
        Those of the start and of the goal.
    found : Found
        Answer of the search whose states the climb has; of the last search without a climb.
    least : float or None
        Least load factor of the climb's planned stages; None without a climb, or if a stage has
        none.
    route : Route or None
    climb : Climb or None
        Verified knots from end to end.
    result : RouteResult or None
        Plans of all stages.
    deciding : DecidingStage or None
    raises : tuple of Raise
        Changes that raise the load factor of the deciding stage, the best first.
    raised : tuple of Question
        The deciding stage with each of these changes.
    refused : tuple of RefusedMoves
        Moves of found states that have no plan, by kind.
    seconds : dict of str to float
        Duration of each phase [s].
    compliant : RouteResult or None
        Plans of the same stages with wrists that give; None unless they were asked for and planned.
    """

    status: ClimbStatus
    wall: Wall
    ends: tuple[Ends, Ends]
    found: Found
    least: float | None = None
    route: Route | None = None
    climb: Climb | None = None
    result: RouteResult | None = None
    deciding: DecidingStage | None = None
    raises: tuple[Raise, ...] = ()
    raised: tuple[Question, ...] = ()
    refused: tuple[RefusedMoves, ...] = ()
    seconds: dict[str, float] = field(default_factory=dict)
    compliant: RouteResult | None = None

    @property
    def bound(self) -> float:
        """Bound of the search: no climb of the wall has a larger least load factor, by statics."""
        return self.found.bound

    @property
    def gap(self) -> float | None:
        """Part by which another climb's least load factor may be larger; None without a climb.

        None is larger where the plans of the stages hold as much as the bound, or more: they know
        the posture's centre of mass.
        """
        return max(self.bound / self.least - 1.0, 0.0) if self.least else None

    @property
    def about(self) -> str:
        """Sentence that says what the bound is about, and which limbs reach nothing at an end."""
        wall = self.wall
        said = (
            f"the bound is about the placements ({len(wall.places)}) and poses of the body "
            f"({len(wall.bodies)}), hands with fixed wrists and joints as the reach table has them "
            "(what inverse kinematics did not find is left out), without limits of joint torques"
        )
        for name, end in zip(("start", "goal"), self.ends, strict=True):
            if short := " and ".join(_out_of_reach(wall, end)):
                said += f"; at the {name} no placement that counts is within reach of {short}"
        return said


def _out_of_reach(wall: Wall, end: Ends) -> list[str]:
    """Return the limbs that reach no placement that counts, at any pose of the body at an end."""
    reached = wall.reach.reached[:, end.bodies]
    if end.members is not None:
        at = np.array(end.members)
        reached = reached[at, :, np.arange(len(at))].T[None]
    return [limb for i, limb in enumerate(wall.robot.limbs) if not reached[:, :, i].any()]


def with_joints(climb: Climb) -> Route:
    """Return the route of a climb with the joint angles that it has at the start and on holds."""
    route, stages = climb.route, climb.stage_joints
    placed = [climb.held[i + 1].posed.angles for i in range(len(route.moves))]
    return replace(
        route,
        start=replace(route.start, joints=stages[0]),
        moves=tuple(
            replace(move, joints={move.hand.limb: angles[move.hand.limb]})
            for move, angles in zip(route.moves, placed, strict=True)
        ),
    )


def with_compliant_wrists(route: Route, travel: WristTravel | None = None) -> Route:
    """Return a route whose hands have compliant wrists, with a travel; nails stay fixed.

    Parameters
    ----------
    route : Route
    travel : WristTravel, optional
        Range in which wrists may settle; `WristTravel` by default.
    """

    def giving(hand: HandOnHold) -> HandOnHold:
        if hand.grasp.fingernail:
            return hand
        return replace(hand, wrist="compliant", wrist_travel=travel)

    start = replace(route.start, hands=tuple(map(giving, route.start.hands)))
    moves = tuple(replace(move, hand=giving(move.hand)) for move in route.moves)
    return replace(route, start=start, moves=moves)


def with_compliant_stages(
    found: FoundClimb,
    travel: WristTravel | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> FoundClimb:
    """Return a climb whose stages are planned with compliant wrists, too, in its joint angles.

    Without a climb, or if the deadline passes before all stages are planned, it stays as it is.

    Parameters
    ----------
    found : FoundClimb
    travel : WristTravel, optional
        Range in which wrists may settle.
    progress : callable, optional
        Called after each stage with (number of stages planned, number of stages).
    """
    if found.route is None:
        return found
    begun, route = time.perf_counter(), with_compliant_wrists(found.route, travel)
    with suppress(DeadlineError):
        plans = evaluate(route, workers=1, progress=progress, climb=found.climb)
        seconds = found.seconds | {"compliant": time.perf_counter() - begun}
        return replace(found, compliant=plans, seconds=seconds)
    return found


def deciding_stage(
    steps: Sequence[ClimbStep], result: RouteResult, wall: Wall
) -> tuple[DecidingStage | None, State]:
    """Return the stage of a climb with the least load factor, and its state.

    Parameters
    ----------
    steps : sequence of ClimbStep
    result : RouteResult
        Plans of its stages.
    wall : Wall
    """
    states = [steps[0].shifts[0]]
    for step in steps:
        states += [step.shifts[-1]] * (len(step.shifts) > 1)
        states += [state for state in (step.lift, step.place) if state is not None]
    plans = result.plans
    factors = [np.inf if p.load_factor is None else p.load_factor for p in plans]
    i = int(np.argmin(factors))
    if not np.isfinite(factors[i]):
        return None, states[i]
    stage, state = result.stages[i], states[i]
    placed = zip(wall.robot.limbs, state.members, strict=True)
    return DecidingStage(
        stage=i,
        move=stage.move,
        phase=stage.phase,
        limb=stage.limb,
        load_factor=factors[i],
        limiting=plans[i].limiting,
        placements={limb: p for limb, p in placed if p >= 0},
        body=state.body,
    ), state


def weakest_state(
    found: FoundClimb, start: Ends, goal: Ends, seconds: float | None = None
) -> State | None:
    """Return the state that decides a climb; without a climb, where its bound chokes.

    That is the weakest state of the best way that hands hold, however little they do. None if there
    is no such way.

    Parameters
    ----------
    found : FoundClimb
    start, goal : Ends
        Those of the climb.
    seconds : float, optional
        Longest time of the search for the best way [s].
    """
    if found.deciding is not None:
        placed = found.deciding.placements
        members = tuple([placed.get(limb, -1) for limb in found.wall.robot.limbs])
        return State(found.deciding.body, members)
    held = found.found
    if not held.states:
        held = search(found.wall, start, goal, within=0.5, seconds=seconds)
    return held.states[int(held.factors.argmin())] if held.states else None
