"""Find a climb that can be executed: search for states, plan their moves, go round what fails."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from hand_models.base import InvalidInputError
from planner import deadline
from planner.climbs.found_climb import FoundClimb, deciding_stage, with_joints
from planner.climbs.move_checks import MoveChecks
from planner.climbs.other_bodies import detours
from planner.climbs.outcome import ClimbProgress, ClimbStatus, Raise, RefusedMoves
from planner.climbs.postures import PostureChoice, Postures, Swung
from planner.climbs.raising import raises
from planner.climbs.routing import ClimbStep, RouteMaker
from planner.climbs.settings import StepSettings
from planner.climbs.stepping import Stepping
from planner.deadline import DeadlineError
from planner.question import Limits, Objective, Question
from planner.route import (
    Climb,
    ClimbSettings,
    Failure,
    KnotPhase,
    RouteResult,
    evaluate,
    plan_climb,
)
from planner.search import Arc, Ends, Found, Proof, SearchMemory, State, Wall, search

__all__ = ["find_climb"]


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

    Between heights or points a first climb is looked for step by step. The search finds states;
    their moves are planned whole. A move that has no plan is left out of the next search, until a
    climb has a plan from end to end, the time is over, or no states are left. The bound is that of
    all states, whether their moves have plans or not.

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
        Time after which the best so far is returned [s]: until then, better climbs are looked for
        where joints decide. Without it, the search ends with the best by its statics.
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
        return finder.find(start, goal, within, at_least, higher=seconds is not None)


class _Planned(NamedTuple):
    """A climb that has a plan from end to end."""

    steps: list[ClimbStep]
    climb: Climb
    result: RouteResult

    @property
    def least(self) -> float:
        return self.result.load_factor or -np.inf


class _Tried(NamedTuple):
    """Moves that were planned, and the parts that have no plan."""

    climb: Climb | None
    failures: tuple[Failure, ...]

    @property
    def failure(self) -> Failure | None:
        """The first part that has none."""
        return self.failures[0] if self.failures else None


class _Finder:
    """The best climb so far, and what is left out of further searches."""

    def __init__(
        self,
        maker: RouteMaker,
        settings: ClimbSettings | None,
        progress: Callable[[ClimbProgress], None] | None,
    ) -> None:
        self._maker, self._settings, self._progress = maker, settings, progress
        self._asks, self._memory = False, SearchMemory()
        self._refused = Counter[tuple[str | None, KnotPhase]]()
        self._reasons = dict[tuple[str | None, KnotPhase], str]()
        self._best: _Planned | None = None
        self._bound = np.inf
        self._proof: Proof | None = None
        # below one, the hands do not hold the robot at all
        self._floor = 1.0
        self._begun = time.perf_counter()
        self._seconds = dict.fromkeys(
            ("search", "steps", "postures", "moves", "stages", "changes"), 0.0
        )
        self._before: Climb | None = None
        self._began: object = None
        self._checks = MoveChecks(maker.wall, maker.limits)
        self._postures = Postures(self._checks)

    def find(
        self, start: Ends, goal: Ends, within: float, at_least: float | None, *, higher: bool
    ) -> FoundClimb:
        """Search and plan until the climb is good enough, nothing is left, or the time is over."""
        # the first search bounds all climbs; in the next one moves are planned as climbs are found
        found = self._search(start, goal, within, at_least, 0.3)
        open_ends = None in (start.members, goal.members)
        steps = open_ends and bool(found.states or not found.finished)
        if steps and not deadline.expired():
            # from one stance to another there are few climbs, and the search finds the best
            self._step((start, goal), max(self._floor, at_least or 0.0))
        self._asks = True
        none, known = found.finished and not found.states, self._best is not None
        done = known and (higher or self._good(within, at_least))
        if not (none or done or deadline.expired()):
            found = self._search(start, goal, within, at_least, 1.0)
        if higher:
            found = self._climb_higher(found, (start, goal), within, at_least)
        return self._answer(found, (start, goal), within, at_least)

    def _climb_higher(
        self, found: Found, ends: tuple[Ends, Ends], within: float, at_least: float | None
    ) -> Found:
        """Look for climbs better than the best, in whose states joints bear as much as hands hold.

        The best of a search is so by its statics, which know no joints. Multiples are tried between
        the best climb's load factor and the bound of all, as long as there is time: it may be long.

        Returns the answer of the search that has found the best climb.
        """
        high, checks = self._bound, self._checks
        while self._best is not None and not (deadline.expired() or self._good(within, at_least)):
            least = self._best.least
            multiple = max((least * high) ** 0.5, at_least or 0.0)
            if high <= (1.0 + within) * least or multiple >= high:
                break
            self._checks = checks.bearing(multiple)
            self._postures = self._postures.with_checks(self._checks)
            again = self._search(*ends, 0.0, multiple, 0.3, multiple)
            if self._best.least > least:
                found = again
            elif not again.finished:
                self._step(ends, multiple)
            high = high if self._best.least >= multiple else multiple
        return found

    def _search(
        self,
        start: Ends,
        goal: Ends,
        within: float,
        at_least: float | None,
        share: float,
        floor: float | None = None,
    ) -> Found:
        begun, left = time.perf_counter(), deadline.left()
        try:
            found = search(
                self._maker.wall,
                start,
                goal,
                within=within,
                at_least=at_least,
                floor=self._floor if floor is None else floor,
                seconds=None if left is None else share * left,
                passes=self._checks.passes if self._asks else None,
                refuses=self._refuses if self._asks else None,
                memory=self._memory,
                progress=lambda _, __, bound, ___: self._report("search", bound),
            )
        except DeadlineError:
            found = Found.nothing()
        if found.bound <= self._bound:
            self._bound, self._proof = found.bound, found.proof
        self._seconds["search"] += time.perf_counter() - begun
        return found

    def _refuses(self, states: Sequence[State]) -> set[Arc]:
        """Plan the moves of states; return those that have no plan, and keep a climb that has."""
        begun, blocked = time.perf_counter(), set[Arc]()
        tried, failed, own = self._climb(states), False, ClimbStep.each(states)
        first = tried
        while tried.failure is not None:
            failure, steps = tried.failure, ClimbStep.each(states)
            step = steps[max(failure.move, 1) - 1]
            alone = len(tried.failures) == 1
            others = detours(self._maker.wall, self._checks, states, step) if alone else ()
            for other in others:
                again = self._climb(other)
                if again.failure is None or again.failure.move > failure.move:
                    tried, states = again, other
                    break
                if again.climb is not None:
                    # its postures fit, and another move has no plan: that counts as well
                    blocked |= self._refusal(again, ClimbStep.each(other))
            else:
                blocked |= self._refusal(tried, steps)
                if first is not tried:
                    # the climb that was asked about has no plan either
                    blocked |= self._refusal(first, own)
                failed = True
                break
        self._seconds["moves"] += time.perf_counter() - begun
        if failed or tried.climb is None:
            return blocked
        self._keep(ClimbStep.each(states), tried.climb)
        return set()

    def _keep(self, steps: list[ClimbStep], climb: Climb) -> None:
        """Plan the stages of a climb, and keep it if it is the best."""
        begun = time.perf_counter()
        self._report("stages")
        result = evaluate(climb.route, workers=1, climb=climb)
        self._seconds["stages"] += time.perf_counter() - begun
        planned = _Planned(steps, climb, result)
        if self._best is None or planned.least > self._best.least:
            self._best = planned

    def _step(self, ends: tuple[Ends, Ends], least: float) -> None:
        """Look for a first climb step by step."""
        begun, left, settings = time.perf_counter(), deadline.left(), StepSettings()
        with (
            suppress(DeadlineError),
            deadline.within(None if left is None else settings.time * left),
        ):
            stepping = Stepping(self._checks, ends, self._memory, least)
            for _ in range(settings.plans):
                self._report("steps")
                found = stepping.find()
                if found is None:
                    break
                steps = ClimbStep.each(found.states)
                tried = self._plan(steps, found.choice)
                if tried.climb is not None and tried.failure is None:
                    self._keep(steps, tried.climb)
                    break
                self._refusal(tried, steps)
                stepping.refuse(found, tried.failures[0])
        self._seconds["steps"] += time.perf_counter() - begun

    def _climb(self, states: Sequence[State]) -> _Tried:
        """Choose postures for states, and plan the moves."""
        steps, without, best = ClimbStep.each(states), frozenset[Swung](), None
        for _ in range(self._checks.settings.plans):
            begun = time.perf_counter()
            chosen = self._postures.choose(steps, without)
            self._seconds["postures"] += time.perf_counter() - begun
            if isinstance(chosen, list):
                return best or _Tried(None, tuple(chosen))
            tried = self._plan(steps, chosen)
            if tried.failure is None:
                return tried
            if best is None or best.failure is None or tried.failure.move > best.failure.move:
                best = tried
            without |= self._postures.refuse(steps, chosen, tried.failure)
        assert best is not None
        return best

    def _plan(self, steps: Sequence[ClimbStep], chosen: PostureChoice) -> _Tried:
        """Plan the moves with joint angles that were chosen."""
        start = steps[0].shifts[0], [angles.tobytes() for angles in chosen.start.values()]
        after = self._before if start == self._began else None
        climb = plan_climb(
            self._maker.route(steps, chosen.start, chosen.placed),
            self._settings,
            lambda done, total: self._report("moves", done=done, total=total),
            after=after,
        )
        self._before, self._began = climb, start
        return _Tried(climb, () if climb.failure is None else (climb.failure,))

    def _refusal(self, tried: _Tried, steps: Sequence[ClimbStep]) -> set[Arc]:
        """Return what to leave out as moves fail, and count them."""
        limbs, found = self._maker.wall.robot.limbs, set[Arc]()
        for failure in tried.failures:
            step = steps[max(failure.move, 1) - 1]
            # of a planned climb it is not said which limb is in the way
            if tried.climb is None and failure.phase == "shift" and failure.limb in limbs:
                self._checks.learn_shift(step.shifts, limbs.index(failure.limb))
            key = failure.limb, failure.phase
            self._refused[key] += 1
            self._reasons[key] = failure.reason
            found |= step.refused(failure.phase)
        return found

    def _good(self, within: float, at_least: float | None) -> bool:
        least = -np.inf if self._best is None else self._best.least
        slack = 1e-6  # of linear programs
        enough = at_least is not None and least >= at_least
        return enough or self._bound <= (1.0 + within) * least * (1.0 + slack)

    def _answer(
        self, found: Found, ends: tuple[Ends, Ends], within: float, at_least: float | None
    ) -> FoundClimb:
        refused = tuple(
            RefusedMoves(limb=key[0], phase=key[1], reason=self._reasons[key], count=count)
            for key, count in self._refused.most_common()
        )
        # the bound may be that of another search, and the certificate is one of this bound
        found = replace(found, bound=self._bound, proof=self._proof)
        wall, best = self._maker.wall, self._best
        made = partial(FoundClimb, wall=wall, ends=ends, found=found, refused=refused)
        if best is None:
            ended = found.finished and not found.states
            proven = self._bound <= max(self._floor, at_least or 0.0)
            nothing: ClimbStatus = ("none" if proven else "blocked") if ended else "unknown"
            return made(status=nothing, seconds=dict(self._seconds))
        status: ClimbStatus = "found" if self._good(within, at_least) else "not_proven"
        if at_least is not None and best.least < at_least:
            status = "none" if self._bound <= at_least else "unknown"
        begun = time.perf_counter()
        self._report("changes")
        deciding, state = deciding_stage(best.steps, best.result, wall)
        changes: tuple[tuple[Raise, Question], ...] = ()
        if deciding is not None and not deadline.expired():
            stage = best.result.stages[deciding.stage].question
            with suppress(DeadlineError):
                changes = raises(wall, state, stage, deciding.load_factor)
        self._seconds["changes"] += time.perf_counter() - begun
        return made(
            status=status,
            least=best.result.load_factor,
            route=with_joints(best.climb),
            climb=best.climb,
            result=best.result,
            deciding=deciding,
            raises=tuple(change for change, _ in changes),
            raised=tuple(asked for _, asked in changes),
            seconds=dict(self._seconds),
        )

    def _report(
        self, phase: str, bound: float | None = None, *, done: int = 0, total: int = 0
    ) -> None:
        if self._progress is not None:
            best = None if self._best is None else self._best.result.load_factor
            lowest = min(each for each in (bound, self._bound) if each is not None)
            seconds = time.perf_counter() - self._begun
            known = lowest if np.isfinite(lowest) else None
            self._progress(ClimbProgress(phase, best, known, seconds, done, total))
