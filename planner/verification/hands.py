"""Check palms and whole hands: sums of forces, loads of hands, and reported contacts."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from hand_models.base import Array
from hand_models.hand import HELD_DIRECTIONS
from planner.result import PlanArrays
from planner.verification.finger_geometry import wrenches_of
from planner.verification.residuals import (
    TOLERANCES,
    PartNames,
    Recomputed,
    Residual,
    ResidualLimits,
    claim,
)

__all__ = ["HandLimits", "check_contacts"]

PALM_SIGNS: Final = np.array([-1.0, 1.0])
"""Signs of a palm's shear along x and pressing along z."""


class HandLimits(ResidualLimits):
    """Limits of palms and whole hands, and the hands' wrenches as sums of forces.

    Parameters
    ----------
    names : PartNames
        Names of the hands' parts.
    """

    def __init__(self, names: PartNames) -> None:
        known = names.known
        self._names, self._known = names, known
        self._each = np.arange(len(known.hands))
        self._palm_shares = PALM_SIGNS / known.palm_limits
        self._hand_load = known.hands[0].hand.structure.hand_load

    def recompute(self, again: Recomputed) -> list[Residual]:
        """Return the residuals of force sums and palms, and utilisations of palms and hands."""
        planned, names, own = again.arrays, self._names, self._each
        tiles, palms = len(planned.loads), planned.palms
        off = planned.forces[:tiles] - (planned.loads[:, None] @ planned.axes)[:, 0]
        each = wrenches_of(planned.points, planned.forces)
        wrenches = np.add.reduceat(each[:tiles], self._known.places.first)
        wrenches += each[tiles:]
        wrenches[:, 3:] += planned.palm_moments
        pressing, numbers = palms[:, ::2], (palms[:, 0], palms[:, 1], palms[:, 2])
        used, said = pressing * self._palm_shares, planned.palm_utilisations
        most = np.maximum.reduce(used, axis=1)
        along = planned.wrenches[:, :3] @ HELD_DIRECTIONS.T
        disagree = ": force and loads disagree"
        no_sum = "the wrench is not the sum of its tiles' and palm's forces"
        cannot = "the palm cannot exert {:.6g}, {:.6g}, {:.6g} N"
        return [
            Residual("zero", off, self._known.places.hand, names.tile, disagree),
            Residual("zero", wrenches - planned.wrenches, own, names.limb, no_sum),
            Residual("zero", palms[:, 1], own, names.limb, cannot, numbers),
            Residual("least", pressing * PALM_SIGNS, own, names.limb, cannot, numbers),
            Residual("use", used, own),
            claim(most, said, own, TOLERANCES.utilisation, names.limb, "palm: utilisation"),
            Residual("use", along / self._hand_load, own),
        ]

    def recompute_curved(self, arrays: PlanArrays, loads: Array, wrenches: Array) -> list[Residual]:
        """Return by how much the program's linear bounds exceed the size of each hand's force [N].

        Only the part of the force across and away from the rock counts. The bound is the largest
        product of the force with `HELD_DIRECTIONS`; it must not be below the size.
        """
        forces = wrenches[:, :3]
        # what does not press
        held = np.minimum(forces, [np.inf, np.inf, 0.0])
        size = np.sqrt(np.add.reduce(held * held, axis=1))
        left, limb = np.maximum.reduce(forces @ HELD_DIRECTIONS.T, axis=1) - size, self._names.limb
        text = "the hand holds {:.6g} N, more than its rows say"
        return [Residual("least", left, self._each, limb, text, (size,), affine=False)]


def check_contacts(names: PartNames, arrays: PlanArrays) -> Iterator[str]:
    """Yield an error message for each load without contact and each wrongly reported contact.

    Parameters
    ----------
    names : PartNames
        Names of the hands' parts, with the settled hands.
    arrays : PlanArrays
        The plan's numbers.
    """
    known, limbs, palms = names.known, names.limbs, arrays.palms
    for own, planned in ((known.points, arrays.points), (known.axes, arrays.axes)):
        if not (planned is own or np.array_equal(planned, own)):
            hands = np.concatenate((known.places.hand, np.arange(len(palms))))
            elsewhere = (planned != own).reshape(len(own), -1).any(axis=1)
            for i in np.flatnonzero(elsewhere).tolist():
                if arrays.wrists[hands[i]] is None:
                    yield f"{names.tile(i)} is elsewhere, or turned"
    for t in known.touch.idle.tolist():
        if arrays.forces[t].any():
            yield f"{names.tile(t)} carries a load but touches nothing"
    shares, said = known.engagement, arrays.engagement
    if said is not shares:
        for t in np.flatnonzero(said != shares).tolist():
            yield f"{names.tile(t)}: {shares[t]:.6g} of its spines hold, not {said[t]:.6g}"
    for h, hand in enumerate(known.hands):
        engaged, planned_engaged = hand.palm.engaged, arrays.engaged[h]
        if not (engaged and planned_engaged) and palms[h].any():
            yield f"{limbs[h]}: the palm carries a load but touches nothing"
        if engaged != planned_engaged:
            touching = f"{list(engaged)}, not {list(planned_engaged)}"
            yield f"{limbs[h]}: the palm touches with tiles {touching}"
        if hand.tiles != arrays.tiles[h]:
            for t, (tile, each) in enumerate(
                zip(hand.tiles, arrays.tiles[h], strict=True), int(known.places.first[h])
            ):
                if tile != each:
                    if each.contact == "none" and arrays.forces[t].any():
                        yield f"{names.tile(t)} carries a load but touches nothing"
                    other = f"the plan has {' '.join(each)}"
                    yield f"{names.tile(t)} touches with {tile.contact}; {other}"
