"""The plan of least utilisation that is meant: one program, its proof, and its last digits."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from hand_models.base import Array
from planner import programs
from planner.programs import TIE, Outcome, StanceData
from planner.solving import dual_bounds
from planner.solving.active_set import active_set_optimum

__all__ = ["LeastUtilisation", "is_least", "least_utilisation"]

OPTIMAL: Final = 1e-5
"""How far, relatively, the utilisation may be above its proven lower bound."""


def is_least(value: float, bound: float) -> bool:
    """Whether a utilisation, or an effort, is as low as its bound, as far as it counts."""
    return value - bound <= OPTIMAL * max(1.0, value)


class LeastUtilisation(NamedTuple):
    """What came of `programs.unique`.

    Attributes
    ----------
    outcome : Outcome
    bound : float
        The least utilisation is not below; −∞ without a solution.
    loads : tuple of ndarray or None
        y of each hand, exact [N]; None where their last digits are not found.
    """

    outcome: Outcome
    bound: float
    loads: tuple[Array, ...] | None = None

    @property
    def proven(self) -> bool:
        """Whether the utilisation is the least, as far as it counts."""
        return self.outcome.solved and is_least(self.outcome.value, self.bound)


def least_utilisation(data: StanceData) -> LeastUtilisation:
    """Return the plan of least utilisation, of these the one of least tensions.

    What makes it unique exceeds the least utilisation by up to `program.TIE` times its square: far
    beyond the limits it is asked for again with less weight.
    """
    outcome, share = programs.unique(data), 1.0
    if outcome.solved and OPTIMAL * outcome.value < TIE * outcome.value**2:
        smaller = outcome.value**-2
        again = programs.unique(data, smaller)
        if again.solved:
            outcome, share = again, smaller
    if not outcome.solved:
        return LeastUtilisation(outcome, -math.inf)
    exact = active_set_optimum(data, outcome, share)
    if exact is None:
        return LeastUtilisation(outcome, dual_bounds.unique_bound(data, outcome, share))
    # with exact multipliers the bound of `unique_bound` is the optimum itself, but for second terms
    most = share * TIE * exact.utilisation**2
    return LeastUtilisation(outcome, exact.utilisation + exact.second - most, exact.loads)
