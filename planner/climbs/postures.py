"""Choose the joint angles of all holds of a climb together.

A limb keeps its branch of inverse kinematics until it lifts. So each hold has one way: joint angles
that are followed through all poses of the body. Those are chosen with which limbs keep apart, and
joints bear what the hands hold, in all states of the climb.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from itertools import combinations, product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array
from planner import deadline
from planner.climbs.holds import HeldState, Stay, holds_of
from planner.climbs.joint_loads import LimbLoads
from planner.climbs.move_checks import MoveChecks
from planner.climbs.routing import ClimbStep
from planner.route import Failure

__all__ = ["PostureChoice", "Postures", "Swung"]

Swung = tuple[int, int, int, int]
"""A limb's swing: a hold with its way, and the next one with its own, by their numbers."""


@dataclass(frozen=True, eq=False)
class PostureChoice:
    """Joint angles of a climb.

    Attributes
    ----------
    start : dict of str to ndarray, shape (n,)
        Of each limb at the start [rad].
    placed : tuple of ndarray, shape (n,)
        Of the limb of each move on its new placement [rad].
    ways : tuple of int
        Number of each hold's way.
    """

    start: dict[str, Array]
    placed: tuple[Array, ...]
    ways: tuple[int, ...]


class _Pair(NamedTuple):
    """Table of the ways of two holds that keep limbs apart, (k, m), and the states with both."""

    fits: NDArray[np.bool_]
    states: tuple[HeldState, ...]


class _Conflict(NamedTuple):
    """A state that ways of some holds, by their indices, do not pass."""

    state: HeldState
    reason: str
    holds: set[int]


class Postures:
    """Choice of postures; what is found out of holds is kept for further climbs of the same wall.

    Parameters
    ----------
    checks : MoveChecks
    """

    def __init__(self, checks: MoveChecks) -> None:
        self._wall, self._checks = checks.wall, checks
        self._clearances, self._programs = checks.clearances, checks.programs
        self._ways, self._settings = checks.ways, checks.settings
        self._loads = dict[tuple[Stay, int, int], LimbLoads]()
        self._meets = dict[tuple[Stay, Stay, int, int], NDArray[np.bool_]]()
        self._off = dict[tuple[Stay, int, Stay, int], NDArray[np.bool_]]()
        self._moments = dict[tuple[object, ...], Array]()
        self._shares = dict[tuple[object, ...], float]()

    def with_checks(self, checks: MoveChecks) -> Postures:
        """Return the same choice by other checks of the same wall: loads and clearances stay known.

        What is known of whole states, of which some were refused, does not.
        """
        other = copy(self)
        other._checks, other._shares = checks, {}
        return other

    def choose(
        self, steps: Sequence[ClimbStep], without: Collection[Swung] = ()
    ) -> PostureChoice | list[Failure]:
        """Return joint angles for all holds of moves; or the parts of moves that have none.

        Swings of ``without`` are left out.
        """
        (holds, held), most = holds_of(steps), self._settings.tries
        failures = [
            self._without_way(hold, [each for each in held if i in each.holds])
            for i, hold in enumerate(holds)
            if not self._ways.of(hold)
        ]
        pairs = {} if failures else self._pairs(holds, held)
        failures += [
            self._met(holds, i, j, states)
            for (i, j), (fits, states) in pairs.items()
            if not fits.any()
        ]
        if failures:
            return sorted(failures, key=lambda each: each.move)
        chosen, failed = list[int](), (-1, held[0], "no posture was found")
        # depth first; back to the last hold in a conflict
        leaves = {each.air[1]: each.air[0] for each in held if each.phase == "swing"}
        orders, conflicts = [self._order(holds, chosen, leaves)], [set[int]()]
        while len(chosen) < len(holds) and most > 0:
            deadline.check("the postures of a climb were chosen")
            i = len(chosen)
            if not orders[i]:
                own = conflicts[i]
                if not own:
                    break
                back = max(own)
                del chosen[back:], orders[back + 1 :], conflicts[back + 1 :]
                conflicts[back] |= own - {back}
                continue
            most -= 1
            chosen.append(orders[i].pop(0))
            wrong = self._wrong(holds, held, chosen, pairs)
            if wrong is None and i in leaves:
                old = leaves[i]
                if (old, chosen[old], i, chosen[i]) in without:
                    state = next(each for each in held if each.air == (old, i))
                    wrong = _Conflict(state, "no swing was found", {old, i})
            if wrong is None:
                if len(chosen) < len(holds):
                    orders.append(self._order(holds, chosen, leaves))
                    conflicts.append(set())
                continue
            chosen.pop()
            conflicts[i] |= wrong.holds - {i}
            if i > failed[0] or (i == failed[0] and wrong.state.move > failed[1].move):
                failed = (i, wrong.state, wrong.reason)
        if len(chosen) < len(holds):
            _, state, reason = failed
            limb = state.state.members.index(-1) if state.air else None
            name = None if limb is None else self._wall.robot.limbs[limb]
            return [Failure(state.move, state.phase, name, reason)]
        limbs = self._wall.robot.limbs
        first = [self._ways.of(hold)[k][0] for hold, k in zip(holds, chosen, strict=True)]
        start = dict(zip(limbs, first, strict=False))
        return PostureChoice(start, tuple(first[len(limbs) :]), tuple(chosen))

    def refuse(
        self, steps: Sequence[ClimbStep], choice: PostureChoice, failure: Failure
    ) -> frozenset[Swung]:
        """Take a choice out of further ones whose moves have no plan at a part of a move.

        The ways of all holds there are not chosen together again. What is returned is how the limb
        would swing if it fails to, for the next choice to leave out.
        """
        holds, held = holds_of(steps)
        phase = "unload" if failure.phase == "open" else failure.phase
        for each in held:
            if (each.move, each.phase) == (failure.move, phase):
                self._shares[self._key(holds, each, choice.ways)] = np.inf
                if phase == "swing":
                    old, new = each.air
                    return frozenset({(old, choice.ways[old], new, choice.ways[new])})
        return frozenset()

    def _order(
        self, holds: Sequence[Stay], chosen: Sequence[int], leaves: Mapping[int, int]
    ) -> list[int]:
        """Return the ways of the next hold in the order in which they are tried.

        Those to which joints turn least from the hold that the limb leaves come first.
        """
        new = len(chosen)
        if new not in leaves:
            return [*range(len(self._ways.of(holds[new])))]
        old = leaves[new]
        start = self._ways.off(holds[old], -1)[chosen[old]][-1]
        far = [float(np.abs(off[-1] - start).max()) for off in self._ways.off(holds[new], 0)]
        return [int(k) for k in np.argsort(far, kind="stable")]

    def _wrong(
        self,
        holds: Sequence[Stay],
        held: Sequence[HeldState],
        chosen: Sequence[int],
        pairs: Mapping[tuple[int, int], _Pair],
    ) -> _Conflict | None:
        """Return a state that the way chosen last does not pass, and why."""
        new, limbs = len(chosen) - 1, self._wall.robot.limbs
        for other in range(new):
            pair = pairs.get((other, new))
            if pair is not None and not pair.fits[chosen[other], chosen[new]]:
                names = limbs[holds[other].limb], limbs[holds[new].limb]
                return _Conflict(pair.states[0], f"{names[0]} meets {names[1]}", {other, new})
        for each in held:
            if max(*each.holds, *each.air) == new:
                share = self._share(holds, each, chosen)
                if not share <= self._settings.torque_share:
                    reason = f"joints would bear {share:.3g} of their limits"
                    return _Conflict(each, reason, {*each.holds, *each.air})
        return None

    def _pairs(
        self, holds: Sequence[Stay], held: Sequence[HeldState]
    ) -> dict[tuple[int, int], _Pair]:
        """Return which ways of holds at the same time keep limbs apart."""
        found = dict[tuple[int, int], _Pair]()
        for each in held:
            for i, j in combinations(sorted(each.holds), 2):
                shape = len(self._ways.of(holds[i])), len(self._ways.of(holds[j]))
                fits, states = found.get((i, j), _Pair(np.ones(shape, dtype=bool), ()))
                for back in range(self._pieces(holds[i], each.holds[i], each)):
                    fits = fits & self._apart(holds, each, (i, j), back)
                found[i, j] = _Pair(fits, (*states, each))
            for i, j in product(each.air if each.closed is not None else (), each.holds):
                passes = self._passes(holds, each, i, j)
                one, two = min(i, j), max(i, j)
                passes = passes if i < j else passes.T
                fits, states = found.get((one, two), _Pair(np.ones_like(passes), ()))
                found[one, two] = _Pair(fits & passes, (*states, each))
        return found

    def _passes(
        self, holds: Sequence[Stay], held: HeldState, leaves: int, stays: int
    ) -> NDArray[np.bool_]:
        """Return with which ways a limb passes another straight off its hold, or onto it."""
        first, second, end = holds[leaves], holds[stays], -1 if held.phase == "unload" else 0
        at = self._ways.path(second)[1][held.holds[stays]]
        key = first, end, second, at
        if key not in self._off:
            still = np.array([way[at] for way in self._ways.of(second)])
            limbs, apart = (first.limb, second.limb), self._clearances.apart
            self._off[key] = np.array(
                [
                    apart(limbs, off[:-1], still).all(axis=0)
                    & apart(limbs, off[-1:], still, swings=True)[0]
                    for off in self._ways.off(first, end)
                ]
            )
        return self._off[key]

    def _apart(
        self, holds: Sequence[Stay], held: HeldState, pair: tuple[int, int], back: int
    ) -> NDArray[np.bool_]:
        """Return which ways of two holds keep limbs apart in a state, or halfway before it."""
        first, second = (holds[i] for i in pair)
        one, two = (self._ways.path(holds[i])[1][held.holds[i]] - back for i in pair)
        key = first, second, one, two
        if key not in self._meets:
            ways = [
                np.array([way[at] for way in self._ways.of(hold)])
                for hold, at in ((first, one), (second, two))
            ]
            self._meets[key] = self._clearances.apart((first.limb, second.limb), *ways)
        return self._meets[key]

    def _pieces(self, hold: Stay, part: int, held: HeldState) -> int:
        """Return the poses of the body to look at: a state's own, and those on the shift to it."""
        at = self._ways.path(hold)[1]
        return at[part] - at[part - 1] if held.phase == "shift" else 1

    def _met(self, holds: Sequence[Stay], i: int, j: int, states: Sequence[HeldState]) -> Failure:
        """Return where two limbs meet whatever their ways are, which is left out from now on."""
        limbs, fits = self._wall.robot.limbs, np.ones((1, 1), dtype=bool)
        first, second = holds[i], holds[j]
        for each in states:
            if i in each.air or j in each.air:
                continue
            for back in range(self._pieces(first, each.holds[i], each)):
                fits = fits & self._apart(holds, each, (i, j), back)
            if not np.any(fits):
                own = sorted(((first.limb, first.place), (second.limb, second.place)))
                self._checks.learn_pair(each.state.body, own[0], own[1])
                reason = f"{limbs[first.limb]} meets {limbs[second.limb]}"
                return Failure(each.move, each.phase, limbs[second.limb], reason)
        # they do as one of them leaves its hold, or comes to it
        each = next(each for each in states if i in each.air or j in each.air)
        leaves, stays = (first, second) if i in each.air else (second, first)
        reason = f"{limbs[leaves.limb]} has no straight way past {limbs[stays.limb]}"
        return Failure(each.move, each.phase, limbs[leaves.limb], reason)

    def _share(self, holds: Sequence[Stay], held: HeldState, chosen: Sequence[int]) -> float:
        """Return the least share of joint torque limits in a state."""
        key = self._key(holds, held, chosen)
        if key not in self._shares:
            own = {holds[i]: (chosen[i], part) for i, part in held.holds.items()}
            air = tuple((holds[i], chosen[i]) for i in held.air)
            loads = {hold.limb: self._loads_of(hold, *at) for hold, at in own.items()}
            more = np.zeros(6)
            if held.closed is not None:
                wrench = self._checks.closed_wrench(held.closed)
                if wrench is None:
                    return float(np.inf)
                more -= wrench
            moments = self._in_air(air, held) if air else np.zeros((1, 3))
            share = 0.0
            if held.closed is None:
                # most states fail by this
                share = self._checks.share_of_multiple(held.state, loads)
            if held.phase == "shift" and share <= self._settings.torque_share:
                share = max(share, self._share_halfway(held, own))
            for moment in moments:
                all_ = more + np.array([*np.zeros(3), *moment])
                if not share <= self._settings.torque_share:
                    break
                share = max(share, self._programs.share(held.state, loads, all_))
            self._shares[key] = share
        return self._shares[key]

    def _share_halfway(self, held: HeldState, own: Mapping[Stay, tuple[int, int]]) -> float:
        """Return the least share of joint torque limits halfway on the shift to a state."""
        wrenches, body, loads = self._wall.screening.wrenches, held.state.body, {}
        for hold, (way, part) in own.items():
            _, at = self._ways.path(hold)
            angles = self._ways.of(hold)[way][(at[part - 1] + at[part]) // 2]
            loads[hold.limb] = self._programs.loads(hold.limb, hold.place, body, angles)
            before = hold.bodies[part - 1]
        return self._programs.share(held.state, loads, 0.5 * (wrenches[before] - wrenches[body]))

    @staticmethod
    def _key(holds: Sequence[Stay], held: HeldState, chosen: Sequence[int]) -> tuple[object, ...]:
        """Return what the loads of a state depend on."""
        air = tuple((holds[i], chosen[i]) for i in held.air)
        own = ((holds[i], chosen[i], part) for i, part in held.holds.items())
        return held.state, held.phase, air, *own

    def _in_air(self, air: Sequence[tuple[Stay, int]], held: HeldState) -> Array:
        """Return moments that the weight of the limb in the air needs, shape (m, 3).

        They are those at its hold, or on the straight line in joint space from the end of the
        straight way off one hold to the beginning of that onto the next.
        """
        key = tuple(air), held.phase, held.state.body
        if key not in self._moments:
            (first, way), (last, goal) = air[0], air[-1]
            if held.closed is not None:
                end = -1 if held.phase == "unload" else 0
                angles = self._ways.of(first)[way][end][None]
            else:
                parts = np.linspace(0.0, 1.0, self._settings.swing_parts + 1)[:, None]
                off = self._ways.off(first, -1)[way][-1]
                angles = off + parts * (self._ways.off(last, 0)[goal][-1] - off)
            body = held.state.body
            self._moments[key] = np.array(
                [self._programs.moment(first.limb, body, each) for each in angles]
            )
        return self._moments[key]

    def _loads_of(self, hold: Stay, way: int, part: int) -> LimbLoads:
        key = hold, way, part
        if key not in self._loads:
            angles = self._ways.of(hold)[way][self._ways.path(hold)[1][part]]
            body = hold.bodies[part]
            self._loads[key] = self._programs.loads(hold.limb, hold.place, body, angles)
        return self._loads[key]

    def _without_way(self, hold: Stay, held: Sequence[HeldState]) -> Failure:
        """Return the part of a climb in which a hold has no way."""
        name = self._wall.robot.limbs[hold.limb]
        first = held[0]
        for m in range(1, len(hold.bodies) + 1):
            if self._ways.of(hold._replace(bodies=hold.bodies[:m], lifts=False)):
                continue
            if m == 1:
                reason = f"{name} has no clear way to its hold"
                return Failure(first.move, "swing" if hold.placed else "start", name, reason)
            shifts = [each.move for each in held if each.phase == "shift"]
            reason = f"{name} cannot keep its hold while the body shifts"
            return Failure(shifts[m - 2], "shift", name, reason)
        return Failure(held[-1].move, "open", name, f"{name} has no clear way back from its hold")
