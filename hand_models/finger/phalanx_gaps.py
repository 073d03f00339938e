"""Gaps between the phalanges of fingers and rock, and the places where contact forces act.

A phalanx is a bar of circular section about its *axis*: straight under the tile, lifted so that
the tile's face is flat at its height, and from the tile's far end on down to the next joint. So
the tile is flat, its corners are round, and the phalanx ends in a disc about the next joint, with
the frame's radius.

Rock is a set of points along its boundary, each with its length w. A point's depth g is its
distance from the axis less the bar's radius. Phalanx and rock touch where g is zero. So that the
contact does not jump from one bump to another as the phalanx turns, the *gap* is the level h to
which a bed of springs between phalanx and rock would sink under a small, fixed energy,

    Σ w max(0, h − g)² = tile length × fine²,

less ``fine``: zero for a face that lies flat, and within a few ``fine`` of the least g elsewhere.

**Where a contact's force acts.** A tile rests on a bed of springs that is pressed in by ``depth``
beyond first touch. With p = w max(0, gap + depth − g) the force acts at the mean, weighted by p,
of the places of the phalanx nearest to the rock's points, along the mean of their directions: in
the middle of a face that lies flat, at the place of least distance on rock that bends away on both
sides, at the face's end on rock under that end. The place changes without a jump.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from hand_models.base import BASE_TOLERANCES, Array, Indices
from hand_models.finger.model import FingerModel
from hand_models.sections import SECTION_SETTINGS, Complexes, Flags, Outlines, stretch_minima

__all__ = [
    "Beside",
    "NearPoints",
    "PhalanxShape",
    "fan_out",
    "middle_of_bed",
    "nearest_points",
]

Pressed = TypeVar("Pressed", float, NDArray[Any])

Values = TypeVar("Values", Array, Complexes)


class Beside(NamedTuple):
    """Gap and contact force of phalanges beside rock, arrays of one shape (...).

    Complex numbers are (along, above) in the phalanx's axes: real part along it from its joint,
    imaginary part toward the rock.

    Attributes
    ----------
    gap : ndarray
        Distance from phalanx to rock [m]; negative where rock is inside the phalanx.
    tile_gap : ndarray
        Distance from the tile's face to the rock [m].
    place : ndarray of complex
        Place where the contact's force acts [m].
    push : ndarray of complex
        Unit vector of the contact's force, toward the rock.
    """

    gap: Array
    tile_gap: Array
    place: Complexes
    push: Complexes


class NearPoints(NamedTuple):
    """Points of rock that phalanges may press on, sorted by phalanx.

    Attributes
    ----------
    points : ndarray of complex, shape (p,)
        x + i z of each point in its finger's F [m].
    lengths : ndarray, shape (p,)
        Length w of the rock's boundary that each point represents [m].
    phalanx : ndarray of int, shape (p,)
        Index of each point's phalanx.
    first : ndarray of int
        Index of the first point of each phalanx; every phalanx has at least one point.
    bare : ndarray of bool, shape (p,)
        True for rock that the bare frame meets, beside the tiles.
    """

    points: Complexes
    lengths: Array
    phalanx: Indices
    first: Indices
    bare: Flags

    def of_poses(self, count: int) -> NearPoints:
        """Return the points repeated for ``count`` poses of all phalanges, pose after pose."""
        poses = np.arange(count)[:, None]
        return NearPoints(
            np.tile(self.points, count),
            np.tile(self.lengths, count),
            (self.phalanx + len(self.first) * poses).ravel(),
            (self.first + len(self.points) * poses).ravel(),
            np.tile(self.bare, count),
        )

    def sums(self, values: Values) -> Values:
        """Return the sum of values (p,) over the points of each phalanx, one number per phalanx."""
        total: Values = np.add.reduceat(values, self.first)
        return total

    def least(self, values: Array) -> Array:
        """Return the least of values (p,) over the points of each phalanx, one per phalanx."""
        return np.asarray(np.minimum.reduceat(values, self.first))


class PhalanxShape(NamedTuple):
    """Dimensions of a phalanx that meets rock, measured from its joint [m].

    Attributes
    ----------
    near, far : float
        Begin and end of the tile's face along the phalanx.
    end : float
        End of the phalanx: distance to the next joint.
    lift : float
        Height of the bar's axis under the tile, above the line of the joints.
    radius : float
        Radius of the bar.
    travel : float
        Distance that spines reach out of the tile.
    """

    near: float
    far: float
    end: float
    lift: float
    radius: float
    travel: float

    @classmethod
    def of(cls, model: FingerModel) -> PhalanxShape:
        """Return the shape of the phalanges of a finger model."""
        radius = min(model.frame_radius, model.tile_height)
        lift = model.tile_height - radius
        return cls(*model.tile_range, model.joint_spacing, lift, radius, model.spine_travel)

    @property
    def length(self) -> float:
        """Length of the tile [m]."""
        return self.far - self.near

    @property
    def spacing(self) -> float:
        """Largest spacing of the points that represent rock [m]."""
        # so near that the round end of a phalanx slides over points as over the rock between
        return self.length / 192

    @property
    def fine(self) -> float:
        """Smoothing length of the gap [m].

        The gap differs from the least distance to the rock by about this length at most.
        """
        return self.length / 4800.0

    @property
    def closes(self) -> float:
        """Tolerance on negative gaps: rock inside a phalanx by less counts as touching [m]."""
        return self.length / 2.4e6

    def beside(self, near: NearPoints, joint: Complexes, u: Complexes, depth: Array) -> Beside:
        """Return gaps, and places and directions of contact forces, of phalanges beside rock.

        Parameters
        ----------
        near : NearPoints
            Points of rock near all phalanges, from `nearest_points`.
        joint, u : ndarray of complex, shape (...)
            x + i z of each phalanx's joint [m], and the unit vector along the phalanx.
        depth : ndarray, shape (...)
            Depth to which each tile is pressed into its bed of springs [m].

        Returns
        -------
        Beside
            Arrays of the same shape (...).
        """
        of = near.phalanx
        seen = (near.points - joint.ravel()[of]) * u.ravel().conj()[of]
        away, from_tile = self._from_axis(seen, near.bare)
        size = np.abs(away)
        depths = size - self.radius
        gap = self._level(depths, near) - self.fine
        pressed = np.maximum((gap + depth.ravel())[of] - depths, 0.0) * near.lengths
        tiny = 1e-30  # divides what is zero
        total = np.maximum(near.sums(pressed), tiny)
        out = away / np.maximum(size, tiny)
        place = near.sums(pressed * (seen - away + self.radius * out)) / total
        push = near.sums(pressed * out) / total
        return Beside(
            gap.reshape(u.shape),
            (near.least(from_tile) - self.radius).reshape(u.shape),
            place.reshape(u.shape),
            (push / np.maximum(np.abs(push), tiny)).reshape(u.shape),
        )

    def may_press(self, seen: Complexes, near: NearPoints, within: Array) -> NearPoints:
        """Return the points on which `beside` depends, a subset of those given.

        Parameters
        ----------
        seen : ndarray of complex, shape (p,)
            Points in the axes of their phalanges [m].
        near : NearPoints
            The same points, in the finger frame F.
        within : ndarray
            Margin of each phalanx: its tile's depth plus the largest further motion [m].
        """
        away, from_tile = self._from_axis(seen, near.bare)
        size = np.abs(away)
        # the bed sinks no lower than with any point alone
        least = near.least(size + self.alone(near.lengths)) + within
        chosen = size <= least[near.phalanx]
        chosen |= from_tile <= (near.least(from_tile) + within)[near.phalanx]
        count = np.bincount(near.phalanx[chosen], minlength=len(near.first))
        return NearPoints(
            near.points[chosen],
            near.lengths[chosen],
            near.phalanx[chosen],
            np.cumsum(count) - count,
            near.bare[chosen],
        )

    def _from_axis(self, seen: Complexes, bare: Flags) -> tuple[Complexes, Array]:
        """Return the way to points from the axis; and how far from under the tile they are [m].

        The axis of a bare frame has no lift. Its points are infinitely far from under the tile.
        """
        lift = np.where(bare, 0.0, self.lift) if bare.any() else np.array(self.lift)
        from_tile = seen - (np.clip(seen.real, self.near, self.far) + 1j * lift)
        corner, step = self.far + 1j * lift, (self.end - self.far) - 1j * lift
        length = np.hypot(self.end - self.far, lift)
        part = ((seen - corner) * step.conj()).real / length**2
        beyond = seen - (corner + np.clip(part, 0.0, 1.0) * step)
        distance = np.abs(from_tile)
        away = np.where(distance <= np.abs(beyond), from_tile, beyond)
        return away, np.where(bare, np.inf, distance)

    def alone(self, lengths: Array) -> Array:
        """Return how far a bed of springs sinks if it rests on a single point of rock [m].

        ``lengths``: boundary length w that each point represents [m].
        """
        return np.asarray(np.minimum(self._root / np.sqrt(lengths), self.far))

    @property
    def _root(self) -> float:
        """Root of the energy that sinks a bed to its level."""
        return self.fine * math.sqrt(self.length)

    def _level(self, depths: Array, near: NearPoints) -> Array:
        """Return the level h to which the bed sinks [m]; ‖√w max(0, h − g)‖ is convex in it."""
        root = self._root
        first = stretch_minima(depths, near.first)
        level = depths[first] + self.alone(near.lengths[first])
        for _ in range(20):
            sunk = np.maximum(level[near.phalanx] - depths, 0.0)
            load = near.lengths * sunk
            norm = np.sqrt(near.sums(load * sunk))
            step = (root - norm) * norm / np.maximum(near.sums(load), 1e-30)
            # each as far as it needs, whatever others do
            going = np.abs(step) > BASE_TOLERANCES.rounding * self.far
            level = np.where(going, level + step, level)
            if not going.any():
                break
        return np.asarray(level)


def middle_of_bed(
    reaches: Iterable[Pressed], bends: Iterable[float | Pressed], depth: float | Pressed
) -> Pressed:
    """Return the offset from a face's first touch to its bed's centre of pressure [m].

    The offset is positive toward the face's end. The rock is a parabola on either side of the
    touch; the tile's end may cut the pressed part short.

    Parameters
    ----------
    reaches : pair of float or of ndarray
        Length of the pressed part toward the beginning of the face, and toward its end [m].
    bends : pair of float
        Curvature of the rock on either side [1/m].
    depth : float
        Depth to which the bed is pressed in at the touch [m].
    """
    load: Any = 0.0
    moment: Any = 0.0
    for side, reach, bend in zip((-1.0, 1.0), reaches, bends, strict=True):
        square = reach * reach
        load = load + reach * (depth - bend / 6.0 * square)
        moment = moment + square * (side * depth / 2.0 - side * bend / 8.0 * square)
    found: Pressed = moment / load
    return found


def fan_out(q: Array, spacing: float) -> tuple[Complexes, Complexes]:
    """Return the joints and directions of phalanges for joint angles (forward kinematics).

    Parameters
    ----------
    q : ndarray, shape (..., 3)
        Joint angles, each relative to the phalanx before it [rad].
    spacing : float
        Distance between joints [m].

    Returns
    -------
    joints, directions : ndarray of complex, shape (..., 3)
        x + i z of each joint in the finger frame F, the first at the origin [m]; unit vector along
        each phalanx.
    """
    u = np.exp(1j * np.cumsum(q, axis=-1))
    joints = np.zeros(u.shape, dtype=complex)
    joints[..., 1:] = spacing * np.cumsum(u[..., :-1], axis=-1)
    return joints, u


def nearest_points(
    rock: Outlines, shape: PhalanxShape, q: Array, depth: Array, turn: float = 0.0
) -> NearPoints:
    """Return the points of rock that phalanges of fingers may press on.

    Parameters
    ----------
    rock : Outlines
        Rock in the plane of each of the n fingers.
    shape : PhalanxShape
    q : ndarray, shape (n, 3)
        Joint angles [rad].
    depth : ndarray, shape (n, 3)
        Depth to which each tile is pressed into its bed of springs [m].
    turn : float, optional
        Largest further turn of any joint for which the points must still do [rad].
    """
    joints, u = fan_out(q, shape.end)
    # two points may come nearer to each other by the way of each
    arms = 2.0 * q.shape[-1] * (shape.end + shape.radius + depth)
    within = depth + turn * arms
    # blocks that may hold points which press, or are nearest to the tile
    blocks = (rock.centres[:, None] - joints[..., None]) * u.conj()[..., None]
    radii, chosen = rock.radii[:, None] + shape.lift, np.zeros(blocks.shape, dtype=bool)
    alone = shape.alone(rock.longest)[:, None]
    for end, sinks in ((shape.end, alone), (shape.far, 0.0 * alone)):
        away = np.abs(blocks - np.clip(blocks.real, shape.near, end))
        most = (away + radii + sinks).min(axis=-1) + within
        chosen |= away - radii <= most[..., None]
    blocks_each = rock.centres.shape[-1]
    phalanx, block = np.divmod(np.flatnonzero(chosen), blocks_each)
    block += phalanx // q.shape[-1] * blocks_each
    each = SECTION_SETTINGS.points_per_circle
    points = rock.points.reshape(-1, each)[block].ravel()
    lengths = rock.lengths.reshape(-1, each)[block].ravel()
    bare = rock.bare.reshape(-1, each)[block].ravel()
    count = each * np.bincount(phalanx, minlength=q.size)
    phalanx = np.repeat(phalanx, each)
    near = NearPoints(points, lengths, phalanx, np.cumsum(count) - count, bare)
    seen = (points - joints.ravel()[phalanx]) * u.ravel().conj()[phalanx]
    return shape.may_press(seen, near, within.ravel())
