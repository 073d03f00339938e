"""The conic programs of a stance, in CVXPY: their definition, readable as the mathematics.

Hand h has loads y_h with ``L_h y_h + l0_h ≤ u s_h`` (limits), ``H_h y_h ≤ h_h`` (hard rows) and the
wrench o_h + V_h y_h on the rock. Carried to the body, the rock's reactions give the body wrench W:

    Σ_h −Ad(B←H_h) (o_h + V_h y_h) = W.                                              (balance)

Below these six rows the balance has one for each component of a hand's wrench that is given
(`held`). What joints, caps and largest changes of tension say are rows of the hands' sets.

Eight programs share these rows:

=============  =============================================================================
`Unique`       min u + `TIE` · mean (tension / maximum)²       least utilisation, made unique
`Margin`       min u                              least utilisation; its duals are the prices
`Curved`       min u + ½ ‖R (z − z₀)‖²            with the curvature of floating hands
`TieBreak`     min Σ (tension / maximum)²         among plans of least utilisation
`Effort`       min Σ ‖E z + e₀‖²                  relative tensions and torques, under a cap
`LoadFactor`   max s with s W in place of W       at utilisation 1
`Reach`        max c·t with W + B t for W         how far body wrenches go, under a cap
`Nearest`      min ‖S (W − Σ …)‖                  hard rows alone, loads up to `UNLIMITED`
=============  =============================================================================

Everything is nondimensional: loads over `LOAD_UNIT` (a floating wrist's twist over `TWIST_UNIT`),
body wrenches over `WRENCH_UNIT`, limit rows over their capacities. Data enter as whole-block
parameters (disciplined parametrised programming), so a program depends on the shape of a stance
only, is compiled once and solved with new data after (`planner.programs.compiled`). Programs have
room for more than a stance, and one serves nearly all stances of so many hands (`Shape.with_room`).
"""

from __future__ import annotations

import math
import os
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, ClassVar, Final, NamedTuple, Self

import cvxpy as cp
import numpy as np

from hand_models.base import Array
from hand_models.hand import FINGERS
from planner import deadline
from planner.programs.compiled import OUT_OF_TIME, Compiled
from planner.programs.conic_extent import Extent
from planner.programs.stance_data import ROOM, Shape, StanceData

__all__ = [
    "SETTINGS",
    "SOLVER",
    "TIE",
    "Curved",
    "Effort",
    "LoadFactor",
    "Margin",
    "Nearest",
    "Outcome",
    "Reach",
    "Reached",
    "TieBreak",
    "Unique",
    "build_ahead",
    "tie_weight",
]

SOLVER: Final = "CLARABEL"

UNLIMITED: Final = 1e4
"""Box, in `LOAD_UNIT`, on loads at no matter what utilisation: far beyond any strength."""

SLACK: Final = 1e-6
"""What the tie-break may give away of the least utilisation; also its tolerance at a cap."""

TIE: Final = 8e-6
"""Weight of the mean square of relative tensions beside the utilisation."""

SHARP_SLACK: Final = 1e-9
"""The same where the least utilisation has all its digits."""

SETTINGS: Final[dict[str, Any]] = {
    "equilibrate_enable": False,
    "iterative_refinement_enable": False,
    "presolve_enable": False,
    "chordal_decomposition_enable": False,
    "max_threads": 1,
    "tol_gap_abs": 1e-9,
    "tol_gap_rel": 1e-9,
    "tol_feas": 1e-9,
}
"""One physical scaling instead of equilibration, and no refinement of solutions that are good."""

SHARP: Final[dict[str, Any]] = {**SETTINGS, "tol_gap_abs": 1e-11, "tol_gap_rel": 1e-11}
"""Where a small term of the objective decides."""

REFINED: Final[dict[str, Any]] = {**SETTINGS, "iterative_refinement_enable": True}
"""For a second try."""

CAREFUL: Final[dict[str, Any]] = {"max_threads": 1}
"""The solver's own defaults, for a third."""

SOLVED: Final = (cp.OPTIMAL, cp.OPTIMAL_INACCURATE)

_builders = [ThreadPoolExecutor(1, "program-builder")]
"""The one thread that builds programs: CVXPY counts its variables for all threads, and loses count
where two build at a time. Who cannot wait for it goes on without."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """How a program ended.

    Attributes
    ----------
    solved : bool
        Whether the solver says so; the plan is checked apart from it.
    status : str
        CVXPY's word, or `planner.programs.compiled.OUT_OF_TIME`.
    iterations : int
    value : float
        Objective, NaN if not solved.
    loads : tuple of ndarray
        y of each hand [N], of a floating one [m, rad]; empty if not solved.
    limit_duals, hard_duals : tuple of ndarray
        Multipliers of each hand's rows; where there is no solution, the proof of that. Empty if
        the solver has neither.
    balance_dual : ndarray or None
        Multipliers of the balance, shape (nb,).
    """

    solved: bool
    status: str
    iterations: int
    value: float
    loads: tuple[Array, ...] = ()
    limit_duals: tuple[Array, ...] = ()
    hard_duals: tuple[Array, ...] = ()
    balance_dual: Array | None = None


LATE: Final = Outcome(False, OUT_OF_TIME, 0, math.nan)
"""Of a program that is not built in time."""


class _Program(ABC):
    """A program for one shape of stance, compiled. Safe to call from several threads."""

    settings: ClassVar[Sequence[Mapping[str, Any]]] = (SETTINGS, REFINED, CAREFUL)

    def __init__(self, shape: Shape) -> None:
        self.shape = shape
        self.z = [cp.Variable(m) for m, _, _, _ in shape.hands]
        self.G = [cp.Parameter((shape.balance, m)) for m, _, _, _ in shape.hands]
        self.L: list[cp.Parameter] = []
        self.l0: list[cp.Parameter] = []
        self.H = [cp.Parameter((nh, m)) for m, _, nh, _ in shape.hands]
        self.h = [cp.Parameter(nh) for _, _, nh, _ in shape.hands]
        self.offset = cp.Parameter(shape.balance)
        """W − Σ g, or −Σ g where W is scaled apart."""
        self.reaction = sum(G @ z for G, z in zip(self.G, self.z, strict=True))
        self.hard = [H @ z <= h for H, z, h in zip(self.H, self.z, self.h, strict=True)]
        self.limits: list[cp.Constraint] = []
        self.own: list[cp.Parameter] = []
        """Parameters beside the stance's."""
        self.further: list[cp.Variable] = []
        """Variables beside the loads whose values are wanted."""
        self.balance: cp.Constraint
        self.problem = self.define()
        self.compiled = Compiled(
            self.problem,
            [*self.G, *self.L, *self.l0, *self.H, *self.h, self.offset, *self.own],
            [*self.z, *self.further],
            [self.balance, *self.limits, *self.hard],
            self.settings,
        )

    @abstractmethod
    def define(self) -> cp.Problem:
        """Return the problem, with `limits`, `balance`, `own` and `further` set."""

    @classmethod
    def built(cls, shape: Shape, *further: int) -> Self | None:
        """Return a program for a shape, built on first use and kept.

        It has room for other shapes, if there is a map to leave out what is not there. None if the
        deadline comes before: it will be there for a later question.
        """
        program = cls._awaited(shape.with_room(), *further)
        if program is not None and program.compiled.map is None:
            program = cls._awaited(shape, *further)
        return program

    @classmethod
    def _awaited(cls, shape: Shape, *further: int) -> Self | None:
        """Return the program for that very shape; None if the deadline comes before."""
        try:
            program = _built(cls, shape, *further).result(deadline.left())
        except TimeoutError:
            return None
        assert isinstance(program, cls)
        return program

    def utilisations(self) -> list[cp.Expression]:
        """Return each hand's limit rows as load over capacity."""
        self.L = [cp.Parameter((nl, m)) for m, nl, _, _ in self.shape.hands]
        self.l0 = [cp.Parameter(nl) for _, nl, _, _ in self.shape.hands]
        return [L @ z + l0 for L, z, l0 in zip(self.L, self.z, self.l0, strict=True)]

    def values(self, data: StanceData, *own: Any) -> list[Any]:
        """Return what the parameters are given."""
        hands = data.hands
        limits = [*(hand.L for hand in hands), *(hand.l0 for hand in hands)] if self.L else []
        return [
            *(hand.G for hand in hands),
            *limits,
            *(hand.H for hand in hands),
            *(hand.h for hand in hands),
            data.offset,
            *own,
        ]

    def run(self, data: StanceData, *own: Any) -> tuple[Outcome, list[Array]]:
        """Solve with the stance's data and the values of `own`.

        Returns
        -------
        outcome : Outcome
        further : list of ndarray
            Values of the variables `further`; empty where there is no solution.
        """
        hands = data.hands
        found = self.compiled.solve(self.values(data, *own), self._extent(data.shape))
        solved = found.status in SOLVED and math.isfinite(found.value)
        duals, first = found.multipliers, 1 + len(self.limits)
        outcome = Outcome(
            solved=solved,
            status=found.status,
            iterations=found.iterations,
            value=found.value if solved else math.nan,
            loads=tuple(z * hand.unit for z, hand in zip(found.variables, hands, strict=False))
            if solved
            else (),
            limit_duals=duals[1:first],
            hard_duals=duals[first:],
            balance_dual=duals[0] if duals else None,
        )
        return outcome, list(found.variables[len(hands) :]) if solved else []

    def _extent(self, shape: Shape) -> Extent:
        """Return how much there is of variables and constraints for a shape."""
        loads, limits, hard = [], [], []
        for m, nl, nh, _ in shape.hands:
            loads.append(m)
            limits.append(nl)
            hard.append(nh)
        if not self.limits:
            limits = []
        further = [variable.size for variable in self.further]
        return Extent((*loads, *further), (shape.balance, *limits, *hard), shape)


class Margin(_Program):
    """min u: the least utilisation."""

    def define(self) -> cp.Problem:
        self.u = cp.Variable()
        self.limits = [row <= self.u for row in self.utilisations()]
        self.balance = self.reaction == self.offset
        return cp.Problem(cp.Minimize(self.u), [self.balance, *self.limits, *self.hard])

    def solve(self, data: StanceData) -> Outcome:
        """Return the plan of least utilisation; ``value`` is that utilisation."""
        return self.run(data)[0]


class Unique(_Program):
    """min u + `TIE` · mean (tension / maximum)²: the plan that is meant, in one solve.

    A tension is at most u times its maximum, so the least u is exceeded by less than TIE u².
    """

    settings = (SHARP, REFINED, CAREFUL)

    def define(self) -> cp.Problem:
        self.u = cp.Variable()
        self.weights = [cp.Parameter(z.shape[0], nonneg=True) for z in self.z]
        self.own, self.further = [*self.weights], [self.u]
        self.limits = [row <= self.u for row in self.utilisations()]
        self.balance = self.reaction == self.offset
        ties = sum(
            cp.sum(cp.multiply(weights, cp.square(z)))
            for weights, z in zip(self.weights, self.z, strict=True)
        )
        rows = [self.balance, *self.limits, *self.hard]
        return cp.Problem(cp.Minimize(self.u + tie_weight(self.shape) * ties), rows)

    def solve(self, data: StanceData, share: float = 1.0) -> Outcome:
        """Return the plan of least utilisation; ``value`` is that utilisation.

        ``share``: how much of its weight the second term is given.
        """
        ties = [hand.tie for hand in data.hands]
        if share != 1.0:
            ties = [share * tie for tie in ties]
        outcome, further = self.run(data, *ties)
        return replace(outcome, value=float(further[0])) if further else outcome


def tie_weight(shape: Shape) -> float:
    """Return what `Unique` weighs the sum of squares with: `TIE` over the number of tendons."""
    return TIE / (len(FINGERS) * len(shape.hands))


class Curved(_Program):
    """min u + ½ ‖R (z − z₀)‖²: least utilisation where sets are curved, or near to loads."""

    def define(self) -> cp.Problem:
        self.u = cp.Variable()
        size = sum(z.shape[0] for z in self.z)
        self.root = [cp.Parameter((size, z.shape[0])) for z in self.z]
        self.centre = cp.Parameter(size)
        self.own = [*self.root, self.centre]
        self.limits = [row <= self.u for row in self.utilisations()]
        self.balance = self.reaction == self.offset
        parts = [root @ z for root, z in zip(self.root, self.z, strict=True)]
        bent = cp.sum_squares(sum(parts) - self.centre)
        rows = [self.balance, *self.limits, *self.hard]
        return cp.Problem(cp.Minimize(self.u + 0.5 * bent), rows)

    def solve(self, data: StanceData, root: Array, near: Sequence[Array]) -> Outcome:
        """Return the plan for the root R (M, M) of the curvature in all hands' z, about their y."""
        z = [y / hand.unit for hand, y in zip(data.hands, near, strict=True)]
        parts = np.split(root, np.cumsum([len(part) for part in z])[:-1], axis=1)
        return self.run(data, *parts, root @ np.concatenate(z))[0]


class TieBreak(_Program):
    """min Σ (tension / maximum)² under a cap on the utilisation: which plan is meant of those."""

    def define(self) -> cp.Problem:
        self.cap = cp.Parameter()
        self.weights = [cp.Parameter(z.shape[0], nonneg=True) for z in self.z]
        self.own = [self.cap, *self.weights]
        self.limits = [row <= self.cap for row in self.utilisations()]
        self.balance = self.reaction == self.offset
        effort = sum(
            cp.sum(cp.multiply(weights, cp.square(z)))
            for weights, z in zip(self.weights, self.z, strict=True)
        )
        return cp.Problem(cp.Minimize(effort), [self.balance, *self.limits, *self.hard])

    def solve(self, data: StanceData, cap: float) -> Outcome:
        """Return the plan that is meant among those with utilisation at most ``cap``."""
        # weights relative to the largest: the minimiser does not change
        largest = max(float(hand.tie.max(initial=0.0)) for hand in data.hands)
        return self.run(data, cap, *(hand.tie / largest for hand in data.hands))[0]


class Effort(_Program):
    """min Σ ‖E z + e₀‖² under a cap: the least sum of squared relative tensions and torques.

    Small weights make loads unique that are neither: palms, lateral reactions, wrists.
    """

    def define(self) -> cp.Problem:
        self.cap = cp.Parameter()
        self.E = [cp.Parameter((ne, m)) for m, _, _, ne in self.shape.hands]
        self.e0 = [cp.Parameter(ne) for _, _, _, ne in self.shape.hands]
        self.weights = [cp.Parameter(z.shape[0], nonneg=True) for z in self.z]
        self.own = [self.cap, *self.E, *self.e0, *self.weights]
        self.limits = [row <= self.cap for row in self.utilisations()]
        self.balance = self.reaction == self.offset
        effort = sum(
            cp.sum_squares(E @ z + e0) + cp.sum(cp.multiply(weights, cp.square(z)))
            for E, e0, weights, z in zip(self.E, self.e0, self.weights, self.z, strict=True)
        )
        return cp.Problem(cp.Minimize(effort), [self.balance, *self.limits, *self.hard])

    def solve(self, data: StanceData, cap: float) -> Outcome:
        """Return the plan of least effort among those with utilisation at most ``cap``."""
        hands = data.hands
        efforts = (*(hand.E for hand in hands), *(hand.e0 for hand in hands))
        return self.run(data, cap, *efforts, *(hand.rest for hand in hands))[0]


class LoadFactor(_Program):
    """max s: how many times the body wrench could be held at utilisation 1."""

    def define(self) -> cp.Problem:
        self.factor = cp.Variable(nonneg=True)
        self.wrench = cp.Parameter(self.shape.balance)
        self.own = [self.wrench]
        self.limits = [row <= 1.0 for row in self.utilisations()]
        self.balance = self.reaction == self.offset + self.wrench * self.factor
        return cp.Problem(cp.Maximize(self.factor), [self.balance, *self.limits, *self.hard])

    def solve(self, data: StanceData) -> Outcome:
        """Return the largest load factor as ``value``; the body wrench must not be zero."""
        body, held = data.wrench.copy(), data.wrench.copy()
        body[6:], held[:6] = 0.0, 0.0
        size = float(np.abs(body).max())
        # of unit size, or a small wrench and its large factor would defeat the solver
        outcome, _ = self.run(data.turned(held), body / size)
        return replace(outcome, value=outcome.value / size)


class Reach(_Program):
    """max c·t: how far along the columns of B the balance can go, under a cap.

    The limit rows may change with t, too, as those of joints do with the body's acceleration:
    L z + l0 + K t ≤ cap.
    """

    def __init__(self, shape: Shape, directions: int) -> None:
        self.directions = directions
        super().__init__(shape)

    def define(self) -> cp.Problem:
        self.t = cp.Variable(self.directions)
        self.further = [self.t]
        self.goal = cp.Parameter(self.directions)
        self.cap = cp.Parameter()
        self.B = cp.Parameter((self.shape.balance, self.directions))
        self.K = [cp.Parameter((nl, self.directions)) for _, nl, _, _ in self.shape.hands]
        self.own = [self.goal, self.B, self.cap, *self.K]
        self.limits = [
            row + K @ self.t <= self.cap for row, K in zip(self.utilisations(), self.K, strict=True)
        ]
        self.balance = self.reaction == self.offset + self.B @ self.t
        return cp.Problem(cp.Maximize(self.goal @ self.t), [self.balance, *self.limits, *self.hard])

    def solve(
        self,
        data: StanceData,
        goal: Array,
        B: Array,
        cap: float = 1.0,
        K: Sequence[Array] | None = None,
    ) -> Reached:
        """Return the farthest t for the goal c (k,), with B (nb, k) and K (nl, k) of each hand."""
        if K is None:
            K = [np.zeros((len(hand.l0), self.directions)) for hand in data.hands]
        outcome, further = self.run(data, goal, B, cap, *K)
        return Reached(outcome, further[0] if further else np.full(self.directions, np.nan))


class Reached(NamedTuple):
    """How `Reach` ended, and the t it came to, shape (k,), NaN if it was not solved."""

    outcome: Outcome
    t: Array


class Nearest(_Program):
    """min ‖W − w‖ over all body wrenches w that loads up to `UNLIMITED` can give.

    The last ``kept`` rows of the balance, of wrenches that hands are given, are kept exactly; the
    others count like the body's.
    """

    def __init__(self, shape: Shape, kept: int = 0) -> None:
        self.kept = kept
        super().__init__(shape)

    def define(self) -> cp.Problem:
        count = self.shape.balance
        self.shortfall = cp.Variable(count)
        self.balance = self.reaction + self.shortfall == self.offset
        box = [sign * z <= UNLIMITED for z in self.z for sign in (1.0, -1.0)]
        kept = [self.shortfall[count - self.kept :] == 0.0] if self.kept else []
        objective = cp.Minimize(cp.norm(self.shortfall))
        return cp.Problem(objective, [self.balance, *self.hard, *box, *kept])

    def solve(self, data: StanceData) -> Outcome:
        """Return the distance to the nearest body wrench, in `WRENCH_UNIT`, as ``value``."""
        return self.run(data)[0]


@lru_cache(maxsize=128)
def _built(kind: type[_Program], shape: Shape, *further: int) -> Future[_Program]:
    return _builders[0].submit(kind, shape, *further)


def build_ahead(hands: int) -> None:
    """Begin to build what plans of up to so many hands with fixed wrists need; do not wait for it.

    So the first of them need not wait for it either.
    """
    for count in range(hands, 0, -1):
        room = Shape(6, (ROOM,) * count)
        for kind in (Unique, LoadFactor):
            _built(kind, room)


def _after_fork() -> None:
    """Begin anew in a forked process: threads, and what they held, did not come along."""
    _builders[0] = ThreadPoolExecutor(1, "program-builder")
    _built.cache_clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)


def _ask(kind: Any, data: StanceData, *question: Any, further: Sequence[int] = ()) -> Outcome:
    """Solve a program of that kind, if it is there in time."""
    program = kind.built(data.shape, *further)
    outcome: Outcome = LATE if program is None else program.solve(data, *question)
    return outcome


def margin(data: StanceData) -> Outcome:
    """Solve `Margin`, built once for each shape."""
    return _ask(Margin, data)


def unique(data: StanceData, share: float = 1.0) -> Outcome:
    """Solve `Unique`, built once for each shape."""
    return _ask(Unique, data, share)


def curved(data: StanceData, root: Array, near: Sequence[Array]) -> Outcome:
    """Solve `Curved`, built once for each shape."""
    return _ask(Curved, data, root, near)


def tie_break(data: StanceData, cap: float) -> Outcome:
    """Solve `TieBreak`, built once for each shape."""
    return _ask(TieBreak, data, cap)


def least_tensions(data: StanceData, utilisation: float) -> Outcome:
    """Solve `TieBreak` at a utilisation that has all its digits, or where needed near it."""
    outcome = LATE
    for slack in (SHARP_SLACK, SLACK):
        outcome = tie_break(data, utilisation + slack * max(1.0, abs(utilisation)))
        if outcome.solved or deadline.expired():
            break
    return outcome


def effort(data: StanceData, cap: float) -> Outcome:
    """Solve `Effort`, built once for each shape."""
    return _ask(Effort, data, cap)


def load_factor(data: StanceData) -> Outcome:
    """Solve `LoadFactor`, built once for each shape."""
    return _ask(LoadFactor, data)


def reach(
    data: StanceData, goal: Array, B: Array, cap: float = 1.0, K: Sequence[Array] | None = None
) -> Reached:
    """Solve `Reach`, built once for each shape."""
    program = Reach.built(data.shape, len(goal))
    if program is None:
        return Reached(LATE, np.full(len(goal), np.nan))
    return program.solve(data, goal, B, cap, K)


def nearest(data: StanceData) -> Outcome:
    """Solve `Nearest`, built once for each shape."""
    return _ask(Nearest, data)


def nearest_body(data: StanceData) -> Outcome:
    """Solve `Nearest` with all given wrenches of hands kept, built once for each shape."""
    return _ask(Nearest, data, further=(len(data.wrench) - 6,))
