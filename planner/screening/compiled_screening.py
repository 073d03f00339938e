"""Supports of hands, and bounds of the load factors of stances (compiled)."""

from __future__ import annotations

import numpy as np

from hand_models.base import Array, Indices, compiled

__all__ = ["load_factor_ends", "part_supports", "passing"]


@compiled()
def _farthest(
    points: Array,
    rows: Array,
    parts: Indices,
    first: int,
    end: int,
    direction: Array,
    row: int,
    price: float,
    used: Array,
) -> float:
    """Return the largest product of a direction with a sum of parts, less the price of a row.

    What the farthest vertices add to all rows is written into ``used`` (k,).
    """
    total = 0.0
    used[:] = 0.0
    for part in range(first, end):
        most, which = -np.inf, 0
        for i in range(parts[part], parts[part + 1]):
            value = 0.0
            for x in range(6):
                value += direction[x] * points[i, x]
            if price > 0.0:
                value -= price * rows[i, row]
            if value > most:
                most, which = value, i
        total += most
        for k in range(len(used)):
            used[k] += rows[which, k]
    return total


@compiled("f2", "f2", "i1", "i1", "f2", "f2", "f2", "f0")
def part_supports(
    points: Array,
    rows: Array,
    parts: Indices,
    hands: Indices,
    base: Array,
    room: Array,
    directions: Array,
    over: float,
) -> tuple[Array, Array]:
    """Return supports (P, D) of hands, and where they are upper bounds only.

    The sum of the parts is clipped exactly where one row of the whole hand alone is in the way: the
    row's price λ ≥ 0 with the least bound, the sum's support in d − λ row plus λ times the row's
    room, is found by the intersection of tangents.

    Parameters
    ----------
    points : ndarray, shape (n, 6)
        Wrenches of the vertices of all parts.
    rows : ndarray, shape (n, k)
        What each vertex adds to the rows of its whole hand.
    parts : ndarray of int, shape (parts + 1,)
        Index of the first vertex of each part.
    hands : ndarray of int, shape (P + 1,)
        Index of the first part of each hand.
    base : ndarray, shape (P, 6)
        Wrench of each hand without loads.
    room : ndarray, shape (P, k)
        Capacities of the rows; infinite for rows that a hand does not have.
    directions : ndarray, shape (D, 6)
    over : float
        Part of its capacity by which a row may be exceeded.

    Returns
    -------
    supports : ndarray, shape (P, D)
        Supports, or upper bounds of them.
    exceeded : ndarray, shape (P, D)
        1 where further rows are in the way, so that the support may be lower, else 0.
    """
    count, ways, height = len(hands) - 1, len(directions), rows.shape[1]
    supports, exceeded = np.empty((count, ways)), np.zeros((count, ways))
    left, right, used = np.empty(height), np.empty(height), np.empty(height)
    for p in range(count):
        first, end = hands[p], hands[p + 1]
        for d in range(ways):
            fixed = 0.0
            for x in range(6):
                fixed += directions[d, x] * base[p, x]
            low = _farthest(points, rows, parts, first, end, directions[d], 0, 0.0, left)
            supports[p, d] = fixed + low
            row, worst = -1, 0.0
            for k in range(height):
                excess = left[k] - room[p, k] - over * (1.0 + abs(room[p, k]))
                if excess > worst:
                    row, worst = k, excess
            if row < 0:
                continue
            exceeded[p, d] = 1.0
            most = room[p, row]
            # tangents at a price that is too low and at one that is too high
            low_price, high_price = 0.0, 1e-3
            high = _farthest(points, rows, parts, first, end, directions[d], row, high_price, right)
            for _ in range(40):
                if right[row] <= most:
                    break
                high_price *= 2.0
                high = _farthest(
                    points, rows, parts, first, end, directions[d], row, high_price, right
                )
            if right[row] > most:
                continue
            value = np.inf
            for _ in range(60):
                down, up = most - left[row], most - right[row]
                # each bound is its own value plus the price times the room
                gap = (high + high_price * most) - (low + low_price * most)
                price = (gap + down * low_price - up * high_price) / (down - up)
                least = low + low_price * most + down * (price - low_price)
                value = _farthest(points, rows, parts, first, end, directions[d], row, price, used)
                value += price * most
                if value <= least + 1e-12 * (1.0 + abs(least)):
                    break
                if used[row] > most:
                    low_price, low = price, value - price * most
                    left[:] = used
                else:
                    high_price, high = price, value - price * most
                    right[:] = used
            supports[p, d] = min(supports[p, d], fixed + value)
            # loads between those of the two tangents reach the bound if no other row forbids it
            share = (most - right[row]) / (left[row] - right[row])
            held = value <= least + 1e-12 * (1.0 + abs(least))
            for k in range(height):
                mixed = share * left[k] + (1.0 - share) * right[k]
                if mixed > room[p, k] + over * (1.0 + abs(room[p, k])):
                    held = False
            if held:
                exceeded[p, d] = 0.0
    return supports, exceeded


@compiled("f2", "f2", "i1", "i2", "f2", "f4", "f0", "f0")
def load_factor_ends(
    directions: Array,
    supports: Array,
    bodies: Indices,
    members: Indices,
    wrenches: Array,
    moments: Array,
    floor: float,
    least: float,
) -> Array:
    """Return bounds (N, 2) of the multiples of the body wrench that stances can hold.

    Parameters
    ----------
    directions : ndarray, shape (D, 6)
    supports : ndarray, shape (P, D)
    bodies : ndarray of int, shape (N,)
    members : ndarray of int, shape (N, L)
    wrenches : ndarray, shape (B, 6)
    moments : ndarray, shape (B, L, P, 3), or B = 0 for none
        What a hand at a placement changes in the moment of its body's wrench.
    floor : float
        Upper bound below which a stance is not looked at further.
    least : float
        Product of a direction and a wrench that counts as zero.
    """
    found = np.empty((len(bodies), 2))
    limbs, ways, weighed = members.shape[1], len(directions), len(moments) > 0
    wrench, used = np.empty(6), np.empty(limbs, dtype=np.intp)
    for n in range(len(bodies)):
        body, count = bodies[n], 0
        for x in range(6):
            wrench[x] = wrenches[body, x]
        for limb in range(limbs):
            p = members[n, limb]
            if p >= 0:
                used[count] = p
                count += 1
                if weighed:
                    for x in range(3):
                        wrench[3 + x] += moments[body, limb, p, x]
        low, high = 0.0, np.inf
        for d in range(ways):
            need, total = 0.0, 0.0
            for x in range(6):
                need += directions[d, x] * wrench[x]
            for i in range(count):
                total += supports[used[i], d]
            if need > least:
                high = min(high, total / need)
            elif need < -least:
                low = max(low, total / need)
            elif total < 0.0:
                # no multiple up to this one: the product is at most ``least`` either way
                low = max(low, -total / least)
            if high < floor or low > high:
                break
        found[n, 0], found[n, 1] = low, high
    return found


@compiled("f2", "f2", "f1", "f3", "i1", "i1", "f0", "f0", "i0", "i0")
def passing(
    directions: Array,
    supports: Array,
    wrench: Array,
    moments: Array,
    candidates: Indices,
    starts: Indices,
    factor: float,
    slack: float,
    first: int,
    most: int,
) -> tuple[Indices, int]:
    """Return the choices of one placement for each limb that no direction rules out.

    A direction rules a choice out if it does so at the factor and at a bound of all load factors:
    then it does at every multiple in between. Choices of the first limbs are ruled out together
    where the best of the others cannot help.

    Parameters
    ----------
    directions : ndarray, shape (D, 6)
    supports : ndarray, shape (P, D)
    wrench : ndarray, shape (6,)
        Body wrench with all limbs in the air.
    moments : ndarray, shape (H, P, 3), or H = 0 for none
        What a hand of each limb at a placement changes in its moment.
    candidates : ndarray of int, shape (c,)
        Placements of all H limbs, one limb after the other.
    starts : ndarray of int, shape (H + 1,)
        Index of each limb's first candidate.
    factor : float
        Least load factor.
    slack : float
        Relative tolerance of a load factor.
    first, most : int
        Choices that the first buffer holds, and that may pass.

    Returns
    -------
    chosen : ndarray of int, shape (M, H)
    passed : int
        M; or ``most`` + 1 if there are more, of which some are left out.
    """
    limbs, ways = len(starts) - 1, len(directions)
    # what each candidate adds in each direction: to the supports, and to the body wrench
    held, needed = np.empty((len(candidates), ways)), np.zeros((len(candidates), ways))
    for limb in range(limbs):
        for i in range(starts[limb], starts[limb + 1]):
            p = candidates[i]
            for d in range(ways):
                held[i, d] = supports[p, d]
                if len(moments) > 0:
                    for x in range(3):
                        needed[i, d] += directions[d, 3 + x] * moments[limb, p, x]
    # the largest load factor of all choices is at most 1 / share
    share, body = 0.0, np.zeros(ways)
    for d in range(ways):
        for x in range(6):
            body[d] += directions[d, x] * wrench[x]
        most_held, least_needed = 0.0, body[d]
        for limb in range(limbs):
            most_held += held[starts[limb] : starts[limb + 1], d].max()
            least_needed += needed[starts[limb] : starts[limb + 1], d].min()
        if least_needed > 0.0:
            share = max(share, least_needed / max(most_held, 1e-9 * least_needed))
    share *= 1.0 - slack
    if factor > 0.0:
        share = min(share, 1.0 / factor)
    factor *= 1.0 - slack
    # spare of each candidate at both ends of the multiples, and the least that the sum of the limbs
    # up to one must have
    spare, far = held - factor * needed, share * held - needed
    least, far_least = np.empty((limbs + 1, ways)), np.empty((limbs + 1, ways))
    least[limbs], far_least[limbs] = factor * body, body
    for limb in range(limbs - 1, -1, -1):
        for d in range(ways):
            own = slice(starts[limb], starts[limb + 1])
            least[limb, d] = least[limb + 1, d] - spare[own, d].max()
            far_least[limb, d] = far_least[limb + 1, d] - far[own, d].max()
    chosen, passed = np.empty((first, limbs), dtype=np.intp), 0
    sums, far_sums = np.zeros((limbs + 1, ways)), np.zeros((limbs + 1, ways))
    at, killer = starts[:-1].copy(), np.zeros(limbs, dtype=np.intp)
    level = 0
    while level >= 0:
        if at[level] >= starts[level + 1]:
            level -= 1
            if level >= 0:
                at[level] += 1
            continue
        i, below, last = at[level], level + 1, killer[level]
        passes = (
            sums[level, last] + spare[i, last] >= least[below, last]
            or far_sums[level, last] + far[i, last] >= far_least[below, last]
        )
        if passes:
            for d in range(ways):
                if (
                    sums[level, d] + spare[i, d] < least[below, d]
                    and far_sums[level, d] + far[i, d] < far_least[below, d]
                ):
                    passes, killer[level] = False, d
                    break
        if not passes:
            at[level] += 1
        elif below < limbs:
            for d in range(ways):
                sums[below, d] = sums[level, d] + spare[i, d]
                far_sums[below, d] = far_sums[level, d] + far[i, d]
            level = below
            at[level] = starts[level]
        else:
            if passed >= most:
                return chosen[:passed], most + 1
            if passed == len(chosen):
                longer = np.empty((2 * passed, limbs), dtype=np.intp)
                longer[:passed] = chosen
                chosen = longer
            for limb in range(limbs):
                chosen[passed, limb] = candidates[at[limb]]
            passed += 1
            at[level] += 1
    return chosen[:passed], passed
