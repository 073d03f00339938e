"""A hand whose wrist stays where it is: from settled fingers to a WrenchSpace (Eqs. 9, 14–16).

The loads y are the tendon tensions, a passive lateral reaction for each finger that touches rock,
and the palm's shear and pressing. Everything is affine in them:

    w = Σ_tiles W_t (c_sys + f c_act) + lateral and palm loads = o + V y,

and so are the loads of the motors and of the structure. All hands of a stance are worked out
together, those with the same rows and columns in arrays of all of them (`alike_hands`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from hand_models.base import check_positive
from hand_models.fixed_wrist.alike_hands import (
    HELD_ROWS,
    hard_rows,
    limit_rows,
    wrench_columns,
)
from hand_models.fixed_wrist.row_layout import RowLayout, layout_of
from hand_models.hand import HandModel, SettledHand
from hand_models.wrench_spaces import WrenchSpace

__all__ = ["wrench_space", "wrench_spaces"]

KEPT: Final = 4
"""Sets that are kept of one settled hand, for different tension limits."""


def wrench_space(settled: SettledHand, tension_limit: float | None = None) -> WrenchSpace:
    """Return the wrenches on the rock, in H, that a settled hand carries with its wrist fixed.

    Parameters
    ----------
    settled : SettledHand
    tension_limit : float, optional
        A caller's cap on every tendon [N]; the hand's own maximum if that is less.

    Returns
    -------
    WrenchSpace
        Columns: four tensions, the lateral reactions, palm shear and palm pressing [N]. Limit rows:
        each tile's half-planes (with both signs of its lateral load); each tendon's tension, motor
        torque [N·m] and motor current [A]; the shear of a finger's tiles together, the pressing of
        its tip; the palm; and, as wrench rows, what the hand holds in the directions `HELD`. Hard
        rows: tension, palm loads not negative; no tile dragged backwards; a joint's stop and a
        frame beside its tile only push; a nail that clings neither lifts nor slips nor closes its
        finger; with friction in the tendons, no tension below closing, where they would stick. A
        nail has a column for the load along it, and two limit rows. Arrays are read-only.

    Raises
    ------
    InvalidInputError
        If the cap is not above zero.
    """
    # a set of its own: the vertices and half-spaces that it keeps go when the caller is done
    return replace(wrench_spaces([settled], tension_limit)[0])


def wrench_spaces(
    settled: Sequence[SettledHand], tension_limit: float | None = None
) -> list[WrenchSpace]:
    """Return the set of each hand, as `wrench_space` does, all worked out together.

    A hand's sets are kept as long as the hand is, the last `KEPT` of them: asked again, the answer
    is the same set.
    """
    if tension_limit is not None:
        check_positive(tension_limit, "N", "tension_limit", most=math.inf)
    cap = math.inf if tension_limit is None else tension_limit
    limits = [min(hand.hand.maximum_tension, cap) for hand in settled]
    found: dict[SettledHand, WrenchSpace] = {}
    new: dict[SettledHand, float] = {}
    for hand, limit in zip(settled, limits, strict=True):
        known = hand.sets.get(limit)
        if known is None:
            new[hand] = limit
        else:
            found[hand] = known
    if new:
        for hand, space in _worked_out(new):
            found[hand] = hand.sets[new[hand]] = space
            if len(hand.sets) > KEPT:
                for known_limit in list(hand.sets)[:-KEPT]:
                    hand.sets.pop(known_limit, None)
    return [found[hand] for hand in settled]


def _worked_out(limits: Mapping[SettledHand, float]) -> Iterator[tuple[SettledHand, WrenchSpace]]:
    """Yield hands and their sets for each one's largest tension [N], of those alike together."""
    alike: dict[tuple[RowLayout, HandModel], list[SettledHand]] = {}
    for hand in limits:
        layout = layout_of(hand, sticking=hand.hand.finger.friction > 0.0)
        alike.setdefault((layout, hand.hand), []).append(hand)
    for (layout, model), hands in alike.items():
        at_zero, V = wrenches = wrench_columns(layout, hands)
        most = np.array([limits[hand] for hand in hands])
        L, l0, s = limit_rows(layout, model, hands, most, wrenches)
        H, h = hard_rows(layout, hands)
        for array in (at_zero, V, L, l0, s, H, h):
            array.setflags(write=False)
        for i, hand in enumerate(hands):
            yield (
                hand,
                WrenchSpace(
                    origin=at_zero[i, :6],
                    generators=V[i, :6],
                    columns=layout.columns,
                    rows=layout.rows,
                    L=L[i],
                    l0=l0[i],
                    s=s[i],
                    H=H[i],
                    h=h[i],
                    D=HELD_ROWS,
                ),
            )
