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

import cmath
import math

import numpy as np

from hand_models.base import Array, Indices, compiled
from hand_models.finger.path_state import AROUND_FIELDS, SETTINGS_RECORD, SHAPE_FIELDS, Record
from hand_models.sections import Complexes, Flags

__all__ = ["near_points", "phalanx_beside", "put_around", "rock_distances"]


@compiled()
def _size(way: complex) -> float:
    """Return the length of a way, in a third of the time of `abs`, which minds extremes."""
    return math.sqrt(way.real * way.real + way.imag * way.imag)


@compiled()
def _from_line(
    places: Complexes, joint: complex, u: complex, start: float, end: float, height: float
) -> Array:
    """Return the distances of places from a line along a phalanx at a height, from start to end."""
    away = np.empty(len(places))
    for i in range(len(places)):
        x, z = places[i].real - joint.real, places[i].imag - joint.imag
        along, above = x * u.real + z * u.imag, z * u.real - x * u.imag - height
        along -= min(max(along, start), end)
        away[i] = math.sqrt(along * along + above * above)
    return away


@compiled()
def _from_tile(shape: Record, seen: complex, lift: float) -> complex:
    """Return the way to a point from the axis under the tile."""
    return seen - complex(min(max(seen.real, shape.near), shape.far), lift)


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
        corner, step = complex(shape.far, lift), complex(shape.end - shape.far, -lift)
        square = step.real * step.real + step.imag * step.imag
        beyond, part = seen - corner, 0.0
        if square > 0.0:
            part = min(max((beyond * step.conjugate()).real / square, 0.0), 1.0)
        beyond -= part * step
        other = _size(beyond)
        if other < distance:
            away, distance = beyond, other
    return away, distance, math.inf if bare else from_tile


@compiled()
def _alone(shape: Record, length: float) -> float:
    """Return how far a bed sinks on a single point of rock that represents a length w [m]."""
    return float(min(shape.fine * math.sqrt(shape.length) / math.sqrt(length), shape.far))


@compiled()
def _level(settings: Record, shape: Record, depths: Array, lengths: Array, first: int) -> float:
    """Return the level h to which the bed sinks [m]; ``first``: index of the least depth."""
    # ‖√w max(0, h − g)‖ is convex in it
    root = shape.fine * math.sqrt(shape.length)
    level = depths[first] + _alone(shape, lengths[first])
    for _ in range(20):
        loads, energy = 0.0, 0.0
        for i in range(len(depths)):
            sunk = max(level - depths[i], 0.0)
            loads += lengths[i] * sunk
            energy += lengths[i] * sunk * sunk
        norm = math.sqrt(energy)
        step = (root - norm) * norm / max(loads, 1e-30)
        if abs(step) <= settings.sum_rounding * shape.far:
            break
        level += step
    return float(level)


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
) -> tuple[float, float, complex, complex]:
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
    """
    settings, shape = settings[0], shape[0]
    ways, depths = np.empty_like(points), np.empty_like(lengths)
    tile_gap, first, back = math.inf, 0, u.conjugate()
    for i in range(len(points)):
        ways[i], away, from_tile = _from_axis(shape, (points[i] - joint) * back, bare[i])
        depths[i] = away - shape.radius
        tile_gap = min(tile_gap, from_tile - shape.radius)
        if depths[i] < depths[first]:
            first = i
    gap = _level(settings, shape, depths, lengths, first) - shape.fine
    tiny = 1e-30  # divides what is zero
    total, place, push = 0.0, 0.0j, 0.0j
    for i in range(len(points)):
        # pressure falls evenly along the rock that the point stands for, from its deeper end
        sunk, fall = gap + depth - depths[i], 0.0
        for k in range(max(i - 1, 0), min(i + 2, len(points))):
            if bare[k] == bare[i] and _size(points[k] - points[i]) < 1.5 * lengths[i]:
                fall = max(fall, 0.5 * (depths[i] - depths[k]))
        if abs(sunk) < fall:
            sunk = (sunk + fall) ** 2 / (4.0 * fall)
        if sunk > 0.0:
            pressed = sunk * lengths[i]
            out = ways[i] / max(depths[i] + shape.radius, tiny)
            total += pressed
            place += pressed * ((points[i] - joint) * back - ways[i] + shape.radius * out)
            push += pressed * out
    return gap, tile_gap, place / max(total, tiny), push / max(_size(push), tiny)


@compiled("c1", "f1", "b1", "c1", "f1", "f1", SHAPE_FIELDS, "c0", "c0", "f0")
def near_points(
    points: Complexes,
    lengths: Array,
    bare: Flags,
    centres: Complexes,
    radii: Array,
    longest: Array,
    shape: Record,
    joint: complex,
    u: complex,
    within: float,
) -> Indices:
    """Return the indices of the points of rock on which a phalanx's gap and contact depend.

    Parameters
    ----------
    points, lengths, bare, centres, radii, longest : ndarray
        Rock in the finger's plane, a row of `Outlines`.
    shape, joint, u
        As of `phalanx_beside`.
    within : float
        Margin: the tile's depth and the largest further motion [m].
    """
    shape, back, count = shape[0], u.conjugate(), len(centres)
    each, within = len(points) // count, within + longest.max()
    whole = _from_line(centres, joint, u, shape.near, shape.end, 0.0)
    # the nearest rock under the tiles bounds what is looked at
    first = np.where(bare[::each], math.inf, whole + radii).argmin()
    nearest, seen = whole[first] + radii[first], (centres[first] - joint) * back
    most = nearest + shape.lift + _alone(shape, longest[first])
    most_tile = _size(_from_tile(shape, seen, shape.lift)) + radii[first]
    found = np.empty(len(points), np.intp)
    size, from_tile = np.empty_like(lengths), np.empty_like(lengths)
    # the bed sinks no lower than with any point alone
    least, least_tile, taken = math.inf, math.inf, 0
    for block in range(count):
        if whole[block] - radii[block] - shape.lift > max(most, most_tile) + within:
            continue
        begin, end = block * each, block * each + each
        seen = (centres[block] - joint) * back
        radius = radii[block] + (shape.lift if bare[begin] != bare[end - 1] else 0.0)
        _, away, off_tile = _from_axis(shape, seen, bare[begin])
        most = min(most, away + radius + _alone(shape, longest[block]))
        most_tile = min(most_tile, off_tile + radius)
        if away - radius > most + within and off_tile - radius > most_tile + within:
            continue
        for i in range(begin, end):
            seen = (points[i] - joint) * back
            _, size[taken], from_tile[taken] = _from_axis(shape, seen, bare[i])
            found[taken] = i
            if size[taken] < least:
                least = min(least, size[taken] + _alone(shape, lengths[i]))
            least_tile = min(least_tile, from_tile[taken])
            taken += 1
    kept = 0
    for i in range(taken):
        if size[i] <= least + within or from_tile[i] <= least_tile + within:
            found[kept] = found[i]
            kept += 1
    return found[:kept]


@compiled("c1", "c1", "c1", "f1", "i0")
def rock_distances(
    places: Complexes, points: Complexes, centres: Complexes, radii: Array, each_place: int
) -> Array:
    """Return the distance of each of m places from the nearest point of rock, shape (m,) [m].

    Parameters
    ----------
    places : ndarray of complex, shape (m,)
        x + i z [m].
    points, centres, radii : ndarray
        Rock in the finger's plane, a row of `Outlines`.
    each_place : int
        1 for the distance of each place; 0, much faster, for a result whose last number is the
        least distance of all places.
    """
    found = np.full(len(places), math.inf)
    each = len(points) // len(centres)
    for k in range(len(places)):
        if k and not each_place:
            found[k] = found[k - 1]
        for block in range(len(centres)):
            if _size(centres[block] - places[k]) - radii[block] < found[k]:
                for i in range(block * each, block * each + each):
                    found[k] = min(found[k], _size(points[i] - places[k]))
    return found


@compiled()
def _engaged(settings: Record, gap: float, travel: float, exponent: float) -> float:
    """Return the share of spines that reach the rock, as `hand_models.tile.engaged_share` does."""
    if gap <= 0.0:
        return 1.0
    share = 1.0 - (gap / travel) ** exponent if gap < travel else 0.0
    return share if share > settings.least_share else 0.0


@compiled()
def _on_rock(
    places: Complexes,
    ways: Complexes,
    behind: Array,
    near: Indices,
    across: Array,
    settings: Record,
    shape: Record,
    joint: complex,
    u: complex,
    tile_gap: float,
) -> tuple[float, float]:
    """Return the share of a tile's spines that reach the rock, and the middle of these [m]."""
    strips = len(across)
    if strips == 1:
        share = _engaged(settings, tile_gap, shape.travel, shape.exponent)
        return share, across[0] * share / max(share, settings.sum_rounding)
    if tile_gap >= shape.travel:
        return 0.0, 0.0
    away = _from_line(places[near], joint, u, shape.near, shape.far, shape.lift)
    least, farther, back = away.min(), np.full(strips, math.inf), u.conjugate()
    for i in range(len(near)):
        # no spine reaches beyond its travel
        if away[i] - least + tile_gap < shape.travel:
            place, way = (places[near[i]] - joint) * back, ways[near[i]] * back
            for k in range(strips):
                depth = behind[near[i], k]
                above = place.imag + depth * way.imag - shape.lift
                if depth < math.inf and above < farther[k]:
                    along = place.real + depth * way.real
                    along -= min(max(along, shape.near), shape.far)
                    farther[k] = min(farther[k], math.sqrt(along * along + above * above))
    total, middle = 0.0, 0.0
    for k in range(strips):
        part = _engaged(settings, tile_gap + (farther[k] - least), shape.travel, shape.exponent)
        total += part
        middle += part * across[k]
    return total / strips, middle / max(total, settings.sum_rounding)


@compiled(
    *(SETTINGS_RECORD.dtype, SHAPE_FIELDS, "f1", "f1", AROUND_FIELDS),
    *("c1", "f1", "c1", "f1", "f1", "b1", "c1", "c1", "f2", "f1"),
)
def put_around(
    settings: Record,
    shape: Record,
    depth: Array,
    q: Array,
    found: Record,
    points: Complexes,
    lengths: Array,
    centres: Complexes,
    radii: Array,
    longest: Array,
    bare: Flags,
    places: Complexes,
    ways: Complexes,
    behind: Array,
    across: Array,
) -> None:
    """Write gaps, engagement and lever arms at joint angles, and their finite differences.

    Parameters
    ----------
    settings, shape : record
        `FingerSettings` and `PhalanxShape`.
    depth : ndarray, shape (3,)
        Depth to which each tile is pressed into its bed of springs [m].
    q : ndarray, shape (3,)
        Joint angles [rad].
    found : record of `AROUND_FIELDS`
        Result, written over.
    points, lengths, centres, radii, longest, bare, places, ways, behind, across : ndarray
        Rock in the finger's plane, a row of `Outlines`.
    """
    count, turn, bar, found = len(q), settings[0].derivative_turn, shape[0], found[0]
    joints = np.zeros((count + 1, count), np.complex128)
    u = np.zeros_like(joints)
    # as it stands, and with each joint in turn by a small step
    for pose in range(count + 1):
        angle, joint = 0.0, 0.0j
        for j in range(count):
            angle += q[j] + (turn if pose == j + 1 else 0.0)
            joints[pose, j], u[pose, j] = joint, cmath.exp(1j * angle)
            joint += bar.end * u[pose, j]
    for j in range(count):
        # two points may come nearer to each other by the way of each
        within = depth[j] + turn * 2.0 * count * (bar.end + bar.radius + depth[j])
        near = near_points(
            points, lengths, bare, centres, radii, longest, shape, joints[0, j], u[0, j], within
        )
        near_at, near_lengths, near_bare = points[near], lengths[near], bare[near]
        strips = np.empty(0, np.intp)
        # by the joints before it and its own
        for pose in range(j + 2):
            joint, along = joints[pose, j], u[pose, j]
            gap, tile_gap, place, push = phalanx_beside(
                near_at, near_lengths, near_bare, settings, shape, joint, along, depth[j]
            )
            reach = bar.travel - tile_gap + within
            if pose == 0 and reach > 0.0 and len(across) > 1:
                away = _from_line(places, joint, along, bar.near, bar.far, bar.lift)
                strips = np.flatnonzero(away <= away.min() + reach)
            share, middle = _on_rock(
                places, ways, behind, strips, across, settings[0], bar, joint, along, tile_gap
            )
            # a phalanx that presses aside, with its end, has its spines beside the rock
            share = _engaged(settings[0], 1.0 - share * push.imag, 1.0, 1.0)
            if pose == 0:
                found.gap[j], found.share[j] = gap, share
                found.place[j], found.push[j], found.across[j] = place, push, middle
            else:
                found.d_gap[j, pose - 1] = (gap - found.gap[j]) / turn
                found.d_share[j, pose - 1] = (share - found.share[j]) / turn
            for i in range(j + 1):
                # from joint i to contact j, in the axes of its force
                arm = joint + place * along - joints[pose, i]
                arm *= (push * along).conjugate()
                if pose == 0:
                    found.a[i, j], found.b[i, j] = -arm.real, -arm.imag
                else:
                    found.d_a[i, j, pose - 1] = (-arm.real - found.a[i, j]) / turn
                    found.d_b[i, j, pose - 1] = (-arm.imag - found.b[i, j]) / turn
