"""Find cells without a height that a grid has filled with one number, by the cliffs around them.

Some programs write zero where a grid has no height. In a mesh such cells form a floor at exactly
one value of one coordinate, seen from the same side as the rock, and joined to it only by cliffs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices
from hand_models.parameters import scan_table
from hand_models.rock.surface import Triangles
from hand_models.rock.triangles import edges_of

__all__ = ["FilledCells", "filled_cells"]


class FilledCells(NamedTuple):
    """Vertices that seem to be cells of a grid without a height, filled with one number.

    Attributes
    ----------
    axis : int
        Axis, 0 to 2, of the coordinate that all of them share.
    value : float
        Value of that coordinate [m].
    cells : int
        Number of the vertices.
    """

    axis: int
    value: float
    cells: int


def filled_cells(triangles: Triangles) -> list[FilledCells]:
    """Find vertices of a mesh that seem to be cells of a grid without a height.

    Thresholds are in ``scan.toml``.

    Returns
    -------
    list of FilledCells
        One entry for each value of a coordinate that many vertices share.
    """
    table = scan_table()
    least, steep, share = (table.scalar("filled", name) for name in ("least", "steep", "share"))
    vertices, faces = triangles
    found: list[FilledCells] = []
    some = faces[:: max(1, len(faces) // 100_000)]  # so many or some more are enough
    sides = vertices[some] - vertices[some[:, [1, 2, 0]]]
    highest = steep * float(np.median(np.linalg.norm(sides, axis=2)))
    for axis in range(3):
        along = vertices[:, axis]
        values, counts = np.unique(along, return_counts=True)
        if counts.max() < least:
            continue
        edges = edges_of(faces)
        cliff = np.abs(along[edges[:, 0]] - along[edges[:, 1]]) > highest
        if not cliff.any():
            continue
        level = np.searchsorted(values, along)
        ends = level[edges]
        leaves = ends[:, 0] != ends[:, 1]
        ways, cliffs = (
            np.bincount(ends[which].ravel(), minlength=len(values))
            for which in (leaves, leaves & cliff)
        )
        for k in np.flatnonzero((counts >= least) & (ways > 0) & (cliffs >= share * ways)):
            beyond = np.unique(ends[leaves & (ends == k).any(axis=1)])
            floor = (level[faces] == k).all(axis=1)
            # cliffs of a drawn shape end at two levels, those of rough rock at more
            if len(beyond) - 1 > 2 and _seen_alike(vertices, faces, axis, floor):
                found.append(FilledCells(axis, float(values[k]), int(counts[k])))
    return found


def _seen_alike(vertices: Array, faces: Indices, axis: int, floor: NDArray[np.bool_]) -> bool:
    """Return True if a floor faces the way along an axis that all other triangles do together.

    In a closed surface it never does: its areas add up to nothing.
    """
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    area = np.cross(b - a, c - a)[:, axis]
    return bool(area[floor].sum() * area[~floor].sum() > 0.0)
