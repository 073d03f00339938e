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

The inverse of this matrix is kept, and changed by one row at a time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from hand_models.base import Array, Indices
from planner.programs.active_set import TOLERANCES, Mask, Rows

__all__ = ["active_rows_near"]


@dataclass(frozen=True, slots=True)
class DualSettings:
    """Settings of the dual active-set method, for rows of unit length."""

    dependent: float = 1e-9
    """Square of what a row adds to others, at which it depends on them linearly."""
    multiplier: float = 1e-12  # below zero, by rounding
    starts: int = 4  # from which all rows with negative multipliers are dropped at once
    changes: int = 32
    """Rows that come or go at most: with more, a program is sooner solved anew."""


DUAL_SETTINGS: Final = DualSettings()


def active_rows_near(rows: Rows, Q: Array, guess: Mask, multipliers: Array) -> Mask | None:
    """Return the active rows of a quadratic program, sought from a guess.

    Parameters
    ----------
    rows : Rows
        All rows of the stance.
    Q : ndarray, shape (M,)
        Diagonal of the curvature.
    guess : ndarray of bool, shape (k,)
        Rows that may be active, the equations among them.
    multipliers : ndarray, shape (k,)
        Multipliers near those of the optimum: of rows that depend on each other, those with the
        largest count.

    Returns
    -------
    ndarray of bool, shape (k,), or None
        None if too many rows would have to change, or rounding is in the way.
    """
    F = rows.C / np.sqrt(Q)
    size = np.sqrt(np.einsum("ij,ij->i", F, F))
    # rows of nothing bind nothing
    counts = size > 0.0
    if not (counts[: rows.equations].all() and rows.d.any()):
        return None
    size[~counts] = 1.0
    F /= size[:, None]
    d, b = rows.d / size, rows.b / size
    whole = 1.0 / float(d.max())
    d *= whole
    try:
        at, inverse = _first(F, d, b, whole, guess & counts, multipliers * size, rows.equations)
    except np.linalg.LinAlgError:
        return None
    found = inverse @ np.concatenate(([whole], -b[at]))
    changes = 0
    while True:
        room = b + d * found[0] + F @ (found[1:] @ F[at])
        room *= size
        room[at], room[~counts] = 0.0, 0.0
        row = int(room.argmin())
        if room[row] >= -TOLERANCES.row:
            active = np.zeros(len(F), dtype=bool)
            active[at] = True
            return active
        multiplier, entering = 0.0, True
        while entering:
            changes += 1
            if changes > DUAL_SETTINGS.changes:
                return None
            column = np.concatenate(([d[row]], F[at] @ F[row]))
            slopes = -(inverse @ column)
            rise = 1.0 + float(column @ slopes)
            far = b[row] + d[row] * found[0] + F[row] @ (found[1:] @ F[at] + multiplier * F[row])
            full = -float(far) / rise if rise > DUAL_SETTINGS.dependent else math.inf
            falls = slopes[1 + rows.equations :]
            left = np.full(len(falls), math.inf)
            np.divide(-found[1 + rows.equations :], falls, out=left, where=falls < -1e-14)
            first = int(left.argmin()) if len(left) else 0
            step = min(full, max(float(left.min(initial=math.inf)), 0.0))
            if step == math.inf:
                return None
            found += step * slopes
            multiplier += step
            if step == full:
                inverse = _with_row(inverse, slopes, rise)
                at, found = np.append(at, row), np.append(found, multiplier)
                entering = False
            else:
                gone = 1 + rows.equations + first
                if abs(inverse[gone, gone]) < DUAL_SETTINGS.multiplier:
                    return None
                inverse = _without_row(inverse, gone)
                at, found = np.delete(at, gone - 1), np.delete(found, gone)


def _first(
    F: Array, d: Array, b: Array, whole: float, guess: Mask, multipliers: Array, equations: int
) -> tuple[Indices, Array]:
    """Return the rows of a guess that do not depend on others, nor pull, and their inverse.

    The equations come first.
    """
    at: Indices = np.flatnonzero(guess)
    weight = -multipliers[at]
    weight[:equations] = -math.inf
    at = at[weight.argsort(kind="stable")]
    S = F[at] @ F[at].T + d[at, None] * d[at]
    scale = 1.0 / np.sqrt(S.diagonal())
    S *= scale * scale[:, None]
    S.flat[:: len(S) + 1] += 1e-14  # beside a diagonal of ones
    kept = np.linalg.cholesky(S).diagonal() ** 2 > DUAL_SETTINGS.dependent
    for taken in range(len(at)):
        at = at[kept]
        if not (kept[:equations].all() and len(at) > equations and d[at].any()):
            raise np.linalg.LinAlgError
        matrix = np.zeros((len(at) + 1, len(at) + 1))
        matrix[0, 1:] = matrix[1:, 0] = d[at]
        matrix[1:, 1:] = F[at] @ F[at].T
        inverse = np.linalg.inv(matrix)
        signed = (inverse @ np.concatenate(([whole], -b[at])))[1 + equations :]
        pulls = signed < -DUAL_SETTINGS.multiplier * whole
        if not pulls.any():
            return at, np.asarray(inverse)
        if taken >= DUAL_SETTINGS.starts:
            pulls = np.arange(len(signed)) == signed.argmin()
        kept = np.concatenate((np.ones(equations, dtype=bool), ~pulls))
    raise np.linalg.LinAlgError


def _with_row(inverse: Array, slopes: Array, rise: float) -> Array:
    """Return the inverse with a row more, the last."""
    count = len(inverse)
    larger = np.empty((count + 1, count + 1))
    larger[:count, :count] = inverse + slopes[:, None] * (slopes / rise)
    larger[count, :count] = larger[:count, count] = slopes / rise
    larger[count, count] = 1.0 / rise
    return larger


def _without_row(inverse: Array, gone: int) -> Array:
    """Return the inverse without a row."""
    kept = np.arange(len(inverse)) != gone
    column = inverse[kept, gone]
    smaller = inverse[kept][:, kept]
    smaller -= column[:, None] * (column / inverse[gone, gone])
    return np.asarray(smaller)
