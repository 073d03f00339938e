"""One hand of a plan: what it carries, as arrays, and finger by finger.

Its numbers are stored once, in arrays over its tiles and its tendons. Fingers and tiles as objects
are views of these, made when they are asked for.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from hand_models.base import Array
from hand_models.compliance import PalmMode
from hand_models.hand import FINGERS, Seating, Tile
from hand_models.tile import HalfPlane
from hand_models.wrench_spaces import WrenchSpace

__all__ = ["FingerPlan", "HandPlan", "PalmPlan", "TileLoad", "WristPlan"]


@dataclass(frozen=True, eq=False)
class TileLoad:
    """One finger tile of a plan. Vectors in H, forces on the rock, SI units.

    Attributes
    ----------
    phalanx : str
        ``base``, ``proximal``, ``middle`` or ``distal``.
    contact : str
        ``face``, ``edge``, ``frame`` where its phalanx only presses beside it, or ``none`` where
        it touches nothing and carries nothing.
    position : ndarray, shape (3,)
    force : ndarray, shape (3,)
        shear·shear_axis + normal·normal_axis + lateral·lateral_axis.
    shear, normal, lateral : float
    shear_axis, normal_axis, lateral_axis : ndarray, shape (3,)
    utilisation : float
        Largest load over capacity of its half-planes; never below zero.
    load_at_zero : ndarray, shape (2,), or None
        Shear and normal load at zero tension [N]; None where the wrist floats.
    load_per_newton : ndarray, shape (2,), or None
        The same per newton of tension.
    half_planes : tuple of HalfPlane
        Of the spines that are on the rock; of a tile that is not on rock, those of a whole one.
    """

    phalanx: str
    contact: str
    position: Array
    force: Array
    shear: float
    normal: float
    lateral: float
    shear_axis: Array
    normal_axis: Array
    lateral_axis: Array
    utilisation: float
    load_at_zero: Array | None
    load_per_newton: Array | None
    half_planes: tuple[HalfPlane, ...]


@dataclass(frozen=True)
class FingerPlan:
    """One finger of a plan.

    Attributes
    ----------
    name : str
    tendon_tension : float
        [N]
    motor_torque, motor_current : float
        Of its motor while it tightens the tendon to that [N·m], [A].
    winch_angle : float
        From the open finger to that tension, of a floating hand to the preload at which the motor
        stands still [rad].
    tiles : tuple of TileLoad
        From the base outward.
    """

    name: str
    tendon_tension: float
    motor_torque: float
    motor_current: float
    winch_angle: float
    tiles: tuple[TileLoad, ...]


@dataclass(frozen=True, eq=False)
class PalmPlan:
    """The palm of a plan: where it acts and its force and moment on the rock, in H."""

    position: Array
    force: Array
    moment: Array
    engaged: tuple[int, ...]
    utilisation: float


@dataclass(frozen=True, eq=False)
class WristPlan:
    """Where the wrist of a floating hand goes.

    Attributes
    ----------
    twist : ndarray, shape (6,)
        ξ of H about its origin at rest [m, rad].
    palm : PalmMode
        How the palm carries: of the hand's sets, one for each, that which the plan is in.
    rounds : int
        How often all hands' sets were linearised.
    error : float
        How far the set before the last was off where the wrist went: forces, and moments over
        0.1 m [N]. The plan itself is exact.
    """

    twist: Array
    palm: PalmMode
    rounds: int
    error: float


@dataclass(frozen=True, eq=False)
class HandPlan:
    """One hand of a plan. Vectors in H, forces on the rock, SI units; n tiles.

    Attributes
    ----------
    limb : str
    wrench : ndarray, shape (6,)
    tensions : ndarray, shape (4,)
        Of the tendons [N].
    drives : ndarray, shape (3, 4)
        Torque [N·m] and current [A] of each motor, angle of each winch [rad].
    loads : ndarray, shape (n, 3)
        Shear, normal and lateral load of each tile [N].
    forces, positions : ndarray, shape (n, 3)
        [N], [m]
    axes : ndarray, shape (n, 3, 3)
        Rows: unit forces of shear, normal and lateral load.
    engagement : ndarray, shape (n,)
        Share of each tile's spines that are on the rock.
    tile_utilisations : ndarray, shape (n,)
    tiles : tuple of Tile
        Their names and contacts.
    half_planes : tuple of HalfPlane
        Limits of each whole tile that is no nail.
    palm : PalmPlan
    utilisation : float
    seating : Seating
        Where the hold is in H.
    closures : tuple of str
        How each finger has ended on the hold, of `hand_models.hand.CLOSURES`.
    space : WrenchSpace
        The set that the program used; of a floating hand linearised where its wrist goes.
    laws : ndarray, shape (n, 2, 2), or None
        Shear and normal load of each tile, each at zero tension [N] and per newton; None where the
        wrist floats.
    nail_planes : mapping of int to tuple of HalfPlane
        Limits of each nail that hooks, by its index among the tiles.
    wrist : WristPlan or None
        None for a hand with a fixed wrist.
    """

    limb: str
    wrench: Array
    tensions: Array
    drives: Array
    loads: Array
    forces: Array
    positions: Array
    axes: Array
    engagement: Array
    tile_utilisations: Array
    tiles: tuple[Tile, ...]
    half_planes: tuple[HalfPlane, ...]
    palm: PalmPlan
    utilisation: float
    seating: Seating
    closures: tuple[str, ...]
    space: WrenchSpace
    laws: Array | None = None
    nail_planes: Mapping[int, tuple[HalfPlane, ...]] = field(default_factory=dict)
    wrist: WristPlan | None = None

    @cached_property
    def fingers(self) -> tuple[FingerPlan, ...]:
        """The hand finger by finger, in the order of `FINGERS`."""
        tiles: dict[str, list[TileLoad]] = {name: [] for name in FINGERS}
        loads, used = self.loads.tolist(), self.tile_utilisations.tolist()
        for t, (tile, (shear, normal, lateral)) in enumerate(zip(self.tiles, loads, strict=True)):
            law = None if self.laws is None else self.laws[t]
            tiles[tile.finger].append(
                TileLoad(
                    phalanx=tile.phalanx,
                    contact=tile.contact,
                    position=self.positions[t],
                    force=self.forces[t],
                    shear=shear,
                    normal=normal,
                    lateral=lateral,
                    shear_axis=self.axes[t, 0],
                    normal_axis=self.axes[t, 1],
                    lateral_axis=self.axes[t, 2],
                    utilisation=used[t],
                    load_at_zero=None if law is None else law[:, 0],
                    load_per_newton=None if law is None else law[:, 1],
                    half_planes=self.limits_of(t),
                )
            )
        numbers = zip(FINGERS, self.tensions.tolist(), *self.drives.tolist(), strict=True)
        return tuple(
            FingerPlan(name, tension, torque, current, angle, tuple(tiles[name]))
            for name, tension, torque, current, angle in numbers
        )

    def limits_of(self, tile: int) -> tuple[HalfPlane, ...]:
        """Return the half-planes of a tile's spines on the rock, or of its nail, by its index."""
        nail, share = self.nail_planes.get(tile), float(self.engagement[tile])
        if nail is not None or share in (0.0, 1.0):
            return self.half_planes if nail is None else nail
        return tuple(replace(p, capacity=share * p.capacity) for p in self.half_planes)

    def tile(self, finger: str | None, phalanx: str | None) -> int:
        """Return the index of a tile among the hand's."""
        return next(
            i for i, t in enumerate(self.tiles) if (t.finger, t.phalanx) == (finger, phalanx)
        )
