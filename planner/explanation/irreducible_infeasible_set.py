"""Which constraints together leave no loads: an irreducible set of them, by name.

A set of constraints is irreducible if they and the balance of the body have no loads, and have some
as soon as any one of them is left out. It is found by a deletion filter over the constraints that a
proof weighs (Chinneck, Feasibility and Infeasibility in Optimization, ch. 6).

Other constraints may leave no loads, too: there may be many such sets. A constraint without which
all the others have loads is in every one of them.
"""

from __future__ import annotations

from collections.abc import Collection
from itertools import compress
from typing import Final

import numpy as np

from planner.explanation.infeasibility import BODY, WEIGHS, HardRowSystem, Violation, ranked
from planner.programs import UNLIMITED
from planner.result import LimitName

__all__ = ["irreducible_set", "sufficient_alone"]

BROKEN: Final = 1e-7
"""Rows that must be broken by more than this have no loads, in the program's units."""

KEPT: Final = 2e-9
"""Rows that need not be broken by more than this have loads: what the solver's rounding leaves."""

MOST: Final = 24
"""Constraints of a set that are left out one by one; larger sets are not tried."""

RANK: Final = 1e-9
"""Relative size below which singular values of rows are none."""


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
        if first.size > BROKEN:
            return _filtered(system, first)
    return None


def _filtered(system: HardRowSystem, proof: Violation) -> tuple[LimitName, ...] | None:
    """Leave out one constraint after the other, for good where the rest still has no loads."""
    kept = system.weights(proof.direction, proof.multipliers)
    needed = _needed(system, proof, kept)
    for name in reversed(ranked(kept)):
        if name not in kept or name in needed:
            continue
        others = [other for other in kept if other != name]
        trial = system.least_violation(others)
        if trial is None:
            return None
        if trial.size > BROKEN:
            proof = trial
            kept = system.weights(proof.direction, proof.multipliers)
            needed |= _needed(system, proof, kept)
        elif trial.size > KEPT:
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
        a trial shows, which soon leaves few to try.

    Returns
    -------
    tuple of LimitName or None
        In the order of the set. None without a set, or if rounding leaves undecided whether some
        constraints have loads, or if a set of more than `MOST` would have to be tried one by one.
    """
    if not irreducible:
        return irreducible
    others = system.least_violation([n for n in system.constraints if n not in irreducible])
    if others is not None and others.size > BROKEN:
        # what is left is in the way even without all of them
        return ()
    if len(irreducible) > MOST:
        return None
    found, left = [], list(irreducible)
    while left:
        name = left.pop(0)
        trial = system.least_violation([other for other in system.constraints if other != name])
        if trial is None or KEPT < trial.size <= BROKEN:
            return None
        if trial.size <= KEPT:
            found.append(name)
            continue
        weighed = system.weights(trial.direction, trial.multipliers)
        if _prove_alone(system, trial, weighed):
            left = [other for other in left if other in weighed]
    return tuple(found)


def _prove_alone(system: HardRowSystem, proof: Violation, kept: Collection[LimitName]) -> bool:
    """Whether a proof stands on these constraints alone."""
    tied, rows = system.rows_of(kept)
    return system.proves(proof.direction * tied, proof.multipliers * rows)


def _needed(system: HardRowSystem, proof: Violation, kept: Collection[LimitName]) -> set[LimitName]:
    """Return constraints without which the others have loads, as far as a guess shows that.

    The rows that a proof weighs, n = (−d, λ) on M z against r, contradict each other by n · r < 0
    alone. With the row of one constraint moved by −n · r / n_k they agree; those loads z are solved
    for, and count if they also keep to what the others' other rows say.
    """
    tied, mine = system.rows_of(kept)
    rows = mine & (proof.multipliers > WEIGHS)
    M = np.vstack([system.G[tied], system.H[rows]])
    right = np.concatenate([system.goal[tied], system.h[rows]])
    pull = np.concatenate([-proof.direction[tied], proof.multipliers[rows]])
    given = [*[None] * BODY, *compress(system.given, tied[BODY:])]
    owners = [*given, *compress(system.names, rows)]
    tried = [name for name in kept if name in owners]
    moved = [
        max((k for k, owner in enumerate(owners) if owner == name), key=lambda k: abs(pull[k]))
        for name in tried
    ]
    rights = np.repeat(right[:, None], len(tried), axis=1)
    rights[moved, np.arange(len(tried))] -= (pull @ right) / pull[moved]
    loads = np.linalg.pinv(M, rcond=RANK) @ rights
    over = np.vstack(
        [
            np.abs(system.G[tied] @ loads - system.goal[tied, None]),
            system.H[mine] @ loads - system.h[mine, None],
        ]
    )
    whose = [*given, *compress(system.names, mine)]
    found = set()
    for i, name in enumerate(tried):
        others = np.array([owner != name for owner in whose], dtype=bool)
        small = np.abs(loads[:, i]).max(initial=0.0) <= UNLIMITED
        if small and over[others, i].max(initial=0.0) <= KEPT:
            found.add(name)
    return found
