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
    """Part of the rock where no point was seen.

    Attributes
    ----------
    width : float
        Diameter of the widest circle without points whose middle is in it, across the view [m].
    place : ndarray, shape (3,)
        The middle of its corners, in the rock's frame [m].
    """

    width: float
    place: Array


class Step(NamedTuple):
    """Jump between neighbouring points along the view, so large that rock may hide between them.

    Attributes
    ----------
    height : float
        Height of the jump along the view [m].
    place : ndarray, shape (3,)
        The middle of its corners, in the rock's frame [m].
    """

    height: float
    place: Array


@dataclass(frozen=True, eq=False)
class ScannedRock:
    """Triangles of scanned rock, as a mesh hold has them.

    Its frame begins on the rock; z goes into it along the view, x is up as far as it can be.

    Attributes
    ----------
    vertices : ndarray, shape (n, 3)
        In the rock's frame [m].
    faces : ndarray of int, shape (m, 3)
        Counterclockwise seen from outside.
    pose : Pose
        The rock's frame in the scan's, which has z up.
    holes : tuple of Hole
        That were left open, the widest first; the outline is not one of them.
    read, dropped : int
        Points of the file, and how many of them are not finite.
    spacing : float
        Median distance between neighbours, of triangles that were kept the median edge [m].
    filled : tuple of FilledCells
        Points that look like cells of a grid that had no height, in the scan's axes.
    steps : tuple of Step
        That were left open, the highest first.
    covered : float
        Part of the area within the points' convex outline that has triangles, seen along the view;
        one of triangles that were kept.
    outliers : int
        Points that were left out because they stand alone.
    kept, turned : bool
        Whether the triangles are the file's, and whether they were turned over, since they showed
        their backs to the view that was given.
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
        """Size along the axes of the rock's frame, shape (3,) [m]."""
        return np.asarray(np.ptp(self.vertices, axis=0))


def write_rock(rock: ScannedRock, path: Path) -> None:
    """Write rock as a PLY file with normals [m], which a mesh hold may name."""
    mesh = trimesh.Trimesh(rock.vertices, rock.faces, process=False)
    with whole_file(path) as part:
        part.write_bytes(export_ply(mesh, vertex_normal=True))
