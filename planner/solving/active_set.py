"""The last digits of a plan: its active rows, and the one least point where they meet.

An interior-point solver ends near the optimum of `program.Unique`, whose second term is so small
that tensions may be off by newtons while the objective has all its digits. Which rows are active is
nearly clear by then: C z − d u = b of the balance and these rows, with d one for limits. With them
as equations the optimum is where (Karush, Kuhn and Tucker)

    Q z + Cᵀ λ = 0,   dᵀ λ = 1,   C z − d u = b,

Q the curvature of the small term. Newton's step to it from the solver's own point is, with z
eliminated, one small system, r being what is missing in the three:

    [ S  d ] [ δλ ]   [ C Q⁻¹ r₁ − r₂ ]
    [ dᵀ 0 ] [ δu ] = [ r₃            ] ,   S = C Q⁻¹ Cᵀ,   δz = Q⁻¹ (r₁ − Cᵀ δλ).

A little softness keeps S regular where rows say the same, and takes nothing away, since steps are
repeated. On the way there the first row that would break becomes active; at its end the one with
the least λ < 0 no longer is: the active-set method for a convex quadratic program (Nocedal and
Wright, Numerical Optimization, algorithm 16.3), begun next to its end.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from hand_models.base import Array
from planner.programs import Outcome, StanceData, parted, tie_weight

__all__ = ["ActiveSetOptimum", "active_set_optimum"]

Mask = npt.NDArray[np.bool_]

SURE: Final = (1e-6, 1.0)
"""How many times a row's multiplier may be less than its room for the row to be active at first."""

ROUNDS: Final = 12
"""Sets of active rows that are tried at most."""

MANY: Final = 96
"""Rows that may break on the way to where active ones meet; with more, it is sooner solved anew."""

LARGE: Final = 64
"""Loads of a stance up to which so many systems are worth it: fewer for more, by their cube."""

HOLDS: Final = 1e-9
"""By how much a row may be broken, scaled."""

PUSHES: Final = 1e-14
"""How far below zero a multiplier may be, those of the limits adding up to one."""

SOFT: Final = 1e-13
"""Softness of S, whose diagonal is scaled to ones."""

STEPS: Final = 6
"""Newton's steps for a set of active rows, at most."""

MET: Final = 1e-10
"""What may be missing of the equations of rows, scaled."""

STILL: Final = 1e-13
"""What may be missing of Q z + Cᵀ λ = 0."""

WHOLE: Final = 1e-9
"""What may be missing of dᵀ λ = 1."""


class _Point(NamedTuple):
    """Loads z, scaled, the utilisation u and the multipliers λ of rows."""

    z: Array
    u: float
    multipliers: Array


class _Rows(NamedTuple):
    """All rows C z − d u ≤ b of a stance, of which the first, of the balance, are equations."""

    C: Array
    d: Array
    b: Array
    equations: int

    @classmethod
    def of(cls, data: StanceData) -> _Rows:
        """Return those of a stance: balance, limits, hard rows."""
        C, rest, limits = data.rows.whole, data.rows.rest, data.rows.limits
        nb = len(data.wrench)
        d = np.zeros(len(C))
        d[nb : nb + limits] = 1.0
        return cls(C, d, np.concatenate([data.offset, rest]), nb)

    def room(self, z: Array, u: float) -> Array:
        """Return by how much each row holds."""
        return np.asarray(self.b + self.d * u - self.C @ z)


class ActiveSetOptimum(NamedTuple):
    """The optimum of `program.Unique`, exact.

    Attributes
    ----------
    loads : tuple of ndarray
        y of each hand [N].
    utilisation : float
    second : float
        The second term of the objective, ½ zᵀ Q z.
    """

    loads: tuple[Array, ...]
    utilisation: float
    second: float


def active_set_optimum(
    data: StanceData, outcome: Outcome, share: float = 1.0
) -> ActiveSetOptimum | None:
    """Return the exact optimum of `programs.unique` from its outcome; None if that is not found.

    Parameters
    ----------
    data : StanceData
    outcome : Outcome
        Solved.
    share : float, optional
        Of the weight of its second term, as in `programs.unique`.
    """
    assert outcome.balance_dual is not None
    hands, rows = data.hands, _Rows.of(data)
    unit = data.rows.unit
    Q = 2.0 * share * tie_weight(len(data.hands)) * data.rows.tie
    multipliers = np.concatenate([outcome.balance_dual, *outcome.limit_duals, *outcome.hard_duals])
    start = _Point(np.concatenate(outcome.loads) / unit, outcome.value, multipliers)
    room = rows.room(start.z, start.u)
    for sure in SURE:
        active = multipliers > sure * room
        active[: rows.equations] = True
        try:
            found = _optimum(rows, Q, start, active)
        except _ApartError:
            continue
        if found is None:
            break
        loads = parted(found.z * unit, [len(hand.unit) for hand in hands])
        return ActiveSetOptimum(loads, found.u, 0.5 * float(Q @ found.z**2))
    return None


class _ApartError(Exception):
    """Active rows do not meet."""


def _optimum(rows: _Rows, Q: Array, start: _Point, active: Mask) -> _Point | None:
    """Return the optimum, by the active-set method; None if it is too far away."""
    z, u, multipliers = start.z, start.u, np.where(active, start.multipliers, 0.0)
    for _ in range(min(ROUNDS, int(ROUNDS * (LARGE / len(Q)) ** 3))):
        found = _meeting(rows, Q, _Point(z, u, multipliers), active)
        after = rows.room(found.z, found.u)
        after[active] = 0.0
        if after.min() < -HOLDS:
            broken = np.flatnonzero(after < -HOLDS)
            if len(broken) > MANY:
                return None
            room = np.maximum(rows.room(z, u)[broken], 0.0)
            way = room / (room - after[broken])
            first = int(way.argmin())
            z, u = z + way[first] * (found.z - z), u + way[first] * (found.u - u)
            active[broken[first]] = True
            continue
        z, u, multipliers = found
        least = rows.equations + int(multipliers[rows.equations :].argmin())
        if multipliers[least] >= -PUSHES:
            return found
        active[least] = False
        multipliers[least] = 0.0
    return None


def _meeting(rows: _Rows, Q: Array, start: _Point, active: Mask) -> _Point:
    """Return the least point where active rows meet; raises `_ApartError` where they do not."""
    C, d, b = rows.C[active], rows.d[active], rows.b[active]
    z, u, multipliers = start.z, start.u, start.multipliers[active]
    flexible = C / Q
    S = flexible @ C.T
    diagonal = S.diagonal()
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    S = scale[:, None] * S * scale
    S.flat[:: len(S) + 1] += SOFT
    try:
        # S⁻¹ = rootᵀ root
        root = np.linalg.inv(np.linalg.cholesky(S)) * scale
    except np.linalg.LinAlgError:
        raise _ApartError from None
    across = (root @ d) @ root
    stiffness = float(d @ across)
    if not stiffness > 0.0:
        raise _ApartError
    for taken in range(STEPS):
        r1, r2, r3 = -Q * z - multipliers @ C, b + d * u - C @ z, 1.0 - float(d @ multipliers)
        if taken and _size(r1) <= STILL and _size(r2) <= MET and abs(r3) <= WHOLE:
            whole = np.zeros(len(active))
            whole[active] = multipliers
            return _Point(z, u, whole)
        step = (root @ (flexible @ r1 - r2)) @ root
        rise = (float(d @ step) - r3) / stiffness
        step -= rise * across
        z, u, multipliers = z + (r1 - step @ C) / Q, u + rise, multipliers + step
    raise _ApartError


def _size(missing: Array) -> float:
    """Return the Euclidean norm, which none of what is missing exceeds."""
    return math.sqrt(missing.dot(missing))
