"""Scanned rock: triangles in a hold's frame, the pose of that frame, and the holes left."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import trimesh
from trimesh.exchange.ply import export_ply

from hand_models.base import Array, Indices, Pose, whole_file
from hand_models.rock import FilledCells

__all__ = ["Hole", "ScannedRock", "Step", "write_rock"]


class Hole(NamedTuple):
    """Part of the rock without points, seen along the view.

    Attributes
    ----------
    width : float
        Diameter of the widest circle without points whose centre is in the hole, across the
        view [m].
    place : ndarray, shape (3,)
        Mean of the hole's corners, in the rock's frame [m].
    """

    width: float
    place: Array


class Step(NamedTuple):
    """Jump along the view between neighbouring points, so large that it may hide rock.

    Attributes
    ----------
    height : float
        Height of the jump along the view [m].
    place : ndarray, shape (3,)
        Mean of the step's corners, in the rock's frame [m].
    """

    height: float
    place: Array


@dataclass(frozen=True, eq=False)
class ScannedRock:
    """Triangles of scanned rock, ready for a `Mesh` hold.

    The origin of the rock's frame is on the rock; z goes into the rock along the view, x is as
    upward as can be.

    Attributes
    ----------
    vertices : ndarray, shape (n, 3)
        In the rock's frame [m].
    faces : ndarray of int, shape (m, 3)
        Counterclockwise seen from outside.
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
        Number of points that were left out because they stand alone.
    kept, turned : bool
        True if the triangles are the file's; True if these were turned over because they faced
        away from the given view.
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
    kept: bool = False
    turned: bool = False

    @property
    def extent(self) -> Array:
        """Size of the rock along each axis of its frame, shape (3,) [m]."""
        return np.asarray(np.ptp(self.vertices, axis=0))


def write_rock(rock: ScannedRock, path: Path) -> None:
    """Write scanned rock to a PLY file with normals [m], which `read_mesh` can read for a hold."""
    mesh = trimesh.Trimesh(rock.vertices, rock.faces, process=False)
    with whole_file(path) as part:
        part.write_bytes(export_ply(mesh, vertex_normal=True))
