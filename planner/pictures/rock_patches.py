"""Triangles of the rock around a hand, for pictures.

The surface of a hold (`hand_models.rock.Hold.surface`) is cut off at a box around the hand.
"""

from __future__ import annotations

import math

import numpy as np
from trimesh.intersections import slice_faces_plane

from hand_models.base import Array, Indices, Pose
from hand_models.hand import SettledHand
from hand_models.rock import Triangles, weld
from planner.pictures.settings import PICTURE_SETTINGS

__all__ = ["coarse", "rock_patch"]


def rock_patch(settled: SettledHand, beside: Array | None = None) -> Array:
    """Return the triangles of a hand's rock within a box around that hand.

    Parameters
    ----------
    settled : SettledHand
        The hand, closed on its hold.
    beside : ndarray, shape (n, 3), optional
        Origins in hand frame H of all hands on this rock [m]; the box extends by
        `PictureSettings.rock_around` beyond all of them. By default this hand alone.

    Returns
    -------
    ndarray, shape (n, 3, 3)
        Corners in H [m]; empty where the hold is outside the box.
    """
    beside = np.zeros((1, 3)) if beside is None else beside
    around = PICTURE_SETTINGS.rock_around
    in_hand = settled.seating.pose
    there = in_hand.inverse().apply(beside)
    # as far about each hand as the corners of a box are, however that is turned
    reach = 2.0 * around
    vertices, faces = settled.hold.surface(there.min(axis=0) - reach, there.max(axis=0) + reach)
    low, high = beside.min(axis=0) - around, beside.max(axis=0) + around
    near = _near(in_hand, vertices, faces, low, high)
    if not len(near.faces):
        return np.zeros((0, 3, 3))
    vertices, faces = near.vertices, near.faces
    for inward in np.vstack([np.eye(3), -np.eye(3)]):
        # slicing a whole mesh would need a further package
        vertices, faces, _ = slice_faces_plane(
            vertices, faces, inward, np.where(inward > 0.0, low, high) * np.abs(inward)
        )
    return np.asarray(vertices[faces], dtype=float)


def _near(in_hand: Pose, vertices: Array, faces: Indices, low: Array, high: Array) -> Triangles:
    """Return, in H, the triangles whose bounds meet the box; coarsely if they are many."""
    moved = in_hand.apply(vertices)
    corners = moved[faces]
    near = (corners.min(axis=1) <= high).all(axis=1) & (corners.max(axis=1) >= low).all(axis=1)
    found = Triangles(moved, faces[near])
    if len(found.faces) > PICTURE_SETTINGS.rock_triangles:
        # the farther it goes, the coarser, but not as much
        farther = (high - low).max() / (2.0 * PICTURE_SETTINGS.rock_around)
        found = coarse(found, PICTURE_SETTINGS.rock_coarseness * math.sqrt(farther))
    return found


def coarse(triangles: Triangles, size: float) -> Triangles:
    """Return triangles whose vertices within a cell of a grid are one, in their middle.

    Parameters
    ----------
    triangles : Triangles
    size : float
        Side of a cell [m].
    """
    used, faces = np.unique(triangles.faces, return_inverse=True)
    places = triangles.vertices[used]
    _, cell = np.unique(np.round(places / size), axis=0, return_inverse=True)
    cell = cell.ravel()
    counts = np.bincount(cell)
    middles = np.column_stack([np.bincount(cell, x) / counts for x in places.T])
    return weld(Triangles(middles, cell[faces.reshape(-1, 3)]))
