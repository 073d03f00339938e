"""Plans of stances with floating or compliant wrists: the wrists' poses and all hands' loads."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hand_models.compliance import WRIST_COLUMNS
from planner import deadline, programs
from planner.deadline import Budget, late
from planner.explanation import idle_preloads
from planner.floating import (
    LargestFactor,
    WristSolution,
    best_within,
    least_use,
    most_load,
    next_plan,
    with_room,
)
from planner.prepare import HandSets, PreparedStance
from planner.programs import (
    CAP_SLACK,
    StanceData,
    least_bound,
    tension_trade,
    unproven_sentences,
)
from planner.result import LoadFactor, WristPlan
from planner.solving.objective import MAX_MARGIN, CappedObjective
from planner.solving.solution import Solution

__all__ = ["FloatingSolution", "floating_solution", "next_solution", "wrench_is_given"]


@dataclass(frozen=True, eq=False, kw_only=True)
class FloatingSolution(Solution):
    """Loads of the hands of a stance with floating or compliant wrists, and the wrists' poses.

    Attributes
    ----------
    search : WristSolution
        Result of the search that gave the loads.
    usual : WristSolution
        Result of the search for the least utilisation.
    factor : LargestFactor or None
        The largest load factor that the search met.
    """

    search: WristSolution
    usual: WristSolution
    factor: LargestFactor | None

    @property
    def proven(self) -> bool:
        """False if the search for the wrists' poses ended without proof of an optimum."""
        return self.search.found != "unproven"

    def best_in(
        self, objective: CappedObjective, prepared: PreparedStance, budget: Budget
    ) -> FloatingSolution:
        """Return the best solution for an objective within the cap, with new poses of the wrists.

        Without loads, or if they are beyond the cap, the solution itself is returned. If the
        deadline passes before the search finds a plan, the solution is returned, marked as
        unfinished.
        """
        used = self.search.measure.utilisation
        if not self.loads or used > self.cap + CAP_SLACK:
            return self
        cap = with_room(self.cap, used)
        search = best_within(prepared.hands, self.search, cap, objective.goal, budget)
        found = replace(self, cap=cap).late(*late(objective.late))
        if not search.outcome.solved:
            return found if deadline.expired() else found._at(search, prepared.hands)
        found = found._at(search, prepared.hands)
        if not found.proven:
            return replace(found, objective=objective, best=search.outcome)
        value = objective.value(search.sets.data, search.point.loads)
        bound = objective.bound(search.sets.data, search.outcome, cap)
        further = unproven_sentences(objective.words, value, bound)
        return replace(
            found,
            objective=objective,
            best=search.outcome,
            most=np.inf,
            faults=_unproven_use(self.usual, self.usual.outcome.value) + further,
        )

    def _at(self, search: WristSolution, hands: HandSets) -> FloatingSolution:
        """Return the same with the loads of a search, of which nothing is proven without proof."""
        poses = tuple(
            [
                None
                if wrist is None
                else WristPlan(y[-len(WRIST_COLUMNS) :], search.rounds, search.error)
                for wrist, y in zip(hands.wrists, search.point.loads, strict=True)
            ]
        )
        found = replace(
            self, sets=search.sets, loads=search.point.loads, poses=poses, search=search
        )
        return found if found.proven else replace(found, faults=(), most=np.inf)

    def load_factor(
        self, prepared: PreparedStance, budget: Budget
    ) -> tuple[LoadFactor, FloatingSolution]:
        """Search for the load factor; return it with the best solution found on the way.

        The factor is marked as a lower bound if no plan was found beyond it.
        """
        most, search = most_load(prepared.hands, self.usual, self.factor, budget)
        found = self
        if search is not self.usual and self.objective is MAX_MARGIN:
            found = _of_search(prepared, search, self.factor)
        if most is None:
            return LoadFactor(unfinished=deadline.expired()), found
        late = not most.sure and deadline.expired()
        return LoadFactor(most.factor, least=not most.sure, unfinished=late), found

    def no_answer(self, prepared: PreparedStance) -> str:
        """Return a sentence about the missing equilibrium of the wrists, with a likely reason."""
        reason = "no equilibrium found for the wrists"
        if wrench_is_given(prepared):
            reason += " with their given wrenches, which does not prove that there is none"
        idle = idle_preloads(prepared)
        return f"{reason}; {idle[0]}" if idle else reason


def floating_solution(
    prepared: PreparedStance, budget: Budget, near: Solution | None = None
) -> FloatingSolution:
    """Search for the wrists' poses with the least utilisation, and return the loads there.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.
    budget : Budget
        Number of programs that the search may solve.
    near : Solution, optional
        Solution of a similar stance, from which the search starts.

    Returns
    -------
    FloatingSolution
        Solution; it has no loads if no equilibrium was found.
    """
    begin = near.usual if isinstance(near, FloatingSolution) and near.usual.exact else None
    search, factor = least_use(prepared.hands, budget, begin)
    return _of_search(prepared, search, factor)


def next_solution(
    prepared: PreparedStance, budget: Budget, near: FloatingSolution
) -> FloatingSolution | None:
    """Return a solution within the cap close to that for another body wrench; None without one.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.
    budget : Budget
        Number of programs that may be solved.
    near : FloatingSolution
        Solution of the same hands for another body wrench.
    """
    hands = prepared.hands
    if hands.together is None or not near.usual.exact:
        return None
    search = next_plan(hands, near.usual, budget)
    cap = prepared.question.limits.utilisation
    if search is None or search.measure.utilisation > cap + CAP_SLACK:
        return None
    return _of_search(prepared, search, None)


def _of_search(
    prepared: PreparedStance, search: WristSolution, factor: LargestFactor | None
) -> FloatingSolution:
    """Return what a search for the least utilisation has found, as a solution."""
    cap = prepared.question.limits.utilisation
    found = FloatingSolution(
        sets=search.sets,
        loads=(),
        least=search.outcome,
        objective=MAX_MARGIN,
        best=search.outcome,
        cap=cap,
        unfinished=late("wrists"),
        search=search,
        usual=search,
        factor=factor,
    )
    if not search.exact:
        return replace(found, sets=prepared.hands.sets(search.point))
    used = search.measure.utilisation
    found = replace(found, most=tension_trade(used, cap).most, faults=_unproven_use(search, used))
    return found._at(_less_tense_beside(prepared, search), prepared.hands)


def _unproven_use(search: WristSolution, used: float) -> tuple[str, ...]:
    """Return why a search's multipliers do not prove its utilisation the least of its sets."""
    bound = least_bound(search.sets.data, search.outcome)
    return unproven_sentences("utilisation", used, bound)


def _less_tense_beside(prepared: PreparedStance, search: WristSolution) -> WristSolution:
    """Return a search's plan with less tension in its fixed hands, floating wrists as they are."""
    wrists, data = prepared.hands.wrists, search.sets.data
    if None not in wrists or deadline.expired():
        return search
    loads = search.point.loads
    held = [
        hand if wrist is None else hand.held(y)
        for hand, wrist, y in zip(data.hands, wrists, loads, strict=True)
    ]
    cap = prepared.question.limits.utilisation
    trade = tension_trade(search.measure.utilisation, cap)
    found = programs.less_tension(StanceData.of(tuple(held), data.wrench), trade)
    if not found.solved:
        return search
    pairs = zip(wrists, loads, found.loads, strict=True)
    loads = tuple([new if wrist is None else old for wrist, old, new in pairs])
    return replace(search, point=replace(search.point, loads=loads))


def wrench_is_given(prepared: PreparedStance) -> bool:
    """Return whether the wrench of a floating or compliant hand is given in the question.

    A proof of infeasibility is then not valid for other poses of the wrists.
    """
    return any(
        hand.wrist != "fixed" and hand.wrench is not None for hand in prepared.question.stance.hands
    )
