"""Keep the triangles of a scan file as they are, in a frame on the rock."""

from __future__ import annotations

import numpy as np
import scipy

from hand_models.base import Array, Indices, InvalidInputError, Pose
from hand_models.rock import Triangles, connected, edges_of, filled_cells, grouped, weld
from hand_models.scans.holes import Hole, empty_circles
from hand_models.scans.rock import ScannedRock
from hand_models.scans.scan import Scan, areas_of, axes_along, in_scan, start_on

__all__ = ["keep_triangles"]


def keep_triangles(scan: Scan, hole: float) -> ScannedRock:
    """Convert a scan with triangles to rock: weld its vertices, and choose a frame on the rock.

    The triangles' winding says on which side the rock is. If it contradicts the given view, all
    triangles are turned over.

    Parameters
    ----------
    scan : Scan
        Scan with triangles.
    hole : float
        Width above which a hole is reported [m].

    Raises
    ------
    InvalidInputError
        If no triangle has an area, the view is ambiguous, or the wanted origin is not on the rock.
    """
    assert scan.faces is not None
    view = scan.direction()
    axes = axes_along(view)
    middle = 0.5 * (scan.points.min(axis=0) + scan.points.max(axis=0))
    points, faces = weld(Triangles((scan.points - middle) @ axes, scan.faces))
    if not len(faces):
        raise InvalidInputError(
            f"none of its {len(scan.faces)} triangles has an area: the corners of each are on a "
            "line, or equal when rounded to 1e-8 m; check unit or width, or export the mesh again",
            field="file",
        )
    shown = scan.shown()
    turned = shown is not None and float(shown @ view) > 0.0
    if turned:
        faces = faces[:, ::-1]
    before = np.unique(faces[areas_of(points, faces)[:, 2] < 0.0])
    start = start_on(points[before] if len(before) else points, scan, middle, axes)
    edges = edges_of(faces)
    return ScannedRock(
        vertices=points - start,
        faces=faces,
        pose=Pose(middle + axes @ start, axes),
        holes=tuple(
            Hole(width, place - start)
            for width, place in _holes(points, faces, hole, closed=shown is None)
        ),
        read=scan.read,
        dropped=scan.dropped,
        spacing=float(np.median(np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1))),
        filled=tuple(
            in_scan(cells, middle, axes) for cells in filled_cells(Triangles(points, faces))
        ),
        kept=True,
        turned=turned,
    )


def _holes(
    points: Array, faces: Indices, hole: float, *, closed: bool
) -> list[tuple[float, Array]]:
    """Return width and middle of each border that goes around a hole, the widest first.

    Of a surface that is open the largest border of each of its parts is its outline.
    """
    count, edges = len(points), edges_of(faces)
    part = connected(edges, count)
    pairs, number = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    border = pairs[number == 1]
    loops = grouped(np.unique(border), connected(border, count))
    loops.sort(key=lambda each: -float(np.linalg.norm(np.ptp(points[each], axis=0))))
    found: list[tuple[float, Array]] = []
    outlined: set[int] = set()
    for each in loops:
        if not closed and part[each[0]] not in outlined:
            outlined.add(int(part[each[0]]))
            continue
        width = _width(points[each])
        if width > hole:
            found.append((width, points[each].mean(axis=0)))
    return sorted(found, key=lambda entry: -entry[0])


def _width(loop: Array) -> float:
    """Return the diameter of the largest circle without corners within a border [m]."""
    flat = (loop - loop.mean(axis=0)) @ np.linalg.svd(
        loop - loop.mean(axis=0), full_matrices=False
    )[2].T
    try:
        corners = scipy.spatial.Delaunay(flat[:, :2]).simplices
    except scipy.spatial.QhullError:  # on a line, or too few
        return 0.0
    return float(empty_circles(flat[corners]).max())
