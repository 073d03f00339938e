"""Equilibria of a body whose limbs pull hands on rock toward given pose targets.

Each limb pulls its wrist from its twist x_i toward the target t_i, with the stiffness K. Targets
are fixed in the body, which moves by the twist b (of B about its origin). Wrists and body are at
rest where

    w_i(x_i) = K (t_i + A_iᵀ b − x_i),    −Σ A_i w_i(x_i) = W,

with w_i the wrench of hand i on its rock at the twist x_i, A_i = Ad(B←H), and the body wrench W.
The hands are nonlinear; in b the equations are of first order. They give b for any x, and Newton's
method finds x, of many samples at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array
from hand_models.compliance import CompliantHands, FloatingWrist, complex_steps, slopes
from hand_models.wrench_spaces import WRENCH_SCALE
from planner import deadline

__all__ = ["NEWTON_SETTINGS", "Equilibria", "LimbPull", "equilibria"]


@dataclass(frozen=True, slots=True)
class EquilibriumSettings:
    """Tolerance and budget of Newton's method for equilibria."""

    residual: float = 1e-6
    """Largest norm of the residuals of all wrists that counts as zero: forces, and moments over
    0.1 m [N]. Rounding of limbs of 1e9 N/m is about 1e-8 N."""
    evaluations: int = 80  # of the hands, at most; 5 to 7 are the rule
    least_share: float = 1e-4  # of a Newton step, with which the residuals must decrease
    late: str = "all displaced hands were in equilibrium"  # what a deadline may leave unfinished


NEWTON_SETTINGS: Final = EquilibriumSettings()


@dataclass(frozen=True, eq=False)
class LimbPull:
    """Springs with which the limbs of a body pull n wrists toward their targets.

    Attributes
    ----------
    stiffness : ndarray, shape (6,)
        K of each limb along and about the axes of its hand frame H [N/m, N·m/rad].
    targets : ndarray, shape (n, 6)
        Pose target of each wrist, a twist of H from its pose at rest [m, rad].
    transports : ndarray, shape (n, 6, 6)
        Ad(B←H), which carries wrenches of each hand to the body frame B.
    wrench : ndarray, shape (6,)
        Body wrench, in B [N, N·m].
    """

    stiffness: Array
    targets: Array
    transports: Array
    wrench: Array

    @property
    def compliance(self) -> Array:
        """Twist of the body for each unit of body wrench while no wrist moves, shape (6, 6)."""
        A = self.transports
        return np.asarray(np.linalg.inv((A @ (self.stiffness[:, None] * A.swapaxes(1, 2))).sum(0)))

    def pulls(self, twists: Array) -> tuple[Array, Array]:
        """Return what limbs exert on their hands where the body is in balance on them.

        Parameters
        ----------
        twists : ndarray, shape (s, n, 6)
            Twists of the wrists of s samples [m, rad].

        Returns
        -------
        pulls : ndarray, shape (s, n, 6)
            Wrench of each limb on its hand, in H [N, N·m].
        body : ndarray, shape (s, 6)
            Twist of the body frame B from its given pose [m, rad].
        """
        A, short = self.transports, self.targets - twists
        missing = self.wrench + np.einsum("nij,snj->si", A, self.stiffness * short)
        body = -missing @ self.compliance.T
        return self.stiffness * (short + np.einsum("nji,sj->sni", A, body)), body

    @property
    def coupling(self) -> Array:
        """Derivative of the pulls by the wrists' twists, shape (6 n, 6 n)."""
        n, K = len(self.targets), self.stiffness
        rows = (self.transports * K).swapaxes(0, 1).reshape(6, 6 * n)
        return np.asarray(rows.T @ self.compliance @ rows - np.diag(np.tile(K, n)))


class Equilibria(NamedTuple):
    """Equilibria of s samples of n hands.

    Attributes
    ----------
    twists : ndarray, shape (s, n, 6)
        Twist of each wrist from its pose at rest, in H [m, rad].
    body : ndarray, shape (s, 6)
        Twist of the body frame B from its given pose [m, rad].
    found : ndarray of bool, shape (s,)
        Whether wrists and body are in equilibrium there.
    least_stiffness : ndarray, shape (s,)
        Least eigenvalue of the symmetric part of the stiffness of all wrists, on their rock and on
        limbs of a body that is free; rotations over 0.1 m [N/m]. The equilibrium is stable where it
        is positive.
    """

    twists: Array
    body: Array
    found: NDArray[np.bool_]
    least_stiffness: Array


def equilibria(
    samples: Sequence[Sequence[FloatingWrist]],
    tensions: Array,
    pull: LimbPull,
    start: Array,
) -> Equilibria:
    """Find the equilibrium of each sample by Newton's method, with steps that shrink as needed.

    Parameters
    ----------
    samples : sequence of sequence of FloatingWrist, shape (s, n)
        Hands of each sample, at rest on their rock.
    tensions : ndarray, shape (n, 4)
        Tension that each motor of a compliant hand keeps, or at which it stands still [N].
    pull : LimbPull
    start : ndarray, shape (n, 6)
        Twists at which the search begins [m, rad].

    Raises
    ------
    DeadlineError
        If the deadline passes before the search ends.
    """
    hands, count, n = _Hands(samples, tensions), len(samples), len(start)
    scale, coupling = np.tile(WRENCH_SCALE, n), pull.coupling
    twists = np.broadcast_to(start, (count, n, 6)).copy()
    steps, shares = np.zeros_like(twists), np.ones(count)
    least = np.full(count, np.inf)
    stiffness = np.zeros((count, 6 * n, 6 * n))
    for _ in range(NEWTON_SETTINGS.evaluations):
        deadline.check(NEWTON_SETTINGS.late)
        there = twists + shares[:, None, None] * steps
        wrenches, slope = hands.at(there)
        off = ((wrenches - pull.pulls(there)[0]).reshape(count, -1)) * scale
        # where a phalanx loses its rock nothing is known
        sizes = np.nan_to_num(np.linalg.norm(off, axis=1), nan=np.inf)
        better = sizes < (1.0 - NEWTON_SETTINGS.least_share * shares) * least
        twists[better], least[better] = there[better], sizes[better]
        for k in np.flatnonzero(better):
            whole = -coupling
            for h, own in enumerate(slope[k]):
                whole[6 * h : 6 * h + 6, 6 * h : 6 * h + 6] += own
            stiffness[k] = scale[:, None] * whole * scale
            steps[k] = -(scale * np.linalg.lstsq(stiffness[k], off[k])[0]).reshape(n, 6)
        shares = np.where(better, 1.0, 0.5 * shares)
        ended = (least <= NEWTON_SETTINGS.residual) | (shares < NEWTON_SETTINGS.least_share)
        if ended.all():
            break
        steps[ended] = 0.0
    symmetric = stiffness + stiffness.swapaxes(1, 2)
    return Equilibria(
        twists,
        pull.pulls(twists)[1],
        least <= NEWTON_SETTINGS.residual,
        np.asarray(np.linalg.eigvalsh(0.5 * symmetric)[:, 0]),
    )


class _Hands:
    """Hands of all samples, whose wrenches are computed in one call for each way of the motors."""

    def __init__(self, samples: Sequence[Sequence[FloatingWrist]], tensions: Array) -> None:
        self._groups = []
        for driven in (False, True):
            own = [
                (k, h)
                for k, wrists in enumerate(samples)
                for h, wrist in enumerate(wrists)
                if wrist.driven is driven
            ]
            if own:
                together = CompliantHands([samples[k][h].hand for k, h in own])
                closed = [np.broadcast_to(tensions[h], (6, tensions.shape[1])) for _, h in own]
                self._groups.append((own, together, closed))

    def at(self, twists: Array) -> tuple[Array, Array]:
        """Return wrenches (s, n, 6) on the rock and their slopes (s, n, 6, 6) at twists."""
        wrenches, slope = np.zeros(twists.shape), np.zeros((*twists.shape, 6))
        for own, together, closed in self._groups:
            stepped = [complex_steps(twists[at]) for at in own]
            found = together.loads(stepped, closed)
            for at, loads in zip(own, found, strict=True):
                of_steps = loads.wrenches
                wrenches[at], slope[at] = of_steps[0].real, slopes(of_steps)
        return wrenches, slope
