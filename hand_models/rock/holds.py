"""The base class of all holds.

A hold has its own frame: origin on the rock at the crest (the point nearest the palm), z into the
rock, y along the axis of a cylinder or an edge. The rock in a finger's plane is a `Section`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import Array, InvalidInputError, Pose
from hand_models.parameters import scan_table
from hand_models.rock.surface import Triangles, grid
from hand_models.sections import FingerRock, FingerSize, Section, Swept

if TYPE_CHECKING:
    from hand_models.rock.triangles import TriangleCells

__all__ = ["Hold"]

Angle = TypeVar("Angle", float, Array)


class Hold(ABC):
    """A piece of rock that a hand may grip: base class of the shapes, of meshes and of profiles."""

    shape: str

    nbytes = 0
    """Memory that the hold's data takes [bytes]; 0 for a shape of a few numbers."""

    cells: TriangleCells | None = None
    """Index of a mesh's own triangles; None for other holds."""

    @property
    def border(self) -> Array:
        """Edges where the known rock ends, as pairs of end points, in the hold's frame [m].

        Returns
        -------
        ndarray, shape (n, 2, 3)
            Empty, (0, 2, 3), for a shape without border.
        """
        return np.zeros((0, 2, 3))

    @property
    def outline(self) -> Array:
        """Edges of the border that go around no hole of the known rock, shape (n, 2, 3) [m]."""
        return self.border

    @property
    def largest_sizes(self) -> Mapping[str, float]:
        """Largest length of each field that gives the hold a size, by the field's name [m]."""
        return {}

    @property
    def oddities(self) -> tuple[str, ...]:
        """Warnings about the hold's data, which is used nevertheless; each begins with a field."""
        return ()

    @property
    def swept(self) -> Swept | None:
        """A smooth hold as numbers: a ball swept along two faces; None for other holds."""
        return None

    @abstractmethod
    def section(self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike) -> Section | None:
        """Cut the hold with a finger's plane and return the rock in the plane.

        Parameters
        ----------
        origin : array_like, shape (3,)
            Origin of the plane's coordinates (s, t), in the hold's frame [m].
        s_axis, t_axis : array_like, shape (3,)
            Orthonormal axes of the plane, in the hold's frame; t into the rock.

        Returns
        -------
        Section or None
            None where the plane misses the rock.
        """

    def raw_section(
        self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike
    ) -> Section | None:
        """Cut the hold as `section` does, but keep steps and edges smaller than a finger's tile.

        Arguments are those of `section`.

        Returns
        -------
        Section or None
            None where the plane misses the rock. For a smooth shape the same as `section`.
        """
        return self.section(origin, s_axis, t_axis)

    def finger_rock(
        self,
        origin: ArrayLike,
        s_axis: ArrayLike,
        t_axis: ArrayLike,
        size: FingerSize,
        *,
        tiles_only: bool = False,
    ) -> FingerRock:
        """Return the rock that a finger meets with its width, in its plane; in this class alike.

        Parameters
        ----------
        origin, s_axis, t_axis
            The finger's plane, as of `section`.
        size : FingerSize
            Widths of the finger.
        tiles_only : bool, optional
            True to leave out the rock beside the tiles, and the strips across them.
        """
        return FingerRock(self.section(origin, s_axis, t_axis))

    @abstractmethod
    def entry(self, point: ArrayLike, direction: ArrayLike) -> float:
        """Cast a ray: return the distance from a point, along a direction, at which rock begins.

        Parameters
        ----------
        point, direction : array_like, shape (3,)
            In the hold's frame [m]; the direction has length one.

        Returns
        -------
        float
            Negative where the point is inside the rock; infinite where the ray's line misses the
            rock [m].
        """

    def entries(self, points: ArrayLike, direction: ArrayLike) -> list[float]:
        """Return the distance of `entry` for each of n points, shape (n, 3), as a list [m]."""
        return [self.entry(point, direction) for point in np.asarray(points, dtype=float)]

    def surface(self, low: Array, high: Array) -> Triangles:
        """Return the rock's surface as triangles in the hold's frame, at least within a region.

        Pictures show this surface, and limbs are kept clear of it. In this base class the surface
        is where a grid of 41 × 41 rays along z enters the rock, without overhangs.

        Parameters
        ----------
        low, high : ndarray, shape (3,)
            Opposite corners of the region [m].

        Returns
        -------
        Triangles
            Counterclockwise from outside; none where there is no rock.
        """
        x, y = np.meshgrid(*np.linspace(low[:2], high[:2], 41).T)
        begins = [(*place, low[2]) for place in zip(x.flat, y.flat, strict=True)]
        z = low[2] + np.array([self.entry(place, (0.0, 0.0, 1.0)) for place in begins])
        found = grid(np.stack([x, y, z.reshape(x.shape)], axis=2))
        whole = np.isfinite(z[found.faces]).all(axis=1)
        return Triangles(
            np.where(np.isfinite(found.vertices), found.vertices, 0.0), found.faces[whole]
        )

    def check_place(self, at: Pose | None = None) -> None:
        """Check that rock lies at the origin of the frame in which a palm is to be placed.

        Nothing is checked where no frame is given.

        Parameters
        ----------
        at : Pose, optional
            The palm's frame in the hold's frame, z into the rock.

        Raises
        ------
        InvalidInputError
            If no rock begins near the frame's origin along its z axis; the field is
            ``place.point``.
        """
        if at is None:
            return
        near = scan_table().scalar("scan", "place")
        depth = self.entry(at.position, at.rotation[:, 2])
        if not abs(depth) <= near:
            rock = f"the rock begins {depth:.3g} m" if math.isfinite(depth) else "there is no rock"
            raise InvalidInputError(
                f"{rock} from this point along the approach; at most {near:g} m is possible: is "
                "the point in the frame that is named, and the approach into the rock?",
                field="place.point",
            )

    def crest_circle(self, offset: float) -> tuple[float, float] | None:
        """Return the circle that the rock's outline has at its crest in the plane y = ``offset``.

        Returns
        -------
        tuple of (float, float) or None
            Depth of the centre and radius [m]; None if the outline is not round there.
        """
        return None

    def tangent_point(self, offset: float, angle: Angle) -> tuple[Angle, Angle] | None:
        """Return the point of the outline in the plane y = ``offset`` where it has a given slope.

        None from other holds than an ellipsoid, and where the plane misses it. ``angle``: of the
        tangent from x toward z [rad], one or an array; the result is x and z of that shape [m].
        """
        return None
