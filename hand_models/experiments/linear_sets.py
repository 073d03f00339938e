"""Comparison of linearised sets with the hull of a planar gripper's wrenches.

The sets are compared by their support functions, in directions that are evenly spread over the
hull. Wrenches are (F_x, F_z, M_y) in the paper's signs.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hand_models.base import Array, Progress
from hand_models.compliance import PLANAR_COMPONENTS, Gripper, linear_extreme, pieces
from hand_models.experiments.pulling import even_pulls, unloaded
from hand_models.experiments.wrench_hull import (
    clipped_vertices,
    extents,
    in_paper_signs,
    with_mirrored,
)

__all__ = ["asymmetry", "even_directions", "linear_pieces", "linearised", "spread"]


def even_directions(count: int, size: Array) -> Array:
    """Return directions (count, 3), evenly spread over a hull of a size, and symmetric."""
    half = even_pulls(count // 2, np.ones(3))
    return np.vstack([half, -half]) / size


def spread(values: Array) -> dict[str, float]:
    """Return the mean of values, the least and the largest."""
    return {"mean": values.mean(), "least": values.min(), "most": values.max()}


def asymmetry(points: Array, directions: Array) -> float:
    """Return how far a hull is off its image (−F_x, F_z, −M_y), as a share of its extents.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Points of the hull [N, N, N·m].
    directions : ndarray, shape (m, 3)
        From `even_directions`.
    """
    here, there = np.split((with_mirrored(points) @ directions.T), 2)
    return float(np.abs(here.max(axis=0) - there.max(axis=0)).max())


def linearised(gripper: Gripper, points: Array, directions: Array) -> dict[str, Any]:
    """Return how far sets linearised at rest, and where nothing loads, are off the hull.

    Parameters
    ----------
    gripper : Gripper
    points : ndarray, shape (n, 3)
        Points of the hull of its wrenches [N, N, N·m].
    directions : ndarray, shape (m, 3)
        From `even_directions`.

    Returns
    -------
    dict
        Relative errors of the supports of the sets ``at_rest`` and ``unloaded``, of all directions
        and of those that pull, and the extents of the sets.
    """
    support = (points @ directions.T).max(axis=0)
    result = {}
    for name, at in (("at_rest", np.zeros(3)), ("unloaded", unloaded(gripper))):
        corners = in_paper_signs(gripper.linearised(at).vertices())
        error = (corners @ directions.T).max(axis=0) / support - 1.0
        pulling = error[directions[:, 1] < 0.0]
        result[name] = {
            "error": spread(error),
            "mean_size_of_error": np.abs(error).mean(),
            "error_pulling": spread(pulling),
            "mean_size_of_error_pulling": np.abs(pulling).mean(),
            "extents": extents(clipped_vertices(corners))._asdict(),
        }
    return result


def linear_pieces(
    gripper: Gripper, points: Array, ways: Array, progress: Progress
) -> dict[str, Any]:
    """Return a list of linearised sets, and its union's error in support against the hull.

    Supports are from the wrench at rest.

    Parameters
    ----------
    gripper : Gripper
    points : ndarray, shape (n, 3)
        Points of the hull of its wrenches [N, N, N·m].
    ways : ndarray, shape (m, 3)
        Directions: the list is made for every second one of them.
    progress : Progress
    """
    directions = np.zeros((len(ways), 6))
    directions[:, PLANAR_COMPONENTS] = ways * (1.0, 1.0, -1.0)
    found = pieces(gripper, directions[::2], progress=progress).pieces
    rest = directions @ gripper.evaluate(np.zeros((1, len(PLANAR_COMPONENTS)))).wrenches[0]
    reached = [max(linear_extreme(piece.space, d)[1] for piece in found) for d in directions]
    off = (np.array(reached) - rest) / ((points @ ways.T).max(axis=0) - rest) - 1.0
    return {
        "poses": [piece.twist for piece in found],
        "within": [piece.within for piece in found],
        "worst_looked_at": np.abs(off[::2]).max(),
        "worst_elsewhere": np.abs(off[1::2]).max(),
        "mean": off.mean(),
    }
