"""The hands of a stance about a point: sets linearised there where wrists give way, or fixed.

A point is a pose of each wrist that gives way, and loads of each other hand; sets are exact there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy

from hand_models.base import Array, InvalidInputError, UnsupportedError
from hand_models.compliance import (
    CompliantHand,
    CompliantWrist,
    CompliantWrists,
    DrivenHand,
    FloatingWrist,
    PalmMode,
    pose_units,
)
from hand_models.hand import SettledHand
from hand_models.wrench_spaces import WRENCH_SCALE, WrenchSpace
from planner import programs
from planner.prepare.stance_constraints import StanceConstraints
from planner.programs import (
    TWIST_UNIT,
    WRIST_RANGE,
    HandData,
    Outcome,
    ScaledRows,
    StanceData,
    hands_data,
)
from planner.question import Stance

__all__ = [
    "ExactMeasure",
    "HandSets",
    "LinearisationPoint",
    "Sets",
    "widest_at_rest",
    "wrist_at",
    "wrists_at",
]


@dataclass(frozen=True, eq=False)
class LinearisationPoint:
    """Point about which the hands' sets are linearised.

    Attributes
    ----------
    loads : tuple of ndarray
        y of each hand: loads [N], the twist of a floating wrist [m, rad], or tensions and twist.
    palms : tuple of PalmMode or None
        How each floating hand's palm carries; None for a hand with a fixed wrist.
    factor : float
        How many times the body wrench is to be balanced.
    """

    loads: tuple[Array, ...]
    palms: tuple[PalmMode | None, ...]
    factor: float = 1.0


class ExactMeasure(NamedTuple):
    """Exact values of the model at a point, where the sets about it are exact.

    Attributes
    ----------
    utilisation : float
        Largest utilisation.
    missing : float
        Sum of the components of the body wrench that are missing, scaled.
    broken : float
        Largest violation of a hard row, scaled; not below zero.
    effort : float
        What `programs.effort` makes least: the sum of squared relative tensions and joint torques,
        and of fixed hands a little of what makes their other loads unique.
    excess : float
        Sum of the violations of all hard rows, scaled.
    """

    utilisation: float
    missing: float
    broken: float
    effort: float
    excess: float

    def exact(self, hands: HandSets) -> bool:
        """Return whether the body wrench is balanced and no hard row is broken."""
        size = max(1.0, float(np.linalg.norm(hands.wrench)))
        # what is missing is relative, in `WRENCH_UNIT`; hard rows are in `LOAD_UNIT`
        return self.missing <= 2e-8 * size and self.broken <= 1e-8


class Sets(NamedTuple):
    """The hands' sets about a point, and the program's data of them."""

    spaces: tuple[WrenchSpace, ...]
    data: StanceData

    def measure(self, loads: Sequence[Array]) -> ExactMeasure:
        """Return what loads do, exact for those of the point."""
        used, broken, excess, effort = -math.inf, 0.0, 0.0, 0.0
        for hand, y in zip(self.data.hands, loads, strict=True):
            z = y / hand.unit
            used = max(used, float((hand.L @ z + hand.l0).max()))
            over = np.maximum(hand.H @ z - hand.h, 0.0)
            broken, excess = max(broken, float(over.max(initial=0.0))), excess + float(over.sum())
            effort += float(np.sum((hand.E @ z + hand.e0) ** 2) + np.sum(hand.rest * z**2))
        missing = programs.body_wrench(self.data, loads) - self.data.wrench
        return ExactMeasure(used, float(np.abs(missing).sum()), broken, effort, excess)

    @property
    def finite(self) -> bool:
        """True if every phalanx still finds its rock."""
        return all(
            np.isfinite(hand.L).all() and np.isfinite(hand.G).all() for hand in self.data.hands
        )


@dataclass(frozen=True, eq=False)
class HandSets:
    """The hands of a stance.

    Attributes
    ----------
    spaces : tuple of WrenchSpace
        Of hands that give way, at rest with idle palms.
    scaled : tuple of ScaledRows
        Their rows.
    wrists : tuple of FloatingWrist or None
        None for hands with a fixed wrist.
    transports : ndarray, shape (hands, 6, 6)
        Ad(B←H).
    wrench : ndarray, shape (nb,)
        What the balance is to give: the body wrench, in `WRENCH_UNIT`, and components of hands'
        wrenches that are given.
    held : tuple of ndarray, shape (nb − 6, 6)
        Of `HandData.of`.
    added : tuple of StanceConstraints
        What the stance adds to each hand's set; `spaces` have it already. Joints are those at which
        the hand rests: a wrist that gives way by millimetres hardly moves them.
    data : StanceData
        Of hands with a fixed wrist; of floating ones a place to fill.
    floating : bool
        Whether any wrist gives way.
    together : CompliantWrists or None
        The compliant ones of them, if there are any.
    """

    spaces: tuple[WrenchSpace, ...]
    scaled: tuple[ScaledRows, ...]
    wrists: tuple[FloatingWrist | None, ...]
    transports: Array
    wrench: Array
    held: tuple[Array, ...]
    added: tuple[StanceConstraints, ...]
    data: StanceData
    floating: bool
    together: CompliantWrists | None

    @classmethod
    def of(
        cls,
        spaces: Sequence[WrenchSpace],
        wrists: tuple[FloatingWrist | None, ...],
        transports: Array,
        wrench: Array,
        held: tuple[Array, ...],
        added: tuple[StanceConstraints, ...],
        known: tuple[ScaledRows, ...] | None = None,
    ) -> HandSets:
        """Return the hands of a stance; parameters as the attributes, ``known`` as ``scaled``."""
        scaled = tuple(map(ScaledRows.of, spaces)) if known is None else known
        data = StanceData.of(hands_data(scaled, transports, held), wrench)
        floating = any(wrist is not None for wrist in wrists)
        of_all = wrists, transports, wrench, held, added
        compliant = [wrist for wrist in wrists if isinstance(wrist, CompliantWrist)]
        together = CompliantWrists(compliant) if compliant else None
        return cls(tuple(spaces), scaled, *of_all, data, floating, together)

    def with_sets(
        self,
        spaces: Sequence[WrenchSpace],
        wrists: tuple[FloatingWrist | None, ...] | None = None,
    ) -> HandSets:
        """Return the same stance with other sets of its hands, and other wrists."""
        own = self.wrists if wrists is None else wrists
        return HandSets.of(spaces, own, self.transports, self.wrench, self.held, self.added)

    def turned(self, wrench: Array) -> HandSets:
        """Return the same hands for another body wrench, shape (6,) [N, N·m]."""
        needed = np.concatenate([wrench / programs.WRENCH_UNIT, self.wrench[len(wrench) :]])
        return replace(self, wrench=needed, data=self.data.turned(needed))

    @property
    def springy(self) -> bool:
        """True if the palm of a compliant hand carries by its springs."""
        return any(isinstance(w, CompliantWrist) and w.palm_carries for w in self.wrists)

    def without_palms(self) -> HandSets:
        """Return the same hands, of whose compliant ones no palm carries."""
        wrists = [w.without_palm() if isinstance(w, CompliantWrist) else w for w in self.wrists]
        return replace(self, wrists=tuple(wrists))

    @property
    def idle(self) -> tuple[PalmMode | None, ...]:
        """Modes in which no floating hand's palm carries."""
        return tuple(None if wrist is None else "off" for wrist in self.wrists)

    def at_rest(self, palms: Sequence[PalmMode | None]) -> LinearisationPoint:
        """Return the point at which wrists are at rest, and the other hands carry nothing."""
        pairs = zip(self.wrists, self.spaces, strict=True)
        loads = [np.zeros(len(s.columns)) if w is None else w.at_rest for w, s in pairs]
        return LinearisationPoint(tuple(loads), tuple(palms))

    def sets(
        self,
        point: LinearisationPoint,
        within: float | None = None,
        farthest: Sequence[Array] | None = None,
    ) -> Sets:
        """Return the sets about a point.

        Parameters
        ----------
        point : LinearisationPoint
        within : float, optional
            A range about it for wrists, in `TWIST_UNIT`; by default as far as the rows let.
        farthest : sequence of ndarray, shape (6,), optional
            With a range, how far from rest each wrist's twist may be [m, rad].
        """
        if not self.floating:
            whole = point.factor == 1.0
            data = self.data if whole else self.data.turned(self.goal(point.factor))
            return Sets(self.spaces, data)
        self._prepare([y[None] for y in point.loads])
        spaces, parts = list(self.spaces), list(self.data.hands)
        for i, (wrist, y, palm) in enumerate(
            zip(self.wrists, point.loads, point.palms, strict=True)
        ):
            if wrist is not None:
                reach = None if within is None else within * pose_units(wrist.columns)
                space = wrist.linearised(y, palm, reach)
                if farthest is not None:
                    space = _near_rest(space, farthest[i])
                spaces[i], parts[i] = self._floating_hand(i, space)
        return Sets(tuple(spaces), StanceData.of(tuple(parts), self.goal(point.factor)))

    def _prepare(self, poses: Sequence[Array]) -> None:
        """Find the loads of all compliant hands at some poses of each in one call."""
        if self.together is not None:
            pairs = zip(self.wrists, poses, strict=True)
            self.together.prepare([at for w, at in pairs if isinstance(w, CompliantWrist)])

    def _floating_hand(self, i: int, space: WrenchSpace) -> tuple[WrenchSpace, HandData]:
        """Return the set of a floating hand with what the stance adds, and its data."""
        whole = self.added[i].on(space)
        part = HandData.of(whole, self.transports[i], self.held[i])
        # where a wrist is costs nothing by itself
        return whole, part._replace(rest=np.zeros(len(part.rest)))

    def goal(self, factor: float) -> Array:
        """Return the balance's right-hand side for a multiple of the body wrench, shape (nb,)."""
        if factor == 1.0:
            return self.wrench
        return np.concatenate([factor * self.wrench[:6], self.wrench[6:]])

    def curvature(
        self,
        point: LinearisationPoint,
        within: float,
        duals: Outcome,
        efforts: Sequence[Array] | None = None,
    ) -> list[Array]:
        """Return the curvature of each hand's rows, weighed by multipliers, shape (m, m).

        ∂²(λ·L + μ·H + ν·G + ε·E)/∂z², by differences of slopes; zero for fixed wrists. Weights ε
        of the rows of effort are none by default.
        """
        difference = 1e-3  # of slopes, in the units of poses
        balance, bent = duals.balance_dual, []
        assert balance is not None
        units = [hand.unit for hand in self.data.hands]
        poses = [
            np.vstack([y, y + difference * np.diag(unit)])
            for y, unit in zip(point.loads, units, strict=True)
        ]
        self._prepare(poses)
        for i, (wrist, y) in enumerate(zip(self.wrists, point.loads, strict=True)):
            slopes = np.zeros((1 + len(y), len(y)))
            if wrist is not None:
                limit, hard = duals.limit_duals[i], duals.hard_duals[i]
                each = wrist.linearised_each(poses[i], point.palms[i], within * units[i])
                for j, space in enumerate(each):
                    hand = self._floating_hand(i, space)[1]
                    slopes[j] = hand.L.T @ limit + hand.H.T @ hard + hand.G.T @ balance
                    if efforts is not None:
                        slopes[j] += hand.E.T @ efforts[i]
            bent.append((slopes[1:] - slopes[0]) / difference)
        return [0.5 * (part + part.T) for part in map(np.nan_to_num, bent)]

    def near_rest(self, point: LinearisationPoint) -> bool:
        """Return whether no wrist is farther from rest than a small twist."""
        # in `TWIST_UNIT`: beyond, no twist is small
        return self.step(self.at_rest(point.palms), point.loads) <= 50.0

    def step(self, point: LinearisationPoint, loads: Sequence[Array]) -> float:
        """Return how far the wrists move from a point to loads, in `TWIST_UNIT`."""
        moved = [
            float(np.abs((y - at) / pose_units(wrist.columns)).max())
            for wrist, y, at in zip(self.wrists, loads, point.loads, strict=True)
            if wrist is not None
        ]
        return max(moved, default=0.0)


def _near_rest(space: WrenchSpace, farthest: Array) -> WrenchSpace:
    """Return a set whose wrist, within its range, is also so far from rest at most [m, rad]."""
    ranges = np.array([row.limit == WRIST_RANGE for row in space.rows[len(space.s) :]])
    # rows of a range are ±ξ over its half width, in each component
    most = np.abs(space.H) @ farthest
    return replace(space, h=np.where(ranges, np.minimum(space.h, most), space.h))


def widest_at_rest(wrist: FloatingWrist) -> tuple[PalmMode, WrenchSpace, float]:
    """Return the widest set at rest over the palm's modes, and how far it is off at most [N].

    The widest has room for the largest ball of twists, in `TWIST_UNIT`. It is held against the
    model where it reaches farthest along ± each axis, if every phalanx finds its rock there.
    """
    palms = wrist.palm_modes()
    spaces = [wrist.linearised(palm=palm) for palm in palms]
    rooms = [_room(space) for space in spaces]
    best = int(np.argmax(rooms))
    space, error = spaces[best], 0.0
    for direction in np.vstack([np.eye(6), -np.eye(6)]):
        slope = -(direction @ space.generators) * TWIST_UNIT
        result = scipy.optimize.linprog(
            slope, A_ub=space.A * TWIST_UNIT, b_ub=space.b, bounds=(None, None)
        )
        if result.status != 0 or result.x is None:
            continue
        twist = result.x * TWIST_UNIT
        exact = wrist.hand.wrenches(wrist.hand.loads(twist[None]))[0]
        off = np.abs((space.wrench(twist) - exact) * WRENCH_SCALE).max()
        error = max(error, float(off)) if math.isfinite(off) else error
    return palms[best], space, error


def _room(space: WrenchSpace) -> float:
    """Return the radius of the largest ball within a set, in `TWIST_UNIT`; −∞ if it is empty."""
    rows = space.A * TWIST_UNIT
    sizes = np.linalg.norm(rows, axis=1)[:, None]
    goal = np.append(np.zeros(rows.shape[1]), -1.0)
    bounds = [*[(None, None)] * rows.shape[1], (0.0, None)]
    result = scipy.optimize.linprog(
        goal, A_ub=np.hstack([rows, sizes]), b_ub=space.b, bounds=bounds
    )
    return -math.inf if result.fun is None else -float(result.fun)


def wrist_at(
    stance: Stance, index: int, settled: SettledHand, tension_limit: float | None = None
) -> FloatingWrist | None:
    """Return how the hand of that index gives way; None if its wrist is fixed."""
    hand = stance.hands[index]
    if hand.wrist == "fixed":
        return None
    try:
        if hand.wrist == "compliant":
            return CompliantWrist(DrivenHand(settled), tension_limit, hand.wrist_travel)
        return FloatingWrist(CompliantHand(settled, hand.tendon_preload), tension_limit)
    except InvalidInputError as error:
        if isinstance(error, UnsupportedError):
            error.field = "wrist"
        raise error.within(f"stance.hands[{index}]") from None


def wrists_at(
    stance: Stance, settled: Sequence[SettledHand], tension_limit: float | None = None
) -> tuple[FloatingWrist | None, ...]:
    """Return how each hand gives way; see `wrist_at`."""
    return tuple([wrist_at(stance, i, hand, tension_limit) for i, hand in enumerate(settled)])
