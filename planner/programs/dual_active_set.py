"""The dual active-set method for the quadratic programs of a stance, from a guess of active rows.

The program is that of `planner.programs.active_set`, min u + ½ zᵀQz with C z − d u ≤ b. Where the
guess is wrong in a few rows, its least point may violate some of the others. Then the row that is
violated most becomes active, and its multiplier grows until the row is met; a row whose multiplier
would be negative on the way is dropped. No point has to be feasible, and the objective rises with
each row that is met, so that no set of rows comes twice (Goldfarb and Idnani, Mathematical
Programming 27, 1983).

In scaled loads x = Q^½ z and with rows F of unit length, multipliers λ and u of the active rows are

    [ 0  dᵀ ] [ u ]   [  1 ]
    [ d  S  ] [ λ ] = [ −b ] ,   S = F Fᵀ,   x = −Fᵀ λ.

The inverse of this matrix is kept, and changed by one row at a time. The method is compiled
(`planner.programs.compiled_dual`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from planner.programs.active_set import (
    TOLERANCES,
    ApartError,
    Mask,
    Optimum,
    Point,
    Rows,
    optimum,
)

__all__ = ["DualFace", "dual_optimum", "load_dual_method"]


@dataclass(frozen=True, slots=True)
class DualSettings:
    """Settings of the dual active-set method, for rows of unit length."""

    dependent: float = 1e-9
    """Square of what a row adds to others, at which it depends on them linearly."""
    multiplier: float = 1e-12  # below zero, by rounding
    starts: int = 4  # from which all rows with negative multipliers are dropped at once
    changes: int = 96
    """Rows that come or go at most: with more, a program is sooner solved anew."""
    met: float = 1e-10  # of the equations of active rows, scaled, and of dᵀ λ = 1


DUAL_SETTINGS: Final = DualSettings()


class DualFace(NamedTuple):
    """The points at which k of a stance's rows are active, as the dual method leaves them.

    Attributes
    ----------
    rows : Rows
        All rows of the stance.
    Q : ndarray, shape (M,)
        Diagonal of the curvature at a weight of 1.
    active : ndarray of bool
        Mask of the active rows.
    at : ndarray of int, shape (k,)
        Indices of the active rows, the equations first.
    inverse : ndarray, shape (k + 1, k + 1)
        Inverse of [[0, dᵀ], [d, C Q⁻¹ Cᵀ]] of the active rows.
    """

    rows: Rows
    Q: Array
    active: Mask
    at: Indices
    inverse: Array

    def keeps(self, least: Point, weight: float) -> bool:
        """Return whether the least point remains the optimum, as of `OptimalFace.keeps`."""
        C, multipliers = self.rows.C[self.at], least.multipliers[self.at]
        for _ in range(3):
            missing = weight * self.Q * least.z + multipliers @ C
            if math.sqrt(missing.dot(missing)) <= TOLERANCES.stationarity * weight:
                signed = multipliers[self.rows.equations :]
                return bool(signed.min(initial=0.0) >= -TOLERANCES.multiplier * weight)
            multipliers = multipliers - self.inverse[1:, 1:] @ (C @ (missing / self.Q))
        return False


def dual_optimum(rows: Rows, Q: Array, start: Point, guess: Mask) -> Optimum | None:
    """Solve a quadratic program of a stance by the dual method, from a guess of its active rows.

    Parameters
    ----------
    rows : Rows
        All rows of the stance.
    Q : ndarray, shape (M,)
        Diagonal of the curvature.
    start : Point
        Point near the optimum. Of rows that depend on each other, those with the largest
        multipliers count.
    guess : ndarray of bool, shape (k,)
        Rows that may be active, the equations among them.

    Returns
    -------
    Optimum or None
        None if too many rows would have to change, or rounding is in the way.
    """
    from planner.programs.compiled_dual import optimum_near

    own = DUAL_SETTINGS
    tolerances, most = (TOLERANCES.row, own.dependent, own.multiplier), (own.starts, own.changes)
    exact, at, z, u, multipliers, inverse = optimum_near(
        *rows, Q, guess, start.multipliers, *tolerances, *most, own.met, TOLERANCES.stationarity
    )
    if not len(at):
        return None
    active = np.zeros(len(rows.b), dtype=bool)
    active[at] = True
    if exact and multipliers[rows.equations :].min() >= -TOLERANCES.multiplier:
        return Optimum(Point(z, u, multipliers), DualFace(rows, Q, active, at, inverse))
    try:
        # by rounding a row more or less
        return optimum(rows, Q, start, active, 3)
    except ApartError:
        return None


def load_dual_method() -> None:
    """Import what numba compiles for `dual_optimum`, so that no question waits for it."""
    from planner.programs import compiled_dual  # noqa: F401
