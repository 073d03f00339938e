"""The Minkowski sum of a wrench space's blocks: its facets and vertices, without wrench rows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from hand_models.base import Array, Indices, LimitError
from hand_models.wrench_spaces.half_spaces import WRENCH_SCALE, Facets, affine_hull
from hand_models.wrench_spaces.minkowski_sums import (
    Summand,
    about_facets,
    extreme_points,
    facets,
    sum_vertices,
    sums,
)
from hand_models.wrench_spaces.polytopes import hull_facets
from hand_models.wrench_spaces.settings import SETTINGS

__all__ = ["Block", "BlockSum", "Sizes", "coupled_columns"]


class Block(NamedTuple):
    """The polytope { y : A y ≤ b } of a few coupled columns.

    Attributes
    ----------
    columns : ndarray of int, shape (d,)
        Indices of the columns in the wrench space.
    vertices : ndarray, shape (n, d)
        Vertices of the polytope, as loads of these columns.
    A, b : ndarray, shapes (k, d), (k,)
        Rows that are enough to describe the polytope; in more than two columns its facets.
    """

    columns: Indices
    vertices: Array
    A: Array
    b: Array


def coupled_columns(used: NDArray[np.bool_]) -> list[Indices]:
    """Group columns that rows couple, directly or through others (connected components).

    Parameters
    ----------
    used : ndarray of bool, shape (k, m)
        True where a row has a coefficient for a column.

    Returns
    -------
    list of ndarray of int
        Column indices of each group.
    """
    if not used.shape[1]:
        return []
    incidence = scipy.sparse.csr_array((used.T.astype(int) @ used.astype(int)) > 0)
    count, labels = scipy.sparse.csgraph.connected_components(incidence, directed=False)
    return [np.flatnonzero(labels == label) for label in range(count)]


class Sizes(NamedTuple):
    """Numbers of candidate vertices and half-spaces of a set, known before they are computed.

    Attributes
    ----------
    vertices : int
        Number of candidates; some of them are vertices.
    half_spaces : int
        Approximate number of half-spaces; where wrench rows clip the set, the number of
        candidate vertices if that is larger.
    """

    vertices: int
    half_spaces: int


class BlockSum:
    """Minkowski sum of the polytopes of blocks, each mapped to wrenches by V.

    *Scaled* wrenches have their moments divided by 0.1 m (`WRENCH_SCALE`): all components in N.

    Parameters
    ----------
    origin : ndarray, shape (6,)
        o, the wrench at zero load [N, N·m].
    generators : ndarray, shape (6, m)
        V, the wrench per unit of each load.
    blocks : sequence of Block
        Blocks of the wrench space; each column is in one block at most.

    Attributes
    ----------
    axes : tuple of ndarray, shapes (r, 6), (r,)
        Axes of the coordinates in which facets and vertices are found (by singular values):
        orthonormal directions of the affine hull, in scaled wrenches, and the reach, the size of
        the blocks' edges along each of them [N]. A coordinate is the product with a direction,
        divided by the reach.
    """

    def __init__(self, origin: Array, generators: Array, blocks: Sequence[Block]) -> None:
        self.origin, self.generators, self.blocks = origin, generators, blocks
        images = [
            ((vertices @ generators[:, columns].T) * WRENCH_SCALE, len(columns))
            for columns, vertices, *_ in blocks
        ]
        self._summands = [extreme_points(*each) for each in images]
        edges = [s.points[1:] - s.points[0] for s in self._summands if s.dimension]
        self.axes = affine_hull(np.vstack([np.zeros((0, 6)), *edges]))

    @property
    def base(self) -> Array:
        """A scaled wrench of the set, shape (6,) [N]: the origin of coordinates along `axes`."""
        start = self.origin * WRENCH_SCALE
        return np.asarray(sum((summand.points[0] for summand in self._summands), start=start))

    @property
    def sizes(self) -> Sizes:
        """Numbers of candidate vertices and half-spaces of the sum, from the blocks alone."""
        parts, r = [s for s in self._summands if s.dimension], len(self.axes[1])
        candidates = math.prod(len(part.points) for part in parts)
        if self._whole is not None:
            return Sizes(candidates, len(self._whole.b))
        if all(part.dimension <= 2 for part in parts):
            return Sizes(candidates, about_facets(parts, r))
        # as many as a hull of so many points can have
        return Sizes(candidates, candidates ** (r // 2))

    def _parts(self) -> list[Summand]:
        """Return the summands of more than a point, about `base`, in the coordinates of `axes`."""
        directions, reach = self.axes
        summands = [s for s in self._summands if s.dimension]
        candidates = math.prod(len(s.points) for s in summands)
        most = 500_000  # that many take some 20 s
        if candidates > most:
            raise LimitError(
                f"{candidates} candidate vertices are too many (at most {most}): "
                "use fewer half_planes, or a grasp without lateral loads (lateral false)"
            )
        return [
            Summand((s.points - s.points[0]) @ directions.T / reach, s.dimension) for s in summands
        ]

    @property
    def _whole(self) -> Block | None:
        """The block of more than two columns of which the sum is the one to one image, if any."""
        own = [
            block
            for block, summand in zip(self.blocks, self._summands, strict=True)
            if summand.dimension
        ]
        alone = len(own) == 1 and 2 < len(own[0].columns) == len(self.axes[1])
        return own[0] if alone else None

    @property
    def rounding(self) -> float:
        """Largest distance by which rounding may move a point, in coordinates along `axes`.

        The distance is larger for a thin set.
        """
        reach = self.axes[1]
        return max(SETTINGS.tolerance, 16.0 * np.finfo(float).eps * float(reach[0] / reach[-1]))

    def extreme(self, slopes: Array) -> Array:
        """Return the loads with the largest product slopes · y over the sum (support mapping).

        Parameters
        ----------
        slopes : ndarray, shape (m,)
            Coefficient of each load.

        Returns
        -------
        ndarray, shape (m,)
            Loads y.
        """
        y = np.zeros(self.generators.shape[1])
        for columns, vertices, *_ in self.blocks:
            y[columns] = vertices[(vertices @ slopes[columns]).argmax()]
        return y

    @cached_property
    def facets(self) -> Facets:
        """Facets of the sum, in coordinates along `axes` about `base`.

        Raises
        ------
        LimitError
            If the sum has too many candidate vertices.
        """
        parts, r = self._parts(), len(self.axes[1])
        if r == 0:
            return Facets(np.zeros((0, 0)), np.zeros(0))
        if self._whole is not None:
            directions, reach = self.axes
            own = self.generators[:, self._whole.columns] * WRENCH_SCALE[:, None]
            image = directions @ own / reach[:, None]
            normals = np.linalg.solve(image.T, self._whole.A.T).T
            normals /= np.linalg.norm(normals, axis=1)[:, None]
            return Facets(normals, (normals @ parts[0].points.T).max(axis=1))
        if all(part.dimension <= 2 for part in parts):
            return facets(parts, r, self.rounding)
        return Facets(*hull_facets(sums(parts)))

    @property
    def vertices(self) -> Array:
        """Vertices of the sum, shape (n, r), in coordinates along `axes` about `base`.

        Raises
        ------
        LimitError
            If the sum has too many candidate vertices.
        """
        parts = self._parts()
        if not parts:
            return np.zeros((1, 0))
        if len(parts) == 1:
            return parts[0].points
        return sum_vertices(parts, *self.facets, self.rounding)
