"""What a scan becomes: triangles in a hold's frame, where that is, and what holes are left."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from trimesh.exchange.ply import export_ply

from hand_models.base import Array, Indices, Pose, whole_file
from hand_models.rock import FilledCells

__all__ = ["Hole", "ScannedRock", "write_rock"]


@dataclass(frozen=True, eq=False)
class Hole:
    """Where the rock was not seen.

    Attributes
    ----------
    width : float
        Diameter of the widest circle without points, or the height of a step if that is more [m].
    place : ndarray, shape (3,)
        The middle of its corners, in the rock's frame [m].
    """

    width: float
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
        Median distance between neighbours [m].
    filled : tuple of FilledCells
        Points that look like cells of a grid that had no height, in the scan's axes.
    """

    vertices: Array
    faces: Indices
    pose: Pose
    holes: tuple[Hole, ...]
    read: int
    dropped: int
    spacing: float
    filled: tuple[FilledCells, ...] = ()

    @property
    def extent(self) -> Array:
        """Size along the axes of the rock's frame, shape (3,) [m]."""
        return np.asarray(np.ptp(self.vertices, axis=0))


def write_rock(rock: ScannedRock, path: Path) -> None:
    """Write rock as a PLY file with normals [m], which a mesh hold may name."""
    mesh = trimesh.Trimesh(rock.vertices, rock.faces, process=False)
    with whole_file(path) as part:
        part.write_bytes(export_ply(mesh, vertex_normal=True))
