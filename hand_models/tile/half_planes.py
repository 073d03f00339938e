"""Half-planes inside and outside a tile's limit surface, and the gap between them.

The surface r = F(d), d a direction of the load, is boat-shaped and not convex: the region
{ r d : r ≤ F(d) } has dents, at φ_max in the finger plane and, deeper, where the load turns
sideways while it pulls off. A planner needs a convex region inside it. In the finger plane that is
bounded by chords a T + b P ≤ c of the curve of Eq. 21 (T the shear, P = −N the pull). Each chord
bounds the loads that, seen from the side, are between its two ends: it takes as much lateral load Y
as keeps all of them inside,

    a_Y = c max_d ((1 / F(d) − (a t + b p) / c) / y),    d = (t, p, y).

The chord itself is moved inward where the curve between its ends has a dent (c = the least of
F(φ) (a cos φ + b sin φ)), as for laws that fall fast at first.

Both extremes are bounded, not sampled (`hand_models.tile.direction_boxes`): f_s and λ never rise
with φ, so that in a box of directions F is between two bounds. Half-planes are inside the surface
by construction, whatever its law.

A convex region runs straight from its farthest lateral load to its farthest pull, so the lateral
strength that a tile loses under pull-off is lost in pure lateral load too; pressing gives it back.
The outer region has the same normals, moved out until they touch: c = max_d F(d) (a t + b p +
a_Y y).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import BASE_TOLERANCES, Array
from hand_models.tile.direction_boxes import DirectionBoxes, bounded

__all__ = [
    "BoundsGap",
    "HalfPlane",
    "bounds_gap",
    "directional_strength",
    "inner_half_planes",
    "outer_half_planes",
]

SEARCH_MARGIN: Final = 1e-4
"""Relative margin added to a maximum found on grids, within which it is then proved."""


class TileLaw(Protocol):
    """Protocol of a limit surface F(φ, θ), with the numbers of `Surface` and its factors f_s and λ.

    φ is the load's angle from shear toward pull-off, θ its azimuth from the drag [rad]. Neither
    factor may rise with φ. Laws that are equal have equal hashes.
    """

    @property
    def shear_limit(self) -> float: ...
    @property
    def pull_off_limit(self) -> float: ...
    @property
    def pull_off_angle(self) -> float: ...
    @property
    def lateral_limit(self) -> float: ...
    @property
    def compression_gain(self) -> float: ...
    @property
    def half_planes(self) -> int: ...
    def __hash__(self) -> int: ...

    def strength(self, angle: ArrayLike, azimuth: ArrayLike = 0.0) -> Array:
        """Return F(φ, θ), the largest load of a tile in a direction [N].

        ``angle``: φ from shear toward pull-off; ``azimuth``: θ from the drag [rad].
        """
        ...

    def straight_strength(self, angle: ArrayLike) -> Array:
        """Return f_s(φ), the largest load of a tile in the finger's plane [N].

        ``angle``: φ from shear toward pull-off [rad].
        """
        ...

    def sideways_share(self, angle: ArrayLike) -> Array:
        """Return λ(φ), strength straight sideways over strength along the drag.

        ``angle``: φ from shear toward pull-off [rad].
        """
        ...


class HalfPlane(NamedTuple):
    """A limit ``a_shear T + a_normal N + a_lateral |Y| ≤ capacity`` of one tile.

    Attributes
    ----------
    limit : str
        ``shear`` for the half-plane that bounds shear under pressing, ``pull_off`` for the others.
    a_shear, a_normal, a_lateral : float
        Coefficients of the tile's shear T, normal load N (> 0 pressing) and lateral load Y.
    capacity : float
        Right-hand side [N].
    """

    limit: str
    a_shear: float
    a_normal: float
    a_lateral: float
    capacity: float


class BoundsGap(NamedTuple):
    """Gap between half-planes and the limit surface, for loads that pull off (T ≥ 0, N ≤ 0).

    T is the shear of a tile, N its normal load (> 0 pressing).

    Attributes
    ----------
    inner_volume, outer_volume : float
        Volume within the inner and within the outer half-planes, over that within the surface.
    inner_worst, outer_worst : float
        Over all directions of load: the least ratio of the inner half-planes' strength to the
        surface's, and the largest ratio of the outer half-planes' strength to it.
    """

    inner_volume: float
    outer_volume: float
    inner_worst: float
    outer_worst: float


@lru_cache(maxsize=256)
def inner_half_planes(surface: TileLaw) -> tuple[HalfPlane, ...]:
    """Return half-planes whose intersection is inside the limit surface, for shear T ≥ 0.

    The last 256 results are kept in an LRU cache.

    Parameters
    ----------
    surface : TileLaw
        Such as a `Surface`.

    Returns
    -------
    tuple of HalfPlane
        The half-plane that bounds shear, then the chords of the curve of Eq. 21 from pure shear to
        the pull-off angle φ_max, moved inward where the curve has a dent. The last chord runs on
        beyond φ_max; where it would leave the curve there (which stays at f_min), one more chord,
        down to pure pull-off, closes the region.
    """
    nodes = _nodes(surface)
    # a gain steeper than the first chord would cut into the side of pull-off
    shear, pull, _ = _chord(*nodes[:2])
    gain = min(surface.compression_gain, pull / shear if shear > 0.0 else math.inf)
    sideways = surface.shear_limit / surface.lateral_limit
    if gain > 0.0:
        # pressed sideways, it may gain no more than γ N either
        sideways = max(sideways, gain / surface.compression_gain)
    pieces = [HalfPlane("shear", 1.0, -gain, sideways, surface.shear_limit)]
    sectors = [math.atan2(pull, shear) for shear, pull in nodes[:-1]] + [math.pi / 2]
    for (start, end), sector in zip(
        itertools.pairwise(nodes), itertools.pairwise(sectors), strict=True
    ):
        shear, pull, capacity = _inside(surface, _chord(start, end), sector)
        sideways = _lateral_coefficient(surface, (shear, pull, capacity), sector)
        pieces.append(HalfPlane("pull_off", shear, -pull, sideways, capacity))
    return tuple(pieces)


def outer_half_planes(surface: TileLaw) -> tuple[HalfPlane, ...]:
    """Return half-planes that contain the limit surface, for shear T ≥ 0.

    Their normals are those of `inner_half_planes`. Where pressing raises the strength faster than a
    normal allows, the normal is tilted as needed.

    Parameters
    ----------
    surface : TileLaw
        Such as a `Surface`.
    """
    pieces = []
    for piece in inner_half_planes(surface):
        a, y = piece.a_shear, piece.a_lateral
        pull = max(-piece.a_normal, surface.compression_gain * math.hypot(a, y))
        capacity = _support(surface, (a, pull, y))
        pieces.append(HalfPlane(piece.limit, a, -pull, y, capacity))
    return tuple(pieces)


def directional_strength(pieces: Sequence[HalfPlane], directions: Array) -> Array:
    """Return the largest load in each direction that half-planes allow.

    Parameters
    ----------
    pieces : sequence of HalfPlane
    directions : ndarray, shape (n, 3)
        Unit vectors of shear T, normal load N and lateral load Y.

    Returns
    -------
    ndarray, shape (n,)
        Largest load in each direction [N]; infinite where no half-plane bounds it.
    """
    found = np.full(len(directions), np.inf)
    for piece in pieces:
        slope = directions[:, 0] * piece.a_shear + directions[:, 1] * piece.a_normal
        slope += np.abs(directions[:, 2]) * piece.a_lateral
        with np.errstate(divide="ignore"):
            found = np.minimum(
                found, np.where(slope > 0.0, piece.capacity / np.maximum(slope, 0.0), np.inf)
            )
    return found


def bounds_gap(surface: TileLaw, directions: Array) -> BoundsGap:
    """Return the gap between inner half-planes, limit surface and outer half-planes.

    Parameters
    ----------
    surface : Surface
    directions : ndarray, shape (n, 3)
        Unit vectors (T, N, Y) with T ≥ 0 and N ≤ 0, evenly spread: volumes are sums over them.
    """
    angle = np.arctan2(-directions[:, 1], np.hypot(directions[:, 0], directions[:, 2]))
    azimuth = np.arctan2(np.abs(directions[:, 2]), directions[:, 0])
    exact = surface.strength(angle, azimuth)
    inner, outer = (
        directional_strength(p(surface), directions) for p in (inner_half_planes, outer_half_planes)
    )
    volume = float(np.sum(exact**3))
    return BoundsGap(
        inner_volume=float(np.sum(inner**3)) / volume,
        outer_volume=float(np.sum(outer**3)) / volume,
        inner_worst=float((inner / exact).min()),
        outer_worst=float((outer / exact).max()),
    )


def _nodes(surface: TileLaw) -> list[tuple[float, float]]:
    """Return the ends of the chords, (shear T, pull P) on the curve of Eq. 21 [N]."""
    angles = np.linspace(0.0, surface.pull_off_angle, int(surface.half_planes) + 1)
    radii = surface.strength(angles)
    nodes = [
        (float(r * np.cos(a)), float(r * np.sin(a))) for a, r in zip(angles, radii, strict=True)
    ]
    last = _chord(nodes[-2], nodes[-1])
    if surface.pull_off_angle < math.pi / 2 and last[2] > last[1] * surface.pull_off_limit:
        nodes.append((0.0, surface.pull_off_limit))
    return nodes


def _chord(start: tuple[float, float], end: tuple[float, float]) -> tuple[float, float, float]:
    """Return (a, b, c) of the line ``a T + b P = c`` through two points, with a² + b² = 1."""
    a = end[1] - start[1]
    b = start[0] - end[0]
    scale = math.hypot(a, b)
    a, b = a / scale, b / scale
    return a, b, a * start[0] + b * start[1]


def _inside(
    surface: TileLaw, chord: tuple[float, float, float], sector: tuple[float, float]
) -> tuple[float, float, float]:
    """Return a chord as it is if it is inside the curve over its sector, or moved inward."""
    a, b, c = chord

    def over(box: DirectionBoxes) -> Array:
        return c / (surface.straight_strength(box.steep) * box.line(a, b)[0])

    # angles at which a chord is held against the curve, before that is bounded
    ends = np.linspace(*sector, 2049)
    found = float(over(DirectionBoxes(ends, ends, 0.0 * ends, 0.0 * ends)).max())
    # for chords whose ends, on the curve, are what comes nearest
    near = 1.0 + BASE_TOLERANCES.rounding
    most = bounded(
        over,
        DirectionBoxes.over(sector, (0.0, 0.0)),
        near if found <= near else found * (1.0 + SEARCH_MARGIN),
    )
    return chord if most <= near else (a, b, c / most)


def _lateral_coefficient(
    surface: TileLaw, chord: tuple[float, float, float], sector: tuple[float, float]
) -> float:
    """Return the least a_Y that keeps a chord inside the surface over its sector.

    What it is to be at least, (c / F(d) − cos η (a cos ω + b sin ω)) / sin η, is written as

        (c / f_s − H) / sin η + H tan(η / 2) + c / f_s X / (1 − X) / sin η,

    with H = a cos ω + b sin ω and F = f_s (1 − X), and has no pole at η = 0: as the chord is inside
    the curve, c / f_s(φ) ≤ c / f_s(ω) ≤ H. For tiles that hold no more sideways than along the drag
    it is largest at the sector's ends: at a φ it is convex in tan(θ / 2), or rises with it.
    """
    a, b, c = chord

    def needed(box: DirectionBoxes) -> Array:
        least, most = box.line(a, b)
        strong, weak = (surface.straight_strength(angle) for angle in (box.flat, box.steep))
        loss = 1.0 - surface.sideways_share(box.steep)
        (low, high), sine = box.aside(), np.sin(box.far)
        # of X / sin η, the least where it is negative
        lost = np.where(loss > 0.0, loss * high / weak, loss * low / strong)
        lost = lost / (1.0 - loss * np.where(loss > 0.0, high * sine, low * np.sin(box.near)))
        found = np.minimum(c / weak - least, 0.0) / sine + c * lost
        return np.asarray(found + np.maximum(most, 0.0) * np.tan(0.5 * box.far))

    def at(angle: Array, azimuth: Array) -> Array:
        t, p, y = _direction(angle, azimuth)
        need = c / surface.strength(angle, azimuth) - (a * t + b * p)
        # closer to the finger plane than this share of a load the chord is inside anyway
        least = 1e-3
        return np.where(y > least, need / np.maximum(y, least), -np.inf)

    found, turns = _largest(at, surface.pull_off_angle, sector), (0.0, math.pi / 2)
    if surface.lateral_limit > surface.shear_limit:
        boxes = DirectionBoxes.over(sector, turns)
        # bounded in a whole sector, and so not as closely
        return bounded(needed, boxes, found * (1.0 + 2e-3))
    edges = [DirectionBoxes.over((end, end), turns) for end in sector if end > 0.0]
    boxes = DirectionBoxes(*np.concatenate(edges, axis=1))
    return bounded(needed, boxes, found * (1.0 + SEARCH_MARGIN))


def _support(surface: TileLaw, normal: tuple[float, float, float]) -> float:
    """Return the largest load along (a, b, a_Y) on the surface [N]."""

    def along(angle: Array, azimuth: Array) -> Array:
        t, p, y = _direction(angle, azimuth)
        a, b, sideways = normal
        return np.asarray(surface.strength(angle, azimuth) * (a * t + b * p + sideways * y))

    return _largest(along, surface.pull_off_angle, (0.0, math.pi / 2)) * (1.0 + SEARCH_MARGIN)


def _direction(angle: Array, azimuth: Array) -> tuple[Array, Array, Array]:
    """Return (t, p, y) of φ and θ."""
    return np.cos(angle) * np.cos(azimuth), np.sin(angle), np.cos(angle) * np.sin(azimuth)


def _largest(
    function: Callable[[Array, Array], Array], kink: float, sector: tuple[float, float]
) -> float:
    """Return the largest value of a function of φ and θ over a sector, on ever finer grids.

    The sector is in the angle ω of a direction seen from the side, tan φ = tan ω cos θ. Between the
    angles where the function or the sector's edge has a kink it is smooth.
    """
    kinks = sorted({0.0, min(kink, sector[1]), *sector})
    return max(_largest_between(function, pair, sector) for pair in itertools.pairwise(kinks))


def _largest_between(
    function: Callable[[Array, Array], Array],
    angles: tuple[float, float],
    sector: tuple[float, float],
) -> float:
    bounds = (angles, (0.0, 1.0))
    ranges = list(bounds)
    best, counts = -math.inf, (129, 33)  # samples of φ and of θ, at first
    for _ in range(8):
        axes = [np.linspace(*ends, n) for ends, n in zip(ranges, counts, strict=True)]
        angle = axes[0][:, None]
        first, last = (_azimuth(angle, side) for side in sector)
        values = function(angle, first + (last - first) * axes[1][None, :])
        place = np.unravel_index(int(values.argmax()), values.shape)
        best, counts = max(best, float(values[place])), (17, 17)
        for k, axis in enumerate(axes):
            step = 2.0 * (axis[1] - axis[0])  # so many samples to either side of the best
            low, high = bounds[k]
            ranges[k] = (max(low, axis[place[k]] - step), min(high, axis[place[k]] + step))
    return best


def _azimuth(angle: Array, side: float) -> Array:
    """Return the θ at which a direction at φ is seen from the side at ω; 0 where φ ≥ ω."""
    if side <= 0.0:
        return np.zeros_like(angle)
    return np.asarray(np.arccos(np.minimum(np.tan(angle) / math.tan(side), 1.0)))
