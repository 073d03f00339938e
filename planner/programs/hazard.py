"""The program of least hazard: the sum of powers of tiles' uses, by power cones.

Tile i has the rows L_k z + l0_k of its half-planes, k ∈ K_i, and its use u_i is the largest of
them, or zero. The program has in place of the cap on these rows one variable for each tile.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final, NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from planner.programs.conic import Columns, ConicProgram, Outcome
from planner.programs.program import tie_weight
from planner.programs.stance_data import StanceData
from planner.programs.stance_program import CLARABEL_SETTINGS, Definition, StanceProgram

__all__ = ["Hazard", "TilePowers"]

EQUILIBRATED_SETTINGS: Final[dict[str, Any]] = {
    "presolve_enable": False,
    "chordal_decomposition_enable": False,
    "max_threads": 1,
}
"""Clarabel's own options, with equilibration and refinement: slower, and right where power cones
defeat `CLARABEL_SETTINGS`."""


class TilePowers(NamedTuple):
    """Tiles whose uses count in the hazard Σ w_i u_i^m_i, and their rows.

    Attributes
    ----------
    rows, tile_of : ndarray of int, shape (k,)
        Limit rows of half-planes, among those of all hands; the tile of each.
    weights, moduli : ndarray, shape (T,)
        w_i > 0 and m_i > 1.
    """

    rows: Indices
    tile_of: Indices
    weights: Array
    moduli: Array

    def uses(self, utilisations: Array) -> Array:
        """Return the use of each tile, shape (T,), from the utilisations of all limit rows."""
        found = np.zeros(len(self.weights))
        np.maximum.at(found, self.tile_of, utilisations[self.rows])
        return found

    def terms(self, uses: Array) -> Array:
        """Return the term w u^m of each tile, shape (T,)."""
        return np.asarray(self.weights * uses**self.moduli)

    def conjugate(self, slopes: Array, cap: float) -> float:
        """Return Σ_i of the largest s_i u − w_i u^m_i over uses u from 0 to a cap.

        ``slopes``: s_i ≥ 0 of each tile, shape (T,).
        """
        at = (slopes / (self.weights * self.moduli)) ** (1.0 / (self.moduli - 1.0))
        uses = np.minimum(at, cap)
        return float(slopes @ uses - self.terms(uses).sum())

    def slopes(self, uses: Array) -> Array:
        """Return the derivative of each tile's term by its use, shape (T,)."""
        return np.asarray(self.weights * self.moduli * uses ** (self.moduli - 1.0))


class Hazard(StanceProgram):
    """min Σ_i w_i u_i^m_i + ε Σ w z² under a cap on the utilisation; ε makes the loads unique.

    The variables are τ_i = u_i / cap and v_i ≥ τ_i^m_i:

        min Σ_i w_i cap^m_i v_i + ε Σ w z²   with   L_k z + l0_k ≤ cap τ_i  (k ∈ K_i),   τ_i ≤ 1,
                                                    |τ_i| ≤ v_i^(1/m_i).

    Parameters
    ----------
    data : StanceData
    cap : float
        Cap on the utilisation, above zero.
    tiles : TilePowers
        Weights such that the sum is about 1.
    """

    def __init__(self, data: StanceData, cap: float, tiles: TilePowers) -> None:
        super().__init__(data)
        self.cap, self.tiles = cap, tiles
        self.costs = tiles.weights * cap**tiles.moduli
        self.small = tie_weight(len(data.hands)) * data.rows.tie
        self.tau = np.zeros((len(self.L), len(tiles.weights)))
        self.tau[tiles.rows, tiles.tile_of] = cap
        self.caps = np.full(len(self.L), cap)
        self.caps[tiles.rows] = 0.0

    settings: Sequence[Mapping[str, Any]] = (CLARABEL_SETTINGS, EQUILIBRATED_SETTINGS)

    def define(self) -> Definition:
        """Return the program written in CVXPY."""
        import cvxpy as cp

        count = len(self.costs)
        both, z = cp.Variable(2 * count), self.loads()
        v, tau = both[:count], both[count:]
        rows = self.rows(z, self.caps + self.tau @ tau)
        cones = cp.PowCone3D(v, np.ones(count), tau, 1.0 / self.tiles.moduli)
        small = cp.sum(cp.multiply(self.small, cp.square(z)))
        problem = cp.Problem(cp.Minimize(self.costs @ v + small), [*rows, tau <= 1.0, cones])
        return Definition(problem, (both, z), rows)

    def conic(self) -> ConicProgram:
        """Return the program in the solver's form: columns v, τ and z."""
        count = len(self.costs)
        front, loads, b = self.blocks(2 * count, below=4 * count)
        front[self.of_limits, count:] = -self.tau
        b[self.of_limits] += self.caps
        # τ ≤ 1, then of each tile the rows of (v, 1, τ)
        ones, cones = slice(len(b) - 4 * count, len(b) - 3 * count), len(b) - 3 * count
        front[ones, count:], b[ones] = np.eye(count), 1.0
        front[cones::3, :count], front[cones + 2 :: 3, count:] = -np.eye(count), -np.eye(count)
        b[cones + 1 :: 3] = 1.0
        P, q = np.zeros((2, 2 * count + self.size))
        q[:count], P[2 * count :] = self.costs, 2.0 * self.small
        powers = tuple((1.0 / self.tiles.moduli).tolist())
        return ConicProgram(P, q, (Columns.of(front), loads), b, len(self.G), powers=powers)

    def equilibrated(self) -> Hazard:
        """Return the program with Clarabel's own options from the start."""
        other = Hazard(self.data, self.cap, self.tiles)
        other.settings = (EQUILIBRATED_SETTINGS,)
        return other

    def value(self, loads: Sequence[Array]) -> float:
        """Return the objective at loads y of each hand, shapes (m,) [N]."""
        z = np.concatenate(loads) / self.data.rows.unit
        uses = self.tiles.uses(self.L @ z + self.l0)
        return float(self.tiles.terms(uses).sum() + self.small @ z**2)

    def slopes(self, loads: Sequence[Array]) -> Array:
        """Return a subgradient of `value` in the scaled loads z, shape (M,).

        Where several rows of a tile have its use, that of the first of them.
        """
        z = np.concatenate(loads) / self.data.rows.unit
        used = self.L @ z + self.l0
        uses = self.tiles.uses(used)
        rows, tile_of = self.tiles.rows, self.tiles.tile_of
        most = used[rows] == uses[tile_of]
        tiles, first = np.unique(tile_of[most], return_index=True)
        steep = self.tiles.slopes(uses)[tiles]
        return np.asarray(steep @ self.L[rows[most][first]] + 2.0 * self.small * z)

    def solve(self) -> Outcome:
        """Solve the program; ``value`` is the objective at the loads themselves."""
        outcome = self.run()[0]
        return replace(outcome, value=self.value(outcome.loads)) if outcome.solved else outcome
