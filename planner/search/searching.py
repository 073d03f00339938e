"""The search for the climb with the largest least load factor: at any time one, and a bound."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np

from hand_models.base import Array, InvalidInputError, LimitError, go_on
from planner import deadline
from planner.deadline import DeadlineError
from planner.screening import ScreeningTable, StanceIndices, solve_stance
from planner.search.deciding import Decision
from planner.search.found import Found, Proof
from planner.search.learning import learnt, some_lifts
from planner.search.lifts import Ground, Lifts
from planner.search.programs import Programs
from planner.search.settings import SEARCH_SETTINGS
from planner.search.wall import Ends, State, Wall
from planner.search.ways import Arc, Moves, Passes, Refuses

__all__ = ["SearchMemory", "SearchProgress", "search"]

SearchProgress = Callable[[str, float, float, int], None]
"""Gets what is done, the best climb's least load factor, the bound, and the programs so far."""


@dataclass(eq=False)
class SearchMemory:
    """Memory of what searches of one wall from one start to one goal have learnt.

    Attributes
    ----------
    table : ScreeningTable or None
        With learnt directions; None before the first search.
    programs : Programs or None
        All that were solved.
    bound : float
        No climb has a larger least load factor.
    proof : Proof or None
        What it rests on.
    """

    table: ScreeningTable | None = None
    programs: Programs | None = None
    bound: float = float("inf")
    proof: Proof | None = None


def search(
    wall: Wall,
    start: Ends,
    goal: Ends,
    *,
    within: float = 0.0,
    at_least: float | None = None,
    floor: float = 0.0,
    seconds: float | None = None,
    blocked: Collection[Arc] = (),
    passes: Passes | None = None,
    refuses: Refuses | None = None,
    memory: SearchMemory | None = None,
    progress: SearchProgress | None = None,
) -> Found:
    """Find the climb with the largest least load factor, and bound every other.

    Parameters
    ----------
    wall : Wall
    start, goal : Ends
    within : float
        Part of its least load factor by which another climb may be better when the search ends.
    at_least : float, optional
        Least load factor that is enough, and without which none counts; by default the best climb
        is looked for.
    floor : float
        Load factor below which no state is passed.
    seconds : float, optional
        Time after which the search ends with what it has, as it does at a deadline of
        `planner.deadline` [s].
    blocked : collection of pairs of State
        Moves that may not be made, which the climb goes round: a state and the next, or the one
        after it. A state twice may not be passed. The bound is that of the statics all the same.
    passes : callable, optional
        Returns whether a state may be followed by another; twice the same, whether it may be passed
        at all. It is asked of climbs that the statics leave; its word does not count for the bound.
    refuses : callable, optional
        Returns what cannot be done of a climb, as ``blocked`` has it, from its states; nothing if
        the climb is to be kept. It is asked of each climb, which the search then goes round.
    memory : SearchMemory, optional
        Of searches of the same wall with the same ends; it learns from this one.
    progress : callable, optional
        Called with a phase, the least load factor so far, the bound and the programs solved.

    Raises
    ------
    InvalidInputError
        If ``within``, ``at_least``, ``floor`` or ``seconds`` is out of range.
    LimitError
        If too many lifts would have to be kept before any climb is found.
    """
    numbers = {"within": within, "at_least": at_least, "floor": floor, "seconds": seconds}
    for name, value in numbers.items():
        if value is not None and not 0.0 <= value < np.inf:
            raise InvalidInputError(f"must be at least 0, got {value:g}", field=name)
    lifts = {first for first, second in blocked if first == second and -1 in first.members}
    moves = Moves(set(blocked), passes, refuses, lifts)
    known = SearchMemory() if memory is None else memory
    search_of = _Search(wall, (start, goal), moves, known, progress, seconds, floor)
    return search_of.found(within, at_least)


class _TimeOverError(Exception):
    """The time of the search itself is over."""


class _Search:
    """State of a search: what was found and proven so far."""

    def __init__(
        self,
        wall: Wall,
        ends: tuple[Ends, Ends],
        moves: Moves,
        memory: SearchMemory,
        progress: SearchProgress | None,
        seconds: float | None,
        floor: float,
    ) -> None:
        self._floor = floor
        self._started, self._said, self._phase = time.perf_counter(), -np.inf, ""
        self._end = np.inf if seconds is None else self._started + seconds
        self._ground, self._moves, self._progress = Ground(wall, ends), moves, progress
        self._memory, self._table = memory, memory.table or wall.screening
        self._programs = memory.programs or Programs(wall.screening)
        self._states: tuple[State, ...] = ()
        self._least, self._bound, self._proof = -np.inf, memory.bound, memory.proof
        self._lifts = self._relearnt = 0
        bodies, limbs = wall.reach.entry.shape[1:]
        self._doubt, self._failures = np.inf, 0
        self._levels = np.full((bodies, limbs), -np.inf)
        self._ceiling = self._tried = np.inf

    def found(self, within: float, at_least: float | None) -> Found:
        """Run the search to its end, or till time is over."""
        try:
            return self._answer(self._finished(within, at_least))
        except (DeadlineError, _TimeOverError):
            return self._answer(False)

    def _finished(self, within: float, at_least: float | None) -> bool:
        """Search until the climb is as good as asked for, or proven to be the best."""
        settings = SEARCH_SETTINGS
        self._learn()
        while True:
            best = max(self._least, 0.0)
            enough = at_least is not None and self._least >= at_least * (1.0 - settings.exact)
            if enough or self._ceiling <= best * (1.0 + within) * (1.0 + 2.0 * settings.exact):
                return True
            if at_least is not None:
                decided = self._enough(at_least)
            elif self._states:
                try:
                    decided = self._better()
                except LimitError:
                    # too many lifts for a lower bound: what is known stands
                    return False
            else:
                decided = self._decide(self._lower())
            self._note(decided, at_least)

    def _note(self, decided: Decision, at_least: float | None) -> None:
        """Take over what a decision has found or proven."""
        multiple = decided.multiple if decided.multiple > 0.0 else -np.inf
        if decided.route:
            self._states = decided.route
            self._least = min(self._programs.stance(state) for state in decided.route)
        elif decided.exhausted and decided.partial:
            self._doubt = multiple
        elif decided.exhausted:
            # below the least load factor that is asked for, nothing counts
            lowest = decided.multiple == self._floor and not self._states
            self._ceiling = -np.inf if lowest or multiple == at_least else multiple
            if not decided.hindered:
                self._prove(decided, multiple)
        if self._states and (decided.route or (decided.exhausted and not decided.partial)):
            self._failures = 0

    def _lower(self) -> float:
        """Return the least load factor that is tried before any climb is known."""
        settings = SEARCH_SETTINGS
        below = self._tried < self._ceiling
        multiple = min(settings.step * self._ceiling, self._tried)
        multiple *= settings.first_step if below else 1.0
        return multiple if multiple > max(settings.lowest, self._floor) else self._floor

    def _enough(self, at_least: float) -> Decision:
        """Look for a climb with a given least load factor, from larger ones down to it."""
        multiple = self._lower()
        if multiple > at_least:
            return self._decide(multiple)
        self._failures += 1
        if np.isfinite(self._levels).any() and self._failures == 1:
            return self._run(at_least, self._levels, SEARCH_SETTINGS.better_steps)
        return self._run(at_least, None, np.inf)

    def _better(self) -> Decision:
        """Look for a better climb, or for a lower bound, whatever is likely to be cheap."""
        ratio, settings = self._ceiling / self._least, SEARCH_SETTINGS
        if ratio < 1.0 + settings.ratchet:
            return self._run(self._least * (1.0 + settings.exact), None, np.inf)
        self._failures += 1
        if not np.isfinite(self._levels).any() or self._failures > 2:
            self._failures = 0
            return self._run(self._least * ratio**0.5, None, np.inf)
        if self._failures == 1 and not self._least < self._doubt < self._ceiling:
            multiple = self._least * ratio ** (1.0 / 3.0)
            return self._run(multiple, self._levels, settings.better_steps)
        multiple = min(self._least * ratio ** (2.0 / 3.0), self._ceiling)
        if self._least < self._doubt < self._ceiling:
            multiple, self._doubt = self._doubt, np.inf
        return self._run(multiple, None, np.inf, whole=False)

    def _check(self) -> None:
        """Break the search off when time is over, and say now and then how far it is."""
        deadline.check("the best climb was found")
        go_on()
        now = time.perf_counter()
        if now >= self._end:
            raise _TimeOverError
        if self._progress is not None and now >= self._said + SEARCH_SETTINGS.silence:
            self._said = now
            self._progress(self._phase, self._least, self._bound, self._programs.count)

    def _report(self, phase: str) -> None:
        self._phase, self._said = phase, -np.inf
        self._check()

    def _learn(self) -> None:
        """Learn directions from lifts of the whole wall, then from those that these leave."""
        settings, memory = SEARCH_SETTINGS, self._memory
        self._report("directions")
        if memory.table is not None:
            self._ceiling = self._tried = memory.bound
            return
        lifts = some_lifts(self._ground, settings.samples)
        half = settings.directions // 2
        self._table = learnt(self._table, self._programs, lifts, half, self._check)
        bounds = self._table.bounds(lifts)
        self._bound = self._ceiling = float(np.max(self._ground.tops(self._table), initial=0.0))
        self._prove_top()
        self._tried = float(np.max(bounds, initial=0.0))
        if len(bounds):
            some = lifts.of(np.arange(min(len(bounds), settings.examples)))
            self._table = self._table.reordered(some, float(np.quantile(bounds, 0.99)))

    def _decide(self, multiple: float) -> Decision:
        """Decide whether a climb has a least load factor, or leave it open when time is over.

        Before the first climb is known, it is also left open after some steps, for a lower one.
        """
        self._tried = multiple
        few = np.isfinite(self._levels).any() and multiple > self._floor
        steps = SEARCH_SETTINGS.first_steps if multiple > self._floor else np.inf
        return self._run(multiple, self._levels if few else None, steps)

    def _run(
        self, multiple: float, levels: Array | None, steps: float, whole: bool = True
    ) -> Decision:
        """Look for a climb among all lifts, or among those that pass at higher levels.

        Without ``whole``, it is left open whether there is one if stances fail on its way.
        """
        self._report(f"lifts at {multiple:.3g}")
        stances = self._stance_table(multiple)
        lifts = Lifts.passing(self._ground, self._table, multiple, levels, stances, self._check)
        self._lifts = len(lifts)
        many = lifts.counts > SEARCH_SETTINGS.many
        self._levels[many] = np.maximum(self._levels[many], multiple)
        # of all lifts, stances are solved where both ends meet, and all only if some fail there
        attempts = 0.0 if levels is None else float(SEARCH_SETTINGS.attempts)
        self._report(f"climbs at {multiple:.3g}")
        decision = Decision(lifts, self._programs, self._moves, attempts)
        while not decision.ended and steps > 0:
            self._check()
            decision.advance()
            steps -= 1
            if decision.stuck and not whole:
                break
            if decision.stuck:
                lifts.nodes[:] = 0
                attempts = np.inf if levels is None else attempts
                barred = decision.barred
                decision = Decision(lifts, self._programs, self._moves, attempts, barred)
        decision.partial = levels is not None
        self._relearn(multiple)
        return decision

    def _stance_table(self, multiple: float) -> ScreeningTable:
        """Return the directions that rule out most stances of four hands."""
        known, settings = self._programs.known, SEARCH_SETTINGS
        low = (known.factors < multiple) & known.directions.any(axis=1)
        some = np.flatnonzero((known.members >= 0).all(axis=1) & low)[-settings.examples :]
        table = self._table
        if len(some):
            offered = known.directions[some[:: 1 + len(some) // settings.offered]]
            stances = StanceIndices(known.bodies[some], known.members[some])
            table = table.extended(offered).reordered(stances, multiple)
        return table.first(settings.stance_directions)

    def _relearn(self, multiple: float) -> None:
        """Add those directions of lifts just solved that rule out most of them."""
        settings, known = SEARCH_SETTINGS, self._programs.known
        low = np.flatnonzero((known.factors < multiple) & known.directions.any(axis=1))
        low = low[low >= self._relearnt]
        self._relearnt = len(known.factors)
        room = settings.directions - len(self._table.directions)
        if room <= 0 or len(low) < settings.few:
            return
        rng = np.random.default_rng(0)
        some = rng.choice(low, min(len(low), settings.examples), replace=False)
        stances = StanceIndices(known.bodies[some], known.members[some])
        of = known.directions[some[: settings.offered]]
        offered = self._table.extended(of).latest(len(of)).reordered(stances, multiple)
        self._table = self._table.extended(offered.directions[: min(room, settings.taken)])

    def _prove(self, decided: Decision, multiple: float) -> None:
        known = self._programs.known.below(decided.multiple)
        bounding = known.directions.any(axis=1)
        self._bound = multiple
        self._proof = Proof(
            multiple=decided.multiple,
            directions=decided.directions,
            members=known.members[bounding],
            own=known.directions[bounding],
            backward=decided.exhausted == 2,
        )

    def _prove_top(self) -> None:
        """Take the directions learnt as the proof of the first bound, which rule out all states."""
        if 0.0 < self._bound < SEARCH_SETTINGS.unbounded:
            limbs = self._ground.reached.shape[2]
            self._proof = Proof(
                multiple=self._bound,
                directions=self._table.directions,
                members=np.zeros((0, limbs), dtype=np.intp),
                own=np.zeros((0, 6)),
                backward=False,
            )

    def _answer(self, finished: bool) -> Found:
        """Return what was found, each state's program solved again by another solver."""
        if np.isfinite(self._ceiling):
            memory = self._memory
            memory.table, memory.programs = self._table, self._programs
            memory.bound, memory.proof = self._bound, self._proof
        hands, factors = self._table.hands, list[float]()
        for state in self._states:
            members = np.array(state.members)
            (wrench,) = self._table.needed(StanceIndices(np.array([state.body]), members[None]))
            factors.append(solve_stance(hands, members[members >= 0], wrench).factor)
        return Found(
            states=self._states,
            factors=np.array(factors),
            least=min(factors, default=-np.inf),
            bound=self._bound,
            proof=self._proof,
            programs=self._programs.count,
            lifts=self._lifts,
            seconds=time.perf_counter() - self._started,
            finished=finished,
        )
