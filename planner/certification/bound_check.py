"""Check of the bound of climbs in a certificate: supports and states from its arrays alone.

It shares no code with the search or the screening. Every sum is taken with its rounding errors on
the side of the climber: a state counts as held unless numbers that are certain rule it out.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from hand_models.base import Array, Indices, LimitError, go_on
from planner.certification.climb_certificate import ClimbCertificate
from planner.certification.settings import CERTIFICATION_SETTINGS

__all__ = ["BoundCheck", "check_bound"]


class BoundCheck(NamedTuple):
    """The answer of the check of a bound.

    Attributes
    ----------
    proven : bool
        Whether no state of the other end is connected with the end where the check began.
    connected : int
        States that are connected with this end, as far as the check went.
    ruled_out : int
        States next to these that directions rule out.
    open_end : ndarray of int, shape (1 + L,), or None
        The first state of the other end that is connected: its body and its placements.
    """

    proven: bool
    connected: int
    ruled_out: int
    open_end: Indices | None


def check_bound(certificate: ClimbCertificate) -> BoundCheck:
    """Recompute whether directions of a certificate separate the start of climbs from the goal.

    Parameters
    ----------
    certificate : ClimbCertificate

    Raises
    ------
    LimitError
        If there are more states than 63 bits can number.
    """
    graph = _Graph(certificate)
    ends = [
        (certificate.start_bodies, certificate.start_members),
        (certificate.goal_bodies, certificate.goal_members),
    ]
    (bodies, members), (far_bodies, far_members) = ends[::-1] if certificate.backward else ends
    # the last is no state
    seen, connected = np.array([np.iinfo(np.int64).max]), 0
    first, waiting = graph.stances(bodies, members), list[Indices]()
    size = CERTIFICATION_SETTINGS.block
    few = size // CERTIFICATION_SETTINGS.neighbours
    while True:
        go_on()
        states = _batch(first, size)
        if states is None:
            some = _batch(_taken(waiting), few)
            if some is None:
                return BoundCheck(True, connected, len(seen) - 1 - connected, None)
            states = graph.neighbours(some)
        keys, at = np.unique(graph.keys(states[:, 1:], states[:, 0]), return_index=True)
        place = np.searchsorted(seen, keys)
        new = seen[place] != keys
        seen = np.insert(seen, place[new], keys[new])
        held = states[at[new]][graph.held(states[at[new]])]
        connected += len(held)
        ends_here = (held[:, 1:] >= 0).all(axis=1) & far_bodies[held[:, 0]]
        ends_here &= ((far_members < 0) | (held[:, 1:] == far_members)).all(axis=1)
        if ends_here.any():
            return BoundCheck(False, connected, len(seen) - 1 - connected, held[ends_here][0])
        waiting += [held[i : i + few] for i in range(0, len(held), few)]


def _batch(source: Iterator[Indices], rows: int) -> Indices | None:
    """Return the next states of a source, so many at least if there are; None at its end."""
    found = list[Indices]()
    while sum(map(len, found)) < rows and (some := next(source, None)) is not None:
        found.append(some)
    return np.concatenate(found) if found else None


def _taken(waiting: list[Indices]) -> Iterator[Indices]:
    while waiting:
        yield waiting.pop()


class _Graph:
    """States of a certificate, as rows of a body and its placements, and which are held."""

    def __init__(self, certificate: ClimbCertificate) -> None:
        self.of = c = certificate
        count, limbs = len(c.base), len(c.limbs)
        if (count + 1) ** limbs * max(1, len(c.wrenches)) >= np.iinfo(np.int64).max:
            raise LimitError(
                f"{count} placements, {len(c.wrenches)} bodies and {limbs} limbs are too many: the "
                "number of a state needs 63 bits at most; leave placements out"
            )
        self.reached = np.ascontiguousarray(c.reached.transpose(1, 2, 0))
        # a hand in the air is the last: it holds nothing, and moves no weight
        self.supports = np.zeros((count + 1, len(c.directions)))
        self.own_supports, by_limb = np.zeros(len(c.own_directions)), c.own_members.T
        for p in range(count):
            self.supports[p] = _supports(c, p, c.directions)
            for column in by_limb:
                on = np.flatnonzero(column == p)
                self.own_supports[on] += _supports(c, p, c.own_directions[on])
        self.moments = np.pad(c.moments, ((0, 0), (0, 0), (0, 1), (0, 0)))
        self.largest = np.abs(c.wrenches).max(axis=0, initial=0.0)
        self.largest[3:] += limbs * np.abs(c.moments).max(axis=(0, 1, 2), initial=0.0)
        own = self.keys(c.own_members)
        self.own_order = np.argsort(own, kind="stable")
        self.own_keys = own[self.own_order]
        either = np.vstack([c.shifts, c.shifts[:, ::-1]])
        either = either[np.argsort(either[:, 0], kind="stable")]
        self.next_bodies = either[:, 1]
        self.next_from = np.searchsorted(either[:, 0], np.arange(len(c.wrenches) + 1))

    def keys(self, members: Indices, bodies: Indices | int = 0) -> NDArray[np.int64]:
        """Return a number for each state, (n,), from placements (n, L) and bodies (n,)."""
        found = np.zeros(len(members), dtype=np.int64) + bodies
        for column in members.T:
            found = found * (len(self.of.base) + 1) + column + 1
        return found

    def stances(self, bodies: NDArray[np.bool_], members: Indices) -> Iterator[Indices]:
        """Yield the states of some bodies with all hands on the rock, at given placements or any.

        No two of the hands that may be anywhere are where only one hand may be.
        """
        for body in np.flatnonzero(bodies):
            reached = [
                np.flatnonzero(each) if p < 0 else np.flatnonzero(each[p : p + 1]) + p
                for each, p in zip(self.reached[body], members, strict=True)
            ]
            for p in reached[0]:
                found = np.array([[body, p]])
                for limb, choices in enumerate(reached[1:], 1):
                    free = self.of.apart[found[:, 1:, None], choices].all(axis=1)
                    if members[limb] >= 0:
                        free[:] = True
                    row, which = np.nonzero(free)
                    found = np.column_stack([found[row], choices[which]])
                yield found

    def neighbours(self, states: Indices) -> Indices:
        """Return the states one move from some: a hand lifted or placed, or the body shifted."""
        air = (states[:, 1:] < 0).any(axis=1)
        stances, lifts = states[~air], states[air]
        begin = self.next_from[stances[:, 0]]
        count = self.next_from[stances[:, 0] + 1] - begin
        shifted = np.repeat(stances, count, axis=0)
        rank = np.arange(len(shifted)) - np.repeat(np.cumsum(count) - count, count)
        shifted[:, 0] = self.next_bodies[np.repeat(begin, count) + rank]
        limbs = np.arange(len(self.of.limbs))
        stays = self.reached[shifted[:, :1], limbs, shifted[:, 1:]].all(axis=1)
        found = [shifted[stays]]
        for limb in limbs:
            lifted = stances.copy()
            lifted[:, 1 + limb] = -1
            of = lifts[lifts[:, 1 + limb] < 0]
            free = self.reached[of[:, 0], limb].copy()
            for other in limbs[limbs != limb]:
                free &= self.of.apart[of[:, 1 + other]]
            row, place = np.nonzero(free)
            placed = of[row]
            placed[:, 1 + limb] = place
            found += [lifted, placed]
        return np.concatenate(found)

    def held(self, states: Indices) -> NDArray[np.bool_]:
        """Return False where no multiple of at least the claim's can be held, shape (n,).

        Σ σ(d) ≥ s d·w for each direction d: the multiples s end where d·w > 0, and begin where
        d·w < 0.
        """
        settings, c, size = CERTIFICATION_SETTINGS, self.of, CERTIFICATION_SETTINGS.compared
        if len(states) > size:
            blocks = [self.held(states[i : i + size]) for i in range(0, len(states), size)]
            return np.concatenate(blocks)
        bodies, members = states[:, 0], states[:, 1:]
        wrenches = c.wrenches[bodies].copy()
        for limb, column in enumerate(members.T):
            wrenches[:, 3:] += self.moments[bodies, limb, column]
        least = c.multiple * (1.0 - settings.rounding)
        low, high = np.zeros(len(states)), np.full(len(states), np.inf)
        left, first, count = np.arange(len(states)), 0, settings.first_directions
        while first < len(c.directions):
            some = slice(first, first + count)
            total = self.supports[members[left, 0], some]
            for column in members[left, 1:].T:
                total += self.supports[column, some]
            needed = wrenches[left] @ c.directions[some].T - self.rounding(c.directions[some])
            # most states fall short at once
            enough = ~((total < least * needed) & (needed > 0.0)).any(axis=1)
            high[left[~enough]], left = -np.inf, left[enough]
            rises, ends = _multiples(total[enough], needed[enough])
            low[left] = np.maximum(low[left], rises.max(axis=1))
            high[left] = np.minimum(high[left], ends.min(axis=1))
            left = left[self._possible(low[left], high[left])]
            first, count = first + count, 4 * count
        keys = self.keys(members[left])
        begin = np.searchsorted(self.own_keys, keys)
        many = np.searchsorted(self.own_keys, keys, side="right") - begin
        state = np.repeat(left, many)
        rank = np.arange(len(state)) - np.repeat(np.cumsum(many) - many, many)
        own = self.own_order[np.repeat(begin, many) + rank]
        needed = (wrenches[state] * c.own_directions[own]).sum(axis=1)
        needed -= self.rounding(c.own_directions[own])
        rises, ends = _multiples(self.own_supports[own], needed)
        np.maximum.at(low, state, rises)
        np.minimum.at(high, state, ends)
        return self._possible(low, high)

    def rounding(self, directions: Array) -> Array:
        """Return how far products of directions (D, 6) with body wrenches may be wrong, (D,)."""
        found: Array = CERTIFICATION_SETTINGS.rounding * (np.abs(directions) @ self.largest)
        return found

    def _possible(self, low: Array, high: Array) -> NDArray[np.bool_]:
        least = self.of.multiple * (1.0 - CERTIFICATION_SETTINGS.rounding)
        return (high >= least) & (low <= high * (1.0 + CERTIFICATION_SETTINGS.rounding))


def _multiples(total: Array, needed: Array) -> tuple[Array, Array]:
    """Return which multiples of ``needed`` are at most ``total``: from the first to the second."""
    with np.errstate(over="ignore"):  # infinite is far enough
        share = total / np.where(needed == 0.0, -1e-200, needed)
    up = needed > 0.0
    return np.where(up, 0.0, share), np.where(up, share, np.inf)


def _supports(certificate: ClimbCertificate, p: int, directions: Array) -> Array:
    """Return upper bounds of the support function of a placement's hand, shape (D,).

    Where rows of the whole hand are in the way, prices λ ≥ 0 of the rows bound it: by the support
    in d − λ rows, plus λ room. That holds for all prices, wherever they are from.
    """
    starts = certificate.parts[certificate.hands[p] : certificate.hands[p + 1] + 1]
    own, at = slice(starts[0], starts[-1]), starts[:-1] - starts[0]
    finite = np.isfinite(certificate.room[p])
    points, base = certificate.points[own], certificate.base[p]
    rows, room = certificate.rows[own][:, finite], certificate.room[p][finite]
    values = directions @ points.T
    found = np.add.reduce(np.maximum.reduceat(values, at, axis=1), axis=1)
    largest = np.abs(base) + np.maximum.reduceat(np.abs(points), at).sum(axis=0)
    terms = np.abs(directions) @ largest
    if finite.any():
        farthest = [part.argmax(axis=1) for part in np.split(values, at[1:], axis=1)]
        used = sum(rows[first + each] for first, each in zip(at, farthest, strict=True))
        sums = np.repeat(np.eye(len(at)), np.diff(starts), axis=1)
        of_rows = np.abs(room) + np.maximum.reduceat(np.abs(rows), at).sum(axis=0)
        over, size = np.flatnonzero((used > room).any(axis=1)), CERTIFICATION_SETTINGS.programs
        for some in (over[i : i + size] for i in range(0, len(over), size)):
            # programs of some directions, solved as one
            each = scipy.sparse.eye_array(len(some))
            of_each: list[Any] = [scipy.sparse.kron(each, matrix) for matrix in (rows.T, sums)]
            solved = scipy.optimize.linprog(
                -values[some].ravel(),
                of_each[0],
                np.tile(room, len(some)),
                of_each[1],
                np.ones(len(some) * len(at)),
            )
            if solved.status == 0:
                prices = np.maximum(-solved.ineqlin.marginals, 0.0).reshape(len(some), -1)
                priced = np.maximum.reduceat(values[some] - prices @ rows.T, at, axis=1)
                found[some] = np.minimum(found[some], priced.sum(axis=1) + prices @ room)
                terms[some] += prices @ of_rows
    bounds: Array = found + directions @ base + CERTIFICATION_SETTINGS.rounding * terms
    return bounds
