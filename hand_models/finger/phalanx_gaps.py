"""How near the phalanges of fingers are to rock, and where they would press on it.

A phalanx is a bar of circular section about its *axis*: straight under the tile, lifted by so much
that the tile's face is flat at its height, and from the tile's far end on down to the next joint.
So its tile is flat, its corners are round, and its end is a disc about the next joint, as the
frame's radius makes them.

Rock is points along its boundary, each with its length w. A point's depth g is its distance from
the axis less the bar's radius. Phalanx and rock touch when g is zero somewhere; so that this does
not jump from one bump to another as the phalanx turns, the *gap* is the level h to which a bed of
springs between them would sink that takes a small, fixed energy,

    Σ w max(0, h − g)² = tile length × fine²,

less ``fine``: zero for a face that lies flat, and within a few ``fine`` of the least g elsewhere.

**Where a contact's force acts.** A tile rests on what gives: on a bed of springs that is pressed in
by ``depth`` beyond where it first touches. With p = w max(0, gap + depth − g) the force acts at
the mean, weighted by p, of the places of the phalanx that points are nearest to, along the mean of
their directions: in the middle of a face that lies flat, at the place of least distance on rock
that bends away on both sides, at the face's end where the face stands on that. It goes from one to
the other without a jump.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices
from hand_models.finger.model import FingerModel
from hand_models.sections import Complexes, Outlines

__all__ = ["NEAREST", "Beside", "PhalanxShape", "fan_out", "middle_of_bed", "nearest_points"]

NEAREST: Final = 96
"""How many points of rock are looked at for a phalanx: on flat rock, all along it and beyond."""

POINTS: Final = 48
"""Of rock, for the length of a tile."""

FINENESS: Final = 4800.0
"""Of the gap, in parts of the length of a tile."""

ROUNDINGS: Final = 2.4e6
"""Gaps that may be negative without being closed, in as many parts of it."""

MOST_STEPS: Final = 20
LEVEL: Final = 1e-12
"""Of the search for a level: how many steps, and how exactly, in parts of a tile's length."""

TINY: Final = 1e-30

MOTIONS: Final = 3
"""Of a phalanx in its plane."""

Pressed = TypeVar("Pressed", float, NDArray[Any])


class Beside(NamedTuple):
    """Phalanges beside rock, shape (...); in a phalanx's axes, along + i above.

    Attributes
    ----------
    gap : ndarray
        From phalanx to rock, negative where it stands in it [m].
    tile_gap : ndarray
        From the tile's face alone [m].
    place : ndarray of complex
        Where the force of a contact acts [m].
    push : ndarray of complex
        Unit vector toward the rock along which it acts.
    d_gap, d_tile_gap : ndarray, shape (..., 3)
    d_place, d_push : ndarray of complex, shape (..., 3)
        How these change as the phalanx turns about its joint [1/rad], and as it moves along itself
        and to its upper side [1/m].
    """

    gap: Array
    tile_gap: Array
    place: Complexes
    push: Complexes
    d_gap: Array
    d_tile_gap: Array
    d_place: Complexes
    d_push: Complexes


class PhalanxShape(NamedTuple):
    """What of a phalanx meets rock, along it from its joint [m].

    Attributes
    ----------
    near, far : float
        Where the tile's face begins and ends.
    end : float
        Of the phalanx: the next joint.
    lift : float
        Of the axis under the tile, above the line of the joints.
    radius : float
        Of the bar.
    travel : float
        How far spines reach from the tile.
    """

    near: float
    far: float
    end: float
    lift: float
    radius: float
    travel: float

    @classmethod
    def of(cls, model: FingerModel) -> PhalanxShape:
        """Return the shape of a finger's phalanges."""
        radius = min(model.frame_radius, model.tile_height)
        lift = model.tile_height - radius
        return cls(*model.tile_range, model.joint_spacing, lift, radius, model.spine_travel)

    @property
    def spacing(self) -> float:
        """Of the points that rock is made of, at most [m]."""
        return (self.far - self.near) / POINTS

    @property
    def fine(self) -> float:
        """How far the gap may be from the least distance, about [m]."""
        return (self.far - self.near) / FINENESS

    @property
    def closes(self) -> float:
        """By how much a gap may be negative without being closed [m]."""
        return (self.far - self.near) / ROUNDINGS

    def beside(
        self, points: Complexes, lengths: Array, joint: Complexes, u: Complexes, depth: Array
    ) -> Beside:
        """Return how phalanges are beside rock.

        Parameters
        ----------
        points : ndarray of complex, shape (..., p)
            Of the rock; see `nearest_points` [m].
        lengths : ndarray, shape (..., p)
            [m]
        joint, u : ndarray of complex, shape (...)
            Of the phalanges: their joints [m] and their directions.
        depth : ndarray, shape (...)
            How far their tiles are pressed in [m].
        """
        shape = joint.shape
        seen = ((points - joint[..., None]) * u.conj()[..., None]).reshape(-1, points.shape[-1])
        from_tile, from_end = self._from_axis(seen)
        depths = np.minimum(from_tile, from_end) - self.radius
        lengths = np.broadcast_to(lengths, (*shape, lengths.shape[-1])).reshape(seen.shape)
        depth = np.broadcast_to(depth, shape).ravel()
        bed = self._bed(depths, lengths, depth)
        gap = bed.level - self.fine
        pressed = np.maximum((gap + depth)[bed.row] - bed.depth, 0.0) * bed.length
        # of each point, where it is, the way out to it, and how much the foot of that moves
        z = seen[bed.row, bed.column]
        out, bends = self._out(z)
        foot = z - bed.depth * out
        total = np.maximum(bed.sums(pressed), TINY)
        place, push = bed.sums(pressed * foot) / total, bed.sums(pressed * out) / total
        # how points move off the axis, and along it, as the phalanx turns and moves
        away, beside = _motions(z, out)
        load = np.maximum(bed.level[bed.row] - bed.depth, 0.0) * bed.length
        d_gap = bed.sums(load * away) / np.maximum(bed.sums(load), TINY)
        d_pressed = np.where(pressed > 0.0, bed.length * (d_gap[:, bed.row] - away), 0.0)
        d_out = 1j * out * beside * bends
        d_foot = 1j * out * beside * (1.0 - bends * bed.depth)
        d_total = bed.sums(d_pressed)
        d_place = (bed.sums(d_pressed * foot + pressed * d_foot) - place * d_total) / total
        d_push = (bed.sums(d_pressed * out + pressed * d_out) - push * d_total) / total
        size = np.maximum(np.abs(push), TINY)
        push = push / size
        d_push = 1j * push * (d_push * push.conj()).imag / size
        nearest = from_tile.argmin(axis=-1)
        rows = np.arange(len(seen))
        tile_gap, z = from_tile[rows, nearest] - self.radius, seen[rows, nearest]
        d_tile_gap, _ = _motions(z, _unit(z - (z.real.clip(self.near, self.far) + 1j * self.lift)))

        def rates(values: NDArray[Any]) -> NDArray[Any]:
            return np.moveaxis(values, 0, -1).reshape(*shape, MOTIONS)

        return Beside(
            gap.reshape(shape),
            tile_gap.reshape(shape),
            place.reshape(shape),
            push.reshape(shape),
            rates(d_gap),
            rates(d_tile_gap),
            rates(d_place),
            rates(d_push),
        )

    def _from_axis(self, seen: Complexes) -> tuple[Array, Array]:
        """Return how far points are from the axis under the tile, and from the rest of it [m]."""
        x, y = np.ascontiguousarray(seen.real), seen.imag - self.lift
        across = x - np.clip(x, self.near, self.far)
        from_tile = np.sqrt(across * across + y * y)
        x -= self.far
        run, fall = self.end - self.far, -self.lift
        part = np.clip((x * run + y * fall) / (run * run + fall * fall), 0.0, 1.0)
        x -= part * run
        y -= part * fall
        return from_tile, np.sqrt(x * x + y * y)

    def _out(self, z: Complexes) -> tuple[Complexes, Array]:
        """Return unit vectors from the axis to points, and how much they turn as these move [1/m].

        Beside the ends of the axis' parts they do, elsewhere not at all.
        """
        foot = z.real.clip(self.near, self.far) + 1j * self.lift
        corner, step = complex(self.far, self.lift), complex(self.end - self.far, -self.lift)
        part = ((z - corner) * step.conjugate()).real / abs(step) ** 2
        beyond = corner + part.clip(0.0, 1.0) * step
        under = np.abs(z - foot) <= np.abs(z - beyond)
        along = np.where(
            under, (z.real > self.near) & (z.real < self.far), (part > 0.0) & (part < 1.0)
        )
        away = z - np.where(under, foot, beyond)
        return _unit(away), np.where(along, 0.0, 1.0 / np.maximum(np.abs(away), TINY))

    def _bed(self, depths: Array, lengths: Array, depth: Array) -> _Bed:
        """Return points that may be in beds, and the level to which these sink [m].

        That is where ‖√w max(0, h − g)‖, which is convex in h, takes the energy. Beds are then
        pressed in by ``depth``.
        """
        root = self.fine * np.sqrt(self.far - self.near)
        rows, least = np.arange(len(depths)), depths.argmin(axis=-1)
        # no lower than with the nearest point alone
        alone = root / np.sqrt(lengths[rows, least])
        level = depths[rows, least] + np.minimum(alone, self.far)
        row, column = (depths <= (level + depth)[:, None]).nonzero()
        begin = np.searchsorted(row, rows)
        bed = _Bed(row, column, begin, level, depths[row, column], lengths[row, column])
        for _ in range(MOST_STEPS):
            sunk = np.maximum(level[row] - bed.depth, 0.0)
            load = bed.length * sunk
            norm = np.sqrt(bed.sums(load * sunk))
            step = (root - norm) * norm / np.maximum(bed.sums(load), TINY)
            # each as far as it needs, whatever others do
            going = np.abs(step) > LEVEL * self.far
            level = np.where(going, level + step, level)
            if not going.any():
                break
        return bed._replace(level=level)


class _Bed(NamedTuple):
    """Points near n phalanges, and the level of the bed on them.

    Attributes
    ----------
    row, column : ndarray of int, shape (b,)
        Phalanx and number of each, in order.
    begin : ndarray of int, shape (n,)
        Where those of each phalanx begin; each has one at least.
    level : ndarray, shape (n,)
        [m]
    depth, length : ndarray, shape (b,)
        [m]
    """

    row: Indices
    column: Indices
    begin: Indices
    level: Array
    depth: Array
    length: Array

    def sums(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return the sums over the points of each phalanx."""
        return np.add.reduceat(values, self.begin, axis=-1)


def _unit(away: Complexes) -> Complexes:
    return np.asarray(away / np.maximum(np.abs(away), TINY))


def _motions(z: Complexes, out: Complexes) -> tuple[Array, Array]:
    """Return the parts along ``out``, and across it, of how points move in a phalanx's axes.

    As it turns by a radian about its joint and moves by a metre along itself, and to its upper
    side; shape (3, ...).
    """
    turned = -1j * z * out.conj()
    away = np.stack([turned.real, -out.real, -out.imag])
    return away, np.stack([turned.imag, out.imag, -out.real])


def middle_of_bed(reaches: Iterable[Pressed], bends: Iterable[float], depth: float) -> Pressed:
    """Return how far from where a face touches rock the middle of its bed's pressures is [m].

    Parameters
    ----------
    reaches : pair of float or of ndarray
        How far the bed is pressed toward the beginning of the face, and toward its end [m].
    bends : pair of float
        Curvature of the rock on either side [1/m].
    depth : float
        How far the bed is pressed in where the face touches [m].
    """
    load: Any = 0.0
    moment: Any = 0.0
    for side, reach, bend in zip((-1.0, 1.0), reaches, bends, strict=True):
        square = reach * reach
        load = load + reach * (depth - bend * square / 6.0)
        moment = moment + side * square * (0.5 * depth - bend * square / 8.0)
    found: Pressed = moment / load
    return found


def fan_out(q: Array, spacing: float) -> tuple[Complexes, Complexes]:
    """Return joints [m] and directions of the phalanges of fingers turned by q, shape (..., 3)."""
    u = np.exp(1j * np.cumsum(q, axis=-1))
    joints = np.zeros(u.shape, dtype=complex)
    joints[..., 1:] = spacing * np.cumsum(u[..., :-1], axis=-1)
    return joints, u


def nearest_points(rock: Outlines, shape: PhalanxShape, q: Array) -> tuple[Complexes, Array]:
    """Return the points nearest each phalanx of fingers turned by q, (n, 3, `NEAREST`)."""
    joints, u = fan_out(q, shape.end)
    x, y = rock.points.real[:, None] - joints.real[..., None], rock.points.imag[:, None]
    y = y - joints.imag[..., None]
    along, above = x * u.real[..., None], y * u.real[..., None]
    along += y * u.imag[..., None]
    above -= x * u.imag[..., None]
    along -= np.clip(along, shape.near, shape.end, out=x)
    along *= along
    above *= above
    along += above
    nearest = np.argpartition(along, NEAREST - 1, axis=-1)[..., :NEAREST]
    # in their own order, so that sums do not depend on what other fingers are there
    nearest.sort(axis=-1)
    nearest += rock.points.shape[-1] * np.arange(len(q))[:, None, None]
    return rock.points.take(nearest), rock.lengths.take(nearest)
