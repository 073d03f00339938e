"""Which constraints together leave no loads: an irreducible set of them, by name.

A set of constraints is irreducible if they and the balance of the body have no loads, and have some
as soon as any one of them is left out. It is found by a deletion filter over the constraints that a
proof weighs (Chinneck, Feasibility and Infeasibility in Optimization, ch. 6).

Other constraints may leave no loads, too: there may be many such sets. A constraint without which
all the others have loads is in every one of them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Final, NamedTuple

import numpy as np
from scipy.optimize import nnls

from hand_models.base import Array, Indices
from planner.explanation.farkas_program import Multipliers
from planner.explanation.infeasibility import BODY, WEIGHS, Chosen, HardRowSystem, ranked
from planner.programs import UNLIMITED
from planner.result import LimitName

__all__ = ["irreducible_set", "sufficient_alone"]

BROKEN: Final = 1e-7
"""Rows that must be broken by more than this have no loads, in the program's units."""

KEPT: Final = 2e-9
"""Rows that need not be broken by more than this have loads: what the solver's rounding leaves."""

MOST: Final = 24
"""Constraints of a set that are left out one by one; larger sets are not tried."""

RANK: Final = 1e-4
"""Relative size below which singular values of rows are none: loads would be beyond the box."""


def irreducible_set(
    system: HardRowSystem, suspects: Collection[LimitName]
) -> tuple[LimitName, ...] | None:
    """Return constraints that with the balance have no loads, and all of which it takes for that.

    Parameters
    ----------
    system : HardRowSystem
    suspects : collection of LimitName
        Among which such a set is sought; among all constraints if these have loads.

    Returns
    -------
    tuple of LimitName or None
        The weightiest first; empty if the balance alone has no loads. None if rounding leaves
        undecided whether some constraints have loads.
    """
    for start in (suspects, system.constraints):
        first = system.least_violation(start)
        if first is None:
            return None
        if first.gain > BROKEN:
            return _filtered(system, first)
    return None


def _filtered(system: HardRowSystem, proof: Multipliers) -> tuple[LimitName, ...] | None:
    """Leave out one constraint after the other, for good where the rest still has no loads."""
    kept = system.weights(proof.direction, proof.multipliers)
    needed = _needed(system, proof, kept, kept)
    for name in reversed(ranked(kept)):
        if name not in kept or name in needed:
            continue
        others = [other for other in kept if other != name]
        trial = system.least_violation(others)
        if trial is None:
            return None
        if trial.gain > BROKEN:
            proof = trial
            kept = system.weights(proof.direction, proof.multipliers)
            needed |= _needed(system, proof, kept, kept.keys() - needed)
        elif trial.gain > KEPT:
            return None
    return tuple(ranked(kept)) if _prove_alone(system, proof, kept) else None


def sufficient_alone(
    system: HardRowSystem, irreducible: tuple[LimitName, ...] | None
) -> tuple[LimitName, ...] | None:
    """Return the constraints without any one of which all the others have loads.

    Parameters
    ----------
    system : HardRowSystem
        All constraints together have none.
    irreducible : tuple of LimitName or None
        Some irreducible set: only its members can do. So it is with those of every other set that
        a trial shows, which soon leaves few to try. They are tried together, and by halves.

    Returns
    -------
    tuple of LimitName or None
        In the order of the set. None without a set, or if rounding leaves undecided whether some
        constraints have loads, or if a set of more than `MOST` would have to be tried one by one.
    """
    if not irreducible:
        return irreducible
    found, left, groups = set(), set(irreducible), [irreducible]
    while groups:
        group = [name for name in groups.pop() if name in left]
        if not group:
            continue
        trial = system.least_violation(name for name in system.constraints if name not in group)
        if trial is None:
            return None
        if trial.gain > BROKEN:
            # what is left is in the way even without all of them
            left.difference_update(group)
            weighed = system.weights(trial.direction, trial.multipliers)
            if _prove_alone(system, trial, weighed):
                left.intersection_update(weighed)
        elif len(group) > MOST:
            return None
        elif len(group) > 1:
            half = len(group) // 2
            groups += [tuple(group[half:]), tuple(group[:half])]
        elif trial.gain > KEPT:
            return None
        else:
            found.update(group)
    return tuple(name for name in irreducible if name in found)


def _prove_alone(system: HardRowSystem, proof: Multipliers, kept: Collection[LimitName]) -> bool:
    """Whether a proof stands on these constraints alone."""
    tied, rows = system.rows_of(kept)
    return system.proves(proof.direction * tied, proof.multipliers * rows)


def _needed(
    system: HardRowSystem,
    proof: Multipliers,
    kept: Collection[LimitName],
    tried: Iterable[LimitName],
) -> set[LimitName]:
    """Return those tried without which the others kept have loads, as far as guesses show that.

    Guessed are loads that keep to what the proof weighs of the others, then to all their rows.
    """
    tied, mine = system.rows_of(kept)
    whole = _Rows.of(system, tied, mine)
    left = {system.constraints.index(name): name for name in tried}
    found: set[LimitName] = set()
    for rows in (mine & (proof.multipliers > WEIGHS), mine):
        part = _Rows.of(system, tied, rows).split()
        shown = [place for place in left if whole.hold(part.loads(place), place)]
        found.update(map(left.pop, shown))
    return found


class _Rows(NamedTuple):
    """Rows M z ≤ r of which the first are equations, and whose each is."""

    M: Array
    right: Array
    equations: int
    whose: Indices

    @classmethod
    def of(cls, system: HardRowSystem, tied: Chosen, rows: Chosen) -> _Rows:
        """Return some of a system's."""
        limits, given = np.split(system.owners, [len(system.h)])
        return cls(
            np.vstack([system.G[tied], system.H[rows]]),
            np.concatenate([system.goal[tied], system.h[rows]]),
            int(tied.sum()),
            np.concatenate([np.full(BODY, -1), given[tied[BODY:]], limits[rows]]),
        )

    def hold(self, loads: Array | None, but: int) -> bool:
        """Whether loads are in the box, and keep to all rows but those of one constraint."""
        if loads is None or np.abs(loads).max(initial=0.0) > UNLIMITED:
            return False
        over = self.M @ loads - self.right
        over[: self.equations] = np.abs(over[: self.equations])
        return bool(over[self.whose != but].max(initial=0.0) <= KEPT)

    def split(self) -> _Split:
        """Tell what rows say of each other from what they say of loads."""
        left, sizes, across = np.linalg.svd(self.M)
        rank = int((sizes > RANK * sizes.max(initial=0.0)).sum())
        inverse = (across[:rank].T / sizes[:rank]) @ left[:, :rank].T
        return _Split(self, left[:, rank:].T, inverse)


class _Split(NamedTuple):
    """Rows, all N that they say of each other, N M = 0, and the inverse of the rest.

    Loads with slack s, M z = r − s, are there if N (r − s) is zero: few nonnegative unknowns, of
    which a least-squares problem (Lawson and Hanson) finds as many as there are rows of N.
    """

    rows: _Rows
    N: Array
    inverse: Array

    def loads(self, without: int) -> Array | None:
        """Return the smallest loads of rows but those of one constraint; None if there are none.

        Slack of its rows may have any sign.
        """
        freed = self.rows.whose == without
        bound = ~freed
        bound[: self.rows.equations] = False
        columns = self.N[:, bound], self.N[:, freed], -self.N[:, freed]
        try:
            shares, missing = nnls(np.hstack(columns), self.N @ self.rows.right)
        except RuntimeError:  # it has come to no end
            return None
        slack, ends = np.zeros(len(freed)), np.cumsum([bound.sum(), freed.sum()])
        above, more, less = np.split(shares, ends)
        slack[bound], slack[freed] = above, more - less
        return np.asarray(self.inverse @ (self.rows.right - slack)) if missing <= KEPT else None
