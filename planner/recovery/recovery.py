"""Plan a prepared stance anew after tiles have slipped: no closing, and no new solver.

The hands stay where they closed. Only the numbers of the hands that have lost tiles change
(`hand_models.fixed_wrist.slipped_hand`), in rows of the same names and places, so that one
program, or two, of the solver that the stance has already, and the check of their plan, are all.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, BoundedStore, InvalidInputError, UnsupportedError
from hand_models.hand import FINGERS
from planner.prepare import PreparedStance
from planner.question import LostTile
from planner.recovery.hands_without import HandKey, HandsWithout
from planner.recovery.spare_fingers import cannot_spare
from planner.recovery.superposition import superposed
from planner.result import Plan
from planner.solving import Checks, FixedSolution, StanceAnswer, Verified, answer_on

__all__ = ["Recovered", "Recovery"]


class Recovered(NamedTuple):
    """Verified plan of a stance without tiles that have slipped, or why there is none.

    Attributes
    ----------
    found : StanceAnswer
        The answer; its ``prepared`` stance has the hands without the tiles.
    lost : tuple of LostTile
        The tiles that have slipped.
    released : tuple of (str, str)
        Limb and finger of each finger that the plan takes off the rock.
    """

    found: StanceAnswer
    lost: tuple[LostTile, ...]
    released: tuple[tuple[str, str], ...]

    @property
    def utilisation(self) -> float:
        """Least utilisation without the tiles; infinite without a verified plan."""
        return self.found.answer.whole

    @property
    def holds(self) -> bool:
        """True if there is a verified plan within the cap on the utilisation."""
        return self.found.optimal

    @property
    def verified(self) -> Verified | None:
        """The plan's loads, which have passed the checks; None without a plan."""
        return self.found.answer if isinstance(self.found.answer, Verified) else None

    @property
    def save_first(self) -> str | None:
        """Limb of the hand on whose limits the overload depends most; None if there is a plan.

        That is the hand with the largest sum of multipliers: an equal part more of strength there
        lowers the utilisation most.
        """
        least = self.found.answer.solution.least
        if self.holds or not least.limit_duals:
            return None
        pairs = zip(least.limit_duals, least.hard_duals, strict=True)
        prices = [float(limits.sum()) or float(hard.sum()) for limits, hard in pairs]
        return self.found.prepared.limbs[int(np.argmax(prices))]

    def plan(self) -> Plan:
        """Return the whole plan, with its explanation."""
        return self.found.plan()


class Recovery:
    """A prepared stance, for plans without tiles that have slipped. Safe to use from threads.

    A tile that has slipped drags on with friction, and only while it is pressed; a finger of which
    no tile holds, or whose slipped tiles cannot all be pressed, is released: off the rock. Where
    the plan is beyond the cap, fingers that have lost more than one tile are released for a second
    plan, unless that is proven to be worse, and the better one counts; where there is no plan, all
    that have lost a tile.

    Parameters
    ----------
    prepared : PreparedStance
        The stance before tiles slipped; all wrists are fixed.
    many : bool, optional
        True for very many losses of several tiles: hands without one tile are not worked out
        ahead, more hands are kept, and that there is no plan is not proven. Plans are the same.
    like : Recovery, optional
        Recovery of the same stance with palms of other strengths, for very many losses: its hands
        without tiles, and its plans to start from, serve here, too.

    Raises
    ------
    UnsupportedError
        If wrists are compliant or floating, grasps hold with fingernails, or limits keep the
        tensions of fingers that would have to be released.
    """

    def __init__(
        self, prepared: PreparedStance, *, many: bool = False, like: Recovery | None = None
    ) -> None:
        _refuse(prepared)
        self.prepared = prepared
        self._many, self._checks = many, Checks.of(prepared)
        self._places = {
            (limb, tile.finger, tile.phalanx): (h, t)
            for h, (limb, hand) in enumerate(zip(prepared.limbs, prepared.batch.hands, strict=True))
            for t, (tile, on_rock) in enumerate(zip(hand.tiles, hand.touching, strict=True))
            if on_rock
        }
        # each tile and each finger alone, two tiles of a finger, and as many losses of several
        most = 1024 if many else 4 * len(self._places) + 32
        self._hands: HandsWithout
        self._hands = HandsWithout(prepared, most, None if like is None else like._hands)
        self._stances: BoundedStore[tuple[HandKey, ...], PreparedStance] = BoundedStore(
            "stances without tiles", 4
        )
        self._near: BoundedStore[tuple[HandKey, ...], FixedSolution]
        self._near = BoundedStore("plans without tiles", 256) if like is None else like._near
        if not many:
            self._hands.find((h, (t,), (), True) for h, t in self._places.values())

    @property
    def tiles(self) -> tuple[LostTile, ...]:
        """All tiles on the rock, hand by hand: those that can slip."""
        return tuple([LostTile(*name) for name in self._places])

    def plan(
        self,
        lost: Sequence[LostTile],
        body_wrench: Array | None = None,
        *,
        released: Collection[tuple[str, str]] = (),
        off: Collection[str] = (),
    ) -> Recovered:
        """Plan without tiles that have slipped.

        Parameters
        ----------
        lost : sequence of LostTile
            The tiles that have slipped; a tile that is named twice counts once.
        body_wrench : ndarray, shape (6,), optional
            Wrench that the rock must exert on the robot, in B [N, N·m]; by default that of the
            stance.
        released : collection of (str, str), optional
            Limb and finger of fingers that are off the rock, whatever their tiles do.
        off : collection of str, optional
            Limbs of hands that are off the rock: their fingers are released, and palms carry
            nothing.

        Returns
        -------
        Recovered

        Raises
        ------
        InvalidInputError
            If a tile is not on the rock in this stance; the field is ``lost[i]``.
        """
        start = time.perf_counter()
        lost = tuple(dict.fromkeys(lost))
        by_hand = self._by_hand(lost)
        gone = {*released, *((limb, finger) for limb in off for finger in FINGERS)}
        first = self._answer(start, lost, by_hand, gone, off, body_wrench)
        counts = Counter((tile.limb, tile.finger) for tile in lost)
        least = 1 if first.verified is None else 2
        more = {finger for finger, count in counts.items() if count >= least} - {*first.released}
        if first.holds or not more:
            return first
        # mostly the other fingers cannot do without these
        if first.verified is not None and cannot_spare(self.prepared, first.found, more):
            return first
        second = self._answer(start, lost, by_hand, gone | more, off, body_wrench)
        return second if second.utilisation < first.utilisation else first

    def look_ahead(self) -> None:
        """Work out the hands without a finger, or two of its tiles, and plan without a finger."""
        of_finger: dict[tuple[int, int], list[int]] = {}
        for h, t in self._places.values():
            finger = int(self.prepared.batch.hands[h].finger_of[t])
            of_finger.setdefault((h, finger), []).append(t)
        pairs = [(h, two) for (h, _), own in of_finger.items() for two in combinations(own, 2)]
        self._hands.find((h, two, (), True) for h, two in pairs)
        for h, finger in of_finger:
            self.plan((), released=[(self.prepared.limbs[h], FINGERS[finger])])

    def _by_hand(self, lost: Iterable[LostTile]) -> dict[int, list[int]]:
        """Return the tiles that have slipped, by the index of their hand."""
        found: dict[int, list[int]] = {}
        for i, tile in enumerate(lost):
            place = self._places.get((tile.limb, tile.finger, tile.phalanx))
            if place is None:
                raise InvalidInputError(
                    f"no {tile.phalanx} tile of {tile.finger} of {tile.limb} is on the rock in "
                    f"this stance; {self._valid(tile)}",
                    field=f"lost[{i}]",
                )
            found.setdefault(place[0], []).append(place[1])
        return found

    def _valid(self, tile: LostTile) -> str:
        """Return a sentence that says what could be in place of a tile that is not on the rock."""
        limbs = list(self.prepared.limbs)
        if tile.limb not in limbs:
            return f"its limbs are {', '.join(limbs)}"
        own = [name[1:] for name in self._places if name[0] == tile.limb]
        return "on it are " + (", ".join(" ".join(each[::-1]) for each in own) or "none")

    def _answer(
        self,
        start: float,
        lost: tuple[LostTile, ...],
        by_hand: Mapping[int, Sequence[int]],
        released: Collection[tuple[str, str]],
        off: Collection[str],
        body_wrench: Array | None,
    ) -> Recovered:
        keys = self._keys(by_hand, released, off)
        prepared = self._stance_without(keys, body_wrench)
        checks = self._checks.after_slips(prepared, lost)
        found = answer_on(prepared, start, checks, self._nearest(keys), prove=not self._many)
        solution = found.answer.solution
        if isinstance(found.answer, Verified) and isinstance(solution, FixedSolution):
            # a start is all that is needed of it
            self._near.keep([(keys, replace(solution, sets=self.prepared.at_rest))])
        open_fingers = [
            (prepared.limbs[h], finger) for h, *_ in keys for finger in _released(prepared, h)
        ]
        return Recovered(found, lost, tuple(open_fingers))

    def _stance_without(
        self, keys: tuple[HandKey, ...], body_wrench: Array | None
    ) -> PreparedStance:
        prepared = self._stances.get(keys, lambda: self._prepared(keys))
        return prepared if body_wrench is None else prepared.turned(body_wrench)

    def _nearest(self, keys: tuple[HandKey, ...]) -> FixedSolution | None:
        """Return a solution to start from: of the same losses, superposed, or of one loss less."""
        single = [
            (each,)
            for h, tiles, fingers, _ in keys
            for each in (
                *((h, (t,), (), True) for t in tiles),
                *((h, (), (finger,), True) for finger in fingers),
            )
        ]
        same, whole, *others = self._near.find([keys, (), *single])
        starts = [each.start for each in others if each is not None and each.start is not None]
        if same is not None:
            return same
        if whole is not None and whole.start is not None and len(starts) == len(single):
            return replace(whole, start=superposed(whole.start, starts))
        # mostly one tile slips after the other
        return next((each for each in self._near.find(_one_less(keys)) if each), whole)

    def _keys(
        self,
        by_hand: Mapping[int, Sequence[int]],
        released: Collection[tuple[str, str]],
        off: Collection[str],
    ) -> tuple[HandKey, ...]:
        """Return what is gone of each hand that is not whole: fingers, and tiles of others."""
        keys = []
        for h, limb in enumerate(self.prepared.limbs):
            fingers = sorted(FINGERS.index(finger) for at, finger in released if at == limb)
            finger_of = self.prepared.batch.hands[h].finger_of
            tiles = sorted(t for t in by_hand.get(h, ()) if finger_of[t] not in fingers)
            if tiles or fingers or limb in off:
                keys.append((h, tuple(tiles), tuple(fingers), limb not in off))
        return tuple(keys)

    def _prepared(self, keys: Sequence[HandKey]) -> PreparedStance:
        """Return the stance with hands that are not whole, prepared for the solver."""
        prepared, hands, others = self.prepared, list(self.prepared.batch.hands), {}
        for (h, *_), found in self._hands.find(keys).items():
            hands[h], others[h] = found.settled, (found.space, found.scaled, found.part)
        # the rows as the solver takes them are in the pattern that it has already
        sets = prepared.hands.with_hands(others, self._hands.pattern)
        return replace(prepared, batch=prepared.batch.after_slips(hands), hands=sets)


def _one_less(keys: tuple[HandKey, ...]) -> list[tuple[HandKey, ...]]:
    """Return the same losses without one of the tiles each."""
    found = []
    for i, (h, tiles, fingers, palm) in enumerate(keys):
        for t in tiles:
            others = tuple([each for each in tiles if each != t])
            own = ((h, others, fingers, palm),) if others or fingers or not palm else ()
            found.append((*keys[:i], *own, *keys[i + 1 :]))
    return found


def _released(prepared: PreparedStance, h: int) -> Iterator[str]:
    """Yield the fingers of a hand that are off the rock since tiles have slipped."""
    hand = prepared.batch.hands[h]
    bearing = {tile.finger for tile in hand.tiles if tile.contact != "none"}
    before = {tile.finger for tile in hand.as_closed.tiles if tile.contact != "none"}
    yield from (finger for finger in FINGERS if finger in before - bearing)


def _refuse(prepared: PreparedStance) -> None:
    """Refuse stances whose hands cannot be planned without tiles."""
    question = prepared.question
    for i, hand in enumerate(question.stance.hands):
        if hand.wrist != "fixed":
            raise UnsupportedError(
                f"{hand.wrist} is not available after slips: where the wrist then goes takes a "
                "search; valid is fixed",
                field=f"stance.hands[{i}].wrist",
            )
        if hand.grasp.fingernail:
            raise UnsupportedError(
                "a hand that holds with its fingernails has no tiles that can slip",
                field=f"stance.hands[{i}].grasp.fingernail",
            )
    for name in ("tension_change", "least_tension"):
        if getattr(question.limits, name):
            raise UnsupportedError(
                "not available after slips, as fingers may have to be released: leave it out",
                field=f"limits.{name}",
            )
