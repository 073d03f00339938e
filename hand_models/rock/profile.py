"""A hold drawn as outlines: one for all fingers, or one for the strip of rock under each finger.

An outline is a polyline of points (x, z) in the hold's frame, z into the rock, and is extruded
along y. With one outline for each finger the rock has four strips: an inner finger's from y = 0 to
half-way between the planes of an inner and an outer finger, and an outer finger's beyond (left is
+y, as in H). A finger is on the strip over which its base is. A drawn outline is raw rock: like the
cut through a mesh it is smoothed to the scale of a tile (`hand_models.rock.smoothing`), but not
under fingers that hook with their nails.
"""

from __future__ import annotations

import math
import reprlib
from collections.abc import Mapping
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import BASE_TOLERANCES, Array, InvalidInputError
from hand_models.parameters import ParameterTable, hand_table, scan_table
from hand_models.rock.smoothing import Heights, OutlinedHold, Scale
from hand_models.rock.surface import Triangles, drawn_out
from hand_models.sections import SECTION_SETTINGS, FingerSize

__all__ = ["STRIP_NAMES", "Profile"]

STRIP_NAMES: Final = ("outer_left", "inner_left", "inner_right", "outer_right")
"""Names of the four strips from +y to −y, after the fingers over them."""


class Profile(OutlinedHold):
    """A hold given as outlines that are extruded along y.

    Parameters
    ----------
    points : array_like, shape (n, 2), or mapping of str to array_like
        The outline (x, z) of all rock, or one for each of `STRIP_NAMES`. Rock is on the side of
        larger z: on the left going from the end with smaller x to that with larger x [m].
    hand : ParameterTable, optional
        All parameters of the hand that is to grip the hold, the bundled ones by default, for the
        scale of smoothing; the strips lie under its fingers.

    Raises
    ------
    InvalidInputError
        If a strip is missing, or an outline has fewer than two points, numbers that are not finite,
        crosses itself, winds or begins and ends at the same x; the field is ``points`` or
        ``profiles``.
    """

    shape = "profile"

    def __init__(
        self,
        points: ArrayLike | Mapping[str, ArrayLike],
        hand: ParameterTable | None = None,
    ) -> None:
        super().__init__(hand)
        largest = scan_table().scalar("scan", "largest_outline")
        if isinstance(points, Mapping):
            if set(points) != set(STRIP_NAMES):
                raise InvalidInputError(
                    f"one outline for each of {', '.join(STRIP_NAMES)} is needed, "
                    f"got {', '.join(map(str, points)) or 'none'}",
                    field="profiles",
                )
            self.outlines = tuple(
                _checked(points[name], f"profiles.{name}", largest) for name in STRIP_NAMES
            )
        else:
            self.outlines = (_checked(points, "points", largest),)
        hand = hand or hand_table()
        inner = hand.vector("fingers", "inner_joint")[1]
        self._half_way = 0.5 * (inner + hand.vector("fingers", "outer_axis")[1])

    def surface(self, low: Array, high: Array) -> Triangles:
        """Return the outlines as triangles, extruded along y over their strips within a region."""
        from trimesh.util import append_faces

        ends = float(low[1]), float(high[1])
        if len(self.outlines) == 1:
            return drawn_out(self.outlines[0], *ends)
        bounds = np.clip([math.inf, self._half_way, 0.0, -self._half_way, -math.inf], *ends)
        strips = [
            drawn_out(outline, bottom, top)
            for outline, (top, bottom) in zip(self.outlines, pairwise(bounds.tolist()), strict=True)
        ]
        vertices, faces = append_faces(*zip(*strips, strict=True))
        return Triangles(np.asarray(vertices, dtype=float), np.asarray(faces, dtype=np.intp))

    def _outline(self, y: float) -> Array:
        """Return the outline of the strip at y."""
        if len(self.outlines) == 1:
            return self.outlines[0]
        return self.outlines[
            int(np.searchsorted([-self._half_way, 0.0, self._half_way], -y, side="right"))
        ]

    def _pieces(self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike) -> list[Array]:
        """Return the outline in a plane, rock on its left."""
        o, s, t = (np.asarray(v, dtype=float) for v in (origin, s_axis, t_axis))
        M = np.array([[s[0], t[0]], [s[2], t[2]]])
        outline = self._outline(float(o[1]))
        determinant = float(np.linalg.det(M))
        if abs(determinant) < SECTION_SETTINGS.parallel_sine:
            return self._along_axis(o, s, t)
        pieces = np.linalg.solve(M, (outline - o[[0, 2]]).T).T
        return [pieces if determinant > 0.0 else pieces[::-1]]

    def _heights(self, plane: Array, size: FingerSize) -> Heights | None:
        """Return heights of the outline under the finger, extruded as far as it reaches."""
        o, s, t = plane
        across = np.cross(t, s)
        if np.hypot(*across[[0, 2]]) < BASE_TOLERANCES.relative:
            return None
        end = 2.0 * self._scale.reach + size.frame_width
        drawn = drawn_out(self._outline(float(o[1])), o[1] - end, o[1] + end)
        return self._heights_of(drawn, np.arange(len(drawn.faces)), plane, size)

    def _along_axis(self, o: Array, s: Array, t: Array) -> list[Array]:
        """Return the straight rock in a plane that holds the direction of drawing."""
        depth = self.entry(o, t)
        if not math.isfinite(depth):
            return []
        # the direction of drawing, in the plane, through the place where the rock begins
        along = np.array([s[1], t[1]]) / math.hypot(s[1], t[1])
        along = along if along[0] >= 0.0 else -along
        return [np.outer([-2.0, 2.0], along * self._scale.reach) + np.array([0.0, depth])]

    def entry(self, point: ArrayLike, direction: ArrayLike) -> float:
        p, d = np.asarray(point, dtype=float), np.asarray(direction, dtype=float)
        outline = self._outline(float(p[1]))
        ray = d[[0, 2]]
        if math.hypot(*ray) < SECTION_SETTINGS.parallel_sine:
            return math.inf
        start, step = outline[:-1] - p[[0, 2]], np.diff(outline, axis=0)
        # start + u step = λ ray
        across = step[:, 0] * ray[1] - step[:, 1] * ray[0]
        met = across != 0.0
        start, step, across = start[met], step[met], across[met]
        part = (start[:, 1] * ray[0] - start[:, 0] * ray[1]) / across
        where = (step[:, 0] * start[:, 1] - step[:, 1] * start[:, 0]) / across
        on = (part >= 0.0) & (part <= 1.0)
        where, entering = where[on], across[on] > 0.0
        behind = where <= 0.0
        if behind.any():
            last = int(np.where(behind, where, -np.inf).argmax())
            if entering[last]:
                return float(where[last])
        return float(where[entering & ~behind].min(initial=math.inf))


def _checked(points: ArrayLike, field: str, largest: float) -> Array:
    try:
        outline = np.asarray(points, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInputError(
            f"points must be two numbers each, [x, z], got {reprlib.repr(points)}", field=field
        ) from None
    most = 5000
    if outline.ndim != 2 or outline.shape[1:] != (2,) or not 2 <= len(outline) <= most:
        flat = outline.ndim == 2 and outline.shape[1] == 2
        got = len(outline) if flat else f"an array of shape {outline.shape}"
        raise InvalidInputError(f"2 to {most} points [x, z] are needed, got {got}", field=field)
    bad = np.flatnonzero(~(np.abs(outline) <= largest).all(axis=1))
    if len(bad):
        raise InvalidInputError(
            f"both coordinates must be finite and within ±{largest:g} m, got "
            f"{outline[bad[0]].tolist()}",
            field=f"{field}[{bad[0]}]",
        )
    if outline[0, 0] == outline[-1, 0]:
        raise InvalidInputError(
            f"must end at another x than it begins at, got {outline[0, 0]:g} m for both",
            field=field,
        )
    if outline[0, 0] > outline[-1, 0]:
        outline = outline[::-1]
    outline = outline[np.append(True, (np.diff(outline, axis=0) != 0.0).any(axis=1))]
    length = float(np.hypot(*np.diff(outline, axis=0).T).sum())
    across, scale = float(np.ptp(outline, axis=0).max()), Scale.of()
    if length * 2.0 * scale.reach > scale.longest * across:
        raise InvalidInputError(
            f"is {length:.3g} m long and {across:.3g} m across; the maximum is "
            f"{0.5 * scale.longest / scale.reach:g} times as long as across: remove noise and "
            "spikes",
            field=field,
        )
    crossing = _crossing(outline)
    if crossing is not None:
        raise InvalidInputError(
            f"crosses itself near x = {outline[crossing, 0]:g} m, z = {outline[crossing, 1]:g} m; "
            "remove or reorder points there",
            field=field,
        )
    return np.asarray(outline)


def _crossing(outline: Array) -> int | None:
    """Return a segment that meets another, not its neighbour, or turns back; None if none does."""
    start, end = outline[:-1], outline[1:]
    step = end - start
    low, high = np.minimum(start, end), np.maximum(start, end)
    back = (_turn(step[:-1], step[1:]) == 0.0) & ((step[:-1] * step[1:]).sum(axis=1) < 0.0)
    if back.any():
        return int(back.argmax())
    # of segments in order of their least x, those that follow up to its greatest may meet one
    order = np.argsort(low[:, 0], kind="stable")
    following = np.searchsorted(low[order, 0], high[order, 0], side="right")
    for place in np.flatnonzero(following - np.arange(len(order)) > 1):
        i = order[place]
        others = order[place + 1 : following[place]]
        others = others[(low[others, 1] <= high[i, 1]) & (high[others, 1] >= low[i, 1])]
        others = others[np.abs(others - i) > 1]
        if not len(others):
            continue
        theirs = _turn(step[i], start[others] - start[i]) * _turn(step[i], end[others] - start[i])
        mine = _turn(step[others], start[i] - start[others]) * _turn(
            step[others], end[i] - start[others]
        )
        if ((theirs <= 0.0) & (mine <= 0.0)).any():
            return int(i)
    return None


def _turn(a: Array, b: Array) -> Array:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
