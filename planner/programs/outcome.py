"""How a program ended: the solver's word for it, loads and multipliers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

from hand_models.base import Array
from planner.programs.conic import OUT_OF_TIME

__all__ = ["LATE", "Outcome", "Reached"]


@dataclass(frozen=True, eq=False)
class Outcome:
    """How a program ended.

    Attributes
    ----------
    solved : bool
        Whether the solver says so; the plan is checked apart from it.
    status : str
        CVXPY's word, or `planner.programs.conic.OUT_OF_TIME`.
    iterations : int
    value : float
        Objective, NaN if not solved.
    loads : tuple of ndarray
        y of each hand [N], of a floating one [m, rad]; empty if not solved.
    limit_duals, hard_duals : tuple of ndarray
        Multipliers of each hand's rows; where there is no solution, the proof of that. Empty if
        the solver has neither.
    balance_dual : ndarray or None
        Multipliers of the balance, shape (nb,).
    """

    solved: bool
    status: str
    iterations: int
    value: float
    loads: tuple[Array, ...] = ()
    limit_duals: tuple[Array, ...] = ()
    hard_duals: tuple[Array, ...] = ()
    balance_dual: Array | None = None


LATE: Final = Outcome(False, OUT_OF_TIME, 0, math.nan)
"""Of a program that there was no time for."""


class Reached(NamedTuple):
    """How `Reach` ended, and the t it came to, shape (k,), NaN if it was not solved."""

    outcome: Outcome
    t: Array
