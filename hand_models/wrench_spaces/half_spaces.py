"""Convex sets as half-spaces: facets in a set's own coordinates, and back from these.

A set may be thin, or flat. Its facets are found in coordinates along its affine hull in which it is
round, and lifted from there.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array
from hand_models.wrench_spaces.settings import SETTINGS

__all__ = ["WRENCH_SCALE", "Facets", "HalfSpaces", "affine_hull", "lifted"]
WRENCH_SCALE: Final = np.array([1.0, 1.0, 1.0, 10.0, 10.0, 10.0])
"""Factors of a scaled wrench [N]: moments over 0.1 m, about the size of a hand."""


class Facets(NamedTuple):
    """Facets of a polytope: unit outward normals (k, r), and offsets (k,)."""

    normals: Array
    offsets: Array


class HalfSpaces(NamedTuple):
    """``normals @ w ≤ offsets`` and, for a flat set, ``equation_normals @ w = equation_offsets``.

    Normals have unit length (those of a `WrenchSpace` as functions of the scaled wrench, so that a
    violation is a distance [N]).
    """

    normals: Array
    offsets: Array
    equation_normals: Array
    equation_offsets: Array


def affine_hull(edges: Array) -> tuple[Array, Array]:
    """Return orthonormal directions (r, d) that edges (n, d) span, and their reach (r,) along each.

    In coordinates along these, divided by the reach, a thin set is as round as any other and the
    normals of its facets are well apart.
    """
    if not len(edges):
        return np.zeros((0, edges.shape[1])), np.zeros(0)
    _, reach, directions = np.linalg.svd(edges, full_matrices=False)
    # flat where it reaches next to nothing of its longest reach
    rank = int((reach > SETTINGS.tolerance * reach[0]).sum())
    return directions[:rank], reach[:rank]


def lifted(faces: Facets, directions: Array, reach: Array, base: Array) -> HalfSpaces:
    """Return half-spaces of facets known in the coordinates of `affine_hull` about a point.

    Parameters
    ----------
    faces : Faces
        In r dimensions.
    directions, reach : ndarray, shapes (r, d), (r,)
    base : ndarray, shape (d,)
    """
    normals = (faces.normals / reach) @ directions
    lengths = np.linalg.norm(normals, axis=1)
    normals /= lengths[:, None]
    _, _, full = np.linalg.svd(np.vstack([directions, np.zeros((1, len(base)))]))
    flat = full[len(directions) :]
    return HalfSpaces(normals, faces.offsets / lengths + normals @ base, flat, flat @ base)
