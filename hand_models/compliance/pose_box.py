"""Box in which the poses of a compliant grasp's wrist are searched.

Its axes are those of an ellipsoid about the set linearised at rest. Its range along each axis is
that of the linearised set, or is adapted by sparse grids until the box just covers the feasible
poses (the reduction of the search space of Fig. 9).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hand_models.base import BASE_TOLERANCES, Array, EmptySetError, SolverError
from hand_models.compliance.directional_limit import pose_units
from hand_models.compliance.grasp import CompliantGrasp
from hand_models.wrench_spaces import WrenchSpace, linear_program

__all__ = ["SearchBox", "linear_box", "search_box"]


@dataclass(frozen=True, eq=False)
class SearchBox:
    """Box of poses ``centre + axes · t`` with ``|t_i| ≤ range_i``, coordinates t of shape (d,).

    Attributes
    ----------
    centre : ndarray, shape (d,)
        A pose within every limit [m, rad].
    axes : ndarray, shape (d, d)
        One column for each axis of the box [m, rad].
    range : ndarray, shape (d,)
        Largest size of the coordinate along each axis.
    """

    centre: Array
    axes: Array
    range: Array

    def poses(self, t: Array) -> Array:
        """Return the m poses of the wrist at coordinates ``t``, both of shape (m, d)."""
        return np.asarray(self.centre + t @ self.axes.T)

    def grid(self, per_axis: int, start: int, end: int) -> Array:
        """Return coordinates t of some poses of a regular grid over the box.

        Parameters
        ----------
        per_axis : int
            Poses along each axis.
        start, end : int
            First pose to return, and the one after the last, as indices among the
            ``per_axis ** d`` poses of the grid.

        Returns
        -------
        ndarray, shape (end − start, d)
        """
        d = len(self.centre)
        numbers = np.unravel_index(np.arange(start, end), (per_axis,) * d)
        steps = np.stack(numbers, axis=-1) * (2.0 / (per_axis - 1)) - 1.0
        return np.asarray(steps * self.range)


def linear_box(grasp: CompliantGrasp) -> SearchBox:
    """Return the box about a grasp's set linearised at rest: axes of its ellipsoid, its ranges.

    The ellipsoid is that of Dikin about the set's analytic centre. If neither this centre nor rest
    is within every limit, the set is linearised about the centre, up to six times.

    Raises
    ------
    EmptySetError
        If no pose near rest is within every limit.
    SolverError
        If the linearised set has no centre.
    """
    at = np.zeros(len(grasp.columns))
    for _ in range(6):  # linearised again, until its middle holds
        space, centre, axes = _ellipsoid(grasp, at)
        holds = grasp.evaluate(np.stack([centre, at])).holds
        if holds.any():
            at = centre if holds[0] else at
            return SearchBox(at, axes, _range(space, at, axes))
        at = centre
    raise _nothing_holds()


def search_box(grasp: CompliantGrasp) -> SearchBox:
    """Return the `linear_box` of a grasp, its ranges adapted to feasible poses by sparse grids.

    Raises
    ------
    EmptySetError
        If no pose near rest is within every limit.
    SolverError
        If the linearised set has no centre.
    """
    box = linear_box(grasp)
    centre = box.centre
    # odd grids: the middle is among their poses, and it holds
    per_axis = {3: 13, 6: 5}[len(centre)]  # by how many axes there are
    for _ in range(6):
        t = box.grid(per_axis, 0, per_axis ** len(centre))
        t = t[grasp.sieve(box.poses(t))]
        held = t[grasp.evaluate(box.poses(t)).holds]
        step = 2.0 * box.range / (per_axis - 1)
        outermost = np.abs(held).max(axis=0)
        # a layer more than holds: outward while the outermost holds, inward where none does
        wanted = np.minimum(outermost + step, 1.5 * box.range)
        settled = bool((np.abs(wanted - box.range) <= 0.5 * step).all())
        box = SearchBox(box.centre, box.axes, wanted)
        if settled:
            break
    return box


def _ellipsoid(grasp: CompliantGrasp, at: Array) -> tuple[WrenchSpace, Array, Array]:
    """Return the set linearised at a pose, its analytic centre and Dikin ellipsoid's axes.

    A set that no limit ends in some direction is kept within 20 `pose_units`.

    Raises
    ------
    EmptySetError
        If there is no point inside.
    """
    space = grasp.linearised(at)
    units = pose_units(space.columns)
    found = _analytic_centre(space.A * units, space.b)
    if found is None:
        # the largest motion that is looked at where no limit ends it, as it loads nothing
        space = grasp.linearised(at, within=20.0 * units)
        found = _analytic_centre(space.A * units, space.b)
    if found is None:
        raise SolverError(
            "no centre of the wrist poses within the limits found: try another preload"
        )
    y, hessian = found
    lengths, directions = np.linalg.eigh(hessian)
    return space, y * units, units[:, None] * directions / np.sqrt(lengths)


def _analytic_centre(A: Array, b: Array) -> tuple[Array, Array] | None:
    """Return the y with the least −Σ log(b − A y) and its second derivatives; None without a least.

    By damped Newton steps from the centre of the largest ball inside; every row counts alike.

    Raises
    ------
    EmptySetError
        If there is no point inside.
    """
    size = np.linalg.norm(A, axis=1)
    if (b[size == 0.0] < 0.0).any():
        raise _nothing_holds()
    keep = size > 0.0
    A, b = A[keep] / size[keep, None], b[keep] / size[keep]
    d = A.shape[1]
    ball = linear_program(
        np.append(np.zeros(d), -1.0),
        np.column_stack([A, np.ones(len(b))]),
        b,
        "search",
        bounds=[(None, None)] * d + [(None, 1e3)],
    )
    if ball is None or not ball[-1] > 0.0:
        raise _nothing_holds()
    y, hessian, decrement = ball[:-1], np.eye(d), np.inf
    for _ in range(50):  # steps of Newton's method
        gap = b - A @ y
        gradient = A.T @ (1.0 / gap)
        hessian = (A / gap[:, None] ** 2).T @ A
        if not np.linalg.cond(hessian) < 1e12:  # or as good as singular
            return None
        step = -np.linalg.solve(hessian, gradient)
        decrement = math.sqrt(max(-float(gradient @ step), 0.0))
        y = y + step / (1.0 + decrement)
        if decrement < BASE_TOLERANCES.relative:
            break
    # good enough where rounding keeps it from being better
    return (y, hessian) if decrement < 1e-3 else None


def _range(space: WrenchSpace, centre: Array, axes: Array) -> Array:
    """Return how far the linearised set reaches along each axis from the centre."""
    A, b = space.A @ axes, space.b - space.A @ centre
    reach = np.full(len(centre), -np.inf)
    for way in np.vstack([np.eye(len(centre)), -np.eye(len(centre))]):
        end = linear_program(-way, A, b, "search")
        if end is None:
            raise _nothing_holds()
        reach = np.where(way != 0.0, np.maximum(reach, way * end), reach)
    return reach


def _nothing_holds() -> EmptySetError:
    return EmptySetError(
        "no wrist pose near rest is within every limit, as when the preload alone exceeds one; try "
        "another preload"
    )
