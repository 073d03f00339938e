"""The conic programs of a stance, in CVXPY: their definition, readable as the mathematics.

Hand h has loads y_h with ``L_h y_h + l0_h ≤ u s_h`` (limits), ``H_h y_h ≤ h_h`` (hard rows) and the
wrench o_h + V_h y_h on the rock. Carried to the body, the rock's reactions give the body wrench W:

    Σ_h −Ad(B←H_h) (o_h + V_h y_h) = W.                                              (balance)

Below these six rows the balance has one for each component of a hand's wrench that is given
(`held`). What joints, caps and largest changes of tension say are rows of the hands' sets.

Seven programs share these rows:

=============  =============================================================================
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
only, is built once and solved with new data after.
"""

from __future__ import annotations

import threading
import warnings
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Final, NamedTuple, Self

import cvxpy as cp
import numpy as np

from hand_models.frames import Array
from planner.stance_data import Shape, StanceData

__all__ = [
    "SOLVER",
    "Curved",
    "Effort",
    "LoadFactor",
    "Margin",
    "Nearest",
    "Outcome",
    "Reach",
    "Reached",
    "TieBreak",
]

SOLVER: Final = "CLARABEL"

UNLIMITED: Final = 1e4
"""Box, in `LOAD_UNIT`, on loads at no matter what utilisation: far beyond any strength."""

SLACK: Final = 1e-6
"""What the tie-break may give away of the least utilisation; also its tolerance at a cap."""

SETTINGS: Final[dict[str, Any]] = {
    "equilibrate_enable": False,
    "presolve_enable": False,
    "chordal_decomposition_enable": False,
    "max_threads": 1,
    "tol_gap_abs": 1e-9,
    "tol_gap_rel": 1e-9,
    "tol_feas": 1e-9,
}
"""One physical scaling instead of equilibration; see the solver's documentation for the rest."""

CAREFUL: Final[dict[str, Any]] = {"max_threads": 1, "warm_start": False}
"""The solver's own defaults, for a second try, on a new solver: an old one keeps its settings."""

SOLVED: Final = (cp.OPTIMAL, cp.OPTIMAL_INACCURATE)


@dataclass(frozen=True, eq=False)
class Outcome:
    """How a program ended.

    Attributes
    ----------
    solved : bool
        Whether the solver says so; the plan is checked apart from it.
    status : str
        CVXPY's word.
    iterations : int
    value : float
        Objective, NaN if not solved.
    loads : tuple of ndarray
        y of each hand [N], of a floating one [m, rad]; empty if not solved.
    limit_duals, hard_duals : tuple of ndarray
        Multipliers of each hand's rows; empty if not solved.
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


class _Program(ABC):
    """A program for one shape of stance. Safe to call from several threads, one at a time."""

    def __init__(self, shape: Shape) -> None:
        self._lock = threading.Lock()
        self.shape = shape
        self.z = [cp.Variable(m) for m, _, _, _ in shape.hands]
        self.G = [cp.Parameter((shape.balance, m)) for m, _, _, _ in shape.hands]
        self.L: list[cp.Parameter] = []
        self.l0: list[cp.Parameter] = []
        self.H = [cp.Parameter((nh, m)) for m, _, nh, _ in shape.hands]
        self.h = [cp.Parameter(nh) for _, _, nh, _ in shape.hands]
        self._units = [np.ones(m) for m, _, _, _ in shape.hands]
        self.offset = cp.Parameter(shape.balance)
        """W − Σ g, or −Σ g where W is scaled apart."""
        self.reaction = sum(G @ z for G, z in zip(self.G, self.z, strict=True))
        self.hard = [H @ z <= h for H, z, h in zip(self.H, self.z, self.h, strict=True)]
        self.limits: list[cp.Constraint] = []
        self.balance: cp.Constraint
        self.problem = self.define()

    @abstractmethod
    def define(self) -> cp.Problem:
        """Return the problem, with `limits` and `balance` set."""

    @classmethod
    def built(cls, shape: Shape, *further: int) -> Self:
        """Return the program for a shape, built on first use and kept."""
        program = _built(cls, shape, *further)
        assert isinstance(program, cls)
        return program

    def utilisations(self) -> list[cp.Expression]:
        """Return each hand's limit rows as load over capacity."""
        self.L = [cp.Parameter((nl, m)) for m, nl, _, _ in self.shape.hands]
        self.l0 = [cp.Parameter(nl) for _, nl, _, _ in self.shape.hands]
        return [L @ z + l0 for L, z, l0 in zip(self.L, self.z, self.l0, strict=True)]

    def _load(self, data: StanceData) -> None:
        for i, hand in enumerate(data.hands):
            self.G[i].value = hand.G
            if self.L:
                self.L[i].value, self.l0[i].value = hand.L, hand.l0
            self.H[i].value, self.h[i].value = hand.H, hand.h
            self._units[i] = hand.unit
        self.offset.value = data.wrench - sum(hand.g for hand in data.hands)

    def _run(self) -> Outcome:
        """Solve; where the tuned settings fail, once more with the solver's own."""
        outcome = Outcome(False, "error", 0, float("nan"))
        for settings in (SETTINGS, CAREFUL):
            # a solve that diverges leaves loads whose squares overflow: its value is not finite
            with warnings.catch_warnings(), np.errstate(over="ignore"):
                warnings.simplefilter("ignore", UserWarning)
                try:
                    self.problem.solve(solver=SOLVER, enforce_dpp=True, **settings)
                except cp.SolverError:
                    outcome = Outcome(False, str(cp.SOLVER_ERROR), 0, float("nan"))
                    continue
            stats = self.problem.solver_stats
            iterations = int(stats.num_iters or 0) if stats else 0
            outcome = Outcome(False, self.problem.status, iterations, float("nan"))
            if self.problem.status in SOLVED and np.isfinite(self.problem.value):
                return Outcome(
                    solved=True,
                    status=self.problem.status,
                    iterations=iterations,
                    value=float(self.problem.value),
                    loads=tuple(
                        z.value * unit for z, unit in zip(self.z, self._units, strict=True)
                    ),
                    limit_duals=tuple(np.asarray(row.dual_value) for row in self.limits),
                    hard_duals=tuple(np.asarray(row.dual_value) for row in self.hard),
                    balance_dual=np.asarray(self.balance.dual_value),
                )
            if self.problem.status in (cp.INFEASIBLE, cp.UNBOUNDED):
                break
        return outcome


class Margin(_Program):
    """min u: the least utilisation."""

    def define(self) -> cp.Problem:
        self.u = cp.Variable()
        self.limits = [row <= self.u for row in self.utilisations()]
        self.balance = self.reaction == self.offset
        return cp.Problem(cp.Minimize(self.u), [self.balance, *self.limits, *self.hard])

    def solve(self, data: StanceData) -> Outcome:
        """Return the plan of least utilisation; ``value`` is that utilisation."""
        with self._lock:
            self._load(data)
            return self._run()


class Curved(_Program):
    """min u + ½ ‖R (z − z₀)‖²: least utilisation where sets are curved, or near to loads."""

    def define(self) -> cp.Problem:
        self.u = cp.Variable()
        size = sum(z.shape[0] for z in self.z)
        self.root = cp.Parameter((size, size))
        self.centre = cp.Parameter(size)
        self.limits = [row <= self.u for row in self.utilisations()]
        self.balance = self.reaction == self.offset
        bent = cp.sum_squares(self.root @ cp.hstack(self.z) - self.centre)
        rows = [self.balance, *self.limits, *self.hard]
        return cp.Problem(cp.Minimize(self.u + 0.5 * bent), rows)

    def solve(self, data: StanceData, root: Array, near: Sequence[Array]) -> Outcome:
        """Return the plan for the root R (M, M) of the curvature in all hands' z, about their y."""
        with self._lock:
            self._load(data)
            z = [y / hand.unit for hand, y in zip(data.hands, near, strict=True)]
            self.root.value = root
            self.centre.value = root @ np.concatenate(z)
            return self._run()


class TieBreak(_Program):
    """min Σ (tension / maximum)² under a cap on the utilisation: which plan is meant of those."""

    def define(self) -> cp.Problem:
        self.cap = cp.Parameter()
        self.weights = [cp.Parameter(z.shape[0], nonneg=True) for z in self.z]
        self.limits = [row <= self.cap for row in self.utilisations()]
        self.balance = self.reaction == self.offset
        effort = sum(
            cp.sum_squares(cp.multiply(weights, z))
            for weights, z in zip(self.weights, self.z, strict=True)
        )
        return cp.Problem(cp.Minimize(effort), [self.balance, *self.limits, *self.hard])

    def solve(self, data: StanceData, cap: float) -> Outcome:
        """Return the plan that is meant among those with utilisation at most ``cap``."""
        with self._lock:
            self._load(data)
            self.cap.value = cap
            # weights relative to the largest: the minimiser does not change
            largest = max(float(hand.tie.max(initial=0.0)) for hand in data.hands)
            for parameter, hand in zip(self.weights, data.hands, strict=True):
                parameter.value = hand.tie / largest
            return self._run()


class Effort(_Program):
    """min Σ ‖E z + e₀‖² under a cap: the least sum of squared relative tensions and torques.

    Small weights make loads unique that are neither: palms, lateral reactions, wrists.
    """

    def define(self) -> cp.Problem:
        self.cap = cp.Parameter()
        self.E = [cp.Parameter((ne, m)) for m, _, _, ne in self.shape.hands]
        self.e0 = [cp.Parameter(ne) for _, _, _, ne in self.shape.hands]
        self.weights = [cp.Parameter(z.shape[0], nonneg=True) for z in self.z]
        self.limits = [row <= self.cap for row in self.utilisations()]
        self.balance = self.reaction == self.offset
        effort = sum(
            cp.sum_squares(E @ z + e0) + cp.sum_squares(cp.multiply(weights, z))
            for E, e0, weights, z in zip(self.E, self.e0, self.weights, self.z, strict=True)
        )
        return cp.Problem(cp.Minimize(effort), [self.balance, *self.limits, *self.hard])

    def solve(self, data: StanceData, cap: float) -> Outcome:
        """Return the plan of least effort among those with utilisation at most ``cap``."""
        with self._lock:
            self._load(data)
            self.cap.value = cap
            for i, hand in enumerate(data.hands):
                self.E[i].value, self.e0[i].value = hand.E, hand.e0
                self.weights[i].value = hand.rest
            return self._run()


class LoadFactor(_Program):
    """max s: how many times the body wrench could be held at utilisation 1."""

    def define(self) -> cp.Problem:
        self.factor = cp.Variable(nonneg=True)
        self.wrench = cp.Parameter(self.shape.balance)
        self.limits = [row <= 1.0 for row in self.utilisations()]
        self.balance = self.reaction == self.offset + self.wrench * self.factor
        return cp.Problem(cp.Maximize(self.factor), [self.balance, *self.limits, *self.hard])

    def solve(self, data: StanceData) -> Outcome:
        """Return the largest load factor as ``value``; the body wrench must not be zero."""
        body, held = data.wrench.copy(), data.wrench.copy()
        body[6:], held[:6] = 0.0, 0.0
        size = float(np.abs(body).max())
        with self._lock:
            self._load(data.turned(held))
            # of unit size, or a small wrench and its large factor would defeat the solver
            self.wrench.value = body / size
            outcome = self._run()
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
        self.goal = cp.Parameter(self.directions)
        self.cap = cp.Parameter()
        self.B = cp.Parameter((self.shape.balance, self.directions))
        self.K = [cp.Parameter((nl, self.directions)) for _, nl, _, _ in self.shape.hands]
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
        with self._lock:
            self._load(data)
            self.goal.value, self.B.value, self.cap.value = goal, B, cap
            for i, hand in enumerate(data.hands):
                none = np.zeros((len(hand.l0), self.directions))
                self.K[i].value = none if K is None else K[i]
            outcome = self._run()
            t = self.t.value if outcome.solved else None
        return Reached(outcome, np.full(self.directions, np.nan) if t is None else np.asarray(t))


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
        box = [cp.abs(z) <= UNLIMITED for z in self.z]
        kept = [self.shortfall[count - self.kept :] == 0.0] if self.kept else []
        objective = cp.Minimize(cp.norm(self.shortfall))
        return cp.Problem(objective, [self.balance, *self.hard, *box, *kept])

    def solve(self, data: StanceData) -> Outcome:
        """Return the distance to the nearest body wrench, in `WRENCH_UNIT`, as ``value``."""
        with self._lock:
            self._load(data)
            return self._run()


@lru_cache(maxsize=64)
def _built(kind: type[_Program], shape: Shape, *further: int) -> _Program:
    return kind(shape, *further)


def margin(data: StanceData) -> Outcome:
    """Solve `Margin`, built once for each shape."""
    return Margin.built(data.shape).solve(data)


def curved(data: StanceData, root: Array, near: Sequence[Array]) -> Outcome:
    """Solve `Curved`, built once for each shape."""
    return Curved.built(data.shape).solve(data, root, near)


def tie_break(data: StanceData, cap: float) -> Outcome:
    """Solve `TieBreak`, built once for each shape."""
    return TieBreak.built(data.shape).solve(data, cap)


def effort(data: StanceData, cap: float) -> Outcome:
    """Solve `Effort`, built once for each shape."""
    return Effort.built(data.shape).solve(data, cap)


def load_factor(data: StanceData) -> Outcome:
    """Solve `LoadFactor`, built once for each shape."""
    return LoadFactor.built(data.shape).solve(data)


def reach(
    data: StanceData, goal: Array, B: Array, cap: float = 1.0, K: Sequence[Array] | None = None
) -> Reached:
    """Solve `Reach`, built once for each shape."""
    return Reach.built(data.shape, len(goal)).solve(data, goal, B, cap, K)


def nearest(data: StanceData) -> Outcome:
    """Solve `Nearest`, built once for each shape."""
    return Nearest.built(data.shape).solve(data)


def nearest_body(data: StanceData) -> Outcome:
    """Solve `Nearest` with all given wrenches of hands kept, built once for each shape."""
    return Nearest.built(data.shape, len(data.wrench) - 6).solve(data)
