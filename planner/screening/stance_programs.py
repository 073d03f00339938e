"""Linear programs of single stances, from which directions are learnt.

Loads are weights of the vertices of the hands' parts, which sum to 1 in each part. The program for
the load factor is `planner.programs.load_factor` in these weights. Where no multiple of the body
wrench is held, the elastic program finds the least sum of absolute residuals of the balance. The
dual values of the balance are the direction in which either bounds the multiples.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from planner.programs import SilentHighs
from planner.screening.hand_supports import WorldHands

__all__ = ["SolvedStance", "solve_stance"]


class SolvedStance(NamedTuple):
    """Load factor of a stance by its linear program, and the direction that bounds it.

    Attributes
    ----------
    factor : float
        Largest multiple of the body wrench that is held; NaN if none is, or the solver failed.
    direction : ndarray, shape (6,), or None
        Direction whose bound is the factor, or that rules out all multiples; its largest component
        is 1. None if the solver failed.
    """

    factor: float
    direction: Array | None


def solve_stance(hands: WorldHands, members: Indices, wrench: Array) -> SolvedStance:
    """Solve for the load factor of a stance, and where there is none the elastic program.

    Parameters
    ----------
    hands : WorldHands
    members : ndarray of int, shape (h,)
        The hands of the stance.
    wrench : ndarray, shape (6,)
        Body wrench, in the units of ``hands``, not zero.
    """
    vertices = [np.arange(each[0].start, each[0].stop) for each in map(hands.part_of, members)]
    whose = list[Array]()
    for p in members.tolist():
        whose.append(hands.part_of(p)[1] + (whose[-1][-1] + 1 if whose else 0))
    every, part = np.concatenate(vertices), np.concatenate(whose)
    count, size = part[-1] + 1, len(every)
    bounded = [np.isfinite(hands.room[p]) for p in members]
    rows = sum(int(each.sum()) for each in bounded)
    # columns: multiple, missing wrench upward and downward, weights of the vertices
    A = np.zeros((6 + count + rows, 13 + size))
    A[:6, 0], A[:6, 1:7], A[:6, 7:13] = -wrench, np.eye(6), -np.eye(6)
    A[:6, 13:] = hands.points[every].T
    A[6 + part, 13 + np.arange(size)] = 1.0
    top, left, room = 6 + count, 13, list[Array]()
    for p, own, chosen in zip(members.tolist(), vertices, bounded, strict=True):
        end = top + int(chosen.sum())
        A[top:end, left : left + len(own)] = hands.rows[own][:, chosen].T
        room.append(hands.room[p, chosen])
        top, left = end, left + len(own)
    fixed = np.append(-hands.base[members].sum(axis=0), np.ones(count))
    upper = np.concatenate([fixed, *room])
    lower = np.append(fixed, np.full(rows, -np.inf))
    none, free = np.zeros(13 + size), np.full(13 + size, np.inf)
    closed = free.copy()
    closed[1:13] = 0.0
    # presolving such small programs takes longer than the simplex method
    tight = {f"{kind}_feasibility_tolerance": 1e-9 for kind in ("primal", "dual")}
    solver = SilentHighs({"presolve": "off", "solver": "simplex", **tight})
    solver.load(A, (none, closed), (lower, upper))
    solver.changeColCost(0, -1.0)
    if solver.optimal():
        return SolvedStance(-solver.getObjectiveValue(), _direction(solver))
    if not solver.infeasible():
        return SolvedStance(np.nan, None)
    columns = np.arange(13, dtype=np.int32)
    solver.changeColsBounds(13, columns, none[:13], free[:13])
    solver.changeColsCost(13, columns, np.append(0.0, np.ones(12)))
    if not solver.optimal():
        return SolvedStance(np.nan, None)
    return SolvedStance(np.nan, _direction(solver))


def _direction(solver: SilentHighs) -> Array | None:
    """Return the balance's dual values as a direction along which supports fall short."""
    duals = np.array(solver.getSolution().row_dual[:6])
    size = float(np.abs(duals).max())
    return duals / size if size > 0.0 else None
