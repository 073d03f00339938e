"""The best climb without a lift: the body alone is shifted from the start to the goal."""

from __future__ import annotations

import heapq
from math import prod

import numpy as np
import scipy
from numpy.typing import NDArray

from hand_models.base import Indices, LimitError
from planner.screening import ScreeningTable, StanceIndices
from planner.search.lifts import Ground
from planner.search.programs import Programs
from planner.search.settings import SEARCH_SETTINGS
from planner.search.wall import State

__all__ = ["standing_climb"]


def standing_climb(
    ground: Ground, table: ScreeningTable, programs: Programs
) -> tuple[float, tuple[State, ...]]:
    """Return the largest least load factor of climbs without a lift, and such a climb.

    Only what looks best under the bounds of the table is solved. Every other climb without a lift
    then has a state with a smaller load factor, or a bound of it.

    Parameters
    ----------
    ground : Ground
    table : ScreeningTable
    programs : Programs
        Gets the programs that are solved.

    Returns
    -------
    least : float
        −∞ if there is no such climb.
    route : tuple of State

    Raises
    ------
    LimitError
        If too many placements of the hands would have to be looked at.
    """
    members = _through(ground)
    on, (first, last) = ground.reached, (np.asarray(end.bodies, dtype=bool) for end in ground.ends)
    limbs = np.arange(on.shape[2])
    queue, before = list[tuple[float, bool, int, int, int]](), dict[tuple[int, int], int]()
    bounds = dict[tuple[int, int], float]()
    of_limbs = on[members[:, :, None], np.arange(on.shape[1]), limbs[:, None]]
    stays: NDArray[np.bool_] = np.logical_and.reduce(of_limbs, axis=1)
    which, body = np.nonzero(stays)
    values = table.bounds(StanceIndices(body, members[which]))
    for i, b, value in zip(which.tolist(), body.tolist(), values.tolist(), strict=True):
        bounds[i, b] = value
        if first[b]:
            heapq.heappush(queue, (-value, True, i, b, -1))
    while queue:
        negative, bounded, i, b, came = heapq.heappop(queue)
        if (i, b) in before or negative == np.inf:
            continue
        state = State(b, tuple(members[i].tolist()))
        if bounded:
            value = min(-negative, programs.stance(state))
            heapq.heappush(queue, (-value, False, i, b, came))
            continue
        before[i, b] = came
        if last[b]:
            route = [b]
            while route[-1] >= 0:
                route.append(before[i, route[-1]])
            return -negative, tuple(State(each, state.members) for each in route[-2::-1])
        for other in np.flatnonzero(ground.beside[b] & stays[i]).tolist():
            if (i, other) not in before:
                value = min(-negative, bounds[i, other])
                heapq.heappush(queue, (-value, True, i, other, b))
    return -np.inf, ()


def _through(ground: Ground) -> Indices:
    """Return the placements of all limbs that may be kept from the start to the goal, (n, L)."""
    at, limb, body = np.nonzero(np.moveaxis(ground.reached, 1, 2))
    index = np.full((*ground.reached.shape[::2], ground.reached.shape[1]), -1)
    index[at, limb, body] = np.arange(len(at))
    one, other = np.nonzero(ground.beside)
    joined = np.array([index[..., one].ravel(), index[..., other].ravel()])
    joined = joined[:, (joined >= 0).all(axis=0)]
    graph = scipy.sparse.coo_array((np.ones(joined.shape[1]), joined), shape=(len(at),) * 2)
    _, part = scipy.sparse.csgraph.connected_components(graph, directed=False)
    touched = []
    for end, fixed in zip(ground.ends, ground.fixed, strict=True):
        ends_here: NDArray[np.bool_] = np.asarray(end.bodies, dtype=bool)[body]
        ends_here &= (fixed[limb] < 0) | (fixed[limb] == at)
        touched.append(np.isin(part, part[ends_here]))
    both = touched[0] & touched[1]
    choices = [np.unique(at[both & (limb == each)]) for each in range(index.shape[1])]
    if prod(map(len, choices)) > SEARCH_SETTINGS.most_standing:
        raise LimitError(
            f"the start and the goal are so near each other that more than "
            f"{SEARCH_SETTINGS.most_standing} stances may lead from one to the other without a "
            "lift; give one of them as a stance, or put them farther apart"
        )
    found = np.array(np.meshgrid(*choices, indexing="ij")).reshape(len(choices), -1).T
    pairs = np.triu_indices(len(choices), 1)
    free = ground.wall.apart[found[:, pairs[0]], found[:, pairs[1]]].all(axis=1)
    return np.ascontiguousarray(found[free].astype(np.intp))
