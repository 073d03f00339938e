"""Rock of a smooth hold that a finger meets with its whole width, in the finger's plane.

With coordinates (s, y, t) of a finger, y across its plane, the finger meets at |y| ≤ h every point
(s, t) beside which rock is anywhere across it: the hold's slab |y| ≤ h, seen along y. A smooth hold
is convex, and so is this *envelope*. It begins on a line in the plane where the nearest of three
rays does: on the two sides y = ± h of the slab, and where rock first stands in the way of a line
that is free to move along y. That is where the line is tangent to the hold's ball along y: with the
scaled places w = o + λ d + y b and their parts across b,

    |o⊥ + λ d⊥| = radius,   y = −(o + λ d)·b / |b|²,   if that y is within the slab.
"""

from __future__ import annotations

import math

import numpy as np

from hand_models.base import Array
from hand_models.sections.finger_rock import FingerRock, FingerSize, RockStrips
from hand_models.sections.polyline import PolylineSection
from hand_models.sections.section import Flags
from hand_models.sections.settings import SECTION_SETTINGS
from hand_models.sections.swept_cuts import Swept, entry_distances

__all__ = ["alike_across", "rock_across"]


def alike_across(scales: Array, across: Array) -> Flags:
    """Return whether a smooth hold's rock is the same in all planes beside each other, shape (...).

    Parameters
    ----------
    scales : ndarray, shape (..., 3)
        The scales of a hold (`Swept`).
    across : ndarray, shape (..., 3)
        Unit normals of the planes in the hold's frame.
    """
    seen, least = scales * across, SECTION_SETTINGS.alike_sine * scales.max(axis=-1)
    return np.asarray((seen * seen).sum(axis=-1) <= least * least)


def rock_across(
    shape: Swept, plane: Array, size: FingerSize, *, tiles_only: bool = False
) -> FingerRock:
    """Return the rock that a finger meets with its width, where that is not alike across it.

    Parameters
    ----------
    shape : Swept
        The hold.
    plane : ndarray, shape (3, 3)
        Origin [m] and axes s and t of the finger's plane, in the hold's frame.
    size : FingerSize
    tiles_only : bool, optional
        True to leave out the rock beside the tiles, and the strips.
    """
    slab, reach = _Slab(shape, plane), size.reach
    tile_half, frame_half = 0.5 * size.tile_width, 0.5 * size.frame_width
    inside = slab.middle(tile_half, reach)
    if inside is not None:
        tile = slab.outline(tile_half, inside, reach)
        if tiles_only:
            return FingerRock(PolylineSection([tile]))
        frame = PolylineSection([slab.outline(frame_half, inside, reach)])
        return FingerRock(PolylineSection([tile]), frame, slab.strips(tile, size))
    inside = None if tiles_only else slab.middle(frame_half, reach)
    if inside is None:
        return FingerRock(None)
    return FingerRock(None, PolylineSection([slab.outline(frame_half, inside, reach)]))


class _Slab:
    """A smooth hold in the coordinates of a finger, scaled: origin and axes s, y and t."""

    def __init__(self, shape: Swept, plane: Array) -> None:
        scales, (origin, s, t) = np.array(shape[:3]), plane
        self._shape = shape
        self._origin = scales * (origin - [0.0, 0.0, shape.depth])
        self._plane, self._across = scales * np.array([s, t]), scales * np.cross(t, s)

    def _begins(self, places: Array, ways: Array, half: float) -> Array:
        """Return how far along lines in the plane rock begins anywhere across the slab, (n,) [m].

        Infinite where a line misses the rock. Places, ways: (s, t), shapes that broadcast to (n, 2)
        [m].
        """
        shape, b = self._shape, self._across
        w, d = self._origin + places @ self._plane, ways @ self._plane
        sides = entry_distances(shape, w + half * np.array([[[1.0]], [[-1.0]]]) * b, d)
        # the ball alone, seen along y
        square, along = b @ b, d @ b
        w_across, d_across = (v - np.multiply.outer(v @ b / square, b) for v in (w, d))
        free = entry_distances(shape._replace(sine=0.0), w_across, d_across)
        with np.errstate(invalid="ignore"):
            y = -(w @ b + free * along) / square
        least: Array = np.minimum(sides.min(axis=0), np.where(np.abs(y) <= half, free, np.inf))
        return least

    def outline(self, half: float, inside: Array, reach: float) -> Array:
        """Return the envelope's outline within the slab |y| ≤ half, as points (s, t), (n, 2) [m].

        Rock is on its left; within a finger's reach points are dense. ``inside``: a place (s, t)
        within it [m].
        """

        def points(turns: Array) -> Array:
            ways = np.column_stack([np.cos(turns), np.sin(turns)])
            # from outside the rock, against these ways; along some it never ends
            far = -self._begins(inside, -ways, half)
            endless = _endless(self._shape, ways @ self._plane)
            far[endless | (far > SECTION_SETTINGS.envelope_end * reach)] = np.inf
            with np.errstate(invalid="ignore"):
                return np.asarray(inside + far[:, None] * ways)

        turns = np.linspace(0.0, math.tau, SECTION_SETTINGS.envelope_rays + 1)
        rough = points(turns)
        with np.errstate(invalid="ignore"):
            steps = np.hypot(*np.diff(rough, axis=0).T)
            near = np.hypot(*rough[:-1].T) <= reach + steps
        steps = np.where(np.isfinite(steps) & near, steps, 0.0)
        parts = np.ceil(steps / SECTION_SETTINGS.envelope_spacing).clip(1.0, 64.0)
        at = np.append(0.0, np.cumsum(parts))
        outline = points(np.interp(np.arange(at[-1]), at, turns))
        ends = np.flatnonzero(np.isfinite(outline).all(axis=1))
        if len(ends) == len(outline):
            return np.concatenate([outline, outline[:1]])
        gap = np.argmax(np.diff(ends, append=ends[0] + len(outline)))
        return outline[np.roll(ends, -gap - 1)]

    def middle(self, half: float, reach: float) -> Array | None:
        """Return the middle of the rock's envelope in the square |s|, |t| ≤ reach, (2,) [m]."""
        count = round(0.5 * reach / SECTION_SETTINGS.envelope_spacing)
        s, into = np.linspace(-reach, reach, 2 * count + 1), np.array([0.0, 1.0])
        places = np.column_stack([s, np.zeros_like(s)])
        top, bottom = self._begins(places, into, half), np.full(len(s), np.inf)
        if not _endless(self._shape, into @ self._plane):
            bottom = -self._begins(places, -into, half)
        top, bottom = np.maximum(top, -reach), np.minimum(bottom, reach)
        deep = np.maximum(bottom - top, 0.0)
        whole = deep.sum()
        if whole == 0.0:
            return None
        rock = deep > 0.0
        middle = np.array([deep @ s, deep[rock] @ (0.5 * (top[rock] + bottom[rock]))])
        return np.asarray(middle / whole)

    def strips(self, outline: Array, size: FingerSize) -> RockStrips:
        """Return how far the rock in strips across the tiles lies behind the tiles' outline."""
        before, after = np.roll(outline, 1, axis=0), np.roll(outline, -1, axis=0)
        if (outline[0] == outline[-1]).all():
            before[0], after[-1] = outline[-2], outline[1]
        else:
            before[0], after[-1] = outline[0], outline[-1]
        along = after - before
        # a millimetre apart is near enough: 1 μm less deep between two on a ball of 0.2 m
        near = np.flatnonzero(np.hypot(*outline.T) <= size.reach)[::2]
        into = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
        places, ways = (each[near] @ self._plane for each in (outline, into))
        begins = self._origin + places[:, None] + size.strips[:, None] * self._across
        behind = entry_distances(self._shape, begins, ways[:, None])
        points, normals = (each[near].view(complex)[:, 0] for each in (outline, into))
        return RockStrips(size.strips, points, normals, np.maximum(behind, 0.0))


def _endless(shape: Swept, ways: Array) -> Flags:
    """Return whether rock goes on for ever from its places along ways, scaled, shape (...)."""
    along, into = np.abs(ways[..., 0]), ways[..., 2]
    return np.asarray((shape.cosine * along <= shape.sine * into) & (shape.sine > 0.0))
