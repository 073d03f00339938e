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
from importlib import import_module
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import BASE_TOLERANCES, Array, Indices, InvalidInputError
from hand_models.parameters import ParameterTable, hand_table, scan_table
from hand_models.rock.holds import Hold
from hand_models.rock.surface import Triangles
from hand_models.rock.triangles import unstrung
from hand_models.sections import (
    NO_STRIPS,
    FingerRock,
    FingerSize,
    PolylineSection,
    RockStrips,
    Section,
    strung,
)

__all__ = ["Heights", "OutlinedHold", "Scale", "load_compiled", "smooth"]


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
    height_spacing : float
        Distance of places along a finger at which heights of rock are taken.
    """

    tile: float
    spacing: float
    bridged_gap: float
    reach: float
    longest: float
    height_spacing: float

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
            height_spacing=table.scalar("cut", "height_spacing"),
        )

    @property
    def places(self) -> Array:
        """Places s along a finger at which heights of rock are taken, (g,), ascending [m]."""
        count = math.ceil(self.reach / self.height_spacing)
        return np.asarray(self.reach / count * np.arange(-count, count + 1))


def load_compiled() -> None:
    """Import what numba compiles of scanned and drawn rock, so that no cut waits for it.

    The first process of a machine compiles, in some 20 s; others load in 0.5 s.
    """
    for part in ("cells", "cuts", "heights", "outlines", "smoothing"):
        import_module(f"hand_models.rock.compiled_{part}")
    for part in ("polylines", "contacts"):
        import_module(f"hand_models.sections.compiled_{part}")


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
    from hand_models.rock.compiled_smoothing import corners, smoothed

    points, lengths = corners(np.ascontiguousarray(points))
    total = float(lengths[-1])
    # a cut that only touches the rock has no length
    if total < scale.bridged_gap:
        return None
    closed = bool((points[0] == points[-1]).all())
    # steps from its beginning, whatever its length, as that changes with every move of the plane
    step = min(scale.spacing, total / 4)  # of five points at least
    rounding = BASE_TOLERANCES.relative
    count = round(total / step) if closed else math.floor(total / step + rounding) + 1
    half = min(round(0.5 * scale.tile / step), (count - 1) // 2)
    rest = total / step - (count - 1)
    rest = rest if not closed and rest > rounding else 0.0
    wide, narrow = _weights(half), _weights(half // 2)
    return smoothed(points, lengths, step, count, rest, closed, wide, narrow)


def _weights(part: int) -> Array:
    """Return the weights of 2 part + 1 points with which a parabola is fitted at each of them."""
    # as `scipy.signal.savgol_coeffs` has them: projections on 1, x and x², made orthogonal
    x = np.arange(-part, part + 1.0)
    bases = np.stack([np.ones_like(x), x, x * x - part * (part + 1.0) / 3.0])[: 2 * part + 1]
    return np.asarray((bases.T / (bases * bases).sum(axis=1)) @ bases)


def _reached(pieces: Sequence[Array], scale: Scale) -> list[Array]:
    """Return the parts of polylines within the square |s|, |t| ≤ reach."""
    from hand_models.rock.compiled_cuts import reached

    if not pieces:
        return []
    points, ends, length = reached(*strung(pieces), scale.reach)
    if length > scale.longest:
        raise InvalidInputError(
            f"its outline is {length:.3g} m long within {scale.reach:g} m of a finger's base; the "
            f"maximum is {scale.longest:g} m: remove noise and spikes",
            field="hold",
        )
    return unstrung(points, ends)


def _from_least(piece: Array) -> Array:
    """Return an outline; a ring from where s is least on, to be seen as if it began there."""
    if (piece[0] != piece[-1]).any():
        return piece
    ring = piece[:-1]
    # of equal ones the highest, which hides no other
    first = np.lexsort(ring.T[::-1])[0]
    return np.concatenate([ring[first:], piece[: first + 1]])


def _no_outlines() -> tuple[Array, Indices, float]:
    """Return the result of `seen_outlines` where there is no rock in the plane."""
    return np.zeros((0, 2)), np.zeros(0, dtype=np.intp), 0.0


class Heights(NamedTuple):
    """Heights t at which rock begins at g places s along a finger (`Scale.places`).

    Attributes
    ----------
    tile, frame : ndarray, shape (g,)
        Least t anywhere across the finger's tiles, and across its frames [m].
    lines : ndarray, shape (k, g)
        t in the middle of each strip across the tiles [m].
    tile_ends, frame_ends : ndarray, shape (2, g, 2)
        Ends (s, t) of the rock before and after each place, across the tiles and across the
        frames, from `rock_ends`; NaN where the rock does not end there [m].
    line_ends : ndarray, shape (k, 2, g, 2)
        The same for each strip's middle.
    """

    tile: Array
    frame: Array
    lines: Array
    tile_ends: Array
    frame_ends: Array
    line_ends: Array


def _strips(
    scale: Scale, strips: Array, heights: Heights, section: PolylineSection | None, share: float
) -> RockStrips:
    """Return how far the rock of each strip under a finger's tiles lies behind their envelope."""
    from hand_models.rock.compiled_heights import depths_behind, line_depths

    if section is None:
        return NO_STRIPS
    if np.isfinite(heights.lines).all():
        depths = np.maximum(heights.lines - heights.tile, 0.0)
    else:
        depths = line_depths(heights.lines, heights.tile, scale.places, heights.line_ends)
    points, _ = strung(section.pieces)
    places = points.view(complex)[:, 0]
    behind = depths_behind(points, scale.places, depths)
    if share < 1.0:
        behind = share * np.minimum(behind, scale.reach)
    return RockStrips(strips, places, np.full_like(places, 1j), behind)


def _width_share(hidden: float, scale: Scale) -> float:
    """Return the share of rock beside a plane that counts: 1 where overhangs hide a bridged gap."""
    return min(max(2.0 - hidden / scale.bridged_gap, 0.0), 1.0)


class OutlinedHold(Hold):
    """A hold whose cut in each plane is a set of polylines: smoothed for fingers, raw for nails.

    Parameters
    ----------
    hand : ParameterTable, optional
        All parameters of the hand that is to grip the hold, the bundled ones by default: the length
        of its tiles is the scale to which the rock is smoothed for its fingers.
    """

    def __init__(self, hand: ParameterTable | None = None) -> None:
        load_compiled()
        self._scale = Scale.of(hand)

    def finger_rock(
        self,
        origin: ArrayLike,
        s_axis: ArrayLike,
        t_axis: ArrayLike,
        size: FingerSize,
        *,
        tiles_only: bool = False,
    ) -> FingerRock:
        """Return the envelope of the rock across a finger's width, in the finger's plane, smoothed.

        The envelope is the least t of the rock across the tiles, and across the phalanges' frames.
        Where the finger may reach under an overhang in its plane by more than a bridged gap, the
        rock beside the plane counts less, and overhangs are open deeper; from twice that on, only
        the cut in the plane is used. Arguments are those of `Hold.finger_rock`.

        Returns
        -------
        FingerRock
            Rock within a finger's reach of the plane's origin.

        Raises
        ------
        InvalidInputError
            If an outline is too long to be a surface of rock; the field is ``hold``.
        """
        from hand_models.rock import compiled_outlines as compiled
        from hand_models.rock.compiled_smoothing import without_repeats

        scale, slack = self._scale, BASE_TOLERANCES.length
        middle = _reached(self._pieces(origin, s_axis, t_axis), scale)
        # of repeated points none would be a lip
        outlines = [_from_least(without_repeats(piece)) for piece in middle]
        points, stops, hidden = _no_outlines()
        if outlines:
            points, stops, hidden = compiled.seen_outlines(*strung(outlines), size.reach)
        plane, share = np.array([origin, s_axis, t_axis], dtype=float), _width_share(hidden, scale)
        # what is beside several outlines with overhangs belongs to none of them
        several = hidden > scale.bridged_gap and len(outlines) > 1
        seen = size._replace(strip=math.inf) if tiles_only else size  # no strips are asked for
        heights = self._heights(plane, seen) if share > 0.0 and not several else None
        if heights is None:
            return FingerRock(self._smooth(middle))
        s, gap = scale.places, scale.bridged_gap
        own = compiled.least_heights(points, stops, s)
        tile, frame = (np.minimum(each, own) for each in (heights.tile, heights.frame))
        heights = heights._replace(tile=tile, frame=frame)
        # and where the plane has no rock, that beside it has nothing to be moved to
        alone = np.hypot(s, heights.frame)[np.isinf(own)] < size.reach
        if share < 1.0 and alone.any():
            return FingerRock(self._smooth(middle))

        def envelope(least: Array, ends: Array) -> PolylineSection | None:
            if share < 1.0:
                opened = compiled.opened_overhangs(outlines[0], gap * (1.0 / share - 1.0))
                line = compiled.widened_outline(opened, s, own, least, share, slack)
                return self._smooth([line])
            corners = compiled.seen_corners(points, stops, slack)
            runs = compiled.raised_outlines(corners, s, own, least, ends, gap, slack)
            return self._smooth(unstrung(*runs))

        under = envelope(heights.tile, heights.tile_ends)
        if tiles_only:
            return FingerRock(under)
        beside = envelope(heights.frame, heights.frame_ends)
        return FingerRock(under, beside, _strips(scale, size.strips, heights, under, share))

    def _smooth(self, runs: Sequence[Array]) -> PolylineSection | None:
        curves = [smooth(run, self._scale) for run in runs]
        reached = [curve for curve in curves if curve is not None]
        return PolylineSection(reached) if reached else None

    @abstractmethod
    def _heights(self, plane: Array, size: FingerSize) -> Heights | None:
        """Return heights of rock across a finger; None if the rock is alike across it.

        ``plane``: origin [m] and axes s and t of the finger's plane, shape (3, 3).
        """

    def _heights_of(
        self, triangles: Triangles, some: Indices, plane: Array, size: FingerSize
    ) -> Heights:
        """Return heights of some triangles across a finger."""
        from hand_models.rock.compiled_heights import facing_triangles, heights_across, rock_ends

        scale, s = self._scale, self._scale.places
        halves, strips = 0.5 * np.array([size.tile_width, size.frame_width]), size.strips
        seen = facing_triangles(*triangles, some, plane, float(halves.max()), scale.reach)
        least = heights_across(seen, s, halves, strips, BASE_TOLERANCES.length)
        ends = np.broadcast_to(np.full((2, len(s), 2), np.nan), (len(least), 2, len(s), 2))
        if not np.isfinite(least).all():
            slabs = np.concatenate([np.outer(halves, [-1.0, 1.0]), strips[:, None].repeat(2, 1)])
            ends = rock_ends(seen, s, slabs, least, scale.bridged_gap)
        return Heights(least[0], least[1], least[2:], ends[0], ends[1], ends[2:])

    @abstractmethod
    def _pieces(self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike) -> list[Array]:
        """Return the raw outlines in a plane, rock on their left; arguments as of `section`."""

    def section(self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike) -> Section | None:
        """Cut the hold with a finger's plane, and smooth the cut to the scale of a tile.

        Arguments are those of `Hold.section`.

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

        Arguments are those of `Hold.section`.

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
        from hand_models.rock.compiled_smoothing import without_repeats

        runs = map(without_repeats, _reached(self._pieces(origin, s_axis, t_axis), self._scale))
        least = self._scale.bridged_gap
        reached = [run for run in runs if np.hypot(*np.diff(run, axis=0).T).sum() >= least]
        return PolylineSection(reached, faceted=True) if reached else None
