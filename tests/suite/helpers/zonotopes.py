"""Zonotopes by their generators, as sums of segments."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from hand_models.wrench_spaces.half_spaces import Facets, HalfSpaces, affine_hull, lifted
from hand_models.wrench_spaces.minkowski_sums import extreme_points, facets

__all__ = ["half_spaces"]


def half_spaces(
    generators: ArrayLike, lower: ArrayLike, upper: ArrayLike, origin: ArrayLike = 0.0
) -> HalfSpaces:
    """Return the half-spaces of { o + G x : lower ≤ x ≤ upper }."""
    G, low = np.asarray(generators, dtype=float), np.asarray(lower, dtype=float)
    edges = (G * (upper - low)).T
    directions, reach = affine_hull(edges)
    ends = [[np.zeros(len(reach)), edge] for edge in edges @ directions.T / reach]
    found = Facets(np.zeros((0, 0)), np.zeros(0))
    if len(reach):
        parts = [extreme_points(np.array(each), 1) for each in ends]
        found = facets([part for part in parts if part.dimension], len(reach), 1e-9)
    return lifted(found, directions, reach, origin + G @ low)
