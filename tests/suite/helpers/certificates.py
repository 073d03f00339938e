"""Random climbs of invented hands as certificates, and their answers by exhaustion."""

from dataclasses import replace
from itertools import product
from types import SimpleNamespace

import numpy as np
import scipy

from hand_models.base import Pose
from planner.certification import ClimbCertificate
from planner.reach import ReachTable
from planner.screening import ScreeningTable, WorldHands
from planner.search import Ends, Wall


def random_climb(seed, placements=6, bodies=3, limbs=3, reach=0.6):
    """A climb from the first body to the last; the first hands are clipped by rows of the whole."""
    rng = np.random.default_rng(seed)
    lengths = [5, 3] * placements
    points = rng.normal(size=(sum(lengths), 6)) * [0.6, 0.6, 1.0, 0.4, 0.4, 0.4]
    rows, room = rng.uniform(0.0, 1.0, (len(points), 2)), np.full((placements, 2), np.inf)
    rows[np.cumsum([0, *lengths])[:-1]] = 0.0  # no hand is empty
    room[: placements // 2] = rng.uniform(1.0, 1.6, (placements // 2, 2))
    room[0, 1] = np.inf
    apart = rng.random((placements, placements)) < 0.9
    pairs = [(b, b + 1) for b in range(bodies - 1)]
    wrenches = np.zeros((bodies, 6))
    wrenches[:, 2], wrenches[:, 3:] = 1.0, 0.2 * rng.normal(size=(bodies, 3))
    return ClimbCertificate(
        limbs=tuple(f"limb_{i}" for i in range(limbs)),
        multiple=1.0,
        backward=False,
        points=points,
        rows=rows,
        parts=np.cumsum([0, *lengths]),
        hands=np.arange(0, 2 * placements + 1, 2),
        base=0.1 * rng.normal(size=(placements, 6)) + [0.0, 0.0, 0.4, 0.0, 0.0, 0.0],
        room=room,
        wrenches=wrenches,
        moments=0.1 * rng.normal(size=(bodies, limbs, placements, 3)),
        reached=rng.random((placements, bodies, limbs)) < reach,
        apart=apart & apart.T & ~np.eye(placements, dtype=bool),
        shifts=np.array(pairs, dtype=np.intp).reshape(-1, 2),
        start_bodies=np.arange(bodies) == 0,
        start_members=np.full(limbs, -1),
        goal_bodies=np.arange(bodies) == bodies - 1,
        goal_members=np.full(limbs, -1),
        directions=np.vstack([np.eye(6), -np.eye(6)]),
        own_members=np.zeros((0, limbs), dtype=np.intp),
        own_directions=np.zeros((0, 6)),
        route_bodies=np.zeros(0, dtype=np.intp),
        route_members=np.zeros((0, limbs), dtype=np.intp),
        route_factors=np.zeros(0),
        place_poses=np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (placements, 1)),
        body_poses=np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (bodies, 1)),
        about=np.zeros(3),
        unit=np.ones(6),
    )


def every_state(c):
    """All states of a certificate as tuples (body, placements), whether they are held or not."""
    found, limbs = [], range(len(c.limbs))
    for body in range(len(c.wrenches)):
        choices = [[-1, *np.flatnonzero(c.reached[:, body, limb]).tolist()] for limb in limbs]
        for members in product(*choices):
            on = [p for p in members if p >= 0]
            near = any(not c.apart[p, q] for i, p in enumerate(on) for q in on[:i])
            if len(on) >= len(members) - 1 and not near:
                found.append((body, members))
    return found


def solved_state(c, state):
    """The load factor of a state, −∞ for none, and a direction that proves it, by HiGHS."""
    body, members = state
    on = [(limb, p) for limb, p in enumerate(members) if p >= 0]
    wrench = c.wrenches[body].copy()
    columns, sums, limits, most = [], [], [], []
    fixed = np.zeros(6)
    for limb, p in on:
        wrench[3:] += c.moments[body, limb, p]
        fixed += c.base[p]
        mine = []
        for part in range(c.hands[p], c.hands[p + 1]):
            own = list(range(c.parts[part], c.parts[part + 1]))
            sums.append((len(columns), len(own)))
            columns += own
            mine += own
        for row in np.flatnonzero(np.isfinite(c.room[p])):
            limits.append((len(columns) - len(mine), c.rows[mine, row]))
            most.append(c.room[p, row])
    size = len(columns)
    A, B = np.zeros((6 + len(sums), size)), np.zeros((len(limits), size))
    A[:6] = c.points[columns].T
    for i, (first, count) in enumerate(sums):
        A[6 + i, first : first + count] = 1.0
    for i, (first, values) in enumerate(limits):
        B[i, first : first + len(values)] = values
    rest = np.append(-fixed, np.ones(len(sums)))

    def asked(costs, more):
        extra = np.vstack([more, np.zeros((len(sums), more.shape[1]))])
        return scipy.optimize.linprog(
            np.append(costs, np.zeros(size)),
            np.hstack([np.zeros((len(B), len(costs))), B]) if len(B) else None,
            most if len(B) else None,
            np.hstack([extra, A]),
            rest,
        )

    found = asked(np.array([-1.0]), -wrench[:, None])
    if found.status == 0:
        return found.x[0], found.eqlin.marginals[:6]
    assert found.status == 2
    elastic = np.column_stack([-wrench, np.eye(6), -np.eye(6)])
    found = asked(np.append(0.0, np.ones(12)), elastic)
    assert found.status == 0
    return -np.inf, found.eqlin.marginals[:6]


def is_move(c, a, b):
    """Whether one move leads from a state to another."""
    (body, members), (to, others) = a, b
    changed = [i for i, (p, q) in enumerate(zip(members, others, strict=True)) if p != q]
    if body == to:
        return len(changed) == 1 and -1 in (members[changed[0]], others[changed[0]])
    pair = ((c.shifts == (body, to)) | (c.shifts == (to, body))).all(axis=1).any()
    return bool(pair) and not changed and -1 not in members


def at_end(state, bodies, wanted):
    body, members = state
    same = all(w in (-1, p) for w, p in zip(wanted.tolist(), members, strict=True))
    return bool(bodies[body]) and -1 not in members and same


def best_climb(c, factors):
    """The least load factor of the best climb, and its states, from the load factors of all."""
    for least in sorted({f for f in factors.values() if f > -np.inf}, reverse=True):
        left = {s for s, f in factors.items() if f >= least}
        before = {s: None for s in left if at_end(s, c.start_bodies, c.start_members)}
        waiting = list(before)
        while waiting:
            state = waiting.pop(0)
            if at_end(state, c.goal_bodies, c.goal_members):
                route = [state]
                while before[route[0]] is not None:
                    route.insert(0, before[route[0]])
                return least, route
            for other in left - before.keys():
                if is_move(c, state, other):
                    before[other] = state
                    waiting.append(other)
    return -np.inf, []


def proof_of(c, multiple, answers):
    """The certificate with a direction of its own for every state that holds less than this."""
    ruled = [(members, answers[body, members]) for body, members in answers]
    ruled = [(members, direction) for members, (factor, direction) in ruled if factor < multiple]
    limbs = len(c.limbs)
    return replace(
        c,
        multiple=multiple,
        own_members=np.array([m for m, _ in ruled], dtype=np.intp).reshape(-1, limbs),
        own_directions=np.array([d for _, d in ruled]).reshape(-1, 6),
    )


def with_route(c, route, answers):
    """The certificate with a route and its load factors."""
    return replace(
        c,
        route_bodies=np.array([body for body, _ in route], dtype=np.intp),
        route_members=np.array([m for _, m in route], dtype=np.intp).reshape(-1, len(c.limbs)),
        route_factors=np.array([answers[state][0] for state in route]),
    )


def wall_of(c):
    """The wall of a certificate, with its start and goal, as the search takes them."""
    hands = WorldHands(c.points, c.rows, c.parts, c.hands, c.base, c.room, c.about)
    entry = np.full(c.reached.shape, -1)
    entry[c.reached] = np.arange(c.reached.sum())
    reach = ReachTable(entry, c.reached, np.arange(c.reached.sum() + 1), np.zeros((0, 7)))
    pose = Pose.identity()
    wall = Wall(
        robot=SimpleNamespace(limbs=dict.fromkeys(c.limbs)),
        places=tuple(SimpleNamespace(pose=pose) for _ in c.base),
        bodies=(pose,) * len(c.wrenches),
        shifts=c.shifts,
        reach=reach,
        screening=ScreeningTable.of(hands, c.wrenches, c.moments),
        apart=c.apart,
    )

    def end(bodies, members):
        return Ends(bodies=bodies, members=tuple(members.tolist()) if members[0] >= 0 else None)

    return wall, end(c.start_bodies, c.start_members), end(c.goal_bodies, c.goal_members)
