"""Directions of all states, learnt from the lifts of a wall that look best."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hand_models.base import Indices
from planner.screening import ScreeningTable, StanceIndices
from planner.search.lifts import Ground
from planner.search.programs import Programs
from planner.search.settings import SEARCH_SETTINGS

__all__ = ["learnt", "some_lifts"]


def some_lifts(ground: Ground, count: int) -> StanceIndices:
    """Return random lifts of a wall, about as many as asked for, each limb's reach alike."""
    _, bodies, limbs = ground.reached.shape
    placements, first = ground.candidates
    sizes = np.diff(first).reshape(bodies, limbs).astype(float)
    rng = np.random.default_rng(0)
    found_bodies, found = list[Indices](), list[Indices]()
    for lifted in range(limbs):
        others = [limb for limb in range(limbs) if limb != lifted]
        choices = sizes[:, others].prod(axis=1)
        if not choices.any():
            continue
        chosen = rng.choice(bodies, count // limbs, p=choices / choices.sum())
        members = np.full((len(chosen), limbs), -1, dtype=np.intp)
        fits = np.ones(len(chosen), dtype=bool)
        for i, limb in enumerate(others):
            at = chosen * limbs + limb
            picked = (rng.random(len(chosen)) * (first[at + 1] - first[at])).astype(np.intp)
            members[:, limb] = placements[first[at] + picked]
            for other in others[:i]:
                fits &= ground.wall.apart[members[:, other], members[:, limb]]
        found_bodies.append(chosen[fits])
        found.append(members[fits])
    return StanceIndices(np.concatenate(found_bodies), np.concatenate(found))


def learnt(
    table: ScreeningTable,
    programs: Programs,
    lifts: StanceIndices,
    count: int,
    check: Callable[[], None],
) -> ScreeningTable:
    """Return a table with up to so many directions more: those of the lifts that look best.

    Parameters
    ----------
    table : ScreeningTable
    programs : Programs
    lifts : StanceIndices
    count : int
    check : callable
        Called again and again; what it raises ends the learning.
    """
    ends, slack = table.ends(lifts), 1.0 + SEARCH_SETTINGS.exact
    solved = np.zeros(len(lifts.bodies), dtype=bool)
    together = 16
    while count > 0:
        check()
        bounds = np.where(solved | (ends[:, 0] > ends[:, 1] * slack), -np.inf, ends[:, 1])
        size = min(together, count, len(bounds))
        best = np.argpartition(-bounds, size - 1)[:size] if size else np.zeros(0, dtype=np.intp)
        best = best[np.isfinite(bounds[best])]
        if not len(best):
            break
        solved[best] = True
        found = programs.solve(lifts.bodies[best], lifts.members[best])
        new = found.directions[found.directions.any(axis=1)]
        table = table.extended(new)
        lower, upper = table.latest(len(new)).ends(lifts).T
        ends[:, 0], ends[:, 1] = np.maximum(ends[:, 0], lower), np.minimum(ends[:, 1], upper)
        count -= max(1, len(new))
    return table
