"""The active-set method for the quadratic programs of a stance, begun next to their end.

min u + ½ zᵀQ z with C z − d u ≤ b, d one for limits, the first rows equations. With the active rows
as equations the optimum is where (Karush, Kuhn and Tucker)

    Q z + Cᵀ λ = 0,   dᵀ λ = 1,   C z − d u = b.

Newton's step to it from a point is, with z eliminated, one small system, r being what is missing in
the three:

    [ S  d ] [ δλ ]   [ C Q⁻¹ r₁ − r₂ ]
    [ dᵀ 0 ] [ δu ] = [ r₃            ] ,   S = C Q⁻¹ Cᵀ,   δz = Q⁻¹ (r₁ − Cᵀ δλ).

A little softness keeps S regular where rows say the same, and takes nothing away, since steps are
repeated. Where Q is w times as large, S⁻¹ is so, too: one factorisation serves all weights of the
quadratic term. Where u is given, there is neither its row nor its column.

On the way there the first row that would break becomes active; at its end the one with the least
λ < 0 no longer is (Nocedal and Wright, Numerical Optimization, algorithm 16.3).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from hand_models.base import Array
from planner.programs import StanceData

__all__ = [
    "TOLERANCES",
    "ActiveFace",
    "ApartError",
    "Mask",
    "Optimum",
    "Point",
    "Rows",
    "SolvingTolerances",
    "optimum",
]

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class SolvingTolerances:
    """Tolerances of a plan's optimum."""

    row: float = 1e-9  # scaled, of one that holds
    multiplier: float = 1e-14
    """Below zero at a weight of 1; those of the limits add up to one."""
    stationarity: float = 1e-13  # of Q z + Cᵀ λ = 0 at a weight of 1
    optimality: float = 1e-5  # relative gap of the utilisation to its proven lower bound


TOLERANCES: Final = SolvingTolerances()


class Point(NamedTuple):
    """Loads z, scaled, the utilisation u and the multipliers λ of rows."""

    z: Array
    u: float
    multipliers: Array


class Rows(NamedTuple):
    """All rows C z − d u ≤ b of a stance, of which the first, of the balance, are equations."""

    C: Array
    d: Array
    b: Array
    equations: int

    @classmethod
    def of(cls, data: StanceData) -> Rows:
        """Return the rows of a stance: balance, limits, hard rows."""
        C, rest, limits = data.rows.whole, data.rows.rest, data.rows.limits
        nb = len(data.wrench)
        d = np.zeros(len(C))
        d[nb : nb + limits] = 1.0
        return cls(C, d, np.concatenate([data.offset, rest]), nb)

    def room(self, z: Array, u: float) -> Array:
        """Return the slack of each row."""
        return np.asarray(self.b + self.d * u - self.C @ z)

    def tight(self, z: Array, u: float) -> Mask:
        """Return which rows are active at a point that keeps to all."""
        active = self.room(z, u) <= TOLERANCES.row
        active[: self.equations] = True
        return active


class ApartError(Exception):
    """Active rows do not meet."""


class ActiveFace:
    """The points where some rows are active, ready for Newton's steps.

    Parameters
    ----------
    rows : Rows
    Q : ndarray, shape (M,)
        Curvature at a weight of 1.
    active : ndarray of bool

    Raises
    ------
    ApartError
        If the rows do not meet.
    """

    def __init__(self, rows: Rows, Q: Array, active: Mask) -> None:
        self.active, self.Q, self.equations = active.copy(), Q, rows.equations
        self.C, self.d, self.b = rows.C[active], rows.d[active], rows.b[active]
        self.flexible = self.C / Q
        S = self.flexible @ self.C.T
        diagonal = S.diagonal()
        scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
        S = scale[:, None] * S * scale
        S.flat[:: len(S) + 1] += 1e-13  # soft, beside a diagonal of ones
        try:
            # S⁻¹ = rootᵀ root
            self.root = np.linalg.inv(np.linalg.cholesky(S)) * scale
        except np.linalg.LinAlgError:
            raise ApartError from None
        self.across = (self.root @ self.d) @ self.root
        self.stiffness = float(self.d @ self.across)

    def least(self, start: Point, weight: float = 1.0, *, fixed: bool = False) -> Point:
        """Return the least point of the face.

        Parameters
        ----------
        start : Point
        weight : float, optional
            Of the quadratic term.
        fixed : bool, optional
            Whether u stays.

        Raises
        ------
        ApartError
            If the rows do not meet.
        """
        if not (fixed or self.stiffness > 0.0):
            raise ApartError
        C, d, b, root, Q = self.C, self.d, self.b, self.root, weight * self.Q
        z, u, multipliers = start.z, start.u, start.multipliers[self.active]
        met = 1e-10  # of the equations of rows, scaled
        sum_met = 1e-9  # of dᵀ λ = 1
        for taken in range(6):  # Newton's steps
            r1, r2 = -Q * z - multipliers @ C, b + d * u - C @ z
            r3 = 0.0 if fixed else 1.0 - float(d @ multipliers)
            still = (
                _size(r1) <= TOLERANCES.stationarity * weight
                and _size(r2) <= met
                and abs(r3) <= sum_met
            )
            if taken and still:
                whole = np.zeros(len(self.active))
                whole[self.active] = multipliers
                return Point(z, u, whole)
            step = (root @ (self.flexible @ r1 - weight * r2)) @ root
            if not fixed:
                rise = (float(d @ step) - r3) / self.stiffness
                step -= rise * self.across
                u += rise / weight
            z, multipliers = z + (r1 - step @ C) / Q, multipliers + step
        raise ApartError

    def keeps(self, least: Point, weight: float) -> bool:
        """Return whether the least point of the face is the optimum of another weight, too.

        It is where multipliers of the same rows, none below zero, make up for the larger gradient.
        """
        r1 = -weight * self.Q * least.z - least.multipliers[self.active] @ self.C
        step = (self.root @ (self.flexible @ r1)) @ self.root
        step -= float(self.d @ step) / self.stiffness * self.across
        if _size(r1 - step @ self.C) > TOLERANCES.stationarity * weight:
            return False
        multipliers = least.multipliers[self.active] + step
        return bool(
            multipliers[self.equations :].min(initial=0.0) >= -TOLERANCES.multiplier * weight
        )


class Optimum(NamedTuple):
    """An optimum, and the face that it is the least point of."""

    point: Point
    face: ActiveFace


def optimum(
    rows: Rows,
    Q: Array,
    start: Point,
    first: Mask | ActiveFace,
    rounds: int,
    weight: float = 1.0,
    *,
    fixed: bool = False,
) -> Optimum | None:
    """Return the optimum, by the active-set method; None if it is too far away.

    Parameters
    ----------
    rows : Rows
    Q : ndarray, shape (M,)
    start : Point
        About feasible, unless its active rows are those of the optimum.
    first : ndarray of bool or ActiveFace
        The rows that are active at first.
    rounds : int
        Sets of active rows that are tried at most.
    weight : float, optional
        Of the quadratic term.
    fixed : bool, optional
        Whether u stays as it is.

    Raises
    ------
    ApartError
        If active rows do not meet.
    """
    face = first if isinstance(first, ActiveFace) else None
    active = first.active.copy() if isinstance(first, ActiveFace) else first.copy()
    z, u, multipliers = start.z, start.u, np.where(active, start.multipliers, 0.0)
    for taken in range(rounds):
        if face is None:
            face = ActiveFace(rows, Q, active)
        found = face.least(Point(z, u, multipliers), weight, fixed=fixed)
        after = rows.room(found.z, found.u)
        after[active] = 0.0
        if after.min() < -TOLERANCES.row:
            broken = np.flatnonzero(after < -TOLERANCES.row)
            if len(broken) > 96:  # with more it is sooner solved anew
                return None
            room = np.maximum(rows.room(z, u)[broken], 0.0)
            way = room / (room - after[broken])
            breaks = int(way.argmin())
            z, u = z + way[breaks] * (found.z - z), u + way[breaks] * (found.u - u)
            active[broken[breaks]] = True
            face = None
            continue
        z, u, multipliers = found
        signed = multipliers[rows.equations :]
        pulls = np.flatnonzero(signed < -TOLERANCES.multiplier * weight)
        if not len(pulls):
            return Optimum(found, face)
        # those of a larger weight are many at first
        pulls = pulls if not taken else np.array([signed.argmin()])
        active[rows.equations + pulls] = False
        multipliers[rows.equations + pulls] = 0.0
        face = None
    return None


def _size(missing: Array) -> float:
    """Return the Euclidean norm, which no component exceeds."""
    return math.sqrt(missing.dot(missing))
