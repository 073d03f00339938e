"""Strengths of a plan: what it uses of those of its tiles and palms, and how they scatter."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hand_models.base import Array, Indices
from hand_models.hand import NAIL
from hand_models.parameters import surface_table
from hand_models.tile import StrengthScatter, Surface, TileStrengths
from planner.prepare import PreparedStance
from planner.question import SurvivalSettings
from planner.result import HandPlan, StrengthSource
from planner.simulation.cascade import Loads

__all__ = [
    "hand_of_units",
    "plan_loads",
    "strength_law",
    "strength_sources",
    "used_strengths",
    "why_not_simulated",
]


def hand_of_units(prepared: PreparedStance) -> Indices:
    """Return the hand of each tile, then of each palm, shape (T + H,)."""
    batch = prepared.batch
    return np.concatenate([batch.places.hand, np.arange(len(batch.hands))])


def strength_law(prepared: PreparedStance, settings: SurvivalSettings) -> TileStrengths:
    """Return the distribution of the strengths of a stance's tiles, then palms."""
    hands = prepared.batch.hands
    return TileStrengths.of(
        [hand.surface for hand in hands],
        hand_of_units(prepared),
        StrengthScatter.bundled(settings.hold_scatter, settings.rock_scatter),
    )


def plan_loads(prepared: PreparedStance, hands: Sequence[HandPlan]) -> Loads:
    """Return the loads of a plan's hands over all of them."""
    tiles = np.concatenate([hand.loads for hand in hands])
    return Loads.of(prepared.batch, tiles, np.array([hand.palm.force for hand in hands]))


def used_strengths(prepared: PreparedStance, hands: Sequence[HandPlan]) -> Array:
    """Return what the plan uses of each tile's strength and each palm's in shear, (T + H,)."""
    tiles = np.concatenate([hand.tile_utilisations for hand in hands])
    sheared = plan_loads(prepared, hands).palms[:, 0] / prepared.batch.palm_limits[:, 0]
    return np.concatenate([tiles * prepared.batch.touch.touches, sheared])


def strength_sources(prepared: PreparedStance, law: TileStrengths) -> list[StrengthSource]:
    """Return the distribution of the tiles on each surface of a stance."""
    found: dict[Surface, StrengthSource] = {}
    sections = surface_table().sections
    pairs = zip(prepared.batch.hands, law.modulus.tolist(), law.mean.tolist(), strict=True)
    for hand, modulus, mean in pairs:
        surface, source = hand.surface, "given"
        if surface.name in sections:
            own = sections[surface.name]
            source = own.get("scatter_ratio", sections["defaults"]["scatter_ratio"]).source
        variation = surface.shear_scatter / surface.shear_limit
        found[surface] = StrengthSource(surface.name, modulus, variation, source, mean)
    return list(found.values())


def why_not_simulated(prepared: PreparedStance) -> str | None:
    """Return why slips of a stance are not simulated; None if they are."""
    moving = prepared.floating
    if moving:
        one = len(moving) == 1
        whose = (
            f"{'wrist' if one else 'wrists'} of {', '.join(moving)} {'moves' if one else 'move'}"
        )
        return (
            f"slips are not simulated, as the {whose}: where {'it goes' if one else 'they go'} "
            "once a tile slips takes a search for each state; valid is wrist 'fixed'"
        )
    nails = [
        limb
        for limb, hand in zip(prepared.limbs, prepared.batch.hands, strict=True)
        if hand.grasp.fingernail or any(tile.contact == NAIL for tile in hand.tiles)
    ]
    if nails:
        return (
            f"slips are not simulated, as {', '.join(nails)} "
            f"{'holds' if len(nails) == 1 else 'hold'} with fingernails, whose scatter nobody has "
            "measured"
        )
    return None
