"""Findings about a plan's wrists: fixed palms without travel, tiles that are stretched far."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from planner.explanation.active_limits import TOLERANCES
from planner.prepare import PreparedStance
from planner.result import Finding, HandPlan

__all__ = ["ONE_OF_A_PLAN", "palm_findings", "stretch_findings"]

ONE_OF_A_PLAN: Final = ("palm_without_travel", "tile_stretched_far")
"""Kinds of findings of which a plan has at most one, with its largest value; a route, too."""


def palm_findings(prepared: PreparedStance, hands: Sequence[HandPlan]) -> Iterator[Finding]:
    """Yield at most one finding: the fixed hand whose palm would have to travel most for its loads.

    A palm carries shear as its springs give, and pressing only once it has crossed the gap of its
    nearest tile. A fixed wrist does not travel, and its plan takes both loads as free reactions.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.
    hands : sequence of HandPlan
        A plan's hands, in the order of the stance.
    """
    lacking = []
    for i, (hand, settled) in enumerate(zip(hands, prepared.batch.hands, strict=True)):
        if hand.wrist is not None or not settled.palm.engaged:
            continue
        shear, pressing = -float(hand.palm.force[0]), float(hand.palm.force[2])
        travel = shear / settled.palm_shear_stiffness
        presses = pressing >= TOLERANCES.palm_pressing
        gap = max(settled.palm.nearest_gap, 0.0) if presses else 0.0
        lacks = max(travel, gap)
        if lacks > TOLERANCES.palm_travel:
            # alike but for rounding, to a micrometre, the first hand comes first
            order = round(lacks, 6), round(min(travel, gap), 6), -i
            lacking.append((order, lacks, i, shear, travel, pressing, gap))
    if not lacking:
        return
    _, lacks, i, shear, travel, pressing, gap = max(lacking)
    words = []
    if travel > TOLERANCES.palm_travel:
        words.append(f"{shear:.0f} N of shear, which needs {1e3 * travel:.1f} mm of travel")
    if gap > TOLERANCES.palm_travel:
        words.append(f"{pressing:.0f} N of pressing across a gap of {1e3 * gap:.1f} mm")
    message = (
        f"{prepared.limbs[i]}: a fixed wrist does not move, but its palm carries "
        f"{', and '.join(words)}"
    )
    if others := len(lacking) - 1:
        message += (
            f" ({others} other palm{'s' * (others > 1)} would have to move, too, not farther)"
        )
    if not prepared.question.stance.hands[i].grasp.fingernail:
        message += "; 'wrist': 'compliant' plans with wrists that move"
    yield Finding("palm_without_travel", f"stance.hands[{i}].wrist", message, lacks, "m")


def stretch_findings(prepared: PreparedStance, hands: Sequence[HandPlan]) -> Iterator[Finding]:
    """Yield at most one finding: the tile that is stretched most, if that is too far.

    Tiles of hands with compliant or floating wrists are compared with the largest stretch of their
    hand's parameters.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.
    hands : sequence of HandPlan
        A plan's hands, in the order of the stance.
    """
    beyond = []
    for i, (hand, settled) in enumerate(zip(hands, prepared.batch.hands, strict=True)):
        if hand.wrist is None or hand.wrist.stretches is None:
            continue
        far = np.flatnonzero(hand.wrist.stretches > settled.hand.largest_tile_stretch)
        beyond += [(float(hand.wrist.stretches[tile]), i, tile) for tile in far.tolist()]
    if not beyond:
        return
    # of tiles alike but for rounding, to a micrometre, the first
    stretch, i, tile = max(beyond, key=lambda each: (round(each[0], 6), -each[1], -each[2]))
    hand, most = hands[i], prepared.batch.hands[i].hand.largest_tile_stretch
    others = len(beyond) - 1
    too = f" ({others} other tile{'s' * (others > 1)} beyond it, too)" if others else ""
    driven = prepared.question.stance.hands[i].wrist == "compliant"
    less = "a shorter wrist_travel or less load" if driven else "less load"
    message = (
        f"{hand.limb}: {hand.tiles[tile].phalanx} tile of {hand.tiles[tile].finger} is stretched "
        f"by {1e3 * stretch:.1f} mm with {abs(hand.loads[tile, 0]):.0f} N of shear, beyond the "
        f"hand's largest_tile_stretch of {1e3 * most:.3g} mm{too}; its stiffness is not known so "
        f"far; {less} stretches it less"
    )
    yield Finding("tile_stretched_far", f"stance.hands[{i}].wrist", message, stretch, "m")
