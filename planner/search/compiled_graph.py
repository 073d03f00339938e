"""The graph of lifts, joined by stances of four hands and shifts of the body (compiled).

Sets of bodies are bit masks of 62 bits a word.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices, compiled

__all__ = ["LIFT_NODE", "bit_masks", "expand", "hash_table", "rule_out", "touching"]

LIFT_NODE = np.dtype(
    [
        ("claimed", np.intp),  # sum of the ends from which it was reached: 1 start, 2 goal
        ("closed", np.intp),  # the end that has passed it: its neighbours were looked at
        ("out", np.intp),  # 1 if it is ruled out
        # lift from which each end reached it, and the placement with all hands on the rock on the
        # way; −1 for the start itself, −2 for the goal
        ("parent_1", np.intp),
        ("via_1", np.intp),
        ("parent_2", np.intp),
        ("via_2", np.intp),
    ]
)


@compiled("b2")
def bit_masks(table: NDArray[np.bool_]) -> Indices:
    """Return the rows of a table (n, B) as bit masks (n, W)."""
    found = np.zeros((len(table), (table.shape[1] + 61) // 62), dtype=np.intp)
    for i in range(len(table)):
        for b in range(table.shape[1]):
            if table[i, b]:
                found[i, b // 62] |= 1 << (b % 62)
    return found


@compiled()
def _slot(keys: Indices, key: int) -> int:
    """Return where a key is in a table of 2^n keys, or where it would be."""
    at = key * 0x1E3779B97F4A7C15
    at = (at ^ (at >> 29)) & (len(keys) - 1)
    while keys[at] != -1 and keys[at] != key:
        at = (at + 1) & (len(keys) - 1)
    return at


@compiled("i1")
def hash_table(keys: Indices) -> tuple[Indices, Indices]:
    """Return a table of keys by hash, −1 where it is empty, and the index of each."""
    size = 16
    while size < 2 * len(keys):
        size *= 2
    table, values = np.full(size, -1, dtype=np.intp), np.zeros(size, dtype=np.intp)
    for i in range(len(keys)):
        at = _slot(table, keys[i])
        table[at], values[at] = keys[i], i
    return table, values


@compiled()
def _flood(
    reached: Indices, near: Indices, once: int, body: int, found: Indices, stack: Indices
) -> None:
    """Write the mask of the bodies that shifts connect with a body, among those reached.

    With ``once`` not zero, one shift at most.
    """
    found[:] = 0
    found[body // 62] |= 1 << (body % 62)
    stack[0], height = body, 1
    while height > 0:
        height -= 1
        at = stack[height]
        for w in range(len(found)):
            new = near[at, w] & reached[w] & ~found[w]
            found[w] |= new
            while new != 0 and once == 0:
                low = new & -new
                stack[height] = 62 * w + math.frexp(float(low))[1] - 1
                height += 1
                new ^= low


@compiled("i1", "i1", "i2", "i2", "i3", "i1", "i0")
def touching(
    bodies: Indices,
    triples: Indices,
    members: Indices,
    near: Indices,
    reach: Indices,
    end: Indices,
    once: int,
) -> NDArray[np.bool_]:
    """Return which lifts (n,) shifts might connect with the bodies of an end, a mask (W,)."""
    words, limbs = near.shape[1], members.shape[1]
    reached, found = np.empty(words, dtype=np.intp), np.empty(words, dtype=np.intp)
    stack = np.empty(len(near), dtype=np.intp)
    touched = np.zeros(len(bodies), dtype=np.bool_)
    for i in range(len(bodies)):
        reached[:] = -1
        for limb in range(limbs):
            p = members[triples[i], limb]
            if p >= 0:
                for w in range(words):
                    reached[w] &= reach[p, limb, w]
        _flood(reached, near, once, bodies[i], found, stack)
        for w in range(words):
            if found[w] & end[w] != 0:
                touched[i] = True
    return touched


@compiled(LIFT_NODE, "i1", "i1", "i1", "i2", "f1", "f2", "f2", "f4", "f1", "f0")
def rule_out(
    nodes: NDArray[np.void],
    bodies: Indices,
    starts: Indices,
    chosen: Indices,
    members: Indices,
    sums: Array,
    directions: Array,
    wrenches: Array,
    moments: Array,
    tops: Array,
    multiple: float,
) -> int:
    """Rule out lifts by directions of their own triples, and return how many were.

    Parameters
    ----------
    nodes : ndarray of `LIFT_NODE`, shape (n,)
    bodies : ndarray of int, shape (n,)
        Body of each lift.
    starts : ndarray of int, shape (T + 1,)
        First lift of each triple.
    chosen : ndarray of int, shape (m,)
        Triples of the directions.
    members : ndarray of int, shape (T, L)
        Placements of the triples.
    sums : ndarray, shape (m,)
        Sum of the hands' supports in the directions.
    directions : ndarray, shape (m, 6)
    wrenches, moments
        Of `ScreeningTable`.
    tops : ndarray, shape (B,)
        Upper bounds of all load factors at each body.
    multiple : float
        Multiple of the body wrench that is too much.
    """
    count = 0
    for m in range(len(chosen)):
        triple = chosen[m]
        for i in range(starts[triple], starts[triple + 1]):
            if nodes[i]["out"] != 0:
                continue
            body, need = bodies[i], 0.0
            for x in range(6):
                need += directions[m, x] * wrenches[body, x]
            if len(moments) > 0:
                for limb in range(members.shape[1]):
                    p = members[triple, limb]
                    if p >= 0:
                        for x in range(3):
                            need += directions[m, 3 + x] * moments[body, limb, p, x]
            if sums[m] < multiple * need and sums[m] < tops[body] * need:
                nodes[i]["out"] = 1
                count += 1
    return count


@compiled(
    LIFT_NODE, "i1", "i1", "i2", "i1", "i1", "i1", "i2", "i3", "i1", "i1", "b2", "i2", "i2",
    "f2", "f2", "f2", "f4", "f1", "f0", "i1", "i0", "i0",
)  # fmt: skip
def expand(
    nodes: NDArray[np.void],
    bodies: Indices,
    triples: Indices,
    members: Indices,
    starts: Indices,
    keys: Indices,
    values: Indices,
    near: Indices,
    reach: Indices,
    candidates: Indices,
    first: Indices,
    apart: NDArray[np.bool_],
    ends: Indices,
    fixed: Indices,
    directions: Array,
    supports: Array,
    wrenches: Array,
    moments: Array,
    tops: Array,
    multiple: float,
    chosen: Indices,
    side: int,
    once: int,
) -> tuple[Indices, Indices]:
    """Look at the neighbours of lifts: claim those that are open, and list those that are closed.

    Parameters
    ----------
    nodes : ndarray of `LIFT_NODE`, shape (n,)
        Claims, parents and placements on the way are written.
    bodies, triples : ndarray of int, shape (n,)
        Body and triple of each lift.
    members : ndarray of int, shape (T, L)
        Placements of the triples, −1 for the limb in the air.
    starts : ndarray of int, shape (T + 1,)
        First lift of each triple.
    keys, values : ndarray of int
        `hash_table` of the triples' keys.
    near : ndarray of int, shape (B, W)
        Masks of the bodies to which each may be shifted.
    reach : ndarray of int, shape (P, L, W)
        Masks of the bodies from which each limb reaches each placement.
    candidates, first : ndarray of int
        Placements reached by each limb from each body, and the first of each, shape (B L + 1,).
    apart : ndarray of bool, shape (P, P)
    ends : ndarray of int, shape (2, W)
        Masks of the bodies at the start and at the goal.
    fixed : ndarray of int, shape (2, L)
        Placements of the limbs there; −1 for any.
    directions, supports, wrenches, moments
        Of `ScreeningTable`: those that four hands are to pass.
    tops : ndarray, shape (B,)
        Upper bounds of all load factors at each body.
    multiple : float
        Least load factor.
    chosen : ndarray of int, shape (m,)
        Lifts to look at.
    side : int
        End for which neighbours are claimed, 1 or 2; 0 to claim none.
    once : int
        1 if the body is shifted once at most between two lifts, 0 if as often as it takes.

    Returns
    -------
    claimed : ndarray of int, shape (c,)
    met : ndarray of int, shape (e, 3)
        A lift of ``chosen``, a lift that it is joined with and the other end has passed (or any
        end, with side 0), or −1 for the start and −2 for the goal, and the placement on the way.
    """
    words, limbs, ways = near.shape[1], members.shape[1], len(directions)
    count = len(apart)
    reached, found = np.empty(words, dtype=np.intp), np.empty(words, dtype=np.intp)
    three, stack = np.empty(words, dtype=np.intp), np.empty(len(near), dtype=np.intp)
    spare, needs = np.empty(ways), np.empty(ways)
    wrench, own = np.empty(6), np.empty(limbs, dtype=np.intp)
    claimed, claims = np.empty(256, dtype=np.intp), 0
    met, meetings = np.empty((64, 3), dtype=np.intp), 0
    for i in chosen:
        body = bodies[i]
        own[:] = members[triples[i]]
        free, killer = 0, 0
        three[:] = -1
        wrench[:] = wrenches[body]
        for limb in range(limbs):
            p = own[limb]
            if p < 0:
                free = limb
                continue
            for w in range(words):
                three[w] &= reach[p, limb, w]
            if len(moments) > 0:
                for x in range(3):
                    wrench[3 + x] += moments[body, limb, p, x]
        for d in range(ways):
            spare[d], needs[d] = 0.0, 0.0
            for x in range(6):
                needs[d] += directions[d, x] * wrench[x]
            for limb in range(limbs):
                if own[limb] >= 0:
                    spare[d] += supports[own[limb], d]
        for c in range(first[body * limbs + free], first[body * limbs + free + 1]):
            p, fits = candidates[c], True
            for limb in range(limbs):
                if limb != free and not apart[own[limb], p]:
                    fits = False
            if not fits:
                continue
            for turn in range(-1, ways):
                d = killer if turn < 0 else turn
                need = needs[d]
                if len(moments) > 0:
                    for x in range(3):
                        need += directions[d, 3 + x] * moments[body, free, p, x]
                held = spare[d] + supports[p, d]
                if held < multiple * need and held < tops[body] * need:
                    fits, killer = False, d
                    break
            if not fits:
                continue
            for w in range(words):
                reached[w] = three[w] & reach[p, free, w]
            _flood(reached, near, once, body, found, stack)
            own[free] = p
            for end in range(2):
                touched = False
                for w in range(words):
                    touched = touched or found[w] & ends[end, w] != 0
                for limb in range(limbs):
                    touched = touched and (fixed[end, limb] < 0 or fixed[end, limb] == own[limb])
                if touched:
                    if meetings == len(met):
                        met = np.concatenate((met, np.empty_like(met)))
                    met[meetings, 0], met[meetings, 1], met[meetings, 2] = i, -1 - end, p
                    meetings += 1
            for lifted in range(limbs):
                key = lifted
                for limb in range(limbs):
                    if limb != lifted:
                        key = key * count + own[limb]
                at = _slot(keys, key)
                if keys[at] < 0:
                    continue
                other = values[at]
                for j in range(starts[other], starts[other + 1]):
                    to = bodies[j]
                    if (found[to // 62] >> (to % 62)) & 1 == 0 or nodes[j]["out"] != 0 or j == i:
                        continue
                    if nodes[j]["closed"] != 0:
                        if nodes[j]["closed"] == side:
                            continue
                        if meetings == len(met):
                            met = np.concatenate((met, np.empty_like(met)))
                        met[meetings, 0], met[meetings, 1], met[meetings, 2] = i, j, p
                        meetings += 1
                    elif side != 0 and nodes[j]["claimed"] & side == 0:
                        nodes[j]["claimed"] |= side
                        if side == 1:
                            nodes[j]["parent_1"], nodes[j]["via_1"] = i, p
                        else:
                            nodes[j]["parent_2"], nodes[j]["via_2"] = i, p
                        if claims == len(claimed):
                            claimed = np.concatenate((claimed, np.empty_like(claimed)))
                        claimed[claims] = j
                        claims += 1
            own[free] = -1
    return claimed[:claims], met[:meetings]
