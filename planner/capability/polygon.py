"""Inner and outer polygons of a convex set in a plane, from its support function.

Each queried direction gives a support point of the set and a half-plane that contains the set. The
convex hull of the points lies within the set, the intersection of the half-planes around it. Where
these polygons are farthest apart, the normal of the inner edge is queried next (Bretl and Lall,
Testing static equilibrium for legged robots, IEEE Transactions on Robotics 24, 2008). Once each
edge has been queried, the result is exact, be it a polygon, a segment or a point.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, SolverError
from planner.result import LimitName

__all__ = ["POLYGON_SETTINGS", "Polygon", "SupportPoint", "enclose"]


@dataclass(frozen=True, slots=True)
class PolygonSettings:
    """Number of directions of a polygon, and the smallest angle between them."""

    most_directions: int = 160
    least_turn: float = 1e-7
    """Least angle between two directions [rad]; below, rounding moves their half-planes' corner."""


POLYGON_SETTINGS: Final = PolygonSettings()


class SupportPoint(NamedTuple):
    """Point of a convex set that is farthest in a direction.

    Attributes
    ----------
    normal : ndarray, shape (2,)
        Unit vector of the direction.
    point : ndarray, shape (2,)
        The point, in the unit of the set.
    limiting : LimitName or None
        Limit that bounds the set there.
    """

    normal: Array
    point: Array
    limiting: LimitName | None = None

    @property
    def reach(self) -> float:
        """Distance of the point from the origin along the direction, in the unit of the set."""
        return float(self.normal @ self.point)


@dataclass(frozen=True, eq=False)
class Polygon:
    """Convex set between an inner and an outer polygon, both counterclockwise.

    Attributes
    ----------
    inner : ndarray, shape (n, 2)
        Corners of a polygon within the set: two for a segment, one for a point.
    outer : ndarray, shape (m, 2)
        Corners of a polygon that contains the set.
    gap : float
        Largest distance of a point of the outer polygon from the inner polygon.
    limiting : tuple of (LimitName or None), length n
        Limit that bounds the set at each inner corner.
    """

    inner: Array
    outer: Array
    gap: float
    limiting: tuple[LimitName | None, ...] = ()

    def scaled(self, units: Array) -> Polygon:
        """Return the polygons in other units; ``gap`` stays in the old ones.

        Parameters
        ----------
        units : ndarray, shape (2,)
            Factor for each axis.
        """
        return Polygon(self.inner * units, self.outer * units, self.gap, self.limiting)


def enclose(
    touching: Callable[[Array], SupportPoint | None], most: int = POLYGON_SETTINGS.most_directions
) -> Polygon | None:
    """Return inner and outer polygons of a convex set, from its support function.

    Parameters
    ----------
    touching : callable
        Maps a unit direction, shape (2,), to the set's `SupportPoint`; to None if the set is empty.
    most : int, optional
        Largest number of directions to query.

    Returns
    -------
    Polygon or None
        None if the set is empty.

    Raises
    ------
    SolverError
        If the set is empty in one direction and not in another.
    """
    ways = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    first = touching(ways[0])
    if first is None:
        return None
    sides = [first, *(_asked(touching, normal) for normal in ways[1:])]
    lengths = np.array([sides[i].reach + sides[i + 2].reach for i in (0, 1)])
    # by which rounding may move points
    slack = 1e-6 * max(1.0, float(lengths.max()))
    # gap at which polygons count as one, where the set's sides along both axes are the units
    tolerance = 3e-4
    units = np.maximum(lengths, slack / tolerance)
    gaps = [_open_gap(a, b, units) for a, b in pairwise([*sides, sides[0]])]
    while len(sides) < most:
        i = int(np.argmax(gaps))
        before, after = sides[i], sides[(i + 1) % len(sides)]
        normal = _between(before, after)
        if normal is None or gaps[i] <= tolerance:
            break
        side = _asked(touching, normal)
        sides.insert(i + 1, side)
        gaps[i : i + 1] = [_open_gap(before, side, units), _open_gap(side, after, units)]
    pairs = list(pairwise([*sides, sides[0]]))
    corners = np.array([_corner(a, b) for a, b in pairs])
    points = np.array([side.point for side in sides])
    kept = _corners_of(points, slack)
    return Polygon(
        inner=points[kept],
        outer=corners[_corners_of(corners, 0.1 * slack)],
        gap=max(_gap(a, b) for a, b in pairs),
        limiting=tuple(sides[k].limiting for k in kept),
    )


def _asked(touching: Callable[[Array], SupportPoint | None], normal: Array) -> SupportPoint:
    touch = touching(normal)
    if touch is None:
        raise SolverError(
            f"the set has no farthest point toward {normal.tolist()}: the set is empty, or the "
            "solver failed"
        )
    return touch


def _corner(a: SupportPoint, b: SupportPoint) -> Array:
    """Return where the borders of two half-planes meet, shape (2,)."""
    turn = _cross(a.normal, b.normal)
    if turn < POLYGON_SETTINGS.least_turn:
        return a.point
    # along a's border from its point, to b's
    along = np.array([-a.normal[1], a.normal[0]])
    far = float(b.normal @ (b.point - a.point)) / turn
    return np.asarray(a.point + far * along)


def _between(a: SupportPoint, b: SupportPoint) -> Array | None:
    """Return the direction to ask for between two: of the edge's normal, if it is between them."""
    edge = b.point - a.point
    for way in (np.array([edge[1], -edge[0]]), a.normal + b.normal):
        length = float(np.linalg.norm(way))
        if length > 0.0:
            normal = way / length
            turn = min(_cross(a.normal, normal), _cross(normal, b.normal))
            if turn > POLYGON_SETTINGS.least_turn:
                return normal
    return None


def _gap(a: SupportPoint, b: SupportPoint, units: Array | float = 1.0) -> float:
    """Return how far the outer corner between two directions is from the inner edge."""
    return _distance(a.point / units, b.point / units, _corner(a, b) / units)


def _open_gap(a: SupportPoint, b: SupportPoint, units: Array) -> float:
    """Return the gap between two directions, zero where there is none to ask for between them."""
    return 0.0 if _between(a, b) is None else _gap(a, b, units)


def _distance(start: Array, end: Array, point: Array) -> float:
    """Return the distance of a point from a segment."""
    edge = end - start
    square = float(edge @ edge)
    part = min(max(float((point - start) @ edge) / square, 0.0), 1.0) if square > 0.0 else 0.0
    return math.dist(point, start + part * edge)


def _cross(a: Array, b: Array) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


def _corners_of(points: Array, slack: float) -> list[int]:
    """Return which points of a closed convex chain stand out by more than a slack."""
    kept = list(range(len(points)))
    k = 0
    while k < len(kept) and len(kept) > 1:
        before, here, after = (points[kept[(k + j) % len(kept)]] for j in (-1, 0, 1))
        if _distance(before, after, here) <= slack:
            del kept[k]
            k = max(k - 1, 0)
        else:
            k += 1
    return kept
