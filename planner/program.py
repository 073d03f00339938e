"""The conic programs of a stance, in CVXPY: their definition, readable as the mathematics.

Hand h has loads y_h with ``L_h y_h + l0_h ≤ u s_h`` (limits), ``H_h y_h ≤ h_h`` (hard rows) and the
wrench o_h + V_h y_h on the rock. Carried to the body, the rock's reactions give the body wrench W:

    Σ_h −Ad(B←H_h) (o_h + V_h y_h) = W.                                              (balance)

Five programs share these rows:

=============  =============================================================================
`Margin`       min u                              least utilisation; its duals are the prices
`Curved`       min u + ½ ‖R (z − z₀)‖²            with the curvature of floating hands
`Effort`       min Σ (tension / maximum)²         the tie-break, at the least utilisation
`LoadFactor`   max s with s W in place of W       at utilisation 1
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

from hand_models.floating_wrist import WRIST
from hand_models.frames import Array
from hand_models.wrench_space import WrenchSpace
from hand_models.wrist_limit import pose_units

__all__ = [
    "LOAD_UNIT",
    "SOLVER",
    "TWIST_UNIT",
    "WRENCH_UNIT",
    "Curved",
    "Effort",
    "HandData",
    "LoadFactor",
    "Margin",
    "Nearest",
    "Outcome",
    "Shape",
    "StanceData",
]

SOLVER: Final = "CLARABEL"

LOAD_UNIT: Final = 100.0
"""Scale of a hand's loads y [N]."""

TWIST_UNIT: Final = pose_units(WRIST)
"""Scale of a floating wrist's twist y [m, rad]: about what loads a hand by `LOAD_UNIT`."""

WRENCH_UNIT: Final = np.array([300.0, 300.0, 300.0, 30.0, 30.0, 30.0])
"""Scale of a body wrench [N, N·m]."""

UNLIMITED: Final = 1e4
"""Box, in `LOAD_UNIT`, on loads at no matter what utilisation: far beyond any strength."""

SLACK: Final = 1e-6
"""What the tie-break may give away of the least utilisation; also its tolerance at a cap."""

WRIST_RANGE: Final = "wrist_range"
"""Name of the hard rows within which a floating hand's set is linearised."""

SECONDARY: Final = 1e-4
"""Weight in the tie-break of loads that are not tensions: enough to make them unique."""

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

STATIONARY: Final = 1e-5
"""How far multipliers may be from stationary, and below zero, to count as a bound."""

SOLVED: Final = (cp.OPTIMAL, cp.OPTIMAL_INACCURATE)


class HandData(NamedTuple):
    """One hand's rows, nondimensional.

    Attributes
    ----------
    G, g : ndarray, shapes (6, m), (6,)
        Its part of the body wrench, G z + g.
    L, l0 : ndarray, shapes (nl, m), (nl,)
        Utilisations L z + l0.
    H, h : ndarray, shapes (nh, m), (nh,)
        Hard rows H z ≤ h.
    effort : ndarray, shape (m,)
        Weights of z in the tie-break.
    unit : ndarray, shape (m,)
        Of z: the loads are ``y = unit z`` [N], of a floating wrist [m, rad].
    """

    G: Array
    g: Array
    L: Array
    l0: Array
    H: Array
    h: Array
    effort: Array
    unit: Array

    @classmethod
    def of(cls, space: WrenchSpace, transport: Array, reach: Array | None = None) -> HandData:
        """Scale a hand's set.

        Parameters
        ----------
        space : WrenchSpace
        transport : ndarray, shape (6, 6)
            Ad(B←H).
        reach : ndarray, shape (m,), optional
            The maximum of each column's load [N], for the tie-break; tensions come first. A
            floating wrist's twist is measured by its unit.
        """
        carried = -transport / WRENCH_UNIT[:, None]
        weights = np.array(
            [1.0 if name.endswith("/tension") else SECONDARY**0.5 for name in space.columns]
        )
        floats = space.columns == WRIST
        unit = TWIST_UNIT if floats else np.full(len(space.columns), LOAD_UNIT)
        # hard rows are in newtons, but for those of a wrist's range
        ranges = [row.limit == WRIST_RANGE for row in space.rows[len(space.s) :]]
        over = np.where(ranges, 1.0, 1.0 / LOAD_UNIT)
        return cls(
            G=carried @ space.generators * unit,
            g=carried @ space.origin,
            L=space.L / space.s[:, None] * unit,
            l0=space.l0 / space.s,
            H=space.H * unit * over[:, None],
            h=space.h * over,
            effort=weights * (1.0 if reach is None else unit / reach),
            unit=unit,
        )

    @property
    def shape(self) -> tuple[int, int, int]:
        """(m, nl, nh)."""
        return self.G.shape[1], len(self.l0), len(self.h)


@dataclass(frozen=True, eq=False)
class StanceData:
    """All hands of a stance, and the scaled body wrench (6,) they are to balance."""

    hands: tuple[HandData, ...]
    wrench: Array

    @property
    def shape(self) -> Shape:
        """What a program is built for."""
        return tuple(hand.shape for hand in self.hands)


Shape = tuple[tuple[int, int, int], ...]


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
        Multipliers of the balance, shape (6,).
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
        self.z = [cp.Variable(m) for m, _, _ in shape]
        self.G = [cp.Parameter((6, m)) for m, _, _ in shape]
        self.L = [cp.Parameter((nl, m)) for m, nl, _ in shape]
        self.l0 = [cp.Parameter(nl) for _, nl, _ in shape]
        self.H = [cp.Parameter((nh, m)) for m, _, nh in shape]
        self.h = [cp.Parameter(nh) for _, _, nh in shape]
        self._units = [np.ones(m) for m, _, _ in shape]
        self.offset = cp.Parameter(6)
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
    def built(cls, shape: Shape) -> Self:
        """Return the program for a shape, built on first use and kept."""
        program = _built(cls, shape)
        assert isinstance(program, cls)
        return program

    def utilisations(self) -> list[cp.Expression]:
        """Return each hand's limit rows as load over capacity."""
        return [L @ z + l0 for L, z, l0 in zip(self.L, self.z, self.l0, strict=True)]

    def _load(self, data: StanceData) -> None:
        for i, hand in enumerate(data.hands):
            self.G[i].value = hand.G
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


class Effort(_Program):
    """min Σ (tension / maximum)² under a cap on the utilisation."""

    def define(self) -> cp.Problem:
        self.cap = cp.Parameter()
        self.effort = [cp.Parameter(z.shape[0], nonneg=True) for z in self.z]
        self.limits = [row <= self.cap for row in self.utilisations()]
        self.balance = self.reaction == self.offset
        effort = sum(
            cp.sum_squares(cp.multiply(weight, z))
            for weight, z in zip(self.effort, self.z, strict=True)
        )
        return cp.Problem(cp.Minimize(effort), [self.balance, *self.limits, *self.hard])

    def solve(self, data: StanceData, cap: float) -> Outcome:
        """Return the plan of least effort among those with utilisation at most ``cap``."""
        with self._lock:
            self._load(data)
            self.cap.value = cap
            # weights relative to the largest: the minimiser does not change
            largest = max(float(hand.effort.max(initial=0.0)) for hand in data.hands)
            for parameter, hand in zip(self.effort, data.hands, strict=True):
                parameter.value = hand.effort / largest
            return self._run()


class LoadFactor(_Program):
    """max s: how many times the body wrench could be held at utilisation 1."""

    def define(self) -> cp.Problem:
        self.factor = cp.Variable(nonneg=True)
        self.wrench = cp.Parameter(6)
        self.limits = [row <= 1.0 for row in self.utilisations()]
        self.balance = self.reaction == self.offset + self.wrench * self.factor
        return cp.Problem(cp.Maximize(self.factor), [self.balance, *self.limits, *self.hard])

    def solve(self, data: StanceData) -> Outcome:
        """Return the largest load factor as ``value``; the wrench must not be zero."""
        size = float(np.abs(data.wrench).max())
        with self._lock:
            self._load(StanceData(data.hands, np.zeros(6)))
            # of unit size, or a small wrench and its large factor would defeat the solver
            self.wrench.value = data.wrench / size
            outcome = self._run()
        return replace(outcome, value=outcome.value / size)


class Nearest(_Program):
    """min ‖W − w‖ over all body wrenches w that loads up to `UNLIMITED` can give."""

    def define(self) -> cp.Problem:
        self.shortfall = cp.Variable(6)
        self.balance = self.reaction + self.shortfall == self.offset
        box = [cp.abs(z) <= UNLIMITED for z in self.z]
        return cp.Problem(cp.Minimize(cp.norm(self.shortfall)), [self.balance, *self.hard, *box])

    def solve(self, data: StanceData) -> Outcome:
        """Return the distance to the nearest body wrench, in `WRENCH_UNIT`, as ``value``."""
        with self._lock:
            self._load(data)
            return self._run()


@lru_cache(maxsize=64)
def _built(kind: type[_Program], shape: Shape) -> _Program:
    return kind(shape)


def margin(data: StanceData) -> Outcome:
    """Solve `Margin`, built once for each shape."""
    return Margin.built(data.shape).solve(data)


def curved(data: StanceData, root: Array, near: Sequence[Array]) -> Outcome:
    """Solve `Curved`, built once for each shape."""
    return Curved.built(data.shape).solve(data, root, near)


def effort(data: StanceData, cap: float) -> Outcome:
    """Solve `Effort`, built once for each shape."""
    return Effort.built(data.shape).solve(data, cap)


def load_factor(data: StanceData) -> Outcome:
    """Solve `LoadFactor`, built once for each shape."""
    return LoadFactor.built(data.shape).solve(data)


def nearest(data: StanceData) -> Outcome:
    """Solve `Nearest`, built once for each shape."""
    return Nearest.built(data.shape).solve(data)


def body_wrench(data: StanceData, loads: Sequence[Array]) -> Array:
    """Return the scaled body wrench of the hands' loads y, shape (6,)."""
    parts = [hand.G @ (y / hand.unit) + hand.g for hand, y in zip(data.hands, loads, strict=True)]
    return np.asarray(sum(parts, start=np.zeros(6)))


def least_bound(data: StanceData, outcome: Outcome) -> float:
    """Return a lower bound of the least utilisation from the multipliers of `Margin`.

    With λ of the limit rows (Σ λ = 1), μ of the hard rows and ν of the balance, every plan has
    u ≥ λ·l0 − μ·h − ν·(W − g), as far as Lᵀλ + Hᵀμ + Gᵀν is zero; −∞ where it is not.
    """
    assert outcome.balance_dual is not None
    nu = outcome.balance_dual
    bound = -float(nu @ (data.wrench - sum(hand.g for hand in data.hands)))
    leak = abs(1.0 - sum(float(limit.sum()) for limit in outcome.limit_duals))
    for hand, limit, hard in zip(data.hands, outcome.limit_duals, outcome.hard_duals, strict=True):
        bound += float(limit @ hand.l0 - hard @ hand.h)
        leak += float(np.abs(hand.L.T @ limit + hand.H.T @ hard + hand.G.T @ nu).sum())
        if min(limit.min(initial=0.0), hard.min(initial=0.0)) < -STATIONARY * max(
            1.0, abs(outcome.value)
        ):
            return -np.inf
    return bound if leak <= STATIONARY * max(1.0, abs(outcome.value)) else -np.inf
