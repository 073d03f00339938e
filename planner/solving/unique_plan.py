"""Compute the unique plan of a stance: least utilisation, its proof, and less tension for a little.

An interior-point solver ends near the optimum of `programs.unique`. The second term of that program
is so small that tensions may be off by newtons although the objective is accurate. The solver's
result nearly shows which rows are active, and the active-set method (`planner.programs.active_set`)
computes the exact plan. If the rows that were active at another body wrench are still active, no
solver is needed: one linear system, and the signs of its multipliers, prove the plan.

The reported plan is that of `programs.less_tension`, whose second term is larger. The same method
continues to its optimum: mostly the same rows are active, and their multipliers at the larger
weight prove in one step that the plan stays the same. Otherwise some utilisation is traded for less
tension, up to a maximum at which u is fixed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from hand_models.base import Array
from planner import deadline, programs
from planner.programs import (
    TIE_WEIGHT,
    TOLERANCES,
    ApartError,
    Mask,
    Optimum,
    Outcome,
    Point,
    Rows,
    StanceData,
    TensionTrade,
    dual_optimum,
    is_least,
    optimum,
    parted,
    tension_trade,
    tie_weight,
)
from planner.solving.spare_hands import SpareHand, at_closing, spare_hands

__all__ = ["LeastUtilisation", "active_set_optimum", "least_utilisation"]


class LeastUtilisation(NamedTuple):
    """Results of `programs.unique` and of `programs.less_tension`, solved after it.

    Attributes
    ----------
    outcome : Outcome
        Outcome of the program of least utilisation.
    bound : float
        Lower bound of the least utilisation; −∞ without a solution.
    meant : Outcome or None
        The plan to report, that of less tension; None if the deadline passed, or the outcome is not
        exact.
    spare : tuple of SpareHand
        Hands without which the utilisation would hardly be larger.
    """

    outcome: Outcome
    bound: float
    meant: Outcome | None = None
    spare: tuple[SpareHand, ...] = ()

    @property
    def proven(self) -> bool:
        """True if the utilisation is proven the least, within the tolerance of `is_least`."""
        return self.outcome.solved and is_least(self.outcome.value, self.bound)


def least_utilisation(
    data: StanceData,
    cap: float,
    closing: Sequence[float],
    near: LeastUtilisation | None = None,
    *,
    twice: bool = True,
) -> LeastUtilisation:
    """Solve for the least utilisation, and for the plan to report, which has less tension.

    The second term of `programs.unique` may raise the utilisation by up to `programs.TIE_WEIGHT`
    times its square. Where that is too much, far beyond the limits, the program is solved again
    with a smaller weight.

    Parameters
    ----------
    data : StanceData
        Rows of all hands, and the body wrench.
    cap : float
        Cap on the utilisation in the question.
    closing : sequence of float
        Closing tension of every hand [N].
    near : LeastUtilisation, optional
        Result for the same hands at another body wrench, or a guess after slips. If nearly the same
        rows are active at the optimum, no solver is called.
    twice : bool, optional
        False to look for the exact plan at a smaller weight near the first solution, before the
        program is solved again.
    """
    if near is not None:
        share = near.outcome.value**-2 if _far_beyond(near.outcome) else 1.0
        exact = active_set_optimum(data, near.outcome, share, near=True)
        if exact is not None and (share < 1.0 or _far_beyond(exact.outcome)):
            share = min(exact.outcome.value**-2, 1.0)
            exact = active_set_optimum(data, exact.outcome, share, near=True)
        if exact is not None:
            return _meant(data, exact, cap, closing, near.meant)
    outcome, share = programs.unique(data), 1.0
    if outcome.solved and _far_beyond(outcome):
        smaller = outcome.value**-2
        exact = None if twice else active_set_optimum(data, outcome, smaller)
        if exact is not None:
            return _meant(data, exact, cap, closing)
        again = programs.unique(data, smaller)
        if again.solved:
            outcome, share = again, smaller
    if not outcome.solved:
        return LeastUtilisation(outcome, -math.inf)
    exact = active_set_optimum(data, outcome, share)
    if exact is None:
        return LeastUtilisation(outcome, programs.unique_bound(data, outcome, share))
    return _meant(data, exact, cap, closing)._replace(outcome=outcome)


def _far_beyond(outcome: Outcome) -> bool:
    """Return whether the term that makes a plan unique may cost more utilisation than counts."""
    return TOLERANCES.optimality * outcome.value < TIE_WEIGHT * outcome.value**2


class ActiveSetOptimum(NamedTuple):
    """The exact optimum of `programs.unique`.

    Attributes
    ----------
    outcome : Outcome
        Outcome with exact loads and multipliers; its value is the utilisation.
    bound : float
        Lower bound of the least utilisation.
    found : Optimum
        The optimum and its active rows.
    rows : Rows
        All rows of the stance.
    weight : float
        Weight of the sum of squares in the program's second term.
    """

    outcome: Outcome
    bound: float
    found: Optimum
    rows: Rows
    weight: float


def active_set_optimum(
    data: StanceData, start: Outcome, share: float = 1.0, *, near: bool = False
) -> ActiveSetOptimum | None:
    """Compute the exact optimum of `programs.unique` by the active-set method.

    Parameters
    ----------
    data : StanceData
        Scaled rows of all hands, and the wrench that they must balance.
    start : Outcome
        Solved outcome of the same program, or of one near it.
    share : float, optional
        Factor on the weight of the program's second term, as in `programs.unique`.
    near : bool, optional
        True if the start is an exact optimum of another program, of the same hands at another body
        wrench or with other tiles: its multipliers say more than its slacks, and where other rows
        are active, these are sought by the dual method (`programs.dual_optimum`).

    Returns
    -------
    ActiveSetOptimum or None
        None if the optimum was not found.
    """
    rows, weight = Rows.of(data), share * tie_weight(len(data.hands))
    Q = 2.0 * weight * data.rows.tie
    point = _point(data, start)
    if near:
        # a row that does not count may be violated, and one that counts may have some slack
        found = dual_optimum(rows, Q, point, _guess(rows, point, 1e-2, 1e-9))
    else:
        found = _on_active_rows(rows, Q, point, _rounds(len(Q)))
    if found is None:
        return None
    # with exact multipliers the bound of `unique_bound` is the optimum but for second terms
    point = found.point
    second = 0.5 * float(Q @ point.z**2) - share * TIE_WEIGHT * point.u**2
    outcome = _outcome(data, point)
    return ActiveSetOptimum(outcome, point.u + second, found, rows, weight)


def _rounds(size: int) -> int:
    """Return how many sets of active rows are sooner tried than a program is solved anew."""
    most = 12  # sets of active rows, at most
    # so many systems are worth it up to 64 loads: fewer for more, by their cube
    return min(most, int(most * (64 / size) ** 3))


def _meant(
    data: StanceData,
    exact: ActiveSetOptimum,
    cap: float,
    closing: Sequence[float],
    near: Outcome | None = None,
) -> LeastUtilisation:
    """Return the plan that is meant, from the exact least one; ``near`` as of another wrench."""
    trade = tension_trade(exact.outcome.value, cap)
    spare = spare_hands(data, exact.outcome, trade)
    if spare:
        resting = at_closing(data, trade, spare, closing)
        if resting.solved:
            return LeastUtilisation(exact.outcome, exact.bound, resting, spare)
    least, face = exact.found
    if trade.most <= least.u or face.keeps(least, trade.weight / exact.weight):
        return LeastUtilisation(exact.outcome, exact.bound, exact.outcome)
    meant = None if near is None else _nearby(data, exact, trade, near, 1)
    meant = meant or _from_least(data, exact, trade)
    if meant is None and not deadline.expired():
        outcome = programs.less_tension(data, trade)
        if outcome.solved:
            rounds = _rounds(len(face.Q))
            meant = _nearby(data, exact, trade, outcome, rounds) or outcome
    return LeastUtilisation(exact.outcome, exact.bound, meant)


def _from_least(data: StanceData, exact: ActiveSetOptimum, trade: TensionTrade) -> Outcome | None:
    """Return the plan of less tension, sought from that of least utilisation; None if too far."""
    rows, (least, face) = exact.rows, exact.found
    weight, rounds = trade.weight / exact.weight, _rounds(len(face.Q))
    try:
        found = optimum(rows, face.Q, least, face, rounds, weight)
        if found is not None and found.point.u > trade.most:
            # the objective is convex: the optimum with u at most so much has just that
            z, u, multipliers = found.point
            way = (trade.most - least.u) / (u - least.u)
            start = Point(least.z + way * (z - least.z), trade.most, multipliers)
            active = rows.tight(start.z, start.u)
            found = optimum(rows, face.Q, start, active, rounds, weight, fixed=True)
    except ApartError:
        return None
    return None if found is None else _outcome(data, found.point)


def _nearby(
    data: StanceData, exact: ActiveSetOptimum, trade: TensionTrade, near: Outcome, rounds: int
) -> Outcome | None:
    """Return the plan of less tension near a solver's, or one at another wrench; None if too far.

    ``rounds``: sets of active rows that are tried at most.
    """
    rows, Q, weight = exact.rows, exact.found.face.Q, trade.weight / exact.weight
    start = _point(data, near)
    # at the most that is given away the multipliers of limits add up to more
    fixed = float(rows.d @ start.multipliers) > 1.0 + 1e-6
    if fixed:
        start = start._replace(u=trade.most)
    found = _on_active_rows(rows, Q, start, rounds, weight, fixed=fixed)
    if found is None:
        return None
    point = found.point
    stays = float(rows.d @ point.multipliers) >= 1.0 if fixed else point.u <= trade.most
    return _outcome(data, point) if stays else None


def _on_active_rows(
    rows: Rows, Q: Array, start: Point, rounds: int, weight: float = 1.0, *, fixed: bool = False
) -> Optimum | None:
    """Return the optimum from rows that may be active where a solver ends; None if too far."""
    # least ratio of multiplier to slack; more rows first
    for ratio in (1e-6, 1.0):
        guess = _guess(rows, start, ratio, -math.inf)
        with suppress(ApartError):
            return optimum(rows, Q, start, guess, rounds, weight, fixed=fixed)
    return None


def _guess(rows: Rows, start: Point, ratio: float, multiplier: float) -> Mask:
    """Return rows with so large a multiplier, and at least so large a ratio of it to the slack."""
    room, multipliers = rows.room(start.z, start.u), start.multipliers
    active = np.asarray((multipliers > ratio * room) & (multipliers > multiplier))
    active[: rows.equations] = True
    return active


def _point(data: StanceData, outcome: Outcome) -> Point:
    """Return where a program ended."""
    assert outcome.balance_dual is not None
    parts = (outcome.balance_dual, *outcome.limit_duals, *outcome.hard_duals)
    z = np.concatenate(outcome.loads) / data.rows.unit
    return Point(z, outcome.value, np.concatenate(parts))


def _loads(data: StanceData, point: Point) -> tuple[Array, ...]:
    """Return y of each hand at a point."""
    return parted(point.z * data.rows.unit, [len(hand.unit) for hand in data.hands])


def _outcome(data: StanceData, found: Point) -> Outcome:
    """Return an optimum as a solver would that took no step."""
    balance, limits, hard = data.by_rows(found.multipliers)
    return Outcome(
        solved=True,
        status="optimal",
        iterations=0,
        value=found.u,
        loads=_loads(data, found),
        limit_duals=limits,
        hard_duals=hard,
        balance_dual=balance,
    )
