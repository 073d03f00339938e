"""Learn the directions that bound load factors best, from the stances that look best."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hand_models.base import Array, go_on
from planner import deadline
from planner.screening.settings import SCREENING_SETTINGS
from planner.screening.stance_programs import solve_stance
from planner.screening.table import ScreeningTable, StanceIndices

__all__ = ["Learnt", "learn"]


class Learnt(NamedTuple):
    """Bounds of stances after directions were learnt from some of them.

    Attributes
    ----------
    table : ScreeningTable
        Table with the directions learnt.
    bounds : ndarray, shape (N,)
        Upper bounds of the load factors; −∞ where there is none.
    factors : ndarray, shape (N,)
        Load factors of the stances that were solved, by their linear programs; −∞ where no multiple
        of the body wrench is held, NaN for stances that were not solved.
    solved : int
        Number of stances whose programs were solved.
    """

    table: ScreeningTable
    bounds: Array
    factors: Array
    solved: int

    @property
    def best(self) -> float:
        """Largest load factor that was solved; −∞ without one."""
        return float(np.nanmax(self.factors, initial=-np.inf))


def learn(
    table: ScreeningTable,
    stances: StanceIndices,
    *,
    count: int = 1,
    within: float = 0.0,
    programs: int | None = None,
    directions: int = SCREENING_SETTINGS.directions,
    known: Array | None = None,
) -> Learnt:
    """Solve the stances that look best under the bounds so far, and lower all bounds by each.

    The search ends when the best ones are proven: as many as asked for, and all that are within a
    part of the best, have been solved, and the bounds of all others are no higher.

    Parameters
    ----------
    table : ScreeningTable
    stances : StanceIndices
        N stances, of body wrenches that are not zero.
    count : int
        Number of best stances that are to be proven.
    within : float
        Part of the best load factor: stances that may be within it are solved, too.
    programs : int, optional
        Most stances that are solved; all by default.
    directions : int
        Most directions that the table is to have: beyond, the first half and the latest are kept.
    known : ndarray, shape (N,), optional
        Load factors that are known, as in `Learnt`; by default none is.

    Raises
    ------
    DeadlineError
        If the deadline passes first.
    """
    ends = table.ends(stances)
    factors = np.full(len(stances.bodies), np.nan) if known is None else known.copy()
    failed = np.zeros(len(factors), dtype=bool)
    wrenches = table.needed(stances)
    most = len(factors) if programs is None else programs
    solved = 0
    while solved < most:
        deadline.check("the best stances were proven")
        go_on()
        bounds = _bounds(ends)
        floor = _floor(factors, count, within)
        open_ones = np.isnan(factors) & ~failed & (bounds > floor)
        if not open_ones.any():
            break
        left = np.flatnonzero(open_ones)
        size = min(SCREENING_SETTINGS.together, most - solved, len(left))
        chosen = left[np.argpartition(-bounds[left], size - 1)[:size]]
        answers = [
            solve_stance(table.hands, row[row >= 0], wrenches[i])
            for i, row in zip(chosen.tolist(), stances.members[chosen], strict=True)
        ]
        solved += size
        found = [each.direction for each in answers if each.direction is not None]
        if found:
            table = table.extended(np.array(found))
            lower, upper = table.latest(len(found)).ends(stances).T
            ends[:, 0] = np.maximum(ends[:, 0], lower)
            ends[:, 1] = np.minimum(ends[:, 1], upper)
            table = table.trimmed(directions)
        for i, answer, bound in zip(chosen.tolist(), answers, _bounds(ends)[chosen], strict=True):
            # that nothing is held counts where the bounds prove it, whatever the solver says
            factors[i] = -np.inf if bound == -np.inf else answer.factor
            failed[i] = np.isnan(factors[i])
    return Learnt(table, _bounds(ends), factors, solved)


def _bounds(ends: Array) -> Array:
    low, high = ends.T
    return np.where(low > high + SCREENING_SETTINGS.slack * (1.0 + low), -np.inf, high)


def _floor(factors: Array, count: int, within: float) -> float:
    """Return the load factor below which stances need no solving; −∞ while too few are solved."""
    known = np.sort(factors[np.isfinite(factors)])[::-1]
    if len(known) < count:
        return -np.inf
    least = min(known[count - 1], (1.0 - within) * known[0])
    return float(least * (1.0 + SCREENING_SETTINGS.slack))
