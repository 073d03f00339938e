"""What solving a prepared stance comes to, and what is read of its loads."""

from __future__ import annotations

import math
from typing import NamedTuple

from hand_models.base import Array
from planner.deadline import Unfinished
from planner.floating import LargestFactor, WristSolution
from planner.prepare import Sets
from planner.programs import Outcome
from planner.result import HandPlan, PlanArrays

__all__ = ["Reading", "Solution"]


class Reading(NamedTuple):
    """What loads do, recovered and checked.

    Attributes
    ----------
    loads : tuple of ndarray
        y of each hand.
    arrays : PlanArrays
        The plan's numbers.
    hands : tuple of HandPlan
        The same hand by hand, where a wrist floats; none yet where none does.
    used : ndarray, shape (sum of nl,)
        Utilisation of every limit row, hand by hand.
    effort : float
    utilisation : float
        The largest of the hands.
    whole : float
        The largest of these, and of the joints of limbs without a hand.
    wrong : tuple of str
        What the check says is wrong with it.
    """

    loads: tuple[Array, ...]
    arrays: PlanArrays
    hands: tuple[HandPlan, ...]
    used: Array
    effort: float
    utilisation: float
    whole: float
    wrong: tuple[str, ...]


class Solution(NamedTuple):
    """What solving has come to.

    Attributes
    ----------
    sets : Sets
        Of the hands, about the plan.
    outcome : Outcome
        Of the program of least utilisation.
    cap : float
        Under which the effort was made least; else the one asked for.
    reading : Reading or None
        Of the plan's loads; None without any.
    bound : float or None
        Of the least utilisation, from below, where it is known already.
    search : WristSolution or None
        Where the plan's floating wrists are.
    least_use : WristSolution or None
        Where they are at the least utilisation.
    factor : LargestFactor or None
        The largest load factor that the search met.
    effort : Outcome or None
        Of the program of least effort.
    unfinished : tuple of str
        What the deadline came before.
    """

    sets: Sets
    outcome: Outcome
    cap: float
    reading: Reading | None = None
    bound: float | None = None
    search: WristSolution | None = None
    least_use: WristSolution | None = None
    factor: LargestFactor | None = None
    effort: Outcome | None = None
    unfinished: tuple[Unfinished, ...] = ()

    @property
    def wrong(self) -> tuple[str, ...]:
        """What is wrong with the plan."""
        if self.effort is not None and not self.effort.solved:
            return (f"least effort: {self.effort.status}",)
        return () if self.reading is None else self.reading.wrong

    @property
    def passes(self) -> bool:
        """Whether there is a plan that passes its checks."""
        return self.outcome.solved and not self.wrong

    @property
    def utilisation(self) -> float:
        """The largest of the hands; infinite without a plan."""
        return math.inf if self.reading is None else self.reading.utilisation

    @property
    def unproven(self) -> bool:
        """Whether a search for floating wrists ended without proof."""
        return self.search is not None and self.search.found == "unproven"

    def late(self, *names: Unfinished) -> Solution:
        """Return the same with something more that is not finished."""
        return self._replace(unfinished=self.unfinished + names)
