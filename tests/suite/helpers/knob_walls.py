"""Small walls of knobs on a slab, and the best climb on one by trying all states."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from functools import cache

import numpy as np

from hand_models.base import Pose
from planner.prepare import hand_space
from planner.reach import body_wrenches, limb_moments, reach_table
from planner.screening import HandParts, ScreeningTable, StanceIndices, WorldHands, solve_stance
from planner.search import Ends, State, Wall
from service.answering import route_of
from service.commands.stances import read_route


@cache
def knob_wall(rows: int = 2, lean: int = 3) -> Wall:
    """Return a wall with rows of knobs for front and rear hands, and bodies up and across it.

    Parameters
    ----------
    rows : int
        Rows of knobs for the front hands, and as many for the rear ones.
    lean : int
        Poses of the body up the slab.
    """
    start = replace(route_of(read_route("knobs")).start, joints=None)
    up = start.body.rotation @ np.array([1.0, 0.0, 0.0])

    def step(hand):
        """Return the spacing of the rows of front and rear hands [m]."""
        return 0.2 if hand.limb.startswith("front") else 0.1

    places = [
        replace(hand, pose=Pose(hand.pose.position + row * step(hand) * up, hand.pose.rotation))
        for hand in start.hands
        for row in range(rows)
    ]
    grid = [(k, y) for k in range(lean) for y in (-0.1, 0.0, 0.1)]
    bodies = [
        Pose(start.body.position + 0.09 * k * up + np.array([0.0, y, 0.0]), start.body.rotation)
        for k, y in grid
    ]
    near = [
        (i, j)
        for i, (k, y) in enumerate(grid)
        for j, (m, z) in enumerate(grid)
        if i < j and abs(k - m) + round(abs(y - z) / 0.1) == 1
    ]
    about = start.body.position
    poses = [each.pose for each in places]
    reach = reach_table(start.robot, poses, bodies)
    parts = HandParts.of(hand_space(start, start.hands[0].limb)[1])
    hands = WorldHands.of([parts] * len(places), poses, about)
    wrenches = body_wrenches(start.robot, bodies, about)
    apart = np.array(
        [[np.linalg.norm(a.position - b.position) > 0.3 for b in poses] for a in poses]
    )
    return Wall(
        robot=start.robot,
        places=tuple(places),
        bodies=tuple(bodies),
        shifts=np.array(near, dtype=np.intp).reshape(-1, 2),
        reach=reach,
        screening=ScreeningTable.of(hands, wrenches, limb_moments(start.robot, reach, bodies)),
        apart=apart,
    )


def factor(wall: Wall, state: State) -> float:
    """Return the load factor of a state by its linear program; −∞ without one."""
    members = np.array(state.members)
    wrench = wall.screening.needed(StanceIndices(np.array([state.body]), members[None]))[0]
    found = solve_stance(wall.screening.hands, members[members >= 0], wrench).factor
    return -np.inf if np.isnan(found) else found


def neighbours(wall: Wall, state: State) -> list[State]:
    """Return the states that are one lift, place or shift away."""
    members, body, reached = list(state.members), state.body, wall.reach.reached
    found = []
    if -1 in members:
        limb = members.index(-1)
        others = [p for p in members if p >= 0]
        for p in np.flatnonzero(reached[:, body, limb]):
            if wall.apart[p, others].all():
                found.append(State(body, (*members[:limb], int(p), *members[limb + 1 :])))
        return found
    for limb in range(len(members)):
        found.append(State(body, (*members[:limb], -1, *members[limb + 1 :])))
    for one, two in wall.shifts.tolist():
        other = {one: two, two: one}.get(body)
        if other is not None and all(reached[p, other, i] for i, p in enumerate(members)):
            found.append(State(other, state.members))
    return found


def ends(wall: Wall, bodies, members=None) -> Ends:
    """Return the end with some bodies, by their indices."""
    mask = np.zeros(len(wall.bodies), dtype=bool)
    mask[bodies] = True
    return Ends(bodies=mask, members=members)


def _starts(wall: Wall, end: Ends) -> list[State]:
    found = []
    for body in np.flatnonzero(end.bodies).tolist():
        if end.members is not None:
            found.append(State(body, end.members))
            continue
        choices = [np.flatnonzero(wall.reach.reached[:, body, i]) for i in range(4)]
        for members in np.array(np.meshgrid(*choices)).reshape(4, -1).T.tolist():
            pairs = [(a, b) for i, a in enumerate(members) for b in members[:i]]
            if all(wall.apart[a, b] for a, b in pairs):
                found.append(State(body, tuple(members)))
    return found


def best_climb(wall: Wall, start: Ends, goal: Ends, blocked=frozenset(), fits=None):
    """Return the shortest climb of the largest least load factor, and that factor, by trying all.

    The factor is -inf, and there are no states, if none leads to the goal.
    """
    known: dict[State, float] = {}

    def solved(state):
        if state not in known:
            known[state] = factor(wall, state) if fits is None or fits(state) else -np.inf
        return known[state]

    def reachable(least):
        """Return each state that is reached at a load factor, with the one before, and the goal."""
        came = {s: None for s in first if solved(s) >= least and (s, s) not in blocked}
        queue = deque(came)
        while queue:
            state = queue.popleft()
            at_goal = goal.bodies[state.body] and -1 not in state.members
            if at_goal and goal.members in (None, state.members):
                return came, state
            for other in neighbours(wall, state):
                whole = (came[state], other) in blocked and -1 in state.members
                if other in came or (state, other) in blocked or whole or solved(other) < least:
                    continue
                came[other] = state
                queue.append(other)
        return came, None

    first = _starts(wall, start)
    reachable(0.0)
    levels = sorted({value for value in known.values() if value > 0.0}, reverse=True)
    low, high = 0, len(levels)
    while low < high:
        middle = (low + high) // 2
        if reachable(levels[middle])[1] is None:
            low = middle + 1
        else:
            high = middle
    if low == len(levels):
        return [], -np.inf
    came, last = reachable(levels[low])
    path = [last]
    while came[path[-1]] is not None:
        path.append(came[path[-1]])
    return path[::-1], levels[low]
