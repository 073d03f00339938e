"""The plan of least utilisation that is meant: one program, its last digits, and its proof.

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

Where the rows that were active at another wrench still are, no solver is needed: one such system,
and the signs of its multipliers, prove the plan.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from hand_models.base import Array
from planner import programs
from planner.programs import TIE, Outcome, StanceData, parted, tie_weight
from planner.solving import dual_bounds

__all__ = ["LeastUtilisation", "active_set_optimum", "is_least", "least_utilisation"]

Mask = npt.NDArray[np.bool_]

OPTIMAL: Final = 1e-5
"""How far, relatively, the utilisation may be above its proven lower bound."""


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


def least_utilisation(data: StanceData, near: Outcome | None = None) -> LeastUtilisation:
    """Return the plan of least utilisation, of these the one of least tensions.

    What makes it unique exceeds the least utilisation by up to `program.TIE` times its square: far
    beyond the limits it is asked for again with less weight.

    Parameters
    ----------
    data : StanceData
    near : Outcome, optional
        Of the same hands at another wrench: where its active rows are those of the optimum, no
        solver is asked.
    """
    if near is not None:
        exact = active_set_optimum(data, near, rounds=1)
        if exact is not None and not _far_beyond(exact.outcome):
            return LeastUtilisation(exact.outcome, exact.bound, exact.outcome.loads)
    outcome, share = programs.unique(data), 1.0
    if outcome.solved and _far_beyond(outcome):
        smaller = outcome.value**-2
        again = programs.unique(data, smaller)
        if again.solved:
            outcome, share = again, smaller
    if not outcome.solved:
        return LeastUtilisation(outcome, -math.inf)
    exact = active_set_optimum(data, outcome, share)
    if exact is None:
        return LeastUtilisation(outcome, dual_bounds.unique_bound(data, outcome, share))
    return LeastUtilisation(outcome, exact.bound, exact.outcome.loads)


def _far_beyond(outcome: Outcome) -> bool:
    """Whether what makes a plan unique may cost more utilisation than counts."""
    return OPTIMAL * outcome.value < TIE * outcome.value**2


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
    outcome : Outcome
        Its value is the utilisation.
    bound : float
        The least utilisation is not below.
    """

    outcome: Outcome
    bound: float


def active_set_optimum(
    data: StanceData, near: Outcome, share: float = 1.0, rounds: int | None = None
) -> ActiveSetOptimum | None:
    """Return the exact optimum of `programs.unique`; None if it is not found.

    Parameters
    ----------
    data : StanceData
    near : Outcome
        Solved, of the same program or of one at another wrench.
    share : float, optional
        Of the weight of its second term, as in `programs.unique`.
    rounds : int, optional
        Sets of active rows that are tried at most; by default as many as are sooner tried than
        solved anew.
    """
    assert near.balance_dual is not None
    rows, unit = _Rows.of(data), data.rows.unit
    Q = 2.0 * share * tie_weight(len(data.hands)) * data.rows.tie
    multipliers = np.concatenate([near.balance_dual, *near.limit_duals, *near.hard_duals])
    start = _Point(np.concatenate(near.loads) / unit, near.value, multipliers)
    room = rows.room(start.z, start.u)
    if rounds is None:
        rounds = min(ROUNDS, int(ROUNDS * (LARGE / len(Q)) ** 3))
    for sure in SURE:
        active = multipliers > sure * room
        active[: rows.equations] = True
        try:
            found = _optimum(rows, Q, start, active, rounds)
        except _ApartError:
            continue
        if found is None:
            break
        # with exact multipliers the bound of `unique_bound` is the optimum but for second terms
        second = 0.5 * float(Q @ found.z**2) - share * TIE * found.u**2
        return ActiveSetOptimum(_outcome(data, found), found.u + second)
    return None


def _outcome(data: StanceData, found: _Point) -> Outcome:
    """Return an optimum as a solver would that took no step."""
    balance, limits, hard = data.by_rows(found.multipliers)
    return Outcome(
        solved=True,
        status="optimal",
        iterations=0,
        value=found.u,
        loads=parted(found.z * data.rows.unit, [len(hand.unit) for hand in data.hands]),
        limit_duals=limits,
        hard_duals=hard,
        balance_dual=balance,
    )


class _ApartError(Exception):
    """Active rows do not meet."""


def _optimum(rows: _Rows, Q: Array, start: _Point, active: Mask, rounds: int) -> _Point | None:
    """Return the optimum, by the active-set method; None if it is too far away."""
    z, u, multipliers = start.z, start.u, np.where(active, start.multipliers, 0.0)
    for _ in range(rounds):
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
