"""Convex sets as half-spaces: facets in coordinates of the set's affine hull, and back to wrenches.

A set may be thin, or flat. Its facets are found in scaled coordinates of its affine hull, in which
it is about as wide in every direction, and mapped back from there.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array
from hand_models.wrench_spaces.settings import SETTINGS

__all__ = ["WRENCH_SCALE", "Facets", "HalfSpaces", "affine_hull", "lifted"]
WRENCH_SCALE: Final = np.array([1.0, 1.0, 1.0, 10.0, 10.0, 10.0])
"""Factors from a wrench to a scaled wrench [N]: moments over 0.1 m, about the size of a hand."""


class Facets(NamedTuple):
    """Facets of a polytope { x : normals @ x ≤ offsets } in r dimensions.

    Attributes
    ----------
    normals : ndarray, shape (k, r)
        Unit outward normals.
    offsets : ndarray, shape (k,)
        Largest product of each normal with the polytope's points.
    """

    normals: Array
    offsets: Array


class HalfSpaces(NamedTuple):
    """``normals @ w ≤ offsets`` and, for a flat set, ``equation_normals @ w = equation_offsets``.

    For a `WrenchSpace`, a normal has length one as a function of the scaled wrench (moments divided
    by 0.1 m), so that a violation is a distance [N].

    Attributes
    ----------
    normals, offsets : ndarray, shapes (k, d), (k,)
        Inequalities.
    equation_normals, equation_offsets : ndarray, shapes (e, d), (e,)
        Equations; e = 0 for a set that is not flat.
    """

    normals: Array
    offsets: Array
    equation_normals: Array
    equation_offsets: Array


def affine_hull(edges: Array) -> tuple[Array, Array]:
    """Return orthonormal directions that edges span, by singular value decomposition.

    In coordinates along these directions, divided by the reach, a thin set is about as wide in
    every direction, and the normals of its facets are well apart.

    Parameters
    ----------
    edges : ndarray, shape (n, d)
        Vectors.

    Returns
    -------
    directions : ndarray, shape (r, d)
        Directions, one in a row.
    reach : ndarray, shape (r,)
        Singular value along each direction, descending.
    """
    if not len(edges):
        return np.zeros((0, edges.shape[1])), np.zeros(0)
    _, reach, directions = np.linalg.svd(edges, full_matrices=False)
    # flat where it reaches next to nothing of its longest reach
    rank = int((reach > SETTINGS.tolerance * reach[0]).sum())
    return directions[:rank], reach[:rank]


def lifted(faces: Facets, directions: Array, reach: Array, base: Array) -> HalfSpaces:
    """Map facets from coordinates of `affine_hull` back to the full space.

    Parameters
    ----------
    faces : Facets
        Facets in r dimensions, in coordinates divided by the reach, about ``base``.
    directions, reach : ndarray, shapes (r, d), (r,)
        Result of `affine_hull`.
    base : ndarray, shape (d,)
        Origin of the coordinates.

    Returns
    -------
    HalfSpaces
        The same set in d dimensions, with d − r equations.
    """
    normals = (faces.normals / reach) @ directions
    lengths = np.linalg.norm(normals, axis=1)
    normals /= lengths[:, None]
    _, _, full = np.linalg.svd(np.vstack([directions, np.zeros((1, len(base)))]))
    flat = full[len(directions) :]
    return HalfSpaces(normals, faces.offsets / lengths + normals @ base, flat, flat @ base)
