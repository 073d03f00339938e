"""Arrays of the check of plans: what a plan's numbers are, and what they are multiplied by."""

from __future__ import annotations

from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from hand_models.frames import SKEW, Array, Indices
from hand_models.hand import FINGERS
from hand_models.spines import HalfPlane, Surface
from planner.stacked import KEPT, KEPT_NAMES, Places, Same, Stacked
from planner.verify_words import DRIVES

__all__ = [
    "DRIVE",
    "LOAD",
    "UTILISATION",
    "Limits",
    "Roles",
    "arms_of",
    "limits_of",
    "roles_of",
]

LOAD: Final = 1e-6
"""Largest disagreement of a tile's load, relative to the largest load of its hand."""

UTILISATION: Final = 1e-6
"""How far a utilisation may be from what the plan says."""

DRIVE: Final = 1e-9
"""How far a motor's torque, current or winch angle may be from what the plan says, relative."""

FORCES: Final = np.eye(6, 3).ravel()
"""What a wrench takes of a force wherever it acts, row by row."""

MOMENTS: Final = np.concatenate([np.zeros((3, 3, 3)), SKEW], axis=1).reshape(3, -1)
"""What it takes of it per metre of the place's coordinates."""


class Roles(NamedTuple):
    """What the numbers of a plan are, by which tile is whose.

    Attributes
    ----------
    first_component : ndarray of int, shape (H,)
        Of each hand's tiles' loads.
    hand : ndarray of int, shape (n,)
        Whose each number is that `Recomputed.loads_off` speaks of.
    ends : ndarray of int
        Where each kind of them ends.
    least, relative : ndarray, shape (3 F + T + 2 H,)
        Of `Recomputed.used`: what it is at least, and how far it may be off.
    """

    first_component: Indices
    hand: Indices
    ends: Indices
    least: Array
    relative: Array


@lru_cache(maxsize=KEPT)
def roles_of(places: Places) -> Roles:
    """Return what the numbers of a plan are."""
    tiles, fingers, hands = places.shape
    drives, others = len(DRIVES) * fingers, tiles + 2 * hands
    each, tile = np.arange(hands), places.hand
    three, six = tile.repeat(3), each.repeat(6)
    kinds = [each.repeat(len(FINGERS)), *(tile,) * 4, three, tile, each, each, six, each]
    return Roles(
        first_component=3 * places.first,
        hand=np.concatenate(kinds),
        ends=np.cumsum([len(kind) for kind in kinds]),
        least=np.repeat([-np.inf, 0.0], [drives, others]),
        relative=np.repeat([DRIVE, UTILISATION], [drives, others]),
    )


class Limits(NamedTuple):
    """What tiles of some hands hold, on the surface of each hand.

    Attributes
    ----------
    pieces : tuple of tuple of HalfPlane
        Of each hand.
    planes : ndarray, shape (p, 3, H)
        Those over their capacities; zero where a hand has fewer than others.
    """

    pieces: tuple[tuple[HalfPlane, ...], ...]
    planes: Array

    @classmethod
    def of(cls, pieces: tuple[tuple[HalfPlane, ...], ...]) -> Limits:
        """Return the limits of hands' half-planes."""
        most = max(map(len, pieces))
        tables = [
            [
                (p.a_shear / p.capacity, p.a_normal / p.capacity, p.a_lateral / p.capacity)
                for p in own
            ]
            + [(0.0, 0.0, 0.0)] * (most - len(own))
            for own in pieces
        ]
        return cls(pieces, np.array(tables).transpose(1, 2, 0))

    def on(self, known: Stacked) -> Array:
        """Return the half-planes of each tile, shape (p, 3, T); zero if it touches nothing."""
        return np.asarray(self.planes.take(known.places.hand, 2) * known.touch.touches)


@lru_cache(maxsize=KEPT_NAMES)
def limits_of(key: Same) -> Limits:
    """Return the limits of hands on these surfaces."""
    surfaces: tuple[Surface, ...] = key.each  # type: ignore[assignment]
    return Limits.of(tuple(surface.pieces() for surface in surfaces))


def arms_of(points: Array) -> Array:
    """Return what makes wrenches of forces at some places (n, 3), shape (n, 6, 3)."""
    return np.asarray((points @ MOMENTS + FORCES).reshape(-1, 6, 3))
