"""Gaps, engagement and lever arms of a finger at its joint angles, with derivatives (compiled).

Derivatives by the joint angles are differences over a small turn of each joint. For so small a turn
only that rock counts which, without it, counts or is near to counting: it is looked for once.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from hand_models.base import Array, Indices, compiled
from hand_models.finger.path_state import (
    AROUND_FIELDS,
    DRIVE_FIELDS,
    SETTINGS_RECORD,
    SHAPE_FIELDS,
    Record,
    Records,
)
from hand_models.finger.phalanx_gaps import near_points, phalanx_beside
from hand_models.finger.phalanx_shape import PhalanxShape
from hand_models.sections import Complexes, Outlines

__all__ = ["AROUND_PARTS", "ROCK_TYPES", "around_rock", "put_around"]

AROUND_PARTS = (near_points, phalanx_beside)
"""Compiled functions that `put_around` calls."""

ROCK_TYPES = ("c2 f2 b2", "c2 f2 c2 f2 f2", "c2 c2 f3", "c2 f2", "f2")
"""Types of `Outlines.arrays`, as of `compiled`."""

Rock = tuple[Any, ...]
"""`Outlines.arrays`, or one finger's."""

Beside = tuple[float, float, complex, complex, Array, Array]
"""What `phalanx_beside` returns."""

Strips = tuple[Complexes, Complexes, Array]
"""Places, ways and behind of `Outlines`."""


@compiled()
def _engaged(settings: Record, gap: float, travel: float, exponent: float) -> float:
    """Return the share of spines that reach the rock, as `hand_models.tile.engaged_share` does."""
    if gap <= 0.0:
        return 1.0
    # the first power of a number is that number, found in a tenth of the time
    part = gap / travel if exponent == 1.0 else (gap / travel) ** exponent
    share = 1.0 - part if gap < travel else 0.0
    return share if share > settings.least_share else 0.0


@compiled()
def _under_tile(shape: Record, place: complex, joint: complex, u: complex) -> float:
    """Return the distance of a place from the bar's axis under the tile [m]."""
    x, z = place.real - joint.real, place.imag - joint.imag
    along, above = x * u.real + z * u.imag, z * u.real - x * u.imag - shape.lift
    along -= min(max(along, shape.near), shape.far)
    return math.sqrt(along * along + above * above)


@compiled()
def _near_places(
    places: Complexes,
    centres: Complexes,
    radii: Array,
    shape: Record,
    joint: complex,
    u: complex,
    reach: float,
) -> Indices:
    """Return the places that are farther from under the tile than the nearest by at most a reach.

    ``centres``, ``radii``: of the circles about the blocks of places [m].
    """
    count, first, least = len(centres), 0, math.inf
    each, bound = len(places) // count, np.empty(count)
    for i in range(count):
        bound[i] = _under_tile(shape, centres[i], joint, u) - radii[i]
        first = i if bound[i] < bound[first] else first
    for i in range(first * each, first * each + each):
        least = min(least, _under_tile(shape, places[i], joint, u))
    found, away, total = np.empty(len(places), np.intp), np.empty(len(places)), 0
    for block in range(count):
        if bound[block] <= least + reach:
            for i in range(block * each, block * each + each):
                found[total], away[total] = i, _under_tile(shape, places[i], joint, u)
                least = min(least, away[total])
                total += 1
    kept = 0
    for i in range(total):
        if away[i] <= least + reach:
            found[kept] = found[i]
            kept += 1
    return found[:kept]


@compiled()
def _strips(
    rock: Strips,
    near: Indices,
    shape: Record,
    joint: complex,
    u: complex,
    tile_gap: float,
    margin: float,
) -> tuple[Array, Indices]:
    """Return how much farther than the nearest place rock is in each strip, and the places for it.

    Parameters
    ----------
    rock : tuple
        Places, ways and behind of `Outlines`.
    near : ndarray of int
        Places that may count.
    shape, joint, u
        As of `phalanx_beside`.
    tile_gap : float
        Gap of the tile [m].
    margin : float
        How much nearer a place may come by the turns in which its rock is to count as well, [m];
        negative to look for no places.

    Returns
    -------
    farther : ndarray, shape (k,)
        Infinite where no spine reaches [m].
    live : ndarray of int
        Those of ``near`` that count, or may within the margin.
    """
    (places, ways, behind), back, strips = rock, u.conjugate(), rock[2].shape[1]
    away, least = np.empty(len(near)), math.inf
    for i in range(len(near)):
        away[i] = _under_tile(shape, places[near[i]], joint, u)
        least = min(least, away[i])
    # squares of distances, in loops without a branch, several strips at once
    squares, farther = np.empty((len(near), strips)), np.full(strips, math.inf)
    for i in range(len(near)):
        seen, into = (places[near[i]] - joint) * back, ways[near[i]] * back
        depths, square = behind[near[i]], squares[i]
        for k in range(strips):
            along, above = seen.real + depths[k] * into.real, seen.imag + depths[k] * into.imag
            along, above = along - min(max(along, shape.near), shape.far), above - shape.lift
            square[k] = along * along + above * above
        # no spine reaches beyond its travel
        if away[i] - least + tile_gap < shape.travel:
            for k in range(strips):
                farther[k] = square[k] if square[k] < farther[k] else farther[k]
    farther = np.sqrt(farther)
    live, count, most = np.empty(len(near), np.intp), 0, (farther + margin) ** 2
    for i in range(len(near) if margin >= 0.0 else 0):
        counts = 1 if away[i] <= least + margin else 0
        if away[i] - least + tile_gap < shape.travel + 2.0 * margin:
            for k in range(strips):
                counts += squares[i, k] <= most[k]
        live[count] = near[i]
        count += 1 if counts else 0
    return farther - least, live[:count]


@compiled()
def _on_rock(
    settings: Record, shape: Record, across: Array, tile_gap: float, farther: Array
) -> tuple[float, float]:
    """Return the share of a tile's spines that reach the rock, and the middle of these [m]."""
    total, middle = 0.0, 0.0
    for k in range(len(across)):
        part = _engaged(settings, tile_gap + farther[k], shape.travel, shape.exponent)
        total += part
        middle += part * across[k]
    return total / len(across), middle / max(total, settings.sum_rounding)


@compiled()
def _live(
    shape: Record,
    lengths: Array,
    depths: Array,
    tile_depths: Array,
    level: float,
    nearer: float,
) -> Indices:
    """Return the points that count for gap, place and push, or may where rock comes a bit nearer.

    Parameters
    ----------
    lengths, depths, tile_depths : ndarray, shape (p,)
        Length of each point, and its distances, as from `phalanx_beside` [m].
    level : float
        Level of the bed where it is pressed in: the gap and the tile's depth [m].
    nearer : float
        By how much less than now distances may differ from each other [m].
    """
    least, least_tile = depths.min(), tile_depths.min()
    highest = least
    for i in range(len(depths)):
        if depths[i] <= least + nearer:
            # whichever is nearest then, the bed sinks no lower than with it alone
            alone = shape.fine * math.sqrt(shape.length / lengths[i])
            highest = max(highest, depths[i] + alone)
    live, count, last = np.empty(len(depths), np.intp), 0, -1
    for i in range(len(depths)):
        presses = level - depths[i] > -lengths[i] - 2.0 * nearer
        if presses or depths[i] <= highest + nearer or tile_depths[i] <= least_tile + nearer:
            # with its neighbours, which say how pressure falls there
            for k in range(max(i - 1, last + 1, 0), min(i + 2, len(depths))):
                live[count], last = k, k
                count += 1
    return live[:count]


@compiled()
def _row(rocks: Rock, i: int) -> Rock:
    """Return the rock in the plane of one finger."""
    (points, lengths, bare), blocks, strips, circles, across = rocks
    (centres, radii, halves, thick, longest), (places, ways, behind) = blocks, strips
    return (
        (points[i], lengths[i], bare[i]),
        (centres[i], radii[i], halves[i], thick[i], longest[i]),
        *((places[i], ways[i], behind[i]), (circles[0][i], circles[1][i]), across[i]),
    )


@compiled(
    *(*AROUND_PARTS, SETTINGS_RECORD.dtype, SHAPE_FIELDS),
    *("f1", "f1", AROUND_FIELDS, ROCK_TYPES, "i0"),
)
def put_around(
    nearby: Callable[..., Indices],
    beside: Callable[..., Beside],
    settings: Record,
    shape: Record,
    depth: Array,
    q: Array,
    found: Record,
    rocks: Rock,
    finger: int,
) -> None:
    """Write gaps, engagement and lever arms at joint angles, and their finite differences.

    Parameters
    ----------
    nearby, beside : function
        `near_points` and `phalanx_beside`.
    settings, shape : record
        `FingerSettings` and `PhalanxShape`.
    depth : ndarray, shape (3,)
        Depth to which each tile is pressed into its bed of springs [m].
    q : ndarray, shape (3,)
        Joint angles [rad].
    found : record of `AROUND_FIELDS`
        Result, written over.
    rocks, finger : tuple of ndarray, int
        `Outlines.arrays` of several fingers, and the index of this one.
    """
    (points, lengths, bare), blocks, strips, circles, across = _row(rocks, finger)
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
        nearer = turn * 2.0 * count * (bar.end + bar.radius + depth[j])
        within = depth[j] + nearer
        near = nearby(points, lengths, bare, blocks, shape, joints[0, j], u[0, j], within)
        near_at, near_lengths, near_bare = points[near], lengths[near], bare[near]
        places, farther = np.empty(0, np.intp), np.zeros(len(across))
        # by the joints before it and its own
        for pose in range(j + 2):
            joint, along = joints[pose, j], u[pose, j]
            gap, tile_gap, place, push, depths, tile_depths = beside(
                near_at, near_lengths, near_bare, settings, shape, joint, along, depth[j]
            )
            if pose == 0:
                near = _live(bar, near_lengths, depths, tile_depths, gap + depth[j], nearer)
                near_at, near_lengths, near_bare = (
                    near_at[near],
                    near_lengths[near],
                    near_bare[near],
                )
            share, middle = 0.0, 0.0
            reach = bar.travel - tile_gap + (within if pose == 0 else 0.0)
            if len(across) > 1 and reach > 0.0:
                if pose == 0:
                    places = _near_places(
                        strips[0], circles[0], circles[1], bar, joint, along, reach
                    )
                margin = nearer if pose == 0 else -1.0
                farther, live = _strips(strips, places, bar, joint, along, tile_gap, margin)
                places = live if pose == 0 else places
            if len(across) == 1 or tile_gap < bar.travel:
                share, middle = _on_rock(settings[0], bar, across, tile_gap, farther)
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


@compiled(
    *(put_around, *AROUND_PARTS, SETTINGS_RECORD.dtype, SHAPE_FIELDS),
    *(DRIVE_FIELDS, "f2", AROUND_FIELDS, ROCK_TYPES),
)
def _put_all(
    around: Callable[..., None],
    nearby: Callable[..., Indices],
    beside: Callable[..., Beside],
    settings: Record,
    shape: Record,
    drives: Record,
    q: Array,
    found: Record,
    rocks: Rock,
) -> None:
    """Do for n fingers what `put_around` does."""
    for i in range(len(q)):
        around(nearby, beside, settings, shape, drives[i].depth, q[i], found[i : i + 1], rocks, i)


def around_rock(rock: Outlines, shape: PhalanxShape, drive: Records, q: Array) -> Records:
    """Return gaps, engagement and lever arms of n fingers at joint angles, with derivatives.

    Parameters
    ----------
    rock : Outlines
        Rock in the plane of each finger.
    shape : PhalanxShape
    drive : ndarray, shape (n,)
        Records of `DRIVE_FIELDS`.
    q : ndarray, shape (n, 3)
        Joint angles [rad].

    Returns
    -------
    ndarray, shape (n,)
        Records of `AROUND_FIELDS`, with derivatives by the joint angles.
    """
    found, angles = np.zeros(len(q), AROUND_FIELDS), np.ascontiguousarray(q)
    parts = put_around, *AROUND_PARTS
    _put_all(*parts, SETTINGS_RECORD, shape.record, drive, angles, found, rock.arrays)
    return found
