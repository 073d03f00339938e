"""Ways between lifts: four hands on the rock, and shifts of the body."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Indices
from planner.search.lifts import Lifts
from planner.search.programs import Programs
from planner.search.settings import SEARCH_SETTINGS
from planner.search.wall import State

__all__ = ["Arc", "Moves", "Passes", "Refuses", "Way", "Ways"]

Arc = tuple[State, State]
"""A move: a state and a later one; or twice a state that is passed."""

Passes = Callable[[State, State], bool]
"""Returns whether a state may be followed by another; twice the same, whether it may be passed."""

Refuses = Callable[[Sequence[State]], Iterable[Arc]]
"""Returns what cannot be done of a climb, from its states; nothing if it is to be kept."""

Bodies = NDArray[np.bool_]


class Moves(NamedTuple):
    """Knowledge of moves besides the statics.

    Attributes
    ----------
    blocked : set of pairs of State
        Those that may not be made; a state twice may not be passed.
    passes : callable or None
        Returns whether one may be made.
    refuses : callable or None
        Returns what cannot be done of a climb.
    refused : set of State
        States with three hands that may not be passed, as far as is known.
    """

    blocked: set[Arc]
    passes: Passes | None
    refuses: Refuses | None
    refused: set[State]


class Way(NamedTuple):
    """Connection of two lifts, or of a lift and an end, in the order of the climb.

    Attributes
    ----------
    before, after : int
        Lifts; −1 for the start, −2 for the goal.
    place : int
        Placement with which the lift that is not an end has all hands on the rock.
    """

    before: int
    after: int
    place: int


class Ways:
    """Stances of four hands between lifts, and which of them hold enough.

    Parameters
    ----------
    lifts : Lifts
    programs : Programs
    moves : Moves
    barred : set of Way
        Ways that blocked moves leave out.

    Attributes
    ----------
    hindered : bool
        Whether something was left out that holds enough.
    refused : set of State
        That of the moves.
    """

    def __init__(
        self,
        lifts: Lifts,
        programs: Programs,
        moves: Moves,
        barred: set[Way],
    ) -> None:
        self._lifts, self._programs = lifts, programs
        self._moves, self.refused = moves, moves.refused
        self._least = lifts.multiple * (1.0 - 0.1 * SEARCH_SETTINGS.exact)
        self.stopped = {first for first, second in moves.blocked if first == second}
        self.barred, self.hindered = barred, len(barred) > 0
        self._bad, self._good = set[State](), set[State]()
        self._between = dict[Way, list[State]]()

    def _members(self, way: Way) -> tuple[int, ...]:
        lift = way.before if way.before >= 0 else way.after
        if (
            way.before >= 0
            and way.after >= 0
            and self._lifts.triples[way.before] != (self._lifts.triples[way.after])
        ):
            pair = self._lifts.members[self._lifts.triples[[way.before, way.after]]]
            return tuple(pair.max(axis=0).tolist())
        row = self._lifts.members[self._lifts.triples[lift]]
        return tuple(np.where(row < 0, way.place, row).tolist())

    def _span(self, way: Way) -> tuple[Bodies, Bodies]:
        """Return where the body may be before and after the shift between two lifts, (B,) each."""
        ends, count = self._lifts.ground.ends, len(self._lifts.ground.wall.bodies)
        before, after = (
            ends[-1 - lift].bodies if lift < 0 else np.arange(count) == self._lifts.bodies[lift]
            for lift in (way.before, way.after)
        )
        return before, after

    def _shift(self, members: tuple[int, ...], starts: Bodies, goals: Bodies) -> list[int]:
        """Return the bodies of the shortest shift on four hands, past stances that fail."""
        ground = self._lifts.ground
        allowed = np.ones(len(ground.wall.bodies), dtype=bool)
        for limb, p in enumerate(members):
            allowed &= ground.reached[p, :, limb]
        for body in np.flatnonzero(allowed).tolist():
            state = State(body, members)
            self.hindered |= state in self.stopped
            allowed[body] = state not in self._bad and state not in self.stopped
        back = dict[int, int]()
        front = np.flatnonzero(starts & allowed).tolist()
        seen = starts & allowed
        for body in front:
            back[body] = -1
        while front:
            ahead = list[int]()
            for body in front:
                if goals[body]:
                    path = [body]
                    while back[path[-1]] >= 0:
                        path.append(back[path[-1]])
                    return path[::-1]
                for other in np.flatnonzero(ground.beside[body] & allowed & ~seen).tolist():
                    if not self.passes(State(body, members), State(other, members)):
                        self.hindered = True
                        continue
                    seen[other] = True
                    back[other] = body
                    ahead.append(other)
            front = ahead
        return []

    def states(self, way: Way) -> list[State]:
        """Return the four-hand states between two lifts, all of which hold enough; [] if none."""
        if way not in self._between:
            self._between[way] = self._held(self._members(way), *self._span(way))
        return self._between[way]

    def _held(self, members: tuple[int, ...], starts: Bodies, goals: Bodies) -> list[State]:
        """Return the states of the shortest shift that hold enough; [] if none do."""
        while True:
            states = [State(body, members) for body in self._shift(members, starts, goals)]
            low = [each for each in states if self._programs.stance(each) < self._least]
            unfit = [] if low else [each for each in states if not self.passes(each, each)]
            if not low and not unfit:
                return states
            self.stopped.update(unfit)
            self._bad.update(low)

    def passes(self, before: State, after: State) -> bool:
        """Return whether a move may be made, or a state twice be passed."""
        barred = before in self.stopped or after in self.stopped
        if barred or (before, after) in self._moves.blocked:
            return False
        return self._moves.passes is None or self._moves.passes(before, after)

    def fit(self, way: Way) -> list[State]:
        """Return the four-hand states between two lifts by what is known of moves now."""
        between = self.states(way)
        arcs = [*zip(between, between, strict=True), *pairwise(between)]
        if not all(self.passes(*each) for each in arcs):
            self.hindered = True
            del self._between[way]
            between = self.states(way)
        # the body goes straight from the first to the last of them
        if between and (between[0], between[-1]) in self._moves.blocked:
            return []
        return between

    def refuse(self, states: Sequence[State]) -> bool:
        """Return whether something of a climb cannot be done, which is left out from now on."""
        arcs = () if self._moves.refuses is None else self._moves.refuses(states)
        found = set(arcs)
        self._moves.blocked.update(found)
        twice = {first for first, second in found if first == second}
        self.stopped |= twice
        self.refused.update(state for state in twice if -1 in state.members)
        self.hindered |= len(found) > 0
        return len(found) > 0

    def standing(self) -> tuple[State, ...]:
        """Return a climb that only shifts the body, if there is one."""
        ground, table = self._lifts.ground, self._lifts.table
        starts, goals = (np.asarray(end.bodies, dtype=bool) for end in ground.ends)
        both = np.asarray(ground.reached[:, goals].any(axis=1))
        left = SEARCH_SETTINGS.standing
        for body in np.flatnonzero(starts).tolist():
            own = list[Indices]()
            for limb, column in enumerate(both.T):
                fits = ground.of(body, limb)[column[ground.of(body, limb)]]
                for fixed in ground.fixed[:, limb]:
                    fits = fits[(fixed < 0) | (fits == fixed)]
                own.append(fits)
            rows = table.passing(body, own, self._lifts.multiple)
            for i, j in combinations(range(len(own)), 2):
                rows = rows[ground.wall.apart[rows[:, i], rows[:, j]]]
            only = np.arange(len(starts)) == body
            for members in map(tuple, rows.tolist()):
                while left > 0 and (states := self._held(members, only, goals)):
                    if not self.refuse(states):
                        return tuple(states)
                    left -= 1
        return ()

    def state(self, lift: int) -> State:
        """Return the state of a lift."""
        return self._lifts.state(lift)

    def _ends_of(self, way: Way) -> list[State]:
        """Return the first and the last stance of a shift between two lifts."""
        members, bodies = self._members(way), self._lifts.bodies
        both = {int(bodies[lift]) for lift in (way.before, way.after) if lift >= 0}
        return [State(body, members) for body in both]

    def fails(self, way: Way) -> bool:
        """Return whether a way is left out, or a stance at its ends holds too little."""
        return way in self.barred or not self._bad.isdisjoint(self._ends_of(way))

    def solve(self, ways: list[Way]) -> None:
        """Solve the stances at the ends of shifts together, and take over what their bounds say."""
        left = {state for way in ways for state in self._ends_of(way)}
        while left := {each for each in left if each not in self._bad and each not in self._good}:
            # one body of each first: its direction may rule out the others
            some = list({each.members: each for each in sorted(left)}.values())
            members = np.array([each.members for each in some])
            factors = self._programs.stances(some)
            low = factors < self._least
            self._good.update(each for each, fails in zip(some, low, strict=True) if not fails)
            self._bad.update(each for each, fails in zip(some, low, strict=True) if fails)
            self._bad.update(
                self._lifts.ruled_out(members[low], *self._programs.bounding(some, low))
            )
