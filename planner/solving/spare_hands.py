"""Hands that add nothing to a plan, whose tendons stay as closing has left them.

A hand adds nothing where the least utilisation without it, u', is no more than what the plan gives
away. With the utilisation multipliers of all hands a bound of u' is known at once,

    u' ≥ (u* − v) / (1 − Σ λ),

λ of the hand's limits and v its own part of the dual objective, so that hardly a program is solved
for hands that do add something. In the plan of least tension the tension t of a hand that adds
nothing is measured from f times its closing tension instead of zero, and weighs 1 / (1 − f) times
as much,

    f = (r / r₀) min((u* + r − u') / r₀, 1),

with r the utilisation that may be given away, r₀ of it far from the cap. So tensions change
continuously with u', and with the cap; with f = 1 they are those of closing where the body's
balance lets them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from hand_models.hand import FINGERS
from planner import deadline, programs
from planner.programs import LOAD_UNIT, Outcome, StanceData, TensionTrade

__all__ = ["SpareHand", "at_closing", "less_tense", "spare_hands"]


class SpareHand(NamedTuple):
    """A hand that adds nothing.

    Attributes
    ----------
    place : int
        Of the hand, among all.
    without : float
        The least utilisation without it.
    part : float
        f.
    """

    place: int
    without: float
    part: float


def spare_hands(data: StanceData, exact: Outcome, trade: TensionTrade) -> tuple[SpareHand, ...]:
    """Return the hands that add nothing; none where nothing may be given away.

    Parameters
    ----------
    data : StanceData
    exact : Outcome
        Of the least utilisation.
    trade : TensionTrade
    """
    room = trade.most - exact.value
    # with more than the body's six rows of balance, a hand's wrench is given
    if room <= 0.0 or len(data.hands) < 2 or len(data.wrench) > 6:
        return ()
    if exact.balance_dual is None:  # the solver gave no multipliers
        return ()
    found = []
    for i, hand in enumerate(data.hands):
        limits, hard = exact.limit_duals[i], exact.hard_duals[i]
        share = 1.0 - float(np.add.reduce(limits))
        own = float(limits @ hand.l0 - hard @ hand.h + exact.balance_dual @ hand.g)
        # where a hand alone sets u*, Σ λ is one and both are zero but for rounding
        if exact.value - own > share * trade.most + 1e-6 * max(1.0, exact.value):
            continue
        if deadline.expired():
            break
        others = StanceData.of((*data.hands[:i], *data.hands[i + 1 :]), data.wrench)
        without = programs.margin(others)
        if without.solved and without.value < trade.most:
            far = min((trade.most - without.value) / trade.whole, 1.0)
            found.append(SpareHand(i, without.value, far * room / trade.whole))
    return tuple(found)


def at_closing(
    data: StanceData,
    trade: TensionTrade,
    spare: Sequence[SpareHand],
    closing: Sequence[float],
) -> Outcome:
    """Return the plan of less tension in which spare hands stay near their closing tensions.

    Parameters
    ----------
    data : StanceData
    trade : TensionTrade
    spare : sequence of SpareHand
    closing : sequence of float
        Closing tension of every hand [N].
    """
    hands = list(data.hands)
    centres = [np.zeros(len(hand.unit)) for hand in hands]
    for i, _, part in spare:
        centres[i][: len(FINGERS)] = part * closing[i] / LOAD_UNIT
        # a newton off closing is then as dear as ten in other hands
        stiffness = 1.0 / max(1.0 - part, 1.0 / 100.0)
        hands[i] = hands[i].about(centres[i], stiffness)
    outcome = programs.less_tension(StanceData.of(tuple(hands), data.wrench), trade)
    loads = [
        y + centre * hand.unit
        for y, centre, hand in zip(outcome.loads, centres, data.hands, strict=False)
    ]
    return replace(outcome, loads=tuple(loads)) if outcome.solved else outcome


def less_tense(
    data: StanceData, least: Outcome, trade: TensionTrade, closing: Sequence[float]
) -> tuple[Outcome, tuple[SpareHand, ...]]:
    """Return the plan of less tension as a solver finds it, and the hands that add nothing to it.

    Parameters
    ----------
    data : StanceData
    least : Outcome
        Of the least utilisation.
    trade : TensionTrade
    closing : sequence of float
        Closing tension of every hand [N].
    """
    spare = spare_hands(data, least, trade)
    if spare:
        resting = at_closing(data, trade, spare, closing)
        if resting.solved:
            return resting, spare
    return programs.less_tension(data, trade), ()
