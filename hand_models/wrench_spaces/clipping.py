"""Clip polytopes with half-spaces, given their vertices and facets."""

from __future__ import annotations

import numpy as np
import scipy

from hand_models.base import BASE_TOLERANCES, Array, Indices, LimitError, go_on
from hand_models.wrench_spaces.half_spaces import Facets
from hand_models.wrench_spaces.polytopes import distinct
from hand_models.wrench_spaces.settings import SETTINGS

__all__ = ["clipped"]


def clipped(
    vertices: Array, faces: Facets, cuts: Facets, rounding: float
) -> tuple[Array, Facets] | None:
    """Clip a polytope with half-spaces, and return its vertices and facets.

    Half-spaces are taken one after another: vertices beyond one are dropped, and every edge that
    crosses its plane gets a new vertex. Two vertices are the ends of an edge where the normals of
    the facets that both lie on span all directions but one.

    Parameters
    ----------
    vertices : ndarray, shape (n, r)
        All vertices of the polytope.
    faces : Facets
        All facets of the polytope.
    cuts : Facets
        Half-spaces, normals · x ≤ offsets, that clip the polytope.
    rounding : float
        Distance that rounding may move points, in units of the vertices.

    Returns
    -------
    tuple of (ndarray, Facets), or None
        Vertices (k, r) and facets; None if no interior is left.

    Raises
    ------
    LimitError
        If so many vertices lie on the same facets that rounding hides which ones edges join.
    """
    if not len(cuts.offsets):
        return vertices, faces
    settings = SETTINGS
    most_pairs = max(settings.most_pairs, settings.pairs_per_vertex * len(vertices))
    # cuts leave twice as many at most, unless rounding takes diagonals of a facet for edges
    most_vertices = max(20_000, 3 * len(vertices))
    slack = 10.0 * rounding * (1.0 + float(np.abs(faces.offsets).max()))
    lies = _incidence(vertices, faces, slack)
    beyond = vertices @ cuts.normals.T > cuts.offsets
    # those that take most away first: what is gone need not be cut again
    for k in np.argsort(-beyond.sum(axis=0)):
        go_on()
        normal, offset = cuts.normals[k], cuts.offsets[k]
        height = vertices @ normal - offset
        inside, outside = np.flatnonzero(height < -slack), np.flatnonzero(height > slack)
        if not len(outside):
            continue
        if not len(inside):
            return None
        near, far = _edges(lies, inside, outside, faces, most_pairs)
        part = (height[near] / (height[near] - height[far]))[:, None]
        crossings = distinct(vertices[near] + part * (vertices[far] - vertices[near]), slack)
        kept = height <= slack
        vertices = np.vstack([vertices[kept], crossings])
        if len(vertices) > most_vertices:
            raise LimitError(
                f"{len(vertices)} vertices after a cut are too many (at most {most_vertices}): use "
                "fewer half_planes"
            )
        on_cut = np.append(height[kept] >= -slack, np.ones(len(crossings)))[:, None]
        lies = scipy.sparse.vstack([lies[kept], _incidence(crossings, faces, slack)])
        lies = scipy.sparse.hstack([lies, scipy.sparse.csr_array(on_cut)], format="csr")
        met = np.asarray(lies.sum(axis=0)).ravel() >= vertices.shape[1]
        lies = lies[:, met]
        normals, offsets = np.vstack([faces.normals, normal]), np.append(faces.offsets, offset)
        faces = Facets(normals[met], offsets[met])
    return vertices, faces


def _edges(
    lies: scipy.sparse.csr_array, starts: Indices, ends: Indices, faces: Facets, most_pairs: int
) -> tuple[Indices, Indices]:
    """Return the ends of all edges that lead from some vertices to some others."""
    r = faces.normals.shape[1]
    if r == 1:
        return starts, ends
    one, other = lies[starts], lies[ends]
    shared = (one @ other.T).tocoo()
    go_on()
    enough = shared.data >= r - 1
    if (pairs := int(enough.sum())) > most_pairs:
        raise LimitError(
            f"{pairs} pairs of vertices on common facets are too many (at most {most_pairs}): use "
            "fewer half_planes"
        )
    i, j = shared.row[enough], shared.col[enough]
    squares = np.einsum("kr,ks->krs", faces.normals, faces.normals).reshape(-1, r * r)
    spans = np.linalg.eigvalsh((one[i].multiply(other[j]) @ squares).reshape(-1, r, r))
    # squares of unit normals that span a direction sum to more than rounding in it
    edge = spans[:, 1] > 0.1 * BASE_TOLERANCES.rounding
    return starts[i[edge]], ends[j[edge]]


def _incidence(points: Array, faces: Facets, slack: float) -> scipy.sparse.csr_array:
    """Return which points (rows) lie on which facets (columns), as ones."""
    chunk = max(1, 2_000_000 // len(faces.offsets))
    parts = []
    for k in range(0, max(len(points), 1), chunk):
        go_on()
        on = points[k : k + chunk] @ faces.normals.T >= faces.offsets - slack
        parts.append(scipy.sparse.csr_array(on.astype(float)))
    lies: scipy.sparse.csr_array = scipy.sparse.vstack(parts, format="csr")
    return lies
