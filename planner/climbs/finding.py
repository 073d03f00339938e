"""Find a climb that can be executed: search for states, plan their moves, go round what fails."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import chain, pairwise
from typing import NamedTuple

import numpy as np

from hand_models.base import InvalidInputError
from planner import deadline
from planner.climbs.found_climb import FoundClimb
from planner.climbs.move_checks import MoveChecks
from planner.climbs.other_bodies import detours
from planner.climbs.outcome import ClimbStatus, DecidingStage, Raise, RefusedMoves
from planner.climbs.raising import raises
from planner.climbs.routing import Arc, ClimbStep, RouteMaker
from planner.deadline import DeadlineError
from planner.question import Limits, Objective
from planner.route import (
    Climb,
    ClimbSettings,
    Failure,
    KnotPhase,
    Route,
    RouteResult,
    evaluate,
    plan_climb,
)
from planner.search import Ends, Found, State, Wall, search

__all__ = ["ClimbProgress", "find_climb"]


class ClimbProgress(NamedTuple):
    """Progress of the search for a climb.

    Attributes
    ----------
    phase : {'search', 'moves', 'stages', 'changes'}
    best, bound : float or None
        Least load factor of the best climb so far, and the bound of all.
    seconds : float
        Since the beginning [s].
    done, total : int
        Moves that are planned, and their number; zero in other phases.
    """

    phase: str
    best: float | None
    bound: float | None
    seconds: float
    done: int = 0
    total: int = 0


def find_climb(
    wall: Wall,
    start: Ends,
    goal: Ends,
    *,
    name: str = "climb",
    limits: Limits | None = None,
    objective: Objective = "max_margin",
    within: float = 0.05,
    at_least: float | None = None,
    seconds: float | None = None,
    settings: ClimbSettings | None = None,
    progress: Callable[[ClimbProgress], None] | None = None,
) -> FoundClimb:
    """Find the climb of a wall with the largest least load factor that can be executed.

    The search finds states; their moves are planned whole. A move that has no plan is left out of
    the next search, until a climb has a plan from end to end, the time is over, or no states are
    left. The bound is that of all states, whether their moves have plans or not.

    Parameters
    ----------
    wall : Wall
    start, goal : Ends
    name : str
        Of the route.
    limits : Limits, optional
        Of every stage and knot.
    objective : str
        Of every stage.
    within : float
        Part by which another climb may be better.
    at_least : float, optional
        Least load factor that is enough.
    seconds : float, optional
        Time after which the best so far is returned [s]; without limit by default.
    settings : ClimbSettings, optional
        Rates of the controller.
    progress : callable, optional
        Called with `ClimbProgress`.

    Raises
    ------
    InvalidInputError
        If no pose of the body is in the start or the goal, or a number is impossible.
    """
    for field_name, ends in (("start", start), ("goal", goal)):
        if not ends.bodies.any():
            raise InvalidInputError("has no pose of the body on the grid", field=field_name)
    for field_name, number in (("within", within), ("at_least", at_least), ("seconds", seconds)):
        if number is not None and not (0.0 <= number < np.inf and (number or number is within)):
            raise InvalidInputError(
                f"must be a number {'≥' if field_name == 'within' else 'above'} 0, got {number:g}",
                field=field_name,
            )
    finder = _Finder(RouteMaker(wall, name, limits or Limits(), objective), settings, progress)
    with deadline.within(seconds):
        return finder.find(start, goal, within, at_least)


class _Planned(NamedTuple):
    """A climb that has a plan from end to end."""

    found: Found
    steps: list[ClimbStep]
    climb: Climb
    result: RouteResult

    @property
    def least(self) -> float:
        return self.result.load_factor or -np.inf


class _Finder:
    """The best climb so far, and what is left out of further searches."""

    def __init__(
        self,
        maker: RouteMaker,
        settings: ClimbSettings | None,
        progress: Callable[[ClimbProgress], None] | None,
    ) -> None:
        self._maker, self._settings, self._progress = maker, settings, progress
        self._blocked = set[Arc]()
        self._refused = Counter[tuple[str | None, KnotPhase]]()
        self._reasons = dict[tuple[str | None, KnotPhase], str]()
        self._best: _Planned | None = None
        self._bound = np.inf
        # below one, the hands do not hold the robot at all
        self._floor = 1.0
        self._begun = time.perf_counter()
        self._seconds = dict.fromkeys(("search", "moves", "stages", "changes"), 0.0)
        self._before: Climb | None = None
        self._checks = MoveChecks(maker.wall, maker.limits)

    def find(self, start: Ends, goal: Ends, within: float, at_least: float | None) -> FoundClimb:
        """Search and plan until the climb is good enough, nothing is left, or the time is over."""
        found, share, ended = None, 0.7, False
        while not ended:
            bounded = np.isfinite(self._bound)
            found = self._search(start, goal, within, at_least, share)
            if not found.states:
                break
            # the first search bounds all climbs; those after it ask which moves pass
            pairs = [*pairwise(found.states), *zip(found.states, found.states, strict=True)]
            if not bounded and not all(self._checks.passes(*pair) for pair in pairs):
                continue
            try:
                planned = self._plan(found)
            except DeadlineError:
                break
            if planned is not None:
                if self._best is None or planned.least > self._best.least:
                    self._best = planned
                # a search that was broken off may find a better one in all of the time left
                ended = self._good(within, at_least) or found.finished or share == 1.0
                share = 1.0
            ended = ended or deadline.expired()
        assert found is not None
        return self._answer(found, within, at_least)

    def _search(
        self, start: Ends, goal: Ends, within: float, at_least: float | None, share: float
    ) -> Found:
        begun, left = time.perf_counter(), deadline.left()
        try:
            found = search(
                self._maker.wall,
                start,
                goal,
                within=within,
                at_least=at_least,
                floor=self._floor,
                seconds=None if left is None else share * left,
                blocked=frozenset(self._blocked),
                passes=self._checks.passes if np.isfinite(self._bound) else None,
                progress=lambda _, __, bound, ___: self._report("search", bound),
            )
        except DeadlineError:
            found = _nothing()
        self._bound = min(self._bound, found.bound)
        self._seconds["search"] += time.perf_counter() - begun
        return found

    def _plan(self, found: Found) -> _Planned | None:
        """Plan the moves of states; without a plan of them all, leave out those that have none."""
        begun, states = time.perf_counter(), list(found.states)
        climb = self._climb(states, self._before)
        if climb.failure is not None and self._before is not None:
            # joints that were chosen for other moves may be what is in the way
            climb = self._climb(states, None)
        while climb.failure is not None:
            failure, step = climb.failure, ClimbStep.each(states)[max(climb.failure.move, 1) - 1]
            for other in detours(self._maker.wall, self._checks, states, step):
                again = self._climb(other, climb)
                if again.failure is None or again.failure.move > failure.move:
                    climb, states = again, other
                    break
            else:
                self._leave_out(failure, step)
                break
        self._before = climb
        self._seconds["moves"] += time.perf_counter() - begun
        if climb.failure is not None:
            return None
        begun = time.perf_counter()
        self._report("stages")
        result = evaluate(climb.route, workers=1, climb=climb)
        self._seconds["stages"] += time.perf_counter() - begun
        return _Planned(found, ClimbStep.each(states), climb, result)

    def _climb(self, states: Sequence[State], after: Climb | None) -> Climb:
        """Plan moves, after those of another climb or from some joint angles at the start."""
        best: Climb | None = None
        own = () if after is not None else self._checks.joints(states[0])
        starts = chain([None], own)
        for joints in starts:
            climb = plan_climb(
                self._maker.route(ClimbStep.each(states), joints),
                self._settings,
                lambda done, total: self._report("moves", done=done, total=total),
                known=self._maker.branches,
                after=after,
            )
            if best is None or len(climb.knots) > len(best.knots):
                best = climb
            failure = climb.failure
            # the joints at the start last at least till the body has shifted
            if failure is None or failure.move > 1 or failure.phase not in ("start", "shift"):
                return climb
        assert best is not None
        return best

    def _leave_out(self, failure: Failure, step: ClimbStep) -> None:
        """Leave a move that fails out of further searches."""
        self._blocked |= step.refused(failure.phase)
        key = failure.limb, failure.phase
        self._refused[key] += 1
        self._reasons[key] = failure.reason

    def _good(self, within: float, at_least: float | None) -> bool:
        least = -np.inf if self._best is None else self._best.least
        slack = 1e-6  # of linear programs
        enough = at_least is not None and least >= at_least
        return enough or self._bound <= (1.0 + within) * least * (1.0 + slack)

    def _answer(self, found: Found, within: float, at_least: float | None) -> FoundClimb:
        refused = tuple(
            RefusedMoves(limb=key[0], phase=key[1], reason=self._reasons[key], count=count)
            for key, count in self._refused.most_common()
        )
        wall, best = self._maker.wall, self._best
        if best is None:
            ended = found.finished and not found.states
            proven = self._bound <= max(self._floor, at_least or 0.0)
            nothing: ClimbStatus = ("none" if proven else "blocked") if ended else "unknown"
            return FoundClimb(
                status=nothing,
                wall=wall,
                found=found,
                bound=self._bound,
                refused=refused,
                seconds=dict(self._seconds),
            )
        status: ClimbStatus = "found" if self._good(within, at_least) else "not_proven"
        if at_least is not None and best.least < at_least:
            status = "none" if self._bound <= at_least else "unknown"
        begun = time.perf_counter()
        self._report("changes")
        deciding, state = _deciding(best, wall)
        changes: tuple[Raise, ...] = ()
        if deciding is not None and not deadline.expired():
            stage = best.result.stages[deciding.stage].question
            changes = raises(wall, state, stage, deciding.load_factor)
        self._seconds["changes"] += time.perf_counter() - begun
        return FoundClimb(
            status=status,
            wall=wall,
            found=best.found,
            bound=self._bound,
            least=best.result.load_factor,
            route=_with_joints(best.climb),
            climb=best.climb,
            result=best.result,
            deciding=deciding,
            raises=changes,
            refused=refused,
            seconds=dict(self._seconds),
        )

    def _report(
        self, phase: str, bound: float | None = None, *, done: int = 0, total: int = 0
    ) -> None:
        if self._progress is not None:
            best = None if self._best is None else self._best.result.load_factor
            bounds = [each for each in (bound, self._bound) if each is not None]
            lowest = min(bounds)
            seconds = time.perf_counter() - self._begun
            known = lowest if np.isfinite(lowest) else None
            self._progress(ClimbProgress(phase, best, known, seconds, done, total))


def _nothing() -> Found:
    """Return the answer of a search that was broken off before it had one."""
    return Found(
        states=(),
        factors=np.zeros(0),
        least=-np.inf,
        bound=np.inf,
        proof=None,
        programs=0,
        lifts=0,
        seconds=0.0,
        finished=False,
    )


def _with_joints(climb: Climb) -> Route:
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


def _deciding(best: _Planned, wall: Wall) -> tuple[DecidingStage | None, State]:
    """Return the stage with the least load factor, and its state."""
    states = [best.steps[0].shifts[0]]
    for step in best.steps:
        states += [step.shifts[-1]] * (len(step.shifts) > 1)
        states += [state for state in (step.lift, step.place) if state is not None]
    plans = best.result.plans
    factors = [np.inf if p.load_factor is None else p.load_factor for p in plans]
    i = int(np.argmin(factors))
    if not np.isfinite(factors[i]):
        return None, states[i]
    stage, state = best.result.stages[i], states[i]
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
