"""How the palms of floating hands carry, and how much such hands can carry at most.

A palm drags the rock where it moves toward −x and presses where it moves into it, so that each of a
hand's palm modes is a set of its own. They meet where the palm just does not move. A good choice
of modes is sought at rest, hand by hand; where in the plan a palm is held back by nothing but its
mode, it is tried the other way.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Final, NamedTuple

from hand_models.floating_wrist import PalmMode
from hand_models.row_layout import PALM_PRESSING, PALM_SHEAR
from planner import program
from planner.floating import ROUNDS, Settled, settle_wrists
from planner.hand_sets import Hands
from planner.program import SLACK

__all__ = ["least_use", "most_load"]

MODES: Final[dict[tuple[bool, bool], PalmMode]] = {
    (False, False): "off",
    (True, False): "drags",
    (False, True): "presses",
    (True, True): "drags_and_presses",
}
"""By whether the palm drags, and whether it presses."""

STARTS: Final = 5
"""Choices of modes from which a point is sought, if the first ones give none."""

NEARBY: Final = 16
"""Most rounds of a search that starts from a plan, or where another search has failed."""

EXCHANGES: Final = 6
"""Most trials of a palm the other way."""

HELD_BACK: Final = 1e-6
"""Multiplier above which a palm's mode holds it back, in utilisation per `program.LOAD_UNIT`."""

UNBALANCED: Final = 1e6
"""Rank of a choice without balance at rest, beside what is missing."""

FACTORS: Final = 8
"""Most factors of the body wrench that are tried."""

FRACTIONS: Final = (0.5, 0.1)
"""Factors from which the largest is sought where the whole body wrench has no plan."""

BRACKET: Final = 2e-3
"""How closely, relatively, the largest factor is bracketed where Newton's method does not end."""

LEAST: Final = 0.02
"""Least factor that is tried."""

SLOPE: Final = 1e-3
"""Utilisation per factor below which a plan does not get harder with the load."""

Palms = tuple[PalmMode | None, ...]


def least_use(hands: Hands, factor: float = 1.0) -> Settled:
    """Find the point of least utilisation over the modes of the hands' palms.

    If there is none, the returned one is that of the search with the least missing.
    """
    failed: list[Settled] = []
    for palms in _starts(hands, factor):
        most = NEARBY if failed else ROUNDS
        found = settle_wrists(hands, replace(hands.at_rest(palms), factor=factor), most)
        if found.exact:
            return _exchanged(hands, found)
        failed.append(found)
    return min(failed, key=lambda found: found.measure.missing)


class LargestFactor(NamedTuple):
    """The largest factor of the body wrench that was found.

    Attributes
    ----------
    factor : float
    sure : bool
        Whether utilisation 1 ends it; otherwise a search that found no plan beyond it, so that it
        is a lower bound.
    """

    factor: float
    sure: bool


def most_load(hands: Hands, plan: Settled) -> LargestFactor | None:
    """Return the largest factor of the body wrench that has a plan of utilisation 1.

    By Newton's method on the least utilisation as a function of the factor, whose slope the
    multipliers of the balance give. Where hard rows end it first, or at kinks, it is bracketed
    and the lower end returned. None if it is not found.

    Parameters
    ----------
    hands : Hands
    plan : Settled
        For the whole body wrench, or what a search for it has come to.
    """
    now = plan
    for factor in FRACTIONS:
        if now.exact:
            break
        now = least_use(hands, factor)
    if not now.exact:
        return None
    low, high, sure, overloaded = 0.0, math.inf, False, False
    for _ in range(FACTORS):
        used, factor = now.measure.utilisation, now.point.factor
        if used <= 1.0 + SLACK:
            low = max(low, factor)
        elif factor < high:
            high, overloaded = factor, True
        if abs(used - 1.0) <= SLACK:
            better = _exchanged(hands, now)
            if better is now:
                sure = True
                break
            now = better
            continue
        if high < math.inf and high - low <= BRACKET * high:
            sure = overloaded
            break
        assert now.outcome.balance_dual is not None
        slope = -float(now.outcome.balance_dual @ hands.wrench)
        aim = math.inf if used < 1.0 else 0.0
        if slope > SLOPE:
            aim = factor + (1.0 - used) / slope
        aim = min(max(aim, 0.3 * factor), 2.0 * factor)
        if not low < aim < high:
            aim = 0.5 * (low + high) if high < math.inf else 2.0 * low
        if aim < LEAST:
            break
        there = settle_wrists(hands, replace(now.point, factor=aim), NEARBY)
        if there.exact:
            now = there
        elif aim > factor:
            high, overloaded = aim, False
        else:
            break
    return LargestFactor(low, sure) if low > 0.0 else None


def _starts(hands: Hands, factor: float) -> Iterator[Palms]:
    """Yield choices of modes, the best at rest first."""
    choices = [None if wrist is None else wrist.palm_modes() for wrist in hands.wrists]
    engaged = [i for i, modes in enumerate(choices) if modes is not None and len(modes) > 1]
    common: list[Palms] = [
        tuple(None if modes is None else (mode if mode in modes else "off") for modes in choices)
        for mode in MODES.values()
    ]
    common = list(dict.fromkeys(common))
    ranks = {palms: _rank(hands, palms, factor) for palms in common}
    best = min(common, key=lambda palms: ranks[palms])
    for i in engaged:
        others = [_with(best, i, mode) for mode in MODES.values()]
        for palms in others:
            if palms not in ranks:
                ranks[palms] = _rank(hands, palms, factor)
        best = min([best, *others], key=lambda palms: ranks[palms])
    yield from sorted(dict.fromkeys([best, *common]), key=lambda palms: ranks[palms])[:STARTS]


def _rank(hands: Hands, palms: Palms, factor: float) -> float:
    """Return the least utilisation with the sets at rest; more where they have no balance."""
    data = hands.sets(replace(hands.at_rest(palms), factor=factor)).data
    outcome = program.margin(data)
    if outcome.solved:
        return outcome.value
    nearest = program.nearest(data)
    return UNBALANCED * (1.0 + nearest.value) if nearest.solved else float("inf")


def _with(palms: Palms, i: int, mode: PalmMode) -> Palms:
    return (*palms[:i], mode, *palms[i + 1 :])


def _exchanged(hands: Hands, found: Settled) -> Settled:
    """Return a better point that is had by turning palms that their mode holds back."""
    tried: set[Palms] = {found.point.palms}
    for _ in range(EXCHANGES):
        new = next((p for p in _turned(found) if p not in tried), None)
        if new is None:
            break
        tried.add(new)
        there = settle_wrists(hands, replace(found.point, palms=new), NEARBY)
        lower = found.measure.utilisation - SLACK * max(1.0, found.measure.utilisation)
        if there.exact and there.measure.utilisation < lower:
            found = there
    return found


def _turned(found: Settled) -> Iterator[Palms]:
    """Yield choices in which one palm that its mode holds back goes the other way."""
    palms = found.point.palms
    for i, (space, mode) in enumerate(zip(found.sets.spaces, palms, strict=True)):
        if mode is None:
            continue
        drags, presses = next(key for key, value in MODES.items() if value == mode)
        rows = space.rows[len(space.s) :]
        for row, multiplier in zip(rows, found.outcome.hard_duals[i], strict=True):
            if multiplier > HELD_BACK and row.limit == f"{PALM_SHEAR}_reversed":
                yield _with(palms, i, MODES[not drags, presses])
            elif multiplier > HELD_BACK and row.limit == f"{PALM_PRESSING}_reversed":
                yield _with(palms, i, MODES[drags, not presses])
