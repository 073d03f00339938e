"""Wrench spaces of a stance's hands, linearised at a point where wrists are compliant or floating.

A point is a pose of each compliant or floating wrist, and loads of each other hand. A hand's set is
exact at that point. The set of a hand with a fixed wrist does not depend on the point.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from hand_models.base import Array, InvalidInputError, UnsupportedError
from hand_models.compliance import (
    CompliantHand,
    CompliantWrist,
    CompliantWrists,
    FloatingWrist,
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
    "error_at_rest",
    "wrist_at",
    "wrists_at",
]


@dataclass(frozen=True, eq=False)
class LinearisationPoint:
    """Point at which the hands' sets are linearised.

    Attributes
    ----------
    loads : tuple of ndarray, shape (m,)
        y of each hand. Fixed wrist: loads [N]; floating: twist of the wrist [m, rad]; compliant:
        tensions [N] and twist [m, rad].
    factor : float
        Multiple of the body wrench that is to be balanced.
    """

    loads: tuple[Array, ...]
    factor: float = 1.0


class ExactMeasure(NamedTuple):
    """Exact values of the model at the point at which the sets are linearised.

    Attributes
    ----------
    utilisation : float
        Largest utilisation of all limits.
    missing : float
        Sum of the absolute residuals of the balance, in `WRENCH_UNIT`.
    broken : float
        Largest violation of a hard row, in `LOAD_UNIT`; at least zero.
    effort : float
        Objective of `programs.effort`: sum of squared relative tensions and joint torques, plus,
        for hands with fixed wrists, small weights that make their other loads unique.
    excess : float
        Sum of the violations of all hard rows, in `LOAD_UNIT`.
    """

    utilisation: float
    missing: float
    broken: float
    effort: float
    excess: float

    def exact(self, hands: HandSets) -> bool:
        """Return whether the body is balanced and no hard row violated, to about 1e-8."""
        size = max(1.0, float(np.linalg.norm(hands.wrench)))
        # what is missing is relative, in `WRENCH_UNIT`; hard rows are in `LOAD_UNIT`
        return self.missing <= 2e-8 * size and self.broken <= 1e-8


class Sets(NamedTuple):
    """Wrench spaces of all hands linearised at a point, and their scaled rows for the programs."""

    spaces: tuple[WrenchSpace, ...]
    data: StanceData

    def measure(self, loads: Sequence[Array]) -> ExactMeasure:
        """Return utilisation, violations, effort of loads y; exact at the linearisation point."""
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
        """True if no row is NaN: at the point every phalanx in contact still reaches its rock."""
        return all(
            np.isfinite(hand.L).all() and np.isfinite(hand.G).all() for hand in self.data.hands
        )


@dataclass(frozen=True, eq=False)
class HandSets:
    """The hands of a stance, from which their wrench spaces at any point are computed.

    Attributes
    ----------
    spaces : tuple of WrenchSpace
        Set of each hand; of compliant or floating hands at rest.
    scaled : tuple of ScaledRows
        Scaled rows of these sets.
    wrists : tuple of FloatingWrist or None
        Model of each compliant or floating wrist; None for a fixed wrist.
    transports : ndarray, shape (hands, 6, 6)
        Ad(B←H): carries a wrench from the hand frame H to the body frame B.
    wrench : ndarray, shape (nb,)
        Right-hand side of the balance: body wrench, then prescribed components of hands' wrenches,
        in `WRENCH_UNIT`.
    held : tuple of ndarray, shape (nb − 6, 6)
        Selects each hand's prescribed wrench components, as in `HandData.of`.
    added : tuple of StanceConstraints
        Rows that the stance adds to each hand's set (included in `spaces`). Joint torques are those
        at the rest pose: a wrist moves by millimetres, which hardly moves joints.
    data : StanceData
        Scaled rows of all hands; `sets` replaces those of compliant or floating hands.
    floating : bool
        True if any wrist is compliant or floating.
    together : CompliantWrists or None
        All compliant wrists, computed in one call; None if there are none.
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
        """Build the hands of a stance from the attributes of the same names.

        ``known`` are the hands' scaled rows, if already computed.
        """
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
        scaled: tuple[ScaledRows, ...] | None = None,
    ) -> HandSets:
        """Return the same stance with other sets of its hands and, if given, other wrists.

        ``scaled`` are the scaled rows of the sets, if already computed.
        """
        own = self.wrists if wrists is None else wrists
        of_all = self.transports, self.wrench, self.held, self.added
        return HandSets.of(spaces, own, *of_all, scaled)

    def with_hands(
        self,
        found: Mapping[int, tuple[WrenchSpace, ScaledRows, HandData]],
        kept: NDArray[np.bool_],
    ) -> HandSets:
        """Return the same stance with other sets of hands with fixed wrists, by their index.

        Rows have the same names; ``kept`` is as of `HandRows`.
        """
        spaces, scaled, parts = list(self.spaces), list(self.scaled), list(self.data.hands)
        for h, each in found.items():
            spaces[h], scaled[h], parts[h] = each
        rows = self.data.rows.with_hands(parts, found)
        data = StanceData(tuple(parts), self.wrench, replace(rows, kept=kept))
        return replace(self, spaces=tuple(spaces), scaled=tuple(scaled), data=data)

    def turned(self, wrench: Array) -> HandSets:
        """Return the same hands for another body wrench, shape (6,), in B [N, N·m]."""
        needed = np.concatenate([wrench / programs.WRENCH_UNIT, self.wrench[len(wrench) :]])
        return replace(self, wrench=needed, data=self.data.turned(needed))

    @property
    def springy(self) -> bool:
        """True if the palm of a compliant or floating hand carries load by its springs."""
        return any(w is not None and w.palm_carries for w in self.wrists)

    def without_palms(self) -> HandSets:
        """Return the same hands, with palms of compliant or floating hands that carry nothing."""
        wrists = [None if w is None else w.without_palm() for w in self.wrists]
        return replace(self, wrists=tuple(wrists))

    def at_rest(self) -> LinearisationPoint:
        """Return the point with all wrists at rest, and no loads on hands with fixed wrists."""
        pairs = zip(self.wrists, self.spaces, strict=True)
        loads = [np.zeros(len(s.columns)) if w is None else w.at_rest for w, s in pairs]
        return LinearisationPoint(tuple(loads))

    def sets(
        self,
        point: LinearisationPoint,
        within: float | None = None,
        farthest: Sequence[Array] | None = None,
    ) -> Sets:
        """Return the hands' sets linearised at a point.

        Parameters
        ----------
        point : LinearisationPoint
            Wrist poses and loads at which the sets are linearised.
        within : float, optional
            Half width of the trust region of wrists, in `TWIST_UNIT`; by default unbounded.
        farthest : sequence of ndarray, shape (m,), optional
            Bound on the size of each component of each wrist's pose y: twist from rest [m, rad], of
            a compliant hand also tensions [N]. Requires ``within``.
        """
        if not self.floating:
            whole = point.factor == 1.0
            data = self.data if whole else self.data.turned(self.goal(point.factor))
            return Sets(self.spaces, data)
        self._prepare([y[None] for y in point.loads])
        spaces, parts = list(self.spaces), list(self.data.hands)
        for i, (wrist, y) in enumerate(zip(self.wrists, point.loads, strict=True)):
            if wrist is not None:
                reach = None if within is None else within * pose_units(wrist.columns)
                space = wrist.linearised(y, within=reach)
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
        """Return the curvature of each hand's rows, weighted by dual values, shape (m, m) each.

        ∂²(λ·L + μ·H + ν·G + ε·E)/∂z², by finite differences of slopes at a point; zero for fixed
        wrists. λ, μ, ν are the dual values (``duals``) of limits, hard rows and balance; ε are
        weights of the efforts (``efforts``), by default 0. ``within`` is the trust region in
        `TWIST_UNIT`.
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
                each = wrist.linearised_each(poses[i], within * units[i])
                for j, space in enumerate(each):
                    hand = self._floating_hand(i, space)[1]
                    slopes[j] = hand.L.T @ limit + hand.H.T @ hard + hand.G.T @ balance
                    if efforts is not None:
                        slopes[j] += hand.E.T @ efforts[i]
            bent.append((slopes[1:] - slopes[0]) / difference)
        return [0.5 * (part + part.T) for part in map(np.nan_to_num, bent)]

    def near_rest(self, point: LinearisationPoint) -> bool:
        """Return whether every wrist's twist from rest is small (at most 50 `TWIST_UNIT`)."""
        # in `TWIST_UNIT`: beyond, no twist is small
        return self.step(self.at_rest(), point.loads) <= 50.0

    def step(self, point: LinearisationPoint, loads: Sequence[Array]) -> float:
        """Return how far wrists move at most from a point to loads y, in units of `TWIST_UNIT`."""
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


def error_at_rest(wrist: FloatingWrist) -> float:
    """Return the largest error of a floating hand's set that is linearised at rest [N].

    The error is that of the wrench, moments over 0.1 m, where the set reaches farthest along ± each
    axis; poses at which a phalanx in contact loses its rock are left out.
    """
    space, error = wrist.linearised(), 0.0
    for direction in np.vstack([np.eye(6), -np.eye(6)]):
        slope = -(direction @ space.generators) * TWIST_UNIT
        result = scipy.optimize.linprog(
            slope, A_ub=space.A * TWIST_UNIT, b_ub=space.b, bounds=(None, None)
        )
        if result.status != 0 or result.x is None:
            continue
        twist = result.x * TWIST_UNIT
        exact = wrist.hand.loads(twist[None]).wrenches[0]
        off = np.abs((space.wrench(twist) - exact) * WRENCH_SCALE).max()
        error = max(error, float(off)) if math.isfinite(off) else error
    return error


def wrist_at(
    stance: Stance, index: int, settled: SettledHand, tension_limit: float | None = None
) -> FloatingWrist | None:
    """Return the wrist model of a stance's hand, by index; None if the wrist is fixed.

    ``settled`` is the closed hand; ``tension_limit`` caps its tensions [N].
    """
    hand = stance.hands[index]
    if hand.wrist == "fixed":
        return None
    try:
        if hand.wrist == "compliant":
            return CompliantWrist(
                CompliantHand(settled, scheme="tension"), tension_limit, hand.wrist_travel
            )
        return FloatingWrist(CompliantHand(settled, hand.tendon_preload), tension_limit)
    except InvalidInputError as error:
        if isinstance(error, UnsupportedError):
            error.field = "wrist"
        raise error.within(f"stance.hands[{index}]") from None


def wrists_at(
    stance: Stance, settled: Sequence[SettledHand], tension_limit: float | None = None
) -> tuple[FloatingWrist | None, ...]:
    """Return the model of each hand's wrist; see `wrist_at`."""
    return tuple([wrist_at(stance, i, hand, tension_limit) for i, hand in enumerate(settled)])
