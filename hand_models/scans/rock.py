"""Scanned rock: triangles in a hold's frame, the pose of that frame, and the holes left."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hand_models.base import Array, Indices, Pose, whole_file
from hand_models.rock import FilledCells, Triangles
from hand_models.scans.holes import Gaps, Hole, Step
from hand_models.scans.scan import box_about

__all__ = ["ScannedRock", "write_rock"]


@dataclass(frozen=True, eq=False)
class ScannedRock:
    """Triangles of scanned rock, ready for a `Mesh` hold.

    The origin of the rock's frame is on the rock; z goes into the rock along the view, x is as
    upward as can be.

    Attributes
    ----------
    vertices : ndarray, shape (n, 3)
        Corners of the triangles, in the rock's frame [m].
    faces : ndarray of int, shape (m, 3)
        Indices of each triangle's vertices, counterclockwise seen from outside.
    pose : Pose
        The rock's frame in the scan's, which has z up.
    holes : tuple of Hole
        Holes that were left open, the widest first; the outline is not one of them.
    read, dropped : int
        Number of points in the file, and of those that are not finite.
    spacing : float
        Median distance of neighbouring points; of a file's triangles the median edge [m].
    filled : tuple of FilledCells
        Points that seem to be cells of a grid without height, in the scan's axes.
    steps : tuple of Step
        Steps that were left open, the highest first.
    covered : float
        Share of the area within the points' convex outline, seen along the view, that has
        triangles; 1 for a file's triangles.
    outliers : int
        Number of points that were left out because they stand alone (`drop_outliers`).
    alone : int
        Number of points without triangles that have steps around them, as stray points have.
    kept, turned : bool
        True if the triangles are the file's; True if these were turned over because they faced
        away from the given view.
    gaps : Gaps or None
        All triangles between the points, also those that were left out, with the width that each
        bridges; None for a file's triangles.
    """

    vertices: Array
    faces: Indices
    pose: Pose
    holes: tuple[Hole, ...]
    read: int
    dropped: int
    spacing: float
    filled: tuple[FilledCells, ...] = ()
    steps: tuple[Step, ...] = ()
    covered: float = 1.0
    outliers: int = 0
    alone: int = 0
    kept: bool = False
    turned: bool = False
    gaps: Gaps | None = None

    @property
    def extent(self) -> Array:
        """Size of the rock along each axis of its frame, shape (3,) [m]."""
        low, high = box_about(self.vertices)
        return high - low


def write_rock(rock: ScannedRock | Triangles, path: Path) -> None:
    """Write rock to a PLY file with normals [m], which `read_mesh` can read for a hold."""
    from hand_models.scans.compiled_triangulation import vertex_normals

    vertices, faces = rock.vertices, rock.faces
    normals = vertex_normals(np.ascontiguousarray(vertices), np.ascontiguousarray(faces))
    points = np.column_stack([vertices, normals]).astype("<f4")
    triangles = np.full(len(faces), 3, [("count", "u1"), ("corners", "<i4", 3)])
    triangles["corners"] = faces
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
    header += [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    with whole_file(path) as part, part.open("wb") as file:
        file.write("\n".join([*header, "end_header", ""]).encode())
        points.tofile(file)
        triangles.tofile(file)
