"""How far polygons reach."""

from __future__ import annotations

import numpy as np

from planner.capability.polygon import SupportPoint


def hull_of(points, calls=None):
    """How far the hull of points reaches; touches an edge in its middle."""
    points = np.asarray(points, dtype=float)

    def touching(normal):
        if calls is not None:
            calls.append(normal)
        along = points @ normal
        most = along.max()
        far = points[along >= most - 1e-9 * (1.0 + abs(most))]
        return SupportPoint(normal, far.mean(axis=0))

    return touching
