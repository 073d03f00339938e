"""Where a conic meets the unit circle, in closed form and for many conics at once.

A point that turns about a joint meets an ellipse of rock at directions e = (x, y) with

    f(e) = A x² + B y² + 2 D x + 2 E y + F = 0,        x² + y² = 1,        A ≥ B.

All conics f + λ (x² + y² − 1) of this pencil meet the circle in the same points. One of them, with
λ between −A and −B, is a pair of straight lines (its determinant, a cubic in λ, changes its sign
there): with p² = A + λ and q² = −(B + λ),

    (p x + D/p)² = (q y − E/q)².

So at most four points are left, two on each line.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from hand_models.base import Array

__all__ = ["circle_crossings"]

ROUND: Final = 1e-14
"""By how much, of A, a conic is at least taken as longer one way than the other."""

ITERATIONS: Final = 60
"""Steps toward a root of a cubic, at most; about four are needed."""

CONVERGED: Final = 1e-12
"""Change in [0, 1] from which the crossings are near enough for their own steps."""

INSIDE: Final = 1e-12
"""How far from both ends of [0, 1] the search for that root begins."""

NEAR: Final = 1e-3
"""Largest step of Newton's method on a crossing; two that are all but one have none [rad]."""

POLISHES: Final = 2
"""Steps of Newton's method on the crossings."""

LEAST: Final = np.finfo(float).tiny


def circle_crossings(A: Array, B: Array, D: Array, E: Array, F: Array) -> tuple[Array, Array]:
    """Return where conics meet the unit circle.

    Parameters
    ----------
    A, B, D, E, F : ndarray, shape (...)
        Of f, with A ≥ B.

    Returns
    -------
    angles : ndarray, shape (4, ...)
        Of the crossings, from x toward y; NaN in place of those that there are not [rad].
    slopes : ndarray, shape (4, ...)
        df/dangle there.
    """
    spread = np.maximum(A - B, ROUND * A)
    C = F + A
    nu = _split(spread, C, D * D, E * E)
    length = np.sqrt(spread)
    p, q = length * np.sqrt(nu), length * np.sqrt(1.0 - nu)
    # the constants of both sides, D/p and E/q; P² − Q² = F − λ gives the one with less left of λ
    rest = C - spread * nu
    P, Q = D / p, E / q
    square = np.where(nu < 0.5, Q * Q + rest, P * P - rest)
    other = np.sqrt(np.maximum(square, 0.0))
    P, Q = (
        np.where(nu < 0.5, np.copysign(other, D), P),
        np.where(nu < 0.5, Q, np.copysign(other, E)),
    )
    # lines p x ± q y + c = 0, whose constants P − Q and P + Q have the product F − λ
    opposed = P * Q < 0.0
    large = P + np.where(opposed, -Q, Q)
    toward = np.arctan2(np.where(opposed, q, -q), p)
    turn = np.arccos(large / -length), np.arccos(rest / large / -length)
    angles = np.empty((4, *toward.shape))
    np.subtract(toward, turn[0], out=angles[0])
    np.add(toward, turn[0], out=angles[1])
    np.subtract(turn[1], toward, out=angles[2])
    np.add(turn[1], toward, out=angles[3])
    np.negative(angles[3], out=angles[3])
    # the rest of what is off, by Newton's method
    slopes = angles
    for _ in range(POLISHES):
        x, y = np.cos(angles), np.sin(angles)
        half_x, half_y = A * x + D, B * y + E
        slopes = 2.0 * (half_y * x - half_x * y)
        step = ((half_x + D) * x + (half_y + E) * y + F) / slopes
        step[~(np.abs(step) < NEAR)] = 0.0
        angles = angles - step
    return angles, slopes


def _split(spread: Array, C: Array, DD: Array, EE: Array) -> Array:
    """Return (λ + A) / (A − B) in [0, 1] of the pair of lines, by Newton within a bracket.

    The root of s ν (ν − 1) (C − s ν) + D² (1 − ν) − E² ν, s = A − B, which falls from D² to −E².
    """
    both = DD + EE
    low, high = np.zeros_like(both), np.ones_like(both)
    nu = np.minimum(np.maximum((DD + LEAST) / (both + 2.0 * LEAST), INSIDE), 1.0 - INSIDE)
    for _ in range(ITERATIONS):
        part = spread * nu
        rest, bent = C - part, part - spread
        value = bent * nu * rest + DD - both * nu
        above = value > 0.0
        low, high = np.where(above, nu, low), np.where(above, high, nu)
        new = nu - value / ((part + bent) * rest - bent * part - both)
        new = np.where((new >= low) & (new <= high), new, 0.5 * (low + high))
        done = np.abs(new - nu) <= CONVERGED
        nu = new
        if done.all():
            break
    return nu
