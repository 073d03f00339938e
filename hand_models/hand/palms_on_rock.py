"""The palms of hands on their rock."""

from __future__ import annotations

import numpy as np

from hand_models.hand.finger_frames import BASES
from hand_models.hand.placement import PlacedHands
from hand_models.hand.settled_hand import Palm

__all__ = ["palms_on_rock"]


def palms_on_rock(placed: PlacedHands) -> list[Palm]:
    """Return the palm of each hand; a tile is engaged with rock within the spines' travel."""
    hand, travel = placed.hand, placed.hand.spine_travel
    gaps = np.array(placed.gaps)[:, BASES:]
    gaps.setflags(write=False)
    engaged, centres, limits = [], [], []
    for placement, depths in zip(placed.placements, placed.gaps, strict=True):
        near = [i for i, depth in enumerate(depths[BASES:]) if depth <= travel]
        tiles = tuple(near) if placement.grasp.palm else ()
        x, y, shear = hand.palm_share(tiles, placement.surface.shear_limit)
        depth = sum([depths[BASES + i] for i in tiles]) / max(len(tiles), 1)
        engaged.append(tiles)
        centres.append((x, y, depth))
        limits.append((shear, hand.palm_pressing * len(tiles)))
    places = np.array(centres)
    places.setflags(write=False)
    return [
        Palm(own, tiles, centre, *most)
        for own, tiles, centre, most in zip(gaps, engaged, places, limits, strict=True)
    ]
