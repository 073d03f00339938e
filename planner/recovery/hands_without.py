"""The hands of a stance without tiles and fingers, and their parts of the programs.

A hand that has lost tiles of several fingers is joined from hands that have lost those of one each.
Hands are kept, as the next losses mostly differ in one hand.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import BoundedStore
from hand_models.fixed_wrist import slipped_hand, wrench_spaces
from hand_models.hand import SettledHand
from hand_models.wrench_spaces import WrenchSpace
from planner.prepare import PreparedStance
from planner.programs import HandData, ScaledRows, StanceData, blocks_of, hands_data
from planner.recovery.joined_hands import JoinedHands

__all__ = ["HandKey", "HandsWithout"]

HandKey = tuple[int, tuple[int, ...], tuple[int, ...], bool]
"""Index of a hand, its slipped tiles, its released fingers, and whether its palm holds."""


class LessHand(NamedTuple):
    """A hand without tiles, its set, the scaled rows of the set, and its part of the programs."""

    settled: SettledHand
    space: WrenchSpace
    scaled: ScaledRows
    part: HandData


class HandsWithout:
    """Hands of a stance without tiles, and without fingers. Safe to use from threads.

    Parameters
    ----------
    prepared : PreparedStance
        The stance before tiles slipped; all wrists are fixed.
    most : int
        Number of hands that are kept.
    like : HandsWithout, optional
        Those of the same stance with palms of other strengths, which are then taken over.

    Attributes
    ----------
    pattern : ndarray of bool
        Where the rows of the stance may have entries that are not zero, whichever of the tiles slip
        that have been asked for.
    """

    def __init__(
        self, prepared: PreparedStance, most: int, like: HandsWithout | None = None
    ) -> None:
        data = prepared.hands.data
        self._prepared, self._like = prepared, like
        self.pattern: NDArray[np.bool_]
        self.pattern = _pattern(data) if like is None else like.pattern
        self._blocks = blocks_of(data.hands, len(data.wrench))
        pairs = zip(prepared.batch.hands, prepared.hands.spaces, strict=True)
        self._joined = [JoinedHands(*each) for each in pairs]
        self._kept: BoundedStore[HandKey, LessHand] = BoundedStore("hands without tiles", most)

    def find(self, keys: Iterable[HandKey]) -> dict[HandKey, LessHand]:
        """Return hands without tiles; those that are new are worked out in one call."""
        asked = list(dict.fromkeys(keys))
        known = zip(asked, self._kept.find(asked), strict=True)
        found = {key: hand for key, hand in known if hand is not None}
        new = [key for key in asked if key not in found]
        if not new:
            return found
        if self._like is not None:
            others = self._like.find(new)
            hands = {key: self._as_like(key[0], hand) for key, hand in others.items()}
            self._kept.keep(hands.items())
            return found | hands
        parts = {key: self._by_finger(key) for key in new}
        of_parts = self.find(part for own in parts.values() for part in own.values())
        made = dict(self._slipped([key for key in new if not parts[key]]))
        for key, own in parts.items():
            if own:
                of_fingers = {finger: of_parts[part] for finger, part in own.items()}
                made[key] = self._joined[key[0]].join(
                    {finger: (hand.settled, hand.space) for finger, hand in of_fingers.items()}
                )
        sets, at = self._prepared.hands, [h for h, *_ in made]
        scaled = [ScaledRows.of(space) for _, space in made.values()]
        rows = hands_data(scaled, sets.transports[at], [sets.held[h] for h in at])
        for h, part in zip(at, rows, strict=True):
            limits, hard, loads = self._blocks[h]
            self.pattern[limits, loads] |= part.L != 0.0
            self.pattern[hard, loads] |= part.H != 0.0
        hands = {
            key: LessHand(*hand, own, part)
            for (key, hand), own, part in zip(made.items(), scaled, rows, strict=True)
        }
        self._kept.keep(hands.items())
        return found | hands

    def _as_like(self, h: int, other: LessHand) -> LessHand:
        """Return a hand without tiles, from one whose palm has another strength."""
        assert self._like is not None
        sets, whole = self._prepared.hands, self._prepared.batch.hands[h]
        if whole is self._like._prepared.batch.hands[h]:
            return other
        weaker = sets.spaces[h].s / self._like._prepared.hands.spaces[h].s
        space = replace(other.space, s=other.space.s * weaker)
        settled = replace(other.settled, palm=whole.palm, closed=whole)
        scaled = ScaledRows.of(space)
        (part,) = hands_data([scaled], sets.transports[[h]], [sets.held[h]])
        return LessHand(settled, space, scaled, part)

    def _by_finger(self, key: HandKey) -> dict[int, HandKey]:
        """Return the hands that have lost only one finger's tiles, by finger; none of one finger.

        None either of a hand that is off the rock.
        """
        h, tiles, released, palm = key
        finger_of = self._prepared.batch.hands[h].finger_of.tolist()
        fingers = {finger_of[t] for t in tiles} | {*released}
        if not palm or len(fingers) < 2:
            return {}
        return {
            finger: (h, (), (finger,), True)
            if finger in released
            else (h, tuple([t for t in tiles if finger_of[t] == finger]), (), True)
            for finger in sorted(fingers)
        }

    def _slipped(
        self, keys: Sequence[HandKey]
    ) -> Iterator[tuple[HandKey, tuple[SettledHand, WrenchSpace]]]:
        """Yield hands after slips, and their sets with the rows that the stance adds."""
        sets, whole = self._prepared.hands, self._prepared.batch.hands
        hands = [
            slipped_hand(whole[h], tiles, fingers, palm=palm) for h, tiles, fingers, palm in keys
        ]
        plain = wrench_spaces(hands, self._prepared.question.limits.tendon_tension)
        for key, hand, space in zip(keys, hands, plain, strict=True):
            yield key, (hand, sets.added[key[0]].on(space))


def _pattern(data: StanceData) -> NDArray[np.bool_]:
    """Return where rows may have entries that are not zero, whichever tiles slip.

    The balance, and rows that couple more than two loads of a hand, may have all.
    """
    places, balance = np.asarray(data.rows.whole != 0.0), len(data.wrench)
    places[:balance] = True
    for _, _, loads in blocks_of(data.hands, balance):
        own = places[:, loads]
        own[own.sum(axis=1) > 2] = True
    return places
