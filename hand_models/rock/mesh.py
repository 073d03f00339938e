"""A hold made of triangles: a scanned boulder, or any shape that has no formula.

Triangles are counterclockwise seen from outside the rock. They need not close: rock is behind their
front side. On loading they are welded, triangles without area are dropped, spikes are removed and
turned triangles wound alike (`hand_models.rock.triangles`). A finger's plane cuts the mesh; gaps of
the cut up to a few millimetres are bridged, wider ones end the rock there, and the cut is smoothed
to the scale of a tile (`hand_models.rock.smoothing`). The spines of the palm and of the base tiles
and the nails meet the raw triangles.
"""

from __future__ import annotations

import reprlib
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import Array, Indices, InvalidInputError, Pose, go_on, skew
from hand_models.parameters import ParameterTable, scan_table
from hand_models.rock.filled_holes import filled_cells
from hand_models.rock.smoothing import Heights, OutlinedHold
from hand_models.rock.surface import Triangles
from hand_models.rock.triangles import (
    TriangleCells,
    around_holes,
    border_pairs,
    bridge,
    cut,
    weld,
    without_spikes,
    wound_alike,
)
from hand_models.sections import FingerSize

__all__ = ["Mesh"]


class Mesh(OutlinedHold):
    """A hold given as a triangle mesh.

    Parameters
    ----------
    vertices : array_like, shape (n, 3)
        Corners of the triangles, in the hold's frame [m].
    faces : array_like of int, shape (m, 3)
        Indices of each triangle's vertices, counterclockwise from outside the rock.
    hand : ParameterTable, optional
        All parameters of the hand that is to grip the hold, for the scale of smoothing.
    anywhere : bool, optional
        True if the origin of the hold's frame need not be on rock under a palm (`check_place`).

    Attributes
    ----------
    triangles : Triangles
        The repaired mesh.
    nbytes : int
        Memory of the repaired mesh [bytes].
    border : ndarray, shape (n, 2, 3)
        End points of edges of only one triangle, without holes that are bridged [m].
    oddities : tuple of str
        Warnings: vertices that are not finite and in no triangle, and vertices that look like a
        grid's cells without height (`filled_cells`).

    Raises
    ------
    InvalidInputError
        If a triangle has numbers that are not finite, faces name no vertices, no triangle has an
        area, the size is that of another unit, or no palm can be at the frame's origin.
    """

    shape = "mesh"
    cells: TriangleCells

    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        hand: ParameterTable | None = None,
        *,
        anywhere: bool = False,
    ) -> None:
        super().__init__(hand)
        table = scan_table()
        given, self._left_out = _checked(vertices, faces, table)
        welded = weld(given)
        if not len(welded.faces):
            raise InvalidInputError(
                "no triangle has an area; its three vertices must not be on a line", field="faces"
            )
        wound = wound_alike(welded)
        go_on()
        self.triangles = without_spikes(wound, table.scalar("scan", "spike_ratio"))
        go_on()
        self.cells = TriangleCells(self.triangles)
        self.nbytes = sum(part.nbytes for part in self.triangles)
        if not anywhere:
            self.check_place()

    @property
    def border(self) -> Array:
        return self._borders[0]

    @property
    def outline(self) -> Array:
        return self._borders[1]

    @cached_property
    def _borders(self) -> tuple[Array, Array]:
        """End points of the edges of the border, and of those of the outline [m]."""
        pairs = border_pairs(self.triangles, self._scale.bridged_gap)
        border = np.asarray(self.triangles.vertices[pairs])
        return border, border[~around_holes(self.triangles, pairs)]

    @cached_property
    def oddities(self) -> tuple[str, ...]:
        found = [
            f"vertices: {filled.cells} vertices are at exactly {'xyz'[filled.axis]} = "
            f"{filled.value:g} m, with cliffs around them; leave out cells that have no height"
            for filled in filled_cells(self.triangles)
        ]
        if self._left_out:
            found.append(
                f"vertices: {self._left_out} vertices without numbers, which no triangle names, "
                "were left out"
            )
        return tuple(found)

    def surface(self, low: Array, high: Array) -> Triangles:
        """Return the whole repaired mesh, in the hold's frame, whatever the region."""
        return self.triangles

    def check_place(self, at: Pose | None = None) -> None:
        """Check that rock lies at the origin of a palm's frame, and faces the palm.

        Parameters
        ----------
        at : Pose, optional
            The palm's frame in the hold's frame, z into the rock; by default the hold's frame.

        Raises
        ------
        InvalidInputError
            If no rock is near the frame's origin, or the triangles there face away from a palm; the
            field is ``vertices`` or ``faces`` for the hold's frame, else ``place.point`` or
            ``place.approach``.
        """
        there, table = at or Pose.identity(), scan_table()
        near, view = table.scalar("scan", "near"), table.vector("scan", "view")
        if at is None:
            self._check_near(near)
        rays = 5  # along each side of the palm
        x, y = np.meshgrid(*(np.linspace(-half, half, rays) for half in view))
        places = there.apply(np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]))
        if self.cells.lines(places, there.rotation[:, 2])[1].sum() < 0:
            raise InvalidInputError(
                "the triangles under the palm face away from it: is the approach into the rock? "
                "their vertices must be counterclockwise seen from outside the rock: flip every "
                "face, or close the hole under the palm if it opens into the rock",
                field="faces" if at is None else "place.approach",
            )
        super().check_place(at)

    def _check_near(self, near: float) -> None:
        """Check that a triangle is so near to the origin along each axis [m]."""
        most = np.full(3, near)
        found = self.triangles.faces[self.cells.within(np.eye(3), -most, most)]
        corners = self.triangles.vertices[found]
        beside = (corners.min(axis=1) <= near) & (corners.max(axis=1) >= -near)
        if not beside.all(axis=1).any():
            nearest = np.linalg.norm(self.triangles.vertices, axis=1).min()
            raise InvalidInputError(
                f"the nearest vertex is {nearest:.3g} m from the hold's origin, which is to be on "
                f"the rock under the palm; at most {near:g} m is possible: move "
                "the origin onto the rock",
                field="vertices",
            )

    def _pieces(self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike) -> list[Array]:
        """Return the cut through the triangles, small gaps bridged."""
        plane = np.array([origin, s_axis, t_axis], dtype=float)
        o, s, t = plane
        pieces = cut(self.triangles, o, s, t, self._scale.reach, self._near(plane, 0.0))
        return bridge(pieces, self._scale.bridged_gap)

    def _heights(self, plane: Array, size: FingerSize) -> Heights:
        near = self._near(plane, 0.5 * size.frame_width)
        return self._heights_of(self.triangles, near, plane, size)

    def _near(self, plane: Array, half: float) -> Indices:
        """Return the triangles within reach of a plane's origin and so far from the plane [m]."""
        origin, s, t = plane
        axes, reach = np.array([skew(s) @ t, s, t]), self._scale.reach
        beside, middle = np.array([half, reach, reach]), axes @ origin
        return self.cells.within(axes, middle - beside, middle + beside)

    def entry(self, point: ArrayLike, direction: ArrayLike) -> float:
        """Cast a ray: return the distance from a point, along a direction, at which rock begins.

        Returns
        -------
        float
            Negative where the point is inside the rock; infinite where the ray meets no front side
            of a triangle [m].
        """
        return self.entries(np.asarray(point, dtype=float)[None], direction)[0]

    def entries(self, points: ArrayLike, direction: ArrayLike) -> list[float]:
        places, along = np.array(points, float, order="C"), np.asarray(direction, dtype=float)
        found: list[float] = self.cells.lines(places, along)[0].tolist()
        return found


def _checked(vertices: ArrayLike, faces: ArrayLike, table: ParameterTable) -> tuple[Triangles, int]:
    """Return triangles, and how many vertices without numbers were left out that none names."""
    try:
        points = np.asarray(vertices, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInputError(
            f"must be three numbers [x, y, z] each, got {reprlib.repr(vertices)}", field="vertices"
        ) from None
    try:
        corners = np.asarray(faces)
    except (TypeError, ValueError):
        raise InvalidInputError(
            f"must be three indices [i, j, k] each, got {reprlib.repr(faces)}", field="faces"
        ) from None
    if points.ndim != 2 or points.shape[1:] != (3,) or len(points) < 3:
        raise InvalidInputError(
            f"at least three points [x, y, z] are needed, got shape {points.shape}",
            field="vertices",
        )
    if corners.ndim != 2 or corners.shape[1:] != (3,) or not len(corners):
        raise InvalidInputError(
            f"at least one triangle [i, j, k] is needed, got shape {corners.shape}", field="faces"
        )
    if not np.issubdtype(corners.dtype, np.integer):
        raise InvalidInputError(f"whole numbers are needed, got {corners.dtype}", field="faces")
    bad = np.flatnonzero(((corners < 0) | (corners >= len(points))).any(axis=1))
    if len(bad):
        raise InvalidInputError(
            f"must name vertices 0 to {len(points) - 1}, got {corners[bad[0]].tolist()}",
            field=f"faces[{bad[0]}]",
        )
    finite = np.isfinite(points).all(axis=1)
    bad = corners[~finite[corners]]
    if len(bad):
        raise InvalidInputError(
            "must have three finite coordinates, as a triangle uses it, got "
            f"{points[bad.min()].tolist()}; remove its triangles, or repair it",
            field=f"vertices[{bad.min()}]",
        )
    left_out = len(points) - int(finite.sum())
    if left_out:
        points, corners = points[finite], (np.cumsum(finite) - 1)[corners]
    farthest = table.scalar("scan", "farthest")
    if np.abs(points).max() > farthest:
        raise InvalidInputError(
            f"must be within {farthest:g} m of the frame's origin, got {np.abs(points).max():g} m; "
            "subtract an offset from map coordinates, as `crux rock` does",
            field="vertices",
        )
    largest, size = table.scalar("scan", "largest"), float(np.ptp(points, axis=0).max())
    if size > largest:
        raise InvalidInputError(
            f"must be at most {largest:g} m across, got {size:.4g} m: vertices are in metres, so "
            "divide millimetres by 1000, or cut the mesh to what hands reach",
            field="vertices",
        )
    return Triangles(points, corners.astype(np.intp)), left_out
