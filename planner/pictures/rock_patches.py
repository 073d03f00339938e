"""The rock around a hand as triangles, for pictures.

Every hold is drawn from what defines it (circles, faces, semi-axes, outlines, triangles), and cut
off at a box about the hand.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from trimesh.intersections import slice_faces_plane

from hand_models.base import Array, Indices, Pose
from hand_models.hand import SettledHand
from hand_models.rock import (
    Cylinder,
    Edge,
    Ellipsoid,
    Mesh,
    Plane,
    Profile,
    Sphere,
    Triangles,
    drawn_out,
    grid,
    weld,
)

__all__ = ["AROUND", "rock_patch"]

AROUND: Final = 0.45
"""Half the side of the box about the hand in which rock is drawn [m]."""

STEPS: Final = 28
"""Of a curve that is drawn in pieces."""

MOST: Final = 3000
"""Triangles of a mesh near a hand above which it is drawn coarsely."""

COARSE: Final = 0.02
"""Size of what is drawn of such a mesh [m]."""


HERE: Final = np.zeros((1, 3))
"""Of a hand alone, its own place in H."""


def rock_patch(settled: SettledHand, beside: Array = HERE) -> Array:
    """Return the rock within ±`AROUND` of a hand along each axis of H, shape (n, 3, 3) [m].

    Triangles in H; none where the hold is farther away.

    Parameters
    ----------
    settled : SettledHand
    beside : ndarray, shape (n, 3), optional
        Places in H of all hands on this rock, if it is a mesh; its rock reaches so far beyond them.
    """
    in_hand = settled.seating.pose
    vertices, faces = _surface(settled, in_hand.inverse().position)
    low, high = beside.min(axis=0) - AROUND, beside.max(axis=0) + AROUND
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
    if len(found.faces) > MOST:
        # the farther it goes, the coarser, but not as much
        found = _coarse(found, COARSE * math.sqrt((high - low).max() / (2.0 * AROUND)))
    return found


def _coarse(triangles: Triangles, size: float) -> Triangles:
    """Return triangles whose vertices within a cell of a grid are one, in their middle."""
    used, faces = np.unique(triangles.faces, return_inverse=True)
    places = triangles.vertices[used]
    _, cell = np.unique(np.round(places / size), axis=0, return_inverse=True)
    cell = cell.ravel()
    counts = np.bincount(cell)
    middles = np.column_stack([np.bincount(cell, x) / counts for x in places.T])
    return weld(Triangles(middles, cell[faces.reshape(-1, 3)]))


def _surface(settled: SettledHand, hand: Array) -> Triangles:
    """Return a hold's surface in its own frame, at least near a hand at a place in that frame."""
    hold, middle = settled.hold, float(hand[1])
    sides = middle - 2.0 * AROUND, middle + 2.0 * AROUND
    match hold:
        case Plane():
            x = float(hand[0])
            outline = np.array([[x - 2.0 * AROUND, 0.0], [x + 2.0 * AROUND, 0.0]])
            return drawn_out(outline, *sides)
        case Cylinder() | Edge():
            return drawn_out(_round_outline(hold, hand), *sides)
        case Sphere():
            return _cap(np.full(3, hold.diameter / 2.0), hand)
        case Ellipsoid():
            return _cap(np.array(hold.semi_axes), hand)
        case Profile():
            return hold.surface(*sides)
        case Mesh():
            return hold.triangles
    return Triangles(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.intp))


def _round_outline(hold: Cylinder | Edge, hand: Array) -> Array:
    """Return the outline (x, z) of a hold with a round crest, near a hand."""
    radius, sine, cosine = hold.swept.radius, hold.swept.sine, hold.swept.cosine
    # points of the circle are at angles from the crest; flat faces begin where it ends
    end = math.pi / 2.0 - hold.angle / 2.0 if isinstance(hold, Edge) else math.inf
    over = math.atan2(float(hand[0]), radius - float(hand[2]))
    middle = min(max(over, -end), end)
    half = min(math.pi, 2.0 * AROUND / radius)
    t = np.linspace(max(middle - half, -end), min(middle + half, end), STEPS + 1)
    arc = np.column_stack([radius * np.sin(t), radius - radius * np.cos(t)])
    if not sine:
        return arc
    far = float(np.abs(hand).max()) + 4.0 * AROUND
    ends = arc[0] + far * np.array([-sine, cosine]), arc[-1] + far * np.array([sine, cosine])
    return np.vstack([ends[0], arc, ends[1]])


def _cap(semi_axes: Array, hand: Array) -> Triangles:
    """Return an ellipsoid's surface about the place nearest to a hand."""
    centre = np.array([0.0, 0.0, semi_axes[2]])
    pole = (hand - centre) / semi_axes
    length = float(np.linalg.norm(pole))
    pole = pole / length if length > 0.0 else np.array([0.0, 0.0, -1.0])
    across = np.linalg.svd(pole[None])[2][1:]
    t = np.linspace(0.0, min(math.pi, 2.0 * AROUND / float(semi_axes.min())), STEPS + 1)
    turn = np.linspace(0.0, 2.0 * math.pi, STEPS + 1)
    round_about = np.column_stack([np.cos(turn), np.sin(turn)]) @ across
    unit = np.cos(t)[:, None, None] * pole + np.sin(t)[:, None, None] * round_about
    return grid(centre + unit * semi_axes)
