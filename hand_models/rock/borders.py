"""Where triangles end: the borders of open surfaces, but for holes that are bridged."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from hand_models.base import Array
from hand_models.rock.triangles import Triangles

__all__ = ["borders"]


def borders(triangles: Triangles, gap: float) -> Array:
    """Return the ends of every edge that only one triangle has, shape (n, 2, 3) [m].

    Left out are borders of holes that are no wider than ``gap`` along any axis [m].
    """
    vertices, faces = triangles
    ends = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    count = len(vertices)
    names, number = np.unique(ends[:, 0] * count + ends[:, 1], return_counts=True)
    edges = np.column_stack(np.divmod(names[number == 1], count))
    graph = sparse.coo_matrix((np.ones(len(edges)), edges.T), shape=(count, count))
    _, part = connected_components(graph, directed=False)
    low, high = np.full((2, part.max() + 1, 3), np.inf) * np.array([1.0, -1.0])[:, None, None]
    np.minimum.at(low, part, vertices)
    np.maximum.at(high, part, vertices)
    wide = ((high - low) > gap).any(axis=1)
    return np.asarray(vertices[edges[wide[part[edges[:, 0]]]]])
