"""Loads of the hands of a plan: as arrays, hand by hand or all together, and finger by finger.

The numbers are stored once, in arrays over tiles and tendons. `Finger` and `Tile` structs, as a
reply contains them, are made from the arrays on demand.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from msgspec import UNSET

from hand_models.base import Array
from hand_models.compliance import PalmMode
from hand_models.hand import FINGERS, NAIL, Seating, SettledTile
from hand_models.tile import HalfPlane
from hand_models.wrench_spaces import WrenchSpace
from planner.prepare import HandBatch, concatenated
from planner.result.plain_parts import Finger, Palm, Tile

__all__ = ["HandPlan", "PlanArrays", "WristPlan"]


@dataclass(frozen=True, eq=False)
class WristPlan:
    """Planned pose of a compliant or floating wrist, with its accuracy and stability.

    Attributes
    ----------
    twist : ndarray, shape (6,)
        Twist ξ of the hand frame H from rest, about H's origin [m, rad].
    rounds : int
        Number of linearisations of all hands' sets.
    error : float
        Error of the last but one linearised set at the planned pose: forces, and moments over 0.1 m
        [N]. The plan itself is exact.
    palm : PalmMode
        Which loads the palm carries (none, drag, pressure or both).
    driven : bool
        True if the wrist is compliant: motors keep the tendon tensions. False if it is floating.
    pose_target : ndarray, shape (6,), or None
        Set-point of the limb's controller, a twist as ``twist``: x + K⁻¹ w, with twist x, wrench on
        the rock w and limb stiffness K [m, rad]. None if the stance gives no limb stiffness.
    least_stiffness : float or None
        Least eigenvalue of the symmetric part of K_g + K: stiffness of the hand on its rock, K_g,
        plus that of the limb, K; rotations over 0.1 m [N/m]. The wrist is stable only if it is
        positive.
    stretches : ndarray, shape (n,), or None
        Stretch of each tile along the rock: its shear over its contact stiffness [m]. None for a
        wrist pose that is no plan.
    """

    twist: Array
    rounds: int
    error: float
    palm: PalmMode = "off"
    driven: bool = False
    pose_target: Array | None = None
    least_stiffness: float | None = None
    stretches: Array | None = None


@dataclass(frozen=True, eq=False)
class HandPlan:
    """Loads of one hand in a plan. Vectors are in H, forces act on the rock; SI units; n tiles.

    Attributes
    ----------
    limb : str
        Name of the limb that has the hand.
    wrench : ndarray, shape (6,)
        Wrench of the hand on the rock [N, N·m].
    tensions : ndarray, shape (4,)
        Tendon tensions [N].
    drives : ndarray, shape (3, 4)
        Torque [N·m] and current [A] of each motor, angle of each winch [rad].
    loads : ndarray, shape (n, 3)
        Shear, normal and lateral load of each tile [N].
    forces, positions : ndarray, shape (n, 3)
        Contact force of each tile [N], and the point where it acts [m].
    axes : ndarray, shape (n, 3, 3)
        Rows: unit forces of each tile's shear, normal and lateral load.
    engagement : ndarray, shape (n,)
        Share of each tile's spines that are on the rock.
    limit_shares : ndarray, shape (n,)
        Share of a whole tile's strength that limits each tile's load, as in `SettledHand`.
    tile_utilisations : ndarray, shape (n,)
        Utilisation of each tile, over its half-planes.
    tiles : tuple of SettledTile
        Finger, phalanx and contact state of each tile.
    half_planes : tuple of HalfPlane
        Limits of a whole tile (for nails see ``nail_planes``).
    palm : Palm
        Load of the palm.
    utilisation : float
        Largest utilisation of the hand's limits.
    seating : Seating
        Pose of the hold in H.
    closures : tuple of str
        How each finger ended its closing, as in `SettledHand.closures`.
    space : WrenchSpace
        Wrench space that the program used; of a compliant or floating hand, linearised at the
        planned wrist pose.
    laws : ndarray, shape (n, 2, 2), or None
        Loads of each tile as functions of the tension f of its finger's tendon: ``laws[i, 0]`` are
        a [N] and b [1] of the shear a + b f, ``laws[i, 1]`` those of the normal load. None if the
        wrist is compliant or floating.
    nail_planes : mapping of int to tuple of HalfPlane
        Limits of each nail that hooks, by its index among the tiles.
    wrist : WristPlan or None
        Planned wrist pose; None for a fixed wrist.
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
    limit_shares: Array
    tile_utilisations: Array
    tiles: tuple[SettledTile, ...]
    half_planes: tuple[HalfPlane, ...]
    palm: Palm[Array]
    utilisation: float
    seating: Seating
    closures: tuple[str, ...]
    space: WrenchSpace
    laws: Array | None = None
    nail_planes: Mapping[int, tuple[HalfPlane, ...]] = field(default_factory=dict)
    wrist: WristPlan | None = None

    @property
    def fingers(self) -> list[Finger]:
        """The fingers in the order of `FINGERS`, with load laws and half-planes of their tiles."""
        return self.finger_by_finger(model=True)

    def finger_by_finger(self, *, model: bool) -> list[Finger]:
        """Return the fingers in the order of `FINGERS`.

        Parameters
        ----------
        model : bool
            Whether the tiles contain their load laws and half-planes.
        """
        tiles: dict[str, list[Tile]] = {name: [] for name in FINGERS}
        arrays = (self.loads, self.positions, self.forces, self.axes, self.tile_utilisations)
        columns: Iterator[Any] = zip(self.tiles, *(each.tolist() for each in arrays), strict=True)
        for t, (tile, load, position, force, axes, used) in enumerate(columns):
            numbers = position, force, *load, *axes, used
            known = self._model_of(t) if model else ()
            tiles[tile.finger].append(Tile(tile.phalanx, tile.contact, *numbers, *known))
        of_fingers = (self.closures, self.tensions.tolist(), *self.drives.tolist(), tiles.values())
        return [Finger(*own) for own in zip(FINGERS, *of_fingers, strict=True)]

    def _model_of(self, tile: int) -> tuple[Any, ...]:
        """Return a tile's load law, unset where the wrist floats, and its half-planes."""
        law = (UNSET, UNSET) if self.laws is None else self.laws[tile].T.tolist()
        # a lateral load may be of either sign
        planes = [
            [plane.a_shear, plane.a_normal, sign * plane.a_lateral, plane.capacity]
            for plane in self.limits_of(tile)
            for sign in ((1.0, -1.0) if plane.a_lateral > 0.0 else (1.0,))
        ]
        return *law, planes

    def limits_of(self, tile: int) -> tuple[HalfPlane, ...]:
        """Return the half-planes that limit a tile, or a nail, by its index among the tiles.

        Capacities are scaled to the tile's spines on the rock.
        """
        nail, share = self.nail_planes.get(tile), float(self.limit_shares[tile])
        if nail is not None or share in (0.0, 1.0):
            return self.half_planes if nail is None else nail
        return tuple(p._replace(capacity=share * p.capacity) for p in self.half_planes)

    def tile(self, finger: str | None, phalanx: str | None) -> int:
        """Return the index of a tile in the arrays of the hand.

        Parameters
        ----------
        finger, phalanx : str or None
            Names of the tile's finger and phalanx.
        """
        return next(i for i, tile in enumerate(self.tiles) if tile[:2] == (finger, phalanx))


class PlanArrays(NamedTuple):
    """Loads of all hands in a plan, hand after hand in the order of `HandBatch`.

    Vectors are in each hand's frame H, forces act on the rock; SI units. T tiles, F fingers, H
    hands.

    Attributes
    ----------
    tensions : ndarray, shape (F,)
        Tendon tensions [N].
    drives : ndarray, shape (3, F)
        Torque [N·m] and current [A] of each motor, angle of each winch [rad].
    loads : ndarray, shape (T, 3)
        Shear, normal and lateral load of each tile [N].
    forces, points : ndarray, shape (T + H, 3)
        Contact forces of all tiles, then of all palms [N], and the points where they act [m].
    axes : ndarray, shape (T, 3, 3)
        Rows: unit forces of each tile's shear, normal and lateral load.
    tile_utilisations, engagement : ndarray, shape (T,)
        Utilisation of each tile, and share of its spines that are on the rock.
    palm_moments : ndarray, shape (H, 3)
        Moment of each palm about the point where its force acts [N·m].
    palm_utilisations, utilisations : ndarray, shape (H,)
        Largest utilisation of each palm's limits, and of all limits of its hand.
    wrenches : ndarray, shape (H, 6)
        Wrench of each hand on the rock [N, N·m].
    tiles : tuple of tuple of SettledTile
        Finger, phalanx and contact state of each hand's tiles.
    half_planes : tuple of tuple of HalfPlane
        Limits of a whole tile of each hand.
    engaged : tuple of sequence of int
        Indices of each palm's tiles that are on the rock.
    wrists : tuple of WristPlan or None
        Planned pose of each wrist; None for a fixed wrist.
    """

    tensions: Array
    drives: Array
    loads: Array
    forces: Array
    points: Array
    axes: Array
    tile_utilisations: Array
    engagement: Array
    palm_moments: Array
    palm_utilisations: Array
    wrenches: Array
    utilisations: Array
    tiles: tuple[tuple[SettledTile, ...], ...]
    half_planes: tuple[tuple[HalfPlane, ...], ...]
    engaged: tuple[Sequence[int], ...]
    wrists: tuple[WristPlan | None, ...]

    @classmethod
    def of(cls, hands: Sequence[HandPlan]) -> PlanArrays:
        """Concatenate the arrays of hands' plans."""
        palms = [hand.palm for hand in hands]
        return cls(
            tensions=concatenated([hand.tensions for hand in hands]),
            drives=np.hstack([hand.drives for hand in hands]),
            loads=concatenated([hand.loads for hand in hands]),
            forces=np.vstack([*(hand.forces for hand in hands), *(p.force for p in palms)]),
            points=np.vstack([*(hand.positions for hand in hands), *(p.position for p in palms)]),
            axes=concatenated([hand.axes for hand in hands]),
            tile_utilisations=concatenated([hand.tile_utilisations for hand in hands]),
            engagement=concatenated([hand.engagement for hand in hands]),
            palm_moments=np.array([p.moment for p in palms]),
            palm_utilisations=np.array([p.utilisation for p in palms]),
            wrenches=np.array([hand.wrench for hand in hands]),
            utilisations=np.array([hand.utilisation for hand in hands]),
            tiles=tuple(hand.tiles for hand in hands),
            half_planes=tuple(hand.half_planes for hand in hands),
            engaged=tuple(p.engaged for p in palms),
            wrists=tuple(hand.wrist for hand in hands),
        )

    @property
    def palms(self) -> Array:
        """Contact force of each palm, shape (H, 3) [N]."""
        return self.forces[len(self.loads) :]

    def hands(
        self, limbs: Sequence[str], known: HandBatch, spaces: Sequence[WrenchSpace]
    ) -> tuple[HandPlan, ...]:
        """Split the arrays into plans of hands with fixed wrists, which share the arrays' memory.

        Parameters
        ----------
        limbs : sequence of str
            Limb of each hand.
        known : HandBatch
            The settled hands.
        spaces : sequence of WrenchSpace
            Wrench space of each hand that the program used.
        """
        firsts, tiles, count = known.places.first.tolist(), len(self.loads), len(FINGERS)
        palm_used, used = self.palm_utilisations.tolist(), self.utilisations.tolist()
        found = []
        for h, (limb, hand, space) in enumerate(zip(limbs, known.hands, spaces, strict=True)):
            own = slice(firsts[h], firsts[h] + len(hand.tiles))
            fingers, palm = slice(count * h, count * (h + 1)), tiles + h
            found.append(
                HandPlan(
                    limb=limb,
                    wrench=self.wrenches[h],
                    tensions=self.tensions[fingers],
                    drives=self.drives[:, fingers],
                    loads=self.loads[own],
                    forces=self.forces[own],
                    positions=self.points[own],
                    axes=self.axes[own],
                    engagement=self.engagement[own],
                    limit_shares=hand.limit_shares,
                    tile_utilisations=self.tile_utilisations[own],
                    tiles=self.tiles[h],
                    half_planes=self.half_planes[h],
                    palm=Palm(
                        position=self.points[palm],
                        force=self.forces[palm],
                        moment=self.palm_moments[h],
                        engaged=self.engaged[h],
                        utilisation=palm_used[h],
                    ),
                    utilisation=used[h],
                    seating=hand.seating,
                    closures=hand.closures,
                    space=space,
                    laws=hand.loads,
                    nail_planes={
                        t: hand.nail_limits(t)
                        for t, tile in enumerate(hand.tiles)
                        if tile.contact == NAIL
                    },
                )
            )
        return tuple(found)
