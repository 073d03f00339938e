"""Smooth a cut through scanned or drawn rock to the scale of a finger's tile.

A tile of length w bridges whatever is smaller than itself: it rests on the highest points under it.
So a raw polyline is

1. sampled at equal steps of its length, from its first point,
2. fitted with a parabola over every stretch of length w, and once more over w/2, so that no kink
   of the first fit is left (Savitzky–Golay). That leaves circles as they are: their radius R
   changes by 0.0038 (w/2)⁴/R³, 3 µm at R = 30 mm,
3. raised along its normal by the largest height, within w/2, of the raw points above it. That
   height is itself smoothed over w/2 on both sides, so that no raw point stands out any more.

What is sharper than a tile, such as the corner of an edge, becomes a rounding of about its length,
at most a few millimetres off the rock.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
import scipy
from numpy.typing import ArrayLike

from hand_models.base import BASE_TOLERANCES, Array, Indices, InvalidInputError
from hand_models.parameters import ParameterTable, hand_table, scan_table
from hand_models.rock.envelopes import Heights, alike, envelope_outlines
from hand_models.rock.holds import Hold
from hand_models.sections import NO_STRIPS, FingerRock, PolylineSection, RockStrips, Section

__all__ = ["OutlinedHold", "Scale", "smooth"]


@dataclass(frozen=True)
class Scale:
    """Lengths that say how rock in a finger's plane is smoothed and trimmed for a hand [m].

    Attributes
    ----------
    tile : float
        w, a tile's length.
    spacing : float
        Distance of neighbouring points of a smoothed curve.
    bridged_gap : float
        Open ends no farther apart than this are joined; shorter pieces are dropped.
    reach : float
        Half the side of the square about a finger's base outside which rock is left out.
    longest : float
        Length of the rock's outline within that square above which the rock is refused.
    tile_width, frame_width : float
        Widths of a finger's tiles and of its phalanges' frames.
    strip : float
        Largest width of the strips in which rock is cut across them.
    """

    tile: float
    spacing: float
    bridged_gap: float
    reach: float
    longest: float
    tile_width: float
    frame_width: float
    strip: float

    @classmethod
    def of(cls, hand: ParameterTable | None = None) -> Scale:
        """Return the lengths of smoothing for the hand that is to grip a hold.

        The reach is that of ``scan.toml`` or, if larger, of the hand's finger, nail and half its
        palm; ``longest`` grows in proportion.

        Parameters
        ----------
        hand : ParameterTable, optional
            All parameters of the hand; the bundled ones by default.
        """
        hand, table = hand or hand_table(), scan_table()
        usual = table.scalar("cut", "reach")
        reach = max(
            usual,
            len(hand.vector("finger", "pulley_radii")) * hand.scalar("finger", "joint_spacing")
            + hand.scalar("finger", "tile_height")
            + hand.scalar("nail", "length")
            + 0.5 * hand.scalar("palm", "length"),
        )
        return cls(
            tile=hand.scalar("finger", "tile_length"),
            spacing=table.scalar("cut", "spacing"),
            bridged_gap=table.scalar("cut", "bridged_gap"),
            reach=reach,
            longest=table.scalar("cut", "longest") * (reach / usual),
            tile_width=hand.scalar("finger", "tile_width"),
            frame_width=hand.scalar("finger", "frame_width"),
            strip=table.scalar("cut", "strip"),
        )

    @property
    def strips(self) -> tuple[Array, slice]:
        """Return the middles of strips across a finger [m], and which are under its tiles.

        An odd number is under the tiles, so that one is in the finger's plane; as many on either
        side as it takes are under the frame beside them.
        """
        half = math.ceil(0.5 * self.tile_width / self.strip - 0.5)
        beside = math.ceil(0.5 * (self.frame_width - self.tile_width) / self.strip)
        under = self.tile_width / (2 * half + 1) * np.arange(-half, half + 1)
        width = 0.5 * (self.frame_width - self.tile_width) / max(beside, 1)
        outer = 0.5 * self.tile_width + width * (np.arange(beside) + 0.5)
        return np.concatenate([-outer[::-1], under, outer]), slice(beside, beside + 2 * half + 1)


def smooth(points: Array, scale: Scale) -> Array | None:
    """Smooth a polyline to a tile's scale, and raise it over its raw points.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        Raw polyline with the rock on its left; closed if it ends where it begins [m].
    scale : Scale

    Returns
    -------
    ndarray, shape (m, 2), or None
        Smoothed polyline [m]; None if the raw one is a single point or shorter than a bridged gap.
    """
    points = _distinct(points)
    if len(points) < 2:
        # a cut that only touches the rock
        return None
    points = _corners(points)
    lengths = np.hypot(*np.diff(points, axis=0).T)
    total = float(lengths.sum())
    if total < scale.bridged_gap:
        return None
    closed = np.array_equal(points[0], points[-1])
    place = np.concatenate([[0.0], np.cumsum(lengths)])
    # steps from its beginning, whatever its length, as that changes with every move of the plane
    step = min(scale.spacing, total / 4)  # of five points at least
    rounding = BASE_TOLERANCES.relative
    count = round(total / step) if closed else math.floor(total / step + rounding) + 1
    half = min(round(0.5 * scale.tile / step), (count - 1) // 2)
    over = 2 * half if closed else 0
    at = step * np.arange(-over, count + over)
    if closed:
        at %= total
    raw = np.column_stack([np.interp(at, place, points[:, i]) for i in range(2)])
    curve = raw
    for part in (half, half // 2):
        curve = _fitted(curve, part)
    raw, curve = raw[over : over + count], curve[over : over + count]
    rest = total / step - (count - 1)
    if not closed and rest > rounding:
        curve = np.vstack([curve, curve[-1] + rest * (curve[-1] - curve[-2])])
    curve = _raised(curve, np.vstack([raw, points]), half, closed)
    return np.vstack([curve, curve[:1]]) if closed else curve


def _fitted(curve: Array, part: int) -> Array:
    """Return the middles of parabolas over ``part`` points on both sides of each; at ends, theirs.

    This is `scipy.signal.savgol_filter`, which works its weights out anew each time.
    """
    weights = _weights(part)
    fitted = scipy.ndimage.correlate1d(curve, weights[part], axis=0, mode="nearest")
    if part:
        fitted[:part] = weights[:part] @ curve[: 2 * part + 1]
        fitted[-part:] = weights[part + 1 :] @ curve[-2 * part - 1 :]
    return np.asarray(fitted)


@lru_cache(maxsize=64)
def _weights(part: int) -> Array:
    """Return the weights of 2 part + 1 points with which a parabola is fitted at each of them."""
    length = 2 * part + 1
    return np.array(
        [
            scipy.signal.savgol_coeffs(length, min(2, 2 * part), pos=i, use="dot")
            for i in range(length)
        ]
    )


def _raised(curve: Array, raw: Array, half: int, closed: bool) -> Array:
    """Move a curve outward, smoothly, until no raw point stands out of it."""
    mode: Literal["wrap", "nearest"] = "wrap" if closed else "nearest"
    for _ in range(4):  # each time far less is left
        outward = _outward(curve, closed)
        nearest: Indices = np.asarray(scipy.spatial.cKDTree(curve).query(raw)[1], dtype=np.intp)
        excess = np.zeros(len(curve))
        out = np.einsum("ij,ij->i", raw - curve[nearest], outward[nearest])
        np.maximum.at(excess, nearest, out)
        if excess.max() <= 1e-5:  # [m]
            break
        rise = scipy.ndimage.maximum_filter1d(excess, 2 * half + 1, mode=mode)
        # two moving means whose widths add up to that of the maximum leave no point below it
        for size in (2 * (half // 2) + 1, 2 * (half - half // 2) + 1):
            rise = scipy.ndimage.uniform_filter1d(rise, size, mode=mode)
        curve = curve + rise[:, None] * outward
    return curve


def _outward(curve: Array, closed: bool) -> Array:
    """Return unit normals on the right of a curve, shape (n, 2)."""
    if closed:
        step = np.roll(curve, -1, axis=0) - np.roll(curve, 1, axis=0)
    else:
        step = np.gradient(curve, axis=0)
    length = np.maximum(np.hypot(step[:, 0], step[:, 1]), np.finfo(float).tiny)
    return np.column_stack([step[:, 1], -step[:, 0]]) / length[:, None]


def _distinct(points: Array) -> Array:
    """Return a polyline without points that are as the one before."""
    return np.asarray(points[np.append(True, (np.diff(points, axis=0) != 0.0).any(axis=1))])


def _corners(points: Array) -> Array:
    """Return a polyline without points at which it goes straight on, in however many parts."""
    steps = np.diff(points, axis=0)
    steps = steps / np.hypot(*steps.T)[:, None]
    turns = np.abs(steps[:-1, 0] * steps[1:, 1] - steps[:-1, 1] * steps[1:, 0])
    onward = np.einsum("ni,ni->n", steps[:-1], steps[1:]) > 0.0
    bends = (turns > 1e-7) | ~onward  # sine of no turn
    return np.asarray(points[np.concatenate([[True], bends, [True]])])


def _reached(pieces: Sequence[Array], scale: Scale) -> list[Array]:
    """Return the parts of polylines within the square |s|, |t| ≤ reach."""
    runs = [run for piece in pieces for run in _runs(piece, scale.reach)]
    length = sum(float(np.hypot(*np.diff(run, axis=0).T).sum()) for run in runs)
    if length > scale.longest:
        raise InvalidInputError(
            f"its outline is {length:.3g} m long within {scale.reach:g} m of a finger's base; the "
            f"maximum is {scale.longest:g} m: remove noise and spikes",
            field="hold",
        )
    return runs


def _runs(piece: Array, reach: float) -> list[Array]:
    """Cut a polyline into the parts within the square |s|, |t| ≤ reach."""
    outside = np.flatnonzero((np.abs(piece) > reach).any(axis=1))
    if not len(outside):
        return [piece]
    if np.array_equal(piece[0], piece[-1]):
        # begin where nothing is cut apart that belongs together
        piece = np.roll(piece[:-1], -outside[0], axis=0)
        piece = np.vstack([piece, piece[:1]])
    start, step = piece[:-1], np.diff(piece, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        to_low, to_high = (-reach - start) / step, (reach - start) / step
    still, between = step == 0.0, np.abs(start) <= reach
    first = np.where(still, np.where(between, -np.inf, np.inf), np.minimum(to_low, to_high))
    last = np.where(still, np.where(between, np.inf, -np.inf), np.maximum(to_low, to_high))
    begin = np.maximum(first.max(axis=1), 0.0)
    end = np.minimum(last.min(axis=1), 1.0)
    breaks = np.flatnonzero((begin[1:] > 0.0) | (end[:-1] < 1.0)) + 1
    runs: list[Array] = []
    for run in np.split(np.arange(len(step)), breaks):
        kept = run[begin[run] < end[run]]
        if len(kept):
            i, j = kept[0], kept[-1]
            ends = start[i] + begin[i] * step[i], start[j] + end[j] * step[j]
            runs.append(np.vstack([ends[0], piece[kept[1:]], ends[1]]))
    return runs


def _strips(
    heights: Heights, section: PolylineSection | None, offsets: Array, tiles: slice
) -> RockStrips:
    """Return how far the rock of each strip under a finger's tiles lies behind their envelope."""
    if section is None:
        return NO_STRIPS
    curves, own = section.pieces, heights.t[tiles]
    least = own.min(axis=0)
    depths = np.where(np.isfinite(own), own - np.where(np.isfinite(least), least, 0.0), np.inf)
    places = np.concatenate(curves)
    normals = [_outward(curve, np.array_equal(curve[0], curve[-1])) for curve in curves]
    upright = np.maximum(-np.concatenate(normals)[:, 1], BASE_TOLERANCES.angle)
    at = np.searchsorted(heights.s, places[:, 0]).clip(0, len(heights.s) - 1)
    # what is hidden under an overhang is known in the finger's plane only, and taken as alike
    seen = places[:, 1] < least[at] + 1e-3
    behind = np.where(seen, depths[:, at] * upright, 0.0)
    return RockStrips(offsets[tiles], places[:, 0] + 1j * places[:, 1], behind.T)


class OutlinedHold(Hold):
    """A hold whose cut in each plane is a set of polylines: smoothed for fingers, raw for nails.

    Parameters
    ----------
    hand : ParameterTable, optional
        All parameters of the hand that is to grip the hold, the bundled ones by default: the length
        of its tiles is the scale to which the rock is smoothed for its fingers.
    """

    scanned = True

    def __init__(self, hand: ParameterTable | None = None) -> None:
        self._scale = Scale.of(hand)

    def finger_rock(self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike) -> FingerRock:
        """Cut the hold with planes across a finger, and smooth their envelope to a tile's scale.

        Returns
        -------
        FingerRock
            Only rock within a finger's reach of the plane's origin.

        Raises
        ------
        InvalidInputError
            If an outline is too long to be a surface of rock; the field is ``hold``.
        """
        scale = self._scale
        offsets, tiles = scale.strips
        strips = [
            [_corners(run) for run in map(_distinct, _reached(cut, scale)) if len(run) > 1]
            for cut in self._cuts(origin, s_axis, t_axis, offsets)
        ]
        middle = strips[len(strips) // 2]
        if alike(strips) or not any(strips):
            return FingerRock(self._smooth(middle))
        heights = Heights.of(strips, scale.spacing)
        peaks = self._peaks(origin, s_axis, t_axis, 0.5 * scale.frame_width)
        under = peaks[np.abs(peaks[:, 2]) <= 0.5 * scale.tile_width, :2]
        tile = self._smooth(envelope_outlines(heights, middle, under, scale.bridged_gap, tiles))
        frame = self._smooth(envelope_outlines(heights, middle, peaks[:, :2], scale.bridged_gap))
        return FingerRock(tile, frame, _strips(heights, tile, offsets, tiles))

    def _peaks(self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike, half: float) -> Array:
        """Return corners (s, t, y) of rock up to ``half`` beside a finger's plane, (n, 3) [m]."""
        return np.zeros((0, 3))

    def _smooth(self, runs: Sequence[Array]) -> PolylineSection | None:
        curves = [smooth(run, self._scale) for run in runs]
        reached = [curve for curve in curves if curve is not None]
        return PolylineSection(reached) if reached else None

    def _cuts(
        self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike, offsets: Array
    ) -> list[list[Array]]:
        """Return the raw outlines in planes moved by ``offsets`` along t × s [m]."""
        across = np.cross(np.asarray(t_axis), np.asarray(s_axis))
        return [
            self._pieces(np.asarray(origin) + y * across, s_axis, t_axis) for y in offsets.tolist()
        ]

    @abstractmethod
    def _pieces(self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike) -> list[Array]:
        """Return the raw outlines in a plane, rock on their left; arguments as of `section`."""

    def section(self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike) -> Section | None:
        """Cut the hold with a finger's plane, and smooth the cut to the scale of a tile.

        Returns
        -------
        Section or None
            Only rock within a finger's reach of the plane's origin; None if there is none.

        Raises
        ------
        InvalidInputError
            If the outline is too long to be a surface of rock; the field is ``hold``.
        """
        return self._smooth(_reached(self._pieces(origin, s_axis, t_axis), self._scale))

    def raw_section(
        self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike
    ) -> Section | None:
        """Cut the hold with a finger's plane without smoothing, for a nail.

        Returns
        -------
        Section or None
            Only rock within a finger's reach, without pieces shorter than ``Scale.bridged_gap``;
            None if there is none.

        Raises
        ------
        InvalidInputError
            If the outline is too long to be a surface of rock; the field is ``hold``.
        """
        runs = map(_distinct, _reached(self._pieces(origin, s_axis, t_axis), self._scale))
        least = self._scale.bridged_gap
        reached = [run for run in runs if np.hypot(*np.diff(run, axis=0).T).sum() >= least]
        return PolylineSection(reached, faceted=True) if reached else None
