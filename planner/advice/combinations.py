"""Search for changes of several hands and of the body that together make a stance feasible.

With the hands' wrench spaces at the utilisation cap, a stance is feasible if its hands can exert
enough in each direction d of body wrenches W (Farkas):

    Σ_h s_h(d) ≥ d·W,   s_h(d) = max { d·w : w of hand h }.

The balance multipliers of an infeasible or overloaded plan give the direction in which most is
missing. The support function s_h of a changed hand is known without a plan, and so is the effect of
a body shift on W. So the search chooses one variant of each hand, and a shift, that satisfy all
directions found so far, and plans them; if that plan is not feasible, it adds a direction (as
Benders' cuts, 1962).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hand_models.base import Array, Indices, Pose, wrench_transport
from hand_models.fixed_wrist import wrench_spaces
from hand_models.hand import SettledHand
from planner import deadline
from planner.advice.body import BodySearch, can_move
from planner.advice.changes import SETTINGS, Change, changed, combined
from planner.advice.hands import lettings, variants
from planner.advice.new_holds import every_hold
from planner.advice.trials import StanceTrial, Trials, direction
from planner.prepare import settle_each
from planner.programs import Support
from planner.question import HandOnHold

__all__ = ["Choice", "CombinationSearch"]

Mask = npt.NDArray[np.bool_]


class _Variant(NamedTuple):
    """A hand as it may be.

    Attributes
    ----------
    limb : str
    change : Change or None
        None for the hand as it is.
    pose : Pose or None
        Of H in W; None for no hand.
    support : Support or None
        Of its wrenches; None for no hand.
    transport : ndarray, shape (6, 6)
        Ad(B←H).
    """

    limb: str
    change: Change | None
    pose: Pose | None
    support: Support | None
    transport: Array

    def gives(self, direction: Array) -> float:
        """Return the most of direction · w, of body wrenches w that it gives."""
        if self.support is None:
            return 0.0
        return min(
            max(self.support(-(direction @ self.transport)), -SETTINGS.most_given),
            SETTINGS.most_given,
        )


class Choice(NamedTuple):
    """One variant for each limb, and a shift of the body.

    Attributes
    ----------
    hands : tuple of int
        Index of each limb's variant.
    shift : int
        Index of the shift; 0 for none.
    """

    hands: tuple[int, ...]
    shift: int


class CombinationSearch:
    """Search for changes of several hands and the body that together make a stance feasible.

    There are k directions along which some plan fell shortest of the body wrench, v variants of all
    limbs, and s shifts of the body. Directions are scaled so that 1 is needed along each. Floating
    wrists count as fixed where variants are chosen; plans treat them exactly.

    Parameters
    ----------
    trials : Trials
        Budget of plans; its unchanged stance is the start.

    Attributes
    ----------
    gives : ndarray, shape (k, v)
        Largest wrench component along each direction that each variant can exert.
    needs : ndarray, shape (k, s)
        Wrench component needed along each direction with each shift, minus 1. A choice is feasible
        if its sum of ``gives``, minus ``needs``, is at least 1 along all directions.
    sizes : ndarray, shape (v,)
        Size of each variant's change, as in `planner.result.Advice`.
    shift_sizes : ndarray, shape (s,)
        Size of each shift.
    reached : ndarray of bool, shape (v, s)
        Whether a variant is in its limb's reach with a shift.
    together : ndarray of bool, shape (v, v)
        Whether two variants are compatible.
    slots : list of ndarray
        Indices of the variants of each limb.
    """

    def __init__(self, trials: Trials) -> None:
        prepared = trials.base.prepared
        self.trials, self._variants = trials, list(_variants(trials))
        self.sizes = np.array([0.0 if v.change is None else v.change.size for v in self._variants])
        limbs = np.array([each.limb for each in self._variants])
        self.slots = [np.flatnonzero(limbs == limb) for limb in dict.fromkeys(limbs.tolist())]
        self._body = BodySearch(trials) if can_move(prepared) else None
        self._shifts = np.zeros((1, 3)) if self._body is None else self._body.grid()
        self.shift_sizes = np.linalg.norm(self._shifts, axis=1) / SETTINGS.shift_unit
        self.reached = _reached(trials, self._variants, self._shifts)
        self.together = _together(self._variants)
        self._needed = prepared.wrench
        self._random = np.random.default_rng(0)
        self.gives, self.needs = np.zeros((0, len(limbs))), np.zeros((0, len(self._shifts)))
        self.learn(trials.base, 0)

    def run(self) -> None:
        """Search for feasible changes, then for smaller ones, within the budget of plans."""
        if self.find(0, smallest=False) is not None:
            # plans for smaller changes, once some hold
            self.find(max(self.trials.left - 12, 0), smallest=True)

    def find(self, last: int, *, smallest: bool) -> Choice | None:
        """Plan one choice after another until one is feasible.

        Parameters
        ----------
        last : int
            Number of plans to leave in the budget.
        smallest : bool
            Whether to try the smallest choices first, not those that contribute most.

        Returns
        -------
        Choice or None
            The feasible choice; None if none was found.
        """
        as_it_is = Choice(tuple(int(slot[self.sizes[slot].argmin()]) for slot in self.slots), 0)
        seen, forbidden = [as_it_is], 0
        earlier: dict[Choice, float] = {}  # choices and what they were worth
        while len(self.gives) and self.trials.left > last:
            choices = {}
            for start in {as_it_is, seen[-1], *self.anywhere()}:
                deadline.check(SETTINGS.late)
                worth, choice = self._climbed(start, smallest)
                choices[choice] = worth
            earlier |= choices
            # what an earlier search came to only once this one comes to nothing new
            new = self._enough(choices, seen) or self._enough(earlier, seen)
            if not new:
                return None
            _, choice = max(new)
            seen.append(choice)
            change = self.change(choice)
            trial = None if change is None else self.trials.one(change)
            # choices that cannot be, after which the search ends
            if trial is None and forbidden < 200:
                forbidden += 1
                self._forbid(choice)
            elif trial is None:
                return None
            elif self.trials.holds(trial.utilisation):
                return choice
            else:
                self.learn(trial, choice.shift)
        return None

    def anywhere(self) -> Iterator[Choice]:
        """Yield random choices at which the local search starts."""
        for _ in range(8):  # random choices to begin at
            hands = tuple(int(self._random.choice(slot)) for slot in self.slots)
            yield Choice(hands, int(self._random.integers(len(self._shifts))))

    def _enough(
        self, worths: Mapping[Choice, float], seen: Sequence[Choice]
    ) -> list[tuple[float, Choice]]:
        """Return the choices that are not yet seen and give nearly enough, with their worth."""
        enough = 0.97  # of what is needed: with less no plan is made
        return [
            (worth, choice)
            for choice, worth in worths.items()
            if choice not in seen and self.part(choice) >= enough
        ]

    def part(self, choice: Choice) -> float:
        """Return the share of the needed wrench that a choice can exert, in the worst direction.

        Below 1, the choice is infeasible.
        """
        given = self.gives[:, list(choice.hands)].sum(axis=1)
        return float((given - self.needs[:, choice.shift]).min())

    def _climbed(self, start: Choice, smallest: bool) -> tuple[float, Choice]:
        """Return the best that is reached by changing two limbs, or the shift, at a time."""
        hands, shift, best = list(start.hands), start.shift, -np.inf
        while True:
            before = best
            given = self.gives[:, hands].sum(axis=1)
            size = float(self.sizes[hands].sum())
            worth = _worth(given[:, None] - self.needs, size + self.shift_sizes, smallest)
            worth[~self.reached[hands].all(axis=0)] = -np.inf
            if np.isfinite(worth.max()):
                shift = int(worth.argmax())
            for i, j in combinations(range(len(hands)), 2):
                others = [each for k, each in enumerate(hands) if k not in (i, j)]
                given = self.gives[:, others].sum(axis=1) - self.needs[:, shift]
                size = float(self.sizes[others].sum() + self.shift_sizes[shift])
                fits = self.reached[:, shift] & self.together[others].all(axis=0)
                first, second = (
                    self._best(each[fits[each]], given, smallest)
                    for each in (self.slots[i], self.slots[j])
                )
                if not (len(first) and len(second)):
                    continue
                both = self.gives[:, first, None] + self.gives[:, None, second]
                sizes = self.sizes[first, None] + self.sizes[second]
                worth = _worth(given[:, None, None] + both, size + sizes, smallest)
                worth[~self.together[np.ix_(first, second)]] = -np.inf
                a, b = np.unravel_index(int(worth.argmax()), worth.shape)
                if worth[a, b] > best:
                    hands[i], hands[j], best = int(first[a]), int(second[b]), float(worth[a, b])
            if best <= before:
                return best, Choice(tuple(hands), shift)

    def _best(self, slot: Indices, given: Array, smallest: bool) -> Indices:
        """Return the variants of a limb that are worth most by themselves, 48 at most."""
        few = 48  # that are put together with those of another limb
        if len(slot) <= few:
            return slot
        worth = _worth(given[:, None] + self.gives[:, slot], self.sizes[slot], smallest)
        return slot[np.argsort(-worth, kind="stable")[:few]]

    def learn(self, trial: StanceTrial, shift: int) -> None:
        """Add the direction along which a plan falls shortest of the body wrench, if it has one.

        Parameters
        ----------
        trial : StanceTrial
            Plan that is overloaded or infeasible.
        shift : int
            Index of the shift with which it was planned.
        """
        found = direction(trial)
        needs = 0.0 if found is None else float(found @ trial.prepared.wrench)
        if found is None or not needs > 0.0:
            return
        d = found / needs
        # about where B's origin was
        d[:3] -= np.cross(d[3:], self._shifts[shift])
        moves = self._shifts @ np.cross(self._needed[:3], d[3:])
        self.gives = np.vstack([self.gives, [each.gives(d) for each in self._variants]])
        self.needs = np.vstack([self.needs, float(d @ self._needed) + moves - 1.0])

    def _forbid(self, choice: Choice) -> None:
        """Leave out variants that cannot be, or pairs that do not go together; else the largest."""
        moved = self._moved(choice.shift)
        if moved is not None and not self.trials.possible(moved):
            self.reached[:, choice.shift] = False
            return
        alone = {i: each for i in choice.hands if (each := self._variants[i].change) is not None}
        gone = [i for i, each in alone.items() if not self.trials.possible(each)]
        apart = []
        if not gone:
            for i, j in combinations(alone, 2):
                both = combined([alone[i], alone[j]])
                if both is None or not self.trials.possible(both):
                    apart.append((i, j))
        if not gone and not apart:
            gone = [max(alone, key=lambda i: self.sizes[i])] if alone else []
        for i in gone:
            self.slots = [slot[slot != i] for slot in self.slots]
        for i, j in apart:
            self.together[[i, j], [j, i]] = False

    def change(self, choice: Choice) -> Change | None:
        """Return a choice as one change of the question; None if it changes nothing.

        None, too, if two of its changes contradict each other.
        """
        changes = [each for i in choice.hands if (each := self._variants[i].change) is not None]
        moved = self._moved(choice.shift)
        return combined(changes if moved is None else [*changes, moved])

    def _moved(self, shift: int) -> Change | None:
        """Return a shift of the body, by its index, as a change."""
        return self._body.change(self._shifts[shift]) if self._body is not None and shift else None


def _worth(given: Array, sizes: Array, smallest: bool) -> Array:
    """Return what choices are worth, by what they give in all directions (k, …), and size.

    ``smallest``: whether the smallest that gives enough is wanted, not the one that gives most.
    """
    part = given.min(axis=0)
    digits = 6  # of the worth of choices: rounding errors decide nothing
    price = 0.02  # of a change of size 1, in parts of what is needed
    if smallest:
        return np.where(part >= 1.0, -price * sizes, part - SETTINGS.most_given).round(digits)
    # half as much again as is needed is enough: more is no better
    return np.asarray(np.minimum(part, 1.5) - price * sizes).round(digits)


def _variants(trials: Trials) -> Iterator[_Variant]:
    """Yield each hand as it is, changed, let go and elsewhere, and each free limb so, too."""
    prepared = trials.base.prepared
    stance, limits = trials.question.stance, trials.question.limits
    wanted: list[tuple[str, Change | None, HandOnHold]] = []
    # in an order that is not that of the question
    for i in sorted(range(len(stance.hands)), key=lambda i: stance.hands[i].limb):
        hand = stance.hands[i]
        wanted.append((hand.limb, None, hand))
        for change in variants(prepared, i):
            wanted.append((hand.limb, change, _hand(trials, change, i)))
    for limb in sorted(stance.robot.limbs):
        index = prepared.limbs.index(limb) if limb in prepared.limbs else len(stance.hands)
        for change in every_hold(trials, limb):
            wanted.append((limb, change, _hand(trials, change, index)))
    settled = settle_each(stance.robot.hand, [hand for _, _, hand in wanted])
    supports: dict[SettledHand, Support] = {}
    closed = [each for each in settled if isinstance(each, SettledHand)]
    for one, space in zip(closed, wrench_spaces(closed, limits.tendon_tension), strict=True):
        if one not in supports:
            deadline.check(SETTINGS.late)
            supports[one] = Support(space, limits.utilisation)
    body = stance.body.inverse()
    for (limb, said, hand), each in zip(wanted, settled, strict=True):
        if isinstance(each, SettledHand):
            yield _Variant(
                limb, said, hand.pose, supports[each], wrench_transport(body @ hand.pose)
            )
    nothing = np.zeros((6, 6))
    for change in lettings(trials.question):
        yield _Variant(change.limbs[0], change, None, None, nothing)
    for limb in stance.robot.limbs:
        if limb not in prepared.limbs:
            yield _Variant(limb, None, None, None, nothing)


def _reached(trials: Trials, variants: Sequence[_Variant], shifts: Array) -> Mask:
    """Return whether limbs reach their hands (v,) with shifts of the body (s, 3), shape (v, s)."""
    stance = trials.question.stance
    there = [(i, each.limb, each.pose) for i, each in enumerate(variants) if each.pose is not None]
    away, reach = stance.robot.limb_spans(
        stance.body, [limb for _, limb, _ in there], [pose for _, _, pose in there]
    )
    far = np.linalg.norm(away[:, None] - shifts, axis=2)
    found = np.ones((len(variants), len(shifts)), dtype=bool)
    # what is out of reach today may stay so
    found[[i for i, _, _ in there]] = far <= np.maximum(reach[:, None], far[:, :1])
    return found


def _together(variants: Sequence[_Variant]) -> Mask:
    """Return which hands are not where another one is, shape (v, v)."""
    nowhere = np.full(3, np.inf)
    places = np.array([nowhere if v.pose is None else v.pose.position for v in variants])
    with np.errstate(invalid="ignore"):
        near = np.linalg.norm(places[:, None] - places, axis=2) < SETTINGS.hands_apart
    # with a hand elsewhere
    new = np.array(
        [v.change is not None and v.change.kind in ("free_hand", "new_hold") for v in variants]
    )
    return np.asarray(~(near & (new | new[:, None])))


def _hand(trials: Trials, change: Change, index: int) -> HandOnHold:
    """Return a hand as a change has it."""
    return changed(trials.question, change.changes).stance.hands[index]
