"""The check of one stance's plans, for one body wrench after the other: `check`, prepared.

Every load of a hand with a fixed wrist is affine in what its plan chooses: tensions, lateral
reactions, nails' pulls, the palm's loads. For a stance that stays, the check's own numbers are
worked out once, without loads and for each newton of one: what must be zero, and is so for these,
is zero for all loads. A plan is then checked by one matrix, and by what is not affine: Eq. 21's
curve, and the force that a hand holds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate, pairwise
from typing import Final

import numpy as np

from hand_models.base import Array, Indices
from hand_models.fixed_wrist import PALM_PRESSING, PALM_SHEAR
from hand_models.hand import FINGERS, NAIL
from planner.prepare import BALL
from planner.result import LoadRecovery, PlanArrays
from planner.verification.check import BALANCE, Check
from planner.verification.joint_balance import LEVER
from planner.verification.limbs import ARM, JointUse, force_use
from planner.verification.recomputation import LimitCurves, held_by
from planner.verification.sentences import LOAD, NEAR, SIGNED, STOP, STOPS, UTILISATION

__all__ = ["LoadsCheck"]

FILL: Final = {6: np.inf, 7: np.inf, 8: -np.inf, 9: -np.inf}
"""Numbers, by their place among all, of which a hand that has fewer has none that are wrong."""

most = np.maximum.reduce


class LoadsCheck:
    """What loads of a stance do, checked for any body wrench.

    Parameters
    ----------
    check : Check
        Of plans of the stance, with fixed wrists alone and a body wrench; without present tensions.
    reader : LoadRecovery
        Reads the loads of its hands.
    columns : sequence of tuple of str
        Names of each hand's loads y.

    Attributes
    ----------
    wrong : list of str
        What is wrong with the stance, whatever its loads.
    idle : float
        Of their joints' torques, what limbs without a hand use.
    """

    def __init__(
        self, check: Check, reader: LoadRecovery, columns: Sequence[tuple[str, ...]]
    ) -> None:
        known, question = check.known, check.question
        self._check, self._reader, self._columns = check, reader, columns
        self.wrong: list[str] = []
        self.idle = 0.0
        places = question.stance.hands
        self._given = [
            (i, j, value)
            for i, place in enumerate(places)
            for j, value in enumerate(place.wrench or ())
            if value is not None
        ]
        caps = [question.limits.per_hand.get(place.limb) for place in places]
        self._capped = [
            i for i, cap in enumerate(caps) if cap is not None and not isinstance(cap.most, tuple)
        ]
        size = max(map(len, columns))
        self._stack([self._numbers(y) for y in np.eye(size + 1, size, k=-1)])
        carries = check.carry.reshape(6, len(places), 6).transpose(1, 0, 2)
        self._body = np.hstack([*(carries @ self._matrix[:, self._wrench])])
        self._from_rest = check.carry @ self._constant[:, self._wrench].ravel()
        touching = known.touch.touching
        shares = self._by_hand(known.engagement[touching, None], known.places.hand[touching], 1.0)
        of_tile = np.repeat(np.arange(len(places)), shares.shape[1])
        self._curves = LimitCurves([hand.surface for hand in known.hands], of_tile, shares.ravel())

    # Rows ---------------------------------------------------------------------------------------

    def _numbers(self, y: Array) -> list[tuple[Array, Indices]]:
        """Return the check's numbers of loads, the same y of each hand, and whose each is.

        Shear, normal and lateral load of each tile on rock; loads of palms; wrenches on the rock;
        what hands hold along `HELD`; what may not be below zero; what presses on joints' stops;
        what is used of half-planes, and of all other limits.
        """
        check, known, question = self._check, self._check.known, self._check.question
        arrays = self._reader.read([y[: len(names)] for names in self._columns])[0]
        assert question.body_wrench is not None
        joints = check.joints(self.wrong, arrays.wrenches, question.body_wrench)
        again = check.again.of([], arrays, check.asked_for([], arrays, joints))
        named = np.array([y * (np.arange(len(y)) < len(names)) for names in self._columns])
        error = max(again.error, LEVER * float(np.abs(self.loads_of(arrays) - named).max()))
        # each load adds an error in proportion to it, and that without loads
        if not 2.0 * (1.0 + len(y)) * error <= NEAR or any(again.contacts()):
            self.wrong.append("what loads do to the hands")

        fingers, tiles, palms = again.shares
        touching, owners = known.touch.touching, again.owners()
        each, on_rock = owners["hands"], known.places.hand[touching]
        kinds = zip(again.signed(), SIGNED, strict=True)
        signs = [(values, owners[whose]) for values, (_, whose) in kinds]
        stops = signs.pop(STOPS)
        used = [
            (fingers, owners["fingers"]),
            (palms, each),
            (again.along / known.hands[0].hand.structure.hand_load, each),
            (again.nails.used, owners["nails"]),
        ]
        for h, place in enumerate(question.stance.hands):
            capped, none = force_use([], question, place, again.wrenches[h], math.inf)
            use = joints.pop(place.limb, JointUse(capped[:0], {}))
            passive = np.array([*use.passive.values()]) / ARM
            used.append((np.concatenate((capped, use.shares, -use.shares))[None], each[[h]]))
            signs.append((np.concatenate((-none, passive, -passive))[None], each[[h]]))
        self.idle = max((float(np.abs(use.shares).max()) for use in joints.values()), default=0.0)
        parts = [
            *([(own, on_rock)] for own in arrays.loads[touching].T),
            [(arrays.palms[:, ::2], each)],
            [(again.wrenches, each)],
            [(again.along, each)],
            signs,
            [stops],
            [(tiles[touching] / known.engagement[touching, None], on_rock)],
            used,
        ]
        return [_flat(part) for part in parts]

    def _stack(self, numbers: Sequence[Sequence[tuple[Array, Indices]]]) -> None:
        """Put the numbers without loads, and per newton, into a matrix of each hand.

        It is filled up with rows that are never wrong.
        """
        parts = []
        for i, (rest, hand) in enumerate(numbers[0]):
            slopes = [loaded[i][0] - rest for loaded in numbers[1:]]
            parts.append(self._by_hand(np.column_stack([rest, *slopes]), hand, FILL.get(i, 0.0)))
        rows = np.concatenate(parts, axis=1)
        self._constant, self._matrix = rows[:, :, 0].copy(), rows[:, :, 1:].copy()
        ends = accumulate((part.shape[1] for part in parts), initial=0)
        slices = [slice(*pair) for pair in pairwise(ends)]
        self._shear, self._normal, self._lateral, palm, self._wrench, self._held = slices[:6]
        self._signs, self._stops, self._planes, others = slices[6:]
        self._carried, self._used = slice(0, palm.stop), slice(self._planes.start, others.stop)

    def _by_hand(self, rows: Array, hand: Indices, missing: float) -> Array:
        """Return rows (n, k) as those of each hand, shape (hands, most, k), filled up."""
        counts = np.bincount(hand, minlength=len(self._columns))
        found = np.zeros((len(counts), counts.max(), rows.shape[1]))
        found[:, :, 0] = missing
        for h, count in enumerate(counts):
            found[h, :count] = rows[hand == h]
        return found

    def loads_of(self, arrays: PlanArrays) -> Array:
        """Return the loads (hands, m) of a plan's numbers, by their names."""
        places = self._check.known.places
        first, ends = places.first_of_finger, [*places.first_of_finger[1:], len(arrays.loads)]
        kinds = {
            "tension": arrays.tensions,
            "lateral": np.add.reduceat(arrays.loads[:, 2], first),
            NAIL: arrays.loads[np.array(ends) - 1, 0],
        }
        found = np.zeros((len(self._columns), max(map(len, self._columns))))
        for h, (row, names, palm) in enumerate(
            zip(found, self._columns, arrays.palms, strict=True)
        ):
            by_name = {PALM_SHEAR: -palm[0], PALM_PRESSING: palm[2]}
            for kind, values in kinds.items():
                own = values[len(FINGERS) * h :]
                by_name |= {f"{name}/{kind}": own[i] for i, name in enumerate(FINGERS)}
            row[: len(names)] = [by_name[name] for name in names]
        return found

    # Checking -----------------------------------------------------------------------------------

    def fault(
        self, loads: Array, wrenches: Array, utilisation: float, body_wrench: Array
    ) -> str | None:
        """Return what is wrong with a plan's numbers; None if nothing is.

        Parameters
        ----------
        loads : ndarray, shape (hands, m)
            y of each hand, filled up with zeros [N].
        wrenches : ndarray, shape (hands, 6)
            On the rock, in each H.
        utilisation : float
            Of the whole stance, limbs without a hand included.
        body_wrench : ndarray, shape (6,)
            In B.
        """
        found = (self._matrix @ loads[:, :, None])[:, :, 0]
        found += self._constant
        own, used = found[:, self._wrench], found[:, self._used]
        largest = max(1.0, float(most(np.abs(found[:, self._carried]), axis=None)))
        allowed = LOAD * largest
        size = math.sqrt(float(body_wrench @ body_wrench))
        off = self._body @ loads.ravel()
        off += self._from_rest
        off -= body_wrench
        again = max(float(most(used, axis=None)), 0.0, self.idle)
        if self.wrong:
            return self.wrong[0]
        # each in terms that are false where a number is not finite
        if not math.sqrt(float(off @ off)) <= BALANCE * max(size, 1.0):
            return "the balance"
        if not float(most(np.abs(own - wrenches), axis=None)) <= allowed:
            return "a hand's wrench"
        signs, stops = found[:, self._signs], found[:, self._stops]
        if not ((signs >= -allowed).all() and (stops >= -STOP).all()):
            return "a load of the wrong sign"
        if not abs(again - utilisation) <= UTILISATION * max(1.0, again):
            return "the utilisation"
        if not (held_by(own[:, :3]) <= most(found[:, self._held], axis=1) + allowed).all():
            return "what a hand holds"
        for h, i, value in self._given:
            if not abs(own[h, i] - value) <= allowed:
                return "a wrench that is given"
        for h in self._capped:
            if not np.linalg.norm(own[h, :3]) <= (BALL @ own[h, :3]).max() + allowed:
                return "a force that is capped"
        return self._outside(found, allowed)

    def _outside(self, found: Array, allowed: float) -> str | None:
        """Say whether a tile is outside Eq. 21's surface, though within its half-planes."""
        shear, normal = found[:, self._shear].ravel(), found[:, self._normal].ravel()
        lateral = found[:, self._lateral].ravel()
        inside = self._curves.excess(shear, normal, lateral, UTILISATION) <= allowed
        if not inside.all():
            # beyond its half-planes a tile may be outside the surface, too
            used = most(found[:, self._planes].reshape(len(inside), -1), axis=1)
            if (used[~inside] <= 1.0).any():
                return "a tile's limit curve"
        return None


def _flat(parts: Sequence[tuple[Array, Indices]]) -> tuple[Array, Indices]:
    """Return numbers (n, …) of hands (n,) one after another, and whose each is."""
    values = [own.ravel() for own, _ in parts]
    hands = [hand.repeat(own.size // max(len(own), 1)) for own, hand in parts]
    return np.concatenate(values), np.concatenate(hands)
