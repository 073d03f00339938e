"""WrenchSpace: all wrenches that one hand on one hold can exert, as inequalities with named rows.

    { o + V y : L y + l0 ≤ u s,  H y ≤ h }      at utilisation u;   A y ≤ b at u = 1

y are the hand's loads. The views (vertices, half-spaces, support function, …) are of the set at
u = 1. The inequalities of a hand with a fixed wrist couple no finger to another, so the set is a
Minkowski sum of small polytopes, one for each block of coupled columns; the views use that, and
need no double description. Only *wrench rows*, D w ≤ u s, couple all columns: they clip that sum.

Directions and distances that mix forces and moments are taken in *scaled* wrenches, whose moments
are divided by 0.1 m (`WRENCH_SCALE`), so that all six components are newtons.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import (
    BASE_TOLERANCES,
    Array,
    EmptySetError,
    Indices,
    InvalidInputError,
    LimitError,
    finite_vector,
)
from hand_models.wrench_spaces.block_sum import Block, BlockSum, Sizes, coupled_columns
from hand_models.wrench_spaces.clipping import clipped
from hand_models.wrench_spaces.half_spaces import WRENCH_SCALE, Facets, HalfSpaces, lifted
from hand_models.wrench_spaces.linear_programs import ends_along, linear_program
from hand_models.wrench_spaces.polytopes import hull, polytope
from hand_models.wrench_spaces.settings import SETTINGS

__all__ = ["Row", "WrenchSpace"]


class Row(NamedTuple):
    """Name of an inequality of a wrench space: the part and the load that it limits.

    Attributes
    ----------
    finger, phalanx : str or None
        Part that the row concerns; None for the palm, the hand, or a whole finger.
    limit : str
        Name of the limited load.
    kind : {'limit', 'hard'}
    label : str
        Name that is unique in a wrench space.
    joint : str or None
        Joint of the limb that carries the hand, for a limit of that joint.
    """

    finger: str | None
    phalanx: str | None
    limit: str
    kind: Literal["limit", "hard"]
    label: str
    joint: str | None = None


@dataclass(frozen=True, eq=False)
class WrenchSpace:
    """All wrenches on the rock, in the hand's frame H, that a hand can exert.

    Attributes
    ----------
    origin : ndarray, shape (6,)
        o, the wrench at zero load: force and moment [N, N·m].
    generators : ndarray, shape (6, m)
        V, the wrench per unit of each load.
    columns : tuple of str, length m
        Names of the loads y.
    rows : tuple of Row
        Names of the limit rows, then of the hard rows.
    L, l0, s : ndarray, shapes (nl, m), (nl,), (nl,)
        Limit rows: the load ``L y + l0`` against the capacity ``s`` > 0.
    H, h : ndarray, shapes (nh, m), (nh,)
        Hard rows ``H y ≤ h``, whatever the utilisation.
    D : ndarray, shape (nd, 6), optional
        Wrench rows: the last nd limit rows have the load D w (L = D V, l0 = D o). None by default.
    """

    origin: Array
    generators: Array
    columns: tuple[str, ...]
    rows: tuple[Row, ...]
    L: Array
    l0: Array
    s: Array
    H: Array
    h: Array
    D: Array = field(default_factory=lambda: np.zeros((0, 6)))

    def __post_init__(self) -> None:
        m = len(self.columns)
        shapes = {
            "origin": (6,),
            "generators": (6, m),
            "L": (len(self.s), m),
            "l0": (len(self.s),),
            "H": (len(self.h), m),
            "D": (len(self.D), 6),
        }
        for name, shape in shapes.items():
            if getattr(self, name).shape != shape:
                raise InvalidInputError(
                    f"shape {shape} is needed, got {getattr(self, name).shape}", field=name
                )
        if len(self.D) > len(self.s):
            raise InvalidInputError(
                f"must have at most as many rows as s, {len(self.s)}, got {len(self.D)}", field="D"
            )
        if len(self.rows) != len(self.s) + len(self.h):
            count = len(self.s) + len(self.h)
            raise InvalidInputError(f"must name {count} rows, got {len(self.rows)}", field="rows")
        if not (self.s > 0.0).all():
            raise InvalidInputError(
                f"every capacity must be above zero, got {self.s.min():g}", field="s"
            )

    @property
    def A(self) -> Array:
        """Coefficients A of all rows in A y ≤ b at u = 1, limit rows first, shape (nl + nh, m)."""
        return np.vstack([self.L, self.H])

    @property
    def b(self) -> Array:
        """Right-hand sides b of all rows in A y ≤ b at u = 1, limit rows first (nl + nh,)."""
        return np.concatenate([self.s - self.l0, self.h])

    def wrench(self, y: ArrayLike) -> Array:
        """Return the wrench o + V y, shape (6,) [N, N·m], that loads y, shape (m,), exert."""
        return np.asarray(self.origin + self.generators @ np.asarray(y, dtype=float))

    def utilisations(self, y: ArrayLike) -> Array:
        """Return the utilisation (load / capacity) of each limit row (nl,), for loads y (m,)."""
        return np.asarray((self.L @ np.asarray(y, dtype=float) + self.l0) / self.s)

    # Views at u = 1 -----------------------------------------------------------------------------

    @cached_property
    def _coupled(self) -> tuple[tuple[Indices, Array, Array], ...]:
        """Columns that rows couple, and these rows: (indices, A, b) of each block."""
        apart = len(self.s) - len(self.D)
        A = np.vstack([self.L[:apart], self.H])
        b = np.concatenate([(self.s - self.l0)[:apart], self.h])
        used = np.abs(A) > 0.0
        idle = ~used.any(axis=1)
        if (b[idle] < -SETTINGS.tolerance * (1.0 + np.abs(b[idle]))).any():
            raise self._empty()
        # what moves nothing, and nothing holds, adds nothing: a wrist without lateral reactions
        groups = [
            each
            for each in coupled_columns(used)
            if used[:, each].any() or self.generators[:, each].any()
        ]
        if len(groups) == 1:
            # rows of the whole wrench couple nothing that is not coupled already
            A, b, used = self.A, self.b, np.abs(self.A) > 0.0
        mine = [used[:, columns].any(axis=1) for columns in groups]
        return tuple(
            (columns, A[np.ix_(rows, columns)], b[rows])
            for columns, rows in zip(groups, mine, strict=True)
        )

    @property
    def _most_rows(self) -> int:
        """Rows of the largest block of more than two columns; zero without one."""
        return max((len(b) for columns, _, b in self._coupled if len(columns) > 2), default=0)

    @property
    def listed(self) -> bool:
        """True if the blocks of coupled columns have few enough rows to list their vertices."""
        return self._most_rows <= SETTINGS.most_rows

    def _enough(self, blocks: Sequence[Block]) -> tuple[Array, Array]:
        """Return rows that are enough for the set at u = 1, as `A` and `b`."""
        if not self.listed:
            return self.A, self.b
        wide = len(self.s) - len(self.D), len(self.s)
        A, b = [self.L[slice(*wide)]], [self.b[slice(*wide)]]
        for block in blocks:
            A.append(np.zeros((len(block.b), len(self.columns))))
            A[-1][:, block.columns] = block.A
            b.append(block.b)
        return np.vstack(A), np.concatenate(b)

    @cached_property
    def _sum_and_cuts(self) -> tuple[BlockSum, Indices]:
        """The sum of the blocks, and the wrench rows beyond which it reaches."""
        blocks = []
        for columns, A, b in self._coupled:
            vertices, facets = polytope(A, b)
            if not len(vertices):
                raise self._empty(columns)
            blocks.append(Block(columns, vertices, A[facets], b[facets]))
        whole = BlockSum(self.origin, self.generators, blocks)
        slopes = self.D @ self.generators
        reach = self.D @ self.origin
        for columns, vertices, *_ in whole.blocks:
            reach = reach + (slopes[:, columns] @ vertices.T).max(axis=1)
        cuts: Indices = np.flatnonzero(reach > self._held * (1.0 + SETTINGS.tolerance))
        # where the sum reaches least far along the cuts is most often a wrench of the set
        within = not len(cuts) or self._obeys(whole.extreme(-slopes[cuts].sum(axis=0)))
        if not within and self._farthest(np.zeros(6), whole.blocks) is None:
            row = self.rows[len(self.s) - len(self.D) + cuts[0]]
            raise EmptySetError(
                f"the wrench space is empty at utilisation 1: every wrench exceeds {row.limit}"
            )
        return whole, cuts

    @property
    def _sum(self) -> BlockSum:
        """The sum of the blocks, without wrench rows."""
        return self._sum_and_cuts[0]

    @property
    def _cuts(self) -> Indices:
        """Wrench rows beyond which the sum of the blocks reaches."""
        return self._sum_and_cuts[1]

    def _empty(self, columns: Indices | None = None) -> EmptySetError:
        names = "" if columns is None else " of " + ", ".join(self.columns[i] for i in columns)
        return EmptySetError(
            f"the wrench space is empty at utilisation 1: the limits{names} contradict the hard "
            "rows; try another closing_tension, hold or surface"
        )

    @property
    def dimension(self) -> int:
        """Dimension of the set's affine hull at u = 1, from 0 to 6; raises `EmptySetError`."""
        return len(self._sum.axes[1])

    def _obeys(self, y: Array) -> bool:
        """Return True if loads of the sum of the blocks also keep to the wrench rows."""
        return bool((self.D @ self.wrench(y) <= self._held * (1.0 + SETTINGS.tolerance)).all())

    @property
    def _held(self) -> Array:
        """Capacities of the wrench rows, shape (nd,)."""
        return self.s[len(self.s) - len(self.D) :]

    def _farthest(self, direction: Array, blocks: Sequence[Block]) -> Array | None:
        """Return the wrench farthest along d over all rows at u = 1, by linear programming."""
        cost = -(self.generators.T @ direction)
        y = linear_program(cost, *self._enough(blocks), "support", tolerance=BASE_TOLERANCES.force)
        return None if y is None else self.wrench(y)

    @cached_property
    def _clipped(self) -> tuple[Array, Facets]:
        """Vertices (n, r) and facets where wrench rows cut the sum of the blocks."""
        directions, reach = self._sum.axes
        rows, held = self.D[self._cuts] / WRENCH_SCALE, self._held[self._cuts]
        normals = rows @ directions.T * reach
        lengths = np.linalg.norm(normals, axis=1)
        # what is constant on the set, and yet beyond its capacity, is so by rounding
        turns = lengths > SETTINGS.tolerance * held
        room = held - np.asarray(rows @ self._sum.base)
        cuts = Facets(normals[turns] / lengths[turns, None], room[turns] / lengths[turns])
        found = clipped(self._sum.vertices, self._sum.facets, cuts, self._sum.rounding)
        if found is None:
            raise self._empty()
        return found

    def sizes(self) -> Sizes:
        """Return how many candidates `vertices` and `half_spaces` examine, at far less cost.

        Raises
        ------
        EmptySetError
            If the set at u = 1 is empty.
        LimitError
            If the blocks have too many rows to list their vertices.
        """
        if not self.listed:
            raise LimitError(
                f"{self._most_rows} coupled rows are too many (at most {SETTINGS.most_rows}): use "
                "fewer half_planes"
            )
        sizes = self._sum.sizes
        return sizes._replace(half_spaces=max(sizes)) if len(self._cuts) else sizes

    def half_spaces(self) -> HalfSpaces:
        """Return the set at u = 1 as inequalities of the wrench and, where it is flat, equations.

        Raises
        ------
        EmptySetError
            If the set at u = 1 is empty.
        LimitError
            If there are too many candidate vertices (see `sizes`), or rounding hides their edges.
        """
        facets = self._clipped[1] if len(self._cuts) else self._sum.facets
        scaled = lifted(facets, *self._sum.axes, self._sum.base)
        return scaled._replace(
            normals=scaled.normals * WRENCH_SCALE,
            equation_normals=scaled.equation_normals * WRENCH_SCALE,
        )

    def vertices(self) -> Array:
        """Return the vertices (n, 6) of the set at u = 1 [N, N·m]; raises as `half_spaces`."""
        directions, reach = self._sum.axes
        return np.asarray(((self._vertices * reach) @ directions + self._sum.base) / WRENCH_SCALE)

    @property
    def _vertices(self) -> Array:
        """Vertices (n, r) in the coordinates of `BlockSum.axes`, about `BlockSum.base`."""
        return self._clipped[0] if len(self._cuts) else self._sum.vertices

    def support(self, direction: ArrayLike) -> float:
        """Return the support function max { d · w } at u = 1, d (6,); raises as `extreme`."""
        return float(finite_vector(direction, 6, "direction") @ self.extreme(direction))

    def extreme(self, direction: ArrayLike) -> Array:
        """Return the wrench w (6,) in the set at u = 1 with the largest d · w, for d of shape (6,).

        Raises
        ------
        EmptySetError
            If the set at u = 1 is empty.
        SolverError
            If a linear program fails.
        """
        d = finite_vector(direction, 6, "direction")
        if self.listed:
            y = self._sum.extreme(self.generators.T @ d)
            if not len(self._cuts) or self._obeys(y):
                return self.wrench(y)
        found = self._farthest(d, self._sum.blocks if self.listed else ())
        if found is None:
            raise self._empty()
        return found

    def contains(self, wrench: ArrayLike, tolerance: float = 1e-6) -> bool:
        """Return True if a wrench is in the set at u = 1, within ``tolerance`` of each face.

        Parameters
        ----------
        wrench : array_like, shape (6,)
            Wrench on the rock, in H [N, N·m].
        tolerance : float, optional
            Distance, with moments divided by 0.1 m (*scaled* wrenches) [N].
        """
        w = finite_vector(wrench, 6, "wrench")
        faces = self.half_spaces()
        beyond = np.max(faces.normals @ w - faces.offsets, initial=-math.inf)
        off = np.max(np.abs(faces.equation_normals @ w - faces.equation_offsets), initial=0.0)
        return bool(max(beyond, off) <= tolerance)

    def capability(self, direction: ArrayLike) -> tuple[float, float] | None:
        """Return the least and the largest t for which the wrench t·d is in the set at u = 1.

        None where the line through zero along d, of shape (6,), misses the set.

        Raises
        ------
        SolverError
            If the linear program fails.
        """
        d = finite_vector(direction, 6, "direction")
        return ends_along(
            d * WRENCH_SCALE,
            self.origin * WRENCH_SCALE,
            self.generators * WRENCH_SCALE[:, None],
            self.A,
            self.b,
        )

    def volume(self) -> tuple[float, int]:
        """Return the volume of the set at u = 1 in its affine hull, and that hull's dimension r.

        The volume is of scaled wrenches [N^r], accurate to about 1e-4 of its value. Sets of
        thousands of vertices take seconds.

        Raises
        ------
        EmptySetError
            If the set at u = 1 is empty.
        SolverError
            If the convex hull of the vertices cannot be found.
        """
        r = self.dimension
        stretch = float(np.prod(self._sum.axes[1]))
        if r == 0:
            return 0.0, 0
        vertices = self._vertices
        if r == 1:
            return float(np.ptp(vertices)) * stretch, 1
        # joggled: merged facets may be so wide in a set of fine facets that volume is lost
        return float(hull(vertices, "QJ").volume) * stretch, r
