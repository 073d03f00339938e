"""Wrench space of a compliant wrist by grid search over poses of the wrist (Fig. 9).

A grid of poses is tried, those within every limit are kept, and the convex hull of their wrenches
is the wrench space. As in the paper the search space is first reduced (`search_box`). The outermost
poses are then pushed along rays from the middle until a limit is exceeded, so that the hull's
corners are on the boundary, and each names the phalanx and the finger whose limit it is.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import scipy
from numpy.typing import ArrayLike

from hand_models.base import Array, EmptySetError, Indices, InvalidInputError, Progress
from hand_models.compliance.grasp import CompliantGrasp
from hand_models.compliance.pose_box import SearchBox, search_box
from hand_models.wrench_spaces import WRENCH_SCALE, Row

__all__ = ["PLANAR_COMPONENTS", "WristSearch", "boundary", "search_grid"]

PLANAR_COMPONENTS: Final = (0, 2, 4)
"""Indices of F_x, F_z and M_y in a wrench: the components of a grasp that moves in a plane."""


@dataclass(frozen=True, eq=False)
class WristSearch:
    """Boundary of a wrench space, found by search over poses of the wrist.

    Attributes
    ----------
    box : SearchBox
        Box of poses that was searched.
    tried, held : int
        Count of the grid's poses, and of those within every limit.
    poses, wrenches : ndarray, shapes (n, d) and (n, 6)
        Poses of the wrist on the boundary [m, rad], and the wrenches on the rock there [N, N·m].
    limiting : tuple of Row or None, length n
        Limit that is exceeded just beyond each pose; None for a hard row or a phalanx without rock.
    """

    box: SearchBox
    tried: int
    held: int
    poses: Array
    wrenches: Array
    limiting: tuple[Row | None, ...]

    @property
    def hull(self) -> scipy.spatial.ConvexHull:
        """Convex hull of the wrenches [N], moments divided by a length (`WRENCH_SCALE`).

        Raises
        ------
        EmptySetError
            If the wrenches span no volume.
        """
        components = _components(self.poses.shape[1])
        try:
            return scipy.spatial.ConvexHull(self.wrenches[:, components] * WRENCH_SCALE[components])
        except scipy.spatial.QhullError:
            raise EmptySetError(
                f"the {len(self.wrenches)} wrenches found span no volume: raise per_axis, "
                f"which is {round(self.tried ** (1.0 / self.poses.shape[1]))}"
            ) from None

    def support(self, direction: ArrayLike) -> float:
        """Return the support function of the convex hull: the largest d · w over its wrenches w.

        ``direction``: d, shape (6,).
        """
        return float((self.wrenches @ np.asarray(direction, dtype=float)).max())


def search_grid(
    grasp: CompliantGrasp, per_axis: int, progress: Progress | None = None
) -> WristSearch:
    """Return the wrench space of a grasp by grid search over poses of its wrist.

    Parameters
    ----------
    grasp : CompliantGrasp
    per_axis : int
        Poses along each axis of the box, at least 2.
    progress : callable, optional
        Called with (poses done, poses in all).

    Raises
    ------
    EmptySetError
        If no pose of the grid is within every limit.
    InvalidInputError
        If ``per_axis`` is below 2.
    """
    if per_axis < 2:
        raise InvalidInputError(f"must be at least 2, got {per_axis}", field="per_axis")
    box = search_box(grasp)
    total = per_axis ** len(box.centre)
    components = _components(len(box.centre))
    # of those extreme wrenches are kept where a full hull would be too large
    many = len(components) > len(PLANAR_COMPONENTS)
    directions = _sphere(1024, len(components)) if many else None
    outermost, wrenches = np.zeros((0, len(box.centre))), np.zeros((0, 6))
    held = 0
    at_once = 50_000  # poses that are evaluated together
    for start in range(0, total, at_once):
        if progress is not None:
            progress(start, total)
        t = box.grid(per_axis, start, min(start + at_once, total))
        t = t[grasp.sieve(box.poses(t))]
        found = grasp.evaluate(box.poses(t))
        held += int(found.holds.sum())
        outermost = np.vstack([outermost, t[found.holds]])
        wrenches = np.vstack([wrenches, found.wrenches[found.holds]])
        some = _extremes((wrenches * WRENCH_SCALE)[:, components], directions)
        outermost, wrenches = outermost[some], wrenches[some]
    if progress is not None:
        progress(total, total)
    if not held:
        raise EmptySetError(
            f"none of {total} wrist poses of the grid is within every limit: raise per_axis, "
            f"which is {per_axis}, or try another preload"
        )
    return _pushed(grasp, box, outermost, total, held)


def _components(d: int) -> list[int]:
    """Return the components of a wrench that poses of so many components span."""
    return list(PLANAR_COMPONENTS) if d == len(PLANAR_COMPONENTS) else list(range(6))


def _extremes(points: Array, directions: Array | None) -> Indices:
    """Return which points are farthest in some direction, or else corners of their hull.

    All where they span no volume.
    """
    if directions is not None and len(points):
        return np.unique([int((points @ d).argmax()) for d in directions]).astype(np.intp)
    if len(points) > points.shape[1]:
        with contextlib.suppress(scipy.spatial.QhullError):
            return np.asarray(scipy.spatial.ConvexHull(points).vertices, dtype=np.intp)
    return np.arange(len(points))


def boundary(
    grasp: CompliantGrasp, box: SearchBox, rays: int, toward: Array | None = None
) -> WristSearch:
    """Return the boundary of a wrench space by rays of poses from the middle of a box.

    The rays are evenly spread over the box's axes. They find the boundary more finely than a grid
    of as many poses, if every feasible pose is visible from the middle of the box.

    Parameters
    ----------
    grasp : CompliantGrasp
    box : SearchBox
        Box of wrist poses.
    rays : int
        Number of rays.
    toward : ndarray, shape (k, 6), optional
        Directions of the wrench to refine: three rounds of further rays, ever closer about the two
        rays that reach farthest in each direction.
    """
    d = len(box.centre)
    ways = _sphere(rays, d)
    found = _pushed(grasp, box, ways * box.range, 0, 0)
    if toward is None:
        return found
    # nine rays about each of the two that reach farthest, each round from nearer
    closest, nearer, about = 2, 0.4, _sphere(9, d)
    for round_ in range(3):
        reaches = found.wrenches @ toward.T
        best = np.unique(np.argpartition(-reaches, closest, axis=0)[:closest])
        more = (ways[best][:, None, :] + nearer ** (round_ + 1) * about).reshape(-1, d)
        more /= np.linalg.norm(more, axis=1, keepdims=True)
        near = _pushed(grasp, box, more * box.range, 0, 0)
        ways = np.vstack([ways, more])
        found = replace(
            found,
            poses=np.vstack([found.poses, near.poses]),
            wrenches=np.vstack([found.wrenches, near.wrenches]),
            limiting=found.limiting + near.limiting,
        )
    return found


def _pushed(grasp: CompliantGrasp, box: SearchBox, t: Array, tried: int, held: int) -> WristSearch:
    """Return the last poses that hold on rays from the middle through some coordinates.

    What lets go beyond is None where it is a hard row, or a phalanx lost its rock.
    """
    low = np.zeros(len(t))
    high = np.ones(len(t))
    for _ in range(6):  # until something lets go
        holds = grasp.evaluate(box.poses(t * high[:, None])).holds
        if not holds.any():
            break
        low = np.where(holds, high, low)
        high = np.where(holds, 1.5 * high, high)
    for _ in range(30):  # halvings
        middle = 0.5 * (low + high)
        holds = grasp.evaluate(box.poses(t * middle[:, None])).holds
        low, high = np.where(holds, middle, low), np.where(holds, high, middle)
    beyond = grasp.evaluate(box.poses(t * high[:, None]))
    named = np.isfinite(beyond.utilisation) & (beyond.utilisation > 1.0)
    limiting = tuple(
        grasp.limits[i] if known else None for i, known in zip(beyond.limiting, named, strict=True)
    )
    poses = box.poses(t * low[:, None])
    return WristSearch(box, tried, held, poses, grasp.evaluate(poses).wrenches, limiting)


def _sphere(n: int, d: int) -> Array:
    """Return n unit vectors in d dimensions, evenly spread and always the same."""
    uniform = scipy.stats.qmc.Halton(d, scramble=False).random(n + 1)[1:]
    normal = scipy.special.ndtri(np.clip(uniform, 1e-12, 1.0 - 1e-12))
    return np.asarray(normal / np.linalg.norm(normal, axis=1, keepdims=True))
