"""The plan of least utilisation that is meant: one program, its proof, and its last digits."""

from __future__ import annotations

from typing import Final, NamedTuple

from planner import dual_bounds, program
from planner.polish import polished
from planner.program import Outcome
from planner.stance_data import StanceData

__all__ = ["OPTIMAL", "LeastUtilisation", "least_utilisation"]

OPTIMAL: Final = 1e-5
"""How far, relatively, the utilisation may be above its proven lower bound."""


class LeastUtilisation(NamedTuple):
    """What came of `program.unique`.

    Attributes
    ----------
    outcome : Outcome
    bound : float
        The least utilisation is not below; −∞ without a solution.
    exact : Outcome or None
        With the last digits of the loads; None where they are not found.
    """

    outcome: Outcome
    bound: float
    exact: Outcome | None

    @property
    def proven(self) -> bool:
        """Whether the utilisation is the least, as far as it counts."""
        return self.outcome.solved and _is_least(self.outcome.value, self.bound)


def least_utilisation(data: StanceData) -> LeastUtilisation:
    """Return the plan of least utilisation, of these the one of least tensions.

    What makes it unique exceeds the least utilisation by up to `program.TIE` times its square: far
    beyond the limits it is asked for again with less weight.
    """
    outcome, share = program.unique(data), 1.0
    if not outcome.solved:
        return LeastUtilisation(outcome, -float("inf"), None)
    bound = dual_bounds.unique_bound(data, outcome)
    if outcome.value > 1.0 and not _is_least(outcome.value, bound):
        smaller = outcome.value**-2
        again = program.unique(data, smaller)
        if again.solved:
            outcome, share = again, smaller
            bound = dual_bounds.unique_bound(data, outcome, share)
    if not _is_least(outcome.value, bound):
        return LeastUtilisation(outcome, bound, None)
    return LeastUtilisation(outcome, bound, polished(data, outcome, share))


def _is_least(utilisation: float, bound: float) -> bool:
    return utilisation - bound <= OPTIMAL * max(1.0, utilisation)
