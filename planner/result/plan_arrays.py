"""What all hands of a stance carry, in arrays: what is read from loads, checked, and told."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hand_models.base import Array
from hand_models.hand import Tile
from hand_models.tile import HalfPlane
from planner.prepare import concatenated
from planner.result.hand_plan import HandPlan, WristPlan

__all__ = ["PlanArrays"]


class PlanArrays(NamedTuple):
    """The numbers of all hands' plans, one hand after another, as `places_of` says.

    Vectors in each hand's H, forces on the rock, SI units; T tiles, F fingers, H hands.

    Attributes
    ----------
    tensions : ndarray, shape (F,)
    drives : ndarray, shape (3, F)
        Torque and current of each motor, angle of each winch.
    loads : ndarray, shape (T, 3)
    forces, points : ndarray, shape (T + H, 3)
        Of all tiles, then of all palms, and where they act.
    axes : ndarray, shape (T, 3, 3)
    tile_utilisations, engagement : ndarray, shape (T,)
    palm_moments : ndarray, shape (H, 3)
    palm_utilisations : ndarray, shape (H,)
    wrenches : ndarray, shape (H, 6)
    utilisations : ndarray, shape (H,)
    tiles : tuple of tuple of Tile
    half_planes : tuple of tuple of HalfPlane
        Of each hand's whole tiles.
    engaged : tuple of tuple of int
        Tiles of each palm.
    wrists : tuple of WristPlan or None
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
    tiles: tuple[tuple[Tile, ...], ...]
    half_planes: tuple[tuple[HalfPlane, ...], ...]
    engaged: tuple[tuple[int, ...], ...]
    wrists: tuple[WristPlan | None, ...]

    @classmethod
    def of(cls, hands: Sequence[HandPlan]) -> PlanArrays:
        """Return the numbers of hands' plans."""
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
        """Forces of the palms, shape (H, 3)."""
        return self.forces[len(self.loads) :]
