"""Settled hands that the tests share."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from hand_models import (
    Cylinder,
    Edge,
    Grasp,
    Hold,
    InvalidInputError,
    Plane,
    Pose,
    SettledHand,
    Sphere,
    SpinyHand,
    Surface,
    WrenchSpace,
    spiny_hand,
)
from hand_models.finger import PHALANGES
from hand_models.hand import Placement, Seating, seated
from hand_models.parameters import ParameterTable, Quantity, hand_table
from tests.suite.helpers.rocks import random_axes

HAND = spiny_hand()
ROCK = Surface.named("rock")
PINCH = Grasp(outer_rotation=math.pi)


def pinch(diameter: float = 0.3, surface: Surface = ROCK, **grasp) -> SettledHand:
    """A hand that pinches a cylinder, seated."""
    return HAND.settle(Cylinder(diameter), surface, Grasp(outer_rotation=math.pi, **grasp))


def seating_on(hold: Hold, grasp: Grasp, at: Pose | None = None) -> Seating:
    """Where the hand is seated on a hold."""
    (found,) = seated(HAND, [Placement(hold, ROCK, grasp, None, at)])
    return found


def changed_hand(
    section: str, name: str, value: float | list[float], hand: SpinyHand = HAND
) -> SpinyHand:
    """A hand, the SpinyHand by default, with one entry of its own."""
    unit = hand_table().quantity(section, name).unit
    own = {section: {name: Quantity(value, unit, "assumed", "of a test")}}
    return SpinyHand(hand.table.replaced(ParameterTable(own)))


def line_hand() -> SpinyHand:
    """A hand whose fingers have no width."""
    return changed_hand("finger", "frame_width", 0.0, changed_hand("finger", "tile_width", 0.0))


def entry_toml(section: str, name: str, value: Any, unit: str | None = None) -> str:
    """The file of a hand with one entry."""
    unit = hand_table().quantity(section, name).unit if unit is None else unit
    return f'[{section}]\n{name} = {{ value = {value}, unit = "{unit}", source = "assumed" }}\n'


def without_hand_load(space: WrenchSpace) -> WrenchSpace:
    """The same set without its wrench rows, those of the whole hand's force."""
    kept = len(space.s) - len(space.D)
    return replace(
        space,
        rows=(*space.rows[:kept], *space.rows[len(space.s) :]),
        L=space.L[:kept],
        l0=space.l0[:kept],
        s=space.s[:kept],
        D=np.zeros((0, 6)),
    )


def random_surface(rng: np.random.Generator) -> Surface:
    return Surface.from_values(
        {
            "shear_limit": rng.uniform(20.0, 120.0),
            "pull_off_angle": rng.uniform(0.3, math.pi / 2),
            "compression_gain": float(rng.choice([0.0, 0.2])),
            "half_planes": int(rng.choice([1, 1, 1, 2, 3])),
        }
    )


def random_hand(seed: int, lateral: bool | None = None) -> SettledHand:
    """A hand on a random hold, seated or placed a little askew; closing may overload its tiles."""
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-1.0, 1.0)
    kinds = (Plane(), Cylinder(size), Sphere(size), Edge(size / 4.0, rng.uniform(0.8, 3.0)))
    hold = kinds[rng.choice(4, p=[0.15, 0.4, 0.25, 0.2])]
    grasp = Grasp(
        outer_rotation=float(rng.choice([0.0, math.pi, rng.uniform(0.0, math.pi)])),
        closing_tension=float(rng.choice([37.0, rng.uniform(10.0, 60.0)])),
        palm=bool(rng.random() < 0.8),
        lateral=bool(rng.random() < 0.5) if lateral is None else lateral,
    )
    pose = None
    if rng.random() < 0.5:
        place = rng.uniform([-0.03, -0.02, 0.0], [0.05, 0.02, 0.008])
        pose = Pose(place, random_axes(rng, 0.15))
    surface = random_surface(rng)
    return HAND.settle(hold, surface, grasp, pose)


def settled_at(seed: int, lateral: bool | None = None) -> SettledHand | None:
    """A random hand, or None where the hold stands in its palm."""
    try:
        return random_hand(seed, lateral)
    except InvalidInputError:
        return None


def tile_load(settled: SettledHand, t: int, tension: float) -> np.ndarray:
    """Shear and normal load of a tile at a tension of its tendon [N]."""
    return settled.loads[t, :, 0] + settled.loads[t, :, 1] * tension


def own_tiles(settled: SettledHand, i: int) -> np.ndarray:
    """Tiles of a finger that touch the rock."""
    return np.flatnonzero((settled.finger_of == i) & settled.touching)


def limiting(share: float, least: float = 0.1) -> float:
    """Part of a whole tile's strength that limits a tile with a share of its spines on rock."""
    return share if share >= least else share + (least - share) ** 2 / (2.0 * least)


def partly(settled: SettledHand, shares: np.ndarray | float) -> SettledHand:
    """A hand of which only so much of each tile's spines, (n,), holds; not one at a joint's stop.

    Normal loads from the balance of each finger's own joints.
    """
    share = np.broadcast_to(shares, settled.engagement.shape)
    loads = settled.loads.copy()
    loads[:, 0] *= share[:, None]
    for i, finger in enumerate(settled.fingers):
        own = np.flatnonzero(settled.finger_of == i)
        phalanges = own[-len(PHALANGES) :]
        outer = len(own) > len(PHALANGES)
        loads[phalanges, 1] = finger.normals(loads[phalanges, 0], outer)
    return replace(settled, engagement=share * settled.engagement, loads=loads)
