"""Find a first climb step by step, each checked before the next.

The search for the best climb (`planner.search`) knows nothing of joints: from one height to another
there are millions of climbs that hands could hold, and hardly one that a robot can execute. Here a
climb grows from postures at the start, by shifts of the body and moves of limbs whose joint angles
are known and checked (`StepChecks`). The next step is that after which the fewest moves are left,
as counted backward from the goal over all lifts whose linear programs hold enough, with one shift
of the body at most between two of them. Lifts that were made, or could not be, are put back a
little, so that the search leaves what leads nowhere. It proves nothing.
"""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Iterator
from itertools import count, islice, pairwise
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from planner import deadline
from planner.climbs.move_checks import MoveChecks
from planner.climbs.settings import StepSettings
from planner.climbs.step_checks import ClimbPosture, StepChecks, SteppedClimb, with_lift
from planner.route import Failure
from planner.screening import StanceIndices
from planner.search import Ends, Ground, Lifts, Programs, SearchMemory, SolvedStates, State

__all__ = ["Stepping"]


class _Lift(NamedTuple):
    """A lift by its index that is to be made, from a posture or from the start."""

    posture: ClimbPosture | None
    lift: int


class _Step(NamedTuple):
    """A step that was not checked yet: the state after it, and the limb that moves, or −1."""

    posture: ClimbPosture | None
    state: State
    limb: int = -1


class Stepping:
    """Search for climbs whose states all have a least load factor.

    Parameters
    ----------
    checks : MoveChecks
    ends : tuple of Ends
        Start and goal.
    memory : SearchMemory
        Of a search of the same wall with the same ends.
    least : float
        Least load factor.
    """

    def __init__(
        self, checks: MoveChecks, ends: tuple[Ends, Ends], memory: SearchMemory, least: float
    ) -> None:
        self._wall, self._least, self._settings = checks.wall, least, StepSettings()
        self._start, self._goal = ends
        self._checks, self._steps = checks, StepChecks(checks)
        self._programs = memory.programs or Programs(checks.wall.screening)
        table = memory.table or checks.wall.screening
        self._ground = Ground(checks.wall, ends, once=True)
        self._lifts = Lifts.passing(self._ground, table, least, check=self._check)
        self._near = [np.flatnonzero(row).tolist() for row in self._ground.beside]
        self._back = np.zeros(len(self._lifts))
        self._left = np.full(len(self._lifts), np.inf)
        self._held = np.zeros(len(self._lifts), dtype=bool)
        self._stood = dict[int, bool]()
        self._refused = set[tuple[object, ...]]()
        self._out = self._since = 0
        self._recall(self._programs.known)
        self._count_moves()

    @staticmethod
    def _check() -> None:
        deadline.check("a first climb was found")

    # Moves that are left ------------------------------------------------------------------------

    def _recall(self, known: SolvedStates) -> None:
        """Take over what programs of lifts say that were solved before."""
        three = np.flatnonzero((known.members < 0).sum(axis=1) == 1)
        triples, lifts = self._lifts.find(known.bodies[three], known.members[three])
        low, there = known.factors[three] < self._least, lifts >= 0
        out = low & (triples >= 0)
        self._lifts.rule_out(triples[out], known.directions[three[out]], known.held[three[out]])
        self._lifts.nodes["out"][lifts[low & there]] = 1
        self._held[lifts[~low & there]] = True

    def _holding(self, lifts: Indices) -> Indices:
        """Return the lifts whose programs say that they hold enough."""
        nodes, triples = self._lifts.nodes, self._lifts.triples
        new = lifts[~self._held[lifts] & (nodes["out"][lifts] == 0)]
        while len(new):
            # one of each triple first: its direction may rule out the others
            some = new[np.unique(triples[new], return_index=True)[1]]
            found = self._programs.solve(
                self._lifts.bodies[some], self._lifts.members[triples[some]]
            )
            low = found.factors < self._least
            self._held[some[~low]] = True
            nodes["out"][some[low]] = 1
            self._lifts.rule_out(triples[some[low]], found.directions[low], found.held[low])
            new = np.setdiff1d(new, some)
            new = new[nodes["out"][new] == 0]
        held: Indices = lifts[nodes["out"][lifts] == 0]
        return held

    def _count_moves(self) -> None:
        """Count the moves that are left after each lift."""
        lifts, nodes, moves = self._lifts, self._lifts.nodes, 0
        nodes["claimed"], nodes["closed"] = 0, 0
        self._left[:] = np.inf
        _, met = lifts.expand(self._holding(lifts.beside(1)), 0)
        front = np.unique(met[met[:, 1] == -2, 0])
        nodes["claimed"][front] |= 2
        while len(front):
            self._check()
            front = self._holding(front)
            self._left[front] = moves
            nodes["closed"][front] = 2
            front, _ = lifts.expand(front, 2)
            moves += 1
        self._out = self._since = 0

    def _after_lifts(self, bodies: Indices, members: Indices) -> Array:
        """Return what is left after each lift of states (n, L), shape (n, L); ∞ for none."""
        n, limbs = members.shape
        rows = np.repeat(members, limbs, axis=0)
        rows[np.arange(n * limbs), np.tile(np.arange(limbs), n)] = -1
        _, lifts = self._lifts.find(np.repeat(bodies, limbs), rows)
        there = (lifts >= 0) & (self._lifts.nodes["out"][lifts] == 0)
        return np.where(there, self._left[lifts] + self._back[lifts], np.inf).reshape(n, limbs)

    def _before(self, bodies: Indices, members: Indices) -> Array:
        """Return how many moves are left from states, without a shift first, shape (n,)."""
        found = 1.0 + self._after_lifts(bodies, members).min(axis=1, initial=np.inf)
        there, wanted = self._goal.bodies[bodies], self._goal.members
        if wanted is not None:
            there = there & (members == np.array(wanted)).all(axis=1)
        return np.where(there, 0.0, found)

    def _from(self, body: int, members: Indices, to: list[int]) -> Array:
        """Return how many moves are left from states (n, L) at a body, shape (n,).

        ``to``: the bodies to which it may be shifted first.
        """
        found, limbs = (
            self._before(np.full(len(members), body), members),
            np.arange(4)[: members.shape[1]],
        )
        for other in to:
            on = np.flatnonzero(self._ground.reached[members, other, limbs].all(axis=1))
            if len(on):
                far = self._settings.shift + self._before(np.full(len(on), other), members[on])
                found[on] = np.minimum(found[on], far)
        return found

    # The order of steps -------------------------------------------------------------------------

    def find(self) -> SteppedClimb | None:
        """Return a climb; None if none is left.

        Raises
        ------
        DeadlineError
            If the time is over.
        """
        number, queue = count(), list[tuple[float, int, _Lift | _Step]]()
        seen = Counter[State]()

        def push(left: float, step: _Lift | _Step) -> None:
            if np.isfinite(left):
                heapq.heappush(queue, (left, next(number), step))

        for begin in self._starts():
            push(*begin)
        while queue:
            self._check()
            self._since += 1
            if self._out >= self._settings.out and self._since >= self._settings.steps:
                self._count_moves()
            known, _, step = heapq.heappop(queue)
            left = self._left_of(step)
            if left > known:
                # lifts were put back or ruled out since
                push(left, step)
            elif isinstance(step, _Lift):
                for after in self._after(step):
                    push(*after)
            elif seen[step.state] < self._settings.ways:
                found = list(islice(self._taken(step), self._settings.ways))
                seen[step.state] += len(found)
                if not found and step.limb >= 0:
                    self._back[self._lift_of(step.state, step.limb)] += self._settings.no_place
                for posture in found:
                    if self._at_goal(posture.state):
                        return SteppedClimb.to(posture, self._wall.robot.limbs)
                    for later in self._next(posture):
                        push(*later)
        return None

    def _left_of(self, step: _Lift | _Step) -> float:
        """Return how many moves are left before a lift, or after a step."""
        if isinstance(step, _Lift):
            out = self._lifts.nodes["out"][step.lift] != 0
            return np.inf if out else float(1.0 + self._left[step.lift] + self._back[step.lift])
        body, members = step.state
        if step.posture is not None and step.limb < 0:
            # it comes from a shift
            far = self._before(np.array([body]), np.array([members]))
            return float(self._settings.shift + far[0])
        to = self._near[body] if step.posture is None else self._open(step.posture, step.limb)
        return float(self._from(body, np.array([members]), to)[0])

    def _starts(self) -> Iterator[tuple[float, _Lift | _Step]]:
        bodies = self._start.bodies
        if self._start.members is not None:
            for body in np.flatnonzero(bodies).tolist():
                step = _Step(None, State(body, self._start.members))
                yield self._left_of(step), step
            return
        on = bodies[self._lifts.bodies] & np.isfinite(self._left)
        for lift in np.flatnonzero(on).tolist():
            yield 1.0 + self._left[lift], _Lift(None, lift)

    def _after(self, step: _Lift) -> Iterator[tuple[float, _Step]]:
        """Yield what a lift leads to: stances at the start, or other placements of the limb."""
        posture, lift, settings = step.posture, step.lift, self._settings
        if not self._stands(lift):
            return
        state = self._lifts.state(lift)
        limb = state.members.index(-1)
        if posture is None:
            left = self._left_of(step)
            self._back[lift] += settings.start
            stances = self._four(state.body, np.array(state.members), limb)
            asked = StanceIndices(np.full(len(stances), state.body), stances)
            best = np.argsort(-self._wall.screening.bounds(asked), kind="stable")
            for row in stances[best[: settings.stances]].tolist():
                yield left, _Step(None, State(state.body, tuple(row)))
            return
        if (*posture.key, limb) in self._refused or self._steps.off(posture, limb) is None:
            self._back[lift] += settings.failure
            return
        self._back[lift] += settings.visit
        stances = self._four(state.body, np.array(posture.state.members), limb)
        every = self._from(state.body, stances, self._open(posture, limb))
        for row, far in zip(stances.tolist(), every.tolist(), strict=True):
            yield far, _Step(posture, State(state.body, tuple(row)), limb)

    def _taken(self, step: _Step) -> Iterator[ClimbPosture]:
        """Yield the postures to which a step leads."""
        if self._programs.stance(step.state) < self._least:
            return
        if step.posture is None:
            found = self._steps.postures(step.state)
        elif step.limb >= 0:
            found = iter(self._steps.placed(step.posture, step.state, step.limb))
        else:
            after = self._steps.shifted(step.posture, step.state.body)
            found = iter([] if after is None else [after])
        for posture in found:
            if posture.step not in self._refused:
                yield posture

    def _next(self, posture: ClimbPosture) -> Iterator[tuple[float, _Lift | _Step]]:
        """Yield lifts and shifts from a posture, and how many moves are left."""
        for limb in range(len(posture.angles)):
            lift = self._lift_of(posture.state, limb)
            if lift >= 0:
                step = _Lift(posture, lift)
                yield self._left_of(step), step
        body, members = posture.state
        limbs = np.arange(len(members))
        for other in self._near[body]:
            if (
                self._straight_on(posture, other)
                and self._ground.reached[list(members), other, limbs].all()
                and all(self._steps.follows(posture, limb, other) for limb in limbs.tolist())
            ):
                shift = _Step(posture, State(other, members))
                yield self._left_of(shift), shift

    def _straight_on(self, posture: ClimbPosture, other: int) -> bool:
        """Return whether a shift goes straight on where the body was shifted before.

        The moves of a route have one shift each.
        """
        before = posture.before
        if before is None or posture.limb >= 0:
            return True
        bodies = before.state.body, posture.state.body, other
        at = [self._wall.bodies[body].position for body in bodies]
        first, second = (end - start for start, end in pairwise(at))
        straight = 1.0 - 1e-6  # cosine [1]: grids are straight but for rounding
        return bool(first @ second > straight * np.linalg.norm(first) * np.linalg.norm(second))

    def _open(self, posture: ClimbPosture, limb: int) -> list[int]:
        """Return the bodies to which all limbs but one follow a shift."""
        others = [each for each in range(len(posture.angles)) if each != limb]
        reached, members = self._ground.reached, posture.state.members
        return [
            body
            for body in self._near[posture.state.body]
            if all(
                reached[members[each], body, each] and self._steps.follows(posture, each, body)
                for each in others
            )
        ]

    def _stands(self, lift: int) -> bool:
        """Return whether three hands hold a lift, at joint angles that bear it."""
        if lift not in self._stood:
            good = len(self._holding(np.array([lift]))) > 0
            if good and not self._checks.borne(self._lifts.state(lift)):
                self._lifts.nodes["out"][lift], good = 1, False
            self._stood[lift] = good
            self._out += not good
        return self._stood[lift]

    def _lift_of(self, state: State, limb: int) -> int:
        body, members = with_lift(state, limb)
        return int(self._lifts.find(np.array([body]), np.array([members]))[1][0])

    def _four(self, body: int, members: Indices, limb: int) -> Indices:
        """Return the stances in which a limb is elsewhere that may hold enough, shape (n, L)."""
        wall, others = self._wall, np.delete(members, limb)
        fits = wall.reach.reached[:, body, limb] & wall.apart[:, others].all(axis=1)
        fits[members[members >= 0]] = False
        choices = np.flatnonzero(fits)
        stances = np.repeat(members[None], len(choices), axis=0)
        stances[:, limb] = choices
        asked = StanceIndices(np.full(len(choices), body), stances)
        return stances[wall.screening.bounds(asked, self._least) >= self._least]

    def _at_goal(self, state: State) -> bool:
        wanted = self._goal.members
        return bool(self._goal.bodies[state.body]) and wanted in (None, state.members)

    def refuse(self, climb: SteppedClimb, failure: Failure) -> None:
        """Leave a part of a move that has no plan out of further climbs."""
        moves, shift = 0, climb.postures[0]
        for before, after in pairwise(climb.postures):
            if after.limb < 0:
                shift = after
                continue
            moves += 1
            if moves == failure.move:
                lets_go = failure.phase in ("unload", "open")
                key = (*before.key, after.limb) if lets_go else after.step
                self._refused.add(shift.step if failure.phase == "shift" else key)
                return
        # the start, or a shift at the end
        self._refused.add(climb.postures[0].step if failure.move == 0 else shift.step)
