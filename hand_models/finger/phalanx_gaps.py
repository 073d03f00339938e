"""Gaps between the phalanges of a finger and rock, and where contact forces act (compiled).

Rock is a set of points along its boundary, each with its length w. A point's depth g is its
distance from a phalanx's axis less the bar's radius (`hand_models.finger.phalanx_shape`). Phalanx
and rock touch where g is zero. So that the contact does not jump from one bump to another as the
phalanx turns, the *gap* is the level h to which a bed of springs between phalanx and rock would
sink under a small, fixed energy,

    Σ w max(0, h − g)² = tile length × fine²,

less ``fine``: zero for a face that lies flat, and within a few ``fine`` of the least g elsewhere.

**Where a contact's force acts.** A tile rests on a bed of springs that is pressed in by ``depth``
beyond first touch. With p = w max(0, gap + depth − g) the force acts at the mean, weighted by p,
of the places of the phalanx nearest to the rock's points, along the mean of their directions: in
the middle of a face that lies flat, at the place of least distance on rock that bends away on both
sides, at the face's end on rock under that end. At the edge of what is pressed, p is its mean along
the rock that the point stands for: the place changes without a jump.
"""

from __future__ import annotations

import math

import numpy as np

from hand_models.base import Array, Indices, compiled
from hand_models.finger.path_state import SETTINGS_RECORD, SHAPE_FIELDS, Record
from hand_models.sections import Complexes, Flags

__all__ = ["near_points", "phalanx_beside"]

Blocks = tuple[Complexes, Array, Complexes, Array, Array]
"""Rows of `Outlines`: its centres, radii, halves, thick and longest."""


@compiled()
def _size(way: complex) -> float:
    """Return the length of a way, in a third of the time of `abs`, which minds extremes."""
    return math.sqrt(way.real * way.real + way.imag * way.imag)


@compiled()
def _off_line(
    place: complex, joint: complex, u: complex, start: float, end: float, height: float
) -> float:
    """Return the distance of a place from a line along a phalanx at a height, from start to end."""
    x, z = place.real - joint.real, place.imag - joint.imag
    along, above = x * u.real + z * u.imag, z * u.real - x * u.imag - height
    along -= min(max(along, start), end)
    return math.sqrt(along * along + above * above)


@compiled()
def _from_tile(shape: Record, seen: complex, lift: float) -> complex:
    """Return the way to a point from the axis under the tile."""
    return seen - complex(min(max(seen.real, shape.near), shape.far), lift)


@compiled()
def _from_tip(shape: Record, seen: complex, lift: float) -> complex:
    """Return the way to a point from the axis beyond the tile."""
    corner, step = complex(shape.far, lift), complex(shape.end - shape.far, -lift)
    square = step.real * step.real + step.imag * step.imag
    beyond, part = seen - corner, 0.0
    if square > 0.0:
        part = min(max((beyond * step.conjugate()).real / square, 0.0), 1.0)
    return beyond - part * step


@compiled()
def _from_axis(shape: Record, seen: complex, bare: bool) -> tuple[complex, float, float]:
    """Return the way to a point from the axis, its length, and that from under the tile [m].

    The axis of a bare frame has no lift. Its points are infinitely far from under the tile.
    """
    lift = 0.0 if bare else shape.lift
    away = _from_tile(shape, seen, lift)
    distance = from_tile = _size(away)
    # a point over the tile is nearest to it
    if seen.real > shape.far or seen.imag < lift:
        beyond = _from_tip(shape, seen, lift)
        other = _size(beyond)
        if other < distance:
            away, distance = beyond, other
    return away, distance, math.inf if bare else from_tile


@compiled()
def _alone(shape: Record, length: float) -> float:
    """Return how far a bed sinks on a single point of rock that represents a length w [m]."""
    return float(min(shape.fine * math.sqrt(shape.length) / math.sqrt(length), shape.far))


@compiled()
def _level(settings: Record, shape: Record, depths: Array, lengths: Array) -> float:
    """Return the level h to which the bed sinks [m]."""
    # ‖√w max(0, h − g)‖ is convex in it
    root, first = shape.fine * math.sqrt(shape.length), np.argmin(depths)
    alone = _alone(shape, lengths[first])
    level = depths[first] + alone
    # no higher than with the nearest point alone: those beyond do not count
    most = level if alone < shape.far else math.inf
    pressed, count = np.empty((len(depths), 2)), 0
    for i in range(len(depths)):
        pressed[count, 0], pressed[count, 1] = depths[i], lengths[i]
        count += 1 if depths[i] <= most else 0
    for _ in range(20):
        loads, energy = 0.0, 0.0
        for i in range(count):
            sunk = max(level - pressed[i, 0], 0.0)
            loads += pressed[i, 1] * sunk
            energy += pressed[i, 1] * sunk * sunk
        norm = math.sqrt(energy)
        step = (root - norm) * norm / max(loads, 1e-30)
        if abs(step) <= settings.sum_rounding * shape.far:
            break
        level += step
    return float(level)


@compiled()
def _fall(points: Complexes, lengths: Array, bare: Flags, depths: Array, i: int) -> float:
    """Return by how much rock half way to the points next to one is less deep, at most [m]."""
    fall = 0.0
    for k in range(max(i - 1, 0), min(i + 2, len(points))):
        if bare[k] == bare[i] and _size(points[k] - points[i]) < 1.5 * lengths[i]:
            fall = max(fall, 0.5 * (depths[i] - depths[k]))
    return fall


@compiled("c1", "f1", "b1", SETTINGS_RECORD.dtype, SHAPE_FIELDS, "c0", "c0", "f0")
def phalanx_beside(
    points: Complexes,
    lengths: Array,
    bare: Flags,
    settings: Record,
    shape: Record,
    joint: complex,
    u: complex,
    depth: float,
) -> tuple[float, float, complex, complex, Array, Array]:
    """Return gap, and place and direction of the contact force, of a phalanx beside rock.

    Parameters
    ----------
    points : ndarray of complex, shape (p,)
        x + i z of points of rock in the finger frame F [m].
    lengths : ndarray, shape (p,)
        Length w of the rock's boundary that each point represents [m].
    bare : ndarray of bool, shape (p,)
        True for rock that the bare frame meets, beside the tiles.
    settings, shape : record
        `FingerSettings` and `PhalanxShape`.
    joint, u : complex
        x + i z of the phalanx's joint [m], and the unit vector along the phalanx.
    depth : float
        Depth to which the tile is pressed into its bed of springs [m].

    Returns
    -------
    gap, tile_gap : float
        Distance from the phalanx to the rock, negative where rock is inside the phalanx; and from
        the tile's face [m].
    place, push : complex
        Place where the contact's force acts [m], and its unit vector toward the rock, in the
        phalanx's axes: real part along it from its joint, imaginary part toward the rock.
    depths, tile_depths : ndarray, shape (p,)
        Distance of each point from the bar, and from under the tile less the bar's radius, infinite
        for bare frames [m].
    """
    settings, shape, back, count = settings[0], shape[0], u.conjugate(), len(points)
    ways, depths, tile_depths = np.empty(count, np.complex128), np.empty(count), np.empty(count)
    for i in range(count):
        ways[i], away, from_tile = _from_axis(shape, (points[i] - joint) * back, bare[i])
        depths[i], tile_depths[i] = away - shape.radius, from_tile - shape.radius
    gap = _level(settings, shape, depths, lengths) - shape.fine
    tiny = 1e-30  # divides what is zero
    # numbers one by one: compiled products with complex numbers take twice as long
    total, along, above, push_s, push_t, last = 0.0, 0.0, 0.0, 0.0, 0.0, count - 1
    for i in range(count):
        sunk, beside = gap + depth - depths[i], min(depths[max(i - 1, 0)], depths[min(i + 1, last)])
        if abs(sunk) < 0.5 * (depths[i] - beside):
            # pressure falls evenly along the rock that the point stands for, from its deeper end
            fall = _fall(points, lengths, bare, depths, i)
            if abs(sunk) < fall:
                sunk = (sunk + fall) ** 2 / (4.0 * fall)
        if sunk > 0.0:
            pressed, away = sunk * lengths[i], max(depths[i] + shape.radius, tiny)
            s, t, seen = ways[i].real / away, ways[i].imag / away, (points[i] - joint) * back
            total += pressed
            along += pressed * (seen.real - ways[i].real + shape.radius * s)
            above += pressed * (seen.imag - ways[i].imag + shape.radius * t)
            push_s += pressed * s
            push_t += pressed * t
    push, total = complex(push_s, push_t), max(total, tiny)
    place, push = complex(along / total, above / total), push / max(_size(push), tiny)
    return gap, tile_depths.min(), place, push, depths, tile_depths


@compiled()
def _less(
    shape: Record, least: tuple[float, float], away: float, off_tile: float, length: float
) -> tuple[float, float]:
    """Return how low a bed sinks and how near the tile is, at most, with one point more."""
    axis, tile = least
    if away < axis:
        axis = min(axis, away + _alone(shape, length))
    return axis, min(tile, off_tile)


@compiled()
def _most(least: tuple[float, float], within: float) -> tuple[float, float]:
    """Return distances from the axis and from under the tile up to which points count [m]."""
    return least[0] + within, least[1] + within if least[1] < math.inf else -math.inf


@compiled()
def _look(
    points: Complexes,
    bare: Flags,
    lengths: Array,
    begin: int,
    count: int,
    shape: Record,
    joint: complex,
    u: complex,
    least: tuple[float, float],
) -> tuple[float, float]:
    """Return how low a bed sinks and how near the tile is, at most, with some points more."""
    for i in range(begin, begin + count):
        _, away, off_tile = _from_axis(shape, (points[i] - joint) * u.conjugate(), bare[i])
        least = _less(shape, least, away, off_tile, lengths[i])
    return least


@compiled()
def _nearest(
    shape: Record, seen: complex, half: complex, thick: float, bare: bool
) -> tuple[float, float]:
    """Return bounds below the distances of a block of rock from the axis and from under the tile.

    The distance from a straight part of the axis grows, along any line, by no less than with the
    slope that it has at a place: for a block that lies along the axis it hardly falls.
    """
    lift, least, of_tile = 0.0 if bare else shape.lift, math.inf, math.inf
    for way in (_from_tip(shape, seen, lift), _from_tile(shape, seen, lift)):
        away = _size(way)
        slope = abs(way.real * half.real + way.imag * half.imag) / max(away, 1e-30)
        of_tile = away - (slope if away > 0.0 else _size(half)) - thick
        least = min(least, of_tile)
    return least, math.inf if bare else of_tile


@compiled("c1", "f1", "b1", "c1 f1 c1 f1 f1", SHAPE_FIELDS, "c0", "c0", "f0")
def near_points(
    points: Complexes,
    lengths: Array,
    bare: Flags,
    blocks: Blocks,
    shape: Record,
    joint: complex,
    u: complex,
    within: float,
) -> Indices:
    """Return the indices of the points of rock on which a phalanx's gap and contact depend.

    Parameters
    ----------
    points, lengths, bare : ndarray
        Rock in the finger's plane, a row of `Outlines`.
    blocks : tuple of ndarray
        `Blocks` of these points.
    shape, joint, u
        As of `phalanx_beside`.
    within : float
        Margin: the tile's depth and the largest further motion [m].
    """
    centres, radii, halves, thick, longest = blocks
    shape, back, count = shape[0], u.conjugate(), len(centres)
    each, long = len(points) // count, 0.0
    # blocks by the least distance that they may have from the bar as if it had no lift; the nearest
    # of those under tiles bounds which of them are looked at, and the nearest of these which points
    bound, first, low = np.empty(count), 0, math.inf
    for i in range(count):
        away = _off_line(centres[i], joint, u, shape.near, shape.end, 0.0)
        bound[i], long = away - radii[i] - shape.lift, max(long, longest[i])
        if away + radii[i] < low and not bare[i * each]:
            first, low = i, away + radii[i]
    within, nothing = within + long, (math.inf, math.inf)
    least = _look(points, bare, lengths, first * each, each, shape, joint, u, nothing)
    axis, tile, which = np.empty(count), np.empty(count), np.empty(count, np.intp)
    looked, low, low_tile, under, most = 0, math.inf, math.inf, first, _most(least, within)
    for i in range(count):
        if bound[i] <= max(most[0], most[1]):
            begin, half = i * each, halves[i] * back
            axis[looked], tile[looked] = _nearest(
                shape, (centres[i] - joint) * back, half, thick[i], bare[begin]
            )
            # on a block that stands for next to nothing the bed sinks far
            if axis[looked] + radii[i] < low and longest[i] > 0.01 * long:
                first, low = i, axis[looked] + radii[i]
            if tile[looked] + radii[i] < low_tile:
                under, low_tile = i, tile[looked] + radii[i]
            # a block of both kinds
            axis[looked] -= shape.lift if bare[begin] != bare[begin + each - 1] else 0.0
            which[looked] = i
            looked += 1
    for i in (first, under):
        least = _look(points, bare, lengths, i * each, each, shape, joint, u, least)
    found, total = np.empty(looked * each, np.intp), 0
    size, from_tile = np.empty(looked * each), np.empty(looked * each)
    for k in range(looked):
        most = _most(least, within)
        if axis[k] <= most[0] or tile[k] <= most[1]:
            for i in range(which[k] * each, which[k] * each + each):
                _, size[total], from_tile[total] = _from_axis(
                    shape, (points[i] - joint) * back, bare[i]
                )
                least = _less(shape, least, size[total], from_tile[total], lengths[i])
                found[total] = i
                total += 1
    most, kept = _most(least, within), 0
    for i in range(total):
        if size[i] <= most[0] or from_tile[i] <= most[1]:
            found[kept] = found[i]
            kept += 1
    return found[:kept]
