"""All lifts of a wall that may have a load factor, as the nodes of a graph.

A lift is a body, a limb in the air and placements of the others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices, go_on
from planner.screening import ScreeningTable, StanceIndices
from planner.search.settings import SEARCH_SETTINGS
from planner.search.wall import Ends, State, Wall

__all__ = ["Ground", "Lifts"]


class Ground:
    """Reach, shifts and ends of climbs of a wall, whatever its hands hold.

    Parameters
    ----------
    wall : Wall
    ends : tuple of Ends
        Start and goal.
    once : bool, optional
        Whether the body is shifted once at most between two lifts; as often as it takes by default.

    Attributes
    ----------
    reached : ndarray of bool, shape (P, B, L)
        True where a limb reaches a placement from a body.
    beside : ndarray of bool, shape (B, B)
        True where the body may be shifted from one pose to another.
    near : ndarray of int, shape (B, W)
        Masks of ``beside``.
    reach : ndarray of int, shape (P, L, W)
        Masks of the bodies from which limbs reach placements.
    candidates : tuple of ndarray of int
        Placements that each limb reaches from each body, and the first of each, (B L + 1,).
    end_masks : ndarray of int, shape (2, W)
        Masks of the bodies at the start and at the goal.
    fixed : ndarray of int, shape (2, L)
        Placements of the limbs at the start and at the goal, −1 for any.
    hops : ndarray, shape (2, B)
        Shifts from each body to the nearest of the start and of the goal.
    far : ndarray, shape (2, P, L)
        Mean of the ``hops`` of the bodies from which limbs reach placements.
    """

    def __init__(self, wall: Wall, ends: tuple[Ends, Ends], once: bool = False) -> None:
        self.wall, self.ends, self.once = wall, ends, once
        self.reached = reached = wall.reach.reached
        count, bodies, limbs = reached.shape
        self.beside = np.zeros((bodies, bodies), dtype=bool)
        first, second = np.asarray(wall.shifts, dtype=np.intp).reshape(-1, 2).T
        self.beside[first, second] = self.beside[second, first] = True
        self.near = _masks(self.beside)
        flat = np.moveaxis(reached, 1, 2).reshape(count * limbs, bodies)
        self.reach = _masks(flat).reshape(count, limbs, -1)
        by_body = np.moveaxis(reached, 0, 2)
        starts = np.cumsum(np.append(0, by_body.sum(axis=2).ravel()))
        self.candidates: tuple[Indices, Indices] = np.nonzero(by_body)[2].copy(), starts
        self.end_masks = _masks(np.array([end.bodies for end in ends], dtype=bool))
        rows = [[-1] * limbs if end.members is None else end.members for end in ends]
        self.fixed = np.array(rows, dtype=np.intp)
        self.hops = np.array([_hops(self.beside, end) for end in ends])
        total: Array = np.einsum("pbl,eb->epl", reached.astype(float), self.hops)
        self.far = total / np.maximum(reached.sum(axis=1), 1)

    def of(self, body: int, limb: int) -> Indices:
        """Return the placements that a limb reaches from a body."""
        placements, first = self.candidates
        at = body * self.reached.shape[2] + limb
        return placements[first[at] : first[at + 1]]

    def tops(self, table: ScreeningTable) -> Array:
        """Return upper bounds of all load factors at each body, shape (B,)."""
        found = np.empty(len(self.wall.bodies))
        for body in range(len(found)):
            held = np.zeros(len(table.directions))
            needed = table.directions @ table.wrenches[body]
            for limb in range(self.reached.shape[2]):
                own = self.of(body, limb)
                held += np.max(table.supports[own], axis=0, initial=0.0)
                if len(table.moments) and len(own):
                    turned = table.moments[body, limb, own] @ table.directions[:, 3:].T
                    needed += np.minimum(turned.min(axis=0), 0.0)
            counts = needed > SEARCH_SETTINGS.exact
            found[body] = np.min(held[counts] / needed[counts], initial=SEARCH_SETTINGS.unbounded)
        return found * (1.0 + 1e3 * SEARCH_SETTINGS.exact)


@dataclass(frozen=True, eq=False)
class Lifts:
    """Lifts that no direction of a table rules out at a multiple, sorted by triple and body.

    Attributes
    ----------
    ground : Ground
    table : ScreeningTable
    stances : ScreeningTable
        The directions that stances of four hands have to pass.
    multiple : float
        Least load factor.
    tops : ndarray, shape (B,)
        Upper bounds of all load factors at each body.
    bodies, triples : ndarray of int, shape (n,)
        Body of each lift, and its placements, an index of ``members``.
    members : ndarray of int, shape (T, L)
        Placements of each triple, −1 for the limb in the air.
    starts : ndarray of int, shape (T + 1,)
        First lift of each triple.
    keys : ndarray of int, shape (T,)
        Number of each triple, ascending.
    nodes : ndarray of records, shape (n,)
        State of each lift in a search.
    counts : ndarray of int, shape (B, L)
        Lifts of each body and limb in the air.
    hashed : tuple of ndarray of int
        Hash table of ``keys`` (`compiled_graph.hash_table`).
    """

    ground: Ground
    table: ScreeningTable
    stances: ScreeningTable
    multiple: float
    tops: Array
    bodies: Indices
    triples: Indices
    members: Indices
    starts: Indices
    keys: Indices
    nodes: NDArray[np.void]
    counts: Indices
    hashed: tuple[Indices, Indices]

    @classmethod
    def passing(
        cls,
        ground: Ground,
        table: ScreeningTable,
        multiple: float,
        levels: Array | None = None,
        stances: ScreeningTable | None = None,
        check: Callable[[], None] = go_on,
    ) -> Self:
        """Return all lifts of a wall that may have a load factor of at least a multiple.

        Parameters
        ----------
        ground : Ground
        table : ScreeningTable
        multiple : float
        levels : ndarray, shape (B, L), optional
            Larger multiples for some bodies and limbs in the air, so that fewer lifts are kept.
        stances : ScreeningTable, optional
            The directions that stances of four hands have to pass; those of ``table`` by default.
        check : callable
            Called again and again; what it raises ends the screening.

        Raises
        ------
        LimitError
            If there are too many.
        """
        from planner.search.compiled_graph import LIFT_NODE, hash_table

        count, bodies, limbs = ground.reached.shape
        found, left = list[Indices](), SEARCH_SETTINGS.most_lifts
        counts = np.zeros((bodies, limbs), dtype=np.intp)
        for body in range(bodies):
            check()
            for lifted in range(limbs):
                others = [limb for limb in range(limbs) if limb != lifted]
                own = [ground.of(body, limb) for limb in others]
                least = multiple if levels is None else max(multiple, levels[body, lifted])
                rows = table.passing(body, own, least, others, left)
                apart = np.ones(len(rows), dtype=bool)
                for i in range(len(others)):
                    for j in range(i):
                        apart &= ground.wall.apart[rows[:, i], rows[:, j]]
                rows = rows[apart]
                left -= len(rows)
                counts[body, lifted] = len(rows)
                key = np.full(len(rows), lifted, dtype=np.intp)
                for column in rows.T:
                    key = key * count + column
                found.append(key * bodies + body)
        order = np.sort(np.concatenate(found))
        keys, starts, triples = np.unique(order // bodies, return_index=True, return_inverse=True)
        return cls(
            ground=ground,
            table=table,
            stances=table if stances is None else stances,
            multiple=multiple,
            tops=ground.tops(table),
            bodies=order % bodies,
            triples=triples,
            members=_unpacked(keys, count, limbs),
            starts=np.append(starts, len(order)),
            keys=keys,
            nodes=np.zeros(len(order), dtype=LIFT_NODE),
            counts=counts,
            hashed=hash_table(keys),
        )

    def __len__(self) -> int:
        return len(self.bodies)

    def state(self, lift: int) -> State:
        """Return the state of a lift."""
        row = self.members[self.triples[lift]]
        return State(int(self.bodies[lift]), tuple(row.tolist()))

    def rule_out(self, triples: Indices, directions: Array, held: Array) -> int:
        """Rule out lifts of triples by directions and the sums of supports in them, one each."""
        from planner.search.compiled_graph import rule_out

        return rule_out(
            self.nodes,
            self.bodies,
            self.starts,
            np.ascontiguousarray(triples),
            self.members,
            np.ascontiguousarray(held),
            np.ascontiguousarray(directions),
            self.table.wrenches,
            self.table.moments,
            self.tops,
            self.multiple * (1.0 - 0.1 * SEARCH_SETTINGS.exact),
        )

    def ruled_out(self, members: Indices, directions: Array, held: Array) -> list[State]:
        """Return the states of stances (n, L) that directions of their own rule out."""
        on = np.ones((len(members), len(self.ground.wall.bodies)), dtype=bool)
        for limb, column in enumerate(members.T):
            on &= self.ground.reached[column, :, limb]
        at, bodies = np.nonzero(on)
        wrenches = self.table.needed(StanceIndices(bodies, members[at]))
        need = (directions[at] * wrenches).sum(axis=1)
        least = self.multiple * (1.0 - 0.1 * SEARCH_SETTINGS.exact)
        out = (held[at] < least * need) & (held[at] < self.tops[bodies] * need)
        rows = zip(bodies[out].tolist(), members[at[out]].tolist(), strict=True)
        return [State(body, tuple(row)) for body, row in rows]

    def expand(self, chosen: Indices, side: int) -> tuple[Indices, Indices]:
        """Look at the neighbours of lifts, as `compiled_graph.expand` describes."""
        from planner.search.compiled_graph import expand

        ground = self.ground
        placements, first = ground.candidates
        return expand(
            self.nodes,
            self.bodies,
            self.triples,
            self.members,
            self.starts,
            *self.hashed,
            ground.near,
            ground.reach,
            placements,
            first,
            np.ascontiguousarray(ground.wall.apart),
            ground.end_masks,
            ground.fixed,
            self.stances.directions,
            self.stances.supports,
            self.table.wrenches,
            self.table.moments,
            self.tops,
            self.multiple * (1.0 - 0.1 * SEARCH_SETTINGS.exact),
            np.ascontiguousarray(chosen),
            side,
            int(ground.once),
        )

    def find(self, bodies: Indices, members: Indices) -> tuple[Indices, Indices]:
        """Return the triples and indices of states with three hands (N, L); −1 for none."""
        count, every, limbs = self.ground.reached.shape
        rows = np.arange(len(members))
        air = (members < 0).argmax(axis=1)
        key = air
        for limb in range(limbs - 1):
            key = key * count + members[rows, limb + (limb >= air)]
        triples, lifts = (
            np.full(len(rows), -1, dtype=np.intp),
            np.full(len(rows), -1, dtype=np.intp),
        )
        if len(self.keys) and len(self.bodies):
            at = np.minimum(np.searchsorted(self.keys, key), len(self.keys) - 1)
            triples = np.where(self.keys[at] == key, at, -1)
            whole = self.keys[self.triples] * every + self.bodies
            asked = key * every + bodies
            at = np.minimum(np.searchsorted(whole, asked), len(whole) - 1)
            lifts = np.where(whole[at] == asked, at, -1)
        return triples, lifts

    def beside(self, end: int) -> Indices:
        """Return the lifts next to which an end of the climb may be: 0 the start, 1 the goal."""
        from planner.search.compiled_graph import touching

        ground = self.ground
        fixed = ground.fixed[end]
        touched = touching(
            self.bodies, self.triples, self.members, ground.near, ground.reach,
            ground.end_masks[end], int(ground.once),
        )  # fmt: skip
        fits = (self.members < 0) | (fixed < 0) | (self.members == fixed)
        found: Indices = np.flatnonzero(touched & fits.all(axis=1)[self.triples])
        return found

    def lag(self, lifts: Indices, end: int) -> Array:
        """Return how far lifts are from an end of the climb, in shifts of the body."""
        rows, ground = self.members[self.triples[lifts]], self.ground
        far = np.zeros(len(lifts))
        for limb, column in enumerate(rows.T):
            far += np.where(column >= 0, ground.far[end, column, limb], 0.0)
        far += ground.hops[end, self.bodies[lifts]]
        return far


def _hops(beside: NDArray[np.bool_], end: Ends) -> Array:
    """Return the shifts from each body to the nearest of an end, shape (B,)."""
    found = np.full(len(beside), float(len(beside)))
    at, hop = np.asarray(end.bodies, dtype=bool).copy(), 0
    while at.any():
        found[at] = hop
        at = beside[at].any(axis=0) & (found == len(beside))
        hop += 1
    return found


def _masks(table: NDArray[np.bool_]) -> Indices:
    from planner.search.compiled_graph import bit_masks

    return bit_masks(np.ascontiguousarray(table))


def _unpacked(keys: Indices, count: int, limbs: int) -> Indices:
    """Return the placements (T, L) of triples from their numbers."""
    left, columns = keys, list[Indices]()
    for _ in range(limbs - 1):
        columns.append(left % count)
        left = left // count
    found = np.full((len(keys), limbs), -1, dtype=np.intp)
    rows, three = np.arange(len(keys)), np.array(columns[::-1]).reshape(limbs - 1, -1)
    for at in range(limbs - 1):
        limb = at + (at >= left)
        found[rows, limb] = three[at]
    return found
