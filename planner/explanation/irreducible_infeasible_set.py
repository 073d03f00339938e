"""Find an irreducible infeasible subset (IIS) of a stance's constraints, by name.

Constraints form such a subset if they and the body's balance are infeasible, and become feasible as
soon as any one of them is left out. The subset is found by a deletion filter over the constraints
that a Farkas certificate weighs (Chinneck, Feasibility and Infeasibility in Optimization, ch. 6).

A stance may have many such subsets. A constraint without which all others are feasible is in every
one of them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from typing import NamedTuple

import numpy as np
import scipy

from hand_models.base import Array, Indices
from planner.explanation.active_limits import TOLERANCES
from planner.explanation.infeasibility import BODY_ROWS, Chosen, HardRowSystem, Multipliers, ranked
from planner.result import LimitName

__all__ = ["balance_alone", "blocks_up_to", "irreducible_set", "sufficient_alone"]


def balance_alone(system: HardRowSystem) -> bool:
    """Return whether the body's balance is infeasible even without any other constraint.

    The irreducible infeasible subset is then empty.
    """
    found = system.least_violation(())
    return found is not None and found.gain > TOLERANCES.broken and _prove_alone(system, found, ())


def irreducible_set(
    system: HardRowSystem, suspects: Collection[LimitName]
) -> tuple[LimitName, ...] | None:
    """Return constraints that are infeasible together, but feasible without any one of them.

    Parameters
    ----------
    system : HardRowSystem
        Named constraints of the stance.
    suspects : collection of LimitName
        Constraints among which the subset is sought; all constraints if these are feasible.

    Returns
    -------
    tuple of LimitName or None
        The constraint with the largest weight first; empty if the balance alone is infeasible. None
        if rounding leaves the feasibility of some constraints undecided, or the deadline has
        expired.
    """
    for start in (suspects, system.constraints):
        first = system.least_violation(start)
        if first is None:
            return None
        if first.gain > TOLERANCES.broken:
            return _filtered(system, first)
    return None


def _filtered(system: HardRowSystem, proof: Multipliers) -> tuple[LimitName, ...] | None:
    """Leave out one constraint after the other, for good where the rest still has no loads."""
    kept = system.weights(proof.direction, proof.multipliers)
    needed = _needed(system, kept, proof.multipliers > TOLERANCES.weighing_multiplier, kept)
    for name in reversed(ranked(kept)):
        if name not in kept or name in needed:
            continue
        others = [other for other in kept if other != name]
        trial = system.least_violation(others)
        if trial is None:
            return None
        if trial.gain > TOLERANCES.broken:
            proof = trial
            kept = system.weights(proof.direction, proof.multipliers)
        elif trial.gain > TOLERANCES.kept and not _needed(
            system, kept, np.ones_like(system.h, bool), [name]
        ):
            return None
    return tuple(ranked(kept)) if _prove_alone(system, proof, kept) else None


def blocks_up_to(system: HardRowSystem, names: Collection[LimitName]) -> float:
    """Return the load size |z| up to which infeasible constraints are proven infeasible.

    Parameters
    ----------
    system : HardRowSystem
        Named constraints of the stance.
    names : collection of LimitName
        Infeasible constraints.

    Returns
    -------
    float
        Nondimensional; at least the system's box, infinite if the proof needs no box.
    """
    proof = system.least_violation(names)
    if proof is None:
        return system.box
    tied, rows = system.rows_of(names)
    return max(system.proven_up_to(proof.direction * tied, proof.multipliers * rows), system.box)


def sufficient_alone(
    system: HardRowSystem, irreducible: tuple[LimitName, ...] | None
) -> tuple[LimitName, ...] | None:
    """Return the constraints whose removal, one at a time, makes all others feasible.

    Parameters
    ----------
    system : HardRowSystem
        Named constraints of the stance, infeasible together.
    irreducible : tuple of LimitName or None
        An irreducible infeasible subset: only its members can suffice. Each proof that turns up
        narrows them further. They are tried together, then by halves.

    Returns
    -------
    tuple of LimitName or None
        Constraints in the order of ``irreducible``. None if that is None, if rounding or a deadline
        leaves the answer undecided, or if more than 24 members would have to be tried one by one.
    """
    if not irreducible:
        return irreducible
    found: set[LimitName] = set()
    left, groups = set(irreducible), [irreducible]
    while groups:
        group = [name for name in groups.pop() if name in left]
        if not group:
            continue
        trial = system.least_violation_without(group)
        if trial is None:
            return None
        if trial.gain > TOLERANCES.broken:
            # what is left is in the way even without all of them
            left.difference_update(group)
            weighed = system.weights(trial.direction, trial.multipliers)
            if _prove_alone(system, trial, weighed):
                left.intersection_update(weighed)
        elif len(group) > 24:  # of a larger set they are not left out one by one
            return None
        elif len(group) > 1:
            half = len(group) // 2
            groups += [tuple(group[half:]), tuple(group[:half])]
        elif trial.gain > TOLERANCES.kept:
            return None
        else:
            found.update(group)
    return tuple(name for name in irreducible if name in found)


def _prove_alone(system: HardRowSystem, proof: Multipliers, kept: Collection[LimitName]) -> bool:
    """Return whether a proof stands on these constraints alone."""
    tied, rows = system.rows_of(kept)
    return system.proves(proof.direction * tied, proof.multipliers * rows)


def _needed(
    system: HardRowSystem, kept: Collection[LimitName], counted: Chosen, names: Iterable[LimitName]
) -> set[LimitName]:
    """Return those of some names without which the others kept have loads, as guesses show that.

    Guessed are loads that keep to the hard rows that are counted, shape (n,); they count if they
    keep to all rows of the others.
    """
    places = {system.constraints.index(name): name for name in names}
    _, mine = system.rows_of(kept)
    whole = _Rows.of(system, kept, mine)
    guesses = _Rows.of(system, kept, mine & counted).loads_without(places)
    return {places[place] for place, loads in guesses if whole.hold(loads, place)}


class _Rows(NamedTuple):
    """Rows M z ≤ r, the first `BODY_ROWS` of them equations, and which constraint each is.

    A given wrench's rows are there twice, with either sign.
    """

    M: Array
    right: Array
    whose: Indices
    box: float

    @classmethod
    def of(cls, system: HardRowSystem, kept: Collection[LimitName], rows: Chosen) -> _Rows:
        """Return the balance, given wrenches that are kept, and some hard rows."""
        tied, _ = system.rows_of(kept)
        G, goal = system.G[tied], system.goal[tied]
        limits, given = np.split(system.owners, [len(system.h)])
        held = given[tied[BODY_ROWS:]]
        return cls(
            np.vstack([G, -G[BODY_ROWS:], system.H[rows]]),
            np.concatenate([goal, -goal[BODY_ROWS:], system.h[rows]]),
            np.concatenate([np.full(BODY_ROWS, -1), held, held, limits[rows]]),
            system.box,
        )

    def hold(self, loads: Array, but: int) -> bool:
        """Return whether loads are in the box, and keep to all rows but those of one constraint."""
        over = self.M @ loads - self.right
        over[:BODY_ROWS] = np.abs(over[:BODY_ROWS])
        over[self.whose == but] = 0.0
        small = np.abs(loads).max(initial=0.0) <= self.box
        return bool(small and over.max() <= TOLERANCES.kept)

    def loads_without(self, places: Iterable[int]) -> Iterator[tuple[int, Array]]:
        """Yield loads of all rows but those of one constraint after the other, if there are any.

        With N all that the rows say of each other, N M = 0, there are loads with slack s,
        M z = r − s, if N (r − s) is zero: a least-squares problem in nonnegative unknowns (Lawson
        and Hanson), of few equations. Slack of what is left out may have either sign. The loads are
        the smallest.
        """
        left, sizes, across = np.linalg.svd(self.M)
        least = 1e-4  # relative: loads of smaller singular values would be beyond the box
        rank = int((sizes > least * sizes.max(initial=0.0)).sum())
        N, inverse = left[:, rank:].T, (across[:rank].T / sizes[:rank]) @ left[:, :rank].T
        missing, above = N @ self.right, N[:, BODY_ROWS:]
        if not len(N):  # on no equations SciPy's nnls may end the process
            loads = inverse @ self.right
            yield from ((place, loads) for place in places)
            return
        for place in places:
            (freed,) = (self.whose == place).nonzero()
            try:
                shares, _ = scipy.optimize.nnls(np.hstack([above, -N[:, freed]]), missing)
            except RuntimeError:  # it has come to no end
                continue
            if not np.isfinite(shares).all():
                continue
            slack = np.append(np.zeros(BODY_ROWS), shares[: above.shape[1]])
            slack[freed] -= shares[above.shape[1] :]
            yield place, inverse @ (self.right - slack)
