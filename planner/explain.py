"""What a plan's numbers mean, in sentences that a climber understands."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from hand_models.hand import SettledHand
from planner.plan import Certificate, HandPlan, LimitName
from planner.program import WRENCH_UNIT
from planner.stance import Stance

__all__ = ["limit_sentence", "shortfall_sentence", "warnings"]

NOTABLE: Final = 0.3
"""Components of what is missing are told from this part of the largest on."""

MANNERS: Final = {
    "shear": " in shear",
    "pull_off": " toward pull-off",
    "palm_shear": " in shear",
    "palm_pressing": " in pressing",
}
"""How a limit is loaded."""

BARRIERS: Final = {
    "slack_tendon": "cannot push",
    "dragged_backwards": "cannot be dragged away from the finger's base",
    "joint_stop": "cannot leave its joint's stop",
    "palm_shear_reversed": "cannot drag the rock along +x of the hand",
    "palm_pressing_reversed": "cannot pull",
}
"""What a hard row forbids."""


def _spoken(name: LimitName) -> str:
    """Say whose limit it is: ``front_left: proximal tile of inner_right``."""
    if name.phalanx is not None:
        return f"{name.limb}: {name.phalanx} tile of {name.finger}"
    if name.finger is not None:
        return f"{name.limb}: tendon of {name.finger}"
    return f"{name.limb}: palm"


def _newtons(force: float) -> str:
    return f"{force:.0f} N" if abs(force) >= 10.0 else f"{force:.2g} N"


def limit_sentence(
    name: LimitName, load: float, capacity: float, hand: HandPlan, *, held: bool
) -> str:
    """Say how much of a limit is used.

    A tile's force is told with what the tile would hold in that direction, not with the distances
    to its half-plane.

    Parameters
    ----------
    name : LimitName
    load, capacity : float
        Of its row [N].
    hand : HandPlan
        Whose limit it is.
    held : bool
        Whether the plan is within its limits.
    """
    if name.phalanx is not None and load > 0.0:
        finger = next(f for f in hand.fingers if f.name == name.finger)
        tile = next(t for t in finger.tiles if t.phalanx == name.phalanx)
        pull = tile.normal if name.limit == "pull_off" else 0.0
        force = math.hypot(tile.shear, pull, tile.lateral)
        load, capacity = force, force * capacity / load
    verb = "carries" if held else "would carry"
    manner = MANNERS.get(name.limit, "")
    return f"{_spoken(name)} {verb} {_newtons(load)} of {_newtons(capacity)}{manner}"


def shortfall_sentence(certificate: Certificate, touching: bool) -> str:
    """Say what no plan can supply, and what is in the way.

    Parameters
    ----------
    certificate : Certificate
    touching : bool
        Whether any hand touches rock at all.
    """
    axes = ("fx", "fy", "fz", "mx", "my", "mz")
    units = ("N",) * 3 + ("N·m",) * 3
    size = np.abs(certificate.shortfall / WRENCH_UNIT)
    order = [int(i) for i in np.argsort(-size) if size[i] >= NOTABLE * size.max()]
    missing = ", ".join(f"{axes[i]} {certificate.shortfall[i]:+.3g} {units[i]}" for i in order)
    sentence = f"no loads balance the body at any utilisation: missing {missing} (in B)"
    if not touching:
        return f"{sentence}; no hand touches rock"
    if certificate.blocking:
        first = certificate.blocking[0]
        sentence += f"; {_spoken(first)} {BARRIERS.get(first.limit, first.limit)}"
    return sentence


def warnings(stance: Stance, settled: Sequence[SettledHand]) -> tuple[str, ...]:
    """Return what is odd about a stance that can be planned all the same."""
    found = []
    body = stance.body.inverse()
    for place, hand in zip(stance.hands, settled, strict=True):
        stretch = stance.robot.stretch(place.limb, body @ place.pose)
        if stretch > 1.0:
            found.append(f"{place.limb}: out of reach, {stretch:.2g} times as far as its limb goes")
        tiles = int(hand.touching.sum())
        if not tiles and not hand.palm.engaged:
            found.append(f"{place.limb}: touches nothing, so it carries nothing")
        elif not tiles:
            found.append(f"{place.limb}: no finger touches rock, only the palm does")
        if place.grasp.palm and not hand.palm.engaged and tiles:
            found.append(f"{place.limb}: no palm tile is within its spines' travel of the rock")
    return tuple(found)
