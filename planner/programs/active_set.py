"""The active-set method for the quadratic programs of a stance, started close to the optimum.

The program is min u + ½ zᵀQ z with C z − d u ≤ b: z are the scaled loads of all hands, u is the
utilisation, d is one for limits and zero for other rows, and the first rows, the balance, are
equations. With the active rows as equations the optimum fulfils (Karush, Kuhn and Tucker)

    Q z + Cᵀ λ = 0,   dᵀ λ = 1,   C z − d u = b,

with the multipliers λ of the rows. With z eliminated, Newton's step from a point is one small
system, where r₁, r₂ and r₃ are the residuals of the three equations:

    [ S  d ] [ δλ ]   [ C Q⁻¹ r₁ − r₂ ]
    [ dᵀ 0 ] [ δu ] = [ r₃            ] ,   S = C Q⁻¹ Cᵀ,   δz = Q⁻¹ (r₁ − Cᵀ δλ).

A small term on its diagonal keeps S regular where rows are linearly dependent; it costs no
accuracy, since steps are repeated. If Q is multiplied by w, so is S⁻¹: one factorisation serves all
weights of the quadratic term. If u is given, its row and its column are left out.

On the way to the optimum of the active rows, the first row that would be violated becomes active;
at the optimum, the row with the smallest λ < 0 is dropped (Nocedal and Wright, Numerical
Optimization, algorithm 16.3).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from hand_models.base import Array
from planner.programs.stance_data import StanceData

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
    """Tolerances of a plan's optimum.

    The multipliers of the limits add up to one, the quadratic term has weight 1.
    """

    row: float = 1e-9  # scaled, of one that holds
    multiplier: float = 1e-14
    """Below zero at a weight of 1; those of the limits add up to one."""
    stationarity: float = 1e-13  # of Q z + Cᵀ λ = 0 at a weight of 1
    optimality: float = 1e-5  # relative gap of the utilisation to its proven lower bound


TOLERANCES: Final = SolvingTolerances()


class Point(NamedTuple):
    """Scaled loads z (M,), utilisation u and multipliers λ (k,) of all k rows, at one iterate."""

    z: Array
    u: float
    multipliers: Array


class Rows(NamedTuple):
    """All rows C z − d u ≤ b of a stance; the first ones, of the balance, are equations.

    Attributes
    ----------
    C : ndarray, shape (k, M)
        Coefficients of the scaled loads z.
    d : ndarray, shape (k,)
        One for limits, zero for the balance and for hard rows.
    b : ndarray, shape (k,)
        Right-hand sides, scaled.
    equations : int
        Number of equations.
    """

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
        """Return the slack b + d u − C z of each row, shape (k,).

        Parameters
        ----------
        z : ndarray, shape (M,)
            Scaled loads of all hands.
        u : float
            Utilisation.
        """
        return np.asarray(self.b + self.d * u - self.C @ z)

    def tight(self, z: Array, u: float) -> Mask:
        """Return which rows are active at a feasible point: equations, and rows without slack.

        Parameters
        ----------
        z : ndarray, shape (M,)
            Scaled loads of all hands.
        u : float
            Utilisation.

        Returns
        -------
        ndarray of bool, shape (k,)
            True for active rows.
        """
        active = self.room(z, u) <= TOLERANCES.row
        active[: self.equations] = True
        return active


class ApartError(Exception):
    """Error: the active rows have no common point, or Newton's iteration does not converge."""


class OptimalFace(Protocol):
    """The points at which a set of rows is active.

    Attributes
    ----------
    active : ndarray of bool, shape (k,)
        Mask of the active rows.
    Q : ndarray, shape (M,)
        Diagonal of the curvature at a weight of 1.
    """

    @property
    def active(self) -> Mask: ...

    @property
    def Q(self) -> Array: ...

    def keeps(self, least: Point, weight: float) -> bool:
        """Return whether the least point of the face remains the optimum at another weight.

        Parameters
        ----------
        least : Point
            Least point of the face at a weight of 1.
        weight : float
            The other weight of the quadratic term.
        """


class ActiveFace:
    """The points at which a set of rows is active, factorised for Newton's steps.

    Parameters
    ----------
    rows : Rows
        All rows of the stance.
    Q : ndarray, shape (M,)
        Diagonal of the curvature at a weight of 1.
    active : ndarray of bool, shape (k,)
        Mask of the active rows.

    Raises
    ------
    ApartError
        If the system of the active rows cannot be factorised.
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
        """Return the point of the face at which the objective is least.

        Parameters
        ----------
        start : Point
            Point at which Newton's steps start.
        weight : float, optional
            Weight of the quadratic term.
        fixed : bool, optional
            True to keep u as it is at the start.

        Raises
        ------
        ApartError
            If the active rows have no common point.
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
        """Return whether the least point remains the optimum, as of `OptimalFace.keeps`.

        It does if multipliers of the same rows, none of them negative, balance the scaled gradient.
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
    """An optimum, and the face of active rows of which it is the least point."""

    point: Point
    face: OptimalFace


def optimum(
    rows: Rows,
    Q: Array,
    start: Point,
    first: Mask | OptimalFace,
    rounds: int,
    weight: float = 1.0,
    *,
    fixed: bool = False,
) -> Optimum | None:
    """Solve a quadratic program of a stance by the active-set method.

    Parameters
    ----------
    rows : Rows
        All rows of the stance.
    Q : ndarray, shape (M,)
        Diagonal of the curvature at a weight of 1.
    start : Point
        A point that is nearly feasible, or any point if ``first`` are the optimum's active rows.
    first : ndarray of bool, shape (k,), or OptimalFace
        The rows that are active at first.
    rounds : int
        Largest number of sets of active rows that are tried.
    weight : float, optional
        Weight of the quadratic term.
    fixed : bool, optional
        True to keep u as it is at the start.

    Returns
    -------
    Optimum or None
        None if the optimum was not found within ``rounds``, or too many rows are violated.

    Raises
    ------
    ApartError
        If active rows have no common point.
    """
    face = first if isinstance(first, ActiveFace) else None
    active = first.copy() if isinstance(first, np.ndarray) else first.active.copy()
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
