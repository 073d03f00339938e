"""The floating-wrist wrench space by search over poses of the wrist (Fig. 9).

A grid of poses is tried, those at which nothing lets go are kept, and the hull of their wrenches is
the wrench space. As in the paper the search space is first reduced (`wrist_box`). The outermost
poses are then pushed along rays from the middle until something lets go, so that the hull's corners
lie on the boundary, and each tells which phalanx of which finger fails there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull, QhullError
from scipy.special import ndtri
from scipy.stats import qmc

from hand_models.base import Array, EmptySetError, Indices, InvalidInputError, Progress
from hand_models.compliance.grasp import CompliantGrasp
from hand_models.compliance.pose_box import SearchBox, search_box
from hand_models.wrench_spaces import SCALE, Row

__all__ = ["PLANAR", "WristSearch", "boundary", "search"]

PLANAR: Final = (0, 2, 4)
"""Components F_x, F_z, M_y of a wrench, of a grasp that moves in a plane."""

CHUNK: Final = 50_000
"""Poses that are evaluated at once."""

GROWTHS: Final = 6
"""How often a ray is lengthened at most until something lets go."""

HALVINGS: Final = 30
"""Of the rays' lengths."""

EXTREMES: Final = 1024
"""Directions in which extreme wrenches are kept where a full hull would be too large."""

FEWEST: Final = 2
"""Poses per axis of a grid."""


@dataclass(frozen=True, eq=False)
class WristSearch:
    """The wrenches found.

    Attributes
    ----------
    box : SearchBox
    tried, held : int
        Poses of the grid; those of them at which nothing lets go.
    poses, wrenches : ndarray, shapes (n, d) and (n, 6)
        On the boundary: extreme wrenches, and where the wrist is then [m, rad, N, N·m].
    limiting : tuple of Row, length n
        What lets go there first.
    components : tuple of int
        Of a wrench, those that the grasp's poses span.
    """

    box: SearchBox
    tried: int
    held: int
    poses: Array
    wrenches: Array
    limiting: tuple[Row | None, ...]
    components: tuple[int, ...]

    @cached_property
    def hull(self) -> ConvexHull:
        """The hull of the wrenches, in newtons (moments over a length, `SCALE`).

        Raises
        ------
        EmptySetError
            If the wrenches span no volume.
        """
        components = list(self.components)
        try:
            return ConvexHull(self.wrenches[:, components] * SCALE[components])
        except QhullError:
            raise EmptySetError(
                f"the {len(self.wrenches)} wrenches found span no volume: try more poses per axis"
            ) from None

    def support(self, direction: ArrayLike) -> float:
        """Return max { d · w } over the hull, d of shape (6,)."""
        return float((self.wrenches @ np.asarray(direction, dtype=float)).max())


def search(grasp: CompliantGrasp, per_axis: int, progress: Progress | None = None) -> WristSearch:
    """Return the wrench space found by a grid of poses.

    Parameters
    ----------
    grasp : CompliantGrasp
    per_axis : int
        Poses along each axis.
    progress : callable, optional
        Told how many poses are done, of how many.

    Raises
    ------
    EmptySetError
        If no pose of the grid holds.
    InvalidInputError
        If there are fewer than two poses along an axis.
    """
    if per_axis < FEWEST:
        raise InvalidInputError(f"must be at least {FEWEST}, got {per_axis}", field="per_axis")
    box = search_box(grasp)
    d = len(box.centre)
    components = PLANAR if d == len(PLANAR) else tuple(range(6))
    total = per_axis**d
    extremes = _Extremes(components)
    held = 0
    for start in range(0, total, CHUNK):
        if progress is not None:
            progress(start, total)
        t = box.grid(per_axis, start, min(start + CHUNK, total))
        t = t[grasp.sieve(box.poses(t))]
        found = grasp.evaluate(box.poses(t))
        good = found.holds
        held += int(good.sum())
        extremes.add(t[good], found.wrenches[good])
    if progress is not None:
        progress(total, total)
    if not held:
        raise EmptySetError(f"none of {total} poses of the wrist holds")
    return _pushed(grasp, box, extremes.coordinates(), total, held, components)


class _Extremes:
    """The outermost of wrenches that come in chunks: corners of their hull, or many of them."""

    def __init__(self, components: tuple[int, ...]) -> None:
        self._components = list(components)
        self._directions = _sphere(EXTREMES, len(components)) if len(components) > 3 else None
        self._t: list[Array] = []
        self._wrenches: list[Array] = []

    def add(self, t: Array, wrenches: Array) -> None:
        """Take the outermost of some more."""
        scaled = (wrenches * SCALE)[:, self._components]
        if self._directions is not None:
            some = _outermost(scaled, self._directions)
        else:
            some = _corners(scaled)
        self._t.append(t[some])
        self._wrenches.append(scaled[some])

    def coordinates(self) -> Array:
        """Return the coordinates of the outermost."""
        t, scaled = np.concatenate(self._t), np.concatenate(self._wrenches)
        if self._directions is None:
            return t[_corners(scaled)]
        return t[_outermost(scaled, self._directions)]


def _corners(points: Array) -> Indices:
    """Return which points are corners of their hull; all where they span no volume."""
    if len(points) <= points.shape[1]:
        return np.arange(len(points))
    try:
        return np.asarray(ConvexHull(points).vertices, dtype=np.intp)
    except QhullError:
        return np.arange(len(points))


def _outermost(points: Array, directions: Array) -> Indices:
    """Return which points are farthest in some direction."""
    if not len(points):
        return np.zeros(0, dtype=np.intp)
    return np.unique([int((points @ d).argmax()) for d in directions]).astype(np.intp)


def boundary(grasp: CompliantGrasp, box: SearchBox, rays: int) -> WristSearch:
    """Return the wrench space by rays from the middle of a box, evenly spread over its axes.

    Finer than a grid of as many poses where the poses that hold are seen from the middle.
    """
    d = len(box.centre)
    components = PLANAR if d == len(PLANAR) else tuple(range(6))
    t = _sphere(rays, d) * box.range
    return _pushed(grasp, box, t, 0, 0, components)


def _pushed(
    grasp: CompliantGrasp,
    box: SearchBox,
    corners: Array,
    tried: int,
    held: int,
    components: tuple[int, ...],
) -> WristSearch:
    """Return the boundary poses on the rays through some coordinates."""
    t, exceeded = _to_boundary(grasp, box, corners)
    poses = box.poses(t)
    wrenches = grasp.evaluate(poses).wrenches
    names = grasp.limits
    limiting = tuple(names[int(i)] if i >= 0 else None for i in exceeded)
    return WristSearch(box, tried, held, poses, wrenches, limiting, components)


def _to_boundary(grasp: CompliantGrasp, box: SearchBox, t: Array) -> tuple[Array, Indices]:
    """Push coordinates along rays from the middle until something lets go.

    Returns
    -------
    t : ndarray, shape (n, d)
        The last that hold.
    limiting : ndarray of int, shape (n,)
        The limit row that is exceeded beyond; −1 where it is a hard row or a phalanx lost its
        rock.
    """
    low = np.zeros(len(t))
    high = np.ones(len(t))
    for _ in range(GROWTHS):
        holds = grasp.evaluate(box.poses(t * high[:, None])).holds
        if not holds.any():
            break
        low = np.where(holds, high, low)
        high = np.where(holds, 1.5 * high, high)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        holds = grasp.evaluate(box.poses(t * middle[:, None])).holds
        low, high = np.where(holds, middle, low), np.where(holds, high, middle)
    beyond = grasp.evaluate(box.poses(t * high[:, None]))
    named = np.isfinite(beyond.utilisation) & (beyond.utilisation > 1.0)
    limiting = np.where(named, beyond.limiting, -1)
    return t * low[:, None], limiting


def _sphere(n: int, d: int) -> Array:
    """Return n unit vectors in d dimensions, evenly spread and always the same."""
    uniform = qmc.Halton(d, scramble=False).random(n + 1)[1:]
    normal = ndtri(np.clip(uniform, 1e-12, 1.0 - 1e-12))
    return np.asarray(normal / np.linalg.norm(normal, axis=1, keepdims=True))
