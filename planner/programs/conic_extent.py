"""What a query fills of a program that has room for more: its own conic program, and no more.

A program is compiled with room for so many loads and rows of each hand, and serves every stance
that fits in. A stance's arrays go to the first rows and columns of their parameters. What is
beyond is not there: its columns and rows are left out of the data that a solver gets, which are to
the last bit those of the program compiled for that stance alone.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from typing import Any, NamedTuple

import clarabel
import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

from hand_models.base import Array, Indices
from planner.programs.cvxpy_internals import Affine, ConeMap, Positions

__all__ = ["Extent", "Layout", "PaddedProgram", "Part"]

Mask = npt.NDArray[np.bool_]


class Extent(NamedTuple):
    """How much there is of a program's vectors: so many of their first entries.

    Attributes
    ----------
    variables, constraints : tuple of int
        Of those whose values and multipliers are wanted.
    given : hashable
        What the sizes of the parameters' values depend on.
    """

    variables: tuple[int, ...]
    constraints: tuple[int, ...]
    given: Hashable


class Kept(NamedTuple):
    """Which of some there are, their numbers among these, and how many there are."""

    mask: Mask
    numbers: Indices
    total: int

    @classmethod
    def of(cls, mask: Mask) -> Kept:
        """Count them."""
        numbers = mask.cumsum() - 1
        return cls(mask, numbers, int(numbers[-1]) + 1 if len(mask) else 0)


ONE = Kept.of(np.ones(1, dtype=bool))
"""The column of a vector."""


class AffineEntries:
    """Numbers that are affine in p, each a row of a sparse matrix times p.

    Parameters
    ----------
    data : ndarray
    index, indptr : ndarray of int
        Of that matrix, in compressed rows.
    width : int
        Length of p; its last is 1.
    """

    def __init__(self, data: Array, index: Indices, indptr: Indices, width: int) -> None:
        self._data, self._index, self._indptr, self._width = data, index, indptr, width
        counts = np.diff(indptr)
        self._rows = np.repeat(np.arange(len(counts)), counts)
        # mostly each is one of p, or a constant: then there is nothing to add up
        single = len(data) == len(counts) and bool((counts == 1).all())
        self._sum = None if single else sp.csr_array((data, index, indptr), (len(counts), width))

    @classmethod
    def of(cls, values: Any) -> AffineEntries:
        """Take a sparse matrix over, in compressed rows."""
        return cls(values.data, values.indices, values.indptr, values.shape[1])

    def __len__(self) -> int:
        return len(self._indptr) - 1

    @property
    def own(self) -> Indices:
        """Which of p they depend on, but for the constant."""
        found = np.unique(self._index)
        return np.asarray(found[found < self._width - 1])

    @property
    def constant(self) -> Mask:
        """Which have a constant part."""
        return self._some(self._index == self._width - 1)

    def there(self, filled: Mask) -> Mask:
        """Return which depend on anything that is there of p."""
        return self._some(filled[self._index])

    def at(self, p: Array) -> Array:
        """Return the numbers for the values p."""
        if self._sum is None:
            return np.asarray(self._data * p.take(self._index))
        return np.asarray(self._sum @ p)

    def chosen(self, kept: Mask, filled: Kept | None = None) -> AffineEntries:
        """Return some of them, of what is there of p."""
        hit = kept if self._sum is None else kept[self._rows]
        if filled is not None:
            hit = hit & filled.mask[self._index]
        index, width = self._index[hit], self._width
        if filled is not None:
            index, width = filled.numbers[index], filled.total
        counts = np.bincount(self._rows[hit], minlength=len(self))[kept]
        return AffineEntries(self._data[hit], index, np.append(0, np.cumsum(counts)), width)

    def _some(self, hit: Mask) -> Mask:
        """Return of which any summand is hit."""
        if self._sum is None:
            return hit
        return np.asarray(np.bincount(self._rows[hit], minlength=len(self)) > 0)


class Part(NamedTuple):
    """A matrix in compressed columns, or a vector of all its entries.

    Attributes
    ----------
    entries : AffineEntries
    rows, columns : ndarray of int
        Of the entries, column by column.
    shape : tuple of int
    """

    entries: AffineEntries
    rows: Indices
    columns: Indices
    shape: tuple[int, int]

    @classmethod
    def of(cls, affine: Affine) -> Part:
        """Take a part of CVXPY's data over."""
        columns = np.repeat(np.arange(affine.shape[1]), np.diff(affine.indptr))
        return cls(AffineEntries.of(affine.values), affine.indices, columns, affine.shape)

    def matrix(self, p: Array) -> Any:
        """Return it as a sparse matrix for the values p."""
        starts = np.searchsorted(self.columns, np.arange(self.shape[1] + 1))
        return sp.csc_matrix((self.entries.at(p), self.rows, starts), shape=self.shape)

    def without_zeros(self, p: Array) -> Part:
        """Return it without the entries that are zero for p."""
        # an entry with a constant part may be zero by chance alone
        kept = self.entries.constant | (self.entries.at(p) != 0.0)
        return Part(self.entries.chosen(kept), self.rows[kept], self.columns[kept], self.shape)

    def within(self, rows: Kept, columns: Kept, filled: Kept) -> Part:
        """Return what is there of it; of a vector all that is left, zero or not."""
        kept = rows.mask[self.rows] & columns.mask[self.columns]
        if columns is not ONE:
            kept &= self.entries.there(filled.mask)
        return Part(
            self.entries.chosen(kept, filled),
            rows.numbers[self.rows[kept]],
            columns.numbers[self.columns[kept]],
            (rows.total, columns.total),
        )


class Layout(NamedTuple):
    """The conic program of an extent.

    Attributes
    ----------
    size : int
        Of its p.
    places : tuple of slice
        Where each parameter's values are in p, column by column.
    shapes : tuple of tuple of int
        Of these values.
    P, q, A, b, d : Part
    cones : list
        Of Clarabel.
    sign : float
        −1 where the problem maximises.
    variables, constraints : Positions
        Of those that are wanted.
    shaping : ndarray of int
        Entries of p that A may depend on.
    touched : tuple of tuple of str
        Names of the parts that may depend on each parameter.
    """

    size: int
    places: tuple[slice, ...]
    shapes: tuple[tuple[int, ...], ...]
    P: Part
    q: Part
    A: Part
    b: Part
    d: Part
    cones: list[Any]
    sign: float
    variables: Positions
    constraints: Positions
    shaping: Indices
    touched: tuple[tuple[str, ...], ...]


class PaddedProgram:
    """A problem's conic program, with all its room.

    Parameters
    ----------
    of : ConeMap
    """

    def __init__(self, of: ConeMap) -> None:
        self.map = of
        self.P, self.q, self.A, self.b, self.d = map(Part.of, (of.P, of.q, of.A, of.b, of.d))
        own = {name: getattr(self, name).entries.own for name in ("P", "q", "A", "b")}
        self._shaping = np.zeros(of.size, dtype=bool)
        self._shaping[own["A"]] = True
        self._touched = tuple(
            tuple(
                name
                for name, found in own.items()
                if ((found >= place.start) & (found < place.stop)).any()
            )
            for _, place in of.parameters
        )
        self._count = np.bincount(self.A.rows, minlength=self.A.shape[0])

    def layout(self, extent: Extent, shapes: Sequence[tuple[int, ...]]) -> Layout:
        """Return the conic program of an extent.

        Parameters
        ----------
        extent : Extent
        shapes : sequence of tuple of int
            Of the values that each parameter will get.
        """
        of = self.map
        there = np.zeros(of.size, dtype=bool)
        there[-1] = True
        for (parameter, place), shape in zip(of.parameters, shapes, strict=True):
            whole = there[place].reshape(parameter.shape, order="F")
            whole[tuple(slice(length) for length in shape)] = True
        rows_there = _there(self.A.shape[0], of.constraints, extent.constraints)
        columns_there = _there(self.A.shape[1], of.variables, extent.variables)
        self._leave_out(rows_there, columns_there, there)
        filled, rows, columns = Kept.of(there), Kept.of(rows_there), Kept.of(columns_there)
        starts = [int(filled.numbers[place.start]) for _, place in of.parameters]
        ends = np.cumsum([0, *(cone.dim for cone in of.cones)])
        return Layout(
            size=filled.total,
            places=tuple(
                slice(start, start + math.prod(shape))
                for start, shape in zip(starts, shapes, strict=True)
            ),
            shapes=tuple(shapes),
            P=self.P.within(columns, columns, filled),
            q=self.q.within(columns, ONE, filled),
            A=self.A.within(rows, columns, filled),
            b=self.b.within(rows, ONE, filled),
            d=self.d.within(ONE, ONE, filled),
            cones=[
                type(cone)(int(np.count_nonzero(rows.mask[first:last])))
                for cone, first, last in zip(of.cones, ends, ends[1:], strict=False)
            ],
            sign=of.sign,
            variables=_renumbered(of.variables, extent.variables, columns),
            constraints=_renumbered(of.constraints, extent.constraints, rows),
            shaping=np.flatnonzero(self._shaping[there]),
            touched=self._touched,
        )

    def _leave_out(self, rows: Mask, columns: Mask, filled: Mask) -> None:
        """Leave out, too, rows 0 ≤ b, and x_j = 0 with its x_j: what is left of auxiliary ones."""
        A, first = self.A, 0
        kept = A.entries.there(filled) & columns[A.columns] & rows[A.rows]
        left = np.bincount(A.rows[kept], minlength=len(rows))
        lost = rows & (left < self._count)
        variable = filled.copy()
        variable[-1] = False
        constant = ~self.b.entries.there(variable)
        least = self.b.entries.at(np.append(np.zeros(len(filled) - 1), 1.0))
        bare = lost & (left == 0) & constant & (least >= 0.0)
        alone = lost & (left == 1) & ~self.b.entries.there(filled)
        for cone in self.map.cones:
            part = slice(first, first + cone.dim)
            first += cone.dim
            if isinstance(cone, clarabel.NonnegativeConeT):
                rows[part] &= ~bare[part]
            if isinstance(cone, clarabel.ZeroConeT):
                rows[part] &= ~alone[part]
            else:
                alone[part] = False
        columns[A.columns[kept & alone[A.rows]]] = False


def _there(count: int, places: Positions, extents: Sequence[int]) -> Mask:
    """Return which entries of x, or of z, there are."""
    there = np.ones(count, dtype=bool)
    for (part, _), extent in zip(places.parts, extents, strict=True):
        there[places.entries[part][extent:]] = False
    return there


def _renumbered(places: Positions, extents: Sequence[int], there: Kept) -> Positions:
    """Return where the first entries of each are, of those that there are."""
    kept, parts, start = [], [], 0
    for (part, shape), extent in zip(places.parts, extents, strict=True):
        kept.append(np.arange(part.start, part.start + extent))
        parts.append((slice(start, start + extent), (extent,) if shape else ()))
        start += extent
    chosen = np.concatenate([np.zeros(0, dtype=np.intp), *kept])
    return Positions(there.numbers[places.entries[chosen]], places.factors[chosen], tuple(parts))
