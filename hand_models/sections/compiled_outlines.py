"""Rock as points in blocks: what bounds the blocks, and distances from the points (compiled).

Points are places s + i t; their blocks are equally many of them, one after the other.
"""

from __future__ import annotations

import math

import numpy as np

from hand_models.base import Array, compiled
from hand_models.sections.section import Complexes

__all__ = ["bounds_of_blocks", "least_distance", "rock_distances"]


@compiled()
def _size(way: complex) -> float:
    """Return the length of a way, in a third of the time of `abs`, which minds extremes."""
    return math.sqrt(way.real * way.real + way.imag * way.imag)


@compiled("c2", "i0")
def bounds_of_blocks(points: Complexes, each: int) -> tuple[Complexes, Array, Complexes, Array]:
    """Return what bounds blocks of points, shapes (n, b).

    Parameters
    ----------
    points : ndarray of complex, shape (n, b · each)
        s + i t [m].
    each : int
        Number of points of a block.

    Returns
    -------
    centres, radii : ndarray
        Mean of a block's points, s + i t, and their largest distance from it [m].
    halves : ndarray of complex
        Vector from the mean along the line from the first point to the last, as long as points are
        away from it along that line, at most [m].
    thick : ndarray
        How far they are from it across that line, at most [m].
    """
    shape = len(points), points.shape[1] // each
    centres, halves = np.empty(shape, np.complex128), np.empty(shape, np.complex128)
    radii, thick = np.empty(shape), np.empty(shape)
    for i in range(shape[0]):
        for block in range(shape[1]):
            own = points[i, block * each : block * each + each]
            middle, step = own.mean(), own[-1] - own[0]
            long = _size(step)
            step = step / long if long > 0.0 else 1.0 + 0.0j
            radius, half, beside = 0.0, 0.0, 0.0
            for point in own:
                away = (point - middle) * step.conjugate()
                radius = max(radius, _size(away))
                half, beside = max(half, abs(away.real)), max(beside, abs(away.imag))
            # rounding must leave no point out
            more = 1e-12 * (_size(middle) + radius)
            centres[i, block], radii[i, block] = middle, radius + more
            halves[i, block], thick[i, block] = half * step, beside + more
    return centres, radii, halves, thick


@compiled("c1", "c1", "c1", "f1")
def rock_distances(places: Complexes, points: Complexes, centres: Complexes, radii: Array) -> Array:
    """Return the distance of each of m places from the nearest point of rock, shape (m,) [m].

    Parameters
    ----------
    places : ndarray of complex, shape (m,)
        x + i z [m].
    points, centres, radii : ndarray
        Rock in the finger's plane, a row of `Outlines`.
    """
    found = np.full(len(places), math.inf)
    each = len(points) // len(centres)
    for k in range(len(places)):
        for block in range(len(centres)):
            if _size(centres[block] - places[k]) - radii[block] < found[k]:
                for i in range(block * each, block * each + each):
                    found[k] = min(found[k], _size(points[i] - places[k]))
    return found


@compiled("c1", "i0", "c1", "c1", "f1")
def least_distance(
    places: Complexes, together: int, points: Complexes, centres: Complexes, radii: Array
) -> float:
    """Return the least of `rock_distances` [m].

    ``together``: number of places that follow each other and are near each other.
    """
    least, each = math.inf, len(points) // len(centres)
    for first in range(0, len(places), together):
        own = places[first : first + together]
        middle, radius = own.mean(), 0.0
        for place in own:
            radius = max(radius, _size(place - middle))
        for block in range(len(centres)):
            if _size(centres[block] - middle) - radii[block] - radius >= least:
                continue
            for place in own:
                if _size(centres[block] - place) - radii[block] < least:
                    for i in range(block * each, block * each + each):
                        least = min(least, _size(points[i] - place))
    return least
