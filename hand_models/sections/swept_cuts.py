"""Smooth holds in one form: a ball, stretched along the axes, that is swept along two faces.

With x from the hold's frame, its centre c at (0, 0, depth) and the scales S on the diagonal, the
rock is every point that a point of the ball ``|S (x − c)| ≤ radius`` reaches along the directions
of the faces, (± sine, 0, cosine):

- a ball and a boulder have no faces;
- a log is a ball without its scale along y, so that every plane across y cuts the same disc;
- an edge is a log swept along its two faces;
- a wall is an edge of half a turn whose log has no size, and of which only z counts.

So the same arithmetic casts rays into all these holds, and cuts them with a finger's plane.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import BASE_TOLERANCES, Array
from hand_models.sections.ellipses import Ellipse, arc, radii, rock_left
from hand_models.sections.section import Complexes, Face
from hand_models.sections.settings import SECTION_SETTINGS
from hand_models.sections.smooth import Disc, FlatRock, SmoothSection, Tangent

__all__ = ["FingerPlane", "Swept", "cut_of", "entry_distances"]

FingerPlane = tuple[float, float, float, float, float, float, float, float, float]
"""Nine numbers: axes of a finger's plane, along the finger and into the rock, and its origin from
the centre of the hold's ball, all multiplied by the scales.
"""


class Swept(NamedTuple):
    """Numbers of a smooth hold: a ball, scaled along the axes, that is swept along two faces.

    Attributes
    ----------
    scale_x, scale_y, scale_z : float
        Scales S: 1/m for an ellipsoid; for other holds 1, or 0 for a coordinate without effect.
    depth : float
        z of the ball's centre in the hold's frame [m].
    radius : float
        Radius of the scaled ball: 1 for an ellipsoid, in m for other holds, 0 for a wall.
    sine, cosine : float
        Sine and cosine of half the angle between the faces; both 0 for a hold without faces.
    grazing : float
        Slope up to which a line counts as parallel to a face, and so does not meet it.
    """

    scale_x: float
    scale_y: float
    scale_z: float
    depth: float
    radius: float
    sine: float = 0.0
    cosine: float = 0.0
    grazing: float = 0.0


def entry_distances(shape: Swept, points: ArrayLike, directions: ArrayLike) -> Array:
    """Cast rays: return the distance from each point, along its direction, at which rock begins.

    Parameters
    ----------
    shape : Swept
        The hold.
    points : array_like, shape (..., 3)
        x, y, z from the ball's centre (0, 0, ``shape.depth``) in the hold's frame [m], each times
        the scale of its axis (``shape.scale_x``, …).
    directions : array_like, shape (..., 3)
        x, y, z of unit vectors in the hold's frame, scaled likewise; the shapes broadcast.

    Returns
    -------
    ndarray, shape (...)
        Distance from each point, in metres of the hold's frame. Negative if the rock begins behind
        the point, as for a point inside the rock; infinite if the ray's line misses the rock.
    """
    places, ways = np.asarray(points, dtype=float), np.asarray(directions, dtype=float)
    x, y, z = places[..., 0], places[..., 1], places[..., 2]
    dx, dy, dz = ways[..., 0], ways[..., 1], ways[..., 2]
    a, b = dx * dx + dy * dy + dz * dz, x * dx + y * dy + z * dz
    radius = shape.radius
    discriminant = b * b - a * (x * x + y * y + z * z - radius * radius)
    meets = (discriminant >= 0.0) & (a > 0.0) & (radius > 0.0)
    near = -b - np.sqrt(np.where(meets, discriminant, 0.0))
    found = np.where(meets, near / np.where(a > 0.0, a, 1.0), math.inf)
    if shape.sine:
        for side in (1.0, -1.0):
            sine, cosine = shape.sine, side * shape.cosine
            closing = cosine * dx - sine * dz
            steep = closing < -shape.grazing
            hit = (radius - cosine * x + sine * z) / np.where(steep, closing, 1.0)
            ahead = side * sine * (x + hit * dx) + shape.cosine * (z + hit * dz)
            found = np.minimum(found, np.where(steep & (ahead >= 0.0), hit, math.inf))
    return np.asarray(found)


def cut_of(shape: Swept, plane: FingerPlane) -> SmoothSection | None:
    """Cut a smooth hold with a finger's plane, and return the rock in the plane.

    Parameters
    ----------
    shape : Swept
    plane : tuple of float, length 9
        Axes s and t of the plane and its origin, scaled as `FingerPlane` says.

    Returns
    -------
    SmoothSection or None
        None if the plane misses the rock.
    """
    a, b, c, d, e, f, x, y, z = plane
    if not shape.radius:
        steep = math.hypot(c, f)
        if steep < SECTION_SETTINGS.parallel_sine:
            return None
        return FlatRock(complex(c, f) / steep, -z / steep)
    if shape.scale_y:
        # Cholesky's factor of the ellipsoid's quadratic form in the plane
        g11, g12, g22 = a * a + b * b + c * c, a * d + b * e + c * f, d * d + e * e + f * f
        b1, b2 = a * x + b * y + c * z, d * x + e * y + f * z
        determinant = g11 * g22 - g12 * g12
        centre = complex(g12 * b2 - g22 * b1, g12 * b1 - g11 * b2) / determinant
        square = shape.radius**2 - (x * x + y * y + z * z) - b1 * centre.real - b2 * centre.imag
        if square <= 0.0:
            return None
        rho, size = math.sqrt(square), determinant**-0.25
        a, c = math.sqrt(g11), 0.0
        d, f = g12 / a, math.sqrt(determinant) / a
    else:
        turned = a * f - c * d
        if abs(turned) < SECTION_SETTINGS.parallel_sine:
            return _along_axis(shape, plane)
        centre = complex(d * z - f * x, c * x - a * z) / turned
        rho, size = shape.radius, 1.0
    # w = A v + B v̄ for the matrix of a, d over c, f
    A, B = 0.5 * complex(a + f, c - d), 0.5 * complex(a - f, c + d)
    core: Disc | Ellipse
    # a boulder's cut is an ellipse wherever it is, round or not
    less, more = sorted((abs(A), abs(B)))
    if less <= BASE_TOLERANCES.rounding * more and shape.scale_y in (0.0, 1.0):
        core = Disc(centre, rho / more)
    else:
        # an ellipsoid's mean radius turns distances to its section into metres
        core = Ellipse(centre, (A, B), rho, size)
        # square of the least sine of the angle between the plane and the axis of what it cuts
        core.skew = (more**2 - less**2) ** 2 <= 1e-3 * (more**2 + less**2) ** 2
    if not shape.sine:
        return core
    lines = (_line(shape, plane, side) for side in (1.0, -1.0))
    return _Edge(core, radii((A, B), rho), math.atan2(shape.cosine, shape.sine), *lines)


def _along_axis(shape: Swept, plane: FingerPlane) -> FlatRock | None:
    """Return the straight rock in a plane that holds the axis of an extrusion."""
    depth = float(entry_distances(shape, plane[6:], plane[3:6]))
    if not math.isfinite(depth):
        return None
    # where a vector of the plane is all but lost across the axis
    a, _, c, d, _, f = plane[:6]
    lost = complex(d * d + f * f - a * a - c * c, -2.0 * (a * d + c * f))
    along = (lost / abs(lost)) ** 0.5
    wall = FlatRock(1j * along, along.real * depth)
    wall.skew = True
    return wall


class _Line(NamedTuple):
    """A flat face of the rock: it is where out · q = ball, from where ahead · q ≥ 0 on.

    Attributes
    ----------
    out : complex
        Out of the rock, conjugated; from the ball's centre.
    out_offset : float
    ahead : complex
        Along the face, conjugated; from where it begins.
    ahead_offset : float
    ball : float
        How far the face is from the ball's centre [m].
    way : complex
        Along the line in the plane, on the side of the face, conjugated.
    """

    out: complex
    out_offset: float
    ahead: complex
    ahead_offset: float
    ball: float
    way: complex

    def beyond(self, point: complex) -> float:
        """Return how far a point is beyond the face's line."""
        return (self.out * point).real + self.out_offset - self.ball

    def beside(self, point: complex) -> float:
        """Return how far a point is along the face from where it begins."""
        return (self.ahead * point).real + self.ahead_offset

    def entry(self, joint: complex, arm: float) -> complex | None:
        """Return the direction in which a point that turns about a joint crosses the face."""
        steep = abs(self.out)
        cosine = self.beyond(joint) / (steep * arm)
        if abs(cosine) > 1.0:
            return None
        way = self.out.conjugate() / -steep * complex(cosine, -math.sqrt(1.0 - cosine * cosine))
        return way if self.beside(joint + arm * way) >= 0.0 else None


def _line(shape: Swept, plane: FingerPlane, side: float) -> _Line:
    """Return the face on one side of a hold."""
    a, _, c, d, _, f, x, _, z = plane
    sine, cosine = side * shape.sine, side * shape.cosine
    out = complex(cosine * a - shape.sine * c, shape.sine * f - cosine * d)
    ahead = complex(sine * a + shape.cosine * c, -sine * d - shape.cosine * f)
    way = 1j * out
    return _Line(
        out=out,
        out_offset=cosine * x - shape.sine * z,
        ahead=ahead,
        ahead_offset=sine * x + shape.cosine * z,
        ball=shape.radius,
        way=way if (way.conjugate() * ahead).real >= 0.0 else -way,
    )


class _Edge(SmoothSection):
    """A disc or an ellipse of rock that is swept along two faces.

    Parameters
    ----------
    core : Disc or Ellipse
    axes : tuple of complex
        As of `Ellipse` [m].
    most : float
        How far the normal out of the core turns from the crest to each face [rad].
    first, second : _Line
        The faces, with φ growing toward the first.
    """

    faced = True

    def __init__(
        self,
        core: Disc | Ellipse,
        axes: tuple[complex, complex],
        most: float,
        first: _Line,
        second: _Line,
    ) -> None:
        self._core, self._axes, self._most = core, axes, most
        self._first, self._second, self.skew = first, second, core.skew

    def _bounded(self, normal: complex) -> bool:
        """Return True if a line of that normal, into the rock, can bound it: no face crosses it."""
        return (self._first.way * normal).real >= 0.0 and (self._second.way * normal).real >= 0.0

    def tangent(self, joint: complex, height: float) -> Tangent | None:
        found = self._core.tangent(joint, height)
        return found if found is not None and self._bounded(1j * found[0]) else None

    def entries(self, joint: complex, arm: float) -> list[complex]:
        first, second = self._first, self._second
        ways = []
        for way in self._core.entries(joint, arm):
            point = joint + arm * way
            if first.beside(point) <= 0.0 and second.beside(point) <= 0.0:
                ways.append(way)
        for line in (first, second):
            on_face = line.entry(joint, arm)
            if on_face is not None:
                ways.append(on_face)
        return ways

    def partings(self, joint: complex, u: complex, face: Face) -> Iterator[complex]:
        begin, end = (joint + complex(along, face.height) * u for along in (face.start, face.end))
        for line in (self._first, self._second):
            if line.beyond(begin) > 0.0 and line.beyond(end) > 0.0:
                yield -line.out.conjugate()
        for normal in self._core.partings(joint, u, face):
            if self._bounded(normal):
                yield normal

    def distance(self, point: complex) -> float:
        first, second = self._first, self._second
        ball, beyond = first.ball, (first.beyond(point), second.beyond(point))
        if max(beyond) <= -ball:
            return max(beyond)
        away = self._core.distance(point)
        for line, far in zip((first, second), beyond, strict=True):
            if far >= -ball and line.beside(point) >= 0.0:
                away = min(away, far)
        return away

    def straight(self, point: complex) -> bool:
        return any(
            line.beside(point) >= 0.0 and line.beyond(point) + line.ball >= -BASE_TOLERANCES.length
            for line in (self._first, self._second)
        )

    def outline(self, reach: float, spacing: float) -> Sequence[Complexes]:
        places = arc(self._core.centre, self._axes, self._most, reach, spacing)
        ends = []
        for end, line in ((places[0], self._second), (places[-1], self._first)):
            way = line.way.conjugate()
            ends.append(end + (abs(end) + reach) / abs(way) * way)
        return [rock_left(np.concatenate([ends[:1], places, ends[1:]]), self._axes)]
