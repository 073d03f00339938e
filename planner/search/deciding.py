"""Decide whether a climb has a given least load factor: from both ends, until they meet.

From the start and from the goal, lifts are reached over four-hand stances that no direction rules
out. A lift is passed only if its linear program says that it holds enough. The stances between
lifts are solved where lifts of both ends meet, or for each lift that is passed. If one end has no
lift left, no climb has this least load factor.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from itertools import count

import numpy as np

from hand_models.base import Array, Indices
from planner.search.lifts import Lifts
from planner.search.programs import Programs
from planner.search.settings import SEARCH_SETTINGS
from planner.search.wall import State
from planner.search.ways import Moves, Way, Ways

__all__ = ["Decision"]


class Decision:
    """Search for a climb whose states all have a least load factor.

    Parameters
    ----------
    lifts : Lifts
        All lifts that may have it.
    programs : Programs
    moves : Moves
    attempts : float
        Parents of a lift that are tried over four hands.
    barred : set of Way, optional
        Ways that are left out.
    """

    def __init__(
        self,
        lifts: Lifts,
        programs: Programs,
        moves: Moves,
        attempts: float,
        barred: set[Way] | None = None,
    ) -> None:
        self._attempts = attempts
        self.stuck = False
        self._lifts, self._nodes, self._programs = lifts, lifts.nodes, programs
        self._least = lifts.multiple * (1.0 - 0.1 * SEARCH_SETTINGS.exact)
        self._factors = np.full(len(lifts), np.nan)
        self._ways = Ways(lifts, programs, moves, set() if barred is None else barred)
        self._turn = count()
        self._queues = [list[tuple[float, int, Indices]](), list[tuple[float, int, Indices]]()]
        self.partial = False
        self.route = self._ways.standing()
        self.exhausted = 0
        self._parents = [self._nodes["out"], self._nodes["parent_1"], self._nodes["parent_2"]]
        self._vias = [self._nodes["out"], self._nodes["via_1"], self._nodes["via_2"]]
        self._recall()
        for side in (1, 2):
            seeds = lifts.beside(side - 1)
            seeds = seeds[self._nodes["out"][seeds] == 0]
            self._nodes["claimed"][seeds] |= side
            self._parents[side][seeds], self._vias[side][seeds] = -side, -1
            self._push(side, seeds)

    @property
    def multiple(self) -> float:
        """The least load factor that is asked for."""
        return self._lifts.multiple

    @property
    def directions(self) -> Array:
        """Directions of all states that it rests on, shape (D, 6)."""
        both = self._lifts.table.directions, self._lifts.stances.directions
        return np.unique(np.vstack(both), axis=0)

    @property
    def hindered(self) -> bool:
        """True if blocked moves left something out, so that the decision proves nothing."""
        return self._ways.hindered

    @property
    def barred(self) -> set[Way]:
        """Ways that blocked moves leave out."""
        return self._ways.barred

    @property
    def ended(self) -> bool:
        """True once it is decided: a route was found, or an end has no lift left."""
        return bool(self.route) or self.exhausted > 0

    def _recall(self) -> None:
        """Take over what was solved before."""
        known, lifts = self._programs.known, self._lifts
        three = np.flatnonzero((known.members < 0).sum(axis=1) == 1)
        triples, found = lifts.find(known.bodies[three], known.members[three])
        bounding = known.factors[three] < self._least
        low = bounding & (triples >= 0)
        lifts.rule_out(triples[low], known.directions[three[low]], known.held[three[low]])
        there = found >= 0
        self._factors[found[there]] = known.factors[three[there]]
        self._nodes["out"][found[there & bounding]] = 1
        refused = self._ways.refused
        if refused:
            bodies, members = (np.array(column) for column in zip(*refused, strict=True))
            _, found = lifts.find(bodies, members)
            self._nodes["out"][found[found >= 0]] = 1
            self._ways.hindered |= bool((found >= 0).any())

    def _push(self, side: int, lifts: Indices) -> None:
        if len(lifts):
            lag = np.round(self._lifts.lag(lifts, 2 - side))
            order = np.argsort(lag, kind="stable")
            cuts = np.flatnonzero(np.diff(lag[order])) + 1
            for part in np.split(order, cuts):
                entry = float(lag[part[0]]), -next(self._turn), lifts[part]
                heapq.heappush(self._queues[side - 1], entry)

    def _waiting(self, side: int) -> int:
        return sum(len(lifts) for _, _, lifts in self._queues[side - 1])

    def _pop(self, side: int) -> Indices:
        """Return some of the lifts that look nearest to the other end."""
        queue, found, left = self._queues[side - 1], list[Indices](), SEARCH_SETTINGS.at_once
        while queue and left > 0:
            lag, _, lifts = heapq.heappop(queue)
            mine = self._nodes[lifts]
            lifts = lifts[(mine["claimed"] & side > 0) & (mine["closed"] == 0) & (mine["out"] == 0)]
            if len(lifts) > left:
                heapq.heappush(queue, (lag, -next(self._turn), lifts[left:]))
            found.append(lifts[:left])
            left -= len(found[-1])
        return np.unique(np.concatenate(found)) if found else np.zeros(0, dtype=np.intp)

    def advance(self) -> None:
        """Pass some lifts of the end that has fewer of them."""
        side = 1 if self._waiting(1) <= self._waiting(2) else 2
        chosen = self._pop(side)
        if not len(chosen):
            self.exhausted = side
            return
        self._solve(chosen)
        chosen = chosen[self._nodes["out"][chosen] == 0]
        chosen = self._joined(side, chosen)
        self._nodes["closed"][chosen] = side
        claimed, met = self._lifts.expand(chosen, side)
        self._push(side, claimed)
        for i, j, place in met.tolist():
            if j != -side and self._meet(side, i, j, place):
                return

    def _solve(self, chosen: Indices) -> None:
        """Solve the programs of lifts, and rule out those that hold too little."""
        lifts = self._lifts
        new = chosen[np.isnan(self._factors[chosen])]
        # one of each triple first: its direction may rule out the others
        while len(new):
            _, first = np.unique(lifts.triples[new], return_index=True)
            some = new[first]
            found = self._programs.solve(lifts.bodies[some], lifts.members[lifts.triples[some]])
            self._factors[some] = found.factors
            low = found.factors < self._least
            self._nodes["out"][some[low]] = 1
            lifts.rule_out(lifts.triples[some[low]], found.directions[low], found.held[low])
            new = np.setdiff1d(new, some)
            new = new[self._nodes["out"][new] == 0]

    def _joined(self, side: int, chosen: Indices) -> Indices:
        """Return the lifts that four hands that hold enough join with their end.

        Where the stances on the way fail, another passed lift becomes the parent.
        """
        held, others = list[int](), dict[int, Iterator[tuple[int, int]]]()
        parents, vias = self._parents[side], self._vias[side]
        left = chosen[vias[chosen] >= 0]
        loose, attempts = chosen[vias[chosen] < 0], self._attempts
        if not attempts:
            held, left = left.tolist(), left[:0]
        while len(left) or len(loose):
            columns = (each.tolist() for each in (parents[left], left, vias[left]))
            ways = [self._way(side, *row) for row in zip(*columns, strict=True)]
            self._ways.solve(ways if attempts else [])
            failed = loose.tolist()
            for lift, way in zip(left.tolist(), ways, strict=True):
                fits = way not in self._ways.barred and (
                    not self._attempts or self._ways.states(way)
                )
                (held if fits else failed).append(lift)
            new = [lift for lift in failed if lift not in others]
            if new:
                met = self._parents_of(np.array(new), side)
                order = np.argsort(met[:, 0], kind="stable")
                met = met[order]
                firsts = np.searchsorted(met[:, 0], [*new, len(self._nodes)])
                for i, lift in enumerate(new):
                    own = np.unique(met[firsts[i] : firsts[i + 1], 1:], axis=0)
                    others[lift] = iter(list(map(tuple, own.tolist())))
            again, attempts = list[int](), attempts - 1
            if attempts == 0:
                self._nodes["claimed"][failed] &= ~side
                break
            for lift in failed:
                for parent, place in others[lift]:
                    if not self._ways.fails(self._way(side, parent, lift, place)):
                        parents[lift], vias[lift] = parent, place
                        again.append(lift)
                        break
                else:
                    self._nodes["claimed"][lift] &= ~side
            left, loose = np.array(again, dtype=np.intp), loose[:0]
        return np.unique(np.array(held, dtype=np.intp))

    def _way(self, side: int, parent: int, lift: int, place: int) -> Way:
        if side == 1:
            return Way(parent, lift, place)
        return Way(lift, parent, place)

    def _meet(self, side: int, i: int, j: int, place: int) -> bool:
        """Try the climb over a lift that one end has passed, and one that the other has."""
        if j >= 0 and self._nodes["closed"][j] != 3 - side:
            return False
        if i >= 0 and self._nodes["closed"][i] != side:
            return False
        middle = Way(i, j, place) if side == 1 else Way(j, i, place)
        if middle in self._ways.barred or not self._ways.states(middle):
            return False
        first, last = (i, j) if side == 1 else (j, i)
        ways = [*reversed(list(self._chain(1, first))), middle, *self._chain(2, last)]
        at = ways.index(middle)
        while True:
            unfit = [
                (1 if k < at else 2, way.after if k < at else way.before)
                for k, way in enumerate(ways)
                if k != at
            ]
            unfit = [each for each in unfit if not self._fits(each[1])]
            if unfit:
                for part, lift in unfit:
                    self._cut(part, lift)
                return False
            failed = self._try(ways)
            if failed is None and self._ways.refuse(self.route):
                self.route = ()
                continue
            if failed is None or failed is middle:
                return failed is None
            if failed not in self._ways.barred:
                self.stuck = True
                return True
            k = ways.index(failed)
            self._cut(*((1, failed.after) if k < at else (2, failed.before)))
            return False

    def _fits(self, lift: int) -> bool:
        """Return whether a lift may be passed; if not, it is out of all further climbs."""
        state = self._ways.state(lift)
        if self._ways.passes(state, state):
            return True
        self._ways.refused.add(state)
        self._ways.hindered = True
        self._nodes["out"][lift] = 1
        return False

    def _cut(self, side: int, lift: int) -> None:
        """Take back a lift that its parent does not lead to, and all that was reached over it.

        What is next to lifts that are left is claimed again from there.
        """
        parents, vias = self._parents[side], self._vias[side]
        own = np.flatnonzero(self._nodes["claimed"] & side)
        cut = last = np.array([lift], dtype=np.intp)
        while len(last):
            last = own[np.isin(parents[own], last)]
            cut = np.append(cut, last)
        self._nodes["closed"][cut[self._nodes["closed"][cut] == side]] = 0
        self._nodes["claimed"][cut] &= ~side
        left = cut[self._nodes["out"][cut] == 0]
        if not len(left):
            return
        for other, parent, place in self._parents_of(left, side).tolist():
            if not self._nodes["claimed"][other] & side and not self._ways.fails(
                self._way(side, parent, other, place)
            ):
                self._nodes["claimed"][other] |= side
                parents[other], vias[other] = parent, place
        self._push(side, left[(self._nodes["claimed"][left] & side) > 0])

    def _parents_of(self, lifts: Indices, side: int) -> Indices:
        """Return rows (lift, parent, place) of what may come before lifts on the way from an end.

        Parents are lifts that the side has closed, or the end itself, ``-side``.
        """
        _, met = self._lifts.expand(lifts, 0)
        to = met[:, 1]
        # an end is no index, and there may be fewer nodes than its number
        closed = self._nodes["closed"][np.maximum(to, 0)] == side
        return np.asarray(met[(to == -side) | ((to >= 0) & closed)])

    def _chain(self, side: int, lift: int) -> Iterator[Way]:
        """Return the ways from a lift back to its end; none from the end itself."""
        while lift >= 0:
            parent = int(self._parents[side][lift])
            yield self._way(side, parent, lift, int(self._vias[side][lift]))
            lift = parent

    def _try(self, ways: list[Way]) -> Way | None:
        """Return the first way that fails; None, and the climb is kept, if all hold."""
        states = list[State]()
        for way in ways:
            known = way not in self._ways.barred and len(self._ways.states(way)) > 0
            between = self._ways.fit(way) if known else []
            if not between:
                if known:
                    self._bar(way)
                return way
            if way.before >= 0:
                lift = self._ways.state(way.before)
                turns = [(lift, between[0]), (states[-2], lift), (states[-2], between[0])]
                if not all(self._ways.passes(*turn) for turn in turns):
                    self._bar(way)
                    return way
            states += between
            if way.after >= 0:
                after = self._ways.state(way.after)
                if not self._ways.passes(between[-1], after):
                    self._bar(way)
                    return way
                states.append(after)
        self.route = tuple(states)
        return None

    def _bar(self, way: Way) -> None:
        self._ways.barred.add(way)
        self._ways.hindered = True
