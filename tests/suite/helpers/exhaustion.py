"""All climbs of a small wall: every program solved by HiGHS, and a plain widest path."""

import heapq
from itertools import combinations, product

import numpy as np

from planner.screening import StanceIndices, solve_stance
from planner.search import State


def all_states(wall):
    """Every state with all limbs, or all but one, on the rock."""
    reached, limbs = wall.reach.reached, wall.reach.entry.shape[2]
    found = []
    for body in range(len(wall.bodies)):
        own = [np.flatnonzero(reached[:, body, limb]).tolist() for limb in range(limbs)]
        for lifted in range(limbs + 1):
            choices = [[-1] if limb == lifted else own[limb] for limb in range(limbs)]
            for members in product(*choices):
                on = [p for p in members if p >= 0]
                if all(wall.apart[p, q] for p, q in combinations(on, 2)):
                    found.append(State(body, members))
    return found


def all_factors(wall):
    """The load factor of every state, by HiGHS; −∞ where there is none."""
    table, found = wall.screening, {}
    for state in all_states(wall):
        members = np.array(state.members)
        (wrench,) = table.needed(StanceIndices(np.array([state.body]), members[None]))
        factor = solve_stance(table.hands, members[members >= 0], wrench).factor
        found[state] = -np.inf if np.isnan(factor) else factor
    return found


def best_of_all(wall, start, goal, factors, blocked=frozenset()):
    """The largest least load factor of all climbs."""
    beside = {body: set() for body in range(len(wall.bodies))}
    for a, b in np.asarray(wall.shifts).tolist():
        beside[a].add(b)
        beside[b].add(a)
    reached = wall.reach.reached

    def at(end, state):
        fits = end.members is None or tuple(end.members) == state.members
        return -1 not in state.members and bool(end.bodies[state.body]) and fits

    def moves(state):
        body, members = state
        if -1 in members:
            limb = members.index(-1)
            for p in np.flatnonzero(reached[:, body, limb]).tolist():
                yield State(body, (*members[:limb], p, *members[limb + 1 :]))
            return
        for limb in range(len(members)):
            yield State(body, (*members[:limb], -1, *members[limb + 1 :]))
        for other in beside[body]:
            yield State(other, members)

    least = {}
    queue = [(-factors[state], state) for state in factors if at(start, state)]
    heapq.heapify(queue)
    while queue:
        value, state = heapq.heappop(queue)
        if state in least or value == np.inf or (state, state) in blocked:
            continue
        least[state] = -value
        if at(goal, state):
            return -value
        for after in moves(state):
            if after in factors and after not in least and (state, after) not in blocked:
                heapq.heappush(queue, (max(value, -factors[after]), after))
    return -np.inf
