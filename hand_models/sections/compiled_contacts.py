"""Find where turning faces first meet polylines, and where they touch these (compiled).

What is computed is in `hand_models.sections.first_contact`. Polylines are an array of their
vertices, one after another, and for each vertex the first and the last one of its polyline.
"""

from __future__ import annotations

import math

import numpy as np

from hand_models.base import Array, Indices, compiled
from hand_models.sections.section import Flags

__all__ = ["first_contacts", "pierced_faces"]

Seen = tuple[Array, Array, float, float, float]
"""Vertices, and joint, cosine, sine and height of a face beside them."""


@compiled()
def _order(x: float, y: float, rounding: float) -> float:
    """Return what grows with the angle of a direction, from 0 to 4 in a turn."""
    quarter = 1.0 - x / max(abs(x) + abs(y), 1e-300)
    return 4.0 - quarter if y < -rounding * x else quarter


@compiled()
def _angle(x: float, y: float, rounding: float) -> float:
    """Return the angle of a direction, from 0 to 2π, of which rounding takes nothing."""
    return max((math.atan2(y, x) + rounding) % (2.0 * math.pi) - rounding, 0.0)


@compiled()
def _turned(vertices: Array, joint: Array, angle: float) -> Array:
    """Return vertices along a phalanx at an angle, across it, and the distance's square, (n, 3)."""
    u, v = math.cos(angle), math.sin(angle)
    found = np.empty((len(vertices), 3))
    for i in range(len(vertices)):
        s, t = vertices[i, 0] - joint[0], vertices[i, 1] - joint[1]
        found[i, 0], found[i, 1], found[i, 2] = s * u + t * v, t * u - s * v, s * s + t * t
    return found


@compiled()
def _by_end(
    near: Array, lasts: Indices, end: float, height: float, longest: float, rounding: float
) -> tuple[float, int]:
    """Return by what angle a phalanx turns until an end is on the boundary, and the vertex after.

    ``near``: the vertices as `_turned` returns them where the phalanx begins.
    """
    arm = math.sqrt(end * end + height * height)
    u, v = end / arm, height / arm
    # a segment that the end meets begins no farther from its circle than it is long
    nearest, farthest = max(arm - longest, 0.0) ** 2, (arm + longest) ** 2
    first, there, vertex = math.inf, (0.0, 0.0), 0
    for i in range(len(near)):
        x, y, square = near[i]
        if i == lasts[i] or square < nearest or square > farthest:
            continue
        d_x, d_y = near[i + 1, 0] - x, near[i + 1, 1] - y
        long, b = d_x * d_x + d_y * d_y, x * d_x + y * d_y
        inside = b * b - long * (square - arm * arm)
        if inside < 0.0:
            continue
        root = math.sqrt(inside)
        for part in ((-b - root) / long, (root - b) / long):
            if 0.0 <= part <= 1.0:
                p, q = x + part * d_x, y + part * d_y
                along, across = p * u + q * v, q * u - p * v
                order = _order(along, across, rounding)
                if order < first:
                    first, there, vertex = order, (along, across), i + 1
    return _angle(there[0], there[1], rounding) if first < math.inf else math.inf, vertex


@compiled()
def _on_face(
    near: Array, start: float, end: float, height: float, rounding: float
) -> tuple[float, int]:
    """Return by what angle a phalanx turns until a vertex is on its face, and the vertex."""
    first, there, vertex = math.inf, (0.0, 0.0), 0
    # rounding must leave none out
    nearest, farthest = (1.0 - 1e-9) * max(start, 0.0) ** 2, (1.0 + 1e-9) * end * end
    for i in range(len(near)):
        x, y, square = near[i]
        beyond = square - height * height
        if beyond < nearest or beyond > farthest:
            continue
        along = math.sqrt(beyond)
        if start <= along <= end:
            p, q = x * along + y * height, y * along - x * height
            order = _order(p, q, rounding)
            if order < first:
                first, there, vertex = order, (p, q), i
    return _angle(there[0], there[1], rounding) if first < math.inf else math.inf, vertex


@compiled()
def _on(seen: Seen, i: int) -> tuple[float, float]:
    """Return how far along a face a vertex is, and how far off it [m]."""
    vertices, joint, u, v, height = seen
    s, t = vertices[i, 0] - joint[0], vertices[i, 1] - joint[1]
    return s * u + t * v, t * u - s * v - height


@compiled()
def _reached(
    on: Seen, here: float, level: float, at: int, way: int, last: int, face: Array
) -> float:
    """Return up to where along a face rock stays at it, on one side of a place.

    Parameters
    ----------
    on : tuple
        Vertices as `_on` sees them.
    here, level : float
        The place along the face, and off it [m].
    at, way, last : int
        The vertex next to the place, the way from there, 1 or −1, and the boundary's last that way.
    face : ndarray, shape (2,)
        Where the face begins and ends [m].
    """
    start, end = face
    limit = level + 5e-7  # [m] so near rock counts as touched
    near, low = here, level
    while (last - at) * way >= 0:
        along, gap = _on(on, at)
        if gap > limit or along < start or along > end:
            # the last step is taken as straight
            part = min(max((limit - low) / (gap - low), 0.0), 1.0) if gap > low else 1.0
            return float(min(max(near + part * (along - near), start), end))
        near, low = along, gap
        at += way
    return near


@compiled()
def _lowest(on: Seen, here: float, first: int, last: int, more: int, fitted: float) -> float:
    """Return where a parabola fitted to some of the rock is lowest, near a place on it.

    ``first`` and ``last`` of the vertices count, and ``more`` times the place itself, at zero.
    """
    s_0, s_1, s_2, s_3, s_4, g_0, g_1, g_2 = float(more), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(first, last + 1):
        along, g = _on(on, i)
        t = (along - here) / fitted
        square = t * t
        s_0, s_1, s_2 = s_0 + 1.0, s_1 + t, s_2 + square
        s_3, s_4 = s_3 + t * square, s_4 + square * square
        g_0, g_1, g_2 = g_0 + g, g_1 + g * t, g_2 + g * square
    # bend and slope of the normal equations, by Cramer's rule, but for their determinant, above 0
    c_0, c_1, c_2 = s_2 * s_0 - s_1 * s_1, s_1 * s_2 - s_3 * s_0, s_3 * s_1 - s_2 * s_2
    bend = g_2 * c_0 + g_1 * c_1 + g_0 * c_2
    slope = g_2 * c_1 + g_1 * (s_4 * s_0 - s_2 * s_2) + g_0 * (s_3 * s_2 - s_4 * s_1)
    if bend <= 0.0 or s_0 < 3.0:
        return here
    return here + fitted * min(max(-0.5 * slope / bend, -1.0), 1.0)


@compiled()
def _touched(
    on: Seen,
    here: float,
    vertex: int,
    by_end: bool,
    bounds: tuple[int, int],
    face: Array,
    fitted: float,
    faceted: int,
) -> tuple[float, bool]:
    """Return where along a face that rests on the boundary it touches, and whether it lies flat.

    Parameters
    ----------
    on : tuple
        Vertices as `_on` sees them.
    here : float
        Place along the face at which it met the rock [m].
    vertex, by_end : int, bool
        The vertex there; or the one after it, if an end of the face met a place before it.
    bounds : tuple of two ints
        Vertices at which the boundary there begins and ends.
    face, fitted, faceted
        As of `first_contacts`.
    """
    first, last = bounds
    before, after = vertex - 1, vertex if by_end else vertex + 1
    level = 0.0 if by_end else _on(on, vertex)[1]
    back = _reached(on, here, level, before, -1, first, face)
    onward = _reached(on, here, level, after, 1, last, face)
    near, far = min(back, onward), max(back, onward)
    flat = near <= face[0] and far >= face[1]
    place = here
    if far - near >= 2.0 * fitted:
        place = 0.5 * (near + far)
    elif not (faceted or flat or (by_end and far - near < fitted)):
        while before >= first and abs(_on(on, before)[0] - here) <= fitted:
            before -= 1
        while after <= last and abs(_on(on, after)[0] - here) <= fitted:
            after += 1
        place = _lowest(on, here, before + 1, after - 1, 1 if by_end else 0, fitted)
    return min(max(place, face[0]), face[1]), flat


@compiled("f2", "i1", "i1", "f2", "f1", "f0", "f0", "f0", "i0", "f0")
def first_contacts(
    vertices: Array,
    firsts: Indices,
    lasts: Indices,
    joints: Array,
    face: Array,
    low: float,
    high: float,
    fitted: float,
    faceted: int,
    rounding: float,
) -> tuple[Array, Array, Flags]:
    """Return the first contacts of faces; see `TurningFaces.contacts`.

    Parameters
    ----------
    vertices, firsts, lasts : ndarray, shapes (n, 2), (n,) and (n,)
        Vertices (s, t) [m], and the index of the first and of the last vertex of each one's
        polyline (`Boundary.runs`).
    joints : ndarray, shape (m, 2)
        Joints (s, t) about which the phalanges turn [m].
    face : ndarray, shape (3,)
        Where the face begins and ends along the phalanx, and its height [m].
    low, high : float
        Angles between which the phalanges turn [rad].
    fitted : float
        Length of rock on each side of a contact to which a parabola is fitted [m].
    faceted : int
        1 if vertices are corners of the rock, 0 if they are places on a smooth curve.
    rounding : float
        Angle by which an angle may fall short of a bound by rounding [rad].

    Returns
    -------
    tuple of (ndarray, ndarray, ndarray of bool), shape (m,) each
        Angles [rad], distances [m] and flags of faces that lie flat, as `TurningFaces.contacts`.
    """
    start, end, height = face
    longest = 0.0
    for i in range(len(vertices) - 1):
        if i != lasts[i]:
            x, y = vertices[i + 1, 0] - vertices[i, 0], vertices[i + 1, 1] - vertices[i, 1]
            longest = max(longest, math.sqrt(x * x + y * y) + 1e-9)  # [m] of rounding
    angles, places = np.full(len(joints), math.nan), np.full(len(joints), math.nan)
    flat = np.zeros(len(joints), dtype=np.bool_)
    for i in range(len(joints)):
        near = _turned(vertices, joints[i], low)
        turn, vertex = _by_end(near, lasts, start, height, longest, rounding)
        here, by_end = start, True
        other, after = _by_end(near, lasts, end, height, longest, rounding)
        if other < turn:
            turn, vertex, here = other, after, end
        other, on = _on_face(near, start, end, height, rounding)
        if other < turn:
            turn, vertex, by_end = other, on, False
        if not low + turn <= high:
            continue
        angles[i] = low + turn
        against = vertices, joints[i], math.cos(angles[i]), math.sin(angles[i]), height
        if not by_end:
            here = _on(against, vertex)[0]
        bounds = firsts[vertex], lasts[vertex]
        places[i], flat[i] = _touched(
            against, here, vertex, by_end, bounds, face[:2], fitted, faceted
        )
    return angles, places, flat


@compiled("f2", "i1", "f2", "f1", "f0")
def pierced_faces(
    vertices: Array, lasts: Indices, joints: Array, face: Array, angle: float
) -> Flags:
    """Return whether the rock's boundary crosses each face, (m,), with the phalanges at an angle.

    ``angle``: of the phalanges [rad]; the other arguments are those of `first_contacts`.
    """
    start, end, height = face
    found = np.zeros(len(joints), dtype=np.bool_)
    for i in range(len(joints)):
        on = _turned(vertices, joints[i], angle)
        for k in range(len(on) - 1):
            gap, after = on[k, 1] - height, on[k + 1, 1] - height
            if k != lasts[k] and (gap < 0.0) != (after < 0.0):
                part = gap / (gap - after)
                crossing = on[k, 0] + part * (on[k + 1, 0] - on[k, 0])
                found[i] |= start <= crossing <= end
    return found
