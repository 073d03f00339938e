"""Spare hands: hands that a plan hardly needs, whose tendons stay near their closing tension.

A hand is spare if the least utilisation without it, u', is no more than the plan may give away for
less tension. The multipliers of the program with all hands give a lower bound of u',

    u' ≥ (u* − v) / (1 − Σ λ),

with u* the least utilisation, λ the multipliers of the hand's limits and v the hand's part of the
dual objective. So hardly a program is solved for hands that are needed. In the plan of least
tension the tension t of a spare hand is measured from f times its closing tension instead of from
zero, and weighs 1 / (1 − f) times as much,

    f = (r / r₀) min((u* + r − u') / r₀, 1),

with r the utilisation that may be given away, and r₀ its value far from the cap. So tensions change
continuously with u', and with the cap. With f = 1 they are the closing tensions, if the body's
balance allows that.
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
    """A hand without which the least utilisation is no more than the plan may have.

    Attributes
    ----------
    place : int
        Index of the hand.
    without : float
        Least utilisation without the hand.
    part : float
        Share f of the closing tension from which the hand's tensions are measured, 0 to 1.
    """

    place: int
    without: float
    part: float


def spare_hands(data: StanceData, exact: Outcome, trade: TensionTrade) -> tuple[SpareHand, ...]:
    """Return the spare hands of a stance; none if the plan may not give away any utilisation.

    Parameters
    ----------
    data : StanceData
        Scaled rows of all hands, and the wrench that they must balance.
    exact : Outcome
        Outcome of the program of least utilisation, with exact multipliers.
    trade : TensionTrade
        Utilisation that the plan may give away for less tension.
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
    """Solve for the plan of less tension in which spare hands stay near their closing tensions.

    Parameters
    ----------
    data : StanceData
        Scaled rows of all hands, and the wrench that they must balance.
    trade : TensionTrade
        Utilisation that the plan may give away for less tension.
    spare : sequence of SpareHand
        The spare hands.
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
    """Solve for the plan of less tension; return its outcome and the spare hands.

    Parameters
    ----------
    data : StanceData
        Scaled rows of all hands, and the wrench that they must balance.
    least : Outcome
        Outcome of the program of least utilisation.
    trade : TensionTrade
        Utilisation that the plan may give away for less tension.
    closing : sequence of float
        Closing tension of every hand [N].
    """
    spare = spare_hands(data, least, trade)
    if spare:
        resting = at_closing(data, trade, spare, closing)
        if resting.solved:
            return resting, spare
    return programs.less_tension(data, trade), ()
