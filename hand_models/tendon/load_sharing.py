"""Load sharing of a palm: N tiles on one tendon with friction (Eqs. 1–3, 18–19).

The palm frame travels x; tile i, on a contact of stiffness k_i and preload springs k_p, travels
x_i and lags by the slip δ_i = x − x_i. With tensions A_i and B_i of its strands, before and after
its pulley, the tiles obey

    A_i + B_i + k_p δ_i = k_i x_i            (balance, Eq. 18)
    Σ δ_i = 0                                (the tendon's length)

and the tendon passes tile i's pulley by m_i = 2 Σ_{j<i} δ_j + δ_i and the palm's pulley between
tiles i and i + 1 by n_i = 2 Σ_{j≤i} δ_j, toward its first strand. In a change of load the tension s
before a pulley and s′ after it obey (Eq. 19)

    s′ = ρ s  if the travel grows,  s = ρ s′  if it shrinks,  between the two if the tendon sticks,

with ρ = (1 − μ/2)/(1 + μ/2), at the tiles' pulleys with one μ, at the palm's with another, which
Eq. 18 leaves out (μ = 0: A_{i+1} = B_i). The directions are unknown: each change of load is a
linear complementarity problem. They are those of the *increments* of m and n, so a palm remembers
where its tiles were; from rest everything is proportional to x.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Final

import numpy as np

from hand_models.base import Array, Indices, InvalidInputError
from hand_models.tendon.complementarity import stick_slip

__all__ = ["PalmSharing", "PalmState", "PalmTendon", "share_load", "shear_capacity"]

FRICTIONLESS: Final = 1e-8
"""A coefficient of friction that is as good as none: such pulleys are left out."""


@dataclass(frozen=True, eq=False)
class PalmState:
    """A loaded palm.

    Attributes
    ----------
    travel : float
        x, of the palm's frame [m].
    tile_travel : ndarray, shape (N,)
        x_i [m].
    tile_loads : ndarray, shape (N,)
        k_i x_i [N].
    strands : ndarray, shape (N, 2)
        Tensions A_i and B_i [N]. Where neighbouring pulleys stick, the loads leave them open, and
        these are some that fit.
    """

    travel: float
    tile_travel: Array
    tile_loads: Array
    strands: Array

    @cached_property
    def slip(self) -> Array:
        """δ_i = x − x_i, shape (N,) [m]."""
        return self.travel - self.tile_travel


@dataclass(frozen=True, eq=False)
class PalmSharing:
    """How the tiles of a palm share its load from rest, per unit of palm travel.

    Attributes
    ----------
    tile_stiffness : ndarray, shape (N,)
        Load of each tile, k_i x_i / x [N/m].
    tile_travel : ndarray, shape (N,)
        x_i / x.
    strand_stiffness : ndarray, shape (N, 2)
        Tensions before and after each tile's pulley, A_i / x and B_i / x [N/m].
    """

    tile_stiffness: Array
    tile_travel: Array
    strand_stiffness: Array

    def capacity(self, tile_limits: Sequence[float] | Array) -> float:
        """Return the palm's load when its first tile reaches its limit [N]."""
        limits = np.asarray(tile_limits, dtype=float)
        return float(np.min(limits / self.tile_stiffness) * self.tile_stiffness.sum())


@dataclass(frozen=True)
class PalmTendon:
    """Tiles on one tendon.

    Attributes
    ----------
    contact_stiffness : tuple of float, length N
        k_i in the tendon's order [N/m].
    spring_stiffness : float
        k_p [N/m].
    friction : float
        μ between the strands of a tile, in [0, 2).
    own_friction : float
        The same at the palm's N − 1 pulleys between the tiles.

    Raises
    ------
    InvalidInputError
        If a stiffness is not above zero, k_p is negative, or a friction is out of range.
    """

    contact_stiffness: tuple[float, ...]
    spring_stiffness: float
    friction: float
    own_friction: float = 0.0

    def __post_init__(self) -> None:
        k = self.contact_stiffness
        if not k or not all(math.isfinite(k_i) and k_i > 0.0 for k_i in k):
            raise InvalidInputError(
                f"stiffnesses above 0 N/m are needed, got {list(k)}", field="contact_stiffness"
            )
        if not (math.isfinite(self.spring_stiffness) and self.spring_stiffness >= 0.0):
            raise InvalidInputError(
                f"must not be negative, got {self.spring_stiffness:g}", field="spring_stiffness"
            )
        for field in ("friction", "own_friction"):
            if not 0.0 <= getattr(self, field) < 2.0:
                raise InvalidInputError(
                    f"must be in [0, 2), got {getattr(self, field):g}", field=field
                )

    def rest(self) -> PalmState:
        """Return the palm without load."""
        n = len(self.contact_stiffness)
        return PalmState(0.0, np.zeros(n), np.zeros(n), np.zeros((n, 2)))

    def advance(self, state: PalmState, increment: float) -> PalmState:
        """Move the palm, and let its tiles follow.

        One complementarity problem, exact for a step at whose end every pulley that slipped on the
        way still slips; from rest that is any step forward.

        Parameters
        ----------
        state : PalmState
            From `rest` or an earlier increment of this palm.
        increment : float
            Of the palm's travel, of either sign [m].

        Returns
        -------
        PalmState

        Raises
        ------
        InvalidInputError
            If the palm would be pushed back beyond where it began: nothing is loaded there.
        SolverError
            If the complementarity problem ends without a solution.
        """
        travel = state.travel + increment
        if not (math.isfinite(travel) and travel >= 0.0):
            raise InvalidInputError(
                f"must keep the palm's travel at 0 m or above, leads to {travel:g}",
                field="increment",
            )
        return self._equations.solve(travel, state.slip)

    @cached_property
    def _equations(self) -> _Equations:
        return _Equations(self)


class _Equations:
    """A palm's stick–slip problem, all of it that does not depend on the load.

    Tensions are in units of the mean contact stiffness (so they are lengths). The unknowns are the
    a of `complementarity`, one for each pulley with friction, s′ = ρ s + ω a with ω = 1/ρ − ρ. They
    give all the strands s = G a + g s_0, with s_0 by the tendon's length, and from these the slips
    δ = (k x − A − B)/(k + k_p) and the travels V (δ − δ_before).
    """

    def __init__(self, palm: PalmTendon) -> None:
        self.k = np.array(palm.contact_stiffness)
        self.scale = self.k.mean()
        kappa = self.k / self.scale
        self.compliance = 1.0 / (kappa + palm.spring_stiffness / self.scale)
        self.pull = self.compliance * kappa
        ratio, self.travel_of_slip, self.strands = _thread(palm)
        # G and g: products of the ratios between two strands
        logs = np.concatenate([[0.0], np.cumsum(np.log(ratio))])
        decay = np.tril(np.exp(np.minimum(logs[:, None] - logs[None, :], 0.0)))
        by_first, by_a = decay[:, 0], decay[:, 1:] * (1.0 / ratio - ratio)
        weight = np.zeros(len(logs))
        np.add.at(weight, self.strands, self.compliance[:, None])
        self.by_load = by_first / (weight @ by_first)
        self.by_a = by_a - np.outer(self.by_load, weight @ by_a)
        self.travel_by_a = -self.travel_of_slip @ (self.compliance[:, None] * self._pair(self.by_a))

    def _pair(self, strands: Array) -> Array:
        """Return A + B of every tile."""
        return np.asarray(strands[self.strands[:, 0]] + strands[self.strands[:, 1]])

    def solve(self, travel: float, slip_before: Array) -> PalmState:
        """Return the palm's state at a travel, from where its tiles lagged before."""
        constant = self.by_load * (self.pull.sum() * travel)
        slip = self.pull * travel - self.compliance * self._pair(constant)
        a = stick_slip(
            (self.travel_by_a, self.travel_of_slip @ (slip - slip_before)),
            (self.by_a[:-1], constant[:-1]),
        )
        strands = self.by_a @ a + constant
        tiles = travel * (1.0 - self.pull) + self.compliance * self._pair(strands)
        return PalmState(travel, tiles, self.k * tiles, self.scale * strands[self.strands])


def _thread(palm: PalmTendon) -> tuple[Array, Array, Indices]:
    """Return how the tendon runs over the pulleys that have friction.

    Returns
    -------
    ratio : ndarray, shape (P,)
        ρ of each pulley (Eq. 19).
    travel_of_slip : ndarray, shape (P, N)
        V, the tendon's travels past them by slip.
    strands : ndarray of int, shape (N, 2)
        Which of the P + 1 strands lie before and after each tile's pulley.
    """
    n = len(palm.contact_stiffness)
    travels = np.empty((2 * n - 1, n))
    travels[::2] = 2.0 * np.tril(np.ones((n, n))) - np.eye(n)
    travels[1::2] = 2.0 * np.tril(np.ones((n - 1, n)))
    friction = np.full(2 * n - 1, palm.friction, dtype=float)
    friction[1::2] = palm.own_friction
    rubs = friction > FRICTIONLESS
    after = np.cumsum(rubs)
    strands = np.stack([np.concatenate([[0], after[:-1]])[::2], after[::2]], axis=1)
    half = friction[rubs] / 2.0
    return (1.0 - half) / (1.0 + half), travels[rubs], strands


def share_load(
    contact_stiffness: Sequence[float],
    spring_stiffness: float,
    friction: float,
    own_friction: float = 0.0,
) -> PalmSharing:
    """Solve the load sharing of N tiles from rest.

    Parameters
    ----------
    contact_stiffness, spring_stiffness, friction, own_friction
        As of `PalmTendon`.

    Returns
    -------
    PalmSharing

    Raises
    ------
    InvalidInputError
        As of `PalmTendon`.
    SolverError
        If the complementarity problem ends without a solution.
    """
    stiffness = tuple(float(k) for k in contact_stiffness)
    palm = PalmTendon(stiffness, spring_stiffness, friction, own_friction)
    state = palm.advance(palm.rest(), 1.0)
    return PalmSharing(state.tile_loads, state.tile_travel, state.strands)


@lru_cache(maxsize=4096)
def shear_capacity(
    contact_stiffness: tuple[float, ...],
    spring_stiffness: float,
    friction: float,
    tile_limit: float,
    own_friction: float = 0.0,
) -> float:
    """Return the shear that a palm carries when its first tile reaches ``tile_limit`` [N].

    Parameters as of `share_load`, hashable; the last few thousand answers are kept.
    """
    sharing = share_load(contact_stiffness, spring_stiffness, friction, own_friction)
    return sharing.capacity(np.full(len(contact_stiffness), tile_limit))
